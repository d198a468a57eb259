"""The report: what the cases have found, as JSON and as a page that needs no network."""

import json
import math
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jinja2 import Environment

from vrx_mj.draw.chart import Chart, Series, chart_svg
from vrx_mj.draw.page import page_environment
from vrx_mj.errors import VrxError
from vrx_mj.outputs import write_files
from vrx_mj.validation.rows import Case, Findings, Row

__all__ = ["PAGE", "RESULTS", "Result", "counts", "page", "results_json", "run_cases", "write_report"]

PAGE, RESULTS = "index.html", "results.json"
NEEDED = ("mujoco", "numba", "numpy")
"""Packages whose versions the report names."""


@dataclass(frozen=True)
class Result:
    """What became of a case."""

    case: Case
    findings: Findings
    """Its rows and charts; none where it failed."""
    error: str
    """Why it failed; empty where it did not."""
    seconds: float
    """How long it took [s]."""

    @property
    def inside(self) -> bool:
        """Whether it came to an end with all rows inside."""
        return not self.error and all(row.inside for row in self.findings.rows)


def run_cases(cases: Sequence[Case], begun: Callable[[int, Case], None] = lambda _number, _case: None) -> list[Result]:
    """Carry out cases one after the other; an error of one is its result."""
    results = []
    for number, case in enumerate(cases):
        begun(number, case)
        start = time.monotonic()
        try:
            findings, error = case.run(), ""
        except VrxError as failure:
            findings, error = Findings(()), str(failure)
        results.append(Result(case, findings, error, time.monotonic() - start))
    return results


def counts(results: Sequence[Result]) -> tuple[int, int]:
    """How many rows are inside, and how many there are; a case that failed counts as one that is outside."""
    rows = [row for result in results for row in result.findings.rows]
    return sum(row.inside for row in rows), len(rows) + sum(bool(result.error) for result in results)


def results_json(results: Sequence[Result]) -> dict[str, Any]:
    """All rows with what they were made on. A number that is not finite is null."""
    inside, total = counts(results)
    return {
        "inside": inside,
        "rows": total,
        "machine": _machine(),
        "cases": [
            {
                "name": result.case.name,
                "title": result.case.title,
                "setup": result.case.setup,
                "source": result.case.source,
                "files": list(result.case.files),
                "inside": result.inside,
                "error": result.error or None,
                "seconds": round(result.seconds, 2),
                "rows": [_fields(row) for row in result.findings.rows],
            }
            for result in results
        ],
    }


def _fields(row: Row) -> dict[str, Any]:
    return {
        "quantity": row.quantity,
        "unit": row.unit,
        "reference": _number(row.reference),
        "ours": _number(row.ours),
        "difference": _number(row.difference),
        "low": _number(row.low),
        "high": _number(row.high),
        "band": row.band,
        "inside": row.inside,
    }


def _number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else value


def _machine() -> dict[str, str]:
    versions = {name: version(name) for name in NEEDED}
    return {
        "vrx_mj": version("vrx-mj"),
        **versions,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def page(results: Sequence[Result], left_out: Sequence[Case] = ()) -> str:
    """The report as HTML; `left_out` are cases that it does not have."""
    inside, total = counts(results)
    return (
        _environment()
        .get_template("page.html.j2")
        .render(results=results, left_out=left_out, inside=inside, total=total, machine=_machine())
    )


@cache
def _environment() -> Environment:
    environment = page_environment("validation")
    environment.filters |= {"figure": _figure, "signed": _difference}
    environment.globals |= {"chart": chart_svg, "charts": _charts}
    return environment


def _charts(result: Result) -> tuple[Chart, ...]:
    """The charts of a case; if it has none, where its rows lie in their bands."""
    return result.findings.charts or (_bands(result.findings.rows),)


def _bands(rows: Sequence[Row]) -> Chart:
    """Rows from the middle of their bands: at 1 and -1 are the limits."""
    places = [(row.ours - 0.5 * (row.low + row.high)) / (0.5 * (row.high - row.low) or 1.0) for row in rows]
    numbers, shown = list(range(1, len(rows) + 1)), [min(max(place, -3.0), 3.0) for place in places]
    ends = [0.5, len(rows) + 0.5]
    limits = (Series(label, ends, [place] * 2, reference=True) for label, place in (("limits", 1.0), ("", -1.0)))
    points = Series("rows", numbers, shown, kind="points")
    return Chart("Place of each row in its band", "row of the table", "distance / half the band", (*limits, points))


def _figure(value: float | None) -> str:
    """A number with six digits, those before the point all; a dash for none."""
    if value is None or math.isnan(value):
        return "–"
    return f"{value:,.0f}" if 1e5 <= abs(value) < 1e12 else f"{value:,.6g}"


def _difference(row: Row) -> str:
    """The difference, with its share of the reference where that says more."""
    if math.isnan(row.difference):
        return "–"
    text = f"{row.difference:+.3g}" if row.difference else "0"
    if row.reference and "%" in row.band:
        return f"{text} ({100.0 * row.difference / abs(row.reference):+.2g} %)"
    return text


def write_report(folder: Path, results: Sequence[Result], left_out: Sequence[Case] = ()) -> Path:
    """Write the page and `results.json` into a folder; the path of the page."""
    text = json.dumps(results_json(results), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    write_files(folder, {RESULTS: text, PAGE: page(results, left_out)}, "the report")
    return folder / PAGE
