"""What a case of the report is, and what it finds: comparisons of a reference and our value, and charts.

Tables and meshes of other programs and tanks are in `assets/validation`, each table with its source in its head. Worlds
of the cases have profile `marine`, and are calm and without wind or current unless given.
"""

import contextlib
import csv
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, SupportsFloat

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.draw.chart import Chart
from vrx_mj.errors import VrxError, ignore_warnings
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.packages import root
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.simulation import Simulation

EVIDENCE = ("measured", "independent program", "closed form", "own earlier run", "number of a file")
"""Kinds of references, from the strongest to the weakest."""
_KNOWN = 0.002
"""Greatest distance from exact theory of a row that is known to be outside, as a share of it."""
GRAVITY = 9.81
"""Gravity of these worlds [m/s2], the value of most of the references."""
PHYSICS = {"profile": "marine", "gravity": GRAVITY}
"""Key `physics` of these worlds."""


def folder() -> Path:
    """Where the tables, meshes and worlds of the report are."""
    return root() / "assets" / "validation"


TableRow = dict[str, Any]
"""A row of a table by column: numbers and texts."""


def rows(name: str) -> list[TableRow]:
    """The rows of a table by column; what reads as a number is one."""
    return [{column: _value(text) for column, text in row.items()} for row in _texts(name)]


def _texts(name: str) -> list[dict[str, str]]:
    """The rows of a table by column, as they are written."""
    with (folder() / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader((line for line in file if not line.startswith("#")), restval=""))


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


@dataclass(frozen=True)
class Band:
    """Kind of a reference, and the band in which our value has to be."""

    evidence: str
    """One of `EVIDENCE`."""
    width: str
    """`1 %` of the reference to either side, `0.05` of the row's unit to either side, or the range `0.7 to 0.8`."""
    known: str = ""
    """Range outside the band in which our value is known to be, if it is."""
    why: str = ""
    """Why it is."""

    def limits(self, reference: float | None) -> tuple[float, float]:
        """Smallest and largest value that is inside, in the row's unit."""
        low, _, high = self.width.partition(" to ")
        if high:
            return float(low), float(high)
        assert reference is not None
        share = self.width.removesuffix(" %")
        half = float(share) if share == self.width else float(share) * abs(reference) / 100.0
        return reference - half, reference + half

    def words(self, unit: str) -> str:
        """The band for readers."""
        if self.width == "0":
            return "equal"
        text = self.width if self.width.endswith("%") else f"{self.width} {unit}".rstrip()
        return text if " to " in text else f"± {text}"


@cache
def bands() -> Mapping[tuple[str, str], Band]:
    """The bands of all rows of the report by case and quantity, from `assets/validation/bands.csv`."""
    columns = "evidence", "band", "known", "why"
    return {(row["case"], row["quantity"]): Band(*(row[column] for column in columns)) for row in _texts("bands")}


@dataclass(frozen=True)
class Row:
    """One comparison in the report."""

    quantity: str
    """Quantity that is compared."""
    unit: str
    """Unit of all its numbers; empty for ratios and counts."""
    reference: float | None
    """Value of the reference; None where the reference is a range."""
    ours: float
    """Our value."""
    band: Band
    """Kind of reference, and how near is near enough."""
    theory: float | None = None
    """Value of exact theory, where the reference is another."""

    @property
    def low(self) -> float:
        """Smallest value that is inside."""
        return self.band.limits(self.reference)[0]

    @property
    def high(self) -> float:
        """Largest value that is inside."""
        return self.band.limits(self.reference)[1]

    @property
    def inside(self) -> bool:
        """Whether our value is in the band; one that is not a number is not."""
        return self.low <= self.ours <= self.high

    @property
    def state(self) -> str:
        """`inside`, `outside`, or `known`: outside where `bands.csv` says so, or within 0.2 % of theory that is."""
        if self.inside:
            return "inside"
        if self.band.known:
            low, high = Band("", self.band.known).limits(None)
            return "known" if low <= self.ours <= high else "outside"
        if self.theory is None or self.low <= self.theory <= self.high:
            return "outside"
        return "known" if math.isclose(self.ours, self.theory, rel_tol=_KNOWN) else "outside"

    @property
    def difference(self) -> float:
        """Our value less the reference; of a range, how far our value is beyond it."""
        if self.reference is not None:
            return self.ours - self.reference
        return self.ours - min(max(self.ours, self.low), self.high) if math.isfinite(self.ours) else math.nan

    @property
    def use(self) -> float | None:
        """Share of the band that the difference takes; None where the band is a range, or equality."""
        half = 0.5 * (self.high - self.low)
        if self.reference is None:
            return self.ours / self.high if self.low == 0.0 else None
        return abs(self.difference) / half if half else None


