"""What each case of the validation report finds: the numbers that it found before."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

from fingerprints import check
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.errors import VrxError
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation import report
from vrx_mj.validation.case import EVIDENCE, Band, Case, Comparison
from vrx_mj.validation.cases import drifting, hulls, mean_forces, pressures, propellers, runs, waves, winds
from vrx_mj.validation.report import CASES, run_cases

QUICK = {
    "added-mass-impact", "barge-afloat", "barges", "beam-wind", "contacts", "froude-krylov", "heave-undamped",
    "hemisphere", "heron-speed", "hull-resistance", "mirrored", "otter-periods", "otter-surge", "otter-turn",
    "panels-doubled", "propeller-quadrants", "propeller-ventilation", "rudder-stream", "sea-record", "sea-spreading",
    "sphere-decay", "sphere-orbit", "sphere-tank", "sphere-theory", "step-halved", "vrx-seas", "wamv-bollard",
    "wind-profile", "wind-wander",
}  # fmt: skip
"""Cases that take half a second at most."""
LONG = ("response-amplitudes", "waves-adrift")
LAPSED = {
    "airy": {}, "stokes5": {}, "sea-energy": {}, "meshes": {}, "roll-damping": {}, "short-waves": {},
    "components-doubled": {}, "diffraction-headings": {}, "section-flume": {}, "propeller-lag": {},
    "propeller-speed": {}, "heron-lake": {}, "current-tide": {}, "mean-drift": {}, "towed-drift": {},
    "limits-said": {}, "calm-hour": {}, "same-bits": {}, "current-adrift": {}, "vrx-kept": {},
    "sphere-heave": {"_HEAVE": {3.0: (0.115, 0.118)}, "_RELATIVE": {4.4: 1.7}},
    "wind-gusts": {"_HOURS": 1.0, "_SAMPLE": 1.0, "_SEEDS": 2},
    "wave-pressure": {"_SAMPLES": 2, "_BOATS": pressures._BOATS[1:2]},
    "swell-adrift": {"_ADRIFT": drifting._ADRIFT[1:3]},
    "waves-adrift": {"_FREE": mean_forces._FREE[9:13:3], "_SEEDS": (0,), "_SPHERES": 2},
    "current-random": {"_RECORD": 60.0},
    "vrx-runs": {"_RUNS": ("zigzag_20", "turn_L100_R50")},
    "rough-treatment": {"_ROUGH": dict([*runs._ROUGH.items()][3:4])},
}  # fmt: skip
"""Cases in short, with what is left of their constants."""
SUBJECTS = drifting, hulls, mean_forces, pressures, propellers, runs, waves, winds


def check_case(case, name="", **parts):
    (result,) = run_cases([case])
    assert result.error == ""
    rows = [(row.reference, row.ours, row.theory) for row in result.rows]
    check("validation", name or case.name, rows=rows, charts=result.charts, **parts)
    return result


@pytest.fixture
def lapse(monkeypatch):
    """Runs of which each call makes one step, after which the time goes on to its end, and tables of two rows."""
    advance, step, rows, calls = Simulation.advance, Simulation.step, runs.rows, []

    def advance_once(sim, steps):
        calls.append(steps)
        advance(sim, min(steps, 1))
        sim.data.time += max(steps - 1, 0) * sim.timestep

    def note(sim, commands=None, *, duration=None):
        calls.append(commands)
        return step(sim, commands, duration=duration)

    def few(name):
        return rows(name)[: {"diffraction": None, "towed": 1}.get(name, 2)]

    monkeypatch.setattr(Simulation, "advance", advance_once)
    monkeypatch.setattr(Simulation, "step", note)
    for subject in SUBJECTS:
        if hasattr(subject, "rows"):
            monkeypatch.setattr(subject, "rows", few if subject is not runs else rows)
    return calls


@pytest.mark.parametrize("case", [case for case in CASES if case.name in LAPSED], ids=lambda case: case.name)
def test_a_case_in_short_finds_what_it_found(case, lapse, monkeypatch):
    """Its numbers say nothing of the water: they are those of all that a case sets, commands, reads and computes."""
    (subject,) = (one for one in SUBJECTS if hasattr(one, case.name.replace("-", "_")))
    for name, value in LAPSED[case.name].items():
        monkeypatch.setattr(subject, name, value)
    check_case(case, f"{case.name}, in short", calls=lapse)


@pytest.mark.parametrize("case", [case for case in CASES if case.name in QUICK], ids=lambda case: case.name)
def test_a_case_finds_what_it_found(case):
    check_case(case)


@pytest.mark.slow
@pytest.mark.nightly
def test_so_do_the_others():
    for case in CASES:
        if case.name not in {*QUICK, *LONG}:
            check_case(case)


@pytest.mark.slow
@pytest.mark.nightly
def test_so_do_those_that_take_longest():
    for case in CASES:
        if case.name in LONG:
            check_case(case)


JUDGED = (
    (100.0, 100.9, "1 %"), (100.0, 130.0, "1 %"), (0.0, 0.04, "0.05"), (None, 2.5, "1 to 3"), (None, 4.5, "1 to 3"),
    (-2.0, -2.03, "5 %"), (7.0, 7.0, "0"), (1.0, math.nan, "1 %"), (123456.0, 123457.0, "1 %"), (None, 0.5, "0 to 2"),
)  # fmt: skip
"""References, our values and bands."""


def judged():
    """Rows of all kinds of bands and states, and a chart."""
    for number, (reference, ours, width) in enumerate(JUDGED):
        band = Band(EVIDENCE[number % 5], width, "120 to 140" if reference == 100.0 else "", "it is known")
        yield Comparison(f"row {number}", "m", reference, ours, theory=1.5, band=band)
    yield Chart("a chart", "x", "y", [Series("ours", [0.0, 1.0], [0.0, 2.0])])


def failing():
    raise VrxError("no water")


def test_a_report_shows_what_it_showed(monkeypatch, tmp_path):
    """Its pages and its JSON, without the machine and the time that it took."""
    charts = []
    clock = itertools.count(0.0, 0.5)
    monkeypatch.setattr(report, "_machine", lambda: {"python": "3"})
    monkeypatch.setattr(report, "time", SimpleNamespace(monotonic=clock.__next__))
    monkeypatch.setitem(report._environment().globals, "chart", lambda chart: charts.append(chart) or "")
    cases = [Case(name, f"case {name}", "a tank", "a book", ("a.py",), run) for name, run in
             (("good", judged), ("bad", failing))]  # fmt: skip
    begun = []
    results = run_cases(cases, lambda number, case: begun.append((number, case.name)))
    assert report.write_report(tmp_path, results, cases[:1]) == tmp_path / "index.html"
    page, text = ((tmp_path / name).read_text(encoding="utf-8") for name in ("index.html", "results.json"))
    assert text.endswith("\n}\n")
    found = report.counts(results), report.evidence(results), [one.state for one in results], begun
    check("validation", "report", page=page.splitlines(), text=text.splitlines(), charts=charts, found=found)


def test_tracks_of_the_moored_sphere_are_taken_twenty_times_a_second(monkeypatch):
    asked = []
    sim = SimpleNamespace(set_object=lambda name, **how: asked.append((name, how)))
    found = np.arange(4.0) + 7.0, np.zeros((4, 2))
    monkeypatch.setattr(drifting, "record", lambda sim, _read, count, part: asked.append((count, part)) or found)
    times, places = drifting._track(sim, (3.0, 0.5), 40.0)
    assert (times.tolist(), places.shape) == ([0.0, 1.0, 2.0, 3.0], (4, 2))
    start = {"pose": (3.0, 0.5, -5.0, 0.0, 0.0, 0.0), "velocity": [0.0] * 6}
    assert asked == [("sphere", start), (800, 0.05)]


@pytest.mark.parametrize("case", [drifting.mooring_offset, drifting.mooring_period], ids=lambda case: case.name)
def test_a_moored_sphere_that_moves_by_theory_agrees_with_it(case, monkeypatch):
    """A damped spring along its rope, and a damped pendulum across it."""
    asked, moored = [], {"current": {"speed": 1.0}}

    def theory(sim, place, duration):
        asked.append((sim, place, duration))
        speed, mass, decay = sim["current"]["speed"], 1025.0 * math.pi / 6.0, 0.025
        far = 3.0 + 2.0 * decay * mass * speed / 200.0
        times = np.arange(0.0, duration, 0.05)
        omega = np.sqrt(np.array((200.0 / mass, 2.0 * decay * speed / far)) - decay**2)
        phases = times[:, None] * omega
        swings = np.exp(-decay * times)[:, None] * (np.cos(phases) + decay / omega * np.sin(phases))
        return times, (far, 0.0) + (place - np.array((far, 0.0))) * swings

    monkeypatch.setattr(drifting, "_track", theory)
    monkeypatch.setattr(drifting, "packaged_simulation", lambda world, **keys: {"name": world, **moored, **keys})
    result = check_case(case, f"{case.name}, in theory", calls=asked)
    assert [row.ours for row in result.rows] == pytest.approx([row.reference for row in result.rows], rel=1e-3)


@pytest.mark.parametrize("case", [mean_forces.moored_drift, mean_forces.towed_drift], ids=lambda case: case.name)
def test_a_spring_that_pulls_as_the_table_has_it_agrees_with_it(case, monkeypatch):
    asked = []
    monkeypatch.setattr(mean_forces, "_line_force", lambda *asking: asked.append(asking) or asking[-1])
    result = check_case(case, f"{case.name}, in theory", calls=asked)
    assert [row.ours for row in result.rows] == pytest.approx([row.reference for row in result.rows])


@pytest.mark.parametrize(("period", "decay"), [(2.0, 0.1), (5.0, 0.0)])
def test_swings_have_the_period_and_decay_of_their_closed_form(period, decay):
    times = np.arange(0.0, 40.0, 0.01)
    offs = np.exp(-decay * times) * np.cos(2.0 * np.pi / period * times + 0.3)
    found, ratio = drifting._swing(times, offs)
    assert (found, ratio) == (pytest.approx(period, rel=1e-5), pytest.approx(math.exp(-0.5 * decay * period), rel=1e-3))


def test_extremes_are_those_of_parabolas():
    times = np.arange(0.0, 6.0, 0.01)
    found = drifting._extremes(times, 3.0 + np.cos(2.0 * times - 0.5))
    expected = [(0.25 + number * np.pi / 2.0, 3.0 + (-1.0) ** number) for number in range(4)]
    assert np.array(found) == pytest.approx(np.array(expected), abs=1e-5)
