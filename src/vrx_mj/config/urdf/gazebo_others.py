"""Thrusters in the tags of other simulators: the UUV simulator, and freefloating_gazebo, which usv_sim uses."""

from typing import Any

from vrx_mj.config.dynamics import ThrusterConfig
from vrx_mj.config.urdf.elements import Node
from vrx_mj.config.urdf.gazebo_scope import Scope
from vrx_mj.config.urdf.model import UrdfThruster
from vrx_mj.errors import UnknownNameError

__all__ = ["read_freefloating", "read_uuv_thruster"]

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
    joint = next((joint for joint in scope.urdf.joints.values() if joint.child == link), None)
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
    return [UrdfThruster(own, link, joint.name if joint else None, None, config, line=node.line, axis=axis)]


def _link(node: Node, tag: str, scope: Scope) -> str:
    """The link that a child names; empty, with a warning, if there is none."""
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
        above = next((joint for joint in scope.urdf.joints.values() if joint.child == link), None)
        hinge = above.name if above and above.type == "revolute" and not above.locked else None
        name = scope.local(link).rpartition("/")[2]
        found.append(UrdfThruster(name, link, None, hinge, config, line=part.line, axis=(0.0, 0.0, -1.0)))
    return found


def _drive(forward: float, reverse: float) -> dict[str, Any]:
    return {"mapping": "linear", "max_force_forward": forward, "max_force_reverse": reverse}
