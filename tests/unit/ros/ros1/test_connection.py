"""Headers and frames of TCPROS."""

import asyncio
import io
import itertools
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import Intake
from vrx_mj.ros.ros1.connection import Peer, decode_header, encode_header, with_length

NAMES = st.text(min_size=1, max_size=20).filter(lambda name: "=" not in name)


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


class Transport(SimpleNamespace):
    """In place of a connection's: what is written to it, and how often it was ended."""

    def __init__(self):
        super().__init__(written=b"", ended=0, set_write_buffer_limits=lambda _most: None)

    def abort(self):
        self.ended += 1


def peer_of(intake, host="127.0.0.1", drain=None):
    """A peer, what feeds its stream and what it has written; `drain` waits until that is taken."""
    transport = Transport()

    async def at_once():
        return None

    def write(data):
        transport.written += bytes(data)

    writer = SimpleNamespace(
        transport=transport,
        write=write,
        drain=drain or at_once,
        get_extra_info={"peername": (host, 1), "socket": SimpleNamespace(setsockopt=lambda *_: None)}.get,
    )
    reader = asyncio.StreamReader()
    return Peer(reader, writer, intake), reader, transport


@given(st.lists(st.binary(max_size=40), max_size=10), st.lists(st.integers(1, 30), min_size=1))
def test_frames_come_out_however_the_stream_is_cut(bodies, sizes):
    stream, intake = io.BytesIO(b"".join(map(with_length, bodies))), Intake(1000)

    async def run():
        peer, reader, _ = peer_of(intake)
        taking = asyncio.ensure_future(frames(peer, len(bodies)))
        cuts = itertools.cycle(sizes)
        while not taking.done():
            reader.feed_data(stream.read(next(cuts)))
            await asyncio.sleep(0)
        return await taking

    assert asyncio.run(run()) == bodies
    assert intake.used == 0


async def frames(peer, count):
    return [await peer.frame(40) for _ in range(count)]


def taken(data, most=1000):
    """The frame in some bytes."""

    async def run():
        peer, reader, _ = peer_of(Intake(most))
        reader.feed_data(data)
        reader.feed_eof()
        return await peer.frame(40)

    return asyncio.run(run())


def test_a_frame_is_not_waited_for_when_it_would_be_too_large():
    with pytest.raises(CommandError) as caught:
        taken(b"\x29\0\0\0")
    assert str(caught.value) == "a frame of 41 bytes, where at most 40 are allowed"


def test_a_frame_may_be_as_large_as_the_largest_and_has_to_be_whole():
    assert taken(with_length(b"x" * 40)) == b"x" * 40
    with pytest.raises(EOFError):
        taken(with_length(b"x" * 40)[:-1])


def test_all_that_wait_for_frames_share_what_they_may_hold():
    async def run():
        intake = Intake(100)
        one, first, transport = peer_of(intake)
        other, second, _ = peer_of(intake)
        first.feed_data(b"\x50\0\0\0" + b"x" * 76)
        waiting = asyncio.ensure_future(one.frame(90))
        await asyncio.sleep(0)
        assert intake.used == 76
        second.feed_data(b"\x70\0\0\0" + b"x" * 40)
        taking = asyncio.ensure_future(other.frame(200))
        await asyncio.sleep(0)
        assert (transport.ended, intake.used) == (1, 40)  # who came first, and is not done yet
        second.feed_data(b"x" * 61)
        with pytest.raises(CommandError) as caught:
            await taking
        assert str(caught.value) == "more than 100 bytes of incomplete messages"
        waiting.cancel()
        one.close()
        assert intake.used == 0

    asyncio.run(run())


def test_a_frame_that_does_not_go_on_ends_the_connection(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.ros1.connection.STALL_TIMEOUT", 0.01)

    async def run():
        peer, reader, _ = peer_of(Intake(1000))
        reader.feed_data(b"\x09\0\0\0x")
        with pytest.raises(ConnectionAbortedError):
            await peer.frame(40)
        with pytest.raises(TimeoutError):
            await peer.frame(40, 0.01)

    asyncio.run(run())


def test_what_is_not_taken_counts_until_it_is():
    intake, held = Intake(1 << 20), []

    async def drain():
        held.append(intake.used)

    async def run():
        peer, _, transport = peer_of(intake, drain=drain)
        await peer.send(b"x" * 150_000)
        return transport.written

    assert asyncio.run(run()) == b"x" * 150_000
    assert (held, intake.used) == ([150_000, 150_000 - (1 << 16), 150_000 - (2 << 16)], 0)
