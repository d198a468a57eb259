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
from vrx_mj.physics.elementary import exponential, near_cosine_and_sine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, rotate
from vrx_mj.physics.tables import Record
from vrx_mj.physics.wave_columns import AMPLITUDE, BOTTOM, EAST, FREQUENCY, MEMORY, NORTH, PHASE, WAVENUMBER
from vrx_mj.physics.waves import ramp

__all__ = ["LEVELS", "SIDE", "WaveBox", "fill_box", "heading_of", "pressures_in_box", "wave_box"]

SIDE: Final = 5
"""Nodes of the box along, and across."""
LEVELS: Final = 4
"""Nodes over its depth."""
_FADES, _FADED = 3.0, 5.0  # k a at which a wave begins to fade, and at which it is gone
_SPARE = 1.25  # depth of the box over that of the lowest point: crests lift the surface from which depth counts
_THINNEST = 0.05  # least sides and depth of the box [m]
_ALONG = MEMORY  # rows of memory: cosine and sine, their powers, then pairs for the rows of nodes, and the levels
_ACROSS, _LEVELS = _ALONG + 4, _ALONG + 14


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
def fill_box(box: WaveBox, columns: FloatArray, sea: Record, t: float, out: FloatArray) -> None:
    """Write the polynomial of the waves' pressure head [m] at time `t` [s] into `out`, (LEVELS, SIDE, SIDE).

    Its coefficients are those of the powers of depth, across and along, in units of the box: `pressures_in_box`
    evaluates it. `columns` are `wave_columns`, whose memory is used.
    """
    _phases_in_box(box, columns, t)
    _heights_in_box(box, columns)
    for level in range(LEVELS):
        for row in range(SIDE):
            _add_up(columns, level, row, out[level, row])
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
def _phases_in_box(box: WaveBox, columns: FloatArray, t: float) -> None:
    """Write cosine and sine of each wave in the middle of every row across, and from node to node along, to memory."""
    east, north, wavenumber = columns[EAST], columns[NORTH], columns[WAVENUMBER]
    frequency, phase = columns[FREQUENCY], columns[PHASE]
    c1, s1, c1c1, c1s1 = columns[_ALONG], columns[_ALONG + 1], columns[_ALONG + 2], columns[_ALONG + 3]
    turn, turned = columns[_LEVELS], columns[_LEVELS + 1]
    c, s = columns[_ACROSS + 4], columns[_ACROSS + 5]
    for i in range(c1.size):
        k = wavenumber[i]
        c[i], s[i] = near_cosine_and_sine(k * (east[i] * box.x + north[i] * box.y) - frequency[i] * t + phase[i])
    for i in range(c1.size):
        angle = 0.5 * wavenumber[i] * box.half_length * (east[i] * box.cos + north[i] * box.sin)
        c1[i], s1[i] = near_cosine_and_sine(angle)
    for i in range(c1.size):
        angle = 0.5 * wavenumber[i] * box.half_width * (north[i] * box.cos - east[i] * box.sin)
        turn[i], turned[i] = near_cosine_and_sine(angle)
        c1c1[i], c1s1[i] = c1[i] * c1[i], c1[i] * s1[i]
    for row in (2, 3):
        _turn_row(columns, row, row + 1, 1.0)
        _turn_row(columns, 4 - row, 3 - row, -1.0)


@kernel
def _turn_row(columns: FloatArray, start: int, end: int, sign: float) -> None:
    """Write cosine and sine of the waves in a row of nodes, from those in the row beside it."""
    turn, turned = columns[_LEVELS], columns[_LEVELS + 1]
    c, s = columns[_ACROSS + 2 * start], columns[_ACROSS + 2 * start + 1]
    cos, sin = columns[_ACROSS + 2 * end], columns[_ACROSS + 2 * end + 1]
    for i in range(c.size):
        cos[i] = c[i] * turn[i] - sign * s[i] * turned[i]
        sin[i] = s[i] * turn[i] + sign * c[i] * turned[i]


