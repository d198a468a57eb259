"""A robot as its URDF describes it: links with masses, shapes and looks, and joints; poses along them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path
from typing import Any

from vrx_mj.config.dynamics import HydrodynamicsConfig, ThrusterConfig
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.frames import Pose, compose


@dataclass(frozen=True)
class Inertial:
    """Mass properties of a link."""

    mass: float
    """Mass [kg]."""
    pose: Pose
    """Pose of the centre of mass, with the axes of `tensor`, in the link's frame [m, rad]."""
    tensor: tuple[float, float, float, float, float, float]
    """ixx, iyy, izz, ixy, ixz, iyz [kg m2] about the centre of mass."""


@dataclass(frozen=True)
class Link:
    """A link; `inertial` is None if it has no mass."""

    name: str
    inertial: Inertial | None
    collisions: tuple[Shape, ...]
    visuals: tuple[Visual, ...]
    line: int | None = None


@dataclass(frozen=True)
class Limits:
    """What a joint can do."""

    lower: float = 0.0
    upper: float = 0.0
    effort: float = 0.0
    velocity: float = 0.0


@dataclass(frozen=True)
class Joint:
    """A joint; `pose` is of the child's frame in the parent's at `rest`."""

    name: str
    type: str
    """fixed, revolute, continuous, prismatic, floating or planar."""
    parent: str
    child: str
    pose: Pose
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    limits: Limits | None = None
    line: int | None = None
    rest: float = 0.0
    """Angle [rad] or distance [m] at rest: 0, or the limit that is nearest to it."""

    @property
    def locked(self) -> bool:
        """A revolute or prismatic joint whose limits leave no room: VRX's way to keep a link of its own."""
        return self.type in {"revolute", "prismatic"} and self.limits is not None and (
            self.limits.lower == self.limits.upper
        )  # fmt: skip


@dataclass(frozen=True)
class UrdfThruster:
    """A thruster of a plugin, by the names of its links and joints."""

    name: str
    """Stem of its topics: `left` of `thrusters/left_thrust_cmd`; else of its propeller's link."""
    propeller_link: str
    """Thrust acts at its origin, along `axis`."""
    propeller_joint: str | None
    engine_joint: str | None
    """What steers; None if nothing does."""
    drive: ThrusterConfig
    kp: float = 300.0
    kd: float = 20.0
    line: int | None = None
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    """Direction of the thrust in the propeller's link, of length 1."""


@dataclass(frozen=True)
class Gazebo:
    """What Gazebo's tags of a URDF mean to us."""

    thrusters: tuple[UrdfThruster, ...] = ()
    hydrodynamics: HydrodynamicsConfig | None = None
    water: Mapping[str, Any] = field(default_factory=dict)
    """Fields of `HydrodynamicsConfig` that are known where the rest is not; in a six None is what is not."""
    wind: tuple[float, float, float] | None = None
    """Coefficients, from VRX's wind plugin."""
    sensors: tuple[SensorConfig, ...] = ()
    """Posed in the root link's frame, names without the namespace."""
    warnings: tuple[str, ...] = ()
    """What the file asks for and is not done, each with its line."""


@dataclass(frozen=True)
class Urdf:
    """A robot; its links hang together as one tree."""

    file: Path
    name: str
    root: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    """Joints by name; each link but the root is the child of one."""
    gazebo: tuple[Any, ...] = ()
    """The `<gazebo>` elements (lxml), in the order of the file."""
    namespace: str = ""
    """Namespace of the links' names: `wamv` of `wamv/base_link`; empty if they have none."""
    remarks: tuple[str, ...] = ()
    """What the file asks for and is not done, besides its Gazebo tags, each with its line."""
    is_sdf: bool = False
    """Whether the file is a model of Gazebo: its plugins and sensors are in no `<gazebo>` there."""
    label: str = ""
    """What messages call the text that line numbers are of; empty: the file."""

    def local(self, name: str) -> str:
        """A link's or joint's name without the namespace."""
        return name.removeprefix(f"{self.namespace}/") if self.namespace else name


ZERO: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def link_pose(urdf: Urdf, link: str) -> Pose:
    """Pose of a link's frame in the root link's, every joint at zero [m, rad]. `link` is as the file calls it."""
    above = {joint.child: joint for joint in urdf.joints.values()}
    poses: list[Pose] = []
    while link in above:
        poses.append(above[link].pose)
        link = above[link].parent
    return chained(*reversed(poses))


def chained(*poses: Pose) -> Pose:
    """The pose of the last frame in the first one's parent; each pose is in the frame before it [m, rad]."""
    return reduce(compose, poses, ZERO)
