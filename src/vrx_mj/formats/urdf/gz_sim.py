"""Plugins of gz-sim and of ArduPilot that push boats: Hydrodynamics, Buoyancy, ArduPilotPlugin."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pydantic import ValidationError

from vrx_mj.config.robots import ChannelEntry
from vrx_mj.config.wording import choice
from vrx_mj.formats.urdf.elements import Node, Tag, Values
from vrx_mj.formats.urdf.gazebo_sensors import Scope
from vrx_mj.formats.urdf.model import UrdfThruster

_AXES = ("xU", "yV", "zW", "kP", "mQ", "nR")
"""Coefficients along the axes of motion: surge, sway, heave, roll, pitch, yaw."""
_FOSSEN = {axis: (f"{axis[0]}Dot{axis[1]}", axis, f"{axis}abs{axis[1]}", f"{axis}{axis[1]}") for axis in _AXES}
"""Tags of added mass [kg, kg m2], linear [N s/m, N m s] and quadratic drag, the last by its newer and older name."""
CURRENT = Tag("default_current", (0.0, 0.0, 0.0), "m/s"), "{} is ignored: the water has no current here"
_TYPES = ("COMMAND", "EFFORT", "POSITION", "VELOCITY")

_COEFFICIENT = re.compile(r"[xyzkmn](Dot)?[UVWPQR][UVWPQR]?|[xyzkmn][UVWPQR]abs[UVWPQR]")


def read_fossen(node: Node, scope: Scope) -> Values:
    """Added mass and drag of gz-sim's Hydrodynamics along each axis; a drag that it does not give is not known.

    Fossen's derivatives are negative where they resist; the plugin takes its water for still.
    """
    used = {tag for tags in _FOSSEN.values() for tag in tags}
    positive = [tag for tag in used if node.value(tag, 0.0) > 0.0]
    if positive:
        names = ", ".join(sorted(positive))
        scope.warn(node, f"positive coefficients push in gz-sim, here they resist as negative ones do: {names}")
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
    commands = {joint: f"{name}_angle" for joint, name in turned.items()}
    commands |= {item.engine_joint: f"{item.name}_angle" for item in thrusters}
    commands |= {item.propeller_joint: item.name for item in thrusters}
    channels = {}
    for one in controls:
        if one.joint not in commands:
            scope.warn(one.node, f"the joint '{one.joint}' neither pushes nor steers here: no thruster is on it")
            continue
        try:
            channels[one.channel] = ChannelEntry(thruster=commands[one.joint], trim=one.trim, span=one.span)
        except ValidationError:
            scope.warn(one.node, f"channel {one.channel} is ignored: no servo has a trim of {one.trim:g} us")
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
