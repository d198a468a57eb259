"""What waits to be sent to one who does not keep up: bounded, the oldest thrown away first."""

from collections import deque

__all__ = ["Budget", "Outbox"]

MOST_MESSAGES = 256
MOST_BYTES = 1 << 24
"""Of one connection; a single message may be larger."""
ALL_BYTES = 1 << 28
"""Of all connections together."""


class Budget:
    """Bytes that all share."""

    def __init__(self, most: int = ALL_BYTES) -> None:
        self.most = most
        self.used = 0

    @property
    def is_spent(self) -> bool:
        """Whether more is held than there is."""
        return self.used > self.most


class Outbox:
    """Messages for one connection, in order. The newest is always kept, so that a latched one is not lost."""

    def __init__(self, budget: Budget, most_messages: int = MOST_MESSAGES, most_bytes: int = MOST_BYTES) -> None:
        self.dropped = 0
        self.bytes = 0
        self._budget = budget
        self._limits = most_messages, most_bytes
        self._waiting: deque[bytearray] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def push(self, frame: bytearray) -> int:
        """Add the newest; returns how many older ones were thrown away for it."""
        self._waiting.append(frame)
        self._count(len(frame))
        dropped = 0
        while len(self._waiting) > 1 and self._is_over():
            self._count(-len(self._waiting.popleft()))
            dropped += 1
        self.dropped += dropped
        return dropped

    def pop(self) -> bytearray | None:
        """Take the oldest."""
        if not self._waiting:
            return None
        frame = self._waiting.popleft()
        self._count(-len(frame))
        return frame

    def clear(self) -> None:
        """Throw all away, uncounted: nobody is there to get it."""
        while self.pop() is not None:
            pass

    def _is_over(self) -> bool:
        most_messages, most_bytes = self._limits
        return len(self._waiting) > most_messages or self.bytes > most_bytes or self._budget.is_spent

    def _count(self, size: int) -> None:
        self.bytes += size
        self._budget.used += size
