"""How much simulated time is due, so that it keeps its pace with the clock on the wall."""

from __future__ import annotations

from collections import deque

__all__ = ["PACES", "Pacer"]

PACES = (1.0 / 64.0, 64.0)
"""Slowest and fastest pace, as a multiple of real time."""
LONGEST = 1.0
"""Wall time [s] that is made up for, at most: after a longer halt, time goes on from where it was."""
WINDOW = 1.0
"""Wall time [s] over which the pace that is really kept is measured."""


class Pacer:
    """Turns wall time into physics steps."""

    def __init__(self, timestep: float, pace: float, now: float) -> None:
        self._timestep = timestep
        self.pace = pace
        """Simulated seconds asked for per second."""
        self.paused = False
        self.restart(now)

    def restart(self, now: float) -> None:
        """Begin again at wall time `now` [s]: nothing is owed, nothing is measured."""
        self._last, self._owed, self._done = now, 0.0, 0
        self._marks: deque[tuple[float, int]] = deque([(now, 0)])

    def due(self, now: float) -> int:
        """Physics steps that are due at wall time `now` [s]."""
        elapsed, self._last = min(now - self._last, LONGEST), now
        if self.paused:
            self._owed = 0.0
            return 0
        self._owed += elapsed * self.pace / self._timestep
        steps = int(self._owed + 1e-9)
        self._owed -= steps
        return steps

    def did(self, steps: int, now: float) -> None:
        """Note that so many steps were made by wall time `now` [s]."""
        self._done += steps
        self._marks.append((now, self._done))
        while len(self._marks) > 2 and self._marks[1][0] <= now - WINDOW:
            self._marks.popleft()

    @property
    def kept(self) -> float:
        """The pace of about the last second."""
        (begun, before), (now, done) = self._marks[0], self._marks[-1]
        return (done - before) * self._timestep / (now - begun) if now > begun else 0.0

    def change(self, factor: float) -> None:
        """Multiply the pace, within `PACES`."""
        self.pace = min(max(self.pace * factor, PACES[0]), PACES[1])
