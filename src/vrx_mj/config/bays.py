"""Bays of docks: where a drawing has them, and what a file gives for them, their placards and their holes.

All places are in the dock's frame [m]: x down the page, y to the right, z up from the water.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Annotated, Literal, get_args

from pydantic import BeforeValidator, Field

from vrx_mj.config.base import Config, Only
from vrx_mj.config.shapes import Size
from vrx_mj.config.values import COLORS, Name, NotEmpty, Pose, Vec3, demand, numbers, several
from vrx_mj.frames import apply, rotation

Cell = tuple[int, int]
"""Row and column of a block, counted from 0."""

_ColorName = Literal["red", "green", "blue", "yellow"]
LIGHT_COLORS: tuple[str, ...] = get_args(_ColorName)
OFF: Literal["off"] = "off"
_ShapeName = Literal["circle", "cross", "triangle", "rectangle"]
SHAPES: tuple[_ShapeName, ...] = get_args(_ShapeName)
RGB = {color: COLORS[color] for color in LIGHT_COLORS} | {OFF: COLORS["black"]}
"""Red, green and blue of the colours of lights and symbols, 0 to 1."""
LIGHT_PATTERNS = tuple((i, j, k) for i, j, k in product(LIGHT_COLORS, repeat=3) if j not in {i, k})
"""The 36 patterns that shuffling goes through: no colour twice in a row."""
SYMBOLS = tuple(f"{color}_{shape}" for color, shape in product(("blue", "green", "red", "yellow"), SHAPES))
"""The 16 symbols that shuffling goes through; a placard shows the first unless another is set."""


_OF_SYMBOLS = f"COLOUR_SHAPE of {', '.join(LIGHT_COLORS)} and {', '.join(SHAPES)}"
Symbol = Annotated[str, demand(SYMBOLS.__contains__, f"expected a symbol {_OF_SYMBOLS}, got {{}}")]
"""Symbol of a placard, such as `red_circle`."""
LightColor = Annotated[
    Literal["red", "green", "blue", "yellow", "off"], BeforeValidator(lambda value: OFF if value is False else value)
]
Colors = Annotated[tuple[_ColorName, _ColorName, _ColorName], several(f"three colours of {', '.join(LIGHT_COLORS)}", 3)]
"""Colours of a light buoy in their order, as a task has them."""
Pattern = Annotated[tuple[LightColor, LightColor, LightColor], several("three of red, green, blue, yellow and off", 3)]


class LightConfig(Config):
    """Panels that light up together: a second each of three colours, then two seconds dark, and again."""

    panels: Annotated[tuple[Name, ...], NotEmpty]
    """Names of the visuals that are the panels."""
    pattern: Pattern = (OFF, OFF, OFF)
    """The colours until a task or a user gives others."""


_Board = Literal["placard", "placard_2022"]
"""Objects that placards are made of."""
_FIRST_SYMBOL = SYMBOLS[0]
"""Symbol of a placard at the start."""

MOUTH_GAP = 2.5
"""Distance from a bay's mouth to the middle of the zone outside [m]; VRX: dock_2022."""
_ZONE_DEPTH = 1.5
"""Length of the zone outside, along the way out [m]; VRX: dock_2018, dock_2022."""
_ZONE_SPILL = 1.5
"""Width of the zone outside beyond that of the bay [m]; VRX: dock_2022."""
_BOAT_WIDTH = 2.5
"""Width of the zone inside short of that of the bay [m]: a WAM-V's width, as in VRX's dock_2022."""
_ZONE_HEIGHT, _ZONE_CENTER = 2.0, 0.25
"""Height of zones and of their middle over the dock's origin [m]; VRX: dock_2022."""
_BOARD_SETBACK = 0.95
"""Distance from a bay's inner end to the middle of its board [m], at most half a block; VRX: dock_2022."""
_BOARD_CENTER = 1.75
"""Height of a board's middle over the dock's origin [m]; VRX: dock_2016, dock_2022."""
_SYMBOLS_ON = {"placard": (0.07, 2.25), "placard_2022": (0.27, 1.5)}
"""How far before the middle of a board, and how high over the dock's origin, its symbol is [m]; VRX's static docks."""
_Hole = tuple[Literal["big", "small"], float, tuple[float, float, float]]
_HOLES: tuple[_Hole, ...] = (("big", -0.6, (0.5, 0.5, 0.5)), ("small", 0.6, (0.25, 0.5, 0.25)))
"""Holes of a `placard_2022`: size, x in its frame and the box that detects a ball [m]; VRX: scan_dock_deliver.xacro."""
_HOLE_HEIGHT = 1.08
"""Height of the holes over the middle of the board [m]."""


