"""A share of the time: what answers calls must not take all of it from the simulation."""

from collections.abc import Callable

__all__ = ["Pace"]

SHARE = 0.25
"""Of the wall time that answers may take in the long run."""
BURST = 0.5
"""Wall time of answers that are given at once: a launch file or a recorder calls hundreds of times [s]."""


class Pace:
    """Says how long to wait before the next call is taken."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._paid_until = clock()

    def wait(self, spent: float) -> float:
        """How long to wait [s], now that an answer took so long [s]."""
        now = self._clock()
        self._paid_until = max(self._paid_until, now) + spent / SHARE
        return max(self._paid_until - now - BURST / SHARE, 0.0)
