"""The waves in boxes around the parts of a hull: what all of them press there, as one polynomial for each.

A hull's mesh has hundreds of points and a sea dozens of waves. So the waves are added up at the nodes of a box that
lies level around the mesh, in its heading, and the polynomial through these serves all points: of degree 4 along and
across and 3 over the depth, which counts from the surface (Wheeler, 1970); of degree 2 across a slender hull, and over
the depth of a shallow one (`panel_mesh`). Each hull of a catamaran has a box of its own.

Over a side of 2 a [m], a wave of k [rad/m] in the side's direction is met within (k a)^5 / 1057 of its amplitude, or
within (k a)^3 / 15.6 by a polynomial of degree 2. Waves as short as the hull, which it hardly feels as a whole, fade
out from k a = 3 to 5, by a polynomial of degree 2 from 1.5 to 2.5.
"""

import math
from fractions import Fraction
from typing import Final, NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import exponential, near_cosine_and_sine
from vrx_mj.physics.kernel import inlined_kernel, kernel
from vrx_mj.physics.lanes import (
    WIDTH,
    Lanes,
    any_positive,
    broadcast,
    larger,
    load,
    product_and,
    smaller,
    store,
    total,
    totals,
)
from vrx_mj.physics.motion import Level, Motion, Vector, rotate, unrotate_level
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import AMPLITUDE, BOTTOM, EAST, FREQUENCY, MEMORY, NORTH, PHASE, WAVENUMBER, ramp

_SIDE: Final = 5
"""Nodes of the box along."""
ROWS: Final = 5
"""Nodes across."""
SLENDER_ROWS: Final = 3
"""Nodes across a slender hull."""
LEVELS: Final = 4
"""Nodes over the depth."""
SHALLOW_LEVELS: Final = 3
"""Nodes over the depth of a shallow hull."""
_FADES, _FADED = 3.0, 5.0  # k a at which a wave begins to fade, and at which it is gone; half of it by three nodes
_SPARE = 1.25  # depth of a box over that of its lowest corner under the surface at its middle and its ends
_THINNEST = 0.05  # least sides and depth of the box [m]
_ALONG = MEMORY  # rows of memory: cosine and sine, and powers, along; across; a row; heights; the middles of parts
_ACROSS, _ROW, _HEIGHT, _LEVELS, _MIDDLES = _ALONG + 4, _ALONG + 6, _ALONG + 8, _ALONG + 9, _ALONG + 9 + LEVELS
BOX_MEMORY: Final = _MIDDLES - MEMORY
"""Rows of memory in `wave_columns` that are used here, and two more for each part of a hull."""
_SUMS = np.array([(-1, 0, 0, 2, 2), (0, 1, 1, 0, 0), (1, 0, 0, 0, 0), (0, 1, -1, 0, 0), (-1, 0, 0, 2, -2)], np.float64)
_FROM_SUMS = np.zeros(
    (_SIDE, WIDTH)
)  # coefficients of powers along, for what `_add_up` writes, of which nodes are made


class WaveBox(NamedTuple):
    """Level boxes of one size: cosine and sine of their heading, half their sides [m], and their nodes."""

    cos: float
    sin: float
    half_length: float
    half_width: float
    rows: int
    levels: int


def _to_powers(first: int, count: int) -> tuple[tuple[float, ...], ...]:
    """Return the matrix that gives a polynomial's coefficients of 1, s, s^2 ... for its values at even nodes up to 1.

    It is made of Lagrange's polynomials in fractions, whose rounding no processor decides.
    """
    nodes = [first + Fraction((1 - first) * k, count - 1) for k in range(count)]
    columns = []
    for node in nodes:
        column = [Fraction(1)]
        for other in (other for other in nodes if other != node):
            up, same = [Fraction(0), *column], [*column, Fraction(0)]
            column = [(a - other * b) / (node - other) for a, b in zip(up, same, strict=True)]
        columns.append(column)
    return tuple(tuple(map(float, row)) for row in zip(*columns, strict=True))


_SIDE_POWERS = _to_powers(-1, _SIDE)
_SLENDER_POWERS = _to_powers(-1, SLENDER_ROWS)
_DEPTH_POWERS = _to_powers(0, LEVELS)
_SHALLOW_POWERS = _to_powers(0, SHALLOW_LEVELS)
_FROM_SUMS[:, :_SIDE] = (np.array(_SIDE_POWERS) @ _SUMS).T


@kernel
def heading_of(m: Motion) -> Level:
    """Return cosine and sine of the direction in which the bow points; where it points up, of the keel's."""
    x, y = (m.r00, m.r10) if abs(m.r20) < 0.9 else (-m.r20 * m.r02, -m.r20 * m.r12)
    length = math.sqrt(x * x + y * y)
    return x / length, y / length


