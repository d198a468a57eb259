"""What the `<gazebo>` tags of a URDF ask for, as far as it is done here; the rest is listed."""

from dataclasses import dataclass, field

from vrx_mj.config.dynamics import HydrodynamicsConfig
from vrx_mj.config.search import display
from vrx_mj.config.urdf.elements import Findings, Node
from vrx_mj.config.urdf.gazebo_forces import (
    read_hydrodynamics,
    read_newer_hydrodynamics,
    read_newer_thruster,
    read_thrusters,
    read_wind,
)
from vrx_mj.config.urdf.gazebo_instruments import INSTRUMENTS
from vrx_mj.config.urdf.gazebo_others import read_freefloating, read_uuv_thruster
from vrx_mj.config.urdf.gazebo_scope import Scope, plugin_kind
from vrx_mj.config.urdf.gazebo_sensors import read_sensor
from vrx_mj.config.urdf.model import Gazebo, Urdf, UrdfThruster
from vrx_mj.errors import Problem

__all__ = ["read_gazebo"]

THRUSTERS = {
    "usv_gazebo_thrust_plugin": read_thrusters,
    "gz-sim-thruster-system": read_newer_thruster,
    "uuv_thruster_plugin": read_uuv_thruster,
    "uuv_thruster_ros_plugin": read_uuv_thruster,
    "freefloating_gazebo_control": read_freefloating,
}
WATER, NEWER_DRAG, NEWER_HULL, WIND = (
    "usv_gazebo_dynamics_plugin",
    "SimpleHydrodynamics",
    "Surface",
    "usv_gazebo_wind_plugin",
)
QUIET_PLUGINS = frozenset({
    "gazebo_ros_joint_state_publisher",
    "gz-sim-detachable-joint-system",
    "gz-sim-joint-position-controller-system",
    "gz-sim-joint-state-publisher-system",
    "gz-sim-pose-publisher-system",
    "usv_gazebo_joint_state_publisher",
})  # fmt: skip
"""Plugins that only tell ROS what is known anyway, or that steer what thrusters steer here."""
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


def read_gazebo(urdf: Urdf) -> Gazebo:
    """Thrusters, water, wind and sensors of a robot, in the order of the file.

    VRX's and Hector's plugins of Gazebo classic are known by their files' names, and those that took their place in
    newer VRX as far as they mean the same; and thrusters of the UUV simulator and of freefloating_gazebo. Names and
    frames come without the namespace, poses in the root link's frame.

    Raises:
        ConfigError: For values that are wrong, and links and joints that are not there.
    """
    scope, forces = Scope(urdf, Findings(urdf.label or display(urdf.file))), _Forces()
    for element in urdf.gazebo:
        _read_element(Node(element, "gazebo", scope.findings), scope, forces)
    if forces.newer_drag is not None and forces.water is None:
        forces.water = read_newer_hydrodynamics(forces.newer_drag, forces.newer_hulls, scope)
    _check_names(forces.thrusters, scope)
    scope.findings.settle()
    return Gazebo(
        thrusters=tuple(forces.thrusters),
        hydrodynamics=forces.water,
        wind=forces.wind,
        sensors=tuple(scope.sensors),
        warnings=tuple(scope.warnings),
    )


def _read_element(node: Node, scope: Scope, forces: _Forces) -> None:
    """One `<gazebo>`, about a link or about the whole robot."""
    reference = node.attribute("reference")
    if reference:
        node.path = f"gazebo '{reference}'"
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
    elif kind == WATER:
        forces.water = read_hydrodynamics(node, scope)
    elif kind == WIND:
        forces.wind = read_wind(node, scope)
    elif kind == NEWER_DRAG:
        forces.newer_drag = node
    elif kind == NEWER_HULL:
        forces.newer_hulls.append(node)
    elif kind not in QUIET_PLUGINS:
        scope.warn(node, f"the plugin {node.attribute('filename') or 'without a filename'} is not simulated")


def _check_names(thrusters: list[UrdfThruster], scope: Scope) -> None:
    lines: dict[str, int | None] = {}
    for thruster in thrusters:
        if thruster.name in lines:
            message = f"duplicate name: line {lines[thruster.name]} has a thruster of this name"
            place = (scope.findings.file, thruster.line, None, f"thruster '{thruster.name}'")
            scope.findings.problems.append(Problem(*place, message))
        lines.setdefault(thruster.name, thruster.line)
