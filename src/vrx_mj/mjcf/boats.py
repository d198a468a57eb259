"""A boat as it is built: the parts of a URDF that move together, its thrusters, rudders, sails, water and sensors.

Links on fixed joints belong to the base link, as in Gazebo; those on joints that do not turn, or that nothing
steers, are rigid here too, at zero. What steers is a joint of a thruster, rudder or sail, with all that hangs on it.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from vrx_mj.config.dynamics import (
    ContactConfig,
    HydrodynamicsConfig,
    MarineHullConfig,
    PropellerConfig,
    ServoConfig,
    ThrusterConfig,
)
from vrx_mj.config.robots import BatteryEntry, ChannelEntry, RobotConfig, RudderEntry, SailEntry
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.wind import WindageConfig
from vrx_mj.errors import ConfigError
from vrx_mj.formats.urdf.model import ZERO, Gazebo, Inertial, Joint, Urdf, UrdfThruster
from vrx_mj.frames import Pose, apply, compose, facing, inverse, rotation
from vrx_mj.mjcf.steering import Hinges, own_problem, read_hinges, room, urdf_name

_Vector = tuple[float, float, float]
_YIELDING = ContactConfig()
"""Contact parameters of a robot whose file gives none."""


@dataclass(frozen=True)
class Part:
    """A link, rigid in the frame of what carries it."""

    name: str
    pose: Pose
    """Pose in the frame of the base link, or of the hinge it hangs on [m, rad]."""
    inertial: Inertial | None
    collisions: tuple[Shape, ...]
    visuals: tuple[Visual, ...]
    lumped: bool
    """Held to the base link: water and wind push at the centre of mass of what is. Where VRX's plugin gives how the
    hull floats, fixed joints alone hold, as Gazebo makes one link of these; else all that do not turn a propeller."""


@dataclass(frozen=True)
class Rudder:
    """The wing of a rudder."""

    area: float
    """[m2]"""
    aspect_ratio: float
    propeller: str | None
    """Thruster in whose race it is."""
    propeller_diameter: float
    """[m]; 0 without a propeller."""
    race_share: float


@dataclass(frozen=True)
class AssembledThruster:
    """What pushes: a propeller, on an engine that steers or fixed; a rudder or a keel; or a sail."""

    name: str
    link: str
    """Link of the engine that turns, or of the propeller if nothing does."""
    joint: str | None
    """What steers; None: nothing does."""
    pose: Pose
    """Pose of the hinge in the base link's frame, its z axis the one of steering [m, rad]."""
    center: _Vector
    """Where the force acts, in the hinge's frame [m]."""
    direction: _Vector
    """Direction of the force at zero steering, in the hinge's frame."""
    drive: ThrusterConfig
    servo: ServoConfig
    parts: tuple[Part, ...]
    """All that turns, in the hinge's frame."""
    blade: Rudder | SailEntry | None = None
    measured: PropellerConfig | None = None
    """Its propeller in profile `marine`."""


@dataclass(frozen=True)
class Boat:
    """A kind of boat, assembled."""

    name: str
    link: str
    """The base link, without namespace."""
    parts: tuple[Part, ...]
    thrusters: tuple[AssembledThruster, ...]
    hydrodynamics: HydrodynamicsConfig | None
    """None: not known, to be derived from the shapes."""
    wind: _Vector | None
    sensors: tuple[SensorConfig, ...]
    warnings: tuple[str, ...] = ()
    contact: ContactConfig = _YIELDING
    """How the hull yields to what it touches."""
    water: Mapping[str, Any] = field(default_factory=dict)
    """Fields of `HydrodynamicsConfig` that are known where the rest is to be derived; in a six None is what is not."""
    windage: WindageConfig | None = None
    """Areas and coefficients in profile `marine`, instead of `wind`."""
    hull: MarineHullConfig | None = None
    """Hull in profile `marine`."""
    pushed: _Vector | None = None
    """Where in the base link water and wind push [m]; None: at the centre of mass of what is held to it."""
    autopilot: Mapping[str, ChannelEntry] = field(default_factory=dict)
    """What an autopilot's channels command, by number."""
    battery: BatteryEntry | None = None
    description: str = ""
    """Its URDF, with the places of its meshes; empty if it is made of the package's own files alone."""


