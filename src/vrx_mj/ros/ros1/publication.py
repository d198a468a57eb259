"""Topics that we publish and services that we provide over TCPROS, and the peers that connect to our port for them."""

import asyncio
import contextlib
import itertools
import socket
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from vrx_mj.errors import CommandError
from vrx_mj.ros.interface import Answer
from vrx_mj.ros.limits import ConnectionLimit, Counts, Intake, Outbox, Place, Stall
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
from vrx_mj.ros.network import Network, Notices
from vrx_mj.ros.parameters import LONGEST
from vrx_mj.ros.ros1.connection import LARGEST_CALL, LARGEST_HEADER, Splitter, decode_header, encode_header, with_length

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
        for reader in list(self.readers):
            reader.transport.abort()

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

    def __init__(self, publication: Publication, transport: asyncio.Transport, header: Mapping[str, str]) -> None:
        self.publication, self.transport = publication, transport
        self.node = header["callerid"][:LONGEST]
        self.number = next(publication.stream.numbers)
        self.sent = self.messages = 0
        self._outbox: Outbox[bytearray] = Outbox(publication.stream.counts, _MOST_FRAMES, self._write)
        self._rest = memoryview(b"")
        """What asyncio has not been given yet of the message that is being sent."""
        self._blocked = False
        self._talk = 0
        transport.set_write_buffer_limits(high=_HIGH_WATER)

    def send(self, frame: bytearray) -> None:
        """Send a message now or later."""
        self._outbox.push(frame, len(frame))

    def take(self, data: bytes) -> None:
        """It sends something; nothing is expected."""
        self._talk += len(data)
        if self._talk > _MOST_IDLE_TALK:
            self.transport.abort()

    def set_blocked(self, *, now: bool) -> None:
        """The connection takes no more, or takes again."""
        self._blocked = now
        self._write()

    def note_loss(self) -> None:
        """The connection is closed."""
        self._blocked = True
        self._rest = memoryview(b"")
        self._outbox.forget()
        self.publication.readers.discard(self)

    def info(self) -> list[object]:
        """The row of this connection in `getBusInfo`."""
        there = self.transport.get_extra_info("peername") or ("?", 0)
        here = self.transport.get_extra_info("sockname") or ("?", 0)
        about = f"TCPROS connection on port {here[1]} to [{there[0]}:{there[1]} on socket {self.number}]"
        return [self.number, self.node, "o", "TCPROS", self.publication.name, True, about]

    def _write(self) -> None:
        """Send what there is until the connection is blocked."""
        while not self._blocked and not self.transport.is_closing():
            if not self._rest:
                frame = self._outbox.pop()
                if frame is None:
                    return
                self._rest = memoryview(frame)
                self.sent += len(frame)
                self.messages += 1
                self.publication.stream.counts.sent += len(frame)
            piece, self._rest = self._rest[:_PIECE], self._rest[_PIECE:]
            self.transport.write(piece)


_REQUEST_TIMEOUT = 10.0
"""Wall time in which a request must begin to come, and in which an answer must be taken [s]."""


@dataclass(eq=False)
class Provided:
    """A service of a node of this process, and its callers."""

    node: str
    name: str
    type: str
    call: Callable[[Message, str, Answer], None]
    """Takes the request, the caller's name, and what is to be called with the response."""
    callers: "set[Caller]" = field(default_factory=set)

    def refusal(self, header: Mapping[str, str]) -> str | None:
        """Why somebody cannot call it."""
        if not (is_known(f"{self.type}Request") and is_known(f"{self.type}Response")):
            return f"[{self.name}] has the type [{self.type}], which only clients of rosbridge can call"
        wanted, own = header["md5sum"], service_md5sum(self.type)
        if wanted in {"*", own}:
            return None
        return f"request from [{header['callerid']}]: md5sums do not match: [{wanted}] vs. [{own}]"

    def reply(self) -> dict[str, str]:
        """Our own header."""
        return {
            "callerid": self.node,
            "md5sum": service_md5sum(self.type),
            "request_type": f"{self.type}Request",
            "response_type": f"{self.type}Response",
            "service": self.name,
            "type": self.type,
        }

    def close(self) -> None:
        """Close all connections."""
        for caller in list(self.callers):
            caller.transport.abort()


