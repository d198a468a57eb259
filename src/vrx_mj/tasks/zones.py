"""Boxes that go with a dock: what is inside, and what flew through."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vrx_mj.tasks.frame import Stand

__all__ = ["Box", "Point", "relative"]

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box in the frame of a dock; its faces belong to it."""

    center: Point
    """[m]"""
    size: Point
    """Length of the edges [m]."""

    def contains(self, point: Sequence[float]) -> bool:
        """Whether a point is in it."""
        return all(2.0 * abs(p - center) <= size for p, center, size in zip(point, self.center, self.size, strict=True))

    def meets(self, start: Sequence[float], end: Sequence[float]) -> bool:
        """Whether the straight way from one point to another has a point in it: it lies between all pairs of faces."""
        enters, leaves = 0.0, 1.0
        for a, b, center, size in zip(start, end, self.center, self.size, strict=True):
            low, high = center - 0.5 * size, center + 0.5 * size
            if a == b:
                if not low <= a <= high:
                    return False
                continue
            first, last = sorted(((low - a) / (b - a), (high - a) / (b - a)))
            enters, leaves = max(enters, first), min(leaves, last)
        return enters <= leaves

    def entered(self, before: Sequence[float], now: Sequence[float], reach: float) -> bool:
        """Whether something has come in between two frames; at most `reach` [m] apart, or it did not come that way."""
        if self.contains(before):
            return False
        return self.meets(before, now) if math.dist(before, now) <= reach else self.contains(now)


def relative(anchor: Stand, stand: Stand) -> Point:
    """Where `stand` is in the frame of `anchor` [m]: R^T (p - o), with R the rotation of the unit quaternion (w, q).

    Reference: R^T v = v + w t + t x q with t = 2 v x q.
    """
    w, a, b, c = anchor.quaternion
    x, y, z = stand.x - anchor.x, stand.y - anchor.y, stand.z - anchor.z
    u, v, s = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return x + w * u + v * c - s * b, y + w * v + s * a - u * c, z + w * s + u * b - v * a
