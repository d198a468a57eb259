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
MARKS = {**dict.fromkeys(QUICK, ()), **dict.fromkeys(LONG, (pytest.mark.slow, pytest.mark.nightly))}


@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.name, marks=MARKS.get(case.name, pytest.mark.slow)) for case in CASES]
)
def test_a_case_finds_what_it_found(case):
    (result,) = run_cases([case])
    assert result.error == ""
    check(
        "validation",
        case.name,
        rows=[(row.reference, row.ours, row.theory) for row in result.rows],
        charts=result.charts,
    )
