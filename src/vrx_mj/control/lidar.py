"""What a lidar sees on the water: clusters of returns, in the local frame."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vrx_mj.control.guidance import Point
from vrx_mj.control.navigation import Estimate

__all__ = ["LIDAR_MOUNT", "Cluster", "Lookout", "clusters", "in_local_frame"]

FloatArray = npt.NDArray[np.float64]
LIDAR_MOUNT = (0.7, 0.0, 1.8)
"""Of the WAM-V's lidar [m], body frame, level: its place in VRX's wamv_gazebo.urdf.xacro."""
BOAT = (3.2, 1.8)
"""Half length and half width [m] of the box about `base_link` in which returns are the boat's own."""
CELL = 0.4
"""Of the grid on which returns are joined [m]: those in cells that touch are of one thing."""
FAINT = 2
"""A thing has at least so many returns; fewer are noise."""
FORGET = 30.0
"""An obstacle not seen for so long [s] is forgotten."""
SAME = 1.5
"""Obstacles this near each other [m] are one, seen again."""


@dataclass(frozen=True)
class Cluster:
    """A thing that the lidar sees."""

    x: float
    """East [m], local frame, of the middle of its returns."""
    y: float
    """North [m], as above."""
    top: float
    """Of its highest return [m] over the water at rest."""
    bottom: float
    """Of its lowest return [m], as above."""
    width: float
    """Between its outermost returns [m], across the line of sight or along it."""
    count: int
    """Returns."""


def in_local_frame(points: npt.NDArray[np.float32], seen: Estimate, reach: float) -> FloatArray:
    """(n, 3): returns [m] of a cloud within `reach` [m] of the boat, without the boat's own; east, north and up."""
    own = points.astype(np.float64) + LIDAR_MOUNT
    x, y = own[:, 0], own[:, 1]
    near = x * x + y * y < reach * reach
    outside = (np.abs(x) > BOAT[0]) | (np.abs(y) > BOAT[1])
    return np.asarray(own[near & outside] @ seen.rotation.T + (seen.x, seen.y, seen.z))


def clusters(points: FloatArray) -> list[Cluster]:
    """Returns (n, 3) joined to things, from west to east."""
    groups: dict[tuple[int, int], list[int]] = {}
    for index, (column, row) in enumerate(np.floor(points[:, :2] / CELL).astype(int).tolist()):
        groups.setdefault((column, row), []).append(index)
    found = []
    while groups:
        members = _flood(groups, next(iter(groups)))
        if len(members) >= FAINT:
            found.append(_cluster(points[members]))
    return sorted(found, key=lambda cluster: (cluster.x, cluster.y))


def _flood(groups: dict[tuple[int, int], list[int]], start: tuple[int, int]) -> list[int]:
    """Take a cell and all that are joined to it out of the grid; their returns."""
    members, front = groups.pop(start), [start]
    while front:
        column, row = front.pop()
        for cell in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            if cell in groups:
                members += groups.pop(cell)
                front.append(cell)
    return members


def _cluster(points: FloatArray) -> Cluster:
    low, high = points.min(axis=0), points.max(axis=0)
    x, y, _ = (0.5 * (low + high)).tolist()
    width = float(np.hypot(*(high - low)[:2]))
    return Cluster(x, y, float(high[2]), float(low[2]), width, len(points))


class Lookout:
    """Obstacles that the lidar has seen, kept for a while."""

    def __init__(self, *, reach: float = 30.0, widest: float = 3.0) -> None:
        """`reach`: how far it looks [m]; `widest`: what is wider [m] is no buoy, but a shore or a dock."""
        self._reach, self._widest = reach, widest
        self._seen: list[tuple[Point, float]] = []

    def update(self, points: npt.NDArray[np.float32], seen: Estimate, t: float) -> None:
        """Take a cloud in."""
        for thing in clusters(in_local_frame(points, seen, self._reach)):
            if thing.width < self._widest:
                self._seen = [row for row in self._seen if _apart(row[0], thing) > SAME]
                self._seen.append(((thing.x, thing.y), t))
        self._seen = [row for row in self._seen if t - row[1] < FORGET]

    @property
    def obstacles(self) -> list[Point]:
        """Where they are [m]."""
        return [place for place, _ in self._seen]


def _apart(place: Point, thing: Cluster) -> float:
    return float(np.hypot(place[0] - thing.x, place[1] - thing.y))
