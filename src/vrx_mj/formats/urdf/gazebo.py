"""Gazebo's tags in a URDF: sensors, and the plugins of forces and thrusters of Gazebo, gz-sim and ArduPilot."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

from pydantic import ValidationError

from vrx_mj.config.dynamics import HullConfig, HydrodynamicsConfig, ThrusterConfig
from vrx_mj.config.robots import ChannelEntry, RudderEntry, SailEntry
from vrx_mj.config.tree import choice
from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.urdf.elements import FIELDS, Findings, Node, Tag, Values, numbers_of
from vrx_mj.formats.urdf.gazebo_sensors import INSTRUMENTS, TABLES, Scope, plugin_kind, read_instrument, read_sensor
from vrx_mj.formats.urdf.model import Gazebo, Urdf, UrdfThruster
from vrx_mj.frames import ZERO, Vector, compose

_AXES = ("xU", "yV", "zW", "kP", "mQ", "nR")
"""Coefficients along the axes of motion: surge, sway, heave, roll, pitch, yaw."""
_FOSSEN = {axis: (f"{axis[0]}Dot{axis[1]}", axis, f"{axis}abs{axis[1]}", f"{axis}{axis[1]}") for axis in _AXES}
"""Tags of added mass [kg, kg m2], linear [N s/m, N m s] and quadratic drag, the last by its newer and older name."""
CURRENT = Tag("default_current", ZERO, "m/s"), "{} is ignored: set currents in the world"
_TYPES = ("COMMAND", "EFFORT", "POSITION", "VELOCITY")

_COEFFICIENT = re.compile(r"[xyzkmn](Dot)?[UVWPQR][UVWPQR]?|[xyzkmn][UVWPQR]abs[UVWPQR]")
SPEEDS = Tag("use_angvel_cmd", False), "{} is ignored: commands are not propeller speeds [rad/s]"
_MAPPINGS = {0.0: "linear", 1.0: "glf"}
_WIND = Tag("coeff_vector|wind_coeff_vector", ZERO, labels="x y yaw")
_FORWARD = (1.0, 0.0, 0.0)
_USUAL_THRUST = 250.0
"""Largest force [N] where a file gives none: the WAM-V's."""
_FREEFLOATING_THRUST = 100.0
"""Largest force [N] of freefloating_gazebo_control.cpp for a thruster that gives none."""
_MAX_SLOPE = 5.5
"""Largest slope of the normal force of a foil by its aspect ratio; an endless blade has 6.13."""
_ASV_FOILS = {"asv_sim2-sail-lift-drag-system": "sail", "asv_sim2-foil-lift-drag-system": "rudder"}
_LIFTED = "; its coefficients are replaced: the plugin's lift, 8 sin(2 angle), is five times that of a sail"
_SHARES = "commands are fractions of the maximum thrust, -1 to 1"
_TRIANGLES = "drag and damping by triangle are not simulated; all drag is derived from the hull"
"""Warning about the water of asv_wave_sim, which acts on the triangles of the hull."""
QUIET_PLUGINS: frozenset[str] = frozenset(TABLES["quiet_plugins"])
"""Plugins that only publish what ROS has anyway, or that steer what thrusters steer here."""


def read_fossen(node: Node, scope: Scope) -> Values:
    """Added mass and drag of gz-sim's Hydrodynamics along each axis; a drag that it does not give is not known.

    Fossen's derivatives are negative where they resist; the plugin takes its water for still.
    """
    used = {tag for tags in _FOSSEN.values() for tag in tags}
    positive = [tag for tag in used if node.value(tag, 0.0) > 0.0]
    if positive:
        names = ", ".join(sorted(positive))
        scope.warn(node, f"positive coefficients drive the boat in gz-sim; they are read as negative: {names}")
    tags = dict.fromkeys(str(child.tag) for child in node.element)
    crossed = [tag for tag in tags if _COEFFICIENT.fullmatch(tag) and tag not in used and node.value(tag, 0.0)]
    if crossed:
        scope.warn(node, f"coefficients off the diagonal are ignored: {', '.join(crossed)}")
    scope.check(node, [CURRENT])
    paths = [(mass, drag, f"{newer}|{older}") for mass, drag, newer, older in _FOSSEN.values()]
    found = [[abs(node.value(path, 0.0)) if node.child(path) else None for path in along] for along in paths]
    known: Values = {
        "added_mass": (0.0,) * 6 if node.flag("disable_added_mass", False) else tuple(mass for mass, *_ in found),
        "drag_linear": tuple(_drag(linear, quadratic) for _, linear, quadratic in found),
        "drag_quadratic": tuple(_drag(quadratic, linear) for _, linear, quadratic in found),
    }
    density = "water_density|waterDensity"
    return known | ({"water_density": node.value(density, 1000.0, above=0)} if node.child(density) else {})


