"""Headers and frames of TCPROS."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import Intake, Place
from vrx_mj.ros.ros1.connection import Splitter, decode_header, encode_header, with_length

NAMES = st.text(min_size=1, max_size=20).filter(lambda name: "=" not in name)

SOMEBODY = Place("127.0.0.1", list)


def test_a_header_is_lengths_and_fields():
    # The example of http://wiki.ros.org/ROS/Connection%20Header: 0x20 bytes of message_definition, and so on.
    assert encode_header({"topic": "/chatter", "x": ""}) == b"\x18\0\0\0\x0e\0\0\0topic=/chatter\x02\0\0\0x="


@given(st.dictionaries(NAMES, st.text(max_size=50), max_size=20))
def test_a_header_is_read_as_it_was_written(fields):
    assert decode_header(encode_header(fields)[4:]) == fields


@pytest.mark.parametrize(
    ("raw", "message"),
    [
        (b"\x01\0", "truncated header: it ends inside the length of a field, at byte 0"),
        (b"\x02\0\0\0a=\x09\0\0\0b=", "a header's field has 9 bytes where 2 are left"),
        (b"\x02\0\0\0ab", "a header's field has no '='"),
    ],
)
def test_what_is_no_header_is_named(raw, message):
    with pytest.raises(CommandError) as caught:
        decode_header(raw)
    assert str(caught.value) == message


@given(st.lists(st.binary(max_size=40), max_size=10), st.lists(st.integers(1, 30), min_size=1))
def test_frames_come_out_however_the_stream_is_cut(bodies, sizes):
    stream = b"".join(map(with_length, bodies))
    intake = Intake(1000)
    splitter = Splitter(40, intake, SOMEBODY)
    found = []
    while stream:
        piece, stream = stream[: sizes[0]], stream[sizes[0] :]
        sizes = sizes[1:] + sizes[:1]
        splitter.feed(piece)
        while (frame := splitter.take()) is not None:
            found.append(frame)
    assert found == bodies
    assert (len(splitter), intake.used) == (0, 0)


def test_a_frame_is_not_waited_for_when_it_would_be_too_large():
    splitter = Splitter(40, Intake(1000), SOMEBODY)
    splitter.feed(b"\x29\0\0\0")
    with pytest.raises(CommandError) as caught:
        splitter.take()
    assert str(caught.value) == "a frame of 41 bytes, where at most 40 are allowed"


def test_all_that_wait_for_frames_share_what_they_may_hold():
    ended = []
    intake = Intake(100)
    one = Splitter(90, intake, Place("127.0.0.1", lambda: ended.append("one")))
    other = Splitter(90, intake, Place("127.0.0.1", lambda: ended.append("other")))
    one.feed(b"\x50\0\0\0" + b"x" * 76)
    other.feed(b"\x50\0\0\0" + b"x" * 20)
    assert (ended, intake.used) == (["one"], 24)  # who came first, and is not done yet
    with pytest.raises(CommandError) as caught:
        other.feed(b"x" * 77)
    assert str(caught.value) == "more than 100 bytes of incomplete messages"
    one.rest()
    other.rest()
    assert intake.used == 0


def test_a_frame_may_be_as_large_as_the_largest():
    splitter = Splitter(40, Intake(1000), SOMEBODY)
    splitter.feed(with_length(b"x" * 40))
    assert splitter.take() == b"x" * 40
