"""Searching: where to go as long as nothing is known of what is looked for."""

import math
from collections.abc import Iterable

from vrx_mj.control.guidance import Point, wrapped
from vrx_mj.control.navigation import Estimate

__all__ = ["Roam", "in_a_row"]

LEGS = ((50.0, 0.0), (100.0, 0.0), (100.0, 0.7), (150.0, 0.35), (100.0, -0.7), (150.0, -0.35))
"""Where to look: distances [m] and angles [rad] from where the search began. A lidar sees things at 60 to 110 m."""
PATIENCE = 40.0
"""How long one of them is tried for [s]: a shore may lie before it."""
THERE = 6.0
"""A place within this distance [m] was reached."""
ASIDE = 1.9
"""Boats begin with the bow toward the course: what lies further than this [rad] off it is taken for the shore's."""


ROW, MOST = 12.0, 1
"""What has more others than that within that distance [m] is one of many: stones of a shore."""


def in_a_row(place: Point, others: Iterable[Point]) -> bool:
    """Whether something unknown is one of many: a lidar sees one stone here and one there."""
    return sum(0.0 < math.dist(place, other) < ROW for other in others) > MOST


class Roam:
    """Places ahead of where a search began, one after the other."""

    def __init__(self, place: Point, heading: float, time: float) -> None:
        """It begins at a place [m] with a heading [rad] at a time [s]."""
        self._place, self._heading, self._since = place, heading, time
        self._leg = 0

    def next(self, seen: Estimate, time: float) -> Point:
        """Where to go now [m]."""
        if seen.to(*self._goal)[0] < THERE or time - self._since > PATIENCE:
            self._leg, self._since = self._leg + 1, time
        return self._goal

    def likely(self, place: Point, reach: float) -> bool:
        """Whether a place may be of the course: it lies ahead of the beginning, and not too far off."""
        bearing = math.atan2(place[1] - self._place[1], place[0] - self._place[0])
        return math.dist(place, self._place) < reach and abs(wrapped(bearing - self._heading)) < ASIDE

    @property
    def _goal(self) -> Point:
        away, angle = LEGS[self._leg % len(LEGS)]
        bearing = self._heading + angle
        return self._place[0] + away * math.cos(bearing), self._place[1] + away * math.sin(bearing)
