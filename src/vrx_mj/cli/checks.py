"""Commands that check physics: `vrx-mj trial`, manoeuvring trials of a boat, and `vrx-mj validate`, the report."""

import json
import math
from collections.abc import Sequence
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option, echo

from vrx_mj.arguments import check_name
from vrx_mj.bar import Bar
from vrx_mj.cli.options import Folder, above_zero
from vrx_mj.cli.screen import print_table, show
from vrx_mj.errors import CommandError, warn
from vrx_mj.outputs import write_files

if TYPE_CHECKING:
    from vrx_mj.trials import Trial
    from vrx_mj.validation.report import Result


CALM: dict[str, Any] = {"name": "calm", "physics": {"profile": "marine"}, "sea": {"model": "none"}}
"""The world of a trial by default: still water without wind, in profile `marine`."""
_Helm = Annotated[
    float | None,
    Option(help="Fraction of full helm, at most 35 degrees; default: 1, in a zigzag 0.5.", callback=above_zero(1.0)),
]
_Amount = Annotated[
    float | None,
    Option(
        help="Initial displacement of a decay; default: heave 0.1 m, at most half the mean draft, roll 10 degrees, "
        "pitch 5 degrees.",
        callback=above_zero(180.0),
    ),
]
_Power = Annotated[float | None, Option(help="Power of the approach, 0 to 1; default 1.", callback=above_zero(1.0))]
_Angle = Annotated[float | None, Option(help="Heading of a zigzag [degrees]; default 20.", callback=above_zero(90.0))]


def trial(
    name: Annotated[
        str, Argument(metavar="TRIAL", help="One of turning, zigzag, crash-stop, pull-out, spiral, decay.")
    ],
    boat: Annotated[str, Argument(metavar="BOAT", help="The robot: a name, or the path of its file.")],
    output: Folder = Path(),
    world: Annotated[str | None, Option(help="World; default: still water of profile marine.")] = None,
    power: _Power = None,
    helm: _Helm = None,
    angle: _Angle = None,
    mode: Annotated[str | None, Option(help="Mode of a decay: heave, roll or pitch; default roll.")] = None,
    amount: _Amount = None,
) -> None:
    """Run a manoeuvring trial of a boat as ITTC and IMO define it. Write its figures as JSON, with a chart.

    The helm turns rudders or engines by up to 35 degrees; a boat with neither turns by less thrust on the inner side.

    Example: vrx-mj trial turning skiff
    """
    from vrx_mj.mjcf.compile import compile_world
    from vrx_mj.runtime.simulation import Simulation
    from vrx_mj.trials import TRIALS, SimulatedVessel

    check_name("trial", name, TRIALS)
    arguments = _arguments(name, {"power": power, "helm": helm, "angle": angle, "mode": mode, "amount": amount})
    fleet = {"usv_count": 1, "robot": boat, "sensors": "none"}
    sim = Simulation(compile_world(CALM if world is None else world, fleet=fleet))
    done = TRIALS[name](SimulatedVessel(sim, sim.boats[0]), **arguments)
    files = [output / f"{name}.json", output / f"{name}.svg"]
    texts = (_json(done, boat, world), _svg(done, boat))
    write_files(output, {file.name: text for file, text in zip(files, texts, strict=True)}, "the trial")
    for remark in done.remarks:
        warn(f"{name}: {remark}")
    width = max(map(len, done.figures))
    for key, figure in done.figures.items():
        value = "-" if math.isnan(figure.value) else f"{figure.value:.4g}"
        echo(f"{key:<{width}}  {value:>9} {figure.unit:<6} {figure.meaning}")
    echo(f"{files[0]}, {files[1]}")


def _arguments(name: str, given: dict[str, Any]) -> dict[str, Any]:
    """Arguments of a trial's function; CommandError where one is not its own."""
    from vrx_mj.trials import TRIALS

    arguments = {key: value for key, value in given.items() if value is not None}
    for key in arguments:
        trials = [each for each, function in TRIALS.items() if key in signature(function).parameters]
        if name not in trials:
            raise CommandError(f"--{key} is not for {name}, but for {', '.join(trials)}")
    if "amount" in arguments and arguments.get("mode") != "heave":
        arguments["amount"] = math.radians(arguments["amount"])
    return arguments


def _json(done: "Trial", boat: str, world: str | None) -> str:
    """The figures, and the track every state."""
    figures = {
        key: {"value": None if math.isnan(each.value) else each.value, "unit": each.unit, "meaning": each.meaning}
        for key, each in done.figures.items()
    }
    track = {key: [round(float(value), 6) for value in values] for key, values in vars(done.track).items()}
    tree = {"trial": done.name, "boat": boat, "world": world or "calm", "figures": figures, "remarks": done.remarks}
    return json.dumps(tree | {"track": track}, indent=1, allow_nan=False) + "\n"


def _svg(done: "Trial", boat: str) -> str:
    from vrx_mj.draw.chart import Chart, Series, chart_svg

    series = tuple(Series(label, x, y) for label, (x, y) in done.curves.items())
    return str(chart_svg(Chart(f"{done.name}, {boat}", *done.axes, series, equal=done.name == "turning"))) + "\n"


def validate(
    only: Annotated[list[str] | None, Option(metavar="<case>", help="Run only this case; may be repeated.")] = None,
    case: Annotated[Path | None, Option(help="Your own case (YAML), with --data.")] = None,
    data: Annotated[Path | None, Option(help="Your measurements (CSV).")] = None,
    quick: Annotated[
        bool, Option("--quick", help="Run only cases that together take a minute, once compiled.")
    ] = False,
    output: Folder = Path("report"),
) -> None:
    """Compare the physics with closed forms, other programs and tank tests. Write a page of plots and tables.

    A row is inside if our value lies in its band. It is known if it is outside but equals exact theory, which is
    outside too. The exit code is 0 if all rows are inside or known, 1 if any is outside.
    With --case and --data it compares your boat with your measurements; docs/validation.md has the keys.

    Example: vrx-mj validate --quick -o report
    """
    from vrx_mj.validation.report import CASES, counts, evidence, run_cases, select_cases, write_report

    if (case is None) != (data is None):
        raise CommandError("--case and --data are needed together: the case, and its measurements")
    cases = select_cases(tuple(only or ()), quick=quick)
    if case is not None and data is not None:
        from vrx_mj.validation.report import measured_case

        cases = (measured_case(case, data), *(cases if only or quick else ()))
    with Bar("validating", len(cases), "cases") as bar:
        results = run_cases(cases, lambda number, begun: bar.update(number, begun.name))
    page = write_report(output, results, [each for each in CASES if each not in cases])
    _print(results)
    echo(f"page: {page}")
    inside, known, total = counts(results)
    kinds = "; ".join(f"{kind} {within} of {count}" for kind, within, count in evidence(results))
    echo(f"{inside} of {total} inside" + f", {known} known to be outside" * bool(known) + f": {kinds}" * bool(kinds))
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
    echo(f"{seconds:.0f} s" + f", and {compiling:.0f} s to compile, once" * (compiling >= 1.0))
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
