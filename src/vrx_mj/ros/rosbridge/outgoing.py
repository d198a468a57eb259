"""What waits to be sent to a client, within bounds: one that does not keep up loses the oldest messages."""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["Counts", "Outgoing"]

MOST_MESSAGES = 1000
MOST_BYTES = 16 << 20
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
    """One message."""

    source: object
    make: Callable[[], list[bytes]]
    """Gives its frames: they are made when they can be sent, and not at all of what is thrown away."""
    binary: bool
    size: int
    """About so many [bytes]."""


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
        self._replies.append(Bundle(None, lambda: frames, binary, size))
        self._reply_bytes += size
        self._filled.set()
        return True

    def message(
        self, source: object, make: Callable[[], list[bytes]], binary: bool, size: int, most: int = 0
    ) -> None:  # fmt: skip
        """Send a topic's message of about so many bytes.

        At most so many of its `source` wait; 0: as many as there is room for.
        """
        if most and sum(bundle.source is source for bundle in self._messages) >= most:
            self._drop(next(index for index, bundle in enumerate(self._messages) if bundle.source is source))
        self._messages.append(Bundle(source, make, binary, size))
        self._add(size)
        while len(self._messages) > MOST_MESSAGES or (self._crowded and len(self._messages) > 1):
            self._drop(0)
        self._filled.set()

    def forget(self, source: object) -> None:
        """Throw away what waits of a subscription that ended."""
        self._messages = deque(bundle for bundle in self._messages if bundle.source is not source)
        self._add(sum(bundle.size for bundle in self._messages) - self._bytes)

    async def run(self, send: Callable[[bytes, bool], Awaitable[None]], trouble: Callable[[Exception], None]) -> None:
        """Send for ever: each frame, and whether it is binary; `trouble` is told of messages that cannot be written."""
        while True:
            await self._filled.wait()
            while (bundle := self._next()) is not None:
                try:
                    frames = bundle.make()
                except Exception as error:  # a message that is not of its type must not stop the others
                    trouble(error)
                    continue
                for frame in frames:
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
