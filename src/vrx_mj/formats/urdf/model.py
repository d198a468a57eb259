"""A robot as a URDF or SDF describes it, in plain rows: links with masses and shapes, joints, plugins, sensors."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, reduce
from pathlib import Path
from typing import NamedTuple

from vrx_mj.config.dynamics import HullConfig, HydrodynamicsConfig, ThrusterConfig
from vrx_mj.config.robots import ChannelEntry, RudderEntry, SailEntry
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.errors import Problem
from vrx_mj.frames import IDENTITY, Pose, Vector, compose, inverse

Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Place:
    """Place of an element."""

    file: str = ""
    """Name of the file in messages."""
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        return self.file if self.line is None else f"{self.file}:{self.line}"

    def problem(self, key: str, message: str) -> Problem:
        """A problem with the element, or with a part of it."""
        return Problem(self.file, self.line, None, key, message)


class Loss(NamedTuple):
    """A part of a file that is not simulated, or differently."""

    place: Place
    what: str
    """The part, as the file calls it."""
    why: str
    """Reason, or what is done instead."""

    def __str__(self) -> str:
        return f"{self.place}: {self.what}: {self.why}"


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
class MeshRow:
    """A shape that is a mesh, whose file is still to be found."""

    file: str
    """Name of the mesh in the robot's file."""
    pose: Pose
    scale: Vector
    name: str | None
    color: Color | None
    """None: that of the mesh."""
    place: Place
    key: str
    """Path of the element that names it."""


@dataclass(frozen=True)
class Link:
    """A link; `inertial` is None if it has no mass."""

    name: str
    inertial: Inertial | None
    collisions: tuple[Shape, ...] = ()
    visuals: tuple[Visual, ...] = ()
    place: Place = Place()


@dataclass(frozen=True)
class LinkRow:
    """A link without its shapes, and those."""

    link: Link
    collisions: tuple[Shape | MeshRow, ...]
    visuals: tuple[Visual | MeshRow, ...]


@dataclass(frozen=True)
class Limits:
    """Limits of a joint."""

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
    axis: Vector = (1.0, 0.0, 0.0)
    limits: Limits | None = None
    place: Place = Place()
    rest: float = 0.0
    """Angle [rad] or distance [m] at rest: 0, or the limit that is nearest to it."""

    @property
    def is_locked(self) -> bool:
        """A revolute or prismatic joint whose limits leave no room: VRX's way to keep a link of its own."""
        return self.type in {"revolute", "prismatic"} and self.limits is not None and (
            self.limits.lower == self.limits.upper
        )  # fmt: skip


@dataclass(frozen=True)
class UrdfThruster:
    """A thruster of a plugin, by the names of the links and joints."""

    name: str
    """Stem of its topics: `left` of `thrusters/left_thrust_cmd`; else of its propeller's link."""
    propeller_link: str
    """Thrust acts at its origin, along `axis`."""
    propeller_joint: str | None
    engine_joint: str | None
    """Joint that steers; None if nothing does."""
    drive: ThrusterConfig
    kp: float = 300.0
    kd: float = 20.0
    place: Place = Place()
    axis: Vector = (1.0, 0.0, 0.0)
    """Direction of the thrust in the propeller's link, of length 1."""


_Water = dict[str, float | tuple[float | None, ...] | tuple[HullConfig, ...]]


@dataclass
class Gazebo:
    """Plugins and sensors in Gazebo's tags of a URDF."""

    thrusters: list[UrdfThruster] = field(default_factory=list)
    hydrodynamics: HydrodynamicsConfig | None = None
    water: _Water = field(default_factory=dict)
    """Fields of `HydrodynamicsConfig` that are known where the rest is not; in a six None is what is not."""
    wind: Vector | None = None
    """Coefficients, from VRX's wind plugin."""
    rudders: dict[str, RudderEntry] = field(default_factory=dict)
    """Rudders and keels."""
    sails: dict[str, SailEntry] = field(default_factory=dict)
    autopilot: dict[str, ChannelEntry] = field(default_factory=dict)
    """Channels of ArduPilot by number."""
    sensors: list[SensorConfig] = field(default_factory=list)
    """Posed in the root link's frame, names without the namespace."""
    warnings: list[Loss] = field(default_factory=list)
    """Plugins and sensors that are not simulated, or differently."""


@dataclass(frozen=True)
class Urdf:
    """A robot; its links hang together as one tree."""

    file: Path
    label: str
    """Name in messages of the file, or of the text that was made of it."""
    name: str
    root: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    """Joints by name; each link but the root is the child of one."""
    places: Mapping[str, Pose]
    """Pose of each link's frame in the root link's, all joints at rest [m, rad]."""
    namespace: str = ""
    """Namespace of the links' names: `wamv` of `wamv/base_link`; empty if they have none."""
    gazebo: Gazebo = field(default_factory=Gazebo)
    """Plugins and sensors."""
    remarks: tuple[Loss, ...] = ()
    """Other parts of the file that are ignored, or differ here."""
    text: str = ""
    """A URDF of it, where the file is none."""

    def local(self, name: str) -> str:
        """A link's or joint's name without the namespace."""
        return name.removeprefix(f"{self.namespace}/") if self.namespace else name

    @cached_property
    def above(self) -> Mapping[str, Joint]:
        """The joint on which each link hangs."""
        return {joint.child: joint for joint in self.joints.values()}

    def below(self, link: str) -> tuple[str, ...]:
        """A link and all that hangs on it."""
        children: dict[str, list[str]] = {}
        for joint in self.joints.values():
            children.setdefault(joint.parent, []).append(joint.child)
        found, waiting = [], [link]
        while waiting:
            found.append(waiting.pop())
            waiting += reversed(children.get(found[-1], ()))
        return tuple(found)

    def path(self, link: str, base: str) -> list[Joint]:
        """The joints from `base` to a link that hangs on it."""
        joints: list[Joint] = []
        while link != base:
            joints.append(self.above[link])
            link = joints[-1].parent
        return joints[::-1]

    def pose(self, link: str, base: str) -> Pose:
        """Pose of a link in the frame of one above it, all joints at rest [m, rad]."""
        if link != base and self.above[link].parent == base:
            return self.above[link].pose
        return relative(self.places[base], self.places[link])


def relative(outer: Pose, inner: Pose) -> Pose:
    """The pose of one frame in another, both given in a third."""
    return inner if outer == IDENTITY else IDENTITY if inner == outer else compose(inverse(outer), inner)


def chain(*poses: Pose) -> Pose:
    """The pose of the last frame in the first one's parent; each pose is in the frame before it [m, rad]."""
    return reduce(compose, poses, IDENTITY)
