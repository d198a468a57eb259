"""The timeline of a recording, chunks of one row, and the picking of rows: at a lower rate, or where values change."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.physics.kernel import kernel

TIMELINE = "sim_time"


def times(seconds: npt.ArrayLike) -> rr.TimeColumn:
    """The timeline, to a microsecond: readers of finer durations lose what does not fit Python's timedelta."""
    microseconds = np.round(np.asarray(seconds, np.float64) * 1e6).astype("timedelta64[us]")
    return rr.TimeColumn(TIMELINE, duration=microseconds.astype("timedelta64[ns]"))


def static(path: str, *archetypes: rr.AsComponents) -> Chunk:
    """A chunk of one row without time."""
    return shown(None, path, *archetypes)


def shown(begun: float | None, path: str, *archetypes: rr.AsComponents) -> Chunk:
    """A chunk of one row, of a time [s], or without time."""
    columns = [
        column
        for archetype in archetypes
        for batch in archetype.as_component_batches()
        for column in [rr.ComponentColumn(batch.component_descriptor(), batch, lengths=[batch_size(batch)])]
    ]
    return Chunk.from_columns(path, [] if begun is None else [times([begun])], columns)


def batch_size(batch: rr.ComponentBatchLike) -> int:
    """Number of values in a batch."""
    return len(batch.as_arrow_array())


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


class Threshold:
    """Picks rows so that every row is near the last picked one: the first, and each that is not."""

    def __init__(self, within: npt.ArrayLike) -> None:
        """`within`: how far values (k,) of a row may be from those of the last picked one."""
        self._within = np.asarray(within, np.float64)
        self._last = np.full(0, np.nan)

    def __call__(self, values: FloatArray) -> BoolArray:
        """Which of the rows (n, k) to take."""
        taken = np.empty(len(values), np.bool_)
        self._last = self._last if self._last.shape == values.shape[1:] else np.full(values.shape[1], np.nan)
        _pick(np.ascontiguousarray(values), np.broadcast_to(self._within, self._last.shape).copy(), self._last, taken)
        return taken


@kernel
def _pick(values: FloatArray, within: FloatArray, last: FloatArray, taken: BoolArray) -> None:
    """Write which rows of `values` (n, k) have one further than `within` (k,) from `last` (k,), which follows them."""
    for i in range(values.shape[0]):
        taken[i] = False
        for j in range(values.shape[1]):
            if not abs(values[i, j] - last[j]) <= within[j]:  # NaN is the first
                taken[i] = True
        if taken[i]:
            for j in range(values.shape[1]):
                last[j] = values[i, j]
