"""The velocity loop, which holds a surge speed and a yaw rate, and the allocation of its force and moment to thrusters.

Two laws of proportional and integral action, one for each, with the drag of the wanted motion fed forward (Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 15.3). By default the boat is not pushed sideways:
it may drift in a turn or a wind, and its guidance makes up for that. For a user without guidance a third law holds
the sway at zero, so that the course is the heading and a turn has the radius of speed over yaw rate.

Every thruster pushes along its line; one that steers counts as two, along the hull and across it (the extended thrust
representation: Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 11.2). The least forces that
add up to what is wanted come from the pseudoinverse; what is too much for a thruster is given up, the moment last.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.control.navigation import Estimate

if TYPE_CHECKING:
    from vrx_mj.runtime.hull import Hull, Propeller, Rudder
    from vrx_mj.runtime.observation import BoatObservation

_STEERING_ANGLE = math.radians(60.0)
"""A thruster that turns this far either way [rad] can push across the hull."""
_IDLE_FORCE = 2.0
"""A steered thruster with less force than this [N] is kept straight, so that its angle does not jitter."""
_MIN_CONDITION = 0.1
"""Thrusters push every way if the least singular value of their columns is above this share of the largest."""
_ROUNDING = 1e-9
"""Tolerance for rounding of forces [N] and angles [rad]."""
_SHARE_HALVINGS = 12
"""Halvings of the interval in which a share of the force is sought: to 1/4096."""
_MIN_RUDDER_SLOPE = 1e-9
"""A rudder with less moment per radian than this [N m] is left amidships."""
_MASS_TOLERANCE = 0.2
"""Share by which the mass of a boat with a WAM-V's drag may differ from the WAM-V's of the gains: its layouts differ by
14 %, and its payloads by as much."""
_SURGE_RATE = 1.2
"""Rate at which errors of surge speed decay [1/s]: a sixth of what calls at 10 Hz would allow."""
_SWAY_RATE = 1.2
"""Rate at which errors of sway decay [1/s]: that of surge."""
_TURN_RATE = 2.5
"""Rate at which errors of yaw rate decay [1/s]: twice that of surge, as guidance steers through this loop."""
_SATURATION = 1.0
"""Thrusters that miss the commanded force or moment by more than this [N, N m] are at their limits."""
_SWAY_HALVINGS = 6
"""Halvings of the interval in which the share of the force to port is sought: to 1/64."""
_MAX_TOP_SPEED, _SPEED_HALVINGS = 1024.0, 40
"""Largest top speed of a boat [m/s], and halvings of the interval in which it is sought."""
_INTEGRAL_SHARE = 0.2
"""Gain of the integral as a share of the rate [1/s]: it takes over wind and unknown drag in some 5 s."""


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
        able = [name for name in chosen if self._thrusters[name].max_angle >= _STEERING_ANGLE]
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
                commands[name + ANGLE_SUFFIX] = angle
            commands[name] = thruster.command(along)
        return Thrust(commands, float(given[0]), float(given[1]), float(given[2]))

    def _share(self, base: FloatArray, more: FloatArray) -> float:
        """How much of `more` the thrusters can give besides `base`, 0 to 1."""

        def is_given(share: float) -> bool:
            forces = base + share * more
            return all(_within(forces[own].tolist(), self._thrusters[name]) for name, own in self._slices)

        return largest_share(is_given, _SHARE_HALVINGS)


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
    return bool(sizes[-1] > _MIN_CONDITION * sizes[0])


def _columns(thrusters: "Mapping[str, Propeller]", steered: Sequence[str], centre: float) -> FloatArray:
    """Surge, sway and yaw (3, n) of a unit force of each thruster; one that steers has a second column, across."""
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
    in_range = thruster.max_reverse - _ROUNDING <= along <= thruster.max_forward + _ROUNDING
    return in_range and abs(angle) <= thruster.max_angle + _ROUNDING


def _angle_and_force(along: float, across: float, reach: float) -> tuple[float, float]:
    """Steering angle [rad] and force [N] of a thruster that is to push ahead and to port and turns by `reach` [rad].

    It pushes astern where it turns less far for it, or cannot turn far enough; in between, it goes on ahead.
    """
    force = math.hypot(along, across)
    if force < _IDLE_FORCE:
        return 0.0, along
    angle = math.atan2(across, along)
    if abs(angle) <= min(reach, math.pi / 2):
        return angle, force
    return angle - math.copysign(math.pi, angle), -force


@dataclass(frozen=True)
class Craft:
    """Model of a boat in calm water. Drag is linear and quadratic, and opposes each axis of its own."""

    mass: float
    """Mass of the boat with its load [kg]."""
    inertia: float
    """About the vertical through the centre of mass [kg m2]."""
    centre: float
    """Centre of mass, ahead of `base_link` [m]."""
    surge_drag: tuple[float, float]
    """Linear and quadratic drag ahead [N s/m], [N s2/m2]."""
    sway_drag: tuple[float, float]
    """Linear and quadratic drag to port [N s/m], [N s2/m2]."""
    yaw_drag: tuple[float, float]
    """Linear and quadratic drag of turning [N m s], [N m s2]."""
    length: float = 4.9
    """Length of the hull [m]."""
    rudders: Mapping[str, "Rudder"] = field(default_factory=dict)
    """Rudders by name."""
    resistance: Callable[[float], float] | None = None
    """Force [N] at a speed ahead [m/s] besides `surge_drag`; None: none was measured."""
    thrust_share: Callable[[float], float] | None = None
    """Share of full thrust ahead that is left at a speed ahead [m/s]; None: speed takes none of it."""

    def drag(self, surge: float, sway: float) -> tuple[float, float]:
        """Drag of the boat at a velocity [m/s] ahead and to port, as the forces [N] that balance it."""
        resistance = self.resistance(surge) if self.resistance else 0.0
        return _drag(self.surge_drag, surge) + resistance, _drag(self.sway_drag, sway)

    def turning_drag(self, turn: float) -> float:
        """The moment [N m] that keeps a turning rate [rad/s] up."""
        return _drag(self.yaw_drag, turn)

    def rudder_angles(self, moment: float, speed: float, thrust: float) -> dict[str, float]:
        """Angles [rad] by command with which rudders turn the boat with a moment [N m].

        `speed` [m/s] is that ahead and `thrust` [N] that of the propellers; astern both are nothing to a rudder.
        """
        speed, thrust, commands = max(speed, 0.0), max(thrust, 0.0), {}
        for name, rudder in self.rudders.items():
            arm = self.centre - rudder.position[0]
            slope = arm * rudder.force_slope(speed, thrust) * len(self.rudders)
            angle = -moment / slope if abs(slope) > _MIN_RUDDER_SLOPE else 0.0
            commands[name + ANGLE_SUFFIX] = clamp(angle, rudder.max_angle)
        return commands

    def top_speed(self, force: float) -> float:
        """The speed [m/s] that full thrust keeps up, a force ahead of so much [N] at rest."""
        if self.resistance is None and self.thrust_share is None:
            return steady_rate(self.surge_drag, force)

        def is_reached(speed: float) -> bool:
            left = self.thrust_share(speed) if self.thrust_share else 1.0
            return force * left >= self.drag(speed, 0.0)[0]

        most = 1.0
        while is_reached(most) and most < _MAX_TOP_SPEED:
            most *= 2.0
        return most * largest_share(lambda share: is_reached(share * most), _SPEED_HALVINGS)


def steady_rate(drag: tuple[float, float], push: float) -> float:
    """The speed [m/s] or rate [rad/s] that a force [N] or moment [N m] keeps up against linear and quadratic drag."""
    linear, quadratic = drag
    if quadratic == 0.0:
        return push / linear if linear > 0.0 else math.inf
    return (math.sqrt(linear * linear + 4.0 * quadratic * push) - linear) / (2.0 * quadratic)


def clamp(value: float, most: float) -> float:
    """A number, or the nearest within `most` of 0."""
    return max(-most, min(most, value))


def _drag(coefficients: tuple[float, float], speed: float) -> float:
    return (coefficients[0] + coefficients[1] * abs(speed)) * speed


WAMV = Craft(
    mass=299.0,
    inertia=780.0,
    centre=-0.25,
    surge_drag=(51.3, 72.4),
    sway_drag=(40.0, 0.0),
    yaw_drag=(400.0, 0.0),
)
"""The WAM-V of VRX classic, layout T with VRX's sensors; the others are within 10 %."""
WAMV_VRX3 = Craft(
    mass=299.0,
    inertia=780.0,
    centre=-0.25,
    surge_drag=(100.0, 150.0),
    sway_drag=(100.0, 100.0),
    yaw_drag=(800.0, 800.0),
)
"""The WAM-V of VRX 3."""


