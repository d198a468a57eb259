"""What sensors see, kept at their own rates: one clock for every rate, and the moments that it latches.

A clock of rate r latches its k-th moment at the first step at or after k / r, so rates that do not divide the step are
kept on average, without drift; above the step's rate it latches one at every step, and numbers are left out. A clock
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

_FASTEST = 1e6
"""Rate of a clock in a saved state, at most [1/s]."""

CLOCK = np.dtype(
    [
        ("rate", np.float64),  # [1/s]
        ("index", np.int64),  # of the last moment that was latched
        ("slot", np.int64),  # where that is: 0 or 1; the one before it is in the other
        ("time", np.float64),  # of the last moment [s]
        ("before", np.float64),  # of the one before it [s]; NaN: this is the first
    ],
    align=True,
)


@dataclass(frozen=True)
class Moment:
    """All that sensors see at one time."""

    index: int
    """Number of the moment by its clock; 0 is at time 0."""
    time: float
    """Simulated time [s]."""
    qpos: FloatArray
    qvel: FloatArray
    device_state: FloatArray
    """State of devices: positions of beacons, shots left, what lights and placards show."""


@kernel
def latch(
    clocks: Table, latched: FloatArray, qpos: FloatArray, qvel: FloatArray, device_state: FloatArray, time: float
) -> None:
    """Let every clock whose next moment is due at `time` [s] latch it; `latched` has shape (clocks, 2, numbers)."""
    for k in range(clocks.size):
        clock = clocks[k]
        index = newest_sample(clock.rate, time)
        if index != clock.index:
            clock.index, clock.slot = index, 1 - clock.slot
            clock.before, clock.time = clock.time, time
            _copy(latched[k, clock.slot], qpos, qvel, device_state)


@kernel
def _copy(row: FloatArray, qpos: FloatArray, qvel: FloatArray, device_state: FloatArray) -> None:
    for i in range(qpos.size):
        row[i] = qpos[i]
    for i in range(qvel.size):
        row[qpos.size + i] = qvel[i]
    for i in range(device_state.size):
        row[qpos.size + qvel.size + i] = device_state[i]


class SampleClocks:
    """The clocks that run, what they latched, and the state of devices: part of a run's state."""

    def __init__(self, nq: int, nv: int, device_state: Sequence[float]) -> None:
        self._nq, self._nv = nq, nv
        self._start = np.array(device_state, np.float64)
        self.device_state = self._start.copy()
        self.reset()

    def reset(self) -> None:
        """Stop all clocks, and bring the devices to their start."""
        self.device_state[:] = self._start
        self.clocks = np.zeros(0, CLOCK)
        self.latched = np.zeros((0, 2, self._nq + self._nv + len(self.device_state)))

    def runs(self, rate: float) -> bool:
        """Whether the clock of a rate has been started."""
        return bool((self.clocks["rate"] == rate).any())

    def start(self, rate: float, qpos: FloatArray, qvel: FloatArray, time: float) -> None:
        """Start the clock of a rate [1/s] with the present moment."""
        clock = np.array([(rate, sample_number(rate, time), 0, time, np.nan)], CLOCK)
        row = np.zeros((1, *self.latched.shape[1:]))
        row[0, 0] = np.concatenate((qpos, qvel, self.device_state))
        self.clocks = np.concatenate((self.clocks, clock))
        self.latched = np.concatenate((self.latched, row))

    def latch_due(self, qpos: FloatArray, qvel: FloatArray, time: float) -> None:
        """Let the clocks latch what is due now, as they do in the loop."""
        latch(self.clocks, self.latched, qpos, qvel, self.device_state, time)

    def renew(self, qpos: FloatArray, qvel: FloatArray, time: float) -> None:
        """The state of `time` was changed by hand: moments of this very time are latched again."""
        for k in np.flatnonzero(self.clocks["time"] == time):
            self.latched[k, self.clocks["slot"][k]] = np.concatenate((qpos, qvel, self.device_state))

    def last(self, rate: float) -> tuple[Moment, Moment | None]:
        """The last moment that the clock of a rate latched, and the one before it: views, until it latches more."""
        row = self.clocks["rate"].tolist().index(rate)
        _, index, slot, time, before = self.clocks[row].item()  # plain numbers: this is called for every reading
        now = self._moment(index, time, self.latched[row, slot])
        if math.isnan(before):
            return now, None
        return now, self._moment(-1, before, self.latched[row, 1 - slot])

    def pack(self) -> bytes:
        """Device state, clocks and moments as bytes; of these the device state alone affects the motion."""
        count = np.int64(len(self.clocks))
        return b"".join(array.tobytes() for array in (self.device_state, count, self.clocks, self.latched))

    def check(self, block: bytes) -> None:
        """Check that `unpack` can take these bytes.

        Raises:
            StateError: it cannot.
        """
        start = self.device_state.nbytes
        count = int(np.frombuffer(block, np.int64, 1, start)[0]) if len(block) >= start + 8 else -1
        needed = 8 + max(count, 0) * (CLOCK.itemsize + 16 * self.latched.shape[2]) + self.device_state.nbytes
        if count < 0 or len(block) != needed:
            raise StateError(f"the state has {len(block)} bytes of sensors' moments instead of {needed}")
        device_state, clocks, latched = self.parts(block)
        rate, before = clocks["rate"], clocks["before"]
        if not ((rate > 0.0) & (rate <= _FASTEST) & (clocks["index"] >= 0) & np.isin(clocks["slot"], (0, 1))).all():
            raise StateError("the state has a sensors' clock with an invalid rate, index or slot")
        if not (np.isfinite(clocks["time"]) & (np.isfinite(before) | np.isnan(before))).all():
            raise StateError("the state has a sensors' clock whose time is not finite")
        if not (np.isfinite(device_state).all() and np.isfinite(latched).all()):
            raise StateError("the state has sensors' moments that are not finite")

    def parts(self, block: bytes) -> tuple[FloatArray, Table, FloatArray]:
        """Device state, clocks and moments, as views, of bytes that have the right size."""
        start, width = self.device_state.nbytes, self.latched.shape[2]
        count = int(np.frombuffer(block, np.int64, 1, start)[0])
        end = start + 8 + count * CLOCK.itemsize
        latched = np.frombuffer(block[end:], np.float64).reshape(count, 2, width)
        return np.frombuffer(block[:start], np.float64), np.frombuffer(block[start + 8 : end], CLOCK), latched

    def unpack(self, block: bytes) -> None:
        """Write back what `pack` gave."""
        device_state, clocks, latched = self.parts(block)
        self.device_state[:] = device_state
        self.clocks, self.latched = clocks.copy(), latched.copy()

    def _moment(self, index: int, time: float, row: FloatArray) -> Moment:
        end = self._nq + self._nv
        return Moment(index, time, row[: self._nq], row[self._nq : end], row[end:])
