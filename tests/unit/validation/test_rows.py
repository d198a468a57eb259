"""Rows of the report: bands, differences, and what is inside."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vrx_mj.validation.rows import at_most, between, equal, near


@pytest.mark.parametrize(
    ("ours", "inside"), [(99.0, True), (101.0, True), (98.99, False), (101.01, False), (math.nan, False)]
)
def test_a_band_is_a_share_of_its_reference(ours, inside):
    row = near("force", "N", 100.0, ours, relative=0.01)
    assert row.inside is inside
    assert row.band == "± 1 %"
    assert math.isnan(row.difference) if math.isnan(ours) else row.difference == pytest.approx(ours - 100.0)


def test_a_negative_reference_has_a_band_too():
    row = near("trough", "m", -2.0, -2.01, relative=0.01)
    assert (row.low, row.high) == pytest.approx((-2.02, -1.98))
    assert row.inside


def test_numbers_of_numpy_become_plain():
    row = near("force", "N", np.float64(2.0), np.float64(2.0), relative=0.01)
    assert {type(value) for value in (row.reference, row.ours, row.low, row.high)} == {float}
    assert row.inside is True


def test_a_band_may_be_a_distance():
    row = near("place", "m", 0.0, 2e-3, absolute=1e-3)
    assert not row.inside
    assert row.band == "± 0.001 m"


@pytest.mark.parametrize(
    ("ours", "theory", "state"),
    [
        (1.5, None, "inside"),
        (1.5, 4.0, "inside"),
        (4.0, None, "outside"),
        (4.007, 4.0, "known"),
        (4.009, 4.0, "outside"),  # farther than 0.2 % from what theory says
        (2.001, 2.0, "outside"),  # theory is inside
        (math.nan, 4.0, "outside"),
    ],
)
def test_a_row_is_known_to_be_outside_where_exact_theory_is_too(ours, theory, state):
    assert replace(between("height", "m", 1.0, 2.0, ours), theory=theory).state == state


@pytest.mark.parametrize(("ours", "difference", "inside"), [(2.0, 0.0, True), (0.5, -0.5, False), (3.25, 0.25, False)])
def test_a_range_has_no_one_reference(ours, difference, inside):
    row = between("time", "s", 1.0, 3.0, ours)
    assert (row.reference, row.difference, row.inside) == (None, difference, inside)
    assert row.band == "1 to 3 s"


def test_a_bound():
    assert at_most("drift", "m", 1e-6, 0.0).inside
    assert not at_most("drift", "m", 1e-6, 2e-6).inside
    assert not at_most("drift", "m", 1e-6, math.inf).inside


def test_a_count_is_equal_or_outside():
    assert equal("states that are not finite", "", 0.0, 0.0).inside
    assert not equal("states that are not finite", "", 0.0, 1.0).inside
