"""The timeline of a recording, and the picking of rows at a lower rate."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import rerun as rr

from vrx_mj.arrays import BoolArray, FloatArray

__all__ = ["TIMELINE", "Ticker", "times"]

TIMELINE = "sim_time"


def times(seconds: npt.ArrayLike) -> rr.TimeColumn:
    """The timeline, to a microsecond: readers of finer durations lose what does not fit Python's timedelta."""
    microseconds = np.round(np.asarray(seconds, np.float64) * 1e6).astype("timedelta64[us]")
    return rr.TimeColumn(TIMELINE, duration=microseconds.astype("timedelta64[ns]"))


class Ticker:
    """Picks rows at a lower rate: the first row of each tick of its clock."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._last = -math.inf

    def __call__(self, time: FloatArray) -> BoolArray:
        """Which of the rows at `time` (n,) [s] to take."""
        tick = np.floor(time * self._rate + 1e-6)
        taken: BoolArray = np.diff(tick, prepend=self._last) != 0
        self._last = tick[-1]
        return taken
