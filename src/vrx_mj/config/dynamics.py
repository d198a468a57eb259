"""What water and engines do to a boat: the parameters of its forces."""

from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.base import Config
from vrx_mj.config.values import MAX_NUMBER, NonNegative, NotEmpty, Number, Positive, Vec3, numbers

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
    """The command that gives the largest force."""
    max_force_forward: NonNegative = 250.0
    """Force at the largest command [N]."""
    max_force_reverse: Annotated[float, Field(ge=-MAX_NUMBER, le=0)] = -100.0
    """Force at the smallest command [N]."""
    timeout: Number = 1.0
    """Time after which a command counts as zero [s]; 0: never, as in worlds of profile vrx3."""
    max_angle: NonNegative = 1.5707963267948966
    """Largest steering angle either way [rad]."""


class ContactConfig(Config):
    """How a hull yields to what it touches, as a mass on a spring and a damper."""

    duration: Annotated[float, Field(ge=0.05, le=2)] = 0.3
    """Time from the first touch to the last of a hull that hits a wall and rebounds [s]: 0.2 to 0.5 for inflatables."""
    damping_ratio: Annotated[float, Field(ge=0.05, le=0.95)] = 0.5
    """Share of the critical damping; with 0.5 it rebounds with 0.3 of its speed."""


class HullConfig(Config):
    """One float of a boat, lifted at points: VRX 3's Surface plugin. Each point has an equal piece of it."""

    length: Positive
    """Length of the float [m]."""
    radius: Positive
    """Radius of the float [m]."""
    points: Annotated[tuple[Vec3, ...], NotEmpty]
    """Points on the float's keel line, in the base link's axes [m]."""


class HydrodynamicsConfig(Config):
    """VRX's usv_gazebo_dynamics_plugin, or VRX 3's SimpleHydrodynamics and Surface.

    Sixes are in the order surge, sway, heave, roll, pitch, yaw.
    """

    water_level: Number = 0.0
    """Height of the water for this boat, above the sea's own mean level [m]: it floats that much higher."""
    water_density: Positive = 997.8
    """Density of the water [kg/m3]."""
    hull_radius: Positive
    """Radius of each of the two half-cylinders that carry the boat [m]."""
    boat_width: Positive
    """Distance between the axes of the two hulls [m]."""
    boat_length: Positive
    """Length of the hulls [m]."""
    length_n: Annotated[int, Field(ge=1, le=1000)] = 2
    """Stations along each hull."""
    hulls: tuple[HullConfig, ...] = ()
    """Where any are listed they carry the boat, and not two hulls with stations spread evenly along them."""
    added_mass: Six
    """Added mass, the diagonal of the matrix [kg, kg m2]."""
    drag_linear: Six
    """Linear drag [N s/m, N m s]."""
    drag_quadratic: Six
    """Quadratic drag [N s2/m2, N m s2]."""
