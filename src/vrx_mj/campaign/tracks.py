"""What is noted of a trial while it runs: tracks of the boats, with few points, and times for a stopwatch."""

from typing import Protocol

from vrx_mj.arrays import FloatArray

__all__ = ["Stopwatch", "Tracks", "simplified"]

Point = tuple[float, float]
APART = 0.3
"""Places nearer than this to the one kept before are left out while sailing [m]."""
TOLERANCE = 0.2
"""How far a simplified track may be from the true one [m]."""
MOST = 400
"""Points of a simplified track, at most."""


class Stopwatch(Protocol):
    """Who sees to it that a trial ends."""

    def allow(self, wall: float) -> None:
        """The trial may take this wall time [s] from now on."""

    def reach(self, moment: float) -> None:
        """The trial has reached this simulated time [s]."""

    def lead(self, group: int) -> None:
        """A program that sails it has this process group; 0: it has none any more."""


class Tracks:
    """Collects the places of boats while they sail."""

    def __init__(self) -> None:
        self._places: dict[str, list[Point]] = {}

    def add(self, boat: str, position: FloatArray) -> None:
        """Take a boat's position [m, ENU]."""
        x, y = float(position[0]), float(position[1])
        places = self._places.setdefault(boat, [])
        if not places or abs(x - places[-1][0]) + abs(y - places[-1][1]) > APART:
            places.append((x, y))

    def simplified(self) -> dict[str, list[list[float]]]:
        """The track of each boat, east and north [m] to a decimetre."""
        return {boat: simplified(places) for boat, places in self._places.items()}


def simplified(places: list[Point]) -> list[list[float]]:
    """A line through few of these places (Douglas and Peucker 1973), with a tolerance that keeps it short enough."""
    from shapely import LineString

    if len(places) < 3:
        return _rounded(places)
    tolerance, line = TOLERANCE, LineString(places)
    while len(line.coords) > MOST or tolerance == TOLERANCE:
        line, tolerance = line.simplify(tolerance, preserve_topology=False), 1.5 * tolerance
    return _rounded(list(line.coords))


def _rounded(places: list[Point]) -> list[list[float]]:
    return [[round(x, 1), round(y, 1)] for x, y in places]
