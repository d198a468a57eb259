"""A boat as it is built: the parts of a URDF that move together, its masses, thrusters, rudders, sails and sensors.

Links on fixed joints belong to the base link, as in Gazebo; those on joints that do not turn, or that nothing
steers, are rigid here too, at zero. What steers is a joint of a thruster, rudder or sail, with all that hangs on it.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.dynamics import (
    ContactConfig,
    HydrodynamicsConfig,
    MarineHullConfig,
    PropellerConfig,
    ServoConfig,
    ThrusterConfig,
)
from vrx_mj.config.loading import problem_at
from vrx_mj.config.robots import YAML_OF, BatteryEntry, ChannelEntry, RobotConfig, RudderEntry, SailEntry
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.tree import Section
from vrx_mj.config.weather import WindageConfig
from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.errors import CompileError, ConfigError, UnknownNameError
from vrx_mj.formats.urdf.model import Gazebo, Inertial, Joint, Urdf, UrdfThruster
from vrx_mj.frames import IDENTITY, ZERO, Pose, Vector, apply, compose, facing, inverse, rotation
from vrx_mj.rigid_bodies import MassProperties, combine, rigid, with_pose

_TURNING = ("revolute", "continuous")
"""Types of joints that can steer."""
_FREE = "free"
"""Name of the joint on which a boat floats."""
_DEFAULT_CONTACT = ContactConfig()
"""Contact parameters of a robot whose file gives none."""
_NO_THRUSTER = "no thruster, so the boat drifts; add `thrusters` to the YAML beside it"
"""Warning about a robot without thrusters."""
_MIN_INERTIA = 1e-12
"""Mass [kg] and moment of inertia [kg m2] below which MuJoCo takes no body; its own limits are 1e-15 and 1e-14."""
SERVO_INERTIA = 1e-6
"""Least inertia that a servo turns [kg m2]: a URDF may leave out that of its engine."""
NO_INERTIA = rigid(SERVO_INERTIA, ZERO, (SERVO_INERTIA,) * 3)
"""Mass and inertia [kg, kg m2] of a turning body whose links have none: MuJoCo needs some."""


@dataclass(frozen=True)
class Hinges:
    """The joints that steer."""

    by_name: Mapping[str, Joint]
    """Joints by the name of the thruster, rudder or sail that they steer."""
    turning: Mapping[str, tuple[str, ...]]
    """Links that turn with each thruster, rudder or sail."""
    notes: tuple[str, ...] = ()
    """Remarks about what is legal and unusual."""


def read_hinges(urdf: Urdf, thrusters: Mapping[str, UrdfThruster], config: RobotConfig) -> Hinges:
    """The hinges of thrusters, rudders and sails. A joint that is fixed, or that cannot leave zero, steers nothing.

    Raises:
        ConfigError: a joint cannot steer, or steers two things, or hangs on another that steers; a rudder or sail has
            the name of a thruster, or is in the race of one that does not exist; a propeller is that of none.
    """
    wanted = _steering_joints(urdf, thrusters, config)
    hinges: dict[str, Joint] = {}
    notes: list[str] = []
    for name, joint in ((name, urdf.joints[joint]) for name, joint in wanted.items() if joint is not None):
        if joint.type != "fixed" and not joint.is_locked:
            _check_hinge(urdf, name, joint, hinges)
            notes += _limit_notes(name, joint)
            if room(joint) > 0:
                hinges[name] = joint
    turning = {name: urdf.below(joint.child) for name, joint in hinges.items()}
    _check_nesting(thrusters, hinges, turning)
    return Hinges(hinges, turning, tuple(notes))


def _steering_joints(
    urdf: Urdf, thrusters: Mapping[str, UrdfThruster], config: RobotConfig
) -> dict[str, str | None]:  # fmt: skip
    """The joint that turns each thruster, rudder and sail; None for what is fixed."""
    wanted = {name: item.engine_joint for name, item in thrusters.items()}
    for kind, blades in (("rudders", config.rudders), ("sails", config.sails)):
        for name, entry in blades.items():
            if name in thrusters:
                raise own_problem(urdf, f"{kind}.{name}", "duplicate name: it is the name of a thruster")
            wanted[name] = entry.joint and urdf_name(urdf, "joint", entry.joint, f"{kind}.{name}.joint")
    for name, rudder in config.rudders.items():
        if rudder.propeller is not None and rudder.propeller not in thrusters:
            error = UnknownNameError("thruster", rudder.propeller, thrusters)
            raise own_problem(urdf, f"rudders.{name}.propeller", str(error))
    for name in config.propellers:
        if name not in thrusters and not config.layouts:
            raise own_problem(urdf, f"propellers.{name}", str(UnknownNameError("thruster", name, thrusters)))
    for name in wanted:
        steering = name + ANGLE_SUFFIX
        if steering in wanted:
            message = f"duplicate name '{steering}': a thruster, and the command that steers the thruster '{name}'"
            raise ConfigError.of(urdf.label, message)
    return wanted


def room(joint: Joint) -> float:
    """Largest angle [rad] that a hinge reaches either way; 0 if its limits leave no room on one side."""
    if joint.type == "continuous" or joint.limits is None:
        return float("inf")
    return max(0.0, min(-joint.limits.lower, joint.limits.upper))


def urdf_name(urdf: Urdf, kind: str, name: str, path: str) -> str:
    """The URDF's name of a link or joint that the YAML gives with or without the namespace."""
    names = urdf.links if kind == "link" else urdf.joints
    for candidate in (name, f"{urdf.namespace}/{name}"):
        if candidate in names:
            return candidate
    error = UnknownNameError(kind, name, [urdf.local(item) for item in names])
    raise own_problem(urdf, path, str(error))


