"""The answering end of XML-RPC over HTTP."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from vrx_mj.adapters.ros.ros1.gate import Gate
from vrx_mj.adapters.ros.ros1.http import LARGEST_HEAD, body_size, read_head
from vrx_mj.adapters.ros.ros1.notices import Notices
from vrx_mj.adapters.ros.ros1.outbox import Budget
from vrx_mj.adapters.ros.ros1.pace import Pace
from vrx_mj.adapters.ros.ros1.xmlrpc import Fault, answer_bytes, fault_bytes, read
from vrx_mj.errors import CommandError

__all__ = ["Answerer", "HttpServer"]

Answerer = Callable[[str, Sequence[Any], str], Awaitable[Any]]
"""Takes a method, its values and the caller's address; gives a value, or raises CommandError or Fault."""

HANDSHAKE = 10.0
"""Wall time in which a first request must come [s]."""
IDLE = 60.0
"""Wall time that a connection is kept for another request [s]."""
BODY = 30.0
"""Wall time in which a body must come, and an answer be taken [s]."""
ALL_BODIES = 1 << 27
"""Bytes of all bodies that are read at one time."""
MOST_CALLS = 1000
"""Of one system.multicall."""


class HttpServer:
    """Answers calls, those of a connection one after the other."""

    def __init__(self, title: str, answer: Answerer, gate: Gate, notices: Notices) -> None:
        self.title = title
        self._answer, self._gate, self._notices = answer, gate, notices
        self._budget = Budget(ALL_BODIES)
        self._pace = Pace(time.monotonic)
        self._servers: list[asyncio.Server] = []
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
        for server in self._servers:
            server.close()
        own = asyncio.current_task()
        tasks = [task for task in self._tasks if task is not own]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._servers.clear()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        host = str((writer.get_extra_info("peername") or ("?",))[0])
        if not self._gate.enter(host):
            self._notices.tell("WARN", "crowd", host, f"{self.title}: too many connections; one of {host} refused")
            writer.transport.abort()
            return
        self._tasks.add(task)
        writer.transport.set_write_buffer_limits(0)  # so that to drain is to have sent all
        try:
            await self._requests(reader, writer, host)
        except (CommandError, Fault) as error:
            self._notices.tell("WARN", "http", host, f"{self.title}: refused a request of {host}: {error}")
        except (OSError, EOFError, TimeoutError, asyncio.CancelledError):
            pass  # it has gone, was too slow, or all is closed
        finally:
            self._tasks.discard(task)
            self._gate.leave(host)
            writer.transport.abort()

    async def _requests(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str) -> None:
        patience, goes_on = HANDSHAKE, True
        while goes_on:
            async with asyncio.timeout(patience):
                words, fields = await read_head(reader)
            try:
                size = _checked(words, fields)
            except CommandError as error:
                await _send(writer, "400 Bad Request", str(error).encode("utf-8", "replace"), keep=False)
                raise
            goes_on = _keeps(words[2], fields)
            body = await self._body(reader, writer, size, fields)
            began = time.thread_time()
            answer = await self._answered(body, host)
            wait = self._pace.wait(time.thread_time() - began)
            await _send(writer, "200 OK", answer, keep=goes_on)
            await asyncio.sleep(wait)
            patience = IDLE

    async def _body(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, size: int, fields: dict[str, str]
    ) -> bytes:
        self._budget.used += size
        try:
            if self._budget.is_spent:
                raise CommandError(f"bodies of more than {ALL_BODIES} bytes at one time")
            if fields.get("expect", "").lower() == "100-continue":
                writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
            async with asyncio.timeout(BODY):
                return await reader.readexactly(size)
        finally:
            self._budget.used -= size

    async def _answered(self, body: bytes, host: str) -> bytes:
        try:
            values, method = await read(body)
            if method is None:
                raise CommandError("an answer instead of a call")
            if method == "system.multicall":
                return answer_bytes([await self._one_of_many(call, host) for call in _calls(values)])
            return answer_bytes(await self._answer(method, values, host))
        except Fault as fault:
            return fault_bytes(fault.faultString)
        except CommandError as error:
            self._notices.tell("WARN", "xmlrpc", host, f"{self.title}: refused a call of {host}: {error}")
            return fault_bytes(str(error))

    async def _one_of_many(self, call: Any, host: str) -> Any:
        """A call in a `system.multicall`: its value in a list, or a fault."""
        try:
            method, values = call["methodName"], call["params"]
            if not isinstance(method, str) or not isinstance(values, list):
                raise CommandError("a call needs a name and a list of values")
            return [await self._answer(method, values, host)]
        except (CommandError, Fault, LookupError, TypeError) as error:
            return {"faultCode": 1, "faultString": getattr(error, "faultString", str(error))}


def _calls(values: Sequence[Any]) -> list[Any]:
    if len(values) != 1 or not isinstance(values[0], list) or len(values[0]) > MOST_CALLS:
        raise CommandError(f"system.multicall needs one list of at most {MOST_CALLS} calls")
    return values[0]


def _checked(words: list[str], fields: dict[str, str]) -> int:
    """Bytes of a request's body."""
    if len(words) != 3 or words[0] != "POST" or words[2] not in {"HTTP/1.0", "HTTP/1.1"}:
        raise CommandError(f"this is XML-RPC: '{' '.join(words)[:60]}' is not a POST of HTTP/1.0 or 1.1")
    size = body_size(fields)
    if size is None:
        raise CommandError("a request needs a Content-Length")
    return size


def _keeps(version: str, fields: dict[str, str]) -> bool:
    wish = fields.get("connection", "").lower()
    return wish != "close" if version == "HTTP/1.1" else wish == "keep-alive"


async def _send(writer: asyncio.StreamWriter, status: str, body: bytes, *, keep: bool) -> None:
    head = (
        f"HTTP/1.1 {status}\r\nServer: vrx_mj\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n"
        f"Connection: {'keep-alive' if keep else 'close'}\r\n\r\n"
    )
    writer.write(head.encode() + body)
    async with asyncio.timeout(BODY):
        await writer.drain()
