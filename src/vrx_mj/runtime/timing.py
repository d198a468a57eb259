"""When something is due: samples at a rate of simulated time, durations in physics steps, and pauses between looks."""

import math
from collections.abc import Callable, Container

from vrx_mj.arguments import as_number
from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, shown
from vrx_mj.physics.kernel import kernel

_LONGEST = 1e9
"""Duration of a run [s], at most: 30 years."""
MOST_STEPS = 10**13
"""Physics steps of a run, at most."""


def whole_steps(duration: float, timestep: float) -> int:
    """Number of physics steps of `timestep` [s] in a duration [s].

    Raises:
        CommandError: it is not a whole number.
    """
    given = as_number(duration)
    if math.isnan(given) and not isinstance(duration, float):
        raise CommandError(f"invalid duration {shown(duration)}: a number of seconds is needed")
    if not given >= timestep * (1.0 - 1e-6) or math.isinf(given):
        raise CommandError(f"invalid duration {given:g} s: at least one timestep, {timestep:g} s, is needed")
    if given > _LONGEST:
        raise CommandError(f"invalid duration {given:g} s: at most {_LONGEST:g} s")
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
        """No pause yet; a look may come by `early` [s] before its end."""
        self._early = early
        self.end()

    def is_over(self, now: float) -> bool:
        """Whether it is time to look, at `now` [s]."""
        return now >= self._until - self._early

    def begin(self, now: float, period: float) -> None:
        """Pause for a period [s] from now on."""
        self._until = now + period

    def end(self) -> None:
        """It is time to look."""
        self._until = -math.inf