def craft_of(boat: "BoatObservation") -> Craft:
    """Dynamics of a boat: a WAM-V has the figures that the gains are for, another boat those of its hull.

    A boat whose observation has no hull, as one made by hand, is taken for a WAM-V.
    """
    wamv = wamv_of(boat.thrusters)
    hull: Hull | None = getattr(boat, "hull", None)
    if hull is None or _is(wamv, hull):
        return wamv
    return Craft(
        mass=hull.mass + hull.added_mass[0],
        inertia=hull.inertia + hull.added_mass[5],
        centre=hull.centre[0],
        surge_drag=(hull.drag_linear[0], hull.drag_quadratic[0]),
        sway_drag=(hull.drag_linear[1], hull.drag_quadratic[1]),
        yaw_drag=(hull.drag_linear[5], hull.drag_quadratic[5]),
        length=hull.length,
        rudders=hull.rudders,
        resistance=hull.resistance_at if hull.resistance else None,
        thrust_share=_thrust_share(boat.thrusters),
    )


def _thrust_share(thrusters: "Mapping[str, Propeller]") -> Callable[[float], float] | None:
    """Share of full thrust ahead that is left at a speed ahead [m/s]; None if speed takes nothing of it."""
    ways = [(own, own.direction[0]) for own in thrusters.values() if own.direction[0] != 0.0]
    pushes = [(own, way, own.max_forward if way > 0.0 else own.max_reverse) for own, way in ways]

    def thrust(speed: float) -> float:
        return sum(way * own.thrust_at(way * speed, force) for own, way, force in pushes)

    full = sum(way * force for _, way, force in pushes)
    return (lambda speed: thrust(speed) / full) if full and thrust(1.0) != full else None


