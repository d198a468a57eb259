"""The answering end of XML-RPC over HTTP."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.access import Names
from vrx_mj.ros.limits import SMALL, ConnectionLimit, Intake, Pace, Place
from vrx_mj.ros.network import Notices
from vrx_mj.ros.parameters import value_size
from vrx_mj.ros.ros1.xmlrpc import LARGEST_HEAD, answer_bytes, checked_size, fault_bytes, read, read_head

_Answerer = Callable[[str, Sequence[Any], str], Awaitable[Any]]
"""Takes a method, its values and the caller's address; gives a value, or raises CommandError or Fault."""

_HANDSHAKE = 10.0
"""Wall time in which a first request must begin to come [s]."""
_IDLE = 60.0
"""Wall time that a connection is kept for another request [s]."""
STALL = 5.0
"""Wall time in which a head that has begun, and each portion of a body or an answer, must be through [s]."""
_PORTION = 1 << 16
"""[bytes]"""
_ALL_BODIES = 1 << 27
"""Bytes of all bodies and answers that have come, or wait to be taken, at one time."""
_MOST_CALLS = 1000
"""Calls in one system.multicall."""
CALLS_SHARE = 0.25
"""Share of the wall time that answers may take in the long run."""
CALLS_BURST = 0.5
"""Wall time of answers that are given at once: a launch file or a recorder calls hundreds of times [s]."""
_LARGEST_ANSWER = 1 << 26
"""Bytes of the values that a system.multicall gives, about."""


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


