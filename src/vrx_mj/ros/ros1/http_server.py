"""The answering end of XML-RPC over HTTP."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.access import Names
from vrx_mj.ros.limits import SMALL, ConnectionLimit, Intake, Pace
from vrx_mj.ros.network import Notices
from vrx_mj.ros.parameters import value_size
from vrx_mj.ros.ros1.connection import Listener, Peer, in_time
from vrx_mj.ros.ros1.xmlrpc import answer_bytes, checked_size, fault_bytes, read, read_head

_Answerer = Callable[[str, Sequence[Any], str], object]
"""Takes a method, its values and the caller's address; gives a value, or raises CommandError or Fault."""

_HANDSHAKE = 10.0
"""Wall time in which a first request must begin to come [s]."""
_IDLE = 60.0
"""Wall time that a connection is kept for another request [s]."""
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


class HttpServer(Listener):
    """Answers calls of programs, those of a connection one after the other.

    Calls are answered in the order in which they are whole; those that are large, or have large answers, in a lane of
    their own. A slow peer holds up no other, and one who calls often waits for as many as others do.
    """

    def __init__(
        self, title: str, answer: _Answerer, connection_limit: ConnectionLimit, notices: Notices,
        names: Names | None = None,
    ) -> None:  # fmt: skip
        super().__init__(title, self._requests, connection_limit, Intake(_ALL_BODIES), notices)
        self._answer, self._names = answer, names or Names()
        self._lane, self._lane_of_large = Lane(), Lane()

    async def _requests(self, peer: Peer) -> None:
        timeout, goes_on, place = _HANDSHAKE, True, peer.place
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
            answer = await self._answered(await peer.receive(size), peer)
            await self._send(peer, "200 OK", answer, keep=goes_on)
            timeout = _IDLE

    async def _head(self, peer: Peer, timeout: float) -> tuple[list[str], dict[str, str]]:
        self.connection_limit.wait(peer.place)
        async with asyncio.timeout(timeout):
            first = await peer.reader.readexactly(1)
        async with in_time():
            return await read_head(peer.reader, first)

    async def _answered(self, body: bytearray, peer: Peer) -> bytes:
        """The answer to a call, when it is its turn; ConnectionError: the caller has left."""

        def is_gone() -> bool:
            return peer.writer.transport.is_closing() or peer.reader.at_eof()

        host, lane = peer.place.host, self._lane if len(body) <= SMALL else self._lane_of_large
        try:
            async with lane.turn(is_gone):
                values, method = await read(body)
                value = await self._called(method, values, host)
                if lane is self._lane_of_large or value_size(value) <= SMALL:
                    return answer_bytes(value)
            async with self._lane_of_large.turn(is_gone):
                return answer_bytes(value)
        except CommandError as error:
            self._notices.write("WARN", "xmlrpc", host, f"{self.title}: refused a call of {host}: {error}")
            return fault_bytes(str(error))
        except Fault as fault:
            return fault_bytes(fault.faultString)

    async def _called(self, method: str | None, values: Sequence[object], host: str) -> object:
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
