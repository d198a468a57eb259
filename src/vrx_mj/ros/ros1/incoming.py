"""Whoever connects to our port of TCPROS: the header decides whether it subscribes or calls."""

import asyncio
import contextlib
import socket
from collections.abc import Callable, Mapping, Sequence

from vrx_mj.errors import CommandError
from vrx_mj.ros.intake import Intake, Place
from vrx_mj.ros.ros1.connection_limit import ConnectionLimit
from vrx_mj.ros.ros1.frames import Splitter
from vrx_mj.ros.ros1.header import LARGEST_HEADER, decode_header, encode_header
from vrx_mj.ros.ros1.notices import Notices
from vrx_mj.ros.ros1.provided import Caller, is_persistent
from vrx_mj.ros.ros1.publication import Reader

__all__ = ["Role", "TcprosListener", "keep_alive"]

HANDSHAKE = 10.0
"""Wall time in which a header must come [s]."""

Role = Reader | Caller
Meet = Callable[[Mapping[str, str], asyncio.Transport, Place], Role | None]
"""Takes a header; sends ours and gives who that is, or None if it asked for nothing more. CommandError: refused."""


class TcprosListener:
    """Listens for TCPROS."""

    def __init__(
        self,
        meet: Meet,
        connection_limit: ConnectionLimit,
        intake: Intake,
        notices: Notices,
        changed: Callable[[], None],
    ) -> None:
        self.meet, self.connection_limit, self.intake, self.notices, self.changed = (
            meet,
            connection_limit,
            intake,
            notices,
            changed,
        )
        self.inside: set[Incoming] = set()
        self._servers: list[asyncio.Server] = []

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
    """One connection."""

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
            self._listener.notices.tell("WARN", "crowd", host, f"too many connections; one of {host} refused")
            self._over = True
            transport.abort()
            return
        self.transport = transport
        self._listener.inside.add(self)
        keep_alive(transport)
        self._timer = asyncio.get_running_loop().call_later(HANDSHAKE, transport.abort)

    def data_received(self, data: bytes) -> None:
        """A piece of what it says."""
        if self._over or self.transport is None:
            return
        try:
            if self._role is not None:
                self._role.received(data)
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
            self._role.blocked(now=True)

    def resume_writing(self) -> None:
        """It takes more."""
        self._blocked = False
        if self._role is not None:
            self._role.blocked(now=False)

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
            self._role.lost()
            self._listener.changed()

    def _abort(self) -> None:
        if self.transport is not None:
            self.transport.abort()

    def _greet(self, header: Mapping[str, str]) -> None:
        assert self.transport is not None
        lasts = "topic" in header or is_persistent(header)
        if lasts and not self._listener.connection_limit.settle(self._place):
            raise CommandError("too many connections")
        role = self._listener.meet(header, self.transport, self._place)
        if self._timer is not None:
            self._timer.cancel()
        if role is None:
            self._end()
            return
        self._role = role
        role.blocked(now=self._blocked)
        self._listener.changed()
        rest = self._splitter.rest()
        if rest:
            role.received(rest)

    def _refuse(self, why: str) -> None:
        assert self.transport is not None
        host = self._place.host
        self._listener.notices.tell("WARN", "tcpros", host, f"refused a connection of {host}: {why}")
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
        self._timer = asyncio.get_running_loop().call_later(HANDSHAKE, self.transport.abort)


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
