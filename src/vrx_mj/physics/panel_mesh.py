"""A hull's mesh as the kernels of its pressure need it: in parts that lie beside each other, its points in lanes."""

from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.lanes import WIDTH

_SLENDER = 0.25
"""Breadth of a part over its length, up to which waves are taken to be of degree 2 across it."""
_SHALLOW = 0.125
"""Height of a part over its length, up to which they are over its depth."""


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
