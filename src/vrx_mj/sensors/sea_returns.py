"""Where the rays of a lidar meet the sea, for those that want to see it."""

import math
from typing import Any

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.cosine import cosine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import ramp

__all__ = ["cast_at_sea", "sea_distance"]


_TOUCH = 1e-9
"""A ray so little above the surface has met it [m]."""
_STEPS = 200
"""A ray that has not met the surface after so many steps only grazes it, and does not return."""


@kernel
def _along(waves: Table, x: float, y: float, dx: float, dy: float, t: float) -> tuple[float, float]:
    """Return the height [m] of the grown sea over its mean at (x, y), and its slope along (dx, dy)."""
    height, slope = 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        phase = wave.wavenumber * (wave.direction[0] * x + wave.direction[1] * y) - wave.frequency * t
        phase += wave.phase
        height += wave.amplitude * cosine(phase)
        slope -= wave.amplitude * wave.wavenumber * (wave.direction[0] * dx + wave.direction[1] * dy) * math.sin(phase)
    return height, slope


@kernel
def _bounds(waves: Table, dx: float, dy: float) -> tuple[float, float]:
    """Return the most that the grown sea rises over its mean [m], and that it bends along (dx, dy) [1/m]."""
    height, bend = 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        rate = wave.wavenumber * (wave.direction[0] * dx + wave.direction[1] * dy)
        height += abs(wave.amplitude)
        bend += abs(wave.amplitude) * rate * rate
    return height, bend


@kernel
def sea_distance(
    waves: Table, sea: Record, t: float, origin: FloatArray, along: FloatArray, begin: float, end: float
) -> float:
    """Return how far a ray goes until it first meets the sea's surface from above [m], else infinity.

    With f(s) the height of the ray over the surface, no bend of the surface is sharper than some M, so that
    f(s + h) >= f + f' h - M h^2 / 2. Each step goes to where that bound is zero: it passes no crossing, and near one
    it converges as Newton's method does.

    Args:
        waves: `tables.WAVE`.
        sea: a row of `tables.SEA`.
        t: time [s].
        origin: (3,) of the ray, world [m].
        along: (3,) its unit vector.
        begin: where on the ray to begin [m].
        end: where to end [m].
    """
    grown = ramp(sea, t)
    highest, bend = _bounds(waves, along[0], along[1])
    highest, bend = grown * highest, grown * bend
    over = origin[2] + begin * along[2] - sea.level - highest
    if over > 0.0:  # down to the height of the highest crest
        if along[2] >= 0.0:
            return math.inf
        begin -= over / along[2]
    s = begin
    for step in range(_STEPS):
        if not s < end:
            return math.inf
        x, y = origin[0] + s * along[0], origin[1] + s * along[1]
        height, slope = _along(waves, x, y, along[0], along[1], t)
        gap = origin[2] + s * along[2] - sea.level - grown * height
        if gap <= _TOUCH:
            return s if step > 0 or gap >= -_TOUCH else math.inf  # from under water nothing is seen
        rate = along[2] - grown * slope
        root = math.sqrt(rate * rate + 2.0 * bend * gap)
        if rate < 0.0:
            s += 2.0 * gap / (root - rate)
        elif bend > 0.0:
            s += (rate + root) / bend
        else:
            return math.inf
    return math.inf


@kernel
def cast_at_sea(
    view: Any, rays: Any, directions: FloatArray, waves: Table, sea: Record, t: float, found: FloatArray
) -> None:
    """Shorten rays to where they meet the sea; the arguments are those of `rays.cast` and of `sea_distance`."""
    turned, along = view.rotation, view.along
    for ray in range(len(found)):
        x, y, z = directions[ray, 0], directions[ray, 1], directions[ray, 2]
        for i in range(3):
            along[i] = turned[i, 0] * x + turned[i, 1] * y + turned[i, 2] * z
        end = min(rays.far, found[ray])
        found[ray] = min(found[ray], sea_distance(waves, sea, t, view.origin, along, rays.near, end))
