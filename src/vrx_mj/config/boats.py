"""A boat as it is built: the parts of a URDF that move together, its thrusters, rudders, water and sensors.

Links on fixed joints belong to the base link, as in Gazebo; those on joints that do not turn, or that nothing
steers, are rigid here too, at zero. What steers is a joint of a thruster or of a rudder, with all that hangs on it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from vrx_mj.config.dynamics import HydrodynamicsConfig, ServoConfig, ThrusterConfig
from vrx_mj.config.poses import Pose, apply, compose, facing, inverse, rotation
from vrx_mj.config.robots import RobotConfig
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.urdf.model import Gazebo, Inertial, Joint, Link, Urdf, UrdfThruster
from vrx_mj.errors import ConfigError, Problem

__all__ = ["Boat", "Part", "Rudder", "Thruster", "assembled"]

Vector = tuple[float, float, float]
HERE: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Part:
    """A link, rigid in the frame of what carries it."""

    name: str
    pose: Pose
    """In the frame of the base link, or of the hinge it hangs on [m, rad]."""
    inertial: Inertial | None
    collisions: tuple[Shape, ...]
    visuals: tuple[Visual, ...]
    lumped: bool
    """Joined to the base link by fixed joints alone: Gazebo makes one link of these, and VRX pushes at its centre."""


@dataclass(frozen=True)
class Rudder:
    """The wing of a rudder."""

    area: float
    """[m2]"""
    aspect_ratio: float
    propeller: str | None
    """Thruster in whose race it stands."""
    propeller_diameter: float
    """[m]; 0 without a propeller."""
    race_share: float


@dataclass(frozen=True)
class Thruster:
    """What pushes: a propeller, on an engine that steers or fixed; or a rudder."""

    name: str
    link: str
    """Of the engine that turns, or of the propeller if nothing does."""
    joint: str | None
    """What steers; None: nothing does."""
    pose: Pose
    """Of the hinge in the base link's frame, its z axis the one of steering [m, rad]."""
    center: Vector
    """Where the force acts, in the hinge's frame [m]."""
    direction: Vector
    """Of the force at zero steering, in the hinge's frame."""
    drive: ThrusterConfig
    servo: ServoConfig
    parts: tuple[Part, ...]
    """All that turns, in the hinge's frame."""
    rudder: Rudder | None = None


@dataclass(frozen=True)
class Boat:
    """A kind of boat, furnished."""

    name: str
    link: str
    """The base link, without namespace."""
    parts: tuple[Part, ...]
    thrusters: tuple[Thruster, ...]
    hydrodynamics: HydrodynamicsConfig | None
    """None: not known, to be derived from the shapes."""
    wind: Vector | None
    sensors: tuple[SensorConfig, ...]
    warnings: tuple[str, ...] = ()


def assembled(urdf: Urdf, gazebo: Gazebo, config: RobotConfig) -> Boat:
    """The boat of a URDF, of its Gazebo tags and of the YAML beside it, which has the last word.

    Raises:
        ConfigError: the YAML names a link or joint that the URDF does not have, or two things steer with one joint.
    """
    tree = _Tree(urdf)
    thrusters = dict(_thrusters(urdf, gazebo, config))
    hinges = dict(_hinges(urdf, thrusters, config))
    turning = {name: tree.below(joint.child) for name, joint in hinges.items()}
    taken = {link for links in turning.values() for link in links}
    propellers = {item.propeller_joint for item in thrusters.values() if item.propeller_joint}
    steering = {joint.name for joint in hinges.values()}
    pushing = (*_engines(tree, thrusters, hinges), *_rudders(tree, config, hinges))
    return Boat(
        name=urdf.name,
        link=urdf.local(urdf.root),
        parts=tuple(tree.part(name, urdf.root) for name in urdf.links if name not in taken),
        thrusters=pushing,
        hydrodynamics=gazebo.hydrodynamics,
        wind=config.wind or gazebo.wind,
        sensors=(*gazebo.sensors, *_own_sensors(tree, config)),
        warnings=(*gazebo.warnings, *_loose(urdf, steering | propellers)),
    )


