"""Pressure on a hull's surface: its mesh in water, whatever its shape and pose.

The surface is triangles, seen from outside counter-clockwise. A pressure is given at every point and is linear between;
where it is below zero the hull is dry. Force and torque of a linear pressure on the wet part of each triangle are
exact, so still water's on a mesh of flat faces are exact however it lies.

On a triangle that is all wet the wrench is linear in its corners' pressures, so each point has a share g of the
surface around it, and W = sum over wet points of p g. That is wrong only for triangles that the surface cuts. One
corner a of those lies alone on its side, with pressure p, and s = p / (p - q), t = p / (p - r) are the places on its
edges to b and c where the pressure is zero. With the share of the corner in this triangle being S(1, 1),

    S(s, t) = -p / 3 s t N at a + (s (b - a) + t (c - a)) / 4,      N = (b - a) x (c - a) / 2,

S(s, t) is what the corner's own piece feels. If a is wet, S(s, t) takes the place of S(1, 1); if it is dry, S(1, 1) is
what the sum lacks and S(s, t) what it has too much: in both, |p| / p (S(s, t) - S(1, 1)) is added.
"""

from typing import Final

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.lanes import WIDTH, larger, load, spread, total
from vrx_mj.physics.motion import Vector, Wrench
from vrx_mj.physics.panel_mesh import Panels

__all__ = ["CUT", "panel_wrench", "still_pressures", "wrench_of_pressures", "wrench_of_still_water"]

CUT: Final = 12
"""Numbers that are kept of a cut triangle."""
_ALONE = (0, 0, 1, 2, 2, 1, 0, 0)  # the corner alone on its side, by which are wet: 1, 2 and 4 for the three
_NEXT = (0, 1, 2, 0, 0, 2, 1, 0)  # the one after it
_LAST = (0, 2, 0, 1, 1, 0, 2, 0)
_CASES = 8  # a triangle is noted as its number times this, and which corners are wet


@kernel
def panel_wrench(
    points: FloatArray, shares: FloatArray, triangles: IntArray, pressures: FloatArray,
    wet: ByteArray, found: IntArray, cut: FloatArray,
) -> Wrench:  # fmt: skip
    """Return the wrench of the water on a mesh: body axes, about the link's origin.

    Args:
        points: of `Panels`.
        shares: of `Panels`.
        triangles: of `Panels`.
        pressures: (n,) over the air's [Pa]; below zero: dry.
        wet: memory, (n,).
        found: memory, (m,).
        cut: memory, (CUT, m + WIDTH), zeros at first.
    """
    fx, fy, fz = spread(0.0), spread(0.0), spread(0.0)
    tx, ty, tz = spread(0.0), spread(0.0), spread(0.0)
    sx, sy, sz, kx, ky, kz = shares[0], shares[1], shares[2], shares[3], shares[4], shares[5]
    for i in range(0, pressures.size, WIDTH):
        p = larger(load(pressures, i), spread(0.0))
        fx += p * load(sx, i)
        fy += p * load(sy, i)
        fz += p * load(sz, i)
        tx += p * load(kx, i)
        ty += p * load(ky, i)
        tz += p * load(kz, i)
    number = _find_cut(triangles, pressures, wet, found)
    _copy_cut(points, triangles, pressures, found, number, cut)
    x, y, z, k, m, n = _add_cut(cut, number)
    return Wrench(total(fx) + x, total(fy) + y, total(fz) + z, total(tx) + k, total(ty) + m, total(tz) + n)


@kernel
def _find_cut(triangles: IntArray, pressures: FloatArray, wet: ByteArray, found: IntArray) -> int:
    """Note the triangles that the surface cuts, each with the corners that are wet; returns their number."""
    for i in range(pressures.size):
        wet[i] = pressures[i] > 0.0
    number = 0
    for i in range(len(triangles)):
        sides = wet[triangles[i, 0]] + 2 * wet[triangles[i, 1]] + 4 * wet[triangles[i, 2]]
        found[number] = _CASES * i + sides
        number += (sides != 0) & (sides != _CASES - 1)
    return number


@kernel
def _copy_cut(
    points: FloatArray, triangles: IntArray, pressures: FloatArray, found: IntArray, number: int, cut: FloatArray
) -> None:
    """Copy corners and pressures of triangles to `cut`, that corner first which is alone on its side."""
    xs, ys, zs = points[0], points[1], points[2]
    ax, ay, az, p, bx, by = cut[0], cut[1], cut[2], cut[3], cut[4], cut[5]
    bz, q, cx, cy, cz, r = cut[6], cut[7], cut[8], cut[9], cut[10], cut[11]
    for i in range(number):
        own, sides = triangles[found[i] // _CASES], found[i] % _CASES
        one, two, three = own[_ALONE[sides]], own[_NEXT[sides]], own[_LAST[sides]]
        ax[i], ay[i], az[i], p[i] = xs[one], ys[one], zs[one], pressures[one]
        bx[i], by[i], bz[i], q[i] = xs[two], ys[two], zs[two], pressures[two]
        cx[i], cy[i], cz[i], r[i] = xs[three], ys[three], zs[three], pressures[three]
    for i in range(number, (number + WIDTH - 1) // WIDTH * WIDTH):
        p[i], q[i], r[i] = 0.0, -1.0, -1.0


@kernel
def _add_cut(cut: FloatArray, number: int) -> Wrench:
    """Return what cut triangles add to the sum of shares."""
    axs, ays, azs, ps, bxs, bys = cut[0], cut[1], cut[2], cut[3], cut[4], cut[5]
    bzs, qs, cxs, cys, czs, rs = cut[6], cut[7], cut[8], cut[9], cut[10], cut[11]
    fx, fy, fz = spread(0.0), spread(0.0), spread(0.0)
    tx, ty, tz = spread(0.0), spread(0.0), spread(0.0)
    for i in range(0, number, WIDTH):
        p, ax, ay, az = load(ps, i), load(axs, i), load(ays, i), load(azs, i)
        s, t = p / (p - load(qs, i)), p / (p - load(rs, i))
        ux, uy, uz = load(bxs, i) - ax, load(bys, i) - ay, load(bzs, i) - az
        vx, vy, vz = load(cxs, i) - ax, load(cys, i) - ay, load(czs, i) - az
        sixth, st = larger(p, 0.0 - p) * (-1.0 / 6.0), s * t
        nx, ny, nz = sixth * (uy * vz - uz * vy), sixth * (uz * vx - ux * vz), sixth * (ux * vy - uy * vx)
        d, e, f = st - 1.0, 0.25 * (s * st - 1.0), 0.25 * (st * t - 1.0)
        x, y, z = d * ax + e * ux + f * vx, d * ay + e * uy + f * vy, d * az + e * uz + f * vz
        fx += d * nx
        fy += d * ny
        fz += d * nz
        tx += y * nz - z * ny
        ty += z * nx - x * nz
        tz += x * ny - y * nx
    return Wrench(total(fx), total(fy), total(fz), total(tx), total(ty), total(tz))


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
    count = len(panels.triangles)
    memory = np.empty(pressures.size, np.uint8), np.empty(count, np.uint32), np.zeros((CUT, count + WIDTH))
    return np.array(panel_wrench(panels.points, panels.shares, panels.triangles, pressures, *memory))
