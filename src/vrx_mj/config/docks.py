"""Docks drawn with letters, and their bays with placards and holes.

`X` is a block, 2 m by 2 m unless the dock has another `block`; a blank is water. In the dock's frame row i is at x = 2
i and column j at y = 2 j [m]: +x points down the page, +y to the right, +z up from the water.
"""

import contextlib
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, pairwise, product
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, get_args

from pydantic import AfterValidator, BeforeValidator, Field

from vrx_mj.config.base import Config, Fault, Faults, InFolder, Only, duplicate_names, faults
from vrx_mj.config.loading import loads, referenced_file
from vrx_mj.config.search import display
from vrx_mj.config.shapes import Size
from vrx_mj.config.tree import Items, fault, literal, one_of
from vrx_mj.config.values import (
    COLORS,
    Name,
    NotEmpty,
    Number,
    NumberOf,
    Pose,
    Switch,
    Vec3,
    demand,
    numbers,
    several,
)
from vrx_mj.config.yaml_text import find_lookalikes, read_lines
from vrx_mj.errors import ConfigError, Problem, VrxError
from vrx_mj.frames import IDENTITY, Vector, apply, rotation
from vrx_mj.model.things import Mooring

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
_HOLE_HEIGHT = 1.08
"""Height of the holes over the middle of the board [m]."""
_BLOCKS = (0.5, 1.0, 1.5, 2.0)
"""Edges of blocks [m]: VRX's dock_block, 2x2, 3x3 and 4x4."""
_MAX_CELLS = 10_000
"""Most cells of a dock, blanks included."""
_MAX_FAULTS = 10
_HINTS = {"x": "type 'X'", "#": "comments are allowed only at the start of the file"}
_MAX_BLOCKS = 200
"""Most blocks of a dynamic dock."""
_EDGES = one_of([f"{edge:g}" for edge in _BLOCKS])


class LightConfig(Config):
    """Panels that light up together: three colours for one second each, then two seconds dark, repeatedly."""

    panels: Annotated[tuple[Name, ...], NotEmpty]
    """Names of the visuals that are the panels."""
    pattern: Pattern = (OFF, OFF, OFF)
    """The colours until a task or a user sets others."""


_Board = Literal["placard", "placard_2022"]
"""Objects that placards are made of."""

_Hole = tuple[Literal["big", "small"], float, Vector]
_HOLES: tuple[_Hole, ...] = (("big", -0.6, (0.5, 0.5, 0.5)), ("small", 0.6, (0.25, 0.5, 0.25)))
"""Holes of a `placard_2022`: size, x in its frame and the box that detects a ball [m]; VRX: scan_dock_deliver.xacro."""


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
    """A board of 2 by 3 m, that of 2022 with two holes, or none. Ignored if the dock lists its `placards`."""
    internal: Box | None = None
    """Zone in which the boat's origin must stay."""
    external: Box | None = None
    """Zone through which the boat must leave."""


class PlacardConfig(Config):
    """A board with a symbol, at its own pose."""

    name: Name
    """Name of the placard, unique in the world."""
    model: _Board = "placard"
    """The board of 2019, 2 by 3 m, or that of 2022, which has two holes."""
    pose: Pose
    """Pose of the board in the dock's frame [m, rad]."""
    symbol_pose: Pose
    """Pose of the symbol in the dock's frame [m, rad]."""
    symbol: Symbol = _FIRST_SYMBOL
    """Symbol at the start."""
    shapes: Annotated[tuple[_ShapeName, ...], NotEmpty] = SHAPES
    """Shapes that it can show; for any other shape it stays blank."""
    block: Annotated[tuple[int, int], numbers("row column")] | None = None
    """Block of a dynamic dock that carries it, counted from 0; by default the nearest one."""


class HoleConfig(Config):
    """A hole for a ball."""

    bay: Annotated[int, Field(ge=1)]
    """Number of the bay, from 1."""
    size: Literal["big", "small"]
    """Size of the hole, one of VRX's two. The points of a task depend on it."""
    center: Vec3
    """Centre of the hole in the dock's frame [m]."""
    box: Size
    """Edges of the box [m] in which a ball counts as in the hole."""


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


def neighbours(cell: Cell) -> tuple[Cell, ...]:
    """The four cells that share an edge with one."""
    i, j = cell
    return (i - 1, j), (i, j - 1), (i, j + 1), (i + 1, j)


def _is_drawing(text: str) -> bool:
    """Whether a `layout` is a drawing and not the name or path of one."""
    return "\n" in text or not re.search("[^X ]", text)


def _outside_quotes(rows: Sequence[object]) -> dict[int, int]:
    """Blanks before rows that YAML drops, by row: of unquoted rows on lines of their own."""
    places = rows.places if isinstance(rows, Items) else ()
    if len({place.line for place in places}) < len(places) or None in {place.line for place in places}:
        return {}
    first = min((place.column or 0 for place in places), default=0)
    return {
        i: column - first
        for i, (file, line, column) in enumerate(places)
        if line and column and column > first and file.lines[line - 1][column - 1] not in "'\""
    }


