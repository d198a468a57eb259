"""When something is due: samples at a rate of simulated time, durations in physics steps, and clocks of sensors.

A clock of rate r latches its k-th moment at the first step at or after k / r, so rates that do not divide the step are
kept on average, without drift; above the step's rate it latches one at every step, and numbers are left out. A clock
begins to run when a sensor is first asked for.
"""

import math
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arguments import as_number
from vrx_mj.arrays import FloatArray
from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, StateError, quote
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import Table

MAX_DURATION = 1e9
"""Longest duration of a run [s]: 30 years."""
MOST_STEPS = 10**13
"""Largest number of physics steps of a run."""
_MAX_RATE = 1e6
"""Largest rate of a clock in a saved state [1/s]."""
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
"""A clock that ticks at a rate."""


def whole_steps(duration: float, timestep: float) -> int:
    """Number of physics steps of `timestep` [s] in a duration [s].

    Raises:
        CommandError: it is not a whole number.
    """
    given = as_number(duration)
    if math.isnan(given) and not isinstance(duration, float):
        raise CommandError(f"invalid duration {quote(duration)}: a number of seconds is needed")
    if not given >= timestep * (1.0 - 1e-6) or math.isinf(given):
        raise CommandError(f"invalid duration {given:g} s: at least one timestep, {timestep:g} s, is needed")
    if given > MAX_DURATION:
        raise CommandError(f"invalid duration {given:g} s: at most {MAX_DURATION:g} s")
    steps = round(given / timestep)
    if abs(steps * timestep - given) > 1e-4 * timestep:
        below = math.floor(given / timestep)
        raise CommandError(
            f"invalid duration {given:g} s: a multiple of the timestep {timestep:g} s is needed, "
            f"such as {below * timestep:g} or {(below + 1) * timestep:g} s"
        )
    return steps


def stride_of(rate: float, timestep: float) -> int:
    """Physics steps of `timestep` [s] between samples of a rate [1/s], at least one."""
    return max(1, round(1.0 / (rate * timestep)))


def steps_to_multiple(time: float, timestep: float, stride: int) -> int:
    """Number of physics steps of `timestep` [s] from `time` [s] to the next whole multiple of `stride` steps."""
    return stride - round(time / timestep) % stride


def steps_to_time(due: float, time: float, timestep: float, share: float = EARLY) -> int:
    """Physics steps from `time` to `due` [s], at least one; a rest of this share of a step makes no further one."""
    return max(1, math.ceil((due - time) / timestep - share))


@kernel
def newest_sample(rate: float, time: float) -> int:
    """Number of the newest sample of a rate [1/s] at `time` [s]: sample k = 0, 1, ... is due at k / rate."""
    return math.floor((time + EARLY) * rate)


sample_number: Callable[[float, float], int] = newest_sample.py_func  # type: ignore[attr-defined]
"""`newest_sample` for Python."""


class Schedule:
    """Which samples are due, each at a rate of its own, and which of them were taken."""

    def __init__(self) -> None:
        self._taken: dict[str, int] = {}

    def take(self, name: str, rate: float, time: float) -> bool:
        """Whether a new sample of a rate [1/s] is due at `time` [s]; it is taken then."""
        number = sample_number(rate, time)
        if number == self._taken.get(name, -1):
            return False
        self._taken[name] = number
        return True

    def keep(self, names: Container[str]) -> None:
        """Forget what was taken by all other names."""
        self._taken = {name: number for name, number in self._taken.items() if name in names}


class Pause:
    """A pause between two looks: by simulated time, or by the clock on the wall."""

    def __init__(self, early: float = 0.0) -> None:
        """Start without a pause; a look may come by `early` [s] before its end."""
        self._early = early
        self.end()

    def is_over(self, now: float) -> bool:
        """Whether it is time to look, at `now` [s]."""
        return now >= self._until - self._early

    def begin(self, now: float, period: float) -> None:
        """Pause for a period [s] from now on."""
        self._until = now + period

    def end(self) -> None:
        """End the pause now."""
        self._until = -math.inf


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
    """Latch the moment of every clock whose next one is due at `time` [s]; `latched` has shape (clocks, 2, numbers)."""
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
        """Latch the moments that are due now, as in the loop."""
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
            raise StateError(f"the state has {len(block)} bytes of sensor times instead of {needed}")
        device_state, clocks, latched = self.parts(block)
        rate, before = clocks["rate"], clocks["before"]
        if not ((rate > 0.0) & (rate <= _MAX_RATE) & (clocks["index"] >= 0) & np.isin(clocks["slot"], (0, 1))).all():
            raise StateError("the state has a sensor clock with an invalid rate, index or slot")
        if not (np.isfinite(clocks["time"]) & (np.isfinite(before) | np.isnan(before))).all():
            raise StateError("the state has a sensor clock whose time is not finite")
        if not (np.isfinite(device_state).all() and np.isfinite(latched).all()):
            raise StateError("the state has sensor times that are not finite")

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
