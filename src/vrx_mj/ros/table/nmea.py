"""What boats' instruments write and their AIS receivers hear, as messages of nmea_msgs."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from vrx_mj.nmea import Instruments
from vrx_mj.nmea.ais import PERIOD
from vrx_mj.nmea.instruments import RATE
from vrx_mj.nmea.sentences import Sentence
from vrx_mj.ros.interface import BOTH, Output
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.table.host import header

SENTENCE = "nmea_msgs/Sentence"


def nmea_topics(boat: str) -> tuple[str, str]:
    """Topics of a boat's instruments and of what its AIS receiver hears."""
    return f"/{boat}/nmea_sentence", f"/{boat}/ais/nmea_sentence"


def nmea_outputs(instruments: Instruments, boat: str) -> Iterator[Output]:
    """These topics, a message for each sentence."""
    made = (instruments.sentences, RATE), (instruments.reports, 1.0 / PERIOD)
    for name, (ask, rate) in zip(nmea_topics(boat), made, strict=True):
        yield Output(name, SENTENCE, partial(_messages, ask, boat), rate, dialects=BOTH, recorded="nowhere")


def _messages(ask: Callable[[str], Sequence[Sentence]], boat: str) -> list[Message]:
    return [new(SENTENCE, header=header(one.time, one.frame or boat), sentence=one.text) for one in ask(boat)]
