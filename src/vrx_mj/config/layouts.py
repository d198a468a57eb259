"""Places of a layout's boats in the fleet's frame: x ahead, y to the left [m], and headings from x to y [rad]."""

import math
import random
from collections.abc import Sequence
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import Tag

from vrx_mj.arrays import FloatArray
from vrx_mj.config.base import Config, Only
from vrx_mj.config.values import Number, Positive, by_type
from vrx_mj.model.kinds import Seed

LayoutName = Literal["circle", "line", "column", "wedge", "grid", "random"]
_Facing = Literal["outward", "inward", "tangent"]
Headings = Literal["math", "compass"]
Heading = Annotated[
    Annotated[_Facing, Tag("word")] | Annotated[Number, Tag("degrees")],
    by_type(f"{', '.join(get_args(_Facing))} or degrees", get_args(_Facing), degrees=(int, float)),
]
_Spot = tuple[float, float]
"""x, y [m]."""

HEIGHT = 0.1
"""Height of a boat's origin over the water at the start [m], as in the published guide."""
_WEDGE = math.pi / 4
"""Angle between the axis of a wedge and each of its arms [rad]: neighbours across the axis are apart too."""
DENSITY = 0.25
"""Boats of a random layout per square of their spacing; darts thrown at random find room up to about 0.7."""
_TRIES = 1000
"""Number of places tried for a boat before the square counts as full."""


class Layout(Config):
    """How boats without positions are placed."""

    layout: LayoutName | None = None
    """How boats without `positions` are placed."""
    radius: Annotated[Positive, Only("layout", ("circle",))] = 20.0
    """Radius of the circle [m]."""
    start_angle: Annotated[Number, Only("layout", ("circle",))] = 0.0
    """Angle of the circle's first boat [degrees], counter-clockwise from the frame's x axis."""
    spacing: Annotated[Positive, Only("layout", ("line", "column", "wedge", "grid", "random"))] = 10.0
    """Distance between neighbours; in a random layout the minimum distance [m]."""
    size: Annotated[Positive | None, Only("layout", ("random",))] = None
    """Edge of the square of a random layout, centred on the origin [m]."""
    seed: Annotated[Seed | None, Only("layout", ("random",))] = None
    """Seed of a random layout; by default that of the world's file."""
    heading: Annotated[Heading | None, Only("layout")] = None
    """Heading of the layout's boats [degrees], in the convention of `headings`."""
    headings: Headings | None = None
    """Convention of `Y` and `heading`: math (the default), counter-clockwise from x, or compass, clockwise from y."""


def spots(layout: Layout, count: int, seed: int = 0) -> tuple[_Spot, ...]:
    """Places of `count` boats; fewer if there is no room for more in a random layout's square.

    `seed` is that of a random layout which has none.
    """
    if layout.layout == "circle":
        return _circle(count, layout.radius, math.radians(layout.start_angle))
    if layout.layout == "random":
        size = layout.size or roomy_square(layout.spacing, count)
        return _random_spots(count, layout.spacing, size, seed if layout.seed is None else layout.seed)
    places = {"column": _column, "wedge": _wedge, "grid": _grid}.get(layout.layout or "", _line)
    return places(count, layout.spacing)


def roomy_square(spacing: float, count: int) -> float:
    """Edge of a square with room for `count` boats of a random layout [m]."""
    return spacing * math.sqrt(count / DENSITY)


def _circle(count: int, radius: float, start_angle: float) -> tuple[_Spot, ...]:
    """Boat i is at `radius`, start_angle + 360 i / n degrees from x, counter-clockwise: the published guide's."""
    angles = [start_angle + 2 * math.pi * i / count for i in range(count)]
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


def _line(count: int, spacing: float) -> tuple[_Spot, ...]:
    """Abreast, the first on the left; the middle is the origin."""
    return tuple((0.0, spacing * ((count - 1) / 2 - i)) for i in range(count))


def _column(count: int, spacing: float) -> tuple[_Spot, ...]:
    """One behind the other, the first ahead; the middle is the origin."""
    return tuple((y, x) for x, y in _line(count, spacing))


def _wedge(count: int, spacing: float) -> tuple[_Spot, ...]:
    """The first is at the origin, the others behind it by turns on the left arm and the right one."""
    back, aside = spacing * math.cos(_WEDGE), spacing * math.sin(_WEDGE)
    ranks = [((i + 1) // 2, 1 if i % 2 else -1) for i in range(count)]
    return tuple((0.0 - back * rank, aside * rank * side) for rank, side in ranks)


def _grid(count: int, spacing: float) -> tuple[_Spot, ...]:
    """Rows abreast, as many as make it nearly square, the front left first; the middle of each is over the origin."""
    width = math.ceil(math.sqrt(count))
    rows = [min(width, count - first) for first in range(0, count, width)]
    ranks = _column(len(rows), spacing)
    return tuple((x, y) for (x, _), abreast in zip(ranks, rows, strict=True) for _, y in _line(abreast, spacing))


def _random_spots(count: int, spacing: float, size: float, seed: int) -> tuple[_Spot, ...]:
    """Places drawn one by one in a square around the origin, none nearer than `spacing` to one before it.

    Fewer than `count` if `_TRIES` places in a row are too near others.
    """
    draw = random.Random(seed)
    found = np.empty((count, 2))
    for done in range(count):
        for _ in range(_TRIES):
            found[done] = x, y = [size * (draw.random() - 0.5) for _ in range(2)]
            if is_clear(found[:done], x, y, spacing):
                break
        else:
            found = found[:done]
            break
    return tuple((x, y) for x, y in found.tolist())


def is_clear(taken: FloatArray, x: float, y: float, distance: float) -> bool:
    """Whether no point (n, 2) is nearer to (x, y) than a distance [m]."""
    dx, dy = taken[:, 0] - x, taken[:, 1] - y
    return not np.any(dx * dx + dy * dy < distance * distance)


def headings(layout: Layout, places: Sequence[_Spot], seed: int = 0) -> tuple[float, ...]:
    """Heading of the boat at each place [rad]; outward from the origin, where a boat at the origin faces along x."""
    heading = layout.heading
    if heading is None and layout.layout == "random":
        draw = random.Random(f"headings {seed if layout.seed is None else layout.seed}")  # not the places' stream
        return tuple(2 * math.pi * draw.random() for _ in places)
    if heading is None and layout.layout != "circle":
        return (0.0,) * len(places)
    if isinstance(heading, float | int):
        return (yaw_of(heading, layout.headings),) * len(places)
    turn = {"outward": 0.0, "inward": math.pi, "tangent": math.pi / 2}[heading or "outward"]
    return tuple(math.atan2(y, x) + turn for x, y in places)


def yaw_of(heading: float, convention: Headings | None) -> float:
    """Yaw [rad] of a heading [degrees]."""
    return math.radians(90.0 - heading if convention == "compass" else heading)