def _drag(own: float | None, other: float | None) -> float | None:
    """A drag along an axis: 0 where the file has only the other one, linear or quadratic."""
    return 0.0 if own is None and other is not None else own


def read_buoyancy(node: Node) -> Values:
    """The density of the water; what lifts are the shapes, which gz-sim too takes."""
    if node.child("uniform_fluid_density|graded_buoyancy") is None:
        return {}
    return {"water_density": node.value("uniform_fluid_density|graded_buoyancy/default_density", 1000.0, above=0)}


@dataclass(frozen=True)
class Control:
    """A channel of ArduPilot that commands a joint."""

    channel: str
    """Number of the channel, from 1."""
    joint: str
    type: str
    low: float
    """Command at the least pulse [N, rad or rad/s]."""
    high: float
    """Command at the greatest pulse."""
    trim: float
    """Pulse that commands 0 [us]."""
    span: tuple[float, float]
    """Differences of the shortest and longest pulse from `trim` [us]; negative where the longer one commands less."""
    node: Node


def read_controls(node: Node, scope: Scope) -> list[Control]:
    """The channels of ArduPilotPlugin; a command is multiplier times the sum of offset and the share of the pulse."""
    found = []
    for index, part in enumerate(node.children("control")):
        name, kind = scope.joint(part, "jointName"), part.text("type", "VELOCITY").upper()
        if kind not in _TYPES:
            part.fault(choice(kind, _TYPES), "type")
        least, most = part.value("servo_min", 1000.0), part.value("servo_max", 2000.0)
        if least == most:
            part.fault(f"servo_min and servo_max must differ, got {least:g} for both")
        factor, offset = part.value("multiplier", 1.0), part.value("offset", 0.0)
        low, high = sorted((factor * offset, factor * (offset + 1.0)))
        trim, sign = least - offset * (most - least), math.copysign(most - least, factor)
        span = sign * (-offset or 1.0 + offset), sign * (1.0 + offset or -offset)
        if name is not None:
            channel = part.attribute("channel") or str(index)
            number = str(int(channel) + 1) if channel.isdecimal() else channel
            found.append(Control(number, name, kind, low, high, trim, span, part))
    return found


def with_channels(
    thrusters: Sequence[UrdfThruster], controls: Sequence[Control], scope: Scope, turned: Mapping[str | None, str]
) -> tuple[list[UrdfThruster], dict[str, ChannelEntry]]:
    """Thrusters that push and steer no farther than the channels of ArduPilot let them, and these channels.

    `turned` are names of what turns on other joints.
    """
    found = [_with_limits(item, {one.joint: one for one in controls}) for item in thrusters]
    commands = {joint: name + ANGLE_SUFFIX for joint, name in turned.items()}
    commands |= {item.engine_joint: item.name + ANGLE_SUFFIX for item in thrusters}
    commands |= {item.propeller_joint: item.name for item in thrusters}
    channels = {}
    for one in controls:
        if one.joint not in commands:
            scope.warn(one.node, f"the joint '{one.joint}' is ignored: no thruster is mounted on it")
            continue
        try:
            channels[one.channel] = ChannelEntry(thruster=commands[one.joint], trim=one.trim, span=one.span)
        except ValidationError:
            scope.warn(one.node, f"channel {one.channel} is ignored: a trim of {one.trim:g} us is out of range")
    return found, channels


def _with_limits(item: UrdfThruster, controls: Mapping[str, Control]) -> UrdfThruster:
    drive = item.drive
    push, turn = controls.get(item.propeller_joint or ""), controls.get(item.engine_joint or "")
    if push and push.type in {"COMMAND", "EFFORT"}:
        update = {
            "max_force_forward": max(min(drive.max_force_forward, push.high), 0.0),
            "max_force_reverse": min(max(drive.max_force_reverse, push.low), 0.0),
        }
        drive = drive.model_copy(update=update)
    if turn and turn.type == "POSITION":
        room = max(min(-turn.low, turn.high), 0.0)
        drive = drive.model_copy(update={"max_angle": min(drive.max_angle, room)})
    return replace(item, drive=drive)


