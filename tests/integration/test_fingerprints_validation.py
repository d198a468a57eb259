"""What each case of the validation report finds: the numbers that it found before."""

import pytest

from fingerprints import check
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.cases import drifting, hulls, mean_forces, pressures, propellers, runs, waves, winds
from vrx_mj.validation.report import CASES, run_cases

QUICK = {
    "barge-afloat", "barges", "beam-wind", "contacts", "froude-krylov", "hemisphere", "heron-speed", "hull-resistance",
    "mirrored", "otter-periods", "otter-surge", "otter-turn", "panels-doubled", "propeller-quadrants",
    "propeller-ventilation", "rudder-stream", "sea-record", "sea-spreading", "sphere-decay", "sphere-orbit",
    "step-halved", "wamv-bollard", "wind-profile", "wind-wander",
}  # fmt: skip
"""Cases that take a tenth of a second at most."""
LONG = ("response-amplitudes", "waves-adrift")
LAPSED = {
    "airy": {}, "stokes5": {}, "sea-energy": {}, "meshes": {}, "roll-damping": {}, "short-waves": {},
    "components-doubled": {}, "diffraction-headings": {}, "section-flume": {}, "propeller-lag": {},
    "propeller-speed": {}, "heron-lake": {}, "current-tide": {}, "mean-drift": {}, "towed-drift": {},
    "limits-said": {}, "calm-hour": {}, "same-bits": {},
    "wave-pressure": {"_SAMPLES": 2, "_BOATS": pressures._BOATS[1:2]},
    "swell-adrift": {"_ADRIFT": drifting._ADRIFT[1:3]},
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
        for name in {"rows", "table_rows"} & vars(subject).keys():
            monkeypatch.setattr(subject, name, few if subject is not runs else rows)
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
