"""A limit on how long a peer may take over what it has begun to send."""

import asyncio
from collections.abc import Callable

__all__ = ["Stall"]

SECONDS = 10.0
"""Wall time in which a message must be whole, or have grown [s]."""
GROWTH = 1 << 16
"""By so much at least [bytes]."""


class Stall:
    """Ends a connection on which a message that has begun does not go on."""

    def __init__(self, end: Callable[[], object]) -> None:
        self._end = end
        self._timer: asyncio.TimerHandle | None = None
        self._size = 0

    def holds(self, size: int) -> None:
        """So many bytes of an incomplete message are there; 0: none."""
        if size and self._timer is not None and 0 <= size - self._size < GROWTH:
            return
        self.stop()
        if size:
            self._size = size
            self._timer = asyncio.get_running_loop().call_later(SECONDS, self._end)

    def stop(self) -> None:
        """Wait for nothing."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