_DRIFTS = "no thruster, so the boat drifts; add `thrusters` to the YAML beside it"


def assemble_boat(urdf: Urdf, config: RobotConfig, drive: Mapping[str, object] = MappingProxyType({})) -> Boat:
    """The boat of a URDF and of the YAML beside it, which has the last word.

    `drive` is what all its thrusters have in common, whatever the files give: fields of `ThrusterConfig`.

    Raises:
        ConfigError: the YAML names a link or joint that the URDF does not have; two links, or two sensors, have one
            name; a joint cannot steer what it should.
    """
    _check_links(urdf)
    gazebo = urdf.gazebo
    config = config.model_copy(update=_blades_of(gazebo, config))
    thrusters = {
        name: replace(item, drive=item.drive.model_copy(update=drive))
        for name, item in _thrusters(urdf, gazebo, config)
    }
    hinges = read_hinges(urdf, thrusters, config)
    taken = {link for links in hinges.turning.values() for link in links}
    pushing = tuple(_pushing(urdf, thrusters, config, hinges.by_name))
    sensors = _sensors(urdf, gazebo, config)
    spinning = {joint.name for item in thrusters.values() if (joint := urdf.above.get(item.propeller_link))
                and joint.name != item.engine_joint}  # fmt: skip
    held = frozenset[str]() if gazebo.hydrodynamics is not None else urdf.joints.keys() - spinning
    return Boat(
        name=urdf.name,
        link=urdf.local(urdf.root),
        parts=tuple(_part(urdf, name, urdf.root, held=held) for name in urdf.links if name not in taken),
        thrusters=pushing,
        hydrodynamics=gazebo.hydrodynamics,
        water=gazebo.water,
        wind=config.wind or gazebo.wind,
        windage=config.windage,
        hull=config.hull,
        autopilot=config.autopilot,
        battery=config.battery,
        sensors=sensors,
        warnings=(
            *map(str, (*urdf.remarks, *gazebo.warnings)),
            *hinges.notes,
            *_loose(urdf, thrusters, hinges),
            *_swinging(urdf, sensors, hinges),
            *([] if pushing or "thrusters" in config.model_fields_set else [_DRIFTS]),
        ),
    )


def _check_links(urdf: Urdf) -> None:
    """Links are distinguished without the namespace."""
    seen: dict[str, str] = {}
    for name, link in urdf.links.items():
        other = seen.setdefault(urdf.local(name), name)
        if other != name:
            message = f"has the same name as '{other}' without the namespace '{urdf.namespace}'"
            raise ConfigError([link.place.problem(f"link '{name}'", message)])


def _part(urdf: Urdf, name: str, base: str, turn: Pose = ZERO, *, held: Collection[str] = ()) -> Part:
    """A link in the frame of one above it, or in that frame turned by `turn`; joints in `held` hold like fixed ones."""
    link = urdf.links[name]
    pose = urdf.pose(name, base)
    return Part(
        name=urdf.local(name),
        pose=pose if turn == ZERO else compose(inverse(turn), pose),
        inertial=link.inertial,
        collisions=link.collisions,
        visuals=link.visuals,
        lumped=all(joint.type == "fixed" or joint.name in held for joint in urdf.path(name, base)),
    )