class _Tree:
    """Who hangs on whom."""

    def __init__(self, urdf: Urdf) -> None:
        self.urdf = urdf
        self.above = {joint.child: joint for joint in urdf.joints.values()}
        self.children: dict[str, list[str]] = {}
        for joint in urdf.joints.values():
            self.children.setdefault(joint.parent, []).append(joint.child)

    def below(self, link: str) -> tuple[str, ...]:
        """A link and all that hangs on it."""
        return (link, *(name for child in self.children.get(link, ()) for name in self.below(child)))

    def path(self, link: str, base: str) -> list[Joint]:
        """The joints from `base` to a link that hangs on it."""
        joints: list[Joint] = []
        while link != base:
            joints.insert(0, self.above[link])
            link = self.above[link].parent
        return joints

    def pose(self, link: str, base: str) -> Pose:
        """Pose of a link in the frame of one above it, with all joints at zero."""
        pose = HERE
        for joint in self.path(link, base):
            pose = joint.pose if pose == HERE else compose(pose, joint.pose)
        return pose

    def part(self, name: str, base: str, turn: Pose = HERE) -> Part:
        """A link in the frame of one above it, or in that frame turned by `turn`."""
        link: Link = self.urdf.links[name]
        pose = self.pose(name, base)
        return Part(
            name=self.urdf.local(name),
            pose=pose if turn == HERE else compose(inverse(turn), pose),
            inertial=link.inertial,
            collisions=link.collisions,
            visuals=link.visuals,
            lumped=all(joint.type == "fixed" for joint in self.path(name, base)),
        )


def _thrusters(urdf: Urdf, gazebo: Gazebo, config: RobotConfig) -> Iterator[tuple[str, UrdfThruster]]:
    """Those of the plugins, unless the YAML names any; each with its names as in the URDF."""
    if not config.thrusters:
        yield from ((item.name, item) for item in gazebo.thrusters)
        return
    for name, entry in config.thrusters.items():
        path = f"thrusters.{name}"
        link = _known(urdf, "link", entry.propeller, f"{path}.propeller")
        joint = _known(urdf, "joint", entry.joint, f"{path}.joint") if entry.joint else None
        drive = ThrusterConfig(**entry.model_dump(include=set(ThrusterConfig.model_fields)))
        spins = next((item.name for item in urdf.joints.values() if item.child == link), None)
        yield name, UrdfThruster(name, link, spins, joint, drive, entry.servo.kp, entry.servo.kd)


def _hinges(urdf: Urdf, thrusters: Mapping[str, UrdfThruster], config: RobotConfig) -> Iterator[tuple[str, Joint]]:
    """The joint that steers, by the name of what it steers; a locked joint steers nothing."""
    wanted = {name: item.engine_joint for name, item in thrusters.items()}
    for name, item in config.rudders.items():
        wanted[name] = _known(urdf, "joint", item.joint, f"rudders.{name}.joint")
    users: dict[str, str] = {}
    for name, joint in wanted.items():
        if joint is None or urdf.joints[joint].locked or urdf.joints[joint].type == "fixed":
            continue
        if joint in users:
            raise _problem(urdf, f"joint '{joint}' steers both {users[joint]} and {name}", urdf.joints[joint].line)
        users[joint] = name
        yield name, urdf.joints[joint]


def _known(urdf: Urdf, kind: str, name: str, path: str) -> str:
    """The URDF's name of a link or joint that the YAML gives with or without the namespace."""
    known = urdf.links if kind == "link" else urdf.joints
    for candidate in (name, f"{urdf.namespace}/{name}"):
        if candidate in known:
            return candidate
    names = ", ".join(urdf.local(item) for item in known)
    message = f"no {kind} named '{name}' in {urdf.file.name}; known: {names}"
    raise ConfigError([Problem(f"the YAML of {urdf.file.name}", None, None, path, message)])


def _problem(urdf: Urdf, message: str, line: int | None) -> ConfigError:
    return ConfigError([Problem(urdf.file.name, line, None, "", message)])