def own_problem(urdf: Urdf, path: str, message: str) -> ConfigError:
    """A problem with the YAML beside a URDF, at a key of it; the reader of that file adds the line."""
    return ConfigError.of(f"{YAML_OF} {urdf.file.name}", message, key=path)


def with_places(error: ConfigError, section: Section) -> ConfigError:
    """The error with the file and line of its problems in the YAML beside a URDF, whose content is `section`."""
    return ConfigError(
        problem_at(section, _steps(problem.key), problem.message) if problem.file.startswith(YAML_OF) else problem
        for problem in error.problems
    )


def _steps(key: str) -> tuple[str | int, ...]:
    """`sensors[0].link` as `("sensors", 0, "link")`."""
    return tuple(int(number) if number else name for number, name in re.findall(r"\[(\d+)\]|([^.\[\]]+)", key))


def _problem(joint: Joint, message: str) -> ConfigError:
    return ConfigError([joint.place.problem(f"joint '{joint.name}'", message)])


def _check_hinge(urdf: Urdf, name: str, joint: Joint, hinges: Mapping[str, Joint]) -> None:
    if joint.type not in _TURNING:
        raise _problem(joint, f"is {joint.type} and cannot steer '{name}'; expected {' or '.join(_TURNING)}")
    if urdf.local(joint.name) == _FREE:
        raise _problem(joint, f"cannot be named '{_FREE}', the name of the boat's free joint")
    for other, hinge in hinges.items():
        if hinge is joint:
            raise _problem(joint, f"steers both '{other}' and '{name}'; each needs a joint of its own")
        if urdf.local(hinge.name) == urdf.local(joint.name):
            raise _problem(joint, f"has the same name as '{hinge.name}' without the namespace '{urdf.namespace}'")


def _check_nesting(
    thrusters: Mapping[str, UrdfThruster], hinges: Mapping[str, Joint], turning: Mapping[str, tuple[str, ...]]
) -> None:
    """A propeller hangs on the joint that steers its thruster, and neither it nor a joint on another that steers."""
    for other, links in turning.items():
        carrier = hinges[other]
        for name, hinge in hinges.items():
            if name != other and hinge.child in links:
                raise _problem(
                    hinge,
                    f"steers '{name}' and moves with '{carrier.name}', which steers '{other}': "
                    "no steering joint may move with another one",
                )
        for name, item in thrusters.items():
            link = item.propeller_link
            if name == other and link not in links:
                raise _problem(carrier, f"steers '{name}', whose propeller '{link}' does not move with it")
            if name != other and link in links:
                raise _problem(
                    carrier,
                    f"steers '{other}', and the propeller '{link}' of '{name}', which it does not steer, moves with it",
                )


def _limit_notes(name: str, joint: Joint) -> Iterator[str]:
    """Remarks about unequal limits of a steering joint."""
    limits = joint.limits
    if joint.type == "continuous" or limits is None or abs(limits.lower + limits.upper) < 1e-9:
        return
    reach = f"turns {room(joint):g} rad either way at most" if room(joint) > 0 else "does not steer"
    yield f"joint '{joint.name}' has limits {limits.lower:g} and {limits.upper:g} rad: '{name}' {reach}"


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
class AssembledThruster:
    """A propeller on an engine that steers or is fixed, a rudder, a keel or a sail."""

    name: str
    link: str
    """Link of the engine that turns, or of the propeller if nothing does."""
    joint: str | None
    """Joint that steers; None: it is fixed."""
    pose: Pose
    """Pose of the hinge in the base link's frame, its z axis the one of steering [m, rad]."""
    center: Vector
    """Point of application of the force, in the hinge's frame [m]."""
    direction: Vector
    """Direction of the force at zero steering, in the hinge's frame."""
    drive: ThrusterConfig
    servo: ServoConfig
    parts: tuple[Part, ...]
    """All that turns, in the hinge's frame."""
    blade: RudderEntry | SailEntry | None = None
    measured: PropellerConfig | None = None
    """Its propeller in profile `marine`."""


