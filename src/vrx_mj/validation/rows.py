"""What a case of the report is, and what it finds: rows of a reference, our value and a band, and charts.

Tables and meshes of other programs and tanks, in `assets/validation`; each table names its source in its head.
"""

import csv
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsFloat

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.draw.chart import Chart
from vrx_mj.resources import root


def folder() -> Path:
    """Where the tables, meshes and worlds of the report are."""
    return root() / "assets" / "validation"


TableRow = dict[str, Any]
"""A row of a table by column: numbers and texts."""


def rows(name: str) -> list[TableRow]:
    """The rows of a table by column; what reads as a number is one."""
    with (folder() / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        found = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{column: _value(text) for column, text in row.items()} for row in found]


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def source(name: str) -> str:
    """The head of a table: what made it, and how."""
    text = (folder() / f"{name}.csv").read_text(encoding="utf-8")
    return " ".join(line.lstrip("# ").strip() for line in text.splitlines() if line.startswith("#"))


def mesh(name: str) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) [m] and triangles (m, 3) of a hull, counter-clockwise from outside."""
    lines = (folder() / "hulls" / f"{name}.off").read_text(encoding="utf-8").split("\n")
    count, faces, _ = (int(word) for word in lines[1].split())
    vertices = [[float(word) for word in line.split()] for line in lines[2 : 2 + count]]
    triangles = [[int(word) for word in line.split()[1:]] for line in lines[2 + count : 2 + count + faces]]
    return np.array(vertices, np.float64), np.array(triangles, np.int64)


_KNOWN = 0.002
"""Greatest distance from exact theory of a row that is known to be outside, as a share of it."""


@dataclass(frozen=True)
class Row:
    """One comparison."""

    quantity: str
    """What is compared."""
    unit: str
    """Unit of all its numbers; empty for ratios and counts."""
    reference: float | None
    """Value of the reference; None where the reference is a range."""
    ours: float
    """Our value."""
    low: float
    """Smallest value that is inside."""
    high: float
    """Largest value that is inside."""
    band: str
    """The band, in words."""
    theory: float | None = None
    """Value of exact theory, where the reference is another."""

    @property
    def inside(self) -> bool:
        """Whether our value is in the band; one that is not a number is not."""
        return self.low <= self.ours <= self.high

    @property
    def state(self) -> str:
        """`inside`, `outside`, or `known`: outside, where exact theory is outside, too, and within 0.2 % of it."""
        if self.inside or self.theory is None or self.low <= self.theory <= self.high:
            return "inside" if self.inside else "outside"
        return "known" if math.isclose(self.ours, self.theory, rel_tol=_KNOWN) else "outside"

    @property
    def difference(self) -> float:
        """Our value less the reference; of a range, how far our value is beyond it."""
        if self.reference is not None:
            return self.ours - self.reference
        return self.ours - min(max(self.ours, self.low), self.high) if math.isfinite(self.ours) else math.nan


def near(
    quantity: str,
    unit: str,
    reference: float,
    ours: SupportsFloat,
    *,
    relative: float = 0.0,
    absolute: float = 0.0,
) -> Row:
    """A row whose band is a share of the reference, or a distance from it in the row's unit."""
    reference = float(reference)
    half = max(relative * abs(reference), absolute)
    words = f"± {100.0 * relative:g} %" if relative else f"± {absolute:g} {unit}".rstrip()
    return Row(quantity, unit, reference, float(ours), reference - half, reference + half, words)


def between(quantity: str, unit: str, low: float, high: float, ours: SupportsFloat) -> Row:
    """A row whose reference is a range."""
    return Row(quantity, unit, None, float(ours), low, high, f"{low:g} to {high:g} {unit}".rstrip())


def at_most(quantity: str, unit: str, reference: float, ours: SupportsFloat) -> Row:
    """A row of a size, which the reference bounds."""
    return Row(quantity, unit, None, float(ours), 0.0, reference, f"0 to {reference:g} {unit}".rstrip())


def equal(quantity: str, unit: str, reference: float, ours: SupportsFloat) -> Row:
    """A row whose value must be the reference itself, as a count."""
    return Row(quantity, unit, float(reference), float(ours), reference, reference, "equal")


Outcome = Iterator[Row | Chart]
"""What a case finds: comparisons, and curves that show them."""


@dataclass(frozen=True)
class Case:
    """A case of the report, as a reader needs it to judge the numbers."""

    name: str
    """Name in `--only`."""
    title: str
    """Heading of the case."""
    setup: str
    """What is set up and measured."""
    source: str
    """Formula of the reference, and where it is from."""
    files: tuple[str, ...]
    """Files of the package that compute our value."""
    run: Callable[[], Outcome]
    """Carries it out."""
    quick: bool = True
    """Whether it is part of `--quick`."""


def case(*files: str, table: str = "", quick: bool = True) -> Callable[[Callable[[], Outcome]], Case]:
    """Make a case of a function that carries it out, and has its name.

    The function's docstring is for the report: the title, what is set up and measured, and after `Reference:` the
    formula of the reference and where it is from.

    Args:
        files: files of the package that compute our value.
        table: name of the reference's table, whose head names its source.
        quick: whether the case is part of `--quick`.
    """

    def make(run: Callable[[], Outcome]) -> Case:
        title, setup, *reference = (" ".join(part.split()) for part in (run.__doc__ or "").split("\n\n"))
        sources = [text.removeprefix("Reference: ") for text in reference]
        if table:
            sources.append(source(table))
        name = run.__name__.replace("_", "-")
        return Case(name, title.removesuffix("."), setup, " ".join(sources), files, run, quick)

    return make
