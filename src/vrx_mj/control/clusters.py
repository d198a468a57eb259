"""What stands out of the water, from a lidar's returns: near ones belong together.

A lidar of 16 rings sees of a buoy a handful of points, and nothing at all where it falls between two rings; so whoever
uses this looks again and again, and keeps a map (`buoy_map`).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray

__all__ = ["Cluster", "banks", "clusters", "grouped", "leveled", "standing_free"]

Bank = tuple[float, float]
"""A place that something solid is at [m]."""
CELL = 0.5
"""Side of the grid's cells [m]: returns in cells that touch, corners included, belong together."""
OWN = (-3.2, 3.2, 1.8)
"""The boat itself: from stern to bow, and to either side [m], body frame."""


class Cluster(NamedTuple):
    """Returns that belong together."""

    x: float
    """Of the middle [m], level axes as the points."""
    y: float
    extent: float
    """Largest horizontal distance across [m]."""
    bottom: float
    """Height of the lowest return [m]."""
    top: float
    """Height of the highest [m]."""
    returns: int
    """Their number."""


def leveled(
    points: npt.ArrayLike, mount: tuple[FloatArray, FloatArray], attitude: FloatArray, *, reach: float
) -> FloatArray:
    """Lidar returns in level axes, (n, 3) [m]: east, north and up from the boat's origin.

    Args:
        points: (n, 3) returns [m], sensor frame.
        mount: where the sensor is on the boat: position (3,) [m] and rotation (3, 3), sensor to body.
        attitude: (3, 3) rotation of the body to level axes.
        reach: returns further off than this [m], and those from the boat itself, are left out.
    """
    position, rotation = mount
    seen = np.asarray(points, np.float64) @ rotation.T + position
    stern, bow, side = OWN
    own = (seen[:, 0] > stern) & (seen[:, 0] < bow) & (np.abs(seen[:, 1]) < side)
    near = np.hypot(seen[:, 0], seen[:, 1]) < reach
    level: FloatArray = seen[near & ~own] @ attitude.T
    return level


def clusters(points: FloatArray, *, low: float = -0.6, high: float = 3.5) -> list[Cluster]:
    """Clusters of level returns, (n, 3) [m], between two heights [m]; the boat's origin floats near 0."""
    return [_cluster(part) for part in grouped(points[(points[:, 2] > low) & (points[:, 2] < high)])]


def grouped(points: FloatArray) -> list[FloatArray]:
    """Points, (n, 3) [m], in groups of those that belong together, seen from above."""
    if not len(points):
        return []
    cells = np.floor(points[:, :2] / CELL).astype(np.int64)
    kinds, member = np.unique((cells[:, 0] << 32) + cells[:, 1], return_inverse=True)
    label = _parts(kinds)[member]
    order = np.argsort(label, kind="stable")
    ends = np.cumsum(np.bincount(label))[:-1]
    return [part for part in np.split(points[order], ends) if len(part)]


def _parts(keys: IntArray) -> IntArray:
    """The part, a number, that each cell belongs to, of sorted keys: column, times 2^32, plus row."""
    label = np.arange(len(keys))
    ends = [_neighbours(keys, (i << 32) + j) for i, j in ((0, 1), (1, -1), (1, 0), (1, 1))]
    one, other = (np.concatenate(side) for side in zip(*ends, strict=True))
    while True:
        least = np.minimum(label[one], label[other])
        after = label.copy()
        np.minimum.at(after, one, least)
        np.minimum.at(after, other, least)
        after = after[after]
        if np.array_equal(after, label):
            return label
        label = after


def _neighbours(keys: IntArray, step: int) -> tuple[IntArray, IntArray]:
    """Rows of the cells that have a neighbour one step on, and the rows of those."""
    place = np.minimum(np.searchsorted(keys, keys + step), len(keys) - 1)
    rows = np.nonzero(keys[place] == keys + step)[0]
    return rows, place[rows]


def _cluster(points: FloatArray) -> Cluster:
    low, high = points.min(axis=0), points.max(axis=0)
    x, y = (low[:2] + high[:2]) / 2.0
    across = float(np.hypot(*(high - low)[:2]))
    return Cluster(float(x), float(y), across, float(low[2]), float(high[2]), len(points))


def standing_free(
    points: FloatArray, *, widest: float, apart: float, low: float = -0.6, high: float = 3.5
) -> tuple[list[Cluster], FloatArray]:
    """What is narrow and stands free, and the returns of what is wide, (n, 3) [m], as shores and docks.

    Of level returns, (n, 3) [m]: clusters up to `widest` [m] across that keep `apart` [m] from all wider ones.
    """
    groups = grouped(points[(points[:, 2] > low) & (points[:, 2] < high)])
    found = [(_cluster(group), group) for group in groups]
    small = [cluster for cluster, _ in found if cluster.extent <= widest]
    broad = [group for cluster, group in found if cluster.extent > widest]
    if not broad:
        return small, np.empty((0, 3))
    wide = np.concatenate(broad)
    free = [one for one in small if float(np.hypot(wide[:, 0] - one.x, wide[:, 1] - one.y).min()) > apart]
    return free, wide


def banks(points: FloatArray, here: tuple[float, float], *, reach: float = 20.0, cell: float = 2.0) -> list[Bank]:
    """Where something stands out of the water near by [m], one place in each cell with returns, (n, 3) from `here`."""
    near = points[(np.hypot(points[:, 0], points[:, 1]) < reach) & (points[:, 2] > -0.3)]
    cells = np.unique(np.floor(near[:, :2] / cell), axis=0)
    return [(here[0] + float(x), here[1] + float(y)) for x, y in (cells + 0.5) * cell]
