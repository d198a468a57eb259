"""Tracks: lines on the water that boats follow, with a length along them and a direction at every place."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from vrx_mj.control.guidance import Point, wrapped

__all__ = ["Spot", "Track", "rounded"]

STEP = 0.5
"""Between the points that an arc is made of, and of a track that is laid by sailing [m]."""
CHORD = 2.0
"""The direction of a track is that of a chord so far either way [m], so that corners and noise count little."""


class Spot(NamedTuple):
    """A place beside a track."""

    x: float
    """East [m]."""
    y: float
    """North [m]."""
    direction: float
    """Of the track [rad], counter-clockwise from east."""
    curvature: float
    """Of the track [1/m], positive to port."""
    left: float
    """Of the track [m]."""

    def pace(self, speed: float) -> float:
        """The speed [m/s] of this spot when that of its track has a `speed`: in a turn, the outer side goes faster."""
        return speed * (1.0 - self.curvature * self.left)


class Track:
    """A line through points, by its length; it goes on straight before its start and beyond its end."""

    def __init__(self, points: Sequence[Point]) -> None:
        """At least two points apart, east and north [m]."""
        self._points = [points[0]]
        self._shift = (0.0, 0.0)
        self._lengths = [0.0]
        for point in points[1:]:
            self.extend(point)

    @property
    def length(self) -> float:
        """From start to end [m]."""
        return self._lengths[-1]

    @property
    def end(self) -> Point:
        """The last point."""
        return self._points[-1][0] + self._shift[0], self._points[-1][1] + self._shift[1]

    def extend(self, point: Point) -> None:
        """Go on to a point; one nearer than a millimetre is none."""
        gap = math.dist(self.end, point)
        if gap > 1e-3:
            self._points.append((point[0] - self._shift[0], point[1] - self._shift[1]))
            self._lengths.append(self._lengths[-1] + gap)

    def shift(self, east: float, north: float) -> None:
        """Carry the whole line along [m]."""
        self._shift = self._shift[0] + east, self._shift[1] + north

    def spot(self, along: float, left: float = 0.0) -> Spot:
        """The place `along` [m] from the start and `left` [m] of the track there."""
        before, here, after = (self._place(along + way) for way in (-CHORD, 0.0, CHORD))
        direction = math.atan2(after[1] - before[1], after[0] - before[0])
        came = math.atan2(here[1] - before[1], here[0] - before[0])
        goes = math.atan2(after[1] - here[1], after[0] - here[0])
        x, y = here[0] - left * math.sin(direction), here[1] + left * math.cos(direction)
        return Spot(x, y, direction, wrapped(goes - came) / CHORD, left)

    def _place(self, along: float) -> Point:
        leg = min(max(bisect_right(self._lengths, along), 1), len(self._points) - 1)
        start, end = self._lengths[leg - 1], self._lengths[leg]
        share = (along - start) / (end - start)
        (x0, y0), (x1, y1) = self._points[leg - 1], self._points[leg]
        return x0 + share * (x1 - x0) + self._shift[0], y0 + share * (y1 - y0) + self._shift[1]


def rounded(points: Sequence[Point], radius: float) -> list[Point]:
    """The way through points with corners made arcs of a radius [m], or less where legs are too short for that."""
    way = [points[0]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        way += _arc(before, corner, after, radius)
    return [*way, points[-1]]


def _arc(before: Point, corner: Point, after: Point, radius: float) -> list[Point]:
    """From where it leaves the one leg to where it joins the other, tangent to both."""
    one, other = math.dist(before, corner), math.dist(corner, after)
    heading = math.atan2(corner[1] - before[1], corner[0] - before[0])
    turn = wrapped(math.atan2(after[1] - corner[1], after[0] - corner[0]) - heading)
    bend = math.tan(0.5 * abs(turn))
    cut = min(radius * bend, 0.5 * one, 0.5 * other)  # of each leg
    if bend < 1e-9 or cut < 1e-9:
        return [corner]
    side = math.copysign(cut / bend, turn)
    x, y = corner[0] - cut * math.cos(heading), corner[1] - cut * math.sin(heading)
    centre = (x - side * math.sin(heading), y + side * math.cos(heading))
    count = max(2, math.ceil(abs(side * turn) / STEP))
    angles = [heading + turn * i / count for i in range(count + 1)]
    return [(centre[0] + side * math.sin(angle), centre[1] - side * math.cos(angle)) for angle in angles]