class Box(Config):
    """A box along the dock's axes."""

    center: Vec3
    """Centre [m]."""
    size: Size
    """Edges along x, y and z [m]."""


class BayConfig(Config):
    """A bay. Its zones come from the drawing's bay of the same number, unless both are given."""

    name: Name | None = None
    """Name of the bay; by default bay1, bay2 and so on."""
    symbol: Annotated[Symbol | None, Only("placard", ("placard", "placard_2022"))] = None
    """Symbol of its placard at the start; by default a blue circle."""
    placard: Literal["placard", "placard_2022", "none"] = "placard"
    """A board of 2 by 3 m, the one of 2022 with two holes, or none. Not used where the dock lists its `placards`."""
    internal: Box | None = None
    """Zone in which the boat's origin has to stay."""
    external: Box | None = None
    """Zone through which the boat has to leave."""


class PlacardConfig(Config):
    """A board with a symbol on it, at a place of its own."""

    name: Name
    """Name of the placard, which nothing else in the world has."""
    model: _Board = "placard"
    """The board of 2019, 2 by 3 m, or that of 2022, which has two holes."""
    pose: Pose
    """Pose of the board in the dock's frame [m, rad]."""
    symbol_pose: Pose
    """Pose of the symbol in the dock's frame [m, rad]."""
    symbol: Symbol = _FIRST_SYMBOL
    """Symbol at the start."""
    shapes: Annotated[tuple[_ShapeName, ...], NotEmpty] = SHAPES
    """Shapes that it can show; any other shows nothing."""
    block: Annotated[tuple[int, int], numbers("row column")] | None = None
    """Block of a dynamic dock that carries it, counted from 0; by default the nearest."""


class HoleConfig(Config):
    """A hole for a ball."""

    bay: Annotated[int, Field(ge=1)]
    """Number of the bay, from 1."""
    size: Literal["big", "small"]
    """Size of the hole, one of VRX's two; a task gives points by it."""
    center: Vec3
    """Centre of the hole in the dock's frame [m]."""
    box: Size
    """Edges of the box in which a ball is in the hole [m]."""


