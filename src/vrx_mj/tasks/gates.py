"""Gates of two buoys: where a boat is in one (VRX navigation_scoring_plugin.cc).

The `left` marker of VRX's files comes to starboard of a boat that crosses the gate as it should: red right returning.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Literal, NamedTuple

from vrx_mj.tasks.frame import Frame, Stand

__all__ = ["Gate", "GateFate", "Passage", "Side", "gate_between", "marker_names", "passage", "side_of"]

Side = Literal["outside", "before", "after"]
Passage = Literal["forwards", "backwards"]
GateFate = Literal["ahead", "crossed", "missed", "backwards"]
"""What became of a gate: `missed` if a later one was passed before it."""


class Gate(NamedTuple):
    """Where a gate is now; buoys drift."""

    x: float
    """Of the middle [m], east."""
    y: float
    """[m], north."""
    yaw: float
    """Direction in which to cross it [rad], counter-clockwise from east."""
    width: float
    """[m]; as in VRX between the buoys' origins in space, so that their heights count."""


def gate_between(left: Stand, right: Stand) -> Gate:
    """The gate of two buoys."""
    across_x, across_y = left.x - right.x, left.y - right.y
    width = math.hypot(across_x, across_y, left.z - right.z)
    yaw = math.atan2(across_x, -across_y)
    return Gate((left.x + right.x) / 2.0, (left.y + right.y) / 2.0, yaw, width)


def side_of(gate: Gate, x: float, y: float) -> Side:
    """Where a point is: in the strip of the gate's width `before` it or `after` it, or `outside` of the strip."""
    east, north = x - gate.x, y - gate.y
    along_x, along_y = math.cos(gate.yaw), math.sin(gate.yaw)
    if abs(north * along_x - east * along_y) > gate.width / 2.0:
        return "outside"
    return "after" if east * along_x + north * along_y >= 0.0 else "before"


def marker_names(gates: Iterable[Mapping[str, str]]) -> tuple[str, ...]:
    """Names of the buoys of gates, each once."""
    return tuple(dict.fromkeys(name for gate in gates for name in (gate["left"], gate["right"])))


def passage(gate: Mapping[str, str], before: str, boat: str, frame: Frame) -> tuple[Side, Passage | None]:
    """Where the boat is in a gate now, and whether it has passed it since it was at `before`."""
    stands = frame.stands
    place = stands[boat]
    now = side_of(gate_between(stands[gate["left"]], stands[gate["right"]]), place.x, place.y)
    if now == "after" and before == "before":
        return now, "forwards"
    return now, "backwards" if now == "before" and before == "after" else None