class HttpServer:
    """Answers calls of programs, those of a connection one after the other.

    Calls are answered in the order in which they are whole; those that are large, or have large answers, in a lane of
    their own. A slow peer holds up no other, and one who calls often waits for as many as others do.
    """

    def __init__(
        self, title: str, answer: _Answerer, connection_limit: ConnectionLimit, notices: Notices,
        names: Names | None = None,
    ) -> None:  # fmt: skip
        self.title = title
        self._answer, self._connection_limit, self._notices = answer, connection_limit, notices
        self._names = names or Names()
        self._intake = Intake(_ALL_BODIES)
        self._lane, self._lane_of_large = Lane(), Lane()
        self._servers: list[asyncio.Server] = []
        self._is_open = True
        self._tasks: set[asyncio.Task[None]] = set()

    async def start(self, hosts: Sequence[str], port: int) -> int:
        """Listen; returns the port, a free one where 0 is given. OSError: that cannot be done."""
        for host in hosts:
            server = await asyncio.start_server(self._serve, host, port, limit=LARGEST_HEAD, backlog=256)
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
        own = asyncio.current_task()
        tasks = [task for task in self._tasks if task is not own]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._servers.clear()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        place = Place(str((writer.get_extra_info("peername") or ("?",))[0]), writer.transport.abort)
        if not self._is_open:
            writer.transport.abort()
            return
        if not self._connection_limit.enter(place):
            text = f"{self.title}: too many connections: refused one from {place.host}"
            self._notices.write("WARN", "crowd", place.host, text)
            writer.transport.abort()
            return
        self._tasks.add(task)
        writer.transport.set_write_buffer_limits(0)  # so that to drain is to have sent all
        try:
            await self._requests(reader, writer, place)
        except (CommandError, Fault) as error:
            kind = getattr(error, "status", "http")
            text = f"{self.title}: refused a request of {place.host}: {error}"
            self._notices.write("WARN", kind, place.host, text)
        except (OSError, EOFError, TimeoutError, asyncio.CancelledError):
            pass  # it has gone, was too slow, or all is closed
        finally:
            self._tasks.discard(task)
            self._connection_limit.leave(place)
            self._intake.hold(place, 0)
            writer.transport.abort()

    async def _requests(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, place: Place) -> None:
        timeout, goes_on = _HANDSHAKE, True
        reached = str((writer.get_extra_info("sockname") or ("",))[0])
        while goes_on:
            words, fields = await self._head(reader, place, timeout)
            try:
                size = checked_size(words, fields, lambda host: self._names.has(host, reached))
            except CommandError as error:
                status = getattr(error, "status", "400 Bad Request")
                await self._send(writer, status, str(error).encode("utf-8", "replace"), place, keep=False)
                raise
            wish = fields.get("connection", "").lower()
            goes_on = wish != "close" if words[2] == "HTTP/1.1" else wish == "keep-alive"
            if fields.get("expect", "").lower() == "100-continue":
                writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
            body = await self._body(reader, place, size)
            answer = await self._answered(body, place, lambda: writer.transport.is_closing() or reader.at_eof())
            await self._send(writer, "200 OK", answer, place, keep=goes_on)
            timeout = _IDLE

    async def _head(
        self, reader: asyncio.StreamReader, place: Place, timeout: float
    ) -> tuple[list[str], dict[str, str]]:  # fmt: skip
        self._connection_limit.wait(place)
        async with asyncio.timeout(timeout):
            first = await reader.readexactly(1)
        async with asyncio.timeout(STALL):
            return await read_head(reader, first)

    async def _body(self, reader: asyncio.StreamReader, place: Place, size: int) -> bytearray:
        self._connection_limit.wait(place)
        body = bytearray()
        while len(body) < size:
            goal = min(size, len(body) + _PORTION)
            async with asyncio.timeout(STALL):
                while len(body) < goal:
                    part = await reader.read(goal - len(body))
                    if not part:
                        raise EOFError
                    body += part
                    self._intake.hold(place, len(body))
        return body

    async def _answered(self, body: bytearray, place: Place, is_gone: Callable[[], bool]) -> bytes:
        """The answer to a call, when it is its turn; ConnectionError: the caller has left."""
        lane = self._lane if len(body) <= SMALL else self._lane_of_large
        try:
            async with lane.turn(is_gone):
                values, method = await read(body)
                value = await self._called(method, values, place.host)
                if lane is self._lane_of_large or value_size(value) <= SMALL:
                    return answer_bytes(value)
            async with self._lane_of_large.turn(is_gone):
                return answer_bytes(value)
        except CommandError as error:
            text = f"{self.title}: refused a call of {place.host}: {error}"
            self._notices.write("WARN", "xmlrpc", place.host, text)
            return fault_bytes(str(error))
        except Fault as fault:
            return fault_bytes(fault.faultString)

    async def _called(self, method: str | None, values: Sequence[object], host: str) -> object:
        if method is None:
            raise CommandError("an answer instead of a call")
        if method != "system.multicall":
            return await self._answer(method, values, host)
        answers, size = [], 0
        for call in _calls(values):
            answers.append(await self._one_of_many(call, host))
            size += value_size(answers[-1])
            if size > _LARGEST_ANSWER:
                raise CommandError(f"system.multicall: answers of more than {_LARGEST_ANSWER} bytes")
            await asyncio.sleep(0)
        return answers

    async def _one_of_many(self, call: object, host: str) -> object:
        """A call in a `system.multicall`: its value in a list, or a fault."""
        try:
            method, values = (call["methodName"], call["params"]) if isinstance(call, dict) else (None, None)
            if not isinstance(method, str) or not isinstance(values, list):
                raise CommandError("a call needs a name and a list of values")
            return [await self._answer(method, values, host)]
        except (CommandError, Fault, LookupError, TypeError) as error:
            return {"faultCode": 1, "faultString": getattr(error, "faultString", str(error))}

    async def _send(
        self, writer: asyncio.StreamWriter, status: str, body: bytes, place: Place, *, keep: bool
    ) -> None:  # fmt: skip
        """Send an answer, as fast as it is taken."""
        head = (
            f"HTTP/1.1 {status}\r\nServer: vrx_mj\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n"
            f"Connection: {'keep-alive' if keep else 'close'}\r\n"
        )
        if status.startswith("405"):
            head += "Allow: POST\r\n"
        data = memoryview(f"{head}\r\n".encode() + body)
        self._connection_limit.wait(place)
        for at in range(0, len(data), _PORTION):
            self._intake.hold(place, len(data) - at)
            writer.write(data[at : at + _PORTION])
            async with asyncio.timeout(STALL):
                await writer.drain()
        self._intake.hold(place, 0)


def _calls(values: Sequence[object]) -> list[object]:
    if len(values) != 1 or not isinstance(values[0], list) or len(values[0]) > _MOST_CALLS:
        raise CommandError(f"system.multicall needs one list of at most {_MOST_CALLS} calls")
    return values[0]
