"""The report: its cases in order, and a user's own; results as JSON and as a page that needs no network."""

import json
import math
import platform
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np
from jinja2 import Environment
from numba.core import event

from vrx_mj.arguments import check_name
from vrx_mj.config.loading import referenced_file
from vrx_mj.config.measured import SIGNALS, MeasuredCaseConfig, Measurements, read_case, read_measurements
from vrx_mj.draw.chart import Chart, Series, chart_svg, page_environment
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.outputs import write_files
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import EVIDENCE, Band, Case, Comparison, Outcome, Row
from vrx_mj.validation.cases import drifting, hulls, mean_forces, pressures, propellers, runs, waves, winds

PAGE, RESULTS = "index.html", "results.json"
_NEEDED = ("mujoco", "numba", "numpy")
"""Packages whose versions the report names."""
_SUBJECTS = waves, hulls, pressures, propellers, drifting, mean_forces, winds, runs
CASES = tuple(each for subject in _SUBJECTS for each in vars(subject).values() if isinstance(each, Case))
"""All cases."""
_READINGS: dict[str, tuple[str, int | None]] = {
    "x": ("position", 0), "y": ("position", 1), "z": ("position", 2),
    "roll_deg": ("roll", None), "pitch_deg": ("pitch", None), "heading_deg": ("heading", None),
    "surge": ("velocity", 0), "sway": ("velocity", 1), "heave_speed": ("velocity", 2),
    "roll_rate_deg": ("angular_velocity", 0), "pitch_rate_deg": ("angular_velocity", 1),
    "yaw_rate_deg": ("angular_velocity", 2), "speed": ("speed", None),
}  # fmt: skip
"""Signals by name: what of a boat's observation each is, and which number of it, if there are several."""
_ANGLES = ("roll_deg", "pitch_deg", "heading_deg")
"""Signals that are the same after a full turn."""


@dataclass(frozen=True)
class Result:
    """Outcome of a case."""

    case: Case
    rows: tuple[Row, ...]
    """The comparisons; none where it failed."""
    charts: tuple[Chart, ...]
    """Curves that show them."""
    error: str
    """Why it failed; empty where it did not."""
    seconds: float
    """How long it took, without compiling [s]."""
    compiling: float
    """How long it took to compile the kernels that it is the first to need [s]."""

    @property
    def state(self) -> str:
        """`inside` if all rows are, `known` if the others are, `outside`, or `failed`."""
        states = {"failed"} if self.error else {row.state for row in self.rows}
        return next(state for state in ("failed", "outside", "known", "inside") if state in {*states, "inside"})


def run_cases(cases: Sequence[Case], begun: Callable[[int, Case], None] = lambda _number, _case: None) -> list[Result]:
    """Carry out cases one after the other; an error of one is its result."""
    results = []
    for number, case in enumerate(cases):
        begun(number, case)
        start = time.monotonic()
        with event.install_timer("numba:compile", lambda _seconds: None) as timer, warnings.catch_warnings():
            warnings.simplefilter("ignore", VrxWarning)  # a case may be of what is beyond the model
            try:
                found = [each.row(case.name) if isinstance(each, Comparison) else each for each in case.run()]
                error = ""
            except VrxError as failure:
                found, error = [], str(failure)
        compiling = timer.duration if timer.done else 0.0
        rows = tuple(each for each in found if isinstance(each, Row))
        charts = tuple(each for each in found if isinstance(each, Chart))
        results.append(Result(case, rows, charts, error, time.monotonic() - start - compiling, compiling))
    return results


def counts(results: Sequence[Result]) -> tuple[int, int, int]:
    """How many rows are inside, known to be outside, and there at all; a failed case counts as one that is outside."""
    states = ["failed" for result in results if result.error]
    states += [row.state for result in results for row in result.rows]
    return states.count("inside"), states.count("known"), len(states)


def evidence(results: Sequence[Result]) -> list[tuple[str, int, int]]:
    """Each kind of reference that there is, how many of its rows are inside, and how many there are."""
    rows = [row for result in results for row in result.rows]
    found = [(kind, [row.inside for row in rows if row.band.evidence == kind]) for kind in EVIDENCE]
    return [(kind, sum(inside), len(inside)) for kind, inside in found if inside]


def results_json(results: Sequence[Result]) -> dict[str, object]:
    """All rows with what they were made on. A number that is not finite is null."""
    inside, known, total = counts(results)
    cases = [_case_fields(result) for result in results]
    kinds = {kind: {"inside": within, "rows": count} for kind, within, count in evidence(results)}
    figures = {"inside": inside, "known": known, "rows": total, "evidence": kinds}
    return {**figures, "machine": _machine(), "cases": cases}


def _case_fields(result: Result) -> dict[str, object]:
    case, seconds, compiling = result.case, round(result.seconds, 2), round(result.compiling, 2)
    described = {name: getattr(case, name) for name in ("name", "title", "setup", "source", "files")}
    found = {"inside": result.state == "inside", "state": result.state, "error": result.error or None}
    rows = [_row_fields(row) for row in result.rows]
    return {**described, **found, "seconds": seconds, "compiling": compiling, "rows": rows}


def _row_fields(row: Row) -> dict[str, object]:
    plain = {name: getattr(row, name) for name in ("quantity", "unit", "reference", "ours", "theory", "low", "high")}
    judged = {"evidence": row.band.evidence, "band": row.band.words(row.unit), "use": row.use, "why": row.band.why}
    fields = {**plain, **judged, "difference": row.difference, "inside": row.inside, "state": row.state}
    infinite = {name: None for name, value in fields.items() if isinstance(value, float) and not math.isfinite(value)}
    return fields | infinite


