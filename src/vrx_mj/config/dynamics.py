"""What water and engines do to a boat: the parameters of its forces."""

from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.base import Config, NonNegative, NotEmpty, Positive, Vec3, numbers

__all__ = ["HullConfig", "HydrodynamicsConfig", "ServoConfig", "Six", "ThrusterConfig"]

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

    mapping: Literal["linear", "glf", "newtons"]
    """What a command is: a share of the largest force, that on VRX's curve, or the force, as in profile vrx3."""
    max_command: Positive = 1.0
    max_force_forward: NonNegative = 250.0
    """At the largest command [N]."""
    max_force_reverse: Annotated[float, Field(le=0)] = -100.0
    """At the smallest command [N]."""
    timeout: float = 1.0
    """After which a command counts as zero [s]; 0: never, as in worlds of profile vrx3."""
    max_angle: NonNegative = 1.5707963267948966
    """Largest steering angle either way [rad]."""


class HullConfig(Config):
    """One float of a boat, lifted at points: VRX 3's Surface plugin. Each point stands for an equal piece of it."""

    length: Positive
    """Of the float [m]."""
    radius: Positive
    """Of the float [m]."""
    points: Annotated[tuple[Vec3, ...], NotEmpty]
    """On its keel line, in the base link's axes [m]."""


class HydrodynamicsConfig(Config):
    """VRX's usv_gazebo_dynamics_plugin, or VRX 3's SimpleHydrodynamics and Surface.

    Sixes are in the order surge, sway, heave, roll, pitch, yaw.
    """

    water_level: float = 0.0
    water_density: Positive = 997.8
    hull_radius: Positive
    boat_width: Positive
    boat_length: Positive
    length_n: Annotated[int, Field(ge=1, le=1000)] = 2
    """Stations along each hull."""
    hulls: tuple[HullConfig, ...] = ()
    """Where any are listed they carry the boat, and not two hulls with stations spread evenly along them."""
    added_mass: Six
    drag_linear: Six
    drag_quadratic: Six