@dataclass
class Robot(Scope):
    """A robot whose plugins are read, and what pushes it."""

    newer_drags: list[Node] = field(default_factory=list)
    newer_hulls: list[Node] = field(default_factory=list)
    controls: list[Control] = field(default_factory=list)

    def thrust(
        self, node: Node, link: str, drive: Values, *, name: str = "", propeller: str | None = None,
        engine: str | None = None, axis: Vector = _FORWARD,
    ) -> None:  # fmt: skip
        """Keep a thruster, if its values are valid."""
        astern = {"max_force_reverse": -abs(drive["max_force_reverse"])}
        config = node.config_of(ThrusterConfig, {"mapping": "linear", **drive, **astern})
        if config is not None and link:
            name = name or self.local(link).rpartition("/")[2]
            self.thrusters.append(UrdfThruster(name, link, propeller, engine, config, place=node.place, axis=axis))

    def hinge(self, link: str, *, above: int = 0) -> str | None:
        """The hinge on which a link hangs, or so many joints above: it turns the link if no file names another."""
        joint = self.urdf.above.get(link)
        for _ in range(above):
            joint = self.urdf.above.get(joint.parent) if joint else None
        return joint.name if joint and joint.type == "revolute" and not joint.is_locked else None

    def warned_link(self, node: Node, tag: str) -> str:
        """The link that a thruster names; empty, with a warning, without one."""
        found = self.find(node.text(tag), self.urdf.links)
        if not found:
            error = UnknownNameError("link", node.text(tag), self.urdf.links)
            self.warn(node, f"{error}; this thruster is not simulated")
        return found

    def check_body(self, node: Node, tag: str) -> None:
        """The water acts on the root link here."""
        link = self.link(node, tag) if node.text(tag) else ""
        if link and link != self.urdf.root:
            self.warn(node, f"the water acts on '{self.urdf.root}', the root link, not on '{link}'")


def _thrusters(node: Node, robot: Robot) -> None:
    """VRX's thrust plugin. A sign of maxForceRev that is lost is put right."""
    timeout, parts = node.value("cmdTimeout", 1.0), node.children("thruster")
    if not parts:
        robot.warn(node, "it has no <thruster>")
    for part in parts:
        link, mapping = robot.link(part, "linkName"), part.value("mappingType", 0.0)
        if mapping not in _MAPPINGS:
            part.fault(f"expected 0 (linear) or 1 (logistic), got {part.text('mappingType')}", "mappingType")
        propeller, engine = robot.joint(part, "propJointName"), robot.joint(part, "engineJointName")
        steers = part.flag("enableAngle", part.child("angleTopic") is not None)
        drive = part.fields(FIELDS["thruster"]) | {"mapping": _MAPPINGS.get(mapping, "linear"), "timeout": timeout}
        name = part.text("cmdTopic").rpartition("/")[2].removesuffix("_thrust_cmd")
        name = name or robot.local(link).removesuffix("_propeller_link")
        engine = (engine or robot.hinge(link, above=1)) if steers else None
        robot.thrust(part, link, drive, name=name, propeller=propeller, engine=engine)


def _newer_thruster(node: Node, robot: Robot) -> None:
    """A thruster of the newer Gazebo: a joint whose child is the propeller, and commands in newtons."""
    name = robot.joint(node, "joint_name")
    if name is None:
        if not node.text("joint_name"):
            node.fault("required, but missing", "joint_name")
        return
    joint, topic = robot.urdf.joints[name], node.text("topic").removesuffix("/thrust")
    engine = robot.hinge(joint.child, above=1)
    limits = robot.urdf.joints[engine].limits if engine else None
    robot.check(node, [SPEEDS])
    robot.warn(node, "commands are newtons only in profile vrx3, otherwise fractions of the maximum thrust, -1 to 1")
    drive = node.fields(FIELDS["newer_thruster"]) | {"timeout": 0.0}
    drive["max_angle"] = min(abs(limits.lower), abs(limits.upper)) if limits else math.pi / 2
    own = robot.local(joint.child).rpartition("::")[2].removesuffix("_link").removesuffix("_propeller")
    own = node.text("name") or topic.rpartition("/")[2] or own
    robot.thrust(node, joint.child, drive, name=own, propeller=name, engine=engine, axis=joint.axis)


