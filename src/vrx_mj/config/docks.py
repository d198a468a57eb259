"""Docks drawn with letters: `X` is a block, of 2 m by 2 m unless its dock says otherwise, and a blank is water.

In the dock's frame row i is at x = 2 i and column j at y = 2 j: +x points down the page, +y to the right.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vrx_mj.config.characters import find_lookalikes
from vrx_mj.config.loading import referenced
from vrx_mj.config.search import display
from vrx_mj.config.tree import Items
from vrx_mj.config.wording import shown
from vrx_mj.config.yaml_text import read_lines
from vrx_mj.errors import ConfigError, Problem

__all__ = ["Cell", "DockLayout", "dock_faults", "drawn", "is_drawing", "load_dock", "neighbours"]

Cell = tuple[int, int]
"""Row and column of a block, counted from 0."""

MAX_CELLS = 10_000
"""Most cells of a dock, blanks included."""

_MAX_FAULTS = 10
_HINTS = {"x": "type 'X'", "#": "comments are allowed only at the start of the file"}


@dataclass(frozen=True)
class DockLayout:
    """A dock's cells, as its text shows them."""

    rows: tuple[str, ...]
    """The text, `X` and blanks, no blanks at line ends and no blank lines at the end."""

    @property
    def cells(self) -> tuple[Cell, ...]:
        """(row, column) of every block, counted from 0, row by row."""
        return tuple((i, j) for i, row in enumerate(self.rows) for j, cell in enumerate(row) if cell == "X")


def neighbours(cell: Cell) -> tuple[Cell, ...]:
    """The four cells that share an edge with one."""
    i, j = cell
    return (i - 1, j), (i, j - 1), (i, j + 1), (i + 1, j)


def is_drawing(text: str) -> bool:
    """Whether a `layout` is a drawing and not the name or path of one."""
    return "\n" in text or not re.search("[^X ]", text)


def drawn(rows: Sequence[object]) -> tuple[str, list[tuple[int, str]]]:
    """The drawing of a list of rows, and what is wrong with its rows, each as (row, message); rows count from 0."""
    bare = _outside_quotes(rows)
    found = [(i, f"expected a row of X and blanks, in quotes, got {shown(row)}") for i, row in enumerate(rows)
             if not isinstance(row, str)]  # fmt: skip
    found += [(i, f"{bare[i]} columns to the right of other rows; put a row that begins with a blank in quotes")
              for i in sorted(bare)]  # fmt: skip
    if found:
        return "", found
    lines = [str(row) for row in rows]
    return "\n".join(lines) + "\n", [(row - 1, message) for row, _, message in dock_faults(lines)]


def _outside_quotes(rows: Sequence[object]) -> dict[int, int]:
    """Blanks before rows that YAML drops, by row: of rows without quotes that stand in lines of their own."""
    places = rows.places if isinstance(rows, Items) else ()
    if len({place.line for place in places}) < len(places) or None in {place.line for place in places}:
        return {}
    first = min((place.column or 0 for place in places), default=0)
    return {
        i: column - first
        for i, (file, line, column) in enumerate(places)
        if line and column and column > first and file.lines[line - 1][column - 1] not in "'\""
    }


def load_dock(text_or_name: str, near: Path | None = None) -> DockLayout:
    """The layout of an ASCII drawing, of a name in `docks`, or of a path relative to `near`."""
    if is_drawing(text_or_name):
        lines, name, above = text_or_name.split("\n"), "<dock>", 0
    else:
        file = referenced("docks", text_or_name, near)
        text, name = read_lines(file), display(file)
        above = next((i for i, line in enumerate(text) if not line.startswith("#")), len(text))
        lines = list(text[above:])  # a file may start with lines of comment
    found = dock_faults(lines)
    if found:
        raise ConfigError(Problem(name, above + row, column, "", message) for row, column, message in found)
    return DockLayout(_trimmed(lines))


def dock_faults(lines: Sequence[str]) -> list[tuple[int, int, str]]:
    """What is wrong with a drawing, each as (row, column, message); both count from 1."""
    rows = _trimmed(lines)
    if not any("X" in row for row in rows) and not any(row.strip() for row in rows):
        return [(1, 1, "a dock needs at least one X")]
    if len(rows) * max(map(len, rows)) > MAX_CELLS:
        return [(1, 1, f"{len(rows)} rows of up to {max(map(len, rows))} cells; at most {MAX_CELLS} cells")]
    found = {(odd.line, odd.column): odd.message for odd in find_lookalikes(rows, free_text=False)}
    for i, row in enumerate(rows, 1):
        hit = re.search("[^X ]", row)
        if hit and not any(line == i for line, _ in found):
            hint = _HINTS.get(hit[0], "only X and blank")
            found[i, hit.start() + 1] = f"{shown(hit[0])} in a dock; {hint}"
    return [(*place, f"row {place[0]}, column {place[1]}: {found[place]}") for place in sorted(found)][:_MAX_FAULTS]


def _trimmed(lines: Sequence[str]) -> tuple[str, ...]:
    rows = [line.rstrip(" ") for line in lines]
    while rows and not rows[-1]:
        rows.pop()
    return tuple(rows)