def _thrusters(urdf: Urdf, gazebo: Gazebo, config: RobotConfig) -> Iterator[tuple[str, UrdfThruster]]:
    """Those of the plugins, unless the YAML names any; each with its names as in the URDF."""
    if not config.thrusters:
        yield from ((item.name, item) for item in gazebo.thrusters)
        return
    for name, entry in config.thrusters.items():
        path = f"thrusters.{name}"
        link = urdf_name(urdf, "link", entry.propeller, f"{path}.propeller")
        joint = urdf_name(urdf, "joint", entry.joint, f"{path}.joint") if entry.joint else None
        drive = ThrusterConfig(**entry.model_dump(include=set(ThrusterConfig.model_fields)))
        spins = next((item.name for item in urdf.joints.values() if item.child == link), None)
        yield name, UrdfThruster(name, link, spins, joint, drive, entry.servo.kp, entry.servo.kd)


def _blades_of(gazebo: Gazebo, config: RobotConfig) -> Mapping[str, object]:
    """Rudders, sails and channels of the plugins, where the YAML names none."""
    keys = {"rudders", "sails", "autopilot"} - config.model_fields_set
    return {key: getattr(gazebo, key) for key in keys}


def _pushing(
    urdf: Urdf, thrusters: Mapping[str, UrdfThruster], config: RobotConfig, hinges: Mapping[str, Joint]
) -> Iterator[AssembledThruster]:  # fmt: skip
    yield from _engines(urdf, thrusters, config, hinges)
    yield from _rudders(urdf, config, hinges)
    for name, entry in config.sails.items():
        yield _blade(urdf, f"sails.{name}", entry, hinges, entry)


def _engines(
    urdf: Urdf, thrusters: Mapping[str, UrdfThruster], config: RobotConfig, hinges: Mapping[str, Joint]
) -> Iterator[AssembledThruster]:  # fmt: skip
    for name, item in thrusters.items():
        entry, measured = config.thrusters.get(name), config.propellers.get(name)
        given = entry.servo if entry is not None and "servo" in entry.model_fields_set else None
        if name in hinges:
            yield replace(_steering_thruster(urdf, name, item, hinges[name], given), measured=measured)
            continue
        servo = given or ServoConfig(kp=item.kp, kd=item.kd, effort=10.0, velocity=10.0)
        where = urdf.pose(item.propeller_link, urdf.root)
        link = urdf.local(item.propeller_link)
        fixed = item.drive.model_copy(update={"max_angle": 0.0})
        yield AssembledThruster(
            name, link, None, where, (0.0, 0.0, 0.0), item.axis, fixed, servo, (), measured=measured
        )


def _steering_thruster(
    urdf: Urdf, name: str, item: UrdfThruster, hinge: Joint, given: ServoConfig | None
) -> AssembledThruster:
    turn = facing(hinge.axis)
    propeller = _part(urdf, item.propeller_link, hinge.child, turn).pose
    # a URDF's zero means that it gives none
    effort, velocity = (getattr(hinge.limits, key, 0.0) for key in ("effort", "velocity"))
    return AssembledThruster(
        name=name,
        link=urdf.local(hinge.child),
        joint=urdf.local(hinge.name),
        pose=_hinge_pose(urdf, hinge),
        center=propeller[:3],
        direction=apply(rotation(*propeller[3:]), item.axis),
        drive=item.drive.model_copy(update={"max_angle": min(item.drive.max_angle, room(hinge))}),
        servo=given
        or ServoConfig(
            kp=item.kp, kd=item.kd, effort=effort if effort > 0 else 10.0, velocity=velocity if velocity > 0 else 10.0
        ),
        parts=tuple(_part(urdf, link, hinge.child, turn) for link in urdf.below(hinge.child)),
    )


def _rudders(urdf: Urdf, config: RobotConfig, hinges: Mapping[str, Joint]) -> Iterator[AssembledThruster]:
    for name, entry in config.rudders.items():
        wing = Rudder(
            entry.area, entry.aspect_ratio, entry.propeller, entry.propeller_diameter or 0.0, entry.race_share
        )  # fmt: skip
        yield _blade(urdf, f"rudders.{name}", entry, hinges, wing)


