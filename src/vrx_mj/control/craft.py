"""The boat as a control law knows it: mass, drag, and how fast its thrusters drive it.

The WAM-V's figures are VRX's (wamv_gazebo_dynamics_plugin.xacro, wamv_base.urdf.xacro). Those of another boat are its
hull's, as the observation of the boat has them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from vrx_mj.control.allocation import Propeller

if TYPE_CHECKING:
    from vrx_mj.runtime.hull import Hull, Rudder
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["WAMV", "WAMV_VRX3", "Craft", "craft_of", "wamv_of"]

FULL = 10.0
"""A largest command above this is in newtons, as in VRX 3; in VRX classic it is 1."""
NO_SLOPE = 1e-9
"""A rudder whose moment per radian is less [N m] turns nothing."""
TUNED = 0.2
"""Share by which the mass of a boat with a WAM-V's drag may differ from the WAM-V's of the gains: its layouts differ by
14 %, and its payloads by as much."""


@dataclass(frozen=True)
class Craft:
    """Of a boat in calm water. Drag is linear and quadratic, and opposes each axis of its own."""

    mass: float
    """With what it carries [kg]."""
    inertia: float
    """About the vertical through the centre of mass [kg m2]."""
    centre: float
    """Of mass, ahead of `base_link` [m]."""
    surge_drag: tuple[float, float]
    """[N s/m] and [N s2/m2]"""
    sway_drag: tuple[float, float]
    """[N s/m] and [N s2/m2]"""
    yaw_drag: tuple[float, float]
    """[N m s] and [N m s2]"""
    length: float = 4.9
    """Of the hull [m]."""
    rudders: Mapping[str, "Rudder"] = field(default_factory=dict)
    """By name."""

    def drag(self, surge: float, sway: float) -> tuple[float, float]:
        """What holds the boat back at a velocity [m/s] ahead and to port: the forces [N] that keep it up."""
        return _drag(self.surge_drag, surge), _drag(self.sway_drag, sway)

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
            angle = -moment / slope if abs(slope) > NO_SLOPE else 0.0
            commands[f"{name}_angle"] = max(-rudder.max_angle, min(rudder.max_angle, angle))
        return commands

    def top_speed(self, force: float) -> float:
        """The speed [m/s] that a force ahead [N] keeps up."""
        linear, quadratic = self.surge_drag
        if quadratic == 0.0:
            return force / linear
        return (math.sqrt(linear * linear + 4.0 * quadratic * force) - linear) / (2.0 * quadratic)


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
    """What a boat is: a WAM-V, with the figures of the gains, or else what its hull's figures say.

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
    )


def wamv_of(thrusters: Mapping[str, Propeller]) -> Craft:
    """The WAM-V of VRX 3 where commands are newtons, else that of VRX classic."""
    newtons = any(getattr(thruster, "max_command", 1.0) > FULL for thruster in thrusters.values())
    return WAMV_VRX3 if newtons else WAMV


def _is(wamv: Craft, hull: "Hull") -> bool:
    """Whether a hull has a WAM-V's drag, and nearly its mass."""
    drags = [(hull.drag_linear[axis], hull.drag_quadratic[axis]) for axis in (0, 1, 5)]
    alike = drags == [wamv.surge_drag, wamv.sway_drag, wamv.yaw_drag]
    return alike and abs(hull.mass - wamv.mass) <= TUNED * wamv.mass
