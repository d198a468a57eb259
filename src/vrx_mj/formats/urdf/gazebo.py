"""Gazebo's tags in a URDF: plugins of forces, thrusters and others, and the sensors."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.config.dynamics import HullConfig, HydrodynamicsConfig, ThrusterConfig
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.urdf.elements import Findings, Node
from vrx_mj.formats.urdf.gazebo_sensors import INSTRUMENTS, Scope, library, plugin_kind, read_sensor
from vrx_mj.formats.urdf.gz_sim import Control, controlled, read_buoyancy, read_controls, read_fossen
from vrx_mj.formats.urdf.model import Gazebo, Urdf, UrdfThruster

ADDED_MASS = {"xDotU": 5.0, "yDotV": 5.0, "zDotW": 0.1, "kDotP": 0.1, "mDotQ": 0.1, "nDotR": 1.0}
LINEAR = {"xU": 20.0, "yV": 20.0, "zW": 20.0, "kP": 20.0, "mQ": 20.0, "nR": 20.0}
QUADRATIC = {"xUU": 0.0, "yVV": 0.0, "zWW": 0.0, "kPP": 0.0, "mQQ": 0.0, "nRR": 0.0}
"""What the dynamics plugin takes for what a file leaves out: usv_gazebo_dynamics_plugin.cc."""
WATER_DENSITY = 997.7735
MAPPINGS = {0.0: "linear", 1.0: "glf"}
LEAST_THRUST = -1000.0
"""Default smallest command [N] of the newer Gazebo's thrusters."""


def read_thrusters(node: Node, scope: Scope) -> list[UrdfThruster]:
    """The thrusters of VRX's thrust plugin. A sign of maxForceRev that is lost is put right."""
    timeout = node.value("cmdTimeout", 1.0)
    if not node.child("thruster"):
        scope.warn(node, "no <thruster> in it")
    return [found for part in node.children("thruster") if (found := _thruster(part, timeout, scope)) is not None]


def _thruster(node: Node, timeout: float, scope: Scope) -> UrdfThruster | None:
    link, topic = scope.link(node, "linkName"), node.text("cmdTopic")
    mapping = node.value("mappingType", 0.0)
    if mapping not in MAPPINGS:
        node.fault(f"expected 0 (linear) or 1 (logistic), got {node.text('mappingType')}", "mappingType")
    propeller, engine = scope.joint(node, "propJointName"), scope.joint(node, "engineJointName")
    steers = node.flag("enableAngle", node.child("angleTopic") is not None)
    drive = {
        "mapping": MAPPINGS.get(mapping, "linear"),
        "max_command": node.value("maxCmd", 1.0, above=0),
        "max_force_forward": node.value("maxForceFwd", 250.0, low=0),
        "max_force_reverse": -abs(node.value("maxForceRev", -100.0)),
        "timeout": timeout,
        "max_angle": node.value("maxAngle", math.pi / 2, low=0),
    }
    config = node.configured(ThrusterConfig, drive)
    if config is None or not link:
        return None
    name = topic.rpartition("/")[2].removesuffix("_thrust_cmd") or scope.local(link).removesuffix("_propeller_link")
    engine = (engine or _steering_joint(scope.urdf, link)) if steers else None
    return UrdfThruster(name, link, propeller, engine, config, place=node.place)


def _steering_joint(urdf: Urdf, propeller: str) -> str | None:
    """The hinge above a propeller's own, which turns it if no file names another."""
    own = urdf.above.get(propeller)
    hinge = urdf.above.get(own.parent) if own else None
    return hinge.name if hinge and hinge.type == "revolute" and not hinge.locked else None


