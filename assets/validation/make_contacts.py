"""Make the rows of contacts.csv: `pip install numpy scipy`, `python make_contacts.py`.

A cylinder of the size of a WAM-V's float and a box of the size of its battery, in 100 attitudes. The cylinder comes
nearer along a line until it touches the box at the origin, and is moved on by 10 mm. The depth is the least distance
that parts the convex bodies: the least sum of their support functions in a direction, by search over all directions
(Cameron and Culley, 1986).
"""

import sys
from collections.abc import Callable, Iterator

import numpy as np
from scipy.spatial.transform import Rotation

RADIUS, HALF, BOX = 0.2, 2.0, (0.3, 0.2, 0.155)
"""Radius and half length of the cylinder, half edges of the box [m]."""
MOVED = 0.01
"""How far the cylinder is moved on after its first contact [m]."""


def least(function: Callable[[np.ndarray], np.ndarray], random: np.random.Generator) -> float:
    """The least value of a function of directions (n, 3)."""
    tried = random.normal(size=(20_000, 3))
    for width in np.geomspace(0.1, 1e-6, 24):  # around the best ones, ever nearer
        tried /= np.linalg.norm(tried, axis=1, keepdims=True)
        best = tried[np.argsort(function(tried))[:20]]
        tried = np.concatenate([best, *(best + width * random.normal(size=(20, 20, 3)))])
    return float(function(best).min())


def rows() -> Iterator[list[float]]:
    """Place (3,) and attitude (4,) of the cylinder, attitude (4,) of the box, and depth, of each attitude."""
    random = np.random.default_rng(7)
    for _ in range(100):
        cylinder, box = Rotation.random(2, random)
        toward = random.normal(size=3)
        toward /= np.linalg.norm(toward)

        def reach(n: np.ndarray, cylinder: Rotation = cylinder, box: Rotation = box) -> np.ndarray:
            """The sum of the support functions, both bodies at the origin."""
            a, b = cylinder.inv().apply(n), box.inv().apply(n)
            return RADIUS * np.hypot(a[:, 0], a[:, 1]) + HALF * np.abs(a[:, 2]) + np.abs(b) @ np.array(BOX)

        def touching(n: np.ndarray, toward: np.ndarray = toward, reach: Callable = reach) -> np.ndarray:
            """How far along the line a plane of normal `n` parts the bodies."""
            ahead = -n @ toward
            return np.where(ahead > 1e-9, reach(n) / np.maximum(ahead, 1e-9), np.inf)

        place = (least(touching, random) - MOVED) * toward
        depth = least(lambda n, place=place, reach=reach: reach(n) + n @ place, random)
        yield [*place, *cylinder.as_quat(scalar_first=True), *box.as_quat(scalar_first=True), depth]


if __name__ == "__main__":
    for row in rows():
        sys.stdout.write(",".join(f"{value:.9g}" for value in row) + "\n")
