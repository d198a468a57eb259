"""A topic that we publish over TCPROS, and those who have subscribed to it."""

import asyncio
import struct
from collections.abc import Mapping
from typing import Any

from vrx_mj.ros.messages import Message, definition, full_name, md5sum, typestore
from vrx_mj.ros.ros1.names import LONGEST
from vrx_mj.ros.ros1.outbox import Budget, Outbox

__all__ = ["Publication", "Reader", "Stream"]

HIGH_WATER = 1 << 18
"""Bytes that asyncio holds of a connection before its outbox fills."""
PIECE = 1 << 18
"""Bytes that are given to asyncio at one time: it copies what it cannot send."""
MOST_IDLE_TALK = 1 << 16
"""Bytes that a subscriber may say after its header; it has nothing to say."""
MOST_MET = 1000
"""Names of subscribers that are remembered."""
_LENGTH = struct.Struct("<I")


class Stream:
    """What the publications of a node have in common."""

    def __init__(self, node: str) -> None:
        self.node = node
        self.budget = Budget()
        self.sent = 0
        """[bytes]"""
        self.dropped = 0
        """Messages."""
        self.last_number = 0

    def number(self) -> int:
        """A new connection's."""
        self.last_number += 1
        return self.last_number


class Publication:
    """One topic."""

    def __init__(self, stream: Stream, name: str, type_name: str, *, latched: bool) -> None:
        self.stream, self.name, self.type, self.latched = stream, name, type_name, latched
        self.readers: set[Reader] = set()
        self.met: set[str] = set()
        """Nodes that have ever connected."""
        self._last: bytearray | None = None
        self._sequence = 0
        self._kind: Any = typestore().get_msgdef(full_name(type_name))
        self._numbered = definition(type_name).startswith(("Header header\n", "std_msgs/Header header\n"))

    def refusal(self, header: Mapping[str, str]) -> str | None:
        """Why somebody cannot subscribe."""
        missing = [field for field in ("topic", "md5sum", "callerid") if field not in header]
        if missing:
            return f"Missing required '{missing[0]}' field"
        if len(self.met) >= MOST_MET:
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
            "message_definition": definition(self.type),
            "topic": self.name,
            "type": self.type,
        }

    def join(self, reader: "Reader") -> None:
        """Add a subscriber, to whom our header has been sent."""
        self.readers.add(reader)
        if self._last is not None:
            reader.send(self._last)

    def send(self, message: Message) -> None:
        """Send a message to all who are there, and keep it if the topic is latched.

        Raises:
            Exception: whatever rosbags raises of a message that is none of this type.
        """
        if not self.readers and not self.latched:
            return
        frame = self._written(message)
        if self._numbered:  # as roscpp and rospy do: messages are numbered by who publishes them
            _LENGTH.pack_into(frame, _LENGTH.size, self._sequence & 0xFFFFFFFF)
            self._sequence += 1
        if self.latched:
            self._last = frame
        for reader in self.readers:
            reader.send(frame)

    def close(self) -> None:
        """Close all connections."""
        for reader in list(self.readers):
            reader.transport.abort()

    def _written(self, message: Message) -> bytearray:
        """A message with its length before it, written once and without copies: pictures have some MB."""
        size = self._kind.getsize_ros1(0, message, typestore())
        frame = bytearray(_LENGTH.size + size)
        _LENGTH.pack_into(frame, 0, size)
        end = self._kind.serialize_ros1(memoryview(frame), _LENGTH.size, message, typestore())
        assert end == len(frame)
        return frame


class Reader:
    """One who has subscribed. What it does not take in time waits in an outbox, and the oldest of that goes first."""

    def __init__(self, publication: Publication, transport: asyncio.Transport, header: Mapping[str, str]) -> None:
        self.publication, self.transport = publication, transport
        self.node = header["callerid"][:LONGEST]
        self.number = publication.stream.number()
        self.sent = self.messages = 0
        self._outbox = Outbox(publication.stream.budget)
        self._rest = memoryview(b"")
        """What asyncio has not been given yet of the message that is being sent."""
        self._blocked = False
        self._talk = 0
        transport.set_write_buffer_limits(high=HIGH_WATER)

    @property
    def dropped(self) -> int:
        """Messages that it did not get."""
        return self._outbox.dropped

    @property
    def waiting(self) -> int:
        """Bytes that wait for it."""
        return self._outbox.bytes

    def send(self, frame: bytearray) -> None:
        """Send a message now or later."""
        if self._blocked:
            self.publication.stream.dropped += self._outbox.push(frame)
        elif len(frame) > PIECE:
            self._begin(frame)
            self._write()
        elif not self.transport.is_closing():
            self._count(frame)
            self.transport.write(frame)

    def received(self, data: bytes) -> None:
        """It says something; nothing is expected."""
        self._talk += len(data)
        if self._talk > MOST_IDLE_TALK:
            self.transport.abort()

    def blocked(self, *, now: bool) -> None:
        """The connection takes no more, or takes again."""
        self._blocked = now
        self._write()

    def lost(self) -> None:
        """The connection is closed."""
        self._blocked = True
        self._rest = memoryview(b"")
        self._outbox.clear()
        self.publication.readers.discard(self)

    def info(self) -> list[Any]:
        """As `getBusInfo` has it."""
        there = self.transport.get_extra_info("peername") or ("?", 0)
        here = self.transport.get_extra_info("sockname") or ("?", 0)
        about = f"TCPROS connection on port {here[1]} to [{there[0]}:{there[1]} on socket {self.number}]"
        return [self.number, self.node, "o", "TCPROS", self.publication.name, True, about]

    def _begin(self, frame: bytearray) -> None:
        self._rest = memoryview(frame)
        self._count(frame)

    def _count(self, frame: bytearray) -> None:
        self.sent += len(frame)
        self.messages += 1
        self.publication.stream.sent += len(frame)

    def _write(self) -> None:
        """Send what there is until the connection is blocked."""
        while not self._blocked and not self.transport.is_closing():
            if not self._rest:
                frame = self._outbox.pop()
                if frame is None:
                    return
                self._begin(frame)
            piece, self._rest = self._rest[:PIECE], self._rest[PIECE:]
            self.transport.write(piece)