def read_newer_thruster(node: Node, scope: Scope) -> list[UrdfThruster]:
    """A thruster of the newer Gazebo: a joint whose child is the propeller, and commands in newtons."""
    name = scope.joint(node, "joint_name")
    if name is None:
        if not node.text("joint_name"):
            node.fault("required, but missing", "joint_name")
        return []
    joint, topic = scope.urdf.joints[name], node.text("topic").removesuffix("/thrust")
    engine = _steering_joint(scope.urdf, joint.child)
    limits = scope.urdf.joints[engine].limits if engine else None
    least, most = node.value("min_thrust_cmd", LEAST_THRUST), node.value("max_thrust_cmd", -LEAST_THRUST, low=0)
    if node.flag("use_angvel_cmd", False):
        scope.warn(node, "commands are no speeds of the propeller [rad/s]: use_angvel_cmd is ignored")
    drive: dict[str, Any] = {
        "mapping": "linear",
        "max_force_forward": most,
        "max_force_reverse": -abs(least),
        "timeout": 0.0,
        "max_angle": min(abs(limits.lower), abs(limits.upper)) if limits else math.pi / 2,
    }
    config = node.configured(ThrusterConfig, drive)
    scope.warn(node, "commands are newtons only in worlds of profile vrx3, else shares of the largest thrust, -1 to 1")
    link = scope.local(joint.child).rpartition("::")[2].removesuffix("_link").removesuffix("_propeller")
    own = node.text("name") or topic.rpartition("/")[2] or link
    return [UrdfThruster(own, joint.child, name, engine, config, place=node.place, axis=joint.axis)] if config else []


def read_hydrodynamics(node: Node, scope: Scope) -> HydrodynamicsConfig | None:
    """The parameters of VRX's dynamics plugin; what a file leaves out is as in the plugin."""
    _check_body(node, "bodyName", scope)
    values = _coefficients(node) | {
        "water_level": node.value("waterLevel", 0.5),
        "water_density": node.value("waterDensity", WATER_DENSITY, above=0),
        "hull_radius": node.value("hullRadius", 0.213, above=0),
        "boat_width": node.value("boatWidth", 1.0, above=0),
        "boat_length": node.value("boatLength", 1.35, above=0),
        "length_n": round(node.value("length_n", 2.0, low=1, high=1000)),
    }
    return node.configured(HydrodynamicsConfig, values)


def read_newer_hydrodynamics(drag: Node, surfaces: list[Node], scope: Scope) -> HydrodynamicsConfig | None:
    """Newer VRX's drag, and its hulls with their points."""
    floats = read_floats(surfaces, scope)
    if not floats:
        scope.warn(drag, "no hull (Surface plugin) with points belongs to it; its shapes displace the water")
        return None
    _check_body(drag, "link_name", scope)
    return drag.configured(HydrodynamicsConfig, _coefficients(drag) | floats)


def read_floats(surfaces: list[Node], scope: Scope) -> dict[str, Any]:
    """Newer VRX's hulls, one Surface plugin each, in water of one level and density; nothing without any."""
    hulls = [hull for node in surfaces if (hull := _hull(node, scope)) is not None]
    if not hulls:
        return {}
    waters = [
        (node.value("fluid_level", 0.0), node.value("fluid_density", WATER_DENSITY, above=0)) for node in surfaces
    ]
    if len(set(waters)) > 1:
        scope.warn(surfaces[0], "the fluid_level and fluid_density of this hull apply to all hulls")
    beam = 2 * max(abs(point[1]) for hull in hulls for point in hull.points)
    return {
        "water_level": waters[0][0],
        "water_density": waters[0][1],
        "hull_radius": hulls[0].radius,
        "boat_width": beam or 2 * hulls[0].radius,
        "boat_length": hulls[0].length,
        "hulls": tuple(hulls),
    }


def _hull(node: Node, scope: Scope) -> HullConfig | None:
    points = [_point(point) for point in node.element.iterfind("points/point")]
    if not points or None in points:
        scope.warn(node, "expected three numbers in each of its <points>; this hull has no buoyancy")
        return None
    values = {
        "length": node.value("hull_length", 4.9, above=0),
        "radius": node.value("hull_radius", 0.213, above=0),
        "points": tuple(points),
    }
    return node.configured(HullConfig, values)


