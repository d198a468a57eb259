"""Durations as whole numbers of physics steps."""

import math
import operator

from vrx_mj.errors import CommandError

__all__ = ["steps_to_second", "whole", "whole_steps"]


def whole(what: str, value: object) -> int:
    """The value as an int.

    Raises:
        CommandError: it is no whole number.
    """
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise CommandError(f"invalid {what} {value!r}: a whole number is needed") from None


def whole_steps(duration: float, timestep: float) -> int:
    """Number of physics steps of `timestep` [s] in a duration [s].

    Raises:
        CommandError: it is not a whole number.
    """
    try:
        enough = duration >= timestep * (1.0 - 1e-6)
    except TypeError:
        raise CommandError(f"invalid duration {duration!r}: a number of seconds is needed") from None
    if not enough or math.isinf(duration):
        raise CommandError(f"invalid duration {duration:g} s: at least one timestep, {timestep:g} s, is needed")
    steps = round(duration / timestep)
    if abs(steps * timestep - duration) > 1e-4 * timestep:
        below = math.floor(duration / timestep)
        raise CommandError(
            f"invalid duration {duration:g} s: a multiple of the timestep {timestep:g} s is needed, "
            f"such as {below * timestep:g} or {(below + 1) * timestep:g} s"
        )
    return steps


def steps_to_second(time: float, timestep: float) -> int:
    """Number of physics steps of `timestep` [s] from `time` [s] to the next whole second."""
    per_second = max(1, round(1.0 / timestep))
    return per_second - round(time / timestep) % per_second