@dataclass(frozen=True)
class Bay:
    """A bay of a drawing: a rectangle of water with blocks on three sides."""

    first: Cell
    """Row and column of its corner with the least of both, from 0."""
    last: Cell
    """Cell of the opposite corner."""
    opens: tuple[int, int]
    """Toward which neighbour its mouth is: (-1, 0), (1, 0), (0, -1) or (0, 1), as rows and columns, thus as x and y."""

    def zones(self, block: float) -> tuple[Box, Box]:
        """The zones inside and outside the bay of a dock with blocks of edge `block` [m].

        In proportion to VRX's dock_2022, whose bays are 4 m wide and 6 m deep: inside, the boat's origin has the middle
        of the bay from 1/12 of its depth to 3/4; outside, a strip 1.5 m deep whose middle is 2.5 m from the mouth.
        """
        depth, width = self._depth_and_width(block)
        inner = max(width - _BOAT_WIDTH, 0.375 * width)
        internal = self._zone(block, -5.0 / 12.0 * depth, 2.0 / 3.0 * depth, inner)
        return internal, self._zone(block, MOUTH_GAP, _ZONE_DEPTH, width + _ZONE_SPILL)

    def board(self, block: float, name: str, model: _Board) -> PlacardConfig:
        """The board at the inner end of the bay, which faces out of it."""
        depth, _ = self._depth_and_width(block)
        dx, dy = self.opens
        x, y = self._on_axis(block, -depth - min(_BOARD_SETBACK, block / 2.0))
        before, height = _SYMBOLS_ON[model]
        yaw = math.atan2(dx, -dy)
        return PlacardConfig(
            name=name,
            model=model,
            pose=(x, y, _BOARD_CENTER, 0.0, 0.0, yaw),
            symbol_pose=(x + before * dx, y + before * dy, height, 0.0, 0.0, yaw),
        )

    def _depth_and_width(self, block: float) -> tuple[float, float]:
        """Depth and width [m]."""
        rows, columns = self.last[0] - self.first[0] + 1, self.last[1] - self.first[1] + 1
        depth, width = (rows, columns) if self.opens[0] else (columns, rows)
        return depth * block, width * block

    def _on_axis(self, block: float, out: float) -> tuple[float, float]:
        """Point on the bay's axis, x and y [m], `out` [m] beyond its mouth."""
        depth, _ = self._depth_and_width(block)
        x, y = (block * (a + b) / 2.0 for a, b in zip(self.first, self.last, strict=True))
        distance = depth / 2.0 + out
        return x + distance * self.opens[0], y + distance * self.opens[1]

    def _zone(self, block: float, out: float, depth: float, width: float) -> Box:
        """A box of a depth and width [m] on the axis of the bay, its middle `out` [m] beyond the mouth."""
        x, y = self._on_axis(block, out)
        size = (depth, width, _ZONE_HEIGHT) if self.opens[0] else (width, depth, _ZONE_HEIGHT)
        return Box(center=(x, y, _ZONE_CENTER), size=size)


def find_bays(cells: Iterable[Cell]) -> tuple[Bay, ...]:
    """The bays of a dock's blocks: open to one side, straight through to open water. In reading order."""
    blocks = frozenset(cells)
    found = [bay for opens in ((-1, 0), (1, 0), (0, -1), (0, 1)) for bay in _bays_toward(blocks, opens)]
    return tuple(sorted(found, key=lambda bay: (bay.first, bay.opens)))


def _bays_toward(blocks: frozenset[Cell], opens: Cell) -> Iterator[Bay]:
    """Bays that open one way, found with rows that count inward and columns across."""
    (di, dj), (pi, pj) = opens, (abs(opens[1]), abs(opens[0]))
    turned = sorted((-i * di - j * dj, i * pi + j * pj) for i, j in blocks)
    there = frozenset(turned)
    gaps = {(row, left, right) for (row, left), (same, right) in pairwise(turned) if row == same and left + 1 < right}
    for row, left, right in gaps:
        inside = range(left + 1, right)
        if any((row + 1, column) not in there for column in inside):
            continue
        outer = row
        while (outer - 1, left, right) in gaps:
            outer -= 1
        if not any(near < outer and column in inside for near, column in turned):
            corners = [(-u * di + v * pi, -u * dj + v * pj) for u in (outer, row) for v in (left + 1, right - 1)]
            yield Bay(min(corners), max(corners), opens)


def board_holes(bay: int, placard: PlacardConfig) -> Iterator[HoleConfig]:
    """The holes in the board of a bay, counted from 1: a `placard_2022` has two."""
    turn = rotation(*placard.pose[3:])
    for size, x, box in _HOLES if placard.model == "placard_2022" else ():
        px, py, pz = (a + b for a, b in zip(placard.pose, apply(turn, (x, 0.0, _HOLE_HEIGHT)), strict=False))
        ex, ey, ez = (abs(edge) for edge in apply(turn, box))
        yield HoleConfig(bay=bay, size=size, center=(px, py, pz), box=(ex, ey, ez))
