"""The report's rows, all of them, are inside their bands or known to be outside, and use them."""

import pytest

from vrx_mj.validation.case import bands
from vrx_mj.validation.report import CASES, run_cases

ROUNDING = 1e-8
"""Bands that are narrower than this share are those of rounding, of which no share has to be used."""


@pytest.mark.slow
@pytest.mark.nightly
def test_the_report_is_inside_its_bands_and_they_are_no_wider_than_they_must_be():
    results = run_cases(CASES)
    assert {result.case.name: result.error for result in results if result.error} == {}
    rows = {(result.case.name, row.quantity): row for result in results for row in result.rows}
    assert set(rows) == set(bands())
    assert {key: row.ours for key, row in rows.items() if row.state == "outside"} == {}
    wide = [key for key, row in rows.items() if row.use is not None and row.use < 0.01 and _half(row) > ROUNDING]
    assert [key for key in wide if rows[key].band.evidence != "own earlier run"] == []


def _half(row):
    """Half of the band, as a share of the reference where there is one."""
    return 0.5 * (row.high - row.low) / max(abs(row.reference or 0.0), 1.0)