@dataclass(frozen=True)
class Comparison:
    """Result of a case for one quantity."""

    quantity: str
    """Quantity that is compared, as `bands.csv` names it."""
    unit: str
    """Unit of all its numbers; empty for ratios and counts."""
    reference: SupportsFloat | None
    """Value of the reference; None where the band is a range."""
    ours: SupportsFloat
    """Our value."""
    theory: float | None = None
    """Value of exact theory, where the reference is another."""
    band: Band | None = None
    """The band, where `bands.csv` does not have it."""

    def row(self, case: str) -> Row:
        """The row of a case; VrxError: it has no band."""
        band = self.band or bands().get((case, self.quantity))
        if band is None:
            raise VrxError(f"assets/validation/bands.csv: no band for {self.quantity!r} of case {case}")
        reference = None if self.reference is None else float(self.reference)
        return Row(self.quantity, self.unit, reference, float(self.ours), band, self.theory)


Outcome = Iterator[Comparison | Chart]
"""Findings of a case: comparisons, and curves that show them."""


@dataclass(frozen=True)
class Case:
    """A case of the report, as a reader needs it to judge the numbers."""

    name: str
    """Name in `--only`."""
    title: str
    """Heading of the case."""
    setup: str
    """Description of what is set up and measured."""
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


def marine_world(fleet: Mapping[str, object] | None = None, **keys: object) -> World:
    """A world of profile `marine`; keys are those of a world's file."""
    given = {"name": "tank", "physics": PHYSICS, "sea": {"model": "none"}, "wind": {"objects": []}, **keys}
    return compile_world(given, fleet=fleet)


def marine_simulation(fleet: Mapping[str, object] | None = None, **keys: object) -> Simulation:
    """A run in such a world."""
    return Simulation(marine_world(fleet, **keys))


def packaged_simulation(name: str, **keys: object) -> Simulation:
    """A run in a world of `assets/validation/worlds`, with other keys of a world's file; what is unusual is meant."""
    with ignore_warnings(), contextlib.chdir(folder() / "worlds"):
        return Simulation(compile_world({"extends": f"./{name}.yaml", "name": name, **keys}))


def unit(degrees: float) -> FloatArray:
    """The unit vector (2,) in a direction [degrees], counter-clockwise from x."""
    return np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])


def one_boat(robot: str, heading: float = 0.0, **keys: object) -> dict[str, object]:
    """A fleet of one boat of a robot at the origin with a heading [rad]; keys are those of a fleet's file."""
    return {"robot": robot, "boats": [{"name": "a", "pose": [0.0, 0.0, 0.0, 0.0, 0.0, heading]}], **keys}


def with_boat_at(sim: Simulation, pose: Sequence[float], velocity: Sequence[float] | None = None) -> Simulation:
    """A run whose only boat is let go in a pose, at rest unless it has a velocity."""
    sim.set_boat(sim.boats[0], pose=pose, velocity=velocity)
    return sim


def only_boat(sim: Simulation) -> BoatObservation:
    """The only boat of a run, now."""
    return sim.observe()[sim.boats[0]]


def record(
    sim: Simulation, read: Callable[[Simulation], npt.ArrayLike], count: int, part: float, **commands: float
) -> tuple[FloatArray, FloatArray]:
    """Times (count + 1,) [s], and what is read then: now, and after each of `count` steps of `part` [s].

    The commands are those of the only boat.
    """
    given = {sim.boats[0]: commands} if commands else {}
    times, values = [sim.time], [np.array(read(sim), np.float64)]
    for _ in range(count):
        sim.step(given, duration=part)
        times.append(sim.time)
        values.append(np.array(read(sim), np.float64))
    return np.array(times), np.array(values)


def autocorrelation(off: FloatArray, lags: IntArray) -> tuple[float, list[float]]:
    """The variance of a record without a mean, and its correlation with itself some samples later."""
    variance = float((off**2).mean())
    return variance, [float((off[lag:] * off[: len(off) - lag]).mean()) / variance for lag in lags]
