"""What each case of the validation report finds: the numbers that it found before."""

import pytest

from fingerprints import check
from vrx_mj.validation.report import CASES, run_cases

QUICK = {
    "barge-afloat", "barges", "beam-wind", "contacts", "froude-krylov", "hemisphere", "heron-speed", "hull-resistance",
    "mirrored", "otter-periods", "otter-surge", "otter-turn", "panels-doubled", "propeller-quadrants",
    "propeller-ventilation", "rudder-stream", "sea-record", "sea-spreading", "sphere-decay", "sphere-orbit",
    "step-halved", "wamv-bollard", "wind-profile", "wind-wander",
}  # fmt: skip
"""Cases that take a tenth of a second at most."""
LONG = ("response-amplitudes", "waves-adrift")


def check_case(case):
    (result,) = run_cases([case])
    assert result.error == ""
    rows = [(row.reference, row.ours, row.theory) for row in result.rows]
    check("validation", case.name, rows=rows, charts=result.charts)


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
