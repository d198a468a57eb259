"""Leaders of formations: who lays the track that the slots move along, and how fast they do."""

import math
from collections.abc import Mapping, Sequence

from vrx_mj.control.guidance import Point
from vrx_mj.control.navigation import Estimate
from vrx_mj.control.track import CHORD, STEP, Track, rounded
from vrx_mj.errors import UnknownNameError

__all__ = ["BoatLeader", "PathLeader"]

PATIENCE = 15.0
"""A virtual leader goes slower the further boats are behind their slots, and waits for one so far behind [m]."""


class PathLeader:
    """A virtual leader, which goes along a path and waits for boats that fall behind."""

    name: str | None = None
    """Of the boat that leads."""

    def __init__(self, path: Sequence[Point], speed: float, radius: float) -> None:
        """Along a path at a speed [m/s], its corners made arcs of a radius [m]."""
        self.track = Track(rounded(path, radius))
        self.along = 0.0
        """How far it has come [m]."""
        self.speed = 0.0
        """[m/s]"""
        self._full = speed
        self._then = math.inf

    def move(self, seen: Mapping[str, Estimate], t: float, lag: float) -> None:
        """Go on until the time `t` [s]; the boat that is furthest behind its slot is so by `lag` [m]."""
        self.along = min(self.along + self.speed * max(0.0, t - self._then), self.track.length)
        pace = self._full * max(0.0, min(1.0, 1.0 - lag / PATIENCE))
        self.speed = 0.0 if self.arrived else pace
        self._then = t

    @property
    def arrived(self) -> bool:
        """Whether it is at the end of its path."""
        return self.along >= self.track.length


class BoatLeader:
    """A boat that leads the others on the track that it lays; ahead of it and at first that goes where it heads."""

    def __init__(self, name: str) -> None:
        self.name = name
        """Of the boat that leads."""
        self.track = Track([(0.0, 0.0), (1.0, 0.0)])
        self.along = 0.0
        """How far it has come [m]."""
        self.speed = 0.0
        """[m/s]"""
        self._begun = False

    def move(self, seen: Mapping[str, Estimate], t: float, lag: float) -> None:
        """Take in where the boat is; it does not know who is behind.

        Raises:
            UnknownNameError: the boat is not there.
        """
        boat = seen.get(self.name)
        if boat is None:
            raise UnknownNameError("boat", self.name, known=seen)
        ahead = (math.cos(boat.heading), math.sin(boat.heading))
        if not self._begun:
            start = (boat.x - CHORD * ahead[0], boat.y - CHORD * ahead[1])
            self.track, self._begun = Track([start, (boat.x, boat.y)]), True
        east, north = boat.x - self.track.end[0], boat.y - self.track.end[1]
        gone = east * ahead[0] + north * ahead[1]
        if gone >= STEP:
            self.track.extend((boat.x, boat.y))
            gone = 0.0
        self.along, self.speed = self.track.length + gone, max(0.0, boat.surge)