def load_dock(text_or_name: str, near: Path | None = None) -> tuple[Cell, ...]:
    """Row and column of every block, counted from 0 and row by row.

    They are those of an ASCII drawing, of a name in `docks`, or of a path relative to `near`.
    """
    if _is_drawing(text_or_name):
        lines, name, above = text_or_name.split("\n"), "<dock>", 0
    else:
        file = referenced_file("docks", text_or_name, near)
        text, name = read_lines(file), display(file)
        above = next((i for i, line in enumerate(text) if not line.startswith("#")), len(text))
        lines = list(text[above:])  # a file may start with lines of comment
    found = _dock_faults(lines)
    if found:
        raise ConfigError(Problem(name, above + row, column, "", message) for row, column, message in found)
    return tuple((i, j) for i, row in enumerate(lines) for j, cell in enumerate(row) if cell == "X")


def _dock_faults(lines: Sequence[str]) -> list[tuple[int, int, str]]:
    """Mistakes in a drawing, each as (row, column, message); both count from 1."""
    rows = [line.rstrip(" ") for line in "\n".join(lines).rstrip(" \n").split("\n")]
    if not any(map(str.strip, rows)):
        return [(1, 1, "a dock needs at least one X")]
    if len(rows) * max(map(len, rows)) > _MAX_CELLS:
        return [(1, 1, f"{len(rows)} rows of up to {max(map(len, rows))} cells; at most {_MAX_CELLS} cells")]
    found = {(odd.line or 0, odd.column or 0): odd.message for odd in find_lookalikes(rows, free_text=False)}
    for i, row in enumerate(rows, 1):
        hit = re.search("[^X ]", row)
        if hit and not any(line == i for line, _ in found):
            hint = _HINTS.get(hit[0], "use only X and space")
            found[i, hit.start() + 1] = f"{literal(hit[0])} in a dock; {hint}"
    return [(*place, f"row {place[0]}, column {place[1]}: {found[place]}") for place in sorted(found)][:_MAX_FAULTS]


class PosedEntry(InFolder):
    """Something with a name and a pose, in a world or as part of a composite object."""

    name: Name
    """Name, unique in the world."""
    pose: Pose = IDENTITY
    """Pose in the world, or in the object of which this is a part [m, rad]."""


def _drawing(value: object) -> object:
    """Turn a list of rows into the block of text that it means."""
    if isinstance(value, list | tuple):
        bare = _outside_quotes(value)
        found: list[Fault] = [((i,), f"expected a row of X and spaces, in quotes, got {literal(row)}")
                              for i, row in enumerate(value) if not isinstance(row, str)]  # fmt: skip
        found += [((i,), f"{bare[i]} columns right of the other rows; put a row that begins with a space in quotes")
                  for i in sorted(bare)]  # fmt: skip
        if found:
            raise faults(*found)
        return "\n".join(value) + "\n"
    if not isinstance(value, str):
        raise fault(
            f"expected a drawing (`|` and rows of X and spaces, or a list of rows), name or path, got {literal(value)}"
        )
    return value


def _check_drawing(value: str) -> str:
    if _is_drawing(value) and (found := _dock_faults(value.split("\n"))):
        raise faults(*(((), fault(message, row=row, column=column)) for row, column, message in found))
    return value


_Drawing = Annotated[str, BeforeValidator(_drawing), AfterValidator(_check_drawing), loads(load_dock)]
"""A dock's drawing, or what names one."""
_Block = Annotated[Number, demand(_BLOCKS.__contains__, f"a block is {_EDGES} m long, got {{}}")]


class MooringConfig(Config):
    """Mooring lines of a dynamic dock: a horizontal spring and damper at each of its four corners."""

    stiffness: Annotated[float, NumberOf(Mooring, "stiffness")] = 2000.0
    damping: Annotated[float, NumberOf(Mooring, "damping")] = 2000.0


class DockPlacement(PosedEntry):
    """A dock at a pose."""

    layout: _Drawing
    """A drawing, as a block of text `|` or a list of rows; a name from `docks`; or the path of a text file."""
    dynamic: Switch = False
    """Whether it floats. Its blocks are then connected by hinges."""
    block: _Block = 2.0
    """Edge of a block [m]: a block is 1 x 1 to 4 x 4 cubes of 0.5 m."""
    mooring: Annotated[MooringConfig | None, Only("dynamic", (True,))] = None
    """Mooring lines of a dynamic dock; without them it drifts."""
    bays: tuple[BayConfig, ...] | None = None
    """Keys of the first bays, or of all. Without this key a dock has all bays of its drawing, but no placards."""
    placards: tuple[PlacardConfig, ...] | None = None
    """Placards of the bays in their order; by default one at the inner end of each bay of `bays`."""
    holes: tuple[HoleConfig, ...] | None = None
    """Holes for balls; by default those of the placards."""
    symbols: tuple[Symbol, ...] = ()
    """Symbols that the placards show at the start, in the order of the placards."""

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """Row and column of every block, counted from 0."""
        return load_dock(self.layout, self.folder)

    def _faults(self) -> Faults:
        with contextlib.suppress(VrxError):  # what is wrong with the drawing is reported with it
            yield from _geometry_faults(self)


