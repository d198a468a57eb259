"""The timeline of a recording, chunks of one row, and the picking of rows at a lower rate."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import BoolArray, FloatArray

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
