"""Where the boats of a layout are, in the fleet's frame: x ahead, y to the left; m, and headings in rad from x to y."""

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

LayoutName = Literal["circle", "line", "column", "wedge", "grid", "random"]
Facing = Literal["outward", "inward", "tangent"]
Spot = tuple[float, float]
"""x, y [m]."""

HEIGHT = 0.1
"""Height of a boat's origin over the water at the start [m], as in the published guide."""
WEDGE = math.pi / 4
"""Angle between the axis of a wedge and each of its arms [rad]: neighbours across the axis are apart too."""
DENSITY = 0.25
"""Boats of a random layout per square of their spacing; darts thrown at random find room up to about 0.7."""
TRIES = 1000
"""Places that are tried for a boat before the square is full."""


@dataclass(frozen=True)
class Layout:
    """How boats are placed that have no positions."""

    name: LayoutName
    radius: float
    """Radius of the circle [m]."""
    spacing: float
    """Between neighbours; for random ones at least [m]."""
    start_angle: float
    """Angle of the circle's first boat, counter-clockwise from x [rad]."""
    heading: Facing | float | None
    """A word, or [rad]; None: outward on the circle, drawn for random ones, along x for the others."""
    size: float | None
    """Edge of the square of random ones [m]; None: as large as `DENSITY` wants."""
    seed: int
    """Seed of random layouts."""


def spots(layout: Layout, count: int) -> tuple[Spot, ...]:
    """Places of `count` boats; fewer if there is no room for more in a random layout's square."""
    if layout.name == "circle":
        return circle(count, layout.radius, layout.start_angle)
    if layout.name == "random":
        return random_spots(count, layout.spacing, square(layout, count), layout.seed)
    places = {"line": line, "column": column, "wedge": wedge, "grid": grid}[layout.name]
    return places(count, layout.spacing)


def square(layout: Layout, count: int) -> float:
    """Edge of the square of a random layout of `count` boats [m]."""
    return layout.size or layout.spacing * math.sqrt(count / DENSITY)


def circle(count: int, radius: float, start_angle: float) -> tuple[Spot, ...]:
    """Boat i is at `radius`, start_angle + 360 i / n degrees from x, counter-clockwise: the published guide's."""
    angles = [start_angle + 2 * math.pi * i / count for i in range(count)]
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


def line(count: int, spacing: float) -> tuple[Spot, ...]:
    """Abreast, the first on the left; the middle is the origin."""
    return tuple((0.0, spacing * ((count - 1) / 2 - i)) for i in range(count))


def column(count: int, spacing: float) -> tuple[Spot, ...]:
    """One behind the other, the first ahead; the middle is the origin."""
    return tuple((spacing * ((count - 1) / 2 - i), 0.0) for i in range(count))


def wedge(count: int, spacing: float) -> tuple[Spot, ...]:
    """The first is at the origin, the others behind it by turns on the left arm and the right one."""
    back, aside = spacing * math.cos(WEDGE), spacing * math.sin(WEDGE)
    ranks = [((i + 1) // 2, 1 if i % 2 else -1) for i in range(count)]
    return tuple((0.0 - back * rank, aside * rank * side) for rank, side in ranks)


def grid(count: int, spacing: float) -> tuple[Spot, ...]:
    """Rows abreast, as many as make it nearly square, the front left first; the middle of each is over the origin."""
    width = math.ceil(math.sqrt(count))
    rows = [min(width, count - first) for first in range(0, count, width)]
    ranks = column(len(rows), spacing)
    return tuple((x, y) for (x, _), abreast in zip(ranks, rows, strict=True) for _, y in line(abreast, spacing))


def random_spots(count: int, spacing: float, size: float, seed: int) -> tuple[Spot, ...]:
    """Places drawn one by one in a square around the origin, none nearer than `spacing` to one before it.

    Fewer than `count` if `TRIES` places in a row are too near others. Places are kept in cells as wide as the
    spacing, so that a new one is compared with its neighbours alone.
    """
    draw = random.Random(seed)
    found: list[Spot] = []
    cells: dict[tuple[int, int], list[Spot]] = {}
    while len(found) < count:
        for _ in range(TRIES):
            x, y = (size * (draw.random() - 0.5) for _ in range(2))
            cell = math.floor(x / spacing), math.floor(y / spacing)
            if all(math.dist(other, (x, y)) >= spacing for other in _around(cells, cell)):
                break
        else:
            break
        found.append((x, y))
        cells.setdefault(cell, []).append((x, y))
    return tuple(found)


def _around(cells: dict[tuple[int, int], list[Spot]], cell: tuple[int, int]) -> Iterator[Spot]:
    i, j = cell
    for near in ((i + di, j + dj) for di in (-1, 0, 1) for dj in (-1, 0, 1)):
        yield from cells.get(near, ())


def headings(layout: Layout, places: Sequence[Spot]) -> tuple[float, ...]:
    """Heading of the boat at each place [rad]; outward from the origin, where a boat at the origin faces along x."""
    heading = layout.heading
    if heading is None and layout.name == "random":
        draw = random.Random(f"headings {layout.seed}")  # not the stream of the places
        return tuple(2 * math.pi * draw.random() for _ in places)
    if heading is None:
        heading = "outward" if layout.name == "circle" else 0.0
    if not isinstance(heading, str):
        return (heading,) * len(places)
    turn = {"outward": 0.0, "inward": math.pi, "tangent": math.pi / 2}[heading]
    return tuple(math.atan2(y, x) + turn for x, y in places)
