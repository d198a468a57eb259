"""Lengths of linear waves, sea states, and where waves break."""

import math

import pytest

from vrx_mj.spectra import SEA_STATES, Site, breaking_height, developed_period, steepest_sea, wavenumber


@pytest.mark.parametrize(
    ("period", "depth", "expected"), [(3.0, math.inf, 0.447145), (5.0, 10.0, 0.171703), (8.0, 20.0, 0.070762)]
)
def test_lengths_of_linear_waves(period, depth, expected):
    assert wavenumber(2.0 * math.pi / period, Site(depth)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("depth", [0.01, 0.3, 2.0, 17.0, 400.0])
@pytest.mark.parametrize("frequency", [0.05, 0.4, 1.3, 7.0])
def test_wavenumbers_fulfil_the_dispersion_relation(frequency, depth):
    site = Site(depth, 9.80665)
    k = wavenumber(frequency, site)
    assert site.gravity * k * math.tanh(k * depth) == pytest.approx(frequency**2, rel=1e-13)


def test_sea_states_and_their_periods():
    assert SEA_STATES[3] == 0.875
    assert developed_period(1.0) == pytest.approx(5.0, rel=1e-3)  # 5 sqrt(Hs)
    assert developed_period(4.0) == pytest.approx(2.0 * developed_period(1.0))


def test_where_waves_break():
    assert breaking_height(3.0) == pytest.approx(0.142 * 9.81 * 9.0 / (2.0 * math.pi))
    assert breaking_height(60.0, Site(1.0)) == pytest.approx(0.142 * 2.0 * math.pi, rel=2e-3)  # 0.89 of the depth


@pytest.mark.parametrize(
    ("period", "share"), [(3.0, 1 / 15), (8.0, 1 / 15), (11.5, 4 / 75), (15.0, 1 / 25), (20.0, 1 / 25)]
)
def test_a_sea_s_height_is_a_share_of_its_length(period, share):
    """DNV-RP-C205 (2010), 3.5.4."""
    assert steepest_sea(period) == pytest.approx(share * 9.81 * period**2 / (2.0 * math.pi))


def test_a_shallow_sea_is_no_higher_than_its_waves():
    assert steepest_sea(11.2, Site(4.0)) == breaking_height(11.2, Site(4.0)) < steepest_sea(11.2)


def test_sea_states_that_the_wind_has_raised_do_not_break():
    assert all(height < steepest_sea(developed_period(max(height, 1e-3))) for height in SEA_STATES)