def _uuv_thruster(node: Node, robot: Robot) -> None:
    """The UUV simulator's thruster: it pushes along the axis of its joint, at its link.

    The largest force is `thrustMax`, or what `conversion` makes of the largest input.
    """
    link = robot.warned_link(node, "linkName")
    if not link:
        return
    joint, least = robot.urdf.above.get(link), abs(node.value("thrustMin", 0.0))
    largest = max(node.value("thrustMax", 0.0), 0.0) or _conversion_force(node)
    if largest <= 0.0:
        robot.warn(node, f"without thrustMax and a maximum input, the maximum thrust is {_USUAL_THRUST:g} N")
        largest = _USUAL_THRUST
    robot.warn(node, _SHARES)
    axis = joint.axis if joint and joint.type in {"continuous", "revolute"} else _FORWARD
    drive = {"max_force_forward": largest, "max_force_reverse": least or largest}
    robot.thrust(node, link, drive, propeller=joint.name if joint else None, axis=axis)


def _conversion_force(node: Node) -> float:
    """Force [N] of the largest input, where the conversion and the clamp are given: k n |n|, or the end of a table."""
    words = node.text("conversion/outputValues").split()
    if words:
        labels = " ".join("f" * len(words))
        return max(node.values("conversion/outputValues", labels, (0.0,) * len(words)))
    clamp = node.value("clampMax", 0.0)
    return node.value("conversion/rotorConstant|conversion/rotorConstantR", 0.0) * clamp * abs(clamp)


def _freefloating(node: Node, robot: Robot) -> None:
    """freefloating_gazebo's thrusters with a link: they push along its -z; the joint above the link steers."""
    for part in node.children("thruster"):
        if part.child("map") is not None:
            message = "a thruster with a <map> has no link and is not simulated; add it to the YAML beside the file"
            robot.warn(part, message)
            continue
        link = robot.warned_link(part, "name")
        over = part.value("effortOverWater", 0.0, low=0)
        largest = part.value("effort|effortUnderWater", 0.0 if over else _FREEFLOATING_THRUST, low=0)
        if over and over != largest:
            robot.warn(part, f"the maximum thrust is the same in and out of the water: {largest or over:g} N")
        largest = largest or over
        drive = {"max_force_forward": largest, "max_force_reverse": largest}
        if link:
            robot.warn(part, _SHARES)
        robot.thrust(part, link, drive, engine=robot.hinge(link), axis=(0.0, 0.0, -1.0))


def _foil(node: Node, robot: Robot) -> None:
    """A rudder, keel or sail of usv_sim_lsa (foil_dynamics_plugin.cpp) or of asv_sim (LiftDragModel.cc).

    The normal force of usv_sim's rudder is 2 `mult_lift` sin(angle), over which `mult_drag` is written; asv_sim's lift
    has the slope `cla`. Ours has that slope by its aspect ratio and, beyond `_MAX_SLOPE`, by its area.
    """
    link, kind = robot.warned_link(node, "link_name"), node.text("link_type")
    if not link:
        return
    theirs = plugin_kind(node) in _ASV_FOILS
    kind = _ASV_FOILS.get(plugin_kind(node), kind)
    name, joint = robot.local(link).removesuffix("_link"), robot.hinge(link)
    x, y, z = node.values("cp", "x y z", ZERO)
    area = node.value("area", 1.0, above=0)
    entry: dict[str, object] = {"center": (x, y, z), "joint": joint, "max_angle": math.pi / 2}
    if kind == "sail" and joint:
        robot.warn(node, "a sail on a sheet: its command limits the boom to leeward" + ("" if theirs else _LIFTED))
        curve = {"coefficients": _sail_rows(node)} if theirs else {}
        if (sail := node.config_of(SailEntry, entry | curve | {"area": area})) is not None:
            robot.sails[name] = sail
    elif kind in {"rudder", "keel"}:
        steep = node.value("cla", math.tau) if theirs else 2.0 * node.value("mult_drag|mult_lift", 1.5, above=0)
        slope = min(steep, _MAX_SLOPE)
        if joint is None:
            entry["center"] = compose(robot.urdf.pose(link, robot.urdf.root), (x, y, z, 0.0, 0.0, 0.0))[:3]
        entry |= {"area": area * steep / slope, "aspect_ratio": 2.25 * slope / (6.13 - slope)}
        if (blade := node.config_of(RudderEntry, entry)) is not None:
            robot.rudders[name] = blade
    else:
        robot.warn(node, f"a foil of link_type '{kind}' {'without a joint ' if kind == 'sail' else ''}is ignored")


