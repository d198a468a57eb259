"""What stands out of the water, from a lidar's returns: near ones belong together.

A lidar of 16 rings sees of a buoy a handful of points, and nothing at all where it falls between two rings; so whoever
uses this looks again and again, and keeps a map (`buoy_map`).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = ["Cluster", "clusters", "leveled"]

FloatArray = npt.NDArray[np.float64]
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
    count: int
    """Number of returns."""


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
    points = points[(points[:, 2] > low) & (points[:, 2] < high)]
    if not len(points):
        return []
    cells = np.floor(points[:, :2] / CELL).astype(np.int64)
    kinds, member = np.unique(cells, axis=0, return_inverse=True)
    label = _labels([(int(i), int(j)) for i, j in kinds])[member.ravel()]
    return [_cluster(points[label == one]) for one in range(int(label.max()) + 1)]


def _labels(cells: list[tuple[int, int]]) -> npt.NDArray[np.int64]:
    """The number of the connected part that each cell belongs to, (n,)."""
    index = {cell: row for row, cell in enumerate(cells)}
    label = np.full(len(cells), -1)
    part = 0
    for start in range(len(cells)):
        if label[start] >= 0:
            continue
        waiting = [start]
        label[start] = part
        while waiting:
            i, j = cells[waiting.pop()]
            for cell in ((i + di, j + dj) for di in (-1, 0, 1) for dj in (-1, 0, 1)):
                row = index.get(cell)
                if row is not None and label[row] < 0:
                    label[row] = part
                    waiting.append(row)
        part += 1
    return label


def _cluster(points: FloatArray) -> Cluster:
    low, high = points.min(axis=0), points.max(axis=0)
    x, y = (low[:2] + high[:2]) / 2.0
    across = float(np.hypot(*(high - low)[:2]))
    return Cluster(float(x), float(y), across, float(low[2]), float(high[2]), len(points))
