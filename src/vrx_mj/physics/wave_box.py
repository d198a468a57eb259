"""The waves in a box around a hull: what all of them press there, as one polynomial.

A hull's mesh has hundreds of points and a sea dozens of waves. So the waves are added up at the nodes of a box that
lies level around the mesh, in its heading, and the polynomial through these serves all points: of degree 4 along and
across, and 3 over the depth, which counts from the surface (Wheeler, 1970). Over a side of 2 a [m], a wave of k [rad/m]
in the side's direction is met within (k a)^5 / 1057 of its amplitude. Waves as short as the hull, which it hardly feels
as a whole, fade out from k a = 3 to 5.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import cosine_and_sine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, rotate
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import ramp

__all__ = ["LEVELS", "SIDE", "WaveBox", "fill_box", "heading_of", "pressures_in_box", "wave_box"]

SIDE: Final = 5
"""Nodes of the box along, and across."""
LEVELS: Final = 4
"""Nodes over its depth."""
_FADES, _FADED = 3.0, 5.0  # k a at which a wave begins to fade, and at which it is gone
_SPARE = 1.25  # depth of the box over that of the lowest point: crests lift the surface from which depth counts
_THINNEST = 0.05  # least sides and depth of the box [m]


class WaveBox(NamedTuple):
    """A level box: its middle [m], cosine and sine of its heading, half its sides [m] and its depth [m]."""

    x: float
    y: float
    cos: float
    sin: float
    half_length: float
    half_width: float
    depth: float


def _to_powers(nodes: FloatArray) -> tuple[tuple[float, ...], ...]:
    """Return the matrix that gives a polynomial's coefficients of 1, s, s^2 ... for its values at nodes."""
    inverse = np.linalg.inv(np.vander(nodes, increasing=True))
    return tuple(tuple(float(value) for value in row) for row in inverse)


_SIDE_POWERS = _to_powers(np.linspace(-1.0, 1.0, SIDE))
_DEPTH_POWERS = _to_powers(np.linspace(0.0, 1.0, LEVELS))


@kernel
def heading_of(m: Motion) -> tuple[float, float]:
    """Return cosine and sine of the direction in which the bow points; where it points up, of the keel's."""
    x, y = (m.r00, m.r10) if abs(m.r20) < 0.9 else (-m.r20 * m.r02, -m.r20 * m.r12)
    length = math.sqrt(x * x + y * y)
    return x / length, y / length


@kernel
def wave_box(vertices: FloatArray, motion: Motion, level: float, places: FloatArray) -> WaveBox:
    """Return the box around a mesh, and write where its points are into `places`.

    Args:
        vertices: (n, 3) [m], body axes.
        motion: of the link.
        level: of the mean surface [m].
        places: (3, n) along, across and over the mean surface, axes of the box from the link's origin [m].
    """
    cos, sin = heading_of(motion)
    least, most = (math.inf, math.inf, math.inf), (-math.inf, -math.inf)
    for i in range(len(vertices)):
        x, y, z = rotate(motion, vertices[i, 0], vertices[i, 1], vertices[i, 2])
        along, across, up = cos * x + sin * y, cos * y - sin * x, motion.z + z - level
        places[0, i], places[1, i], places[2, i] = along, across, up
        least = min(least[0], along), min(least[1], across), min(least[2], up)
        most = max(most[0], along), max(most[1], across)
    a, b = 0.5 * (least[0] + most[0]), 0.5 * (least[1] + most[1])
    for i in range(len(vertices)):
        places[0, i] -= a
        places[1, i] -= b
    return WaveBox(
        motion.x + cos * a - sin * b,
        motion.y + sin * a + cos * b,
        cos,
        sin,
        max(most[0] - a, _THINNEST),
        max(most[1] - b, _THINNEST),
        max(-_SPARE * least[2], _THINNEST),
    )


@kernel
def _share(angle: float) -> float:
    """Return the share of a wave of k a = `angle` that is left: 1, from `_FADES` on less, from `_FADED` on none."""
    beyond = min(max((abs(angle) - _FADES) / (_FADED - _FADES), 0.0), 1.0)
    return 1.0 - beyond * beyond * (3.0 - 2.0 * beyond)


@kernel
def fill_box(box: WaveBox, waves: Table, sea: Record, t: float, out: FloatArray) -> None:
    """Write the polynomial of the waves' pressure head [m] at time `t` [s] into `out`, (LEVELS, SIDE, SIDE).

    Its coefficients are those of the powers of depth, across and along, in units of the box: `pressures_in_box`
    evaluates it.
    """
    out[:] = 0.0
    for i in range(waves.size):
        _add_wave(box, waves[i], sea, t, out)
    grown = ramp(sea, t)
    for level in range(LEVELS):
        for row in range(SIDE):
            _to_coefficients(out[level, row], grown)
        for column in range(SIDE):
            _to_coefficients(out[level, :, column], 1.0)
    for row in range(SIDE):
        for column in range(SIDE):
            _to_depth_coefficients(out[:, row, column])