def read_wind(node: Node, scope: Scope) -> tuple[float, float, float] | None:
    """The coefficients of VRX's wind plugin for this robot: those of a link it has, else the first."""
    parts = node.children("wind_obj")
    ours = [
        part for part in parts if scope.local(part.text("link_name"), hard_coded=True) == scope.local(scope.urdf.root)
    ]
    for part in (*ours, *parts):
        return _vector(part, "coeff_vector")
    return _vector(node, "wind_coeff_vector") if node.text("wind_coeff_vector") else None


def _vector(node: Node, tag: str) -> tuple[float, float, float]:
    x, y, yaw = node.values(tag, "x y yaw", (0.0, 0.0, 0.0))
    return (x, y, yaw)


def _coefficients(node: Node) -> dict[str, object]:
    tables = {"added_mass": ADDED_MASS, "drag_linear": LINEAR, "drag_quadratic": QUADRATIC}
    return {
        key: tuple(node.value(tag, default, low=0) for tag, default in table.items()) for key, table in tables.items()
    }


def _check_body(node: Node, tag: str, scope: Scope) -> None:
    """The water acts on the root link here."""
    name = node.text(tag)
    link = scope.link(node, tag) if name else scope.urdf.root
    if name and link and link != scope.urdf.root:
        scope.warn(node, f"the water acts on '{scope.urdf.root}', the root link, not on '{link}'")


def _point(element: Any) -> tuple[float, ...] | None:
    try:
        x, y, z = (float(word) for word in (element.text or "").split())
    except ValueError:
        return None
    return (x, y, z) if all(map(math.isfinite, (x, y, z))) else None


USUAL_THRUST = 250.0
"""Largest force [N] where a file gives none: the WAM-V's."""
FREEFLOATING_THRUST = 100.0
"""Largest force [N] of freefloating_gazebo_control.cpp for a thruster that gives none."""
SHARES = "commands are shares of the largest thrust, -1 to 1"


def read_uuv_thruster(node: Node, scope: Scope) -> list[UrdfThruster]:
    """The UUV simulator's thruster: it pushes along the axis of its joint, at its link.

    The largest force is `thrustMax`, or what `conversion` makes of the largest input.
    """
    link = _link(node, "linkName", scope)
    if not link:
        return []
    joint = scope.urdf.above.get(link)
    largest, least = node.value("thrustMax", 0.0), node.value("thrustMin", 0.0)
    largest = largest if largest > 0.0 else _converted(node)
    if largest <= 0.0:
        scope.warn(node, f"no thrustMax and no largest input; the largest thrust is {USUAL_THRUST:g} N")
        largest = USUAL_THRUST
    drive = _drive(largest, -abs(least) if least else -largest)
    config = node.configured(ThrusterConfig, drive)
    if config is None:
        return []
    scope.warn(node, SHARES)
    turns = joint is not None and joint.type in {"continuous", "revolute"}
    own, axis = scope.local(link).rpartition("/")[2], joint.axis if joint and turns else (1.0, 0.0, 0.0)
    return [UrdfThruster(own, link, joint.name if joint else None, None, config, place=node.place, axis=axis)]


def _link(node: Node, tag: str, scope: Scope) -> str:
    """The link that a child names; empty, with a warning, without one."""
    name = node.text(tag)
    for known in (name, f"{scope.urdf.namespace}/{name}"):
        if known in scope.urdf.links:
            return known
    scope.warn(node, f"{UnknownNameError('link', name, scope.urdf.links)}; this thruster is not simulated")
    return ""


def _converted(node: Node) -> float:
    """Force [N] of the largest input, where the conversion and the clamp are given: k n |n|, or the end of a table."""
    conversion, clamp = node.child("conversion"), node.value("clampMax", 0.0)
    if conversion is None:
        return 0.0
    words = conversion.text("outputValues").split()
    if words:
        return max(conversion.values("outputValues", " ".join("f" * len(words)), (0.0,) * len(words)))
    constant = conversion.value("rotorConstant", conversion.value("rotorConstantR", 0.0))
    return constant * clamp * abs(clamp)


