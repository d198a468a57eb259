"""What water and engines do to a boat: the parameters of its forces."""

from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.base import Config, NonNegative, Positive, numbers

__all__ = ["HydrodynamicsConfig", "ServoConfig", "Six", "ThrusterConfig"]

Six = Annotated[tuple[NonNegative, NonNegative, NonNegative, NonNegative, NonNegative, NonNegative],
                numbers("surge sway heave roll pitch yaw")]  # fmt: skip


class ServoConfig(Config):
    """What turns an engine."""

    kp: NonNegative
    """Stiffness [N m/rad]."""
    kd: NonNegative
    """Damping [N m s/rad]."""
    effort: Positive
    """Largest torque [N m]."""
    velocity: Positive
    """Largest rate [rad/s]."""


class ThrusterConfig(Config):
    """VRX's usv_gazebo_thrust_plugin: from commands to forces."""

    mapping: Literal["linear", "glf"]
    max_command: Positive = 1.0
    max_force_forward: NonNegative = 250.0
    """At the largest command [N]."""
    max_force_reverse: Annotated[float, Field(le=0)] = -100.0
    """At the smallest command [N]."""
    timeout: float = 1.0
    """After which a command counts as zero [s]."""
    max_angle: NonNegative = 1.5707963267948966
    """Largest steering angle either way [rad]."""


class HydrodynamicsConfig(Config):
    """VRX's usv_gazebo_dynamics_plugin. Sixes are in the order surge, sway, heave, roll, pitch, yaw."""

    water_level: float = 0.0
    water_density: Positive = 997.8
    hull_radius: Positive
    boat_width: Positive
    boat_length: Positive
    length_n: Annotated[int, Field(ge=1, le=1000)] = 2
    """Stations along each hull."""
    added_mass: Six
    drag_linear: Six
    drag_quadratic: Six
