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
DRIFTING = 0.3
"""A boat slower than this over ground [m/s] carries its track along, instead of laying it."""
ASTERN = -0.5
"""So does one whose course is farther off its heading than this cosine says: 120 degrees."""
SMOOTH = 1.5
"""Time constant with which the course of a boat is smoothed [s]."""


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
        self.drift = (0.0, 0.0)
        """Velocity with which its track is carried along [m/s]: none."""
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
    """A boat that leads the others on the track that it lays over ground; ahead of it, and at first, that is straight.

    The track follows the boat's course, whatever its heading: sideways too. While the boat is nearly at rest or goes
    astern its course says nothing of where the others are to be, and the whole track is carried along with it.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        """Of the boat that leads."""
        self.track = Track([(0.0, 0.0), (1.0, 0.0)])
        self.along = 0.0
        """How far it has come [m]."""
        self.speed = 0.0
        """Along its track [m/s]."""
        self.drift = (0.0, 0.0)
        """Velocity with which its track is carried along [m/s, east and north]."""
        self._velocity = (0.0, 0.0)
        self._place: Point | None = None
        self._gone = 0.0
        self._then = 0.0

    def move(self, seen: Mapping[str, Estimate], t: float, lag: float) -> None:
        """Take in where the boat is; it does not know who is behind.

        Raises:
            UnknownNameError: the boat is not there.
        """
        boat = seen.get(self.name)
        if boat is None:
            raise UnknownNameError("boat", self.name, known=seen)
        ahead = (math.cos(boat.heading), math.sin(boat.heading))
        if self._place is None:
            start = (boat.x - CHORD * ahead[0], boat.y - CHORD * ahead[1])
            self.track, self._velocity = Track([start, (boat.x, boat.y)]), (boat.vx, boat.vy)
            self._place = boat.x, boat.y
        east, north = boat.x - self._place[0], boat.y - self._place[1]
        self._smooth(east, north, t - self._then)
        self._place, self._then = (boat.x, boat.y), t
        vx, vy = self._velocity
        speed = math.hypot(vx, vy)
        if speed < DRIFTING or vx * ahead[0] + vy * ahead[1] < ASTERN * speed:
            self.track.shift(east, north)
            self.speed, self.drift = 0.0, self._velocity
        else:
            self.speed, self.drift = speed, (0.0, 0.0)
            self._lay(boat, vx / speed, vy / speed)
        self.along = self.track.length + self._gone

    def _smooth(self, east: float, north: float, interval: float) -> None:
        """The velocity over ground without what waves do to it."""
        if interval > 0.0:
            share, (vx, vy) = 1.0 - math.exp(-interval / SMOOTH), self._velocity
            self._velocity = vx + share * (east / interval - vx), vy + share * (north / interval - vy)

    def _lay(self, boat: Estimate, east: float, north: float) -> None:
        """Extend the track by what the boat has come along its course, a unit vector."""
        x, y = self.track.end
        self._gone = max(0.0, (boat.x - x) * east + (boat.y - y) * north)
        if self._gone >= STEP:
            self.track.extend((boat.x, boat.y))
            self._gone = 0.0
