"""Topics that we publish and services that we provide over TCPROS."""

import asyncio
import contextlib
import itertools
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.errors import CommandError
from vrx_mj.ros.graph import Graph, Service
from vrx_mj.ros.limits import Counts, Outbox
from vrx_mj.ros.messages import (
    Message,
    decode,
    definition,
    encode,
    full_name,
    full_text,
    is_known,
    md5sum,
    service_md5sum,
    typestore,
)
from vrx_mj.ros.parameters import LONGEST
from vrx_mj.ros.ros1.connection import LARGEST_CALL, Peer, with_length

_HIGH_WATER = 1 << 18
"""Bytes that asyncio holds of a connection before its outbox fills."""
_MOST_FRAMES = 256
"""Messages that wait for one subscriber, at most."""
_PIECE = 1 << 18
"""Bytes that are given to asyncio at one time: it copies what it cannot send."""
_MOST_IDLE_TALK = 1 << 16
"""Bytes that a subscriber may send after its header, of which nothing is used."""
_MOST_MET = 1000
"""Names of subscribers that are remembered."""
_LENGTH = struct.Struct("<I")


class Stream:
    """What the publications of a node have in common."""

    def __init__(self, node: str) -> None:
        self.node = node
        self.counts = Counts()
        self.numbers = itertools.count(1)
        """Numbers of connections."""


class Publication:
    """A topic of the nodes of this process, and its subscribers."""

    def __init__(
        self,
        stream: Stream,
        name: str,
        type_name: str,
        *,
        latched: bool = False,
        last: Callable[[], Sequence[Message]] = tuple,
    ) -> None:
        """`last`: gives the messages that new subscribers get."""
        self.stream, self.name, self.type, self.latched = stream, name, type_name, latched
        self._latest = last
        self.readers: set[Reader] = set()
        self.met: set[str] = set()
        """Nodes that have ever connected."""
        self._sequence = 0
        self._kind: Any = typestore().get_msgdef(full_name(type_name))
        self._numbered = definition(type_name).startswith(("Header header\n", "std_msgs/Header header\n"))

    def refusal(self, header: Mapping[str, str]) -> str | None:
        """Why somebody cannot subscribe."""
        if len(self.met) >= _MOST_MET:
            self.met.clear()
        self.met.add(header["callerid"][:LONGEST])
        wanted, own = header["md5sum"], md5sum(self.type)
        kind = header.get("type", "*")
        if kind not in {"*", self.type}:
            return f"topic types do not match: [{kind}] vs. [{self.type}]"
        if wanted in {"*", own}:
            return None
        return (
            f"Client [{header['callerid']}] wants topic [{self.name}] to have datatype/md5sum "
            f"[{kind}/{wanted}], but our version has [{self.type}/{own}]. Dropping connection."
        )

    def reply(self) -> dict[str, str]:
        """Our own header."""
        return {
            "callerid": self.stream.node,
            "latching": "1" if self.latched else "0",
            "md5sum": md5sum(self.type),
            "message_definition": full_text(self.type),
            "topic": self.name,
            "type": self.type,
        }

    def join(self, reader: "Reader") -> None:
        """Add a subscriber, to whom our header has been sent."""
        self.readers.add(reader)
        for message in self._latest():
            with contextlib.suppress(Exception):  # whatever rosbags raises of one of another type
                reader.send(self._frame(message))

    def send(self, message: Message) -> None:
        """Send a message to all who are there.

        Raises:
            Exception: whatever rosbags raises of a message of another type.
        """
        frame = self._frame(message) if self.readers else bytearray()
        for reader in self.readers:
            reader.send(frame)

    def close(self) -> None:
        """Close all connections."""
        for reader in self.readers:
            reader.peer.close()

    def _frame(self, message: Message) -> bytearray:
        """A message with its length before it, written once and without copies: pictures have some MB."""
        size = self._kind.getsize_ros1(0, message, typestore())
        frame = bytearray(_LENGTH.size + size)
        _LENGTH.pack_into(frame, 0, size)
        end = self._kind.serialize_ros1(memoryview(frame), _LENGTH.size, message, typestore())
        assert end == len(frame)
        if self._numbered:  # as roscpp and rospy do: messages are numbered by who publishes them
            _LENGTH.pack_into(frame, _LENGTH.size, self._sequence & 0xFFFFFFFF)
            self._sequence += 1
        return frame


