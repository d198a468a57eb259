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

Triangles are looked at in pairs that share an edge, since they are mostly wet or dry together. The kernels have the
mesh in parts that lie beside each other, with the points in lanes.
"""

from typing import Final, NamedTuple

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.lanes import WIDTH, Lanes, broadcast, choose, larger, load, product_and, store, sync_lanes, totals
from vrx_mj.physics.motion import Vector, Wrench

_SLENDER = 0.25
"""Breadth of a part over its length, up to which waves are taken to be of degree 2 across it."""
_SHALLOW = 0.125
"""Height of a part over its length, up to which they are over its depth."""
CUT: Final = 10
"""Numbers that are kept of a pair that the surface cuts: pressures at its points, weights of its triangles' corners."""
_TINY = 1e-300  # of a product of pressures [Pa2]; where they are smaller the surface lies in the triangle


class Part(NamedTuple):
    """Points that lie in one box: a monohull, or a hull of a catamaran."""

    center: tuple[float, float, float]
    """Middle of the box [m], body axes."""
    start: int
    """First of its points."""
    size: int
    """Number of its points, a multiple of `WIDTH`: the last one is repeated, without a share."""


class Panels(NamedTuple):
    """A mesh."""

    points: FloatArray
    """(3, n) [m], body axes: part by part, from the lowest up."""
    shares: FloatArray
    """Force [m2] and torque [m3] on each point's share of the surface, by 1 Pa there, (6, n)."""
    pairs: IntArray
    """Points a, b, c, d of two triangles (a, b, c) and (a, c, d) that share an edge, (k, 4); d is c of one alone."""
    corner_shares: FloatArray
    """Force and torque by 1 Pa on a third of each triangle's area, at the corners of both of a pair, (k, 6, WIDTH)."""
    parts: tuple[Part, ...]
    half: tuple[float, float, float]
    """Half sides of a box that is large enough for each part [m]."""

    @property
    def is_slender(self) -> bool:
        """Whether waves across a part are taken to be of degree 2."""
        return self.half[1] <= _SLENDER * self.half[0]

    @property
    def is_shallow(self) -> bool:
        """Whether waves over the depth of a part are taken to be of degree 2."""
        return self.half[2] <= _SHALLOW * self.half[0]


