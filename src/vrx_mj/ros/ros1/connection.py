"""Connections of ROS 1: headers and frames of TCPROS, each with its length before it, and who listens for them."""

import asyncio
import contextlib
import socket
import struct
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import ConnectionLimit, Intake, Place
from vrx_mj.ros.network import Notices
from vrx_mj.ros.ros1.xmlrpc import LARGEST_HEAD, address

LARGEST_HEADER = 1 << 18
"""Bytes of a header, at most: definitions of messages have up to some 10,000."""
LARGEST_CALL = 1 << 24
"""Bytes of a request to a service, or of its response, at most: a robot's description has up to some MB."""
STALL = 10.0
"""Wall time in which each portion of what has begun to come or to go must be through [s]."""
_PORTION = 1 << 16
"""[bytes]"""
_LENGTH = struct.Struct("<I")


def with_length(body: bytes) -> bytes:
    """The bytes of a frame: the length, then the body."""
    return _LENGTH.pack(len(body)) + body


def encode_header(fields: Mapping[str, str]) -> bytes:
    """The header with its length before it."""
    return with_length(b"".join(with_length(f"{name}={value}".encode()) for name, value in fields.items()))


def decode_header(raw: bytes) -> dict[str, str]:
    """Fields of a header that comes without its length; of a field that comes twice the last.

    Raises:
        CommandError: it is invalid.
    """
    fields: dict[str, str] = {}
    at = 0
    while at < len(raw):
        if len(raw) - at < _LENGTH.size:
            raise CommandError(f"truncated header: it ends inside the length of a field, at byte {at}")
        (size,) = _LENGTH.unpack_from(raw, at)
        at += _LENGTH.size
        if size > len(raw) - at:
            raise CommandError(f"a header's field has {size} bytes where {len(raw) - at} are left")
        name, equals, value = raw[at : at + size].decode("utf-8", "replace").partition("=")
        if not equals:
            raise CommandError("a header's field has no '='")
        fields[name] = value
        at += size
    return fields


class Peer:
    """A connection on which bytes come and go in portions, each within a time and within what all connections hold."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, intake: Intake) -> None:
        self.reader, self.writer, self._intake = reader, writer, intake
        self.place = Place(self.address("peername")[0], writer.transport.abort)
        writer.transport.set_write_buffer_limits(0)  # so that to drain is to have sent all
        _keep_alive(writer.get_extra_info("socket"))

    def address(self, end: str) -> tuple[str, int]:
        """Host and port of an end: `peername`, or `sockname` for ours."""
        host, port = (self.writer.get_extra_info(end) or ("?", 0))[:2]
        return str(host), port

    async def frame(self, largest: int, patience: float | None = None) -> bytes:
        """The next frame of at most `largest` bytes, without its length.

        Raises:
            CommandError: it would be too large, or all connections hold too much.
            TimeoutError: it does not begin within the `patience` [s].
            OSError, EOFError: the connection ends, or the frame does not go on.
        """
        async with asyncio.timeout(patience):
            (size,) = _LENGTH.unpack(await self.reader.readexactly(_LENGTH.size))
        if size > largest:
            raise CommandError(f"a frame of {size} bytes, where at most {largest} are allowed")
        body = bytes(await self.receive(size))
        self._intake.hold(self.place, 0)
        return body

    async def receive(self, size: int) -> bytearray:
        """So many bytes, which count until the next ones; errors are those of `frame`."""
        body = bytearray()
        while len(body) < size:
            goal = min(size, len(body) + _PORTION)
            async with in_time():
                while len(body) < goal:
                    part = await self.reader.read(goal - len(body))
                    if not part:
                        raise EOFError(f"the connection ended after {len(body)} of {size} bytes")
                    body += part
                    self._intake.hold(self.place, len(body))
        return body

    async def send(self, data: bytes) -> None:
        """Send, as fast as it is taken; errors are those of `frame`."""
        view = memoryview(data)
        for at in range(0, len(view), _PORTION):
            self._intake.hold(self.place, len(view) - at)
            self.writer.write(view[at : at + _PORTION])
            async with in_time():
                await self.writer.drain()
        self._intake.hold(self.place, 0)

    def close(self) -> None:
        """End the connection at once."""
        self._intake.hold(self.place, 0)
        self.writer.transport.abort()


@contextlib.asynccontextmanager
async def in_time() -> AsyncIterator[None]:
    """Hold what is done inside to the time of a portion; ConnectionAbortedError: it takes longer."""
    try:
        async with asyncio.timeout(STALL):
            yield
    except TimeoutError:
        raise ConnectionAbortedError("the connection stalls") from None


def _keep_alive(connection: socket.socket) -> None:
    """Notice when the other end is gone without a word."""
    options = [(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)]
    for name, value in (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, name):
            options.append((socket.IPPROTO_TCP, getattr(socket, name), value))
    with contextlib.suppress(OSError):
        for option in options:
            connection.setsockopt(*option)


async def dial(uri: str, scheme: str, intake: Intake, *, timeout: float) -> Peer:
    """A connection to a URI.

    Raises:
        CommandError: it is no URI.
        OSError, TimeoutError: nobody answers there in time [s].
    """
    host, port = address(uri, scheme)
    async with asyncio.timeout(timeout):
        return Peer(*await asyncio.open_connection(host, port, limit=LARGEST_HEAD, family=socket.AF_INET), intake)


class Listener:
    """Listens, and has a task for each connection."""

    def __init__(
        self, title: str, serve: Callable[[Peer], Awaitable[None]], connection_limit: ConnectionLimit, intake: Intake,
        notices: Notices,
    ) -> None:  # fmt: skip
        """`serve`: does what a peer wants until it leaves; CommandError or Fault: it has to leave, and why."""
        self.title, self.connection_limit, self.intake, self._notices = title, connection_limit, intake, notices
        self._serve = serve
        self._servers: list[asyncio.Server] = []
        self._is_open = True
        self.tasks: set[asyncio.Task[None]] = set()
        """Those of the connections that are open."""

    async def start(self, hosts: Sequence[str], port: int = 0) -> int:
        """Listen; returns the port, a free one where 0 is given. OSError: that cannot be done."""
        for host in hosts:
            server = await asyncio.start_server(self._connected, host, port, limit=LARGEST_HEAD, backlog=256)
            self._servers.append(server)
            port = server.sockets[0].getsockname()[1]
        return port

    async def close(self) -> None:
        """Close all connections."""
        self._is_open = False
        for server in self._servers:
            server.close()
        for _ in range(8):  # what asyncio has accepted begins in the loop's next turns, and finds it closed
            await asyncio.sleep(0)
        tasks = [task for task in self.tasks if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._servers.clear()

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer, task = Peer(reader, writer, self.intake), asyncio.current_task()
        host = peer.place.host
        assert task is not None
        if not self._is_open or not self.connection_limit.enter(peer.place):
            if self._is_open:
                text = f"{self.title}: too many connections: refused one from {host}"
                self._notices.write("WARN", "crowd", host, text)
            peer.close()
            return
        self.tasks.add(task)
        try:
            await self._serve(peer)
        except (CommandError, Fault) as error:
            kind = getattr(error, "status", self.title)
            self._notices.write("WARN", kind, host, f"{self.title}: refused a request of {host}: {error}")
        except (OSError, EOFError, TimeoutError, asyncio.CancelledError):
            pass  # it has gone, was too slow, or all is closed
        finally:
            self.tasks.discard(task)
            self.connection_limit.leave(peer.place)
            peer.close()
