"""Thrust allocation: from a wanted force and moment on the hull to commands of thrusters and steering angles.

Every thruster pushes along its line; one that steers counts as two, along the hull and across it (the extended thrust
representation: Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 11.2). The least forces that
add up to what is wanted come from the pseudoinverse; what is too much for a thruster is given up, the moment last.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arrays import FloatArray

if TYPE_CHECKING:
    from vrx_mj.runtime.hull import Propeller

_STEERING = math.radians(60.0)
"""A thruster that turns this far either way can push across the hull."""
_IDLE = 2.0
"""Below this force [N] a thruster that steers keeps straight, so that it does not turn about nothing."""
_INDEPENDENT = 0.1
"""Thrusters push every way if the least singular value of their columns is above this share of the largest."""
_SLACK = 1e-9
"""Rounding of forces [N] and angles [rad]."""
_HALVINGS = 12
"""Halvings of the interval in which a share is sought: to 1/4096."""


@dataclass(frozen=True)
class Thrust:
    """Commands, and what they give."""

    commands: dict[str, float]
    surge: float
    """Force ahead [N]."""
    sway: float
    """Force to port [N]."""
    yaw: float
    """Moment to port [N m], about the allocation's centre."""


class Allocation:
    """Shares out forces among the thrusters of one boat."""

    def __init__(
        self, thrusters: "Mapping[str, Propeller]", *, steer: Sequence[str] | bool | None = None, centre: float = 0.0
    ) -> None:
        """Moments are about a point, the `centre` of mass say, so far ahead of `base_link` [m].

        `steer` gives the names of those that shall steer, all or none; by default none, unless the boat needs
        it. A boat needs it that its thrusters, kept straight, cannot push every way, as the WAM-V of layout H.
        """
        self._thrusters = dict(thrusters)
        if steer is None:
            steer = not _pushes_every_way(_columns(self._thrusters, (), centre))
        chosen = self._thrusters if steer is True else steer or ()
        able = [name for name in chosen if self._thrusters[name].max_angle >= _STEERING]
        self._matrix = _columns(self._thrusters, able, centre)
        self._inverse: FloatArray = np.asarray(np.linalg.pinv(self._matrix, rcond=1e-3), np.float64)
        self._slices: list[tuple[str, slice]] = []
        for name in self._thrusters:
            start = self._slices[-1][1].stop if self._slices else 0
            self._slices.append((name, slice(start, start + (2 if name in able else 1))))

    @property
    def every_way(self) -> bool:
        """Whether it can push ahead, across and around at will."""
        return _pushes_every_way(self._matrix)

    def __call__(self, surge: float, sway: float, yaw: float) -> Thrust:
        """Commands for a force [N] ahead and to port and a moment [N m] to port.

        What is too much is made less: first the force, whose direction is kept, then the moment.
        """
        turning, pushing = self._inverse @ [0.0, 0.0, yaw], self._inverse @ [surge, sway, 0.0]
        turning = turning * self._share(np.zeros_like(turning), turning)
        forces = turning + pushing * self._share(turning, pushing)
        given = self._matrix @ forces
        commands = {}
        for name, own in self._slices:
            thruster, (along, *across) = self._thrusters[name], forces[own].tolist()
            if across:
                angle, along = _angle_and_force(along, across[0], thruster.max_angle)
                commands[f"{name}_angle"] = angle
            commands[name] = thruster.command(along)
        return Thrust(commands, float(given[0]), float(given[1]), float(given[2]))

    def _share(self, base: FloatArray, more: FloatArray) -> float:
        """How much of `more` the thrusters can give besides `base`, 0 to 1."""

        def is_given(share: float) -> bool:
            forces = base + share * more
            return all(_within(forces[own].tolist(), self._thrusters[name]) for name, own in self._slices)

        return largest_share(is_given, _HALVINGS)


def largest_share(holds: Callable[[float], bool], halvings: int) -> float:
    """The largest share, 0 to 1, for which a condition holds that smaller shares meet, by halving of the interval."""
    if holds(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _pushes_every_way(matrix: FloatArray) -> bool:
    """Whether the columns of surge, sway and yaw, (3, n), span all three well enough."""
    if matrix.shape[1] < 3:
        return False
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return bool(sizes[-1] > _INDEPENDENT * sizes[0])


def _columns(thrusters: "Mapping[str, Propeller]", steered: Sequence[str], centre: float) -> FloatArray:
    """(3, n): surge, sway and yaw of a unit force of each thruster; one that steers has a second column, across."""
    columns: list[list[float]] = []
    for name, thruster in thrusters.items():
        (x, y, _), (ahead, left, _) = thruster.position, thruster.direction
        x -= centre
        columns.append([ahead, left, x * left - y * ahead])
        if name in steered:
            columns.append([-left, ahead, x * ahead + y * left])
    return np.array(columns).reshape(-1, 3).T


def _within(force: Sequence[float], thruster: "Propeller") -> bool:
    """Whether a thruster can give a force [N] along its line, or along and across it."""
    along, *across = force
    angle, along = _angle_and_force(along, across[0], thruster.max_angle) if across else (0.0, along)
    in_range = thruster.max_reverse - _SLACK <= along <= thruster.max_forward + _SLACK
    return in_range and abs(angle) <= thruster.max_angle + _SLACK


def _angle_and_force(along: float, across: float, reach: float) -> tuple[float, float]:
    """Steering angle [rad] and force [N] of a thruster that is to push ahead and to port and turns by `reach` [rad].

    It pushes astern where it turns less far for it, or cannot turn far enough; in between, it goes on ahead.
    """
    force = math.hypot(along, across)
    if force < _IDLE:
        return 0.0, along
    angle = math.atan2(across, along)
    if abs(angle) <= min(reach, math.pi / 2):
        return angle, force
    return angle - math.copysign(math.pi, angle), -force
