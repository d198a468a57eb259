"""Docks drawn with letters: `X` is a block, of 2 m by 2 m unless its dock has another `block`, and a blank is water.

In the dock's frame row i is at x = 2 i and column j at y = 2 j: +x points down the page, +y to the right.
"""

import contextlib
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, BeforeValidator

from vrx_mj.config.base import Config, Fault, InFolder, Only, duplicate_names, fault, faults
from vrx_mj.config.bays import Bay, BayConfig, Box, Cell, HoleConfig, PlacardConfig, Symbol, board_holes, find_bays
from vrx_mj.config.loading import loads, referenced_file
from vrx_mj.config.search import display
from vrx_mj.config.tree import Items
from vrx_mj.config.values import Name, NonNegative, Number, Pose, Switch, demand
from vrx_mj.config.wording import literal, one_of
from vrx_mj.config.yaml_text import find_lookalikes, read_lines
from vrx_mj.errors import ConfigError, Problem, VrxError

_BLOCKS = (0.5, 1.0, 1.5, 2.0)
"""Edges of blocks [m]: VRX's dock_block, 2x2, 3x3 and 4x4."""
_MAX_CELLS = 10_000
"""Most cells of a dock, blanks included."""

_MAX_FAULTS = 10
_HINTS = {"x": "type 'X'", "#": "comments are allowed only at the start of the file"}


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
            hint = _HINTS.get(hit[0], "only X and blank")
            found[i, hit.start() + 1] = f"{literal(hit[0])} in a dock; {hint}"
    return [(*place, f"row {place[0]}, column {place[1]}: {found[place]}") for place in sorted(found)][:_MAX_FAULTS]


_MAX_BLOCKS = 200
"""Most blocks of a dynamic dock."""


class Placed(InFolder):
    """Something with a name of its own, somewhere: in a world, or as part of a composite object."""

    name: Name
    """Name in the world; nothing else has it."""
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Pose in the world, or in the object that this is a part of [m, rad]."""


def _drawing(value: object) -> object:
    """Turn a list of rows into the block of text that it means."""
    if isinstance(value, list | tuple):
        bare = _outside_quotes(value)
        found: list[Fault] = [((i,), f"expected a row of X and blanks, in quotes, got {literal(row)}")
                              for i, row in enumerate(value) if not isinstance(row, str)]  # fmt: skip
        found += [((i,), f"{bare[i]} columns to the right of other rows; put a row that begins with a blank in quotes")
                  for i in sorted(bare)]  # fmt: skip
        if found:
            raise faults(*found)
        return "\n".join(value) + "\n"
    if not isinstance(value, str):
        raise fault(
            f"expected a drawing (`|` and rows of X and blanks, or a list of rows), name or path, got {literal(value)}"
        )
    return value


def _check_drawing(value: str) -> str:
    if _is_drawing(value) and (found := _dock_faults(value.split("\n"))):
        raise faults(*(((), fault(message, row=row, column=column)) for row, column, message in found))
    return value


_Drawing = Annotated[str, BeforeValidator(_drawing), AfterValidator(_check_drawing), loads(load_dock)]
"""A dock's drawing, or what names one."""
_EDGES = one_of([f"{edge:g}" for edge in _BLOCKS])
_Block = Annotated[Number, demand(_BLOCKS.__contains__, f"a block is {_EDGES} m long, got {{}}")]


class MooringConfig(Config):
    """Lines that hold a dynamic dock: a spring and a damper along the water at each of its four corners."""

    stiffness: NonNegative = 2000.0
    """Stiffness of one line [N/m]."""
    damping: NonNegative = 2000.0
    """Damping of one line [N s/m]."""


class DockPlacement(Placed):
    """A dock somewhere."""

    layout: _Drawing
    """A drawing, as a block of text `|` or a list of rows; a name from `docks`; or the path of a text file."""
    dynamic: Switch = False
    """Whether it floats: its blocks hang together by hinges."""
    block: _Block = 2.0
    """Edge of a block [m]: 1 x 1 to 4 x 4 cubes of 0.5 m."""
    mooring: Annotated[MooringConfig | None, Only("dynamic", (True,))] = None
    """Lines that hold a dynamic dock; without them it drifts."""
    bays: tuple[BayConfig, ...] | None = None
    """Keys of the first bays, or of all. Without it a dock has all bays of its drawing, and no placards."""
    placards: tuple[PlacardConfig, ...] | None = None
    """Placards of the bays in their order; by default one at the inner end of each bay of `bays`."""
    holes: tuple[HoleConfig, ...] | None = None
    """Holes for balls; by default those of the placards."""
    symbols: tuple[Symbol, ...] = ()
    """Symbols that the placards show at the start, in their order."""

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """Row and column of every block, counted from 0."""
        return load_dock(self.layout, self.folder)

    def _faults(self) -> Iterator[Fault]:
        with contextlib.suppress(VrxError):  # what is wrong with the drawing is reported with it
            yield from _berth_faults(self)


class Berth(NamedTuple):
    """A bay of a dock, in the dock's frame [m]."""

    name: str
    internal: Box
    external: Box
    placard: str | None
    """Name of its placard."""


class Berths(NamedTuple):
    """All that a task wants to know of a dock."""

    bays: tuple[Berth, ...]
    placards: tuple[PlacardConfig, ...]
    holes: tuple[HoleConfig, ...]


def berths(dock: DockPlacement) -> Berths:
    """Bays, placards and holes of a dock; `_berth_faults` has found nothing."""
    found = find_bays(dock.cells)
    placards = _placards(dock, found)
    bays = [
        Berth(
            bay.name or f"bay{number}",
            bay.internal or found[number - 1].zones(dock.block)[0],
            bay.external or found[number - 1].zones(dock.block)[1],
            placards[number].name if number in placards else None,
        )
        for number, bay in enumerate(dock.bays if dock.bays is not None else [BayConfig()] * len(found), 1)
    ]
    holes = chain.from_iterable(board_holes(number, placard) for number, placard in placards.items())
    return Berths(tuple(bays), tuple(placards.values()), dock.holes if dock.holes is not None else tuple(holes))


def _berth_faults(dock: DockPlacement) -> Iterator[Fault]:
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


def _bay_faults(dock: DockPlacement, found: int) -> Iterator[Fault]:
    has = f"the drawing has {found} bay{'s' * (found != 1)}"
    bays = list(enumerate(dock.bays or ()))
    for index, bay in bays[found:]:
        if bay.internal is None or bay.external is None:
            yield ("bays", index), f"{has}; a further bay needs `internal` and `external`"
        elif dock.placards is None and bay.placard != "none":
            yield ("bays", index), f"{has}; a further bay needs `placard: none`, or the dock `placards`"
    yield from duplicate_names(bays=(bay.model_copy(update={"name": bay.name or f"bay{i + 1}"}) for i, bay in bays))


def _placard_faults(dock: DockPlacement, found: Sequence[Bay]) -> Iterator[Fault]:
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
