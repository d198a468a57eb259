"""What waits to be sent to a client, within bounds: one that does not keep up loses the oldest messages."""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["Counts", "Outgoing"]

MOST_MESSAGES = 1000
MOST_BYTES = 32 << 20
"""Of a client's messages that wait, but for one that is larger."""
MOST_BYTES_OF_ALL = 256 << 20
MOST_REPLIES = 2000
MOST_REPLY_BYTES = 8 << 20


@dataclass(slots=True)
class Counts:
    """What went to all clients, and what is to go."""

    sent: int = 0
    """[bytes]"""
    dropped: int = 0
    """Messages thrown away because a client did not keep up."""
    waiting: int = 0
    """Of messages [bytes]."""


class Bundle(NamedTuple):
    """The frames of one message."""

    source: object
    frames: list[bytes]
    binary: bool
    size: int


class Outgoing:
    """A client's queue: replies, which are never dropped, go before messages of topics."""

    def __init__(self, counts: Counts) -> None:
        self._counts = counts
        self._replies: deque[Bundle] = deque()
        self._messages: deque[Bundle] = deque()
        self._reply_bytes = self._bytes = 0
        self._filled = asyncio.Event()

    def reply(self, frames: list[bytes], binary: bool = False) -> bool:
        """Send an answer; False: the client takes none, and has to go."""
        size = sum(map(len, frames))
        full = len(self._replies) >= MOST_REPLIES or self._reply_bytes + size > MOST_REPLY_BYTES
        if full and self._replies:
            return False
        self._replies.append(Bundle(None, frames, binary, size))
        self._reply_bytes += size
        self._filled.set()
        return True

    def message(self, source: object, frames: list[bytes], binary: bool, most: int = 0) -> None:
        """Send a topic's message, of which (`source`) at most so many wait; 0: as many as there is room for."""
        if most and sum(bundle.source is source for bundle in self._messages) >= most:
            self._drop(next(index for index, bundle in enumerate(self._messages) if bundle.source is source))
        size = sum(map(len, frames))
        self._messages.append(Bundle(source, frames, binary, size))
        self._add(size)
        while len(self._messages) > MOST_MESSAGES or (self._crowded and len(self._messages) > 1):
            self._drop(0)
        self._filled.set()

    def forget(self, source: object) -> None:
        """Throw away what waits of a subscription that ended."""
        self._messages = deque(bundle for bundle in self._messages if bundle.source is not source)
        self._add(sum(bundle.size for bundle in self._messages) - self._bytes)

    async def run(self, send: Callable[[bytes, bool], Awaitable[None]]) -> None:
        """Send for ever: each frame, and whether it is binary."""
        while True:
            await self._filled.wait()
            while (bundle := self._next()) is not None:
                for frame in bundle.frames:
                    await send(frame, bundle.binary)
                    self._counts.sent += len(frame)
            self._filled.clear()

    def _next(self) -> Bundle | None:
        if self._replies:
            bundle = self._replies.popleft()
            self._reply_bytes -= bundle.size
            return bundle
        if self._messages:
            bundle = self._messages.popleft()
            self._add(-bundle.size)
            return bundle
        return None

    @property
    def _crowded(self) -> bool:
        return self._bytes > MOST_BYTES or self._counts.waiting > MOST_BYTES_OF_ALL

    def _add(self, size: int) -> None:
        self._bytes += size
        self._counts.waiting += size

    def _drop(self, index: int) -> None:
        self._add(-self._messages[index].size)
        del self._messages[index]
        self._counts.dropped += 1