@kernel
def _heights_in_box(box: WaveBox, columns: FloatArray) -> None:
    """Write the height of each wave at every level of the box to memory: what has not faded out, by its decay."""
    east, north, wavenumber = columns[EAST], columns[NORTH], columns[WAVENUMBER]
    amplitude, bottom, top = columns[AMPLITUDE], columns[BOTTOM], columns[_LEVELS]
    for i in range(top.size):
        k = wavenumber[i]
        along = k * box.half_length * (east[i] * box.cos + north[i] * box.sin)
        across = k * box.half_width * (north[i] * box.cos - east[i] * box.sin)
        top[i] = amplitude[i] * _share(along) * _share(across)
    for level in range(1, LEVELS):
        height, down = columns[_LEVELS + level], level / (LEVELS - 1) * box.depth
        for i in range(top.size):
            fall = exponential(-wavenumber[i] * down)
            height[i] = top[i] * (fall + bottom[i] / fall) / (1.0 + bottom[i])


@kernel
def _add_up(columns: FloatArray, level: int, row: int, out: FloatArray) -> None:
    """Write the sums of all waves at the nodes of a row into `out`, (SIDE,)."""
    height, c, s = columns[_LEVELS + level], columns[_ACROSS + 2 * row], columns[_ACROSS + 2 * row + 1]
    c1, s1, c1c1, c1s1 = columns[_ALONG], columns[_ALONG + 1], columns[_ALONG + 2], columns[_ALONG + 3]
    middle, even, odd, far_even, far_odd = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(c.size):
        p, q = height[i] * c[i], height[i] * s[i]
        middle += p
        even += p * c1[i]
        odd += q * s1[i]
        far_even += p * c1c1[i]
        far_odd += q * c1s1[i]
    far_even, far_odd = 2.0 * far_even - middle, 2.0 * far_odd
    out[0], out[1], out[2], out[3], out[4] = far_even + far_odd, even + odd, middle, even - odd, far_even - far_odd


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
def pressures_in_box(
    box: WaveBox, polynomial: FloatArray, places: FloatArray, sea: Record, count: int, out: FloatArray
) -> None:
    """Write the water's pressures over the air's [Pa] at `count` points into `out`; below zero over the surface.

    p = rho g (sum eta_i cosh(k_i (z' + h)) / cosh(k_i h) - z), z' = (z - eta) h / (h + eta): the polynomial's value at
    the depth -z', and eta is that at the surface.
    """
    weight, whole = sea.density * sea.gravity, sea.depth
    shallow = 1.0 / whole  # 0 in deep water
    length, width, depth = 1.0 / box.half_length, 1.0 / box.half_width, 1.0 / box.depth
    top, second, third, fourth = polynomial[0], polynomial[1], polynomial[2], polynomial[3]
    for i in range(count):
        s, r, z = places[0, i] * length, places[1, i] * width, places[2, i]
        surface = _plane(top, s, r)
        below = max(surface - z, 0.0) / (1.0 + shallow * surface)
        d = min(below * depth, 1.0)
        deeper = _plane(second, s, r) + d * (_plane(third, s, r) + d * _plane(fourth, s, r))
        out[i] = weight * (surface + d * deeper - z)


@kernel
def _plane(c: FloatArray, s: float, r: float) -> float:
    """Return the value of a polynomial (SIDE, SIDE) at `s` along and `r` across."""
    s2, r2 = s * s, r * r
    return (_line(c[0], s, s2) + r * _line(c[1], s, s2)) + r2 * (
        (_line(c[2], s, s2) + r * _line(c[3], s, s2)) + r2 * _line(c[4], s, s2)
    )


@kernel
def _line(a: FloatArray, s: float, s2: float) -> float:
    """Return the value of a polynomial (SIDE,) at `s`, whose square is `s2`."""
    return float((a[0] + s * a[1]) + s2 * ((a[2] + s * a[3]) + s2 * a[4]))
