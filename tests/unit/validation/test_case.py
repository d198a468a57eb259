"""Rows of the report: bands, differences, and what is inside."""

import math

import numpy as np
import pytest

from vrx_mj.validation.case import Band, Comparison, Row


def judged(ours, width, reference=None, **what):
    return Comparison("force", "N", reference, ours, band=Band("closed form", width), **what).row("a-case")


@pytest.mark.parametrize(
    ("ours", "inside"), [(99.0, True), (101.0, True), (98.99, False), (101.01, False), (math.nan, False)]
)
def test_a_band_is_a_share_of_its_reference(ours, inside):
    row = judged(ours, "1 %", 100.0)
    assert row.inside is inside
    assert row.band.words("N") == "± 1 %"
    assert math.isnan(row.difference) if math.isnan(ours) else row.difference == pytest.approx(ours - 100.0)


def test_a_negative_reference_has_a_band_too():
    row = judged(-2.01, "1 %", -2.0)
    assert (row.low, row.high) == pytest.approx((-2.02, -1.98))
    assert row.inside
    assert row.use == pytest.approx(0.5)


def test_numbers_of_numpy_become_plain():
    row = judged(np.float64(2.0), "1 %", np.float64(2.0))
    assert {type(value) for value in (row.reference, row.ours, row.low, row.high)} == {float}
    assert row.inside is True


def test_a_band_may_be_a_distance():
    row = judged(2e-3, "0.001", 0.0)
    assert not row.inside
    assert row.band.words("m") == "± 0.001 m"
    assert row.use == pytest.approx(2.0)


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
    assert judged(ours, "1 to 2", theory=theory).state == state


@pytest.mark.parametrize(("ours", "state"), [(1.5, "inside"), (2.5, "known"), (2.7, "outside"), (0.5, "outside")])
def test_a_row_is_known_to_be_outside_in_a_range_of_its_band(ours, state):
    band = Band("measured", "1 to 2", known="2.4 to 2.6", why="it is known")
    assert Row("force", "N", None, ours, band, theory=ours).state == state


@pytest.mark.parametrize(("ours", "difference", "inside"), [(2.0, 0.0, True), (0.5, -0.5, False), (3.25, 0.25, False)])
def test_a_range_has_no_one_reference(ours, difference, inside):
    row = judged(ours, "1 to 3")
    assert (row.reference, row.difference, row.inside, row.use) == (None, difference, inside, None)
    assert row.band.words("s") == "1 to 3 s"


def test_a_bound():
    assert judged(0.0, "0 to 1e-06").inside
    assert not judged(2e-6, "0 to 1e-06").inside
    assert not judged(math.inf, "0 to 1e-06").inside
    assert judged(5e-7, "0 to 1e-06").use == pytest.approx(0.5)


def test_a_count_is_equal_or_outside():
    assert judged(0.0, "0", 0.0).inside
    assert not judged(1.0, "0", 0.0).inside
    assert judged(0.0, "0", 0.0).band.words("") == "equal"
