"""What a body displaces that floats upright at some level: Archimedes' principle over flat faces, exactly."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray

__all__ = ["Displaced", "displaced", "floating_level"]


@dataclass(frozen=True)
class Displaced:
    """What is under a level, and the waterplane that the level cuts."""

    volume: float
    """[m3]"""
    center: FloatArray
    """(3,): centre of buoyancy [m]"""
    area: float
    """Of the waterplane [m2]."""
    spread: FloatArray
    """(2,): second moments of the waterplane along x and along y, about its centroid [m4]"""


def displaced(corners: FloatArray, level: float) -> Displaced:
    """What closed triangles (n, 3, 3) displace below z = `level` [m].

    Gauss's theorem with fields that vanish at the level, so that only wet faces count: V is the integral of
    (z - level) n_z over them, and the waterplane's area that of -n_z. Midpoints of edges integrate quadratics exactly.
    """
    wet = _below(corners, level)
    along, across = wet[:, 1] - wet[:, 0], wet[:, 2] - wet[:, 0]
    weight = ((along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]) / 6.0)[:, None]  # a third of the area on z = 0
    x, y, z = np.moveaxis((wet + np.roll(wet, -1, axis=1)) / 2.0, 2, 0)
    volume, area = float((weight * (z - level)).sum()), -3.0 * float(weight.sum())
    if volume <= 0.0:
        return Displaced(0.0, np.zeros(3), 0.0, np.zeros(2))
    moments = [float((weight * value).sum()) for value in (x * (z - level), y * (z - level), (z * z - level**2) / 2.0)]
    spread = [-float((weight * v * v).sum()) - float((weight * v).sum()) ** 2 / area if area > 0.0 else 0.0
              for v in (x, y)]  # fmt: skip
    return Displaced(volume, np.array(moments) / volume, area, np.maximum(spread, 0.0))


def floating_level(corners: FloatArray, volume: float) -> float:
    """The level [m] up to which closed triangles displace a volume [m3], which must be less than all of theirs."""
    from scipy.optimize import brentq

    heights = corners[:, :, 2]
    low, high = float(heights.min()), float(heights.max())
    found: Any = brentq(lambda level: displaced(corners, level).volume - volume, low, high, xtol=1e-5 * (high - low))
    return float(found)


def _below(corners: FloatArray, level: float) -> FloatArray:
    """The parts of triangles below a level, as triangles that turn the same way."""
    wet = corners[:, :, 2] < level
    count = wet.sum(axis=1)
    a, b, c = _starting(corners[count == 1], wet[count == 1])
    tip = np.stack([a, _cut(a, b, level), _cut(a, c, level)], axis=1)
    a, b, c = _starting(corners[count == 2], ~wet[count == 2])
    left, right = _cut(b, a, level), _cut(c, a, level)
    first, second = np.stack([left, b, c], axis=1), np.stack([left, c, right], axis=1)
    return np.concatenate([corners[count == 3], tip, first, second])


def _starting(corners: FloatArray, marked: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The three corners of triangles in their order, from the one that is marked."""
    rows, start = np.arange(len(corners)), marked.argmax(axis=1) if len(corners) else np.empty(0, dtype=np.int64)
    return corners[rows, start], corners[rows, (start + 1) % 3], corners[rows, (start + 2) % 3]


def _cut(wet: FloatArray, dry: FloatArray, level: float) -> FloatArray:
    """Where lines from wet points to dry ones pass the level."""
    share = (level - wet[:, 2]) / (dry[:, 2] - wet[:, 2])
    return wet + share[:, None] * (dry - wet)