def _sail_rows(node: Node) -> tuple[Vector, ...]:
    """Coefficients of asv_sim's sail, whose lift and drag are straight lines to the stall and from there to 90 degrees.

    Lift there would jump from one sign to the other; here it is 0.
    """
    stall, drag = node.value("alpha_stall", 0.5 / math.pi, above=0, high=1.5), node.value("cda", 2.0 / math.pi, low=0)
    lift, degrees = node.value("cla", math.tau, above=0) * stall, math.degrees(stall)
    up = (ZERO, (degrees, lift, drag * stall))
    down = ((180.0 - angle, -lift, drag) for angle, lift, drag in reversed(up))
    return (*up, (90.0, 0.0, drag * math.pi / 2), *down)


def _hydrodynamics(node: Node, robot: Robot) -> None:
    """VRX's dynamics plugin; what a file leaves out is as in the plugin."""
    robot.check_body(node, "bodyName")
    robot.hydrodynamics = node.config_of(
        HydrodynamicsConfig, _coefficients(node) | node.fields(FIELDS["hydrodynamics"])
    )


def _coefficients(node: Node) -> Values:
    return {key: tuple(node.fields(FIELDS[key]).values()) for key in ("added_mass", "drag_linear", "drag_quadratic")}


def _newer_water(robot: Robot) -> None:
    """Newer VRX's drag, and its hulls with their points; or hulls alone."""
    drag = next(reversed(robot.newer_drags), None) if robot.hydrodynamics is None else None
    if drag is None and robot.hydrodynamics is not None and not robot.water:
        return
    floats = _floats(robot.newer_hulls, robot)
    if drag is None:
        robot.water |= floats
    elif floats:
        robot.check_body(drag, "link_name")
        robot.hydrodynamics = drag.config_of(HydrodynamicsConfig, _coefficients(drag) | floats)
    else:
        robot.warn(drag, "no hull (Surface plugin) with points matches it; the collision shapes displace water")
    if drag is not None and robot.hydrodynamics is None:
        robot.water |= _coefficients(drag)


def _floats(surfaces: list[Node], robot: Robot) -> Values:
    """Newer VRX's hulls, one Surface plugin each, in water of one level and density; nothing without any."""
    hulls = [hull for node in surfaces if (hull := _hull(node, robot)) is not None]
    if not hulls:
        return {}
    waters = [node.fields(FIELDS["water"]) for node in surfaces]
    if any(water != waters[0] for water in waters):
        robot.warn(surfaces[0], "the fluid_level and fluid_density of this hull apply to all hulls")
    beam = 2 * max(abs(point[1]) for hull in hulls for point in hull.points)
    sizes = {"hull_radius": hulls[0].radius, "boat_length": hulls[0].length}
    return waters[0] | sizes | {"boat_width": beam or 2 * hulls[0].radius, "hulls": tuple(hulls)}


def _hull(node: Node, robot: Robot) -> HullConfig | None:
    try:
        points = tuple(numbers_of(point.text or "", "x y z") for point in node.element.iterfind("points/point"))
    except ValueError:
        points = ()
    if points:
        return node.config_of(HullConfig, node.fields(FIELDS["hull"]) | {"points": points})
    robot.warn(node, "expected three numbers in each of its <points>; this hull has no buoyancy")
    return None


def _wind(node: Node, robot: Robot) -> None:
    """VRX's wind plugin: the coefficients of a link that this robot has, else the first."""
    parts, root = node.children("wind_obj"), robot.local(robot.urdf.root)
    ours = [part for part in parts if robot.local(part.text("link_name"), hard_coded=True) == root]
    holder = next(iter((*ours, *parts)), node)
    robot.wind = holder.value_of(_WIND) if parts or node.text(_WIND.path) else None