def _machine() -> dict[str, str]:
    versions = {"vrx_mj": version("vrx-mj"), **{name: version(name) for name in _NEEDED}}
    return {**versions, "python": platform.python_version(), "platform": platform.platform()}


def page(results: Sequence[Result], left_out: Sequence[Case] = ()) -> str:
    """The report as HTML; `left_out` are cases that it does not have."""
    inside, known, total = counts(results)
    template = _environment().get_template("page.html.j2")
    facts = {"inside": inside, "known": known, "total": total, "evidence": evidence(results), "machine": _machine()}
    return template.render(results=results, left_out=left_out, **facts)


@cache
def _environment() -> Environment:
    environment = page_environment("validation")
    environment.filters |= {"figure": _figure, "signed": _difference}
    environment.globals |= {"chart": chart_svg, "bands": _bands}
    return environment


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
    if row.reference and row.band.width.endswith("%"):
        return f"{text} ({100.0 * row.difference / abs(row.reference):+.2g} %)"
    return text


def write_report(folder: Path, results: Sequence[Result], left_out: Sequence[Case] = ()) -> Path:
    """Write the page and `results.json` into a folder; the path of the page."""
    text = json.dumps(results_json(results), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    write_files(folder, {RESULTS: text, PAGE: page(results, left_out)}, "the report")
    return folder / PAGE


def select_cases(only: tuple[str, ...] = (), *, quick: bool = False) -> tuple[Case, ...]:
    """The cases of these names, or all; those of `--quick` if asked for.

    Raises:
        UnknownNameError: no case has a name.
    """
    known = [case.name for case in CASES]
    for name in only:
        check_name("case", name, known)
    return tuple(case for case in CASES if (case.name in only if only else case.quick or not quick))


def measured_case(case: Path, data: Path) -> Case:
    """The case of a YAML file and of the CSV with its measurements.

    Raises:
        VrxError: a file is wrong, or the world does not fit it.
    """
    config = read_case(case)
    measured = read_measurements(data, tuple(config.signals))
    fleet = None if config.fleet is None else referenced_file("fleets", config.fleet, config.folder)
    world = compile_world(referenced_file("worlds", config.world, config.folder), fleet=fleet)
    sim = Simulation(world)
    boat = _boat_of(sim, config)
    _check_commands(sim, boat, config)
    return Case(
        name=case.stem,
        title=config.title or case.stem,
        setup=f"World {config.world}{f', fleet {config.fleet}' if config.fleet else ''}, boat {boat}, as {case.name} "
        f"has it; {len(measured.times)} samples of {data.name}, up to {measured.times[-1]:g} s. Our values are those "
        "of the physics step nearest to each.",
        source=config.source,
        files=(),
        run=lambda: _comparisons(_signals_at(sim, boat, config, measured), config, measured),
    )


def _boat_of(sim: Simulation, config: MeasuredCaseConfig) -> str:
    if config.boat is None and len(sim.boats) != 1:
        raise VrxError(f"world {config.world} has {len(sim.boats)} boats: `boat` is needed")
    boat = sim.boats[0] if config.boat is None else config.boat
    check_name("boat", boat, sim.boats)
    return boat


def _check_commands(sim: Simulation, boat: str, config: MeasuredCaseConfig) -> None:
    known = sim.command_names(boat)
    for row in config.commands:
        for name in row.thrusters:
            check_name(f"command of boat '{boat}'", name, known)


def _signals_at(
    sim: Simulation, boat: str, config: MeasuredCaseConfig, measured: Measurements
) -> dict[str, list[float]]:
    """Our values of the signals at the times of the measurements."""
    sim.reset(seed=config.seed)
    if config.pose is not None or config.velocity is not None:
        sim.set_boat(boat, pose=config.pose, velocity=config.velocity)
    step = sim.timestep
    commands = {round(row.time / step): row.thrusters for row in config.commands}
    samples = [round(time / step) for time in measured.times]
    found: dict[str, list[float]] = {name: [] for name in config.signals}
    now, current = 0, commands.get(0, {})
    for sample in samples:
        for stop in sorted({at for at in commands if now < at <= sample} | {sample}):
            if stop > now:
                sim.step({boat: current}, duration=(stop - now) * step)
            now, current = stop, commands.get(stop, current)
        seen = sim.observe()[boat]
        for name, signal in config.signals.items():
            found[name].append(_signal(seen, signal.of or name))
    return found


def _signal(seen: BoatObservation, name: str) -> float:
    """A signal of a boat, in degrees if it is named so."""
    quantity, axis = _READINGS[name]
    value = getattr(seen, quantity)
    number = float(value if axis is None else value[axis])
    return math.degrees(number) if name.endswith("_deg") else number


def _comparisons(ours: dict[str, list[float]], config: MeasuredCaseConfig, measured: Measurements) -> Outcome:
    for name, signal in config.signals.items():
        of = signal.of or name
        theirs, own = np.array(measured.signals[name]), np.array(ours[name])
        apart = own - theirs
        if of in _ANGLES:
            apart = np.array([math.remainder(each, 360.0) for each in apart])
            own = theirs + apart
        known = np.isfinite(theirs)
        greatest = np.abs(apart[known]).max() if known.any() else math.nan
        band = Band(EVIDENCE[0], f"0 to {signal.band:g}")
        yield Comparison(f"{name}: greatest difference", SIGNALS[of], None, greatest, band=band)
        series = Series("measured", measured.times, theirs, reference=True), Series("ours", measured.times, own)
        yield Chart(name, "time [s]", f"{of} [{SIGNALS[of]}]", series)
