"""The panels of a hull: its closed surface as points and triangles that are small enough for waves."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray

__all__ = ["panels_of"]

SEAM = 1e-9
"""Distance [m] within which two corners are one point."""
FEWEST = 200
"""Triangles that a compact hull has at least, of about the same size."""
ALONG = 8
"""Parts into which a slender hull is divided along its length."""


def panels_of(corners: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points (n, 3) [m] and triangles (m, 3) of closed triangles (k, 3, 3), of which long ones are divided.

    An edge is halved that is a triangle's longest, longer than a part of `ALONG`, and longer than that of `FEWEST`
    equal triangles of the same area, right-angled with two equal sides. It is halved in both triangles that have it, so
    that the surface stays closed.
    """
    points, named = np.unique(np.round(corners.reshape(-1, 3) / SEAM) * SEAM, axis=0, return_inverse=True)
    triangles: IntArray = named.reshape(-1, 3).astype(np.int64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    equal = 2.0 * math.sqrt(0.5 * float(np.linalg.norm(across, axis=1).sum()) / FEWEST)
    longest = max(equal, float(np.ptp(points, axis=0).max()) / ALONG)
    while True:
        edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
        names, places = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        lengths = np.linalg.norm(points[names[:, 0]] - points[names[:, 1]], axis=1)
        own = places.reshape(-1, 3)
        worst = own[np.arange(len(own)), lengths[own].argmax(axis=1)]
        long = np.zeros(len(names), dtype=np.bool_)
        long[worst[lengths[worst] > longest * (1.0 + SEAM)]] = True
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
