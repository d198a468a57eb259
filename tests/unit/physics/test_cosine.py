"""Our cosine against the C library's."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.physics.waves import cosine

ROUNDING = 4e-16  # eleven terms of up to 1.3, summed pairwise, each rounded to 1.1e-16


@given(st.floats(-2e6, 2e6))
def test_it_is_the_c_library_s(angle):
    assert cosine(angle) == pytest.approx(math.cos(angle), abs=ROUNDING, rel=0)


@pytest.mark.parametrize("quarter", range(-9, 10))
def test_it_is_right_at_quarter_turns(quarter):
    angle = quarter * math.pi / 2
    assert cosine(angle) == pytest.approx(math.cos(angle), abs=ROUNDING, rel=0)


def test_zero_has_cosine_one():
    assert cosine(0.0) == 1.0


@pytest.mark.parametrize("angle", [math.nan, math.inf])
def test_what_has_no_cosine_gives_nan(angle):
    assert math.isnan(cosine(angle))