def _is_persistent(header: Mapping[str, str]) -> bool:
    """Whether who sent a header wants to call more than once."""
    return header.get("persistent", "").lower() in {"1", "true"}


class Caller:
    """One who calls: once, or again and again where the connection is persistent; one call at a time."""

    def __init__(
        self,
        service: Provided,
        transport: asyncio.Transport,
        header: Mapping[str, str],
        network: Network,
        intake: Intake,
        place: Place,
    ) -> None:
        self.service, self.transport, self.node = service, transport, header["callerid"][:LONGEST]
        self._persistent = _is_persistent(header)
        self._network = network
        self._splitter = Splitter(LARGEST_CALL, intake, place)
        self._stall = Stall(transport.abort)
        self._busy = self._lost = self._blocked = False
        service.callers.add(self)
        self._timer = None if self._persistent else network.loop.call_later(_REQUEST_TIMEOUT, transport.abort)

    def take(self, data: bytes) -> None:
        """A piece of a request; CommandError: it is too large."""
        if self._timer is not None:
            self._timer.cancel()
        self._splitter.feed(data)
        self._next()

    def set_blocked(self, *, now: bool) -> None:
        """It takes no more answers, so that no more calls are taken, or takes them again."""
        self._blocked = now
        if not now and not self._busy and not self._lost:
            self.transport.resume_reading()
            self._network.loop.call_soon(self._resume)

    def note_loss(self) -> None:
        """The connection is closed."""
        self._lost = True
        self._stall.stop()
        self._splitter.rest()
        if self._timer is not None:
            self._timer.cancel()
        self.service.callers.discard(self)

    def _next(self) -> None:
        if self._busy or self._lost or self._blocked:
            return
        frame = self._splitter.take()
        self._stall.holds(len(self._splitter) if frame is None else 0)
        if frame is None:
            return
        self._busy = True
        self.transport.pause_reading()
        try:
            request = decode(frame, f"{self.service.type}Request")
        except CommandError as error:
            self._answer(None, str(error))
            return
        self.service.call(request, self.node, partial(self._network.soon, self._answer))

    def _answer(self, response: Message | None, why: str) -> None:
        if self._lost or not self._busy:
            return
        self.transport.write(self._bytes(response, why))
        self._busy = False
        if not self._persistent:
            self.transport.close()
            self._timer = self._network.loop.call_later(_REQUEST_TIMEOUT, self.transport.abort)
            return
        if not self._blocked:
            self.transport.resume_reading()
            self._network.loop.call_soon(self._resume)

    def _resume(self) -> None:
        try:
            self._next()
        except CommandError:
            self.transport.abort()

    def _bytes(self, response: Message | None, why: str) -> bytes:
        if response is not None:
            try:
                return b"\x01" + with_length(encode(response, f"{self.service.type}Response"))
            except Exception as error:  # whatever rosbags raises of an invalid response
                why = str(CommandError(f"{self.service.name}: the response cannot be written: {error}"))
        return b"\x00" + with_length(why.encode("utf-8", "replace"))


HEADER_TIMEOUT = 10.0
"""Wall time in which a header must come [s]."""

Role = Reader | Caller
_Meet = Callable[[Mapping[str, str], asyncio.Transport, Place], Role | None]
"""Takes a header; sends ours and gives who that is, or None if it asked for nothing more. CommandError: refused."""


@dataclass
class TcprosListener:
    """Listens for TCPROS."""

    meet: _Meet
    connection_limit: ConnectionLimit
    intake: Intake
    notices: Notices
    changed: Callable[[], None]
    """Called when somebody has come or gone."""
    inside: "set[Incoming]" = field(default_factory=set)
    _servers: list[asyncio.Server] = field(default_factory=list)

    async def start(self, hosts: Sequence[str], port: int = 0) -> int:
        """Listen; returns the port. OSError: that cannot be done."""
        loop = asyncio.get_running_loop()
        for host in hosts:
            server = await loop.create_server(lambda: Incoming(self), host, port, backlog=256)
            self._servers.append(server)
            port = server.sockets[0].getsockname()[1]
        return port

    async def close(self) -> None:
        """Close all connections."""
        for server in self._servers:
            server.close()
        for connection in list(self.inside):
            if connection.transport is not None:
                connection.transport.abort()
        while self.inside:
            await asyncio.sleep(0)


