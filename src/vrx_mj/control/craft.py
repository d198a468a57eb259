"""The boat as a control law knows it: mass, drag, and how fast its thrusters drive it.

The figures are VRX's for the WAM-V 16 (wamv_gazebo_dynamics_plugin.xacro, wamv_base.urdf.xacro). A boat of another kind
needs its own: `Craft(...)`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from vrx_mj.control.allocation import Propeller

__all__ = ["WAMV", "WAMV_VRX3", "Craft", "craft_of"]

FULL = 10.0
"""A largest command above this is in newtons, as in VRX 3; in VRX classic it is 1."""


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

    def drag(self, surge: float, sway: float) -> tuple[float, float]:
        """What holds the boat back at a velocity [m/s] ahead and to port: the forces [N] that keep it up."""
        return _drag(self.surge_drag, surge), _drag(self.sway_drag, sway)

    def turning_drag(self, turn: float) -> float:
        """The moment [N m] that keeps a turning rate [rad/s] up."""
        return _drag(self.yaw_drag, turn)

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


def craft_of(thrusters: Mapping[str, Propeller]) -> Craft:
    """The WAM-V of VRX 3 where commands are newtons, else that of VRX classic."""
    newtons = any(getattr(thruster, "max_command", 1.0) > FULL for thruster in thrusters.values())
    return WAMV_VRX3 if newtons else WAMV