@kernel
def _to_coefficients(values: FloatArray, factor: float) -> None:
    """Replace (SIDE,) values at nodes by coefficients of powers, times a factor."""
    a, b, c, d, e = values[0], values[1], values[2], values[3], values[4]
    for power in range(SIDE):
        m = _SIDE_POWERS[power]
        values[power] = factor * (m[0] * a + m[1] * b + m[2] * c + m[3] * d + m[4] * e)


@kernel
def _to_depth_coefficients(values: FloatArray) -> None:
    """Replace (LEVELS,) values at nodes by coefficients of powers."""
    a, b, c, d = values[0], values[1], values[2], values[3]
    for power in range(LEVELS):
        m = _DEPTH_POWERS[power]
        values[power] = m[0] * a + m[1] * b + m[2] * c + m[3] * d


@kernel
def _add_wave(box: WaveBox, wave: Record, sea: Record, t: float, out: FloatArray) -> None:
    """Add what a wave presses at the nodes, from the surface down."""
    east, north, k = wave.direction[0], wave.direction[1], wave.wavenumber
    along = k * box.half_length * (east * box.cos + north * box.sin)
    across = k * box.half_width * (north * box.cos - east * box.sin)
    height = wave.amplitude * _share(along) * _share(across)
    if height == 0.0:
        return
    middle = k * (east * box.x + north * box.y) - wave.frequency * t + wave.phase
    step = 2.0 * across / (SIDE - 1)
    c1, s1 = cosine_and_sine(0.5 * along)
    c2, s2 = c1 * c1 - s1 * s1, 2.0 * c1 * s1
    cs, ss = cosine_and_sine(step)
    cos, sin = cosine_and_sine(middle - across)
    down, up, bottom = _decay_of_level(k, box.depth, sea.depth)
    for row in range(SIDE):
        fall, rise = height / (1.0 + bottom), bottom * height / (1.0 + bottom)
        for level in range(LEVELS):
            c, s = (fall + rise) * cos, (fall + rise) * sin
            nodes = out[level, row]
            nodes[0] += c * c2 + s * s2
            nodes[1] += c * c1 + s * s1
            nodes[2] += c
            nodes[3] += c * c1 - s * s1
            nodes[4] += c * c2 - s * s2
            fall, rise = fall * down, rise * up
        cos, sin = cos * cs - sin * ss, sin * cs + cos * ss


@kernel
def _decay_of_level(k: float, depth: float, water: float) -> tuple[float, float, float]:
    """Return what e^(k z) and e^(-k z) are multiplied by from node to node, and e^(-2 k h)."""
    down = math.exp(-k * depth / (LEVELS - 1))
    if k * water > 20.0:
        return down, 0.0, 0.0
    return down, 1.0 / down, math.exp(-2.0 * k * water)


@kernel
def pressures_in_box(
    box: WaveBox, polynomial: FloatArray, places: FloatArray, sea: Record, count: int, out: FloatArray
) -> None:
    """Write the water's pressures over the air's [Pa] at `count` points into `out`; below zero over the surface.

    p = rho g (sum eta_i cosh(k_i (z' + h)) / cosh(k_i h) - z), z' = (z - eta) h / (h + eta): the polynomial's value at
    the depth -z', and eta is that at the surface.
    """
    weight, whole = sea.density * sea.gravity, sea.depth
    for i in range(count):
        s, r, z = places[0, i] / box.half_length, places[1, i] / box.half_width, places[2, i]
        surface = _plane(polynomial[0], s, r)
        below = surface - z
        if below > 0.0:
            if whole < math.inf:
                below *= whole / (whole + surface)
            d = min(below / box.depth, 1.0)
            deeper = _plane(polynomial[1], s, r) + d * (_plane(polynomial[2], s, r) + d * _plane(polynomial[3], s, r))
            surface += d * deeper
        out[i] = weight * (surface - z)


@kernel
def _plane(c: FloatArray, s: float, r: float) -> float:
    """Return the value of a polynomial (SIDE, SIDE) at `s` along and `r` across."""
    total = 0.0
    for row in range(SIDE - 1, -1, -1):
        a = c[row]
        total = total * r + a[0] + s * (a[1] + s * (a[2] + s * (a[3] + s * a[4])))
    return total
