"""Pressure on a hull's surface: its mesh in water, whatever its shape and pose.

The surface is triangles, seen from outside counter-clockwise. A pressure is given at every point and is linear between;
where it is below zero the hull is dry. Force and torque of a linear pressure on the wet part of each triangle are
exact, so still water's on a mesh of flat faces are exact however it lies.

On a triangle that is all wet the wrench is linear in its corners' pressures, so each point has a share of the surface
around it, and W = sum over wet points of p times its share. That is wrong only for triangles that the surface cuts. One
corner a of those lies alone on its side, with pressure p, and s = p / (p - q), t = p / (p - r) are the places on its
edges to b and c where the pressure is zero. With g the force and torque of a third of the triangle's area at a corner,

    S(s, t) = p s t (g_a + s (g_b - g_a) / 4 + t (g_c - g_a) / 4),
    g_a = -(N, a x N) / 3,      N = (b - a) x (c - a) / 2,

is what the corner's own piece feels, and S(1, 1) what the sum has of it. If a is wet, S(s, t) takes the place of
S(1, 1); if it is dry, S(1, 1) is what the sum lacks and S(s, t) what it has too much: in both, |p| / p (S(s, t) -
S(1, 1)) is added, a weight for each of the three g.

Triangles are looked at in pairs that share an edge: what one of them shows, the other mostly does, too.
"""

from typing import Final

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.lanes import WIDTH, Lanes, broadcast, choose, larger, load, product_and, store, totals
from vrx_mj.physics.motion import Vector, Wrench
from vrx_mj.physics.panel_mesh import Panels

CUT: Final = 10
"""Numbers that are kept of a pair that the surface cuts: pressures at its points, weights of its triangles' corners."""
_TINY = 1e-300  # of a product of pressures [Pa2]; where they are smaller the surface lies in the triangle


@kernel
def panel_wrench(
    shares: FloatArray, pairs: IntArray, corner_shares: FloatArray, pressures: FloatArray,
    wet: ByteArray, found: IntArray, cut: FloatArray,
) -> Wrench:  # fmt: skip
    """Return the wrench of the water on a mesh: body axes, about the link's origin.

    Args:
        shares: of `Panels`.
        pairs: of `Panels`.
        corner_shares: of `Panels`.
        pressures: (n,) over the air's [Pa]; below zero: dry.
        wet: memory, (n,).
        found: memory, (k,).
        cut: memory, (CUT, k + WIDTH).
    """
    fx = fy = fz = broadcast(0.0)
    tx = ty = tz = broadcast(0.0)
    sx, sy, sz, kx, ky, kz = shares[0], shares[1], shares[2], shares[3], shares[4], shares[5]
    for i in range(0, pressures.size, WIDTH):
        p = larger(load(pressures, i), 0.0)
        fx = product_and(p, load(sx, i), fx)
        fy = product_and(p, load(sy, i), fy)
        fz = product_and(p, load(sz, i), fz)
        tx = product_and(p, load(kx, i), tx)
        ty = product_and(p, load(ky, i), ty)
        tz = product_and(p, load(kz, i), tz)
    number = _find_cut(pairs, pressures, wet, found)
    _weigh_cut(pairs, pressures, found, number, cut)
    sums = cut[0]
    store(sums, 0, _add_cut(corner_shares, found, number, cut) + totals(fx, fy, fz, tx, ty, tz, 0.0, 0.0))
    return Wrench(*to_fixed_tuple(sums, 6))


@kernel
def _find_cut(pairs: IntArray, pressures: FloatArray, wet: ByteArray, found: IntArray) -> int:
    """Note the pairs that the surface cuts; returns their number."""
    for i in range(pressures.size):
        wet[i] = pressures[i] > 0.0
    number = 0
    for i in range(len(pairs)):
        corners = wet[pairs[i, 0]] + wet[pairs[i, 1]] + wet[pairs[i, 2]] + wet[pairs[i, 3]]
        found[number] = i
        number += (corners != 0) & (corners != 4)
    return number


