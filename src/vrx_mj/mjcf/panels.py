"""The panels of a hull: its closed surface as points and triangles that are small enough for waves."""

import math

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray

_SEAM = 1e-9
"""Distance [m] within which two corners are one point."""
_SAME = 1e-7
"""Share by which the moments of two surfaces differ that are one."""
_EQUAL = 1e-6
"""Share by which edges differ that are as long."""
FEWEST = 200
"""Triangles that a compact hull has at least, of about the same size."""
_MOST = 1000
"""Triangles to which equal edges that are halved alike may bring a hull."""
_ALONG = 8
"""Parts into which a slender hull is divided along its length."""


def panels_of(corners: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points (n, 3) [m] and triangles (m, 3) of closed triangles (k, 3, 3), of which long ones are divided.

    An edge is halved that is a triangle's longest, longer than a part of `_ALONG`, and longer than that of `FEWEST`
    equal triangles of the same area, right-angled with two equal sides. It is halved in both triangles that have it, so
    that the surface stays closed. Of a surface that is the same to port and to starboard, or ahead and astern, but
    whose triangles are not, one half is divided and mirrored, so that waves from ahead do not push it aside.
    """
    points, triangles = _merge_points(corners)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    equal = 2.0 * math.sqrt(0.5 * float(np.linalg.norm(across, axis=1).sum()) / FEWEST)
    longest = max(equal, float(np.ptp(points, axis=0).max()) / _ALONG)
    found, even = (_divide(points, triangles, longest, even=choice) for choice in (False, True))
    axes = [axis for axis in (1, 0) if _same_surface(*_halves(corners, axis)) and not _is_mirrored(*found, axis)]
    if not axes:
        return found
    if len(even[1]) <= _MOST and all(_is_mirrored(*even, axis) for axis in axes):
        return even
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    part = corners - middle
    for axis in axes:
        part = _half(part, axis)
    points, triangles = _divide(*_merge_points(part), longest, even=False)
    part = points[triangles]
    for axis in axes:
        part = np.concatenate([part, _mirror(part, axis)])
    points, triangles = _merge_points(part)
    return points + middle, triangles


def _merge_points(corners: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points (n, 3) and triangles (m, 3) of corners (m, 3, 3); those within `_SEAM` are one point."""
    points, named = np.unique(np.round(corners.reshape(-1, 3) / _SEAM) * _SEAM, axis=0, return_inverse=True)
    return points, named.reshape(-1, 3).astype(np.int64)


def _mirror(corners: FloatArray, axis: int) -> FloatArray:
    """Triangles (n, 3, 3) mirrored along an axis, their outside still outside."""
    sign = np.ones(3)
    sign[axis] = -1.0
    return (corners * sign)[:, ::-1]


def _halves(corners: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Triangles (n, 3, 3) of the part beyond the middle along an axis, and the part before it, mirrored."""
    ends = corners.reshape(-1, 3)
    centred = corners - 0.5 * (ends.min(axis=0) + ends.max(axis=0))
    return _half(centred, axis), _half(_mirror(centred, axis), axis)


def _is_mirrored(points: FloatArray, triangles: IntArray, axis: int) -> bool:
    """Whether triangles are the same on both sides of the middle along an axis."""
    corners = points[triangles] - 0.5 * (points.min(axis=0) + points.max(axis=0))
    return _same_triangles(corners, _mirror(corners, axis))


def _half(corners: FloatArray, axis: int) -> FloatArray:
    """The triangles (n, 3, 3) of what is above 0 along an axis; quadrangles have their shorter diagonal."""
    found: list[FloatArray] = []
    for triangle in np.where(np.abs(corners) < _SEAM, 0.0, corners):
        sides = triangle[:, axis]
        if sides.min() >= 0.0:
            found += [triangle] if sides.max() > 0.0 else []
        elif sides.max() > 0.0:
            outline = _above(triangle, axis)
            if len(outline) == 4 and np.linalg.norm(outline[1] - outline[3]) < np.linalg.norm(outline[0] - outline[2]):
                outline = [*outline[1:], outline[0]]
            found += [np.stack([outline[0], *outline[i : i + 2]]) for i in range(1, len(outline) - 1)]
    return np.array(found).reshape(-1, 3, 3)


def _above(triangle: FloatArray, axis: int) -> list[FloatArray]:
    """The outline of the part of a triangle (3, 3) that is above 0 along an axis."""
    outline: list[FloatArray] = []
    for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        if a[axis] >= 0.0:
            outline.append(a)
        if a[axis] * b[axis] < 0.0:
            crossing = a + a[axis] / (a[axis] - b[axis]) * (b - a)
            crossing[axis] = 0.0
            outline.append(crossing)
    return outline


def _same_triangles(one: FloatArray, other: FloatArray) -> bool:
    """Whether two lists of triangles are the same but for their order and that of their corners."""
    found = []
    for corners in (one, other):
        grid = np.round(corners / (10.0 * _SEAM)).astype(np.int64)
        found.append(sorted(sorted(triangle) for triangle in grid.tolist()))
    return found[0] == found[1]


def _same_surface(one: FloatArray, other: FloatArray) -> bool:
    """Whether two surfaces have the same area, normals and moments up to the second order, however they are divided."""
    if not len(one) or not len(other):
        return False
    size = float(np.abs(one).max())
    first, second = _moments(one / size), _moments(other / size)
    return bool(np.abs(first - second).max() < _SAME * first[0])


def _moments(corners: FloatArray) -> FloatArray:
    """Integrals (13,) over triangles of 1, the place, its products and the normal."""
    across = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))  # at which a sum of second order is exact
    square = np.einsum("n,nij,nik->jk", area, middles, middles) / 3.0
    place = area @ middles.mean(axis=1)
    return np.array([area.sum(), *place, *square[np.triu_indices(3)], *across.sum(axis=0)])


def _divide(points: FloatArray, triangles: IntArray, longest: float, *, even: bool) -> tuple[FloatArray, IntArray]:
    """Points and triangles of which no longest edge is longer than that; `even`: equal edges are halved alike."""
    while True:
        edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
        names, places = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        lengths = np.linalg.norm(points[names[:, 0]] - points[names[:, 1]], axis=1)
        own = places.reshape(-1, 3)
        long = np.zeros(len(names), dtype=np.bool_)
        _mark(long, own, lengths[own], longest, even=even)
        if not long.any():
            return points, triangles
        middles = np.full(len(names), -1, dtype=np.int64)
        middles[long] = len(points) + np.arange(int(long.sum()))
        points = np.concatenate([points, 0.5 * (points[names[long, 0]] + points[names[long, 1]])])
        halves = middles[own].tolist()
        divided = [
            part for row, own in zip(triangles.tolist(), halves, strict=True) for part in _parts(row, own, points)
        ]
        triangles = np.array(divided, dtype=np.int64)


def _mark(long: BoolArray, edges: IntArray, lengths: FloatArray, longest: float, *, even: bool) -> None:
    """Mark the edges that are halved, of triangles (m, 3) with edges of lengths (m, 3).

    `even`: of a triangle whose longest edges are equal all these are, and of one of which two equal edges are halved
    the third is, too: it is the same on both sides, and so are its parts.
    """
    most = lengths.max(axis=1, keepdims=True)
    if not even:
        worst = edges[np.arange(len(edges)), lengths.argmax(axis=1)]
        long[worst[most[:, 0] > longest * (1.0 + _SEAM)]] = True
        return
    long[edges[(lengths > most * (1.0 - _EQUAL)) & (most > longest * (1.0 + _SEAM))]] = True
    while True:
        cut = long[edges]
        least, greatest = np.where(cut, lengths, np.inf).min(axis=1), np.where(cut, lengths, 0.0).max(axis=1)
        both = (cut.sum(axis=1) == 2) & (least > greatest * (1.0 - _EQUAL))
        if not both.any():
            return
        long[edges[both]] = True


def _parts(corners: list[int], middles: list[int], points: FloatArray) -> list[tuple[int, int, int]]:
    """The parts of a triangle some edges of which have middles, those from each corner to the next; -1: none."""
    count = sum(middle >= 0 for middle in middles)
    if count == 0:
        a, b, c = corners
        return [(a, b, c)]
    turn = next(i for i in range(3) if middles[i] >= 0 and (count != 2 or middles[i - 1] < 0))
    a, b, c = (corners[(turn + i) % 3] for i in range(3))
    ab, bc, ca = (middles[(turn + i) % 3] for i in range(3))
    if count == 1:
        return [(a, ab, c), (ab, b, c)]
    if count == 3:
        return [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    if np.linalg.norm(points[a] - points[bc]) < np.linalg.norm(points[ab] - points[c]):
        return [(ab, b, bc), (a, ab, bc), (a, bc, c)]
    return [(ab, b, bc), (a, ab, c), (ab, bc, c)]
