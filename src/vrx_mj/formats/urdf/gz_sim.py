"""Plugins of gz-sim and of ArduPilot that push boats: Hydrodynamics, Buoyancy, ArduPilotPlugin."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from vrx_mj.config.wording import choice
from vrx_mj.formats.urdf.elements import Node
from vrx_mj.formats.urdf.gazebo_sensors import Scope
from vrx_mj.formats.urdf.model import UrdfThruster

AXES = ("xU", "yV", "zW", "kP", "mQ", "nR")
"""Coefficients along the axes of motion: surge, sway, heave, roll, pitch, yaw."""
CROSSED = frozenset(
    f"{force}{form}{speed}{again}"
    for force, speed in itertools.product("xyzkmn", "UVWPQR")
    for form in ("", "Dot")
    for again in ("", "U", "V", "W", "P", "Q", "R")
) | frozenset(f"{a}{b}abs{c}" for a, b, c in itertools.product("xyzkmn", "UVWPQR", "UVWPQR"))
"""All coefficients that the plugin has."""
TYPES = ("COMMAND", "EFFORT", "POSITION", "VELOCITY")

Known = dict[str, Any]
"""Fields of `HydrodynamicsConfig` that a file gives; in a six None is what it does not."""


def read_fossen(node: Node, scope: Scope) -> Known:
    """Added mass and drag of gz-sim's Hydrodynamics along each axis; a drag that it does not give is not known.

    Fossen's derivatives are negative where they resist; the plugin takes its water for still.
    """
    used = {name for axis in AXES for name in _names(axis)}
    positive = [name for name in used if node.child(name) and node.value(name, 0.0) > 0.0]
    if positive:
        names = ", ".join(sorted(positive))
        scope.warn(node, f"positive coefficients push in gz-sim, here they resist as negative ones do: {names}")
    crossed = [str(one.tag) for one in node.element if one.tag in CROSSED - used and node.value(str(one.tag), 0.0)]
    if crossed:
        scope.warn(node, f"coefficients off the diagonal are ignored: {', '.join(dict.fromkeys(crossed))}")
    if any(node.values("default_current", "x y z", (0.0, 0.0, 0.0))):
        scope.warn(node, "default_current is ignored: the water has no current here")
    mass = tuple(_size(node, f"{axis[0]}Dot{axis[1]}") for axis in AXES)
    if node.flag("disable_added_mass", False):
        mass = (0.0,) * 6
    linear = tuple(_drag(node, axis, axis) for axis in AXES)
    quadratic = tuple(_drag(node, axis, *_names(axis)[2:]) for axis in AXES)
    known: Known = {"added_mass": mass, "drag_linear": linear, "drag_quadratic": quadratic}
    for tag in ("waterDensity", "water_density"):
        if node.child(tag):
            known["water_density"] = node.value(tag, 1000.0, above=0)
    return known


def _names(axis: str) -> tuple[str, ...]:
    """Added mass, linear and quadratic drag along an axis, the last by its newer and older name."""
    force, speed = axis[0], axis[1]
    return f"{force}Dot{speed}", axis, f"{axis}abs{speed}", f"{axis}{speed}"


def _size(node: Node, *names: str) -> float | None:
    """A coefficient without its sign, by the first of these names that the file has."""
    name = next((name for name in names if node.child(name)), None)
    return None if name is None else abs(node.value(name, 0.0))


def _drag(node: Node, axis: str, *names: str) -> float | None:
    """A drag along an axis: 0 where the file has only the other one, linear or quadratic."""
    found = _size(node, *names)
    given = any(node.child(name) for name in _names(axis)[1:])
    return 0.0 if found is None and given else found


def read_buoyancy(node: Node) -> Known:
    """The density of the water; what lifts are the shapes, which gz-sim too takes."""
    if node.child("uniform_fluid_density"):
        return {"water_density": node.value("uniform_fluid_density", 1000.0, above=0)}
    graded = node.child("graded_buoyancy")
    return {"water_density": graded.value("default_density", 1000.0, above=0)} if graded else {}


@dataclass(frozen=True)
class Control:
    """What a channel of ArduPilot does with a joint."""

    joint: str
    type: str
    low: float
    """Command at the least pulse [N, rad or rad/s]."""
    high: float
    """Command at the greatest pulse."""
    node: Node


def read_controls(node: Node, scope: Scope) -> list[Control]:
    """The channels of ArduPilotPlugin; a command is multiplier times the sum of offset and the share of the pulse."""
    found = []
    for part in node.children("control"):
        name, kind = scope.joint(part, "jointName"), part.text("type", "VELOCITY").upper()
        if kind not in TYPES:
            part.fault(choice(kind, TYPES), "type")
        least, most = part.value("servo_min", 1000.0), part.value("servo_max", 2000.0)
        if least >= most:
            part.fault(f"servo_min {least:g} must be below servo_max {most:g}")
        factor, offset = part.value("multiplier", 1.0), part.value("offset", 0.0)
        low, high = sorted((factor * offset, factor * (offset + 1.0)))
        if name is not None:
            found.append(Control(name, kind, low, high, part))
    scope.warn(node, "there is no link to ArduPilot; its channels give how far thrusters and steering can go")
    return found


def controlled(
    thrusters: Sequence[UrdfThruster], controls: Sequence[Control], scope: Scope
) -> list[UrdfThruster]:  # fmt: skip
    """Thrusters that push and steer no farther than the channels of ArduPilot let them."""
    found = [_narrowed(item, {one.joint: one for one in controls}) for item in thrusters]
    used = {name for item in thrusters for name in (item.propeller_joint, item.engine_joint)}
    for one in controls:
        if one.joint not in used:
            scope.warn(one.node, f"the joint '{one.joint}' neither pushes nor steers here: no thruster is on it")
    return found


def _narrowed(item: UrdfThruster, controls: Mapping[str, Control]) -> UrdfThruster:
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