@kernel
def _weigh_cut(pairs: IntArray, pressures: FloatArray, found: IntArray, number: int, cut: FloatArray) -> None:
    """Write the weights of the corners of pairs' two triangles to `cut`, and before them the pressures."""
    p0, p1, p2, p3 = cut[0], cut[1], cut[2], cut[3]
    for i in range(number):
        own = pairs[found[i]]
        p0[i], p1[i], p2[i], p3[i] = pressures[own[0]], pressures[own[1]], pressures[own[2]], pressures[own[3]]
    for i in range(0, number, WIDTH):
        first, second, third, fourth = load(p0, i), load(p1, i), load(p2, i), load(p3, i)
        a, b, c = _weights(first, second, third)
        store(cut[4], i, a)
        store(cut[5], i, b)
        store(cut[6], i, c)
        a, b, c = _weights(first, third, fourth)
        store(cut[7], i, a)
        store(cut[8], i, b)
        store(cut[9], i, c)


@kernel
def _weights(a: Lanes, b: Lanes, c: Lanes) -> tuple[Lanes, Lanes, Lanes]:
    """Return what the corners of triangles with these pressures weigh; nothing where the surface does not cut them."""
    at_a, at_b, at_c = choose(a, 1.0, -1.0), choose(b, 1.0, -1.0), choose(c, 1.0, -1.0)
    sides = 0.0 - (at_a + at_b + at_c)  # against which one corner alone is
    a_alone, b_alone, c_alone = at_a * sides, at_b * sides, at_c * sides
    p = choose(a_alone, a, choose(b_alone, b, c))
    q = choose(a_alone, b, choose(b_alone, c, a))
    r = choose(a_alone, c, choose(b_alone, a, b))
    q, r, size = p - q, p - r, larger(p, 0.0 - p)
    share = p / larger(q * r, _TINY)
    s, t = share * r, share * q
    st = s * t
    d, e, f = st - 1.0, 0.25 * (s * st - 1.0), 0.25 * (st * t - 1.0)
    cut = larger(a_alone, larger(b_alone, c_alone))
    alone, after, last = choose(cut, size * (d - e - f), 0.0), choose(cut, size * e, 0.0), choose(cut, size * f, 0.0)
    return (
        choose(a_alone, alone, choose(b_alone, last, after)),
        choose(a_alone, after, choose(b_alone, alone, last)),
        choose(a_alone, last, choose(b_alone, after, alone)),
    )


@kernel
def _add_cut(corner_shares: FloatArray, found: IntArray, number: int, cut: FloatArray) -> Lanes:
    """Return what cut pairs add to the sum of shares: force, torque, and two zeros."""
    u = v = w = broadcast(0.0)
    x = y = z = broadcast(0.0)
    for i in range(number):
        own = corner_shares[found[i]]
        u = product_and(cut[4, i], load(own[0], 0), u)
        v = product_and(cut[5, i], load(own[1], 0), v)
        w = product_and(cut[6, i], load(own[2], 0), w)
        x = product_and(cut[7, i], load(own[3], 0), x)
        y = product_and(cut[8, i], load(own[4], 0), y)
        z = product_and(cut[9, i], load(own[5], 0), z)
    return (u + v + w) + (x + y + z)


@kernel
def still_pressures(points: FloatArray, up: Vector, height: float, weight: float, out: FloatArray) -> None:
    """Write the pressures of still water [Pa] at points (3, n) [m, body axes] into `out`, (n,).

    Args:
        points: of the hull.
        up: the vertical, unit vector, body axes.
        height: of the link's origin over the water [m].
        weight: rho g [N/m3].
        out: below zero over the water.
    """
    for i in range(out.size):
        out[i] = -weight * (height + up[0] * points[0, i] + up[1] * points[1, i] + up[2] * points[2, i])


def wrench_of_still_water(panels: Panels, up: Vector, height: float, weight: float) -> FloatArray:
    """Return force [N] and torque [N m] (6,) of still water on a mesh; arguments as in `still_pressures`."""
    pressures = np.empty(panels.points.shape[1])
    still_pressures(panels.points, up, height, weight, pressures)
    return wrench_of_pressures(panels, pressures)


def wrench_of_pressures(panels: Panels, pressures: FloatArray) -> FloatArray:
    """Return force [N] and torque [N m] (6,) of pressures [Pa] at a mesh's points, (n,)."""
    count = len(panels.pairs)
    memory = np.empty(pressures.size, np.uint8), np.empty(count, np.uint32), np.zeros((CUT, count + WIDTH))
    return np.array(panel_wrench(panels.shares, panels.pairs, panels.corner_shares, pressures, *memory))