@dataclass(frozen=True, eq=False)
class Boat:
    """A kind of boat, assembled; what is made of it is kept by its identity."""

    name: str
    link: str
    """The base link, without namespace."""
    parts: tuple[Part, ...]
    thrusters: tuple[AssembledThruster, ...]
    hydrodynamics: HydrodynamicsConfig | None
    """None: not known, to be derived from the shapes."""
    wind: Vector | None
    sensors: tuple[SensorConfig, ...]
    warnings: tuple[str, ...] = ()
    contact: ContactConfig = _DEFAULT_CONTACT
    """Stiffness and damping of the hull in contacts."""
    water: Mapping[str, Any] = field(default_factory=dict)
    """Fields of `HydrodynamicsConfig` that are known where the rest is to be derived; in a six None is what is not."""
    windage: WindageConfig | None = None
    """Areas and coefficients in profile `marine`, instead of `wind`."""
    hull: MarineHullConfig | None = None
    """Hull in profile `marine`."""
    pushed: Vector | None = None
    """Point in the base link where water and wind push [m]; None: the centre of mass of what is held to it."""
    autopilot: Mapping[str, ChannelEntry] = field(default_factory=dict)
    """Commands of an autopilot's channels, by number."""
    battery: BatteryEntry | None = None
    description: str = ""
    """Its URDF, with the places of its meshes; empty if it is made of the package's own files alone."""


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
            *([] if pushing or "thrusters" in config.model_fields_set else [_NO_THRUSTER]),
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


def _part(urdf: Urdf, name: str, base: str, turn: Pose = IDENTITY, *, held: Collection[str] = ()) -> Part:
    """A link in the frame of one above it, or in that frame turned by `turn`; joints in `held` hold like fixed ones."""
    link = urdf.links[name]
    pose = urdf.pose(name, base)
    return Part(
        name=urdf.local(name),
        pose=pose if turn == IDENTITY else compose(inverse(turn), pose),
        inertial=link.inertial,
        collisions=link.collisions,
        visuals=link.visuals,
        lumped=all(joint.type == "fixed" or joint.name in held for joint in urdf.path(name, base)),
    )


def _thrusters(urdf: Urdf, gazebo: Gazebo, config: RobotConfig) -> Iterator[tuple[str, UrdfThruster]]:
    """Thrusters of the plugins, unless the YAML names any; each with its names as in the URDF."""
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
) -> Iterator[AssembledThruster]:
    """Propellers, then rudders, then sails, each on its hinge, or fixed to the base link."""
    for name, item in thrusters.items():
        entry, hinge = config.thrusters.get(name), hinges.get(name)
        given = entry.servo if entry is not None and "servo" in entry.model_fields_set else None
        where = _in_frame(urdf, hinge, item.propeller_link)
        # a URDF's zero means that it gives none
        effort, velocity = (getattr(hinge and hinge.limits, key, 0.0) for key in ("effort", "velocity"))
        yield _on_hinge(
            urdf,
            hinge,
            name=name,
            link=urdf.local(item.propeller_link),
            pose=where,
            center=where[:3] if hinge else ZERO,
            direction=apply(rotation(*where[3:]), item.axis) if hinge else item.axis,
            drive=item.drive,
            servo=given or ServoConfig(kp=item.kp, kd=item.kd, effort=max(effort, 0.0) or 10.0,
                                       velocity=max(velocity, 0.0) or 10.0),
            measured=config.propellers.get(name),
        )  # fmt: skip
    blades: dict[str, RudderEntry | SailEntry] = {**config.rudders, **config.sails}
    for name, blade in blades.items():
        if blade.joint is not None and name not in hinges:
            kind = "rudders" if name in config.rudders else "sails"
            raise own_problem(urdf, f"{kind}.{name}.joint", f"the joint '{blade.joint}' does not turn")
        hinge = hinges.get(name)
        yield _on_hinge(
            urdf,
            hinge,
            name=name,
            link=urdf.local(urdf.root),
            pose=IDENTITY,
            center=apply(rotation(*inverse(facing(hinge.axis))[3:]), blade.center) if hinge else blade.center,
            direction=(0.0, 1.0, 0.0),
            drive=ThrusterConfig(mapping="linear", max_angle=blade.max_angle, timeout=0.0),
            servo=blade.servo,
            blade=blade,
        )