def _blade(
    urdf: Urdf, path: str, entry: RudderEntry | SailEntry, hinges: Mapping[str, Joint], blade: Rudder | SailEntry
) -> AssembledThruster:
    """A rudder or sail on its hinge, or a keel on the base link; `path` is its place in the YAML."""
    name = path.partition(".")[2]
    across = (0.0, 1.0, 0.0)
    if entry.joint is None:
        fixed = ThrusterConfig(mapping="linear", max_angle=0.0, timeout=0.0)
        base = urdf.local(urdf.root)
        return AssembledThruster(name, base, None, ZERO, entry.center, across, fixed, entry.servo, (), blade)
    if name not in hinges:
        raise own_problem(urdf, f"{path}.joint", f"the joint '{entry.joint}' does not turn")
    hinge = hinges[name]
    turn = facing(hinge.axis)
    return AssembledThruster(
        name=name,
        link=urdf.local(hinge.child),
        joint=urdf.local(hinge.name),
        pose=_hinge_pose(urdf, hinge),
        center=apply(rotation(*inverse(turn)[3:]), entry.center),
        direction=across,
        drive=ThrusterConfig(mapping="linear", max_angle=min(entry.max_angle, room(hinge)), timeout=0.0),
        servo=entry.servo,
        parts=tuple(_part(urdf, link, hinge.child, turn) for link in urdf.below(hinge.child)),
        blade=blade,
    )


def _hinge_pose(urdf: Urdf, hinge: Joint) -> Pose:
    """Pose in the base link of the joint's frame, turned so that its axis is z."""
    turn, pose = facing(hinge.axis), urdf.pose(hinge.child, urdf.root)
    return pose if turn == ZERO else compose(pose, turn)


def _sensors(urdf: Urdf, gazebo: Gazebo, config: RobotConfig) -> tuple[SensorConfig, ...]:
    """Those of the URDF, then those of the YAML, posed in the base link's frame."""
    found = {sensor.name: sensor for sensor in gazebo.sensors}
    for index, sensor in enumerate(config.sensors):
        if sensor.name in found:
            raise own_problem(urdf, f"sensors[{index}].name", f"duplicate name of a sensor, '{sensor.name}'")
        link = urdf_name(urdf, "link", sensor.link, f"sensors[{index}].link")
        local = urdf.local(link)
        pose = compose(urdf.pose(link, urdf.root), sensor.pose)
        found[sensor.name] = sensor.model_copy(update={"pose": pose, "link": local, "frame": sensor.frame or local})
    return tuple(found.values())


def _loose(urdf: Urdf, thrusters: Mapping[str, UrdfThruster], hinges: Hinges) -> Iterator[str]:
    """Joints that could move in the file and do not here."""
    used = {joint.name for joint in hinges.by_name.values()}
    for name, item in thrusters.items():
        way = urdf.path(item.propeller_link, urdf.root)
        used |= {item.propeller_joint or "", *(joint.name for joint in way[-1:])}
        if name not in hinges.by_name:  # VRX too holds an engine at zero that does not steer
            used |= {joint.name for joint in way if joint.type == "revolute"}
    for joint in urdf.joints.values():
        if not (joint.type == "fixed" or joint.is_locked or joint.name in used):
            place = f"{joint.rest:g}" if joint.rest else "zero"
            yield f"joint '{joint.name}' ({joint.type}) is not simulated: it stays at {place}"


def _swinging(urdf: Urdf, sensors: tuple[SensorConfig, ...], hinges: Hinges) -> Iterator[str]:
    """Sensors on what steers; theirs is a place on the boat."""
    for name, links in hinges.turning.items():
        carried = {urdf.local(link) for link in links}
        for sensor in sensors:
            if sensor.link in carried:
                yield f"sensor '{sensor.name}' does not turn with the thruster '{name}' on which it is mounted"
