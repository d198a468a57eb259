"""Cosine, sine and exponential against the C library's."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.physics.elementary import cosine, cosine_and_sine, exponential, near_cosine, near_cosine_and_sine

ANGLES = np.concatenate([np.linspace(-20.0, 20.0, 4001), np.random.default_rng(3).uniform(-1e6, 1e6, 4000)])
ROUNDING = 4e-16  # eleven terms of up to 1.3, summed pairwise, each rounded to 1.1e-16


@given(st.floats(-2e6, 2e6))
def test_it_is_the_c_library_s(angle):
    assert cosine(angle) == pytest.approx(math.cos(angle), abs=ROUNDING, rel=0)


def test_they_are_right_at_quarter_turns_and_halfway_between():
    for angle in np.arange(-18, 19) * math.pi / 4:
        assert cosine(angle) == pytest.approx(math.cos(angle), abs=ROUNDING, rel=0)
        for near in np.nextafter(angle, [-math.inf, angle, math.inf]):
            assert cosine_and_sine(near) == pytest.approx((math.cos(near), math.sin(near)), abs=ROUNDING, rel=0)


@given(st.floats(-1e7, 1e7))
def test_cosine_and_sine_are_the_c_library_s(angle):
    cos, sin = cosine_and_sine(angle)
    assert cos == pytest.approx(math.cos(angle), abs=ROUNDING, rel=0)
    assert sin == pytest.approx(math.sin(angle), abs=ROUNDING, rel=0)


def test_zero_has_cosine_one():
    assert cosine(0.0) == 1.0


@pytest.mark.parametrize("angle", [math.nan, math.inf])
def test_what_has_no_cosine_gives_nan(angle):
    assert math.isnan(cosine(angle))


def test_without_branches_they_are_the_same_to_the_bit():
    for angle in ANGLES:
        assert cosine(angle) == near_cosine(angle)
        assert cosine_and_sine(angle) == near_cosine_and_sine(angle)


def test_the_exponential_is_the_c_library_s_within_rounding():
    for x in -np.concatenate([[0.0], np.logspace(-12, math.log10(699.0), 20000)]):
        assert exponential(x) == pytest.approx(math.exp(x), rel=4.5e-16, abs=0.0)
    assert exponential(0.0) == 1.0
    assert exponential(-1e9) == exponential(-700.0) > 0.0