def read_freefloating(node: Node, scope: Scope) -> list[UrdfThruster]:
    """freefloating_gazebo's thrusters with a link: they push along its -z; the joint above the link steers."""
    found = []
    for part in node.children("thruster"):
        if part.child("map") is not None:
            scope.warn(
                part, "a thruster with a <map> has no link and is not simulated; add it to the YAML beside the file"
            )
            continue
        link = _link(part, "name", scope)
        default = part.value("effortUnderWater", FREEFLOATING_THRUST, low=0)
        largest = part.value("effort", default, low=0)
        config = part.configured(ThrusterConfig, _drive(largest, -largest))
        if config is None or not link:
            continue
        scope.warn(part, SHARES)
        above = scope.urdf.above.get(link)
        hinge = above.name if above and above.type == "revolute" and not above.locked else None
        name = scope.local(link).rpartition("/")[2]
        found.append(UrdfThruster(name, link, None, hinge, config, place=part.place, axis=(0.0, 0.0, -1.0)))
    return found


def _drive(forward: float, reverse: float) -> dict[str, object]:
    return {"mapping": "linear", "max_force_forward": forward, "max_force_reverse": reverse}


THRUSTERS = {
    "usv_gazebo_thrust_plugin": read_thrusters,
    "gz-sim-thruster-system": read_newer_thruster,
    "uuv_thruster_plugin": read_uuv_thruster,
    "uuv_thruster_ros_plugin": read_uuv_thruster,
    "freefloating_gazebo_control": read_freefloating,
}


def is_thruster(filename: str) -> bool:
    """Whether a plugin of this `filename` is a thruster."""
    return library(filename) in THRUSTERS


QUIET_PLUGINS = frozenset({
    "gazebo_ros_joint_state_publisher",
    "gz-sim-detachable-joint-system",
    "gz-sim-joint-position-controller-system",
    "gz-sim-joint-state-publisher-system",
    "gz-sim-pose-publisher-system",
    "usv_gazebo_joint_state_publisher",
})  # fmt: skip
"""Plugins that only publish what ROS has anyway, or that steer what thrusters steer here."""
SDF_PARTS = ("link", "joint", "model")
"""SDF inside URDF, with which VRX ties a boat to its place."""


@dataclass
class _Forces:
    """What pushes the boat, as found so far."""

    thrusters: list[UrdfThruster] = field(default_factory=list)
    water: HydrodynamicsConfig | None = None
    wind: tuple[float, float, float] | None = None
    newer_drag: Node | None = None
    newer_hulls: list[Node] = field(default_factory=list)
    known: dict[str, Any] = field(default_factory=dict)
    controls: list[Control] = field(default_factory=list)

    def take_water(self, node: Node, scope: Scope) -> None:
        """Take VRX's dynamics plugin."""
        self.water = read_hydrodynamics(node, scope)

    def take_wind(self, node: Node, scope: Scope) -> None:
        """Take VRX's wind plugin."""
        self.wind = read_wind(node, scope)

    def take_newer_drag(self, node: Node, _: Scope) -> None:
        """Take the drag of newer VRX, which needs its hulls."""
        self.newer_drag = node

    def take_newer_hull(self, node: Node, _: Scope) -> None:
        """Take a hull of newer VRX."""
        self.newer_hulls.append(node)

    def take_fossen(self, node: Node, scope: Scope) -> None:
        """Take gz-sim's added mass and drag."""
        _check_body(node, "link_name", scope)
        self.known |= read_fossen(node, scope)

    def take_buoyancy(self, node: Node, _: Scope) -> None:
        """Take the density of gz-sim's water."""
        self.known |= read_buoyancy(node)

    def take_controls(self, node: Node, scope: Scope) -> None:
        """Take the channels of ArduPilot."""
        self.controls += read_controls(node, scope)

    def take_mesh_water(self, node: Node, scope: Scope) -> None:
        """Take the water of asv_wave_sim, which acts on the triangles of the hull."""
        scope.warn(node, "its damping and drag of each triangle are not simulated; all drag is derived from the hull")


