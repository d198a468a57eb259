"""Boxes in which a boat's parts must lie, and which part gets a place in which of them."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from pydantic import Field

from vrx_mj.config.base import Config, Name, Positive, Vec3, numbers

__all__ = ["FACE", "Box", "Point", "Spot", "assigned", "nearest_box", "nearest_place"]

Point = tuple[float, float, float]
"""x, y, z in base_link [m]."""

FACE = 1e-9
"""How far beyond a face still counts as on it [m]: 0.8 - 0.5 is not 0.3 to the last bit."""
INSET = 1e-3
"""Beside a face that two boxes share, a place this far inside one of them is in that one alone [m]."""


class Box(Config):
    """A box along the axes of base_link; its faces belong to it."""

    name: Name
    """Name of the box, as messages give it."""
    center: Vec3
    """[m]"""
    size: Annotated[tuple[Positive, Positive, Positive], numbers("x y z")]
    """Edges [m]."""
    capacity: Annotated[int, Field(ge=0)] | None = None
    """How many parts it takes; None for any number."""

    @property
    def low(self) -> Point:
        """Least x, y and z [m]."""
        (x, y, z), (a, b, c) = self.center, self.size
        return x - a / 2.0, y - b / 2.0, z - c / 2.0

    @property
    def high(self) -> Point:
        """Greatest x, y and z [m]."""
        (x, y, z), (a, b, c) = self.center, self.size
        return x + a / 2.0, y + b / 2.0, z + c / 2.0

    def contains(self, point: Point) -> bool:
        """Whether a point is inside or on a face."""
        return all(low - FACE <= x <= high + FACE for x, low, high in zip(point, self.low, self.high, strict=True))

    def nearest(self, point: Point, inset: float = 0.0) -> Point:
        """The place nearest to a point that is at least `inset` [m], or half an edge, inside."""
        x, y, z = (
            min(max(x, low + min(inset, edge / 2.0)), high - min(inset, edge / 2.0))
            for x, low, high, edge in zip(point, self.low, self.high, self.size, strict=True)
        )
        return x, y, z


class Spot(NamedTuple):
    """A place in a box."""

    point: Point
    box: Box
    distance: float
    """From where the part is now [m]."""


def assigned(points: Sequence[Point], boxes: Sequence[Box]) -> list[Box | None]:
    """The box of each point in turn: the first that contains it and has room. VRX's algorithm."""
    room = [math.inf if box.capacity is None else box.capacity for box in boxes]
    found: list[Box | None] = []
    for point in points:
        free = (i for i, box in enumerate(boxes) if room[i] > 0 and box.contains(point))
        index = next(free, None)
        if index is not None:
            room[index] -= 1
        found.append(None if index is None else boxes[index])
    return found


def nearest_box(point: Point, boxes: Sequence[Box]) -> Spot | None:
    """The box nearest to a point, whether it has room or not, and its nearest place."""
    return min((_spot(box.nearest(point), box, point) for box in boxes), key=_distance, default=None)


def nearest_place(points: Sequence[Point], index: int, boxes: Sequence[Box]) -> Spot | None:
    """The nearest place at which point `index` gets a box and no other point loses its own.

    None if no box has room. Exact but for places on a face that two boxes share: there it may be `INSET` off.
    """
    point, had = points[index], assigned(points, boxes)
    near = [_spot(box.nearest(point, inset), box, point) for box in boxes for inset in (0.0, INSET)]
    for spot in sorted(near, key=_distance):
        moved = [*points[:index], spot.point, *points[index + 1 :]]
        gets = assigned(moved, boxes)
        box = gets[index]
        if box is not None and all(gets[i] or not had[i] for i in range(len(points)) if i != index):
            return Spot(spot.point, box, spot.distance)
    return None


def _spot(place: Point, box: Box, point: Point) -> Spot:
    return Spot(place, box, math.dist(place, point))


def _distance(spot: Spot) -> float:
    return spot.distance
