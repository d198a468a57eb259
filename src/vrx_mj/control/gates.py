"""Gates of two buoys: which buoys make one, and which gate is next.

Red right returning: who crosses a gate as it should has the red buoy to starboard.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

from vrx_mj.control.guidance import Point, wrapped

__all__ = ["WIDEST", "Gate", "gate_of", "next_gate", "opening", "paired", "side_of", "wall"]

NARROWEST, WIDEST = 5.0, 32.0
"""Of gates [m]: VRX's are 8 to 29."""
TURNING = 8.0
"""Metres of way that a radian of turning is worth, in choosing the next gate."""
FARTHEST = 75.0
"""A next gate is not further off than this [m]: VRX's are 19 to 72."""


class Gate(NamedTuple):
    """A gate, by its buoys."""

    red: Point
    """[m]"""
    partner: Point
    """[m]"""
    middle: Point
    """[m]"""
    course: float
    """Direction in which to cross it [rad], counter-clockwise from east."""
    width: float
    """[m]"""


def gate_of(red: Point, partner: Point) -> Gate:
    """The gate between two buoys [m]: across the line from the partner to the red one, that one to starboard."""
    east, north = red[0] - partner[0], red[1] - partner[1]
    middle = ((red[0] + partner[0]) / 2.0, (red[1] + partner[1]) / 2.0)
    return Gate(red, partner, middle, math.atan2(east, -north), math.hypot(east, north))


def paired(reds: Sequence[Point], partners: Sequence[Point]) -> list[Gate]:
    """The gates of buoys that are each other's nearest of the other kind, and neither too near nor too far.

    Once those have found each other, the same is asked of who is left.
    """
    gates: list[Gate] = []
    left, free = list(reds), list(partners)
    while True:
        found = _mutual(left, free)
        if not found:
            return [gate for gate in gates if NARROWEST < gate.width < WIDEST]
        gates += found
        left = [red for red in left if all(red != gate.red for gate in found)]
        free = [other for other in free if all(other != gate.partner for gate in found)]


def _mutual(reds: Sequence[Point], partners: Sequence[Point]) -> list[Gate]:
    """The gates of buoys that are each other's nearest."""
    gates = []
    for red in reds if partners else ():
        partner = min(partners, key=lambda other: math.dist(red, other))
        if min(reds, key=lambda other: math.dist(partner, other)) == red:
            gates.append(gate_of(red, partner))
    return gates


def next_gate(here: Point, course: float | None, gates: Iterable[Gate]) -> Gate | None:
    """The gate to take next from `here`, near and with little turning; `course` [rad] is that from `here`."""

    def effort(gate: Gate) -> float:
        bearing = math.atan2(gate.middle[1] - here[1], gate.middle[0] - here[0])
        turns = abs(wrapped(gate.course - bearing))
        if course is not None:
            turns += abs(wrapped(bearing - course))
        return math.dist(here, gate.middle) + TURNING * turns

    near = [gate for gate in gates if math.dist(here, gate.middle) < FARTHEST]
    return min(near, key=effort, default=None)


def side_of(gate: Gate, place: Point) -> str:
    """Where a place is: `before` a gate or `after` it, within its width, or else nothing."""
    cos, sin = math.cos(gate.course), math.sin(gate.course)
    east, north = place[0] - gate.middle[0], place[1] - gate.middle[1]
    if abs(north * cos - east * sin) >= gate.width / 2.0:
        return ""
    return "after" if east * cos + north * sin >= 0.0 else "before"


def opening(gate: Gate, buoys: Iterable[Point], berth: float) -> tuple[Point, float]:
    """Where to go through a gate [m], and how much room there is to either side [m].

    It is the gate's middle, or that of its widest part where a buoy lies in between. `berth` [m] is the distance to
    keep from buoys; what lies further before or behind the gate can be steered around.
    """
    cos, sin = math.cos(gate.course), math.sin(gate.course)
    marks = [-gate.width / 2.0, gate.width / 2.0]  # along the gate, to port positive
    for x, y in buoys:
        east, north = x - gate.middle[0], y - gate.middle[1]
        left = north * cos - east * sin
        if abs(east * cos + north * sin) < 2.0 * berth and abs(left) < gate.width / 2.0 - 1.0:
            marks.append(left)
    room = min(abs(mark) for mark in marks)
    if room >= min(berth + 0.5, gate.width / 2.0):
        return gate.middle, room
    marks.sort()
    low, high = max(pairwise(marks), key=lambda pair: pair[1] - pair[0])
    left = (low + high) / 2.0
    return (gate.middle[0] - left * sin, gate.middle[1] + left * cos), (high - low) / 2.0


def wall(gate: Gate, *, spacing: float = 2.0) -> list[Point]:
    """Places [m] along a gate, buoys included, for who is not to go through."""
    count = max(2, math.ceil(gate.width / spacing) + 1)
    shares = [step / (count - 1) for step in range(count)]
    (x, y), (to_x, to_y) = gate.red, gate.partner
    return [(x + share * (to_x - x), y + share * (to_y - y)) for share in shares]