_FORCES: Mapping[str, Callable[[_Forces, Node, Scope], None]] = {
    "usv_gazebo_dynamics_plugin": _Forces.take_water,
    "usv_gazebo_wind_plugin": _Forces.take_wind,
    "SimpleHydrodynamics": _Forces.take_newer_drag,
    "Surface": _Forces.take_newer_hull,
    "gz-sim-hydrodynamics-system": _Forces.take_fossen,
    "gz-sim-buoyancy-system": _Forces.take_buoyancy,
    "ArduPilotPlugin": _Forces.take_controls,
    "gz-waves1-hydrodynamics-system": _Forces.take_mesh_water,
    "HydrodynamicsPlugin": _Forces.take_mesh_water,
}
"""What takes a plugin of forces, by its kind."""


def read_gazebo(urdf: Urdf, tags: Sequence[Node], findings: Findings) -> Gazebo:
    """Thrusters, water, wind and sensors of a robot, by its `<gazebo>` elements, in the order of the file.

    VRX's and Hector's plugins of Gazebo classic are known by their files' names, and those that took their place in
    newer VRX as far as they mean the same; and thrusters of the UUV simulator and of freefloating_gazebo. Names and
    frames come without the namespace, poses in the root link's frame.

    Raises:
        ConfigError: For values that are wrong, and links and joints that are not there.
    """
    scope, forces = Scope(urdf, findings), _Forces()
    for node in tags:
        _read_element(node, scope, forces)
    if forces.newer_drag is not None and forces.water is None:
        forces.water = read_newer_hydrodynamics(forces.newer_drag, forces.newer_hulls, scope)
        forces.known |= {} if forces.water else _coefficients(forces.newer_drag)
    elif forces.known or forces.water is None:
        forces.known |= read_floats(forces.newer_hulls, scope)
    if forces.controls:
        forces.thrusters = controlled(forces.thrusters, forces.controls, scope)
    _check_names(forces.thrusters, scope)
    scope.findings.settle()
    return Gazebo(
        thrusters=tuple(forces.thrusters),
        hydrodynamics=forces.water,
        water=forces.known,
        wind=forces.wind,
        sensors=tuple(scope.sensors),
        warnings=tuple(scope.warnings),
    )


def _read_element(node: Node, scope: Scope, forces: _Forces) -> None:
    """One `<gazebo>`, about a link or about the whole robot."""
    reference = node.attribute("reference")
    if reference:
        node.path = f"{node.path or 'link'} '{reference}'"
    if reference and reference not in scope.urdf.links and reference not in scope.urdf.joints:
        scope.warn(node, f"no link or joint named '{reference}'; the element is ignored")
        return
    for sensor in node.children("sensor"):
        if reference in scope.urdf.links or not reference:
            read_sensor(sensor, reference or scope.urdf.root, scope)
    for plugin in node.children("plugin"):
        _read_plugin(plugin, scope, forces)
    if node.flag("static", False) or node.flag("turnGravityOff", False) or not node.flag("gravity", True):
        scope.warn(node, "static, gravity and turnGravityOff are ignored; everything floats and falls")
    parts = [f"<{part.tag}>" for tag in SDF_PARTS for part in node.children(tag)]
    if parts:
        scope.warn(node, f"{', '.join(dict.fromkeys(parts))} in SDF: ignored; nothing fixes the boat in place")


def _read_plugin(node: Node, scope: Scope, forces: _Forces) -> None:
    kind = plugin_kind(node)
    if kind in THRUSTERS:
        forces.thrusters += THRUSTERS[kind](node, scope)
    elif kind in INSTRUMENTS:
        INSTRUMENTS[kind](node, scope)
    elif kind in _FORCES:
        _FORCES[kind](forces, node, scope)
    elif kind not in QUIET_PLUGINS:
        scope.warn(node, f"the plugin {node.attribute('filename') or 'without a filename'} is not simulated")


def _check_names(thrusters: list[UrdfThruster], scope: Scope) -> None:
    lines: dict[str, int | None] = {}
    for thruster in thrusters:
        if thruster.name in lines:
            message = f"duplicate name: line {lines[thruster.name]} has a thruster of this name"
            scope.findings.problems.append(thruster.place.problem(f"thruster '{thruster.name}'", message))
        lines.setdefault(thruster.name, thruster.place.line)
