"""What commands a kind of boat takes: their names, limits and units, which follow the profile of a world's physics."""

import warnings
from collections.abc import Iterator
from itertools import groupby
from typing import get_args

from vrx_mj.config.boats import Boat, Thruster
from vrx_mj.config.build import Order, build_boat
from vrx_mj.config.profiles import Profile
from vrx_mj.errors import VrxError, VrxWarning

__all__ = ["command_lines"]


def command_lines(robot: str) -> Iterator[str]:
    """For each profile a line about the commands of a robot with its first layout; none if it cannot be built."""
    for profile in get_args(Profile):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", VrxWarning)
                boat = build_boat(Order(robot, profile=profile))
        except VrxError:
            return
        shown = "; ".join((*_thrusts(boat), *_angles(boat)))
        yield f"{profile}: {shown}" if shown else f"{profile}: no commands"


def _thrusts(boat: Boat) -> Iterator[str]:
    """Thrusters that are alike together."""
    pushing = [thruster for thruster in boat.thrusters if thruster.rudder is None]
    for text, group in groupby(pushing, key=_thrust):
        yield f"{', '.join(thruster.name for thruster in group)} {text}"


def _thrust(thruster: Thruster) -> str:
    drive = thruster.drive
    ahead, astern = drive.max_force_forward, -drive.max_force_reverse
    lasts = f"for {drive.timeout:g} s" if drive.timeout > 0 else "until the next command"
    if drive.mapping == "newtons":
        return f"{-astern:g} to {ahead:g} N, {lasts}"
    limit = drive.max_command
    return f"{-limit:g} to {limit:g} of full power, which is at most {ahead:g} N ahead and {astern:g} N astern, {lasts}"


def _angles(boat: Boat) -> Iterator[str]:
    steered = [thruster for thruster in boat.thrusters if thruster.drive.max_angle > 0]
    for angle, group in groupby(steered, key=lambda thruster: thruster.drive.max_angle):
        names = ", ".join(f"{thruster.name}_angle" for thruster in group)
        yield f"{names} {-angle:.4g} to {angle:.4g} rad"