def _on_hinge(urdf: Urdf, hinge: Joint | None, *, drive: ThrusterConfig, **own: Any) -> AssembledThruster:
    """A thruster, rudder or sail on its steering joint with all that turns; without one `own` gives link and pose."""
    if hinge is None:
        return AssembledThruster(joint=None, parts=(), drive=drive.model_copy(update={"max_angle": 0.0}), **own)
    turn, pose = facing(hinge.axis), urdf.pose(hinge.child, urdf.root)
    own |= {"link": urdf.local(hinge.child), "pose": pose if turn == IDENTITY else compose(pose, turn)}
    return AssembledThruster(
        joint=urdf.local(hinge.name),
        parts=tuple(_part(urdf, link, hinge.child, turn) for link in urdf.below(hinge.child)),
        drive=drive.model_copy(update={"max_angle": min(drive.max_angle, room(hinge))}),
        **own,
    )


def _in_frame(urdf: Urdf, hinge: Joint | None, link: str) -> Pose:
    """Pose of a link in the frame of a hinge, its z axis the one of steering; without one in the base link's."""
    if hinge is None:
        return urdf.pose(link, urdf.root)
    return _part(urdf, link, hinge.child, facing(hinge.axis)).pose


def _sensors(urdf: Urdf, gazebo: Gazebo, config: RobotConfig) -> tuple[SensorConfig, ...]:
    """Sensors of the URDF, then those of the YAML, posed in the base link's frame."""
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


Engines = Literal["fixed", "hinged"]
"""Whether engines are part of the hull's body, or bodies of their own that turn about z."""


def axis_inertia(part: MassProperties) -> float:
    """Inertia [kg m2] of the part about the z axis of its frame."""
    x, y, _ = part.center
    return float(part.inertia[2, 2] + part.mass * (x * x + y * y))


def push_center(boat: Boat) -> FloatArray:
    """Place where water and wind push the hull, (3,) [m], in its base link."""
    if boat.pushed is not None:
        return np.array(boat.pushed)
    lumped = list(_masses(part for part in boat.parts if part.lumped))
    return combine(lumped).center if lumped else boat_mass(boat).center


def turning_mass(thruster: AssembledThruster) -> MassProperties | None:
    """An engine with its propeller, in the frame of the hinge it steers on; None if it weighs nothing."""
    parts = list(_masses(thruster.parts))
    return combine(parts) if parts else None


@lru_cache(maxsize=64)
def boat_mass(boat: Boat) -> MassProperties:
    """The whole boat with everything at zero, in its base link.

    Raises:
        CompileError: nothing of it has a mass, or no body has its mass and moments of inertia.
    """
    turning = [
        with_pose(mass, thruster.pose) for thruster in boat.thrusters if (mass := turning_mass(thruster)) is not None
    ]
    parts = [*_masses(boat.parts), *turning]
    if not parts:
        raise CompileError(f"robot {boat.name}: no link has a mass of {_MIN_INERTIA:g} kg or more")
    return check_moments(combine(parts), f"robot {boat.name}")


def body_mass(boat: Boat, engines: Engines) -> MassProperties:
    """Mass properties of the MuJoCo body of the base link; errors are those of `boat_mass`, also about engines."""
    if engines == "fixed":
        return boat_mass(boat)
    for thruster in boat.thrusters:
        check_moments(turning_mass(thruster) or NO_INERTIA, f"robot {boat.name}: what turns with '{thruster.name}'")
    parts = list(_masses(boat.parts))
    if not parts:
        raise CompileError(f"robot {boat.name}: only its engines have a mass; build it with engines: fixed")
    return check_moments(combine(parts), f"robot {boat.name} without its engines")


def check_moments(body: MassProperties, name: str) -> MassProperties:
    """Refuse a body that MuJoCo does not take, and return any other.

    Raises:
        CompileError: a principal moment of inertia is too small.
    """
    moments = np.linalg.eigvalsh(body.inertia).tolist()
    if moments[0] < _MIN_INERTIA:
        words = ", ".join(f"{moment:.3g}" for moment in moments)
        raise CompileError(f"{name} has moments of inertia of {words} kg m2; each must be at least {_MIN_INERTIA:g}")
    return body


def _masses(parts: Iterable[Part]) -> Iterator[MassProperties]:
    for part in parts:
        if part.inertial is not None and part.inertial.mass >= _MIN_INERTIA:
            own = with_pose(rigid(part.inertial.mass, ZERO, part.inertial.tensor), part.inertial.pose)
            yield with_pose(own, part.pose)