class BayVolume(NamedTuple):
    """A bay of a dock, in the dock's frame [m]."""

    name: str
    internal: Box
    external: Box
    placard: str | None
    """Name of its placard."""


class DockGeometry(NamedTuple):
    """All that a task wants to know of a dock."""

    bays: tuple[BayVolume, ...]
    placards: tuple[PlacardConfig, ...]
    holes: tuple[HoleConfig, ...]


def dock_geometry(dock: DockPlacement) -> DockGeometry:
    """Bays, placards and holes of a dock; `_geometry_faults` has found nothing."""
    found = find_bays(dock.cells)
    placards = _placards(dock, found)
    bays = [
        BayVolume(
            bay.name or f"bay{number}",
            bay.internal or found[number - 1].zones(dock.block)[0],
            bay.external or found[number - 1].zones(dock.block)[1],
            placards[number].name if number in placards else None,
        )
        for number, bay in enumerate(dock.bays if dock.bays is not None else [BayConfig()] * len(found), 1)
    ]
    holes = chain.from_iterable(board_holes(number, placard) for number, placard in placards.items())
    return DockGeometry(tuple(bays), tuple(placards.values()), dock.holes if dock.holes is not None else tuple(holes))


def _geometry_faults(dock: DockPlacement) -> Faults:
    """Mistakes in a dock, as (path from the dock, message)."""
    found = find_bays(dock.cells)
    yield from list(_bay_faults(dock, len(found))) or _placard_faults(dock, found)
    if dock.dynamic and len(dock.cells) > _MAX_BLOCKS:
        yield ("dynamic",), f"{len(dock.cells)} blocks; a floating dock has at most {_MAX_BLOCKS}"
    elif dock.dynamic and (apart := _apart(dock.cells)):
        row, column = apart[0] + 1, apart[1] + 1
        text = f"the block in row {row}, column {column} is not connected to the first one"
        yield ("dynamic",), f"{text}; the blocks of a floating dock must join edge to edge"


def _placards(dock: DockPlacement, found: Sequence[Bay]) -> dict[int, PlacardConfig]:
    """The placards by the number of their bay, from 1."""
    if dock.placards is not None:
        placards = dict(enumerate(dock.placards, 1))
    else:
        placards = {
            number: place.board(dock.block, f"{dock.name}_placard{number}", bay.placard)
            for number, (bay, place) in enumerate(zip(dock.bays or (), found, strict=False), 1)
            if bay.placard != "none"
        }
    symbols = {number: bay.symbol for number, bay in enumerate(dock.bays or (), 1) if bay.symbol}
    symbols.update(zip(placards, dock.symbols, strict=False))
    return {
        number: placard.model_copy(update={"symbol": symbols.get(number, placard.symbol)})
        for number, placard in placards.items()
    }


def _bay_faults(dock: DockPlacement, found: int) -> Faults:
    has = f"the drawing has {found} bay{'s' * (found != 1)}"
    bays = list(enumerate(dock.bays or ()))
    for index, bay in bays[found:]:
        if bay.internal is None or bay.external is None:
            yield ("bays", index), f"{has}; each further bay needs `internal` and `external`"
        elif dock.placards is None and bay.placard != "none":
            yield ("bays", index), f"{has}; each further bay needs `placard: none`, or the dock needs `placards`"
    yield from duplicate_names(bays=(bay.model_copy(update={"name": bay.name or f"bay{i + 1}"}) for i, bay in bays))


def _placard_faults(dock: DockPlacement, found: Sequence[Bay]) -> Faults:
    count = len(_placards(dock, found))
    if len(dock.symbols) > count:
        yield ("symbols",), f"{len(dock.symbols)} symbols; this dock has {count} placard{'s' * (count != 1)}"
    for index, placard in enumerate(dock.placards or ()):
        if placard.block is not None and not dock.dynamic:
            yield ("placards", index, "block"), "not allowed for `dynamic: false`; allowed for true"
        elif placard.block is not None and placard.block not in dock.cells:
            row, column = placard.block
            yield ("placards", index, "block"), f"no block in row {row}, column {column}, both counted from 0"
    yield from duplicate_names(placards=dock.placards or ())
    bays = len(found if dock.bays is None else dock.bays)
    for index, hole in enumerate(dock.holes or ()):
        if hole.bay > bays:
            yield ("holes", index, "bay"), f"this dock has {bays} bay{'s' * (bays != 1)}, got {hole.bay}"


def _apart(cells: Sequence[Cell]) -> Cell | None:
    """The first block that no way over shared edges joins with the first of all."""
    reached, fresh = {cells[0]}, [cells[0]]
    while fresh:
        fresh = list({near for cell in fresh for near in neighbours(cell)} & set(cells) - reached)
        reached |= set(fresh)
    return next((cell for cell in cells if cell not in reached), None)