class Incoming(asyncio.Protocol):
    """A connection to our port of TCPROS."""

    def __init__(self, tcpros_listener: TcprosListener) -> None:
        self.transport: asyncio.Transport | None = None
        self._listener = tcpros_listener
        self._place = Place("?", self._abort)
        self._role: Role | None = None
        self._splitter = Splitter(LARGEST_HEADER, tcpros_listener.intake, self._place)
        self._timer: asyncio.TimerHandle | None = None
        self._over = self._blocked = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Somebody is there."""
        assert isinstance(transport, asyncio.Transport)
        host = self._place.host = str((transport.get_extra_info("peername") or ("?",))[0])
        if not self._listener.connection_limit.enter(self._place):
            self._listener.notices.write("WARN", "crowd", host, f"too many connections: refused one from {host}")
            self._over = True
            transport.abort()
            return
        self.transport = transport
        self._listener.inside.add(self)
        keep_alive(transport)
        self._timer = asyncio.get_running_loop().call_later(HEADER_TIMEOUT, transport.abort)

    def data_received(self, data: bytes) -> None:
        """A piece of what it sends."""
        if self._over or self.transport is None:
            return
        try:
            if self._role is not None:
                self._role.take(data)
                return
            self._splitter.feed(data)
            frame = self._splitter.take()
            if frame is not None:
                self._greet(decode_header(frame))
        except CommandError as error:
            self._refuse(str(error))

    def pause_writing(self) -> None:
        """It takes no more."""
        self._blocked = True
        if self._role is not None:
            self._role.set_blocked(now=True)

    def resume_writing(self) -> None:
        """It takes more."""
        self._blocked = False
        if self._role is not None:
            self._role.set_blocked(now=False)

    def connection_lost(self, _: Exception | None) -> None:
        """It has gone."""
        if self.transport is None:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._listener.connection_limit.leave(self._place)
        self._listener.inside.discard(self)
        self._splitter.rest()
        if self._role is not None:
            self._role.note_loss()
            self._listener.changed()

    def _abort(self) -> None:
        if self.transport is not None:
            self.transport.abort()

    def _greet(self, header: Mapping[str, str]) -> None:
        assert self.transport is not None
        lasts = "topic" in header or _is_persistent(header)
        if lasts and not self._listener.connection_limit.settle(self._place):
            raise CommandError("too many connections")
        role = self._listener.meet(header, self.transport, self._place)
        if self._timer is not None:
            self._timer.cancel()
        if role is None:
            self._end()
            return
        self._role = role
        role.set_blocked(now=self._blocked)
        self._listener.changed()
        rest = self._splitter.rest()
        if rest:
            role.take(rest)

    def _refuse(self, why: str) -> None:
        assert self.transport is not None
        host = self._place.host
        self._listener.notices.write("WARN", "tcpros", host, f"refused a connection of {host}: {why}")
        if self._role is None:
            self.transport.write(encode_header({"error": why[:1000]}))
        self._end()

    def _end(self) -> None:
        """Send what is to be sent, then close, whether it is taken or not."""
        assert self.transport is not None
        self._over = True
        self.transport.close()
        if self._timer is not None:
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_later(HEADER_TIMEOUT, self.transport.abort)


def keep_alive(transport: asyncio.BaseTransport) -> None:
    """Send at once, and notice when the other end is gone without a word."""
    connection = transport.get_extra_info("socket")
    options = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1), (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)]
    for name, value in (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, name):
            options.append((socket.IPPROTO_TCP, getattr(socket, name), value))
    with contextlib.suppress(OSError):
        for level, option, value in options:
            connection.setsockopt(level, option, value)
