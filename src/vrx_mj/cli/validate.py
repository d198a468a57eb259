"""`vrx-mj validate`: the physics against closed forms, other programs and tanks."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrx_mj.bar import Bar
from vrx_mj.cli.options import Folder
from vrx_mj.cli.screen import print_table, show
from vrx_mj.errors import CommandError

if TYPE_CHECKING:
    from vrx_mj.validation.report import Result


def validate(
    only: Annotated[
        list[str] | None, typer.Option(metavar="<case>", help="Run only this case; may be repeated.")
    ] = None,
    case: Annotated[Path | None, typer.Option(help="Your own case (YAML), with --data.")] = None,
    data: Annotated[Path | None, typer.Option(help="Your measurements (CSV).")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Run only what takes a minute in all, once compiled.")] = False,
    output: Folder = Path("report"),
) -> None:
    """Compare the physics with closed forms, other programs and tanks. Write a page with a plot and a table for each.

    A row is inside if our value lies in its band, and known if it is outside where exact theory is, too, and equal to
    that. The exit code is 0 if all rows are inside or known, 1 if any is outside.
    With --case and --data it compares a boat of yours with what you have measured; docs/validation.md has the keys.

    Example: vrx-mj validate --quick -o report
    """
    from vrx_mj.validation.report import counts, run_cases, write_report
    from vrx_mj.validation.table import CASES, select_cases

    if (case is None) != (data is None):
        raise CommandError("--case and --data belong together: the case, and what was measured")
    cases = select_cases(tuple(only or ()), quick=quick)
    if case is not None and data is not None:
        from vrx_mj.validation.measured import measured_case

        cases = (measured_case(case, data), *(cases if only or quick else ()))
    with Bar("validating", len(cases), "cases") as bar:
        results = run_cases(cases, lambda number, begun: bar.update(number, begun.name))
    page = write_report(output, results, [each for each in CASES if each not in cases])
    _print(results)
    typer.echo(f"page: {page}")
    inside, known, total = counts(results)
    typer.echo(f"{inside} of {total} inside" + f", {known} known to be outside" * bool(known))
    if inside + known < total:
        raise SystemExit(1)


def _print(results: "Sequence[Result]") -> None:
    """A line for each case, and the rows that are outside."""
    from rich.text import Text

    texts = []
    for result in results:
        rows = result.rows
        count = "failed" if result.error else f"{sum(row.inside for row in rows)} of {len(rows)}"
        style = "red" if result.state in {"failed", "outside"} else ""
        texts.append((result.case.name, Text(count, style=style), f"{result.seconds:.1f} s"))
    print_table("vrx-mj validate", ("case",), ("inside", "time"), texts)
    seconds, compiling = (sum(getattr(result, name) for result in results) for name in ("seconds", "compiling"))
    show(f"{seconds:.0f} s" + f", and {compiling:.0f} s to compile, once" * (compiling >= 1.0), result=True)
    for result in results:
        for line in _faults(result):
            show(line, None if line.startswith("known") else "red", result=True)


def _faults(result: "Result") -> list[str]:
    if result.error:
        return [f"{result.case.name} failed: {result.error}"]
    return [
        f"{row.state}: {result.case.name}: {row.quantity} is {row.ours:.6g} {row.unit}, "
        f"the band is {row.low:.6g} to {row.high:.6g}"
        for row in result.rows
        if not row.inside
    ]
