"""Connections of ROS 1: headers and frames of TCPROS, who listens for them, and the answering end of XML-RPC."""

import asyncio
import contextlib
import socket
import struct
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import SMALL, ConnectionLimit, Intake, Pace, Place
from vrx_mj.ros.network import Names, Notices, end_tasks
from vrx_mj.ros.parameters import value_size
from vrx_mj.ros.ros1.xmlrpc import LARGEST_HEAD, address, answer_bytes, checked_size, fault_bytes, read, read_head

LARGEST_HEADER = 1 << 18
"""Largest header [bytes]: definitions of messages have up to some 10,000."""
LARGEST_CALL = 1 << 24
"""Largest request to a service, or response [bytes]: a robot's description has up to some MB."""
STALL_TIMEOUT = 10.0
"""Longest wall time of the transfer of one portion of a message [s]."""
_PORTION = 1 << 16
"""Size of such a portion [bytes]."""
LENGTH = struct.Struct("<I")
"""Length of what follows."""
_FIRST_TIMEOUT = 10.0
"""Wall time in which a first request must begin [s]."""
_IDLE_TIMEOUT = 60.0
"""Wall time for which a connection is kept open for another request [s]."""
_MAX_BODIES = 1 << 27
"""Largest size of all bodies and answers that are held at one time [bytes]."""
_MOST_CALLS = 1000
"""Largest number of calls in one system.multicall."""
CALLS_SHARE = 0.25
"""Share of the wall time that answers may take in the long run."""
CALLS_BURST = 0.5
"""Wall time of answers that are given at once [s]: a launch file or a recorder calls hundreds of times."""
_LARGEST_ANSWER = 1 << 26
"""Approximate limit of the size of the values that a system.multicall returns [bytes]."""


def with_length(body: bytes) -> bytes:
    """The bytes of a frame: the length, then the body."""
    return LENGTH.pack(len(body)) + body


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
        if len(raw) - at < LENGTH.size:
            raise CommandError(f"truncated header: it ends inside the length of a field, at byte {at}")
        (size,) = LENGTH.unpack_from(raw, at)
        at += LENGTH.size
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
            (size,) = LENGTH.unpack(await self.reader.readexactly(LENGTH.size))
        if size > largest:
            raise CommandError(f"a frame of {size} bytes, where at most {largest} are allowed")
        body = bytes(await self.receive(size))
        self._intake.hold(self.place, 0)
        return body

    async def receive(self, size: int) -> bytearray:
        """Receive so many bytes, which count until the next ones; errors are those of `frame`."""
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
        async with asyncio.timeout(STALL_TIMEOUT):
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
        """Tasks of the connections that are open."""

    async def start(self, hosts: Sequence[str], port: int = 0) -> int:
        """Listen; returns the port, a free one where 0 is given. OSError: that cannot be done."""
        for host in hosts:
            server = await asyncio.start_server(self._serve_client, host, port, limit=LARGEST_HEAD, backlog=256)
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
        await end_tasks(self.tasks)
        self._servers.clear()

    async def _serve_client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
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
            self._notices.write("WARN", kind, host, f"{self.title}: refused a request from {host}: {error}")
        except (OSError, EOFError, TimeoutError, asyncio.CancelledError):
            pass  # it has gone, was too slow, or all is closed
        finally:
            self.tasks.discard(task)
            self.connection_limit.leave(peer.place)
            peer.close()


_Answerer = Callable[[str, Sequence[Any], str], object]
"""Takes a method, its values and the caller's address; gives a value, or raises CommandError or Fault."""


class Lane:
    """Calls that are done one after the other, in the order in which they came, within a share of the time."""

    def __init__(self) -> None:
        self._lock = asyncio.Lock()
        self._pace = Pace(CALLS_SHARE, CALLS_BURST)
        self._next = 0.0

    @contextlib.asynccontextmanager
    async def turn(self, is_gone: Callable[[], bool]) -> AsyncIterator[None]:
        """Wait until it is one's turn; ConnectionError: the caller has left."""
        async with self._lock:
            await asyncio.sleep(self._next - time.monotonic())
            if is_gone():
                raise ConnectionAbortedError
            began = time.thread_time()
            try:
                yield
            finally:
                now = time.monotonic()
                self._next = now + self._pace.wait(time.thread_time() - began, now)