def _engines(
    tree: _Tree, thrusters: Mapping[str, UrdfThruster], hinges: Mapping[str, Joint]
) -> Iterator[Thruster]:  # fmt: skip
    for name, item in thrusters.items():
        if name in hinges:
            yield _steered(tree, name, item, hinges[name])
            continue
        servo = ServoConfig(kp=item.kp, kd=item.kd, effort=10.0, velocity=10.0)
        where = tree.pose(item.propeller_link, tree.urdf.root)
        link = tree.urdf.local(item.propeller_link)
        fixed = item.drive.model_copy(update={"max_angle": 0.0})
        yield Thruster(name, link, None, where, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), fixed, servo, ())


def _steered(tree: _Tree, name: str, item: UrdfThruster, hinge: Joint) -> Thruster:
    links = tree.below(hinge.child)
    if item.propeller_link not in links:
        message = f"thruster {name}: its propeller '{item.propeller_link}' does not hang on joint '{hinge.name}'"
        raise _problem(tree.urdf, message, hinge.line)
    turn = facing(hinge.axis)
    propeller = tree.part(item.propeller_link, hinge.child, turn).pose
    return Thruster(
        name=name,
        link=tree.urdf.local(hinge.child),
        joint=tree.urdf.local(hinge.name),
        pose=_hinge_pose(tree, hinge),
        center=propeller[:3],
        direction=apply(rotation(*propeller[3:]), (1.0, 0.0, 0.0)),
        drive=item.drive,
        servo=ServoConfig(kp=item.kp, kd=item.kd, effort=_effort(hinge), velocity=_velocity(hinge)),
        parts=tuple(tree.part(link, hinge.child, turn) for link in links),
    )


def _rudders(tree: _Tree, config: RobotConfig, hinges: Mapping[str, Joint]) -> Iterator[Thruster]:
    for name, entry in config.rudders.items():
        if name not in hinges:
            raise _problem(tree.urdf, f"rudder {name}: its joint '{entry.joint}' does not turn", None)
        hinge = hinges[name]
        turn = facing(hinge.axis)
        wing = Rudder(
            entry.area, entry.aspect_ratio, entry.propeller, entry.propeller_diameter or 0.0, entry.race_share
        )  # fmt: skip
        yield Thruster(
            name=name,
            link=tree.urdf.local(hinge.child),
            joint=tree.urdf.local(hinge.name),
            pose=_hinge_pose(tree, hinge),
            center=apply(rotation(*inverse(turn)[3:]), entry.center),
            direction=(0.0, 1.0, 0.0),
            drive=ThrusterConfig(mapping="linear", max_angle=entry.max_angle, timeout=0.0),
            servo=entry.servo,
            parts=tuple(tree.part(link, hinge.child, turn) for link in tree.below(hinge.child)),
            rudder=wing,
        )


def _hinge_pose(tree: _Tree, hinge: Joint) -> Pose:
    """Pose in the base link of the joint's frame, turned so that its axis is z."""
    turn, pose = facing(hinge.axis), tree.pose(hinge.child, tree.urdf.root)
    return pose if turn == HERE else compose(pose, turn)


def _effort(hinge: Joint) -> float:
    """Largest torque [N m]; a URDF's zero means that it does not say."""
    return hinge.limits.effort if hinge.limits and hinge.limits.effort > 0 else 10.0


def _velocity(hinge: Joint) -> float:
    """Largest rate [rad/s]."""
    return hinge.limits.velocity if hinge.limits and hinge.limits.velocity > 0 else 10.0


def _own_sensors(tree: _Tree, config: RobotConfig) -> Iterator[SensorConfig]:
    """Sensors of the YAML, posed in the base link's frame."""
    for index, sensor in enumerate(config.sensors):
        link = _known(tree.urdf, "link", sensor.link, f"sensors[{index}].link")
        local = tree.urdf.local(link)
        pose = compose(tree.pose(link, tree.urdf.root), sensor.pose)
        yield sensor.model_copy(update={"pose": pose, "link": local, "frame": sensor.frame or local})


def _loose(urdf: Urdf, used: set[str]) -> Iterator[str]:
    """Joints that could move in the file and do not here."""
    for joint in urdf.joints.values():
        if not (joint.type == "fixed" or joint.locked or joint.name in used):
            yield f"joint '{joint.name}' ({joint.type}) moves nothing here: it stays at zero"
