"""NMEA 0183 for chart plotters: a boat's sentences by UDP, to every client of a TCP port, and as topics of ROS."""

import contextlib
import socket
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from vrx_mj.errors import NetworkError
from vrx_mj.nmea import Instruments
from vrx_mj.nmea.ais import PERIOD
from vrx_mj.nmea.instruments import RATE
from vrx_mj.nmea.sentences import Sentence
from vrx_mj.ros.interface import BOTH, Output, RosInterface, Sent, Traffic
from vrx_mj.ros.limits import Counts, Outbox
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.network import is_wildcard, listening_addresses, refusal
from vrx_mj.ros.table.host import header

SENTENCE = "nmea_msgs/Sentence"
_MOST_CLIENTS = 64
MOST_SENTENCES = 1000
"""Sentences that wait for a client that does not read, at most: the oldest go first."""
_HELD = 1 << 14
"""Bytes that wait in a connection itself, about."""
_EVERYBODY = "255.255.255.255"
"""Where UDP goes if all networks are listened on."""


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


class Nmea:
    """A `Transport` (see `vrx_mj.ros.interface`) of one boat's sentences, without a thread: no socket of it blocks."""

    title = "NMEA"

    def __init__(self, boat: str, *, port: int, host: str = "127.0.0.1") -> None:
        """Serve the sentences of a boat once `start` is called; port 0 is any free one."""
        self._boat, self._host, self.port, self._counts = boat, host, port, Counts()
        self._clients: dict[socket.socket, Outbox[bytes]] = {}
        self._rests: dict[socket.socket, bytes] = {}
        """What is left of the line that each client is being sent."""
        self._opened = contextlib.ExitStack()
        self.subscribed_topics: frozenset[str] = frozenset()
        """All of its topics at any time, since UDP has no subscribers."""

    def start(self) -> Sequence[str]:
        """Open it; returns a line with its address. NetworkError: it cannot be opened, and why."""
        family = socket.AF_INET6 if ":" in self._host else socket.AF_INET
        try:
            self._tcp = self._opened.enter_context(
                socket.create_server((listening_addresses(self._host)[0], self.port), family=family)
            )
            self._udp = self._opened.enter_context(socket.socket(family, socket.SOCK_DGRAM))
        except (OSError, OverflowError) as error:
            raise NetworkError(refusal("NMEA", self._host, self.port, error)) from error
        self._udp.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        for opened in (self._tcp, self._udp):
            opened.setblocking(False)
        here, self.port = self._tcp.getsockname()[:2]
        self._to = _EVERYBODY if is_wildcard(self._host) else here
        return [f"NMEA of {self._boat}: TCP port {self.port} of {self._host}, UDP to port {self.port} of {self._to}"]

    def offer(self, table: RosInterface) -> None:
        """Send the sentences of this table from now on."""
        self.subscribed_topics = frozenset(nmea_topics(self._boat)) & table.outputs.keys()

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send the sentences among these messages."""
        self._accept()
        for sent in batch:
            if sent.output.name in self.subscribed_topics:
                line = f"{sent.message.sentence}\r\n".encode()
                with contextlib.suppress(OSError):  # nobody listens, or there is no network
                    self._counts.sent += self._udp.sendto(line, (self._to, self.port))
                for outbox in self._clients.values():
                    outbox.push(line, len(line))
        for client in list(self._clients):
            self._flush(client)

    def log(self, level: str, text: str) -> None:
        """A line for people, of whom there are none here."""

    @property
    def traffic(self) -> Traffic:
        """Traffic since the start."""
        return Traffic(len(self._clients), self._counts.sent, self._counts.dropped)

    def close(self) -> None:
        """Close every connection."""
        for client in self._clients:
            client.close()
        self._opened.close()

    def _accept(self) -> None:
        """Take new clients. What they send is never read: once the system holds enough of it, they have to wait."""
        with contextlib.suppress(OSError):  # nobody waits
            while len(self._clients) < _MOST_CLIENTS:
                client, _ = self._tcp.accept()
                client.setblocking(False)
                client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _HELD)
                self._clients[client] = Outbox(self._counts, MOST_SENTENCES, lambda: None)

    def _flush(self, client: socket.socket) -> None:
        """Send a client what its connection takes; one that has gone is forgotten."""
        try:
            while line := self._rests.get(client) or self._clients[client].pop():
                self._rests[client] = line
                sent = client.send(line)
                self._rests[client] = line[sent:]
                self._counts.sent += sent
        except BlockingIOError:  # it does not read
            pass
        except OSError:  # it has gone
            self._clients.pop(client).forget()
            self._rests.pop(client)
            client.close()
