"""Durations as whole numbers of physics steps."""

import math

from vrx_mj.errors import CommandError

__all__ = ["steps_to_second", "whole_steps"]


def whole_steps(duration: float, timestep: float) -> int:
    """Number of physics steps of `timestep` [s] in a duration [s].

    Raises:
        CommandError: it is not a whole number.
    """
    if not duration >= timestep * (1.0 - 1e-6) or math.isinf(duration):
        raise CommandError(f"a duration of {duration:g} s: at least one timestep, {timestep:g} s, is needed")
    steps = round(duration / timestep)
    if abs(steps * timestep - duration) > 1e-4 * timestep:
        below = math.floor(duration / timestep)
        raise CommandError(
            f"a duration of {duration:g} s is no multiple of the timestep {timestep:g} s; "
            f"near it are {below * timestep:g} and {(below + 1) * timestep:g} s"
        )
    return steps


def steps_to_second(time: float, timestep: float) -> int:
    """Number of physics steps of `timestep` [s] from `time` [s] to the next whole second."""
    per_second = max(1, round(1.0 / timestep))
    return per_second - round(time / timestep) % per_second
