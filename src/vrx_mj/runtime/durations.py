"""Durations as whole numbers of physics steps."""

import math

from vrx_mj.arguments import as_number
from vrx_mj.errors import CommandError, shown

__all__ = ["MOST_STEPS", "steps_to_second", "whole_steps"]

LONGEST = 1e9
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
    if given > LONGEST:
        raise CommandError(f"invalid duration {given:g} s: at most {LONGEST:g} s")
    steps = round(given / timestep)
    if abs(steps * timestep - given) > 1e-4 * timestep:
        below = math.floor(given / timestep)
        raise CommandError(
            f"invalid duration {given:g} s: a multiple of the timestep {timestep:g} s is needed, "
            f"such as {below * timestep:g} or {(below + 1) * timestep:g} s"
        )
    return steps


def steps_to_second(time: float, timestep: float) -> int:
    """Number of physics steps of `timestep` [s] from `time` [s] to the next whole second."""
    per_second = max(1, round(1.0 / timestep))
    return per_second - round(time / timestep) % per_second