def wamv_of(thrusters: "Mapping[str, Propeller]") -> Craft:
    """The WAM-V of VRX 3 where commands are newtons, else that of VRX classic."""
    newtons = any(getattr(thruster, "in_newtons", False) for thruster in thrusters.values())
    return WAMV_VRX3 if newtons else WAMV


def _is(wamv: Craft, hull: "Hull") -> bool:
    """Whether a hull has a WAM-V's drag, and nearly its mass."""
    drags = [(hull.drag_linear[axis], hull.drag_quadratic[axis]) for axis in (0, 1, 5)]
    alike = drags == [wamv.surge_drag, wamv.sway_drag, wamv.yaw_drag]
    return alike and abs(hull.mass - wamv.mass) <= _MASS_TOLERANCE * wamv.mass


class VelocityKeeper:
    """Holds the surge speed and the yaw rate of one boat."""

    def __init__(
        self, thrusters: "Mapping[str, Propeller]", craft: Craft | None = None, *, hold_sway: bool = False
    ) -> None:
        """`craft` has the boat's figures; by default they are the WAM-V's.

        With `hold_sway` the boat is kept from going sideways as far as its thrusters can push it across, and the speed
        is that over ground: what sway is left counts as a part of it.
        """
        self.craft = craft or wamv_of(thrusters)
        self._allocation = Allocation(thrusters, centre=self.craft.centre)
        self._hold_sway = hold_sway
        plenty = 2.0 * sum(thruster.max_forward for thruster in thrusters.values())
        self.top_speed = self.craft.top_speed(self._allocation(plenty, 0.0, 0.0).surge)
        """Full ahead in calm water [m/s]."""
        self._pushed = (0.0, 0.0, 0.0)
        self._then = math.inf

    def __call__(self, seen: Estimate, t: float, surge: float, turn: float) -> dict[str, float]:
        """Commands at the time `t` [s] for a surge speed [m/s] and a yaw rate [rad/s], positive to port."""
        aside = sway = 0.0
        if self._hold_sway:
            surge = _along(surge, seen.sway)
            if self._allocation.every_way:
                aside = -self.craft.mass * _SWAY_RATE * seen.sway
                sway = self.craft.mass * surge * turn + aside + self._pushed[1]  # toward the centre of the turn
        ahead = self.craft.mass * _SURGE_RATE * (surge - seen.surge)
        around = self.craft.inertia * _TURN_RATE * (turn - seen.turn)
        force = self.craft.drag(surge, 0.0)[0] + ahead + self._pushed[0]
        moment = self.craft.turning_drag(turn) + around + self._pushed[2]
        thrust = self._allocate(force, sway, moment)
        self._integrate(t, (ahead, force, thrust.surge), (aside, sway, thrust.sway), (around, moment, thrust.yaw))
        return {**thrust.commands, **self.craft.rudder_angles(moment, seen.surge, thrust.surge)}

    def _allocate(self, force: float, sway: float, moment: float) -> Thrust:
        """The force ahead goes before that to port, which is made less where the thrusters cannot give both."""

        def reaches(share: float) -> bool:
            return sway == 0.0 or abs(self._allocation(force, share * sway, moment).surge - force) < _SATURATION

        return self._allocation(force, largest_share(reaches, _SWAY_HALVINGS) * sway, moment)

    def _integrate(self, t: float, *axes: tuple[float, float, float]) -> None:
        """Take over what is lacking; not along an axis whose thrusters do not reach what is asked of them.

        An axis is what the error asks for, what all asks for, and what was given [N, N m].
        """
        interval, self._then = t - self._then, t
        if not 0.0 < interval < 1.0:
            return
        rates = (_SURGE_RATE, _SWAY_RATE, _TURN_RATE)
        surge, sway, turn = (
            pushed + rate * _INTEGRAL_SHARE * interval * (error if abs(given - wanted) < _SATURATION else 0.0)
            for pushed, rate, (error, wanted, given) in zip(self._pushed, rates, axes, strict=True)
        )
        self._pushed = (surge, sway, turn)


def _along(speed: float, sway: float) -> float:
    """The surge [m/s] of a boat with a speed over ground and a sway; at least half of that speed."""
    rest = math.sqrt(max(speed * speed - sway * sway, 0.25 * speed * speed))
    return math.copysign(rest, speed)
