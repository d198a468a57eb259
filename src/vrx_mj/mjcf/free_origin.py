"""An origin at which a whole fleet is in free water: what is suggested where its own puts boats ashore."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely

from vrx_mj.arrays import FloatArray

__all__ = ["FARTHEST_ORIGIN", "Frame", "Place", "free_origin"]

Frame = tuple[float, float, float]
"""x, y [m] and yaw [rad] in the world."""
Place = tuple[float, float]
"""x, y [m] in the world."""
Area = Any
"""A shapely polygon in the world [m]."""

FARTHEST_ORIGIN = 300.0
"""How far from where it is asked for an origin is looked for [m]."""
STEP = 2
"""Between the places tried [m]; their coordinates are whole numbers."""
TURNS = (0, 1, -1, 2, -2, 3, -3, 4)
"""Eighths of a turn that are tried, the fleet's own heading first."""
MARGIN = 1.0
"""Water left around each boat and around all of them [m]."""
TOGETHER = 500
"""Places tried in one call of shapely's."""
AROUND = 2000.0
"""How far from the place the water is looked at [m]."""


def free_origin(
    corners: FloatArray, frame: Frame, land: Area, taken: Area, *, water: Place, middle: Place | None = None
) -> Frame | None:
    """The frame that has all boats in one free water, their middle as near as can be to where it is to be.

    None: there is none within `FARTHEST_ORIGIN`.

    Args:
        corners: outlines of the boats in the world (n, 4, 2) [m], as their present frame places them.
        frame: that present frame.
        land: what no boat may be on, and what may not be between them.
        taken: what else no boat may be on, as docks and buoys.
        water: a place [m] in the water that is meant, or near it.
        middle: where the middle of the boats is to be [m]; None: where it is.
    """
    outlines = shapely.buffer(shapely.polygons(corners), MARGIN, join_style="mitre")
    pairs = shapely.STRtree(shapely.polygons(corners)).query(shapely.polygons(corners), predicate="intersects")
    if pairs.shape[1] > len(corners):
        return None  # boats are on one another wherever they are
    inside = _water(water, land)
    shapely.prepare(inside)
    shapely.prepare(taken)
    own = _turned(shapely.get_coordinates(outlines) - frame[:2], -frame[2])
    centre = _turned(corners.reshape(-1, 2) - frame[:2], -frame[2]).mean(axis=0)
    goal = np.array(frame[:2]) + _turned(centre, frame[2]) if middle is None else np.array(middle)
    around = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(own)))
    for turn in TURNS:
        yaw = round(math.remainder(frame[2] + turn * math.pi / 4, 2 * math.pi), 2)
        boats, hull = _turned(own, yaw).reshape(len(corners), -1, 2), _turned(around, yaw)
        for places in _places(goal - _turned(centre, yaw)):
            roomy = places[shapely.contains(inside, shapely.polygons(hull + places[:, None]))]
            for place in roomy:
                if not shapely.intersects(taken, shapely.polygons(boats + place)).any():
                    return float(place[0]), float(place[1]), yaw
    return None


def _water(near: Place, land: Area) -> Area:
    """The connected water at a place, or nearest to it."""
    x, y = near
    waters = shapely.get_parts(shapely.difference(shapely.box(x - AROUND, y - AROUND, x + AROUND, y + AROUND), land))
    if len(waters) == 0:
        return shapely.Polygon()
    return waters[int(np.argmin(shapely.distance(waters, shapely.Point(near))))]


def _turned(points: FloatArray, angle: float) -> FloatArray:
    cos, sin = math.cos(angle), math.sin(angle)
    turned: FloatArray = points @ np.array([[cos, sin], [-sin, cos]])
    return turned


def _places(near: FloatArray) -> Iterator[FloatArray]:
    """Places (n, 2) [m] around one, the nearest first."""
    reach = np.arange(-FARTHEST_ORIGIN, FARTHEST_ORIGIN + STEP / 2, STEP)
    grid = np.stack(np.meshgrid(np.round(near[0]) + reach, np.round(near[1]) + reach), axis=-1).reshape(-1, 2)
    distance = np.hypot(*(grid - near).T)
    order = np.argsort(distance, kind="stable")
    grid = grid[order[: int(np.count_nonzero(distance <= FARTHEST_ORIGIN))]]
    return iter(np.array_split(grid, math.ceil(len(grid) / TOGETHER)))
