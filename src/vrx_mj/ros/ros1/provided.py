"""A service that we provide over TCPROS, and those who call it."""

import asyncio
from collections.abc import Callable, Mapping

from vrx_mj.errors import CommandError
from vrx_mj.ros.inbox import Answer
from vrx_mj.ros.intake import Intake, Place
from vrx_mj.ros.messages import Message, decode, encode, service_md5sum
from vrx_mj.ros.network import Network
from vrx_mj.ros.ros1.frames import Splitter
from vrx_mj.ros.ros1.header import framed
from vrx_mj.ros.ros1.names import LONGEST
from vrx_mj.ros.ros1.stall import Stall

__all__ = ["Caller", "Provided", "is_persistent"]

LARGEST_REQUEST = 1 << 24
"""Bytes, at most: a robot's description has up to some MB."""
PATIENCE = 10.0
"""Wall time in which a request must begin to come, and in which an answer must be taken [s]."""
LONGEST_ERROR = 4000


class Provided:
    """One service."""

    def __init__(self, node: str, name: str, type_name: str, call: Callable[[Message, str, Answer], None]) -> None:
        self.node, self.name, self.type = node, name, type_name
        self.call = call
        """Takes the request, the caller's name, and what is to be called with the response."""
        self.callers: set[Caller] = set()

    def refusal(self, header: Mapping[str, str]) -> str | None:
        """Why somebody cannot call it."""
        missing = [field for field in ("service", "md5sum", "callerid") if field not in header]
        if missing:
            return f"Missing required '{missing[0]}' field"
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


def is_persistent(header: Mapping[str, str]) -> bool:
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
        self._persistent = is_persistent(header)
        self._network = network
        self._splitter = Splitter(LARGEST_REQUEST, intake, place)
        self._stall = Stall(transport.abort)
        self._busy = self._lost = self._blocked = False
        service.callers.add(self)
        self._timer = None if self._persistent else network.loop.call_later(PATIENCE, transport.abort)

    def received(self, data: bytes) -> None:
        """A piece of a request; CommandError: it is too large."""
        if self._timer is not None:
            self._timer.cancel()
        self._splitter.feed(data)
        self._next()

    def blocked(self, *, now: bool) -> None:
        """It takes no more answers, so that no more calls are taken, or takes them again."""
        self._blocked = now
        if not now and not self._busy and not self._lost:
            self.transport.resume_reading()
            self._network.loop.call_soon(self._resume)

    def lost(self) -> None:
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
            self._answered(None, str(error))
            return
        self.service.call(request, self.node, self._answer)

    def _answer(self, response: Message | None, why: str) -> None:
        """The response, or why there is none, from any thread."""
        self._network.soon(self._answered, response, why)

    def _answered(self, response: Message | None, why: str) -> None:
        if self._lost or not self._busy:
            return
        self.transport.write(self._bytes(response, why))
        self._busy = False
        if not self._persistent:
            self.transport.close()
            self._timer = self._network.loop.call_later(PATIENCE, self.transport.abort)
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
                return b"\x01" + framed(encode(response, f"{self.service.type}Response"))
            except Exception as error:  # whatever rosbags raises of a response that is none
                why = f"{self.service.name}: the response cannot be written: {error}"
        return b"\x00" + framed(why[:LONGEST_ERROR].encode("utf-8", "replace"))
