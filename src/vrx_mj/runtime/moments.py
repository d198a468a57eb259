"""What sensors see, kept at their own rates: one clock for every rate, and the moments that it caught.

A clock of rate r takes its k-th moment at the first step at or after k / r, so rates that do not divide the step are
kept on average, without drift; above the step's rate it takes one at every step, and numbers are left out. A clock
begins to run when a sensor is first asked for.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import StateError
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.timing import newest_sample, sample_number

__all__ = ["CLOCK", "Moment", "Moments", "capture"]


FASTEST = 1e6
"""Rate of a clock in a saved state, at most [1/s]."""

CLOCK = np.dtype(
    [
        ("rate", np.float64),  # [1/s]
        ("index", np.int64),  # of the last moment that was caught
        ("slot", np.int64),  # where that is: 0 or 1; the one before it is in the other
        ("time", np.float64),  # of the last moment [s]
        ("before", np.float64),  # of the one before it [s]; NaN: there is none
    ],
    align=True,
)


@dataclass(frozen=True)
class Moment:
    """All that sensors see at one time."""

    index: int
    """Number of the moment by its clock; 0 is at time 0."""
    time: float
    """[s]"""
    qpos: FloatArray
    qvel: FloatArray
    marks: FloatArray
    """What else there is: positions of beacons, shots left, what lights and placards show."""


@kernel
def capture(
    clocks: Table, moments: FloatArray, qpos: FloatArray, qvel: FloatArray, marks: FloatArray, time: float
) -> None:
    """Let every clock whose next moment is due at `time` [s] catch it; `moments` has shape (clocks, 2, numbers)."""
    for k in range(clocks.size):
        clock = clocks[k]
        index = newest_sample(clock.rate, time)
        if index != clock.index:
            clock.index, clock.slot = index, 1 - clock.slot
            clock.before, clock.time = clock.time, time
            _copy(moments[k, clock.slot], qpos, qvel, marks)


@kernel
def _copy(row: FloatArray, qpos: FloatArray, qvel: FloatArray, marks: FloatArray) -> None:
    for i in range(qpos.size):
        row[i] = qpos[i]
    for i in range(qvel.size):
        row[qpos.size + i] = qvel[i]
    for i in range(marks.size):
        row[qpos.size + qvel.size + i] = marks[i]


class Moments:
    """The clocks that run, what they caught, and the marks: part of a run's state."""

    def __init__(self, nq: int, nv: int, marks: Sequence[float]) -> None:
        self._nq, self._nv = nq, nv
        self._start = np.array(marks, np.float64)
        self.marks = self._start.copy()
        self.reset()

    def reset(self) -> None:
        """No clock runs, and the marks are as at the start."""
        self.marks[:] = self._start
        self.clocks = np.zeros(0, CLOCK)
        self.caught = np.zeros((0, 2, self._nq + self._nv + len(self.marks)))

    def runs(self, rate: float) -> bool:
        """Whether the clock of a rate has been started."""
        return bool((self.clocks["rate"] == rate).any())

    def start(self, rate: float, qpos: FloatArray, qvel: FloatArray, time: float) -> None:
        """Start the clock of a rate [1/s] with the present moment."""
        clock = np.array([(rate, sample_number(rate, time), 0, time, np.nan)], CLOCK)
        row = np.zeros((1, *self.caught.shape[1:]))
        row[0, 0] = np.concatenate((qpos, qvel, self.marks))
        self.clocks = np.concatenate((self.clocks, clock))
        self.caught = np.concatenate((self.caught, row))

    def catch(self, qpos: FloatArray, qvel: FloatArray, time: float) -> None:
        """Let the clocks catch what is due now, as they do in the loop."""
        capture(self.clocks, self.caught, qpos, qvel, self.marks, time)

    def renew(self, qpos: FloatArray, qvel: FloatArray, time: float) -> None:
        """The state of `time` was changed by hand: moments of this very time are caught again."""
        for k in np.flatnonzero(self.clocks["time"] == time):
            self.caught[k, self.clocks["slot"][k]] = np.concatenate((qpos, qvel, self.marks))

    def last(self, rate: float) -> tuple[Moment, Moment | None]:
        """The last moment that the clock of a rate caught, and the one before it: views, until it catches more."""
        row = self.clocks["rate"].tolist().index(rate)
        _, index, slot, time, before = self.clocks[row].item()  # plain numbers: this is called for every reading
        now = self._moment(index, time, self.caught[row, slot])
        if math.isnan(before):
            return now, None
        return now, self._moment(-1, before, self.caught[row, 1 - slot])

    def pack(self) -> bytes:
        """Marks, clocks and moments as bytes, the marks first: they alone bear on the motion."""
        count = np.int64(len(self.clocks))
        return b"".join(array.tobytes() for array in (self.marks, count, self.clocks, self.caught))

    def check(self, block: bytes) -> None:
        """Tell whether `unpack` can take these bytes.

        Raises:
            StateError: it cannot.
        """
        start = self.marks.nbytes
        count = int(np.frombuffer(block, np.int64, 1, start)[0]) if len(block) >= start + 8 else -1
        needed = self._size(max(count, 0))
        if count < 0 or len(block) != needed:
            raise StateError(f"the state has {len(block)} bytes of sensors' moments instead of {needed}")
        marks, clocks, caught = self.parts(block)
        rate, before = clocks["rate"], clocks["before"]
        if not ((rate > 0.0) & (rate <= FASTEST) & (clocks["index"] >= 0) & np.isin(clocks["slot"], (0, 1))).all():
            raise StateError("the state has a sensors' clock with an invalid rate, index or slot")
        if not (np.isfinite(clocks["time"]) & (np.isfinite(before) | np.isnan(before))).all():
            raise StateError("the state has a sensors' clock whose time is not finite")
        if not (np.isfinite(marks).all() and np.isfinite(caught).all()):
            raise StateError("the state has sensors' moments that are not finite")

    def parts(self, block: bytes) -> tuple[FloatArray, Table, FloatArray]:
        """Marks, clocks and moments, as views, of bytes that have the right size."""
        start, width = self.marks.nbytes, self.caught.shape[2]
        count = int(np.frombuffer(block, np.int64, 1, start)[0])
        end = start + 8 + count * CLOCK.itemsize
        caught = np.frombuffer(block[end:], np.float64).reshape(count, 2, width)
        return np.frombuffer(block[:start], np.float64), np.frombuffer(block[start + 8 : end], CLOCK), caught

    def unpack(self, block: bytes) -> None:
        """Write back what `pack` gave."""
        marks, clocks, caught = self.parts(block)
        self.marks[:] = marks
        self.clocks, self.caught = clocks.copy(), caught.copy()

    def _size(self, count: int) -> int:
        return 8 + count * (CLOCK.itemsize + 16 * self.caught.shape[2]) + self.marks.nbytes

    def _moment(self, index: int, time: float, row: FloatArray) -> Moment:
        end = self._nq + self._nv
        return Moment(index, time, row[: self._nq], row[self._nq : end], row[end:])
