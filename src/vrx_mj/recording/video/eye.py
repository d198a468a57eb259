"""Where the camera of a video is: behind a boat, or above the fleet, moving smoothly with them.

A recording is known as a whole, so a path is smoothed with what comes after as with what was before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.sensors.view import View

__all__ = ["Above", "Chase", "Eye", "looking", "view_of"]


CALM = 1.2
"""Standard deviation over which a followed path is smoothed [s]."""
TURN_CALM = 2.0
"""Standard deviation over which a followed heading is smoothed [s]."""
SMOOTHED = 10.0
"""Places of a smoothed path per second."""
BEHIND, HIGH, AHEAD = 11.0, 3.6, 5.0
"""Distances of the chasing camera behind the boat and over the water, and of its target before the boat [m]."""
FIELD = 1.15
"""Horizontal field of view [rad]."""
ROOM = 12.0
"""Width of water around the boats in the view from above [m]."""
LEAST = 22.0
"""Half the height of what is seen from above, at least [m]."""
NEAR, FAR = 0.3, 6000.0
"""Distances that are seen [m]."""


@dataclass(frozen=True, eq=False)
class Eye:
    """A place and a direction to look."""

    position: FloatArray
    """Position (3,) [m]."""
    rotation: FloatArray
    """Rotation (3, 3) from camera to world axes; x forward, y left, z up."""
    field: float = FIELD
    """Horizontal field of view [rad]."""


def looking(position: Sequence[float], target: Sequence[float], up: Sequence[float], field: float = FIELD) -> Eye:
    """An eye at `position` that looks at `target` [m]; `up` is what is up in the picture."""
    ahead = np.subtract(target, position)
    ahead /= np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    left /= np.linalg.norm(left)
    return Eye(np.array(position, np.float64), np.column_stack([ahead, left, np.cross(ahead, left)]), field)


def view_of(eye: Eye, width: int, height: int) -> View:
    """What an eye sees in a picture of a size [pixels]."""
    half = math.tan(eye.field / 2.0)
    return View(
        position=eye.position,
        rotation=eye.rotation,
        half_width=half,
        half_height=half * height / width,
        near=NEAR,
        far=FAR,
        focal_length=width / (2.0 * half),
    )


class Chase:
    """An eye behind a boat."""

    def __init__(self, path: FloatArray, level: float) -> None:
        """Follow a path (n, 4): time [s], east, north [m] and heading [rad], over water at `level` [m]."""
        self._level = level
        self._times, self._places = smoothed(path[:, 0], path[:, 1:3], CALM)
        _, self._headings = smoothed(path[:, 0], path[:, 3:4], TURN_CALM)

    def eye(self, time: float) -> Eye:
        """Where it is at a time [s]."""
        east, north = (float(np.interp(time, self._times, self._places[:, axis])) for axis in (0, 1))
        heading = float(np.interp(time, self._times, self._headings[:, 0]))
        along = np.array([math.cos(heading), math.sin(heading)])
        back, front = (east, north) - BEHIND * along, (east, north) + AHEAD * along
        return looking((*back, self._level + HIGH), (*front, self._level + 0.6), (0.0, 0.0, 1.0))


class Above:
    """An eye above boats, north up."""

    def __init__(self, paths: Sequence[FloatArray], level: float, aspect: float) -> None:
        """Follow paths as `Chase` does one; `aspect` is the picture's width by its height."""
        self._level, self._aspect = level, aspect
        self._paths = [smoothed(path[:, 0], path[:, 1:3], CALM) for path in paths]
        self._spans = [(path[0, 0], path[-1, 0]) for path in paths]
        self._half = max(self._needed(time) for time in np.unique(np.concatenate([path[:, 0] for path in paths]))[::10])

    def eye(self, time: float) -> Eye:
        """Where it is at a time [s]: as high as all boats need over the whole recording."""
        low, high = self._box(time)
        middle = (low + high) / 2.0
        height = self._level + self._half / math.tan(FIELD / 2.0) * self._aspect
        return looking((*middle, height), (*middle, self._level), (0.0, 1.0, 0.0))

    def _box(self, time: float) -> tuple[FloatArray, FloatArray]:
        """The least and the largest east and north of boats that are there."""
        there = [
            [np.interp(time, times, places[:, axis]) for axis in (0, 1)]
            for (times, places), (begin, end) in zip(self._paths, self._spans, strict=True)
            if begin <= time <= end
        ]
        spots = np.array(there or [[places[-1, 0], places[-1, 1]] for _, places in self._paths])
        return spots.min(axis=0), spots.max(axis=0)

    def _needed(self, time: float) -> float:
        """Half the height [m] of a picture that holds the boats."""
        low, high = self._box(time)
        width, height = (high - low) / 2.0 + ROOM
        return max(float(height), float(width) / self._aspect, LEAST)


def smoothed(time: FloatArray, values: FloatArray, calm: float) -> tuple[FloatArray, FloatArray]:
    """Times (m,) [s] and values (m, k) of a path, smoothed by a Gaussian of standard deviation `calm` [s].

    Beyond its ends the path goes on as a mirror would show it, turned by half a turn, so that a straight stays one.
    """
    from scipy.ndimage import gaussian_filter1d

    if len(time) < 2:
        return time, values
    count = max(2, math.ceil((time[-1] - time[0]) * SMOOTHED) + 1)
    grid = np.linspace(time[0], time[-1], count)
    even = np.column_stack([np.interp(grid, time, column) for column in values.T])
    pad = count - 1
    mirrored = np.concatenate([2 * even[0] - even[:0:-1], even, 2 * even[-1] - even[-2::-1]])
    sigma = calm * (count - 1) / (time[-1] - time[0])
    return grid, gaussian_filter1d(mirrored, sigma, axis=0, mode="nearest")[pad : pad + count]