def _fossen(node: Node, robot: Robot) -> None:
    robot.check_body(node, "link_name")
    robot.water |= read_fossen(node, robot)


THRUSTERS: Mapping[str, Callable[[Node, Robot], None]] = {
    "usv_gazebo_thrust_plugin": _thrusters,
    "gz-sim-thruster-system": _newer_thruster,
    "uuv_thruster_plugin": _uuv_thruster,
    "uuv_thruster_ros_plugin": _uuv_thruster,
    "freefloating_gazebo_control": _freefloating,
    **dict.fromkeys(("foil_dynamics_plugin", *_ASV_FOILS), _foil),
}
"""Readers of thrusters and foils, by the library of their plugins."""
_PLUGINS: Mapping[str, Callable[[Node, Robot], None]] = {
    **THRUSTERS,
    **dict.fromkeys(INSTRUMENTS, read_instrument),
    "usv_gazebo_dynamics_plugin": _hydrodynamics,
    "usv_gazebo_wind_plugin": _wind,
    "SimpleHydrodynamics": lambda node, robot: robot.newer_drags.append(node),
    "Surface": lambda node, robot: robot.newer_hulls.append(node),
    "gz-sim-hydrodynamics-system": _fossen,
    "gz-sim-buoyancy-system": lambda node, robot: robot.water.update(read_buoyancy(node)),
    "ArduPilotPlugin": lambda node, robot: robot.controls.extend(read_controls(node, robot)),
    "gz-waves1-hydrodynamics-system": lambda node, robot: robot.warn(node, _TRIANGLES),
    "HydrodynamicsPlugin": lambda node, robot: robot.warn(node, _TRIANGLES),
}
"""Readers of plugins, by their library."""


def read_gazebo(urdf: Urdf, tags: Sequence[Node], findings: Findings) -> Gazebo:
    """Thrusters, water, wind and sensors of a robot, by its `<gazebo>` elements, in the order of the file.

    VRX's and Hector's plugins of Gazebo classic are known by their files' names, and those that took their place in
    newer VRX as far as they mean the same; and thrusters of the UUV simulator and of freefloating_gazebo. Names and
    frames come without the namespace, poses in the root link's frame.

    Raises:
        ConfigError: For values that are wrong, and links and joints that are not there.
    """
    robot = Robot(urdf=urdf, findings=findings)
    for node in tags:
        _read_element(node, robot)
    _newer_water(robot)
    blades: Mapping[str, RudderEntry | SailEntry] = {**robot.rudders, **robot.sails}
    turned = {blade.joint: name for name, blade in blades.items()}
    thrusters, channels = with_channels(robot.thrusters, robot.controls, robot, turned)
    findings.check_names("thruster", ((one.name, one.place, f"thruster '{one.name}'") for one in thrusters))
    findings.settle()
    robot.thrusters, robot.autopilot = thrusters, channels
    return Gazebo(**{one.name: getattr(robot, one.name) for one in fields(Gazebo)})


def _read_element(node: Node, robot: Robot) -> None:
    """One `<gazebo>`, about a link or about the whole robot."""
    reference = node.attribute("reference")
    if reference:
        node.path = f"{node.path or 'link'} '{reference}'"
    if reference and reference not in robot.urdf.links and reference not in robot.urdf.joints:
        robot.warn(node, f"no link or joint named '{reference}'; the element is ignored")
        return
    sensors = node.children("sensor") if reference in robot.urdf.links or not reference else []
    types = [sensor.attribute("type") for sensor in sensors]
    for sensor, kind in zip(sensors, types, strict=True):
        read_sensor(sensor, reference or robot.urdf.root, robot, alone=types.count(kind) == 1)
    for plugin in node.children("plugin"):
        kind = plugin_kind(plugin)
        if kind in _PLUGINS:
            _PLUGINS[kind](plugin, robot)
        elif plugin.text("thruster/linkName"):
            robot.warn(plugin, f"the plugin {plugin.attribute('filename')} is read as VRX's thrust plugin, by its tags")
            _thrusters(plugin, robot)
        elif kind not in QUIET_PLUGINS:
            robot.warn_plugin(plugin)