class Reader:
    """One who has subscribed. What it does not take in time waits in an outbox, and the oldest of that goes first."""

    def __init__(self, publication: Publication, peer: Peer, node: str) -> None:
        self.publication, self.peer, self.node = publication, peer, node
        self.number = next(publication.stream.numbers)
        self.sent = self.messages = 0
        self._outbox: Outbox[bytearray] = Outbox(publication.stream.counts, _MOST_FRAMES, self._write)
        self._rest = memoryview(b"")
        """What asyncio has not been given yet of the message that is being sent."""
        self._full = asyncio.Event()
        peer.writer.transport.set_write_buffer_limits(high=_HIGH_WATER)

    def send(self, frame: bytearray) -> None:
        """Send a message now or later."""
        self._outbox.push(frame, len(frame))

    async def stay(self) -> None:
        """Send until it leaves, or talks: nothing is expected of it."""
        writing = asyncio.get_running_loop().create_task(self._write_rest())
        try:
            await self.peer.reader.readexactly(_MOST_IDLE_TALK)
        finally:
            writing.cancel()
            self.publication.readers.discard(self)
            self._outbox.forget()

    async def _write_rest(self) -> None:
        """Go on when the connection takes more."""
        with contextlib.suppress(OSError):
            while True:
                await self._full.wait()
                self._full.clear()
                await self.peer.writer.drain()
                self._write()

    def _write(self) -> None:
        """Send what there is until the connection is full."""
        transport = self.peer.writer.transport
        while not transport.is_closing():
            if transport.get_write_buffer_size() > _HIGH_WATER:
                self._full.set()
                return
            if not self._rest:
                frame = self._outbox.pop()
                if frame is None:
                    return
                self._rest = memoryview(frame)
                self.sent += len(frame)
                self.messages += 1
                self.publication.stream.counts.sent += len(frame)
            piece, self._rest = self._rest[:_PIECE], self._rest[_PIECE:]
            transport.write(piece)


_REQUEST_TIMEOUT = 10.0
"""Wall time in which the request of one who calls once must begin to come [s]."""


@dataclass(eq=False)
class Provided:
    """A service of a node of this process, and its callers."""

    graph: Graph
    name: str
    service: Service
    callers: set[Peer] = field(default_factory=set)

    def refusal(self, header: Mapping[str, str]) -> str | None:
        """Why somebody cannot call it."""
        kind = self.service.type
        if not (is_known(f"{kind}Request") and is_known(f"{kind}Response")):
            return f"[{self.name}] has the type [{kind}], which only clients of rosbridge can call"
        wanted, own = header["md5sum"], service_md5sum(kind)
        if wanted in {"*", own}:
            return None
        return f"request from [{header['callerid']}]: md5sums do not match: [{wanted}] vs. [{own}]"

    def reply(self) -> dict[str, str]:
        """Our own header."""
        kind = self.service.type
        return {
            "callerid": self.service.node,
            "md5sum": service_md5sum(kind),
            "request_type": f"{kind}Request",
            "response_type": f"{kind}Response",
            "service": self.name,
            "type": kind,
        }

    async def answer(self, peer: Peer, node: str, *, persistent: bool) -> None:
        """Answer a node that calls once or again and again, one call at a time; errors are those of `Peer.frame`."""
        self.callers.add(peer)
        try:
            while True:
                asked = await peer.frame(LARGEST_CALL, None if persistent else _REQUEST_TIMEOUT)
                await peer.send(await self._answer(asked, node))
                if not persistent:
                    return
        finally:
            self.callers.discard(peer)

    def close(self) -> None:
        """Close all connections."""
        for caller in list(self.callers):
            caller.close()

    async def _answer(self, asked: bytes, node: str) -> bytes:
        """The bytes that answer a request."""
        try:
            request = decode(asked, f"{self.service.type}Request")
            response = await self.graph.call(self.service, request, node)
            return b"\x01" + with_length(encode(response, f"{self.service.type}Response"))
        except CommandError as error:
            why = str(error)
        except Exception as error:  # whatever rosbags raises of an invalid response
            why = str(CommandError(f"{self.name}: the response cannot be written: {error}"))
        return b"\x00" + with_length(why.encode("utf-8", "replace"))