class HttpServer(Listener):
    """Answers calls of programs, those of a connection one after the other.

    Calls are answered in the order in which they are whole; those that are large, or have large answers, in a lane of
    their own. A slow peer holds up no other, and one who calls often waits for as many as others do.
    """

    def __init__(
        self, title: str, answer: _Answerer, connection_limit: ConnectionLimit, notices: Notices,
        names: Names | None = None,
    ) -> None:  # fmt: skip
        super().__init__(title, self._requests, connection_limit, Intake(_MAX_BODIES), notices)
        self._answer, self._names = answer, names or Names()
        self._lane, self._lane_of_large = Lane(), Lane()

    async def _requests(self, peer: Peer) -> None:
        timeout, goes_on, place = _FIRST_TIMEOUT, True, peer.place
        while goes_on:
            words, fields = await self._head(peer, timeout)
            try:
                size = checked_size(words, fields, lambda host: self._names.has(host, peer.address("sockname")[0]))
            except CommandError as error:
                status = getattr(error, "status", "400 Bad Request")
                await self._send(peer, status, str(error).encode("utf-8", "replace"), keep=False)
                raise
            wish = fields.get("connection", "").lower()
            goes_on = wish != "close" if words[2] == "HTTP/1.1" else wish == "keep-alive"
            if fields.get("expect", "").lower() == "100-continue":
                peer.writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
            self.connection_limit.wait(place)
            answer = await self._answer_body(await peer.receive(size), peer)
            await self._send(peer, "200 OK", answer, keep=goes_on)
            timeout = _IDLE_TIMEOUT

    async def _head(self, peer: Peer, timeout: float) -> tuple[list[str], dict[str, str]]:
        self.connection_limit.wait(peer.place)
        async with asyncio.timeout(timeout):
            first = await peer.reader.readexactly(1)
        async with in_time():
            return await read_head(peer.reader, first)

    async def _answer_body(self, body: bytearray, peer: Peer) -> bytes:
        """The answer to a call, when it is its turn; ConnectionError: the caller has left."""

        def is_gone() -> bool:
            return peer.writer.transport.is_closing() or peer.reader.at_eof()

        host, lane = peer.place.host, self._lane if len(body) <= SMALL else self._lane_of_large
        try:
            async with lane.turn(is_gone):
                values, method = await read(body)
                value = await self._call_method(method, values, host)
                if lane is self._lane_of_large or value_size(value) <= SMALL:
                    return answer_bytes(value)
            async with self._lane_of_large.turn(is_gone):
                return answer_bytes(value)
        except CommandError as error:
            self._notices.write("WARN", "xmlrpc", host, f"{self.title}: refused a call from {host}: {error}")
            return fault_bytes(str(error))
        except Fault as fault:
            return fault_bytes(fault.faultString)

    async def _call_method(self, method: str | None, values: Sequence[object], host: str) -> object:
        if method is None:
            raise CommandError("an answer instead of a call")
        if method != "system.multicall":
            return self._answer(method, values, host)
        answers, size = [], 0
        for call in _calls(values):
            answers.append(self._one_of_many(call, host))
            size += value_size(answers[-1])
            if size > _LARGEST_ANSWER:
                raise CommandError(f"system.multicall: answers of more than {_LARGEST_ANSWER} bytes")
            await asyncio.sleep(0)
        return answers

    def _one_of_many(self, call: object, host: str) -> object:
        """A call in a `system.multicall`: its value in a list, or a fault."""
        try:
            method, values = (call["methodName"], call["params"]) if isinstance(call, dict) else (None, None)
            if not isinstance(method, str) or not isinstance(values, list):
                raise CommandError("a call needs a name and a list of values")
            return [self._answer(method, values, host)]
        except (CommandError, Fault, LookupError, TypeError) as error:
            return {"faultCode": 1, "faultString": getattr(error, "faultString", str(error))}

    async def _send(self, peer: Peer, status: str, body: bytes, *, keep: bool) -> None:
        head = (
            f"HTTP/1.1 {status}\r\nServer: vrx_mj\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n"
            f"Connection: {'keep-alive' if keep else 'close'}\r\n"
        )
        if status.startswith("405"):
            head += "Allow: POST\r\n"
        self.connection_limit.wait(peer.place)
        await peer.send(f"{head}\r\n".encode() + body)


def _calls(values: Sequence[object]) -> list[object]:
    if len(values) != 1 or not isinstance(values[0], list) or len(values[0]) > _MOST_CALLS:
        raise CommandError(f"system.multicall needs one list of at most {_MOST_CALLS} calls")
    return values[0]