def panels_of(vertices: FloatArray, triangles: IntArray) -> Panels:
    """Return a mesh of vertices (v, 3) [m] and triangles (m, 3), seen from outside counter-clockwise."""
    vertices = np.asarray(vertices, np.float64)
    places: IntArray = np.zeros(0, np.int64)
    parts, half = [], np.zeros(3)
    for own in _beside_each_other(vertices[:, 1], triangles):
        upward = own[np.lexsort((vertices[own, 0], vertices[own, 2]))]
        low, high = vertices[own].min(axis=0), vertices[own].max(axis=0)
        x, y, z = (0.5 * (low + high)).tolist()
        parts.append(Part((x, y, z), len(places), -(-len(own) // WIDTH) * WIDTH))
        places = np.concatenate((places, np.pad(upward, (0, -len(own) % WIDTH), mode="edge")))
        half = np.maximum(half, 0.5 * (high - low))
    numbers, first = np.unique(places, return_index=True)
    shares = np.zeros((len(places), 6))
    shares[first] = _shares(vertices, triangles)[numbers]
    renumbered = np.zeros(len(vertices), np.uint32)
    renumbered[numbers] = first
    long, broad, deep = half.tolist()
    pairs = _pairs(vertices, triangles)
    return Panels(
        np.ascontiguousarray(vertices[places].T),
        np.ascontiguousarray(shares.T),
        renumbered[pairs],
        _pair_shares(vertices, pairs),
        tuple(parts),
        (long, broad, deep),
    )


def _shares(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Force and torque (v, 6) by 1 Pa at each vertex that falls to zero along the edges around it."""
    own = _corner_shares(vertices[triangles])
    shares = np.zeros((len(vertices), 6))
    for corner in range(3):
        np.add.at(shares, triangles[:, corner], (own.sum(axis=1) + own[:, corner]) / 4.0)
    return shares


def _corner_shares(corners: FloatArray) -> FloatArray:
    """Force and torque (m, 3, 6) by 1 Pa on a third of a triangle's area at each of its corners, (m, 3, 3)."""
    first, second, third = np.moveaxis(corners, 1, 0)
    normals = np.broadcast_to(0.5 * np.cross(second - first, third - first)[:, None], corners.shape)
    return np.concatenate([-normals, -np.cross(corners, normals)], axis=2) / 3.0


def _pairs(vertices: FloatArray, triangles: IntArray) -> IntArray:
    """Corners (k, 4) of triangles that share an edge, the longest first; one alone has its last corner twice."""
    turned = np.concatenate([np.roll(triangles, turn, axis=1) for turn in range(3)])
    long = ((vertices[turned[:, 0]] - vertices[turned[:, 2]]) ** 2).sum(axis=1)
    order = np.argsort(-long, kind="stable").tolist()
    corners, count = turned.tolist(), len(triangles)
    from_last_to_first = {(c, a): index for index, (a, _, c) in enumerate(corners)}
    pairs, alone = [], dict.fromkeys(range(count))
    for index in order:
        a, b, c = corners[index]
        beside = from_last_to_first.get((a, c))
        if beside is not None and index % count in alone and beside % count in alone:
            pairs.append((a, b, c, corners[beside][1]))
            del alone[index % count], alone[beside % count]
    pairs += [(a, b, c, c) for a, b, c in triangles[list(alone)].tolist()]
    return np.array(pairs, np.int64).reshape(-1, 4)


def _pair_shares(vertices: FloatArray, pairs: IntArray) -> FloatArray:
    """`Panels.corner_shares`."""
    own = [_corner_shares(vertices[pairs[:, corners]]) for corners in ((0, 1, 2), (0, 2, 3))]
    shares = np.zeros((len(pairs), 6, WIDTH))
    shares[:, :, :6] = np.concatenate(own, axis=1)
    return shares


def _beside_each_other(across: FloatArray, triangles: IntArray) -> list[IntArray]:
    """The vertices of the parts of a mesh, connected pieces that share no place across, to starboard first."""
    piece = np.arange(len(across))
    while True:
        lowest = piece[triangles].min(axis=1)
        joined = piece.copy()
        np.minimum.at(joined, triangles.ravel(), np.repeat(lowest, 3))
        joined = joined[joined]
        if np.array_equal(joined, piece):
            break
        piece = joined
    used = np.unique(triangles)
    pieces = [used[piece[used] == number] for number in np.unique(piece[used])]
    parts: list[IntArray] = []
    end = -np.inf
    for own in sorted(pieces, key=lambda own: float(across[own].min())):
        if parts and across[own].min() <= end:
            parts[-1] = np.concatenate((parts[-1], own))
        else:
            parts.append(own)
        end = max(end, float(across[own].max()))
    return parts


@kernel
def panel_wrench(
    shares: FloatArray, pairs: IntArray, corner_shares: FloatArray, pressures: FloatArray,
    wet: ByteArray, found: IntArray, cut: FloatArray,
) -> Wrench:  # fmt: skip
    """Return the wrench of the water on a mesh: body axes, about the link's origin.

    Args:
        shares: of `Panels`, in any shape.
        pairs: of `Panels`.
        corner_shares: of `Panels`.
        pressures: (n,) over the air's [Pa]; below zero: dry.
        wet: memory, (n,).
        found: memory, (k,).
        cut: memory, (CUT, k + WIDTH).
    """
    fx = fy = fz = broadcast(0.0)
    tx = ty = tz = broadcast(0.0)
    n = pressures.size
    for i in range(0, n, WIDTH):
        p = larger(load(pressures, i), 0.0)
        fx = product_and(p, load(shares, i), fx)
        fy = product_and(p, load(shares, n + i), fy)
        fz = product_and(p, load(shares, 2 * n + i), fz)
        tx = product_and(p, load(shares, 3 * n + i), tx)
        ty = product_and(p, load(shares, 4 * n + i), ty)
        tz = product_and(p, load(shares, 5 * n + i), tz)
    number = _find_cut(pairs, pressures, wet, found)
    _weigh_cut(pairs, pressures, found, number, cut)
    sums = cut[0]
    store(sums, 0, _add_cut(corner_shares, found, number, cut) + totals(fx, fy, fz, tx, ty, tz, 0.0, 0.0))
    return Wrench(sums[0], sums[1], sums[2], sums[3], sums[4], sums[5])


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
    sync_lanes()
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
    """Write the pressures of still water [Pa] at points [m, body axes] into `out`, (n,).

    Args:
        points: of the hull, 3 n numbers: of (3, n), in any shape.
        up: the vertical, unit vector, body axes.
        height: of the link's origin over the water [m].
        weight: rho g [N/m3].
        out: below zero over the water.
    """
    n = out.size
    for i in range(0, n, WIDTH):
        x, y, z = load(points, i), load(points, n + i), load(points, 2 * n + i)
        store(out, i, -weight * (height + up[0] * x + up[1] * y + up[2] * z))


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