@kernel
def pressures_in_waves(
    vessel: Record, parts: Table, points: FloatArray, columns: FloatArray, sea: Record,
    body: Motion, t: float, polynomial: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Write the water's pressures over the air's [Pa] at a hull's points into `out`; below zero over the surface.

    p = rho g (sum eta_i cosh(k_i (z' + h)) / cosh(k_i h) - z), z' = (z - eta) h / (h + eta).

    Args:
        vessel: a row of `tables.VESSEL`.
        parts: its rows of `tables.PART`.
        points: of the vessel [m], body axes, 3 n numbers: of (3, n), in any shape.
        columns: `wave_columns`, whose memory is used.
        sea: a row of `tables.SEA`.
        body: motion of the link.
        t: time [s].
        polynomial: memory, (LEVELS, ROWS, WIDTH).
        out: for its points, (n,).
    """
    box = _box_around(vessel, body)
    _spread_over(box, columns)
    grown, reach = ramp(sea, t), _reach((body.r20, body.r21, body.r22), vessel.half)
    depth = _THINNEST
    for i in range(parts.size):
        x, y, z = rotate(body, parts[i].center)
        height = grown * _place_middle(columns, _MIDDLES + 2 * i, body.x + x, body.y + y, t)
        depth = max(depth, _SPARE * (height - (body.z + z - sea.level - reach)))
    _spread_down(box, depth, columns, sea)
    for i in range(parts.size):
        _fill_box(box, columns, _MIDDLES + 2 * i, grown, polynomial)
        _evaluate(box, depth, parts[i], rotate(body, parts[i].center), polynomial, points, sea, body, out)


@kernel
def _box_around(vessel: Record, body: Motion) -> WaveBox:
    """Return the size of the level boxes, in the hull's heading, that hold each its part."""
    cos, sin = heading_of(body)
    h = vessel.half
    length, width = _reach(unrotate_level(body, cos, sin), h), _reach(unrotate_level(body, -sin, cos), h)
    return WaveBox(cos, sin, max(length, _THINNEST), max(width, _THINNEST), vessel.wave_rows, vessel.wave_levels)


@kernel
def _reach(direction: Vector, half: FloatArray) -> float:
    """Return how far a box of half sides reaches from its middle in a direction."""
    return float(abs(direction[0]) * half[0] + abs(direction[1]) * half[1] + abs(direction[2]) * half[2])


@kernel
def _share(angles: Lanes, fades: float, faded: float) -> Lanes:
    """Return the share of waves of k a = `angles` that is left: 1, less from `fades` on, none from `faded` on."""
    beyond = (larger(angles, 0.0 - angles) - fades) * (1.0 / (faded - fades))
    beyond = smaller(larger(beyond, 0.0), 1.0)
    return 1.0 - beyond * beyond * (3.0 - 2.0 * beyond)


@kernel
def _spread_over(box: WaveBox, columns: FloatArray) -> None:
    """Write to memory how each wave turns from node to node, and its height: what has not faded out."""
    east, north, wavenumber, amplitude = columns[EAST], columns[NORTH], columns[WAVENUMBER], columns[AMPLITUDE]
    c1, s1, c2, s2 = columns[_ALONG], columns[_ALONG + 1], columns[_ALONG + 2], columns[_ALONG + 3]
    turn, turned, left = columns[_ACROSS], columns[_ACROSS + 1], columns[_HEIGHT]
    slender = box.rows != ROWS
    fades, faded, spacing = (0.5 * _FADES, 0.5 * _FADED, 1.0) if slender else (_FADES, _FADED, 0.5)
    for i in range(0, c1.size, WIDTH):
        k, x, y = load(wavenumber, i), load(east, i), load(north, i)
        along = k * (x * box.cos + y * box.sin) * box.half_length
        across = k * (y * box.cos - x * box.sin) * box.half_width
        store(left, i, load(amplitude, i) * _share(along, _FADES, _FADED) * _share(across, fades, faded))
        c, s = near_cosine_and_sine(0.5 * along)
        store(c1, i, c)
        store(s1, i, s)
        store(c2, i, c * c)
        store(s2, i, c * s)
        c, s = near_cosine_and_sine(spacing * across)
        store(turn, i, c)
        store(turned, i, s)


@kernel
def _place_middle(columns: FloatArray, start: int, x: float, y: float, t: float) -> float:
    """Write cosine and sine of each wave at (x, y) [m], a part's middle, to memory; return the surface's height [m].

    That is the highest of the middle's and the two ends', of the waves that have not faded out. `start` is where they
    are written.
    """
    c2, s2 = columns[_ALONG + 2], columns[_ALONG + 3]
    east, north, wavenumber, left = columns[EAST], columns[NORTH], columns[WAVENUMBER], columns[_HEIGHT]
    frequency, phase, c, s = columns[FREQUENCY], columns[PHASE], columns[start], columns[start + 1]
    middle = even = odd = broadcast(0.0)
    for i in range(0, c.size, WIDTH):
        along = load(wavenumber, i) * (load(east, i) * x + load(north, i) * y)
        cos, sin = near_cosine_and_sine(along - load(frequency, i) * t + load(phase, i))
        store(c, i, cos)
        store(s, i, sin)
        p, q = load(left, i) * cos, load(left, i) * sin
        middle += p
        even += p * load(c2, i)
        odd += q * load(s2, i)
    height = total(middle)
    return float(max(height, 2.0 * (total(even) + abs(total(odd))) - height))


@kernel
def _spread_down(box: WaveBox, depth: float, columns: FloatArray, sea: Record) -> None:
    """Write the height of each wave at every level to memory: even steps down to a depth [m] under the surface."""
    wavenumber, left, bottom = columns[WAVENUMBER], columns[_HEIGHT], columns[BOTTOM]
    step, deep = -depth / (box.levels - 1), sea.depth == math.inf
    for i in range(0, left.size, WIDTH):
        height, fall = load(left, i), exponential(load(wavenumber, i) * step)
        if deep:
            for level in range(box.levels):
                store(columns[_LEVELS + level], i, height)
                height = height * fall
        else:
            bed, rise = load(bottom, i), 1.0 / fall
            down, up = height / (bed + 1.0), bed * height / (bed + 1.0)
            for level in range(box.levels):
                store(columns[_LEVELS + level], i, down + up)
                down, up = down * fall, up * rise


@kernel
def _fill_box(box: WaveBox, columns: FloatArray, start: int, grown: float, out: FloatArray) -> None:
    """Write the polynomial of the waves' pressure head [m] around a part's middle into `out`, (LEVELS, ROWS, WIDTH).

    Its coefficients are those of the powers of depth, across and along, in units of the box. `start` is where the
    middle is in memory, `grown` the sea's ramp.
    """
    middle = box.rows // 2
    _add_up(columns, start, box.levels, middle, out)
    for sign in (-1, 1):
        for away in range(1, middle + 1):
            _turn_row(columns, start if away == 1 else _ROW, float(sign))
            _add_up(columns, _ROW, box.levels, middle + sign * away, out)
    for level in range(box.levels):
        _to_powers_across(out[level], box.rows, grown)
    for row in range(box.rows):
        _to_powers_of_depth(out, row, box.levels)
    for level in range(box.levels):
        for row in range(box.rows):
            _to_powers_along(out[level, row])


@kernel
def _turn_row(columns: FloatArray, start: int, sign: float) -> None:
    """Write cosine and sine of the waves in a row of nodes, from those in the row beside it."""
    turn, turned = columns[_ACROSS], columns[_ACROSS + 1]
    c, s, cos, sin = columns[start], columns[start + 1], columns[_ROW], columns[_ROW + 1]
    for i in range(0, c.size, WIDTH):
        here, there, on, off = load(c, i), load(s, i), load(turn, i), load(turned, i) * sign
        store(cos, i, here * on - there * off)
        store(sin, i, there * on + here * off)


@inlined_kernel
def _add_up(columns: FloatArray, start: int, levels: int, row: int, out: FloatArray) -> None:
    """Write the sums of waves at the nodes of a row, at all levels, into `out`, (LEVELS, ROWS, WIDTH).

    At the middle, and the even and odd parts of those half a side and a side from it; `start` is where the row is.
    """
    c, s = columns[start], columns[start + 1]
    c1, s1, c2, s2 = columns[_ALONG], columns[_ALONG + 1], columns[_ALONG + 2], columns[_ALONG + 3]
    for level in range(levels):
        height = columns[_LEVELS + level]
        zero = even = odd = far_even = far_odd = broadcast(0.0)
        for i in range(0, c.size, WIDTH):
            h = load(height, i)
            p, q = h * load(c, i), h * load(s, i)
            zero += p
            even = product_and(p, load(c1, i), even)
            odd = product_and(q, load(s1, i), odd)
            far_even = product_and(p, load(c2, i), far_even)
            far_odd = product_and(q, load(s2, i), far_odd)
        store(out[level, row], 0, totals(zero, even, odd, far_even, far_odd, 0.0, 0.0, 0.0))


@kernel
def _to_powers_along(sums: FloatArray) -> None:
    """Replace what `_add_up` writes for a row at a level, (WIDTH,), by coefficients of powers along."""
    value = broadcast(0.0)
    for node in range(_SIDE):
        value = product_and(sums[node], load(_FROM_SUMS[node], 0), value)
    store(sums, 0, value)


@kernel
def _to_powers_across(rows: FloatArray, number: int, factor: float) -> None:
    """Replace the values in rows of nodes, (ROWS, WIDTH), by coefficients of powers across, times a factor."""
    a, b, c = load(rows[0], 0) * factor, load(rows[1], 0) * factor, load(rows[2], 0) * factor
    if number == SLENDER_ROWS:
        m = _SLENDER_POWERS
        store(rows[0], 0, b)
        store(rows[1], 0, a * m[1][0] + c * m[1][2])
        store(rows[2], 0, a * m[2][0] + b * m[2][1] + c * m[2][2])
        return
    d, e = load(rows[3], 0) * factor, load(rows[4], 0) * factor
    for power in range(ROWS):
        n = _SIDE_POWERS[power]
        store(rows[power], 0, a * n[0] + b * n[1] + c * n[2] + d * n[3] + e * n[4])


@kernel
def _to_powers_of_depth(values: FloatArray, row: int, levels: int) -> None:
    """Replace a row's values at levels, of (LEVELS, ROWS, WIDTH), by coefficients of powers of depth."""
    a, b, c = load(values[0, row], 0), load(values[1, row], 0), load(values[2, row], 0)
    if levels == SHALLOW_LEVELS:
        for power in range(1, SHALLOW_LEVELS):
            n = _SHALLOW_POWERS[power]
            store(values[power, row], 0, a * n[0] + b * n[1] + c * n[2])
        return
    d = load(values[3, row], 0)
    for power in range(1, LEVELS):
        m = _DEPTH_POWERS[power]
        store(values[power, row], 0, a * m[0] + b * m[1] + c * m[2] + d * m[3])


@kernel
def _evaluate(
    box: WaveBox, depth: float, part: Record, middle: Vector, polynomial: FloatArray, points: FloatArray, sea: Record,
    body: Motion, out: FloatArray,
) -> None:  # fmt: skip
    """Write the pressures [Pa] at a part's points into `out`; `middle` is that of its box from the link's origin [m].

    The polynomial's value at the depth -z' is that of the waves there, and eta is that at the surface.
    """
    weight, shallow = sea.density * sea.gravity, 1.0 / sea.depth  # 0 in deep water
    length, width, shorter = 1.0 / box.half_length, 1.0 / box.half_width, 1.0 / depth
    ax, ay, az = unrotate_level(body, box.cos * length, box.sin * length)
    bx, by, bz = unrotate_level(body, -box.sin * width, box.cos * width)
    a0 = -length * (box.cos * middle[0] + box.sin * middle[1])
    b0 = -width * (box.cos * middle[1] - box.sin * middle[0])
    c0 = body.z - sea.level
    n = out.size
    for i in range(part.start, part.start + part.size, WIDTH):
        x, y, z = load(points, i), load(points, n + i), load(points, 2 * n + i)
        s = (x * ax + y * ay) + (z * az + a0)
        r = (x * bx + y * by) + (z * bz + b0)
        up = (x * body.r20 + y * body.r21) + (z * body.r22 + c0)
        surface = _plane(polynomial[0], box.rows, s, r)
        head = surface - up
        below = larger(head, 0.0)
        if any_positive(below):
            d = smaller(below * shorter / (surface * shallow + 1.0), 1.0)
            deeper = _plane(polynomial[box.levels - 1], box.rows, s, r)
            for power in range(box.levels - 2, 0, -1):
                deeper = product_and(deeper, d, _plane(polynomial[power], box.rows, s, r))
            head = product_and(deeper, d, head)
        store(out, i, head * weight)


@kernel
def _plane(c: FloatArray, rows: int, s: Lanes, r: Lanes) -> Lanes:
    """Return values of a polynomial (rows, SIDE) at places along and across."""
    s2 = s * s
    value = _line(c[rows - 1], s, s2)
    for row in range(rows - 2, -1, -1):
        value = product_and(value, r, _line(c[row], s, s2))
    return value


@kernel
def _line(a: FloatArray, s: Lanes, s2: Lanes) -> Lanes:
    """Return values of a polynomial (SIDE,) at places, whose squares are given."""
    low, high = product_and(s, a[1], a[0]), product_and(s, a[3], a[2])
    return product_and(s2, product_and(s2, a[4], high), low)
