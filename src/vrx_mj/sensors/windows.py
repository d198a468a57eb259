"""Which rays of a lidar can meet a box or a triangle: a window of its rings and a window of its samples.

Rays stand on a grid, ring `r` at elevation `elevation[0] + r * elevation[1]` and sample `s` at azimuth
`azimuth[0] + s * azimuth[1]`, both [rad] in the sensor's frame: x forward, y left, z up. A window is the first
and the last index of those that may hit, empty where the last is below the first. It may be too wide, by
rounding, but never too narrow.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel

__all__ = ["GRID", "angles", "grid", "ray_count", "sample_window", "turns", "whole", "window"]

GRID = np.dtype(
    [
        ("rings", np.int64),
        ("samples", np.int64),
        ("elevation", np.float64, (2,)),  # of ring 0, and the step to the next [rad]
        ("azimuth", np.float64, (2,)),  # of sample 0, and the step to the next [rad]
        ("near", np.float64),  # where rays begin [m]
        ("far", np.float64),  # where they end [m]
    ],
    align=True,
)

_SLACK = 1e-6
"""By which windows are wider than what is seen [rad]: far more than their rounding, far less than a ray's step."""


def grid(
    rings: int,
    samples: int,
    elevation: tuple[float, float],
    azimuth: tuple[float, float],
    reach: tuple[float, float],
) -> npt.NDArray[np.void]:
    """A table of one row of `GRID`: angles from the first to the last ray, both included, as Gazebo has them.

    Args:
        rings: number of elevations.
        samples: number of azimuths.
        elevation: of the first and the last ring [rad], cut at straight down and up.
        azimuth: of the first and the last sample [rad].
        reach: where rays begin and where they end [m].
    """
    table, low, high = np.zeros(1, GRID), -0.5 * math.pi, 0.5 * math.pi
    elevation = (min(max(elevation[0], low), high), min(max(elevation[1], low), high))
    table[0] = (rings, samples, _steps(elevation, rings), _steps(azimuth, samples), *reach)
    return table


def _steps(span: tuple[float, float], count: int) -> tuple[float, float]:
    return span[0], (span[1] - span[0]) / (count - 1) if count > 1 else 0.0


def angles(span: FloatArray, count: int) -> FloatArray:
    """The (count,) angles [rad] that `GRID.elevation` or `GRID.azimuth` stands for."""
    return np.asarray(span[0] + span[1] * np.arange(count))


@kernel
def _interval(span: FloatArray, count: int, low: float, high: float) -> tuple[int, int]:
    """Return the first and the last of `count` angles, span[0] and on by span[1], that lie in [low, high]."""
    if span[1] == 0.0:
        return 0, count - 1 if low <= span[0] <= high else -1
    a, b = (low - span[0]) / span[1], (high - span[0]) / span[1]
    return max(0, math.ceil(min(a, b))), min(count - 1, math.floor(max(a, b)))


@kernel
def whole(rays: Any) -> tuple[int, int, float, float]:
    """Return the window of all rays."""
    return 0, rays.rings - 1, 0.0, math.inf


@kernel
def _azimuths(corners: FloatArray) -> tuple[float, float]:
    """Return the middle azimuth of points and half their width [rad]; half a turn or more: they are all round."""
    x, y = corners[0, 0], corners[0, 1]
    right, left = 0.0, 0.0
    for i in range(1, len(corners)):
        angle = math.atan2(x * corners[i, 1] - y * corners[i, 0], x * corners[i, 0] + y * corners[i, 1])
        right, left = min(right, angle), max(left, angle)
    return math.atan2(y, x) + 0.5 * (left + right), 0.5 * (left - right) + _SLACK


@kernel
def window(rays: Any, corners: FloatArray) -> tuple[int, int, float, float]:
    """Return the window of rings for the convex hull of `corners`, its middle azimuth and half its width [rad].

    The half width is infinite where all samples may hit: where the hull is above, below or about the sensor.

    Args:
        rays: a row of `GRID`.
        corners: (n, 3) in the sensor's frame [m].
    """
    azimuth, half = _azimuths(corners)
    ux, uy = math.cos(azimuth), math.sin(azimuth)
    nearest, farthest, beyond, low, high = math.inf, 0.0, 0.0, math.inf, -math.inf
    for i in range(len(corners)):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        nearest, farthest = min(nearest, ux * x + uy * y), max(farthest, x * x + y * y)
        beyond = max(beyond, x * x + y * y + z * z)
        low, high = min(low, z), max(high, z)
    farthest = math.sqrt(farthest)
    around = half >= 0.5 * math.pi or nearest <= _SLACK * farthest
    nearest = 0.0 if around else nearest
    if nearest > rays.far or beyond < rays.near**2:
        return 0, -1, 0.0, 0.0
    bottom = math.atan2(low, nearest if low < 0.0 else farthest) - _SLACK
    top = math.atan2(high, nearest if high > 0.0 else farthest) + _SLACK
    first, last = _interval(rays.elevation, rays.rings, bottom, top)
    return first, last, azimuth, math.inf if around else half


@kernel
def ray_count(rays: Any, seen: Any) -> float:
    """Return about how many rays a window has; it may be one sample more."""
    lowest, highest, _, half = seen
    width = 2.0 * half / abs(rays.azimuth[1]) if rays.azimuth[1] != 0.0 else math.inf
    return float(max(highest - lowest + 1, 0) * min(width, float(rays.samples)))


@kernel
def turns(rays: Any, azimuth: float, half: float) -> tuple[int, int]:
    """Return the first and the last number of full turns by which azimuth +- half [rad] meets the grid."""
    if half == math.inf:
        return 0, 0
    end = rays.azimuth[0] + rays.azimuth[1] * (rays.samples - 1)
    low, high = min(rays.azimuth[0], end), max(rays.azimuth[0], end)
    turn = 2.0 * math.pi
    return math.ceil((low - azimuth - half) / turn), math.floor((high - azimuth + half) / turn)


@kernel
def sample_window(rays: Any, azimuth: float, half: float, turn: int) -> tuple[int, int]:
    """Return the window of samples for azimuth +- half [rad], `turn` full turns further (see `turns`)."""
    if half == math.inf:
        return 0, rays.samples - 1
    centre = azimuth + 2.0 * math.pi * turn
    return _interval(rays.azimuth, rays.samples, centre - half, centre + half)
