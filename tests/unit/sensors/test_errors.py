"""Errors of sensors: their statistics, and that each number has a place of its own."""

import math

import numpy as np
import pytest

from vrx_mj.config.sensors import ErrorModel
from vrx_mj.physics.noise import axis_error, bits, gauss_markov, normal, stream_key
from vrx_mj.sensors.instruments import Draw, errors, variances

COUNT = 6000
SPREAD = 4.5 / math.sqrt(COUNT)
"""Four and a half standard errors of a mean of COUNT independent numbers with variance 1."""
KEYS = [np.uint64(stream_key(7, k)) for k in range(COUNT)]


def drifts(index, reversion):
    """Number `index` of COUNT independent sequences."""
    return np.array([gauss_markov(key, index, reversion) for key in KEYS])


@pytest.mark.parametrize("index", [0, 1, 1000, 65536, 1_000_003])
def test_a_drift_has_mean_0_and_variance_1_from_the_first_number_on(index):
    values = drifts(index, 1e-3)
    assert abs(values.mean()) < SPREAD
    assert abs(values.var() - 1.0) < SPREAD * math.sqrt(2.0)


@pytest.mark.parametrize("start", [0, 4095, 65530])
@pytest.mark.parametrize("lag", [1, 7, 1000, 4096])
def test_a_drift_forgets_exponentially(start, lag):
    """Also across the boundaries between blocks of powers of two."""
    one, other = drifts(start, 1e-3), drifts(start + lag, 1e-3)
    assert abs(np.mean(one * other) - math.exp(-lag * 1e-3)) < SPREAD * math.sqrt(2.0)


def test_a_drift_depends_on_its_past_through_the_present_alone():
    """Given the present, past and future are uncorrelated: what makes a Gaussian process Markov's."""
    reversion, (past, now, future) = 0.01, (drifts(k, 0.01) for k in (960, 1030, 1090))
    earlier = past - math.exp(-70 * reversion) * now
    later = future - math.exp(-60 * reversion) * now
    assert abs(np.mean(earlier * later)) < SPREAD


def test_a_drift_is_smooth_on_its_time_scale():
    """Neighbours 1/1000 of the time constant apart differ by sqrt(2 (1 - exp(-1/1000))) = 0.045 in the mean square."""
    values = np.array([gauss_markov(KEYS[0], k, 1e-3) for k in range(20_000)])
    assert np.sqrt(np.mean(np.diff(values) ** 2)) == pytest.approx(math.sqrt(-2.0 * math.expm1(-1e-3)), rel=0.03)


def test_a_drift_without_a_time_constant_stays():
    values = {gauss_markov(KEYS[0], k, 0.0) for k in (0, 1, 17, 10**9)}
    assert values == {normal(KEYS[0], np.uint64(0))}


def test_a_drift_that_forgets_at_once_is_white():
    assert [gauss_markov(KEYS[0], k, 50.0) for k in range(9)] == [normal(KEYS[0], np.uint64(k)) for k in range(9)]


def test_an_error_is_offset_and_drift_and_noise():
    key, axis, index = KEYS[3], 2, 41
    drift = gauss_markov(np.uint64(bits(key, np.uint64(5))), index, 0.02)
    noise = normal(np.uint64(bits(key, np.uint64(4))), np.uint64(index))
    found = axis_error(key, axis, index, 0.5, 3.0, 0.02, 0.1)
    assert found == pytest.approx(0.5 + 3.0 * drift + 0.1 * noise, abs=1e-12)
    assert axis_error(key, axis, index, 0.5, 0.0, 0.02, 0.0) == 0.5


def test_noise_of_a_model_has_its_standard_deviations_and_no_correlation():
    model = ErrorModel(noise=(1.0, 2.0, 0.5), offset=(0.0, 10.0, 0.0))
    values = np.array([errors(model, Draw(3, "a", "gps", k, 15.0), 0) for k in range(COUNT)])
    assert np.abs(values.mean(axis=0) - (0.0, 10.0, 0.0)) == pytest.approx((0, 0, 0), abs=2.0 * SPREAD)
    assert values.std(axis=0) == pytest.approx((1.0, 2.0, 0.5), rel=SPREAD)
    assert np.corrcoef(values.T) == pytest.approx(np.eye(3), abs=SPREAD)


def test_the_same_measurement_has_the_same_error():
    assert Draw(1, "a", "gps", 5, 15.0).error(0, 1.0) == Draw(1, "a", "gps", 5, 15.0).error(0, 1.0)


def test_seeds_boats_sensors_measurements_and_axes_have_numbers_of_their_own():
    draws = [
        Draw(seed, boat, sensor, index, 15.0).error(axis, 1.0)
        for seed in (1, 2)
        for boat in ("a", "b")
        for sensor in ("gps", "imu")
        for index in (0, 1)
        for axis in (0, 1)
    ]
    assert len(set(draws)) == 32


def test_a_drifts_time_constant_is_in_seconds():
    """Measurements twice as often are half as far apart."""
    model = {"drift": 1.0, "frequency": 0.3}
    slow, fast = (Draw(1, "a", "imu", 8, rate).error(0, 0.0, **model) for rate in (10.0, 20.0))
    assert slow == gauss_markov(np.uint64(bits(np.uint64(Draw(1, "a", "imu", 8, 10.0).key), np.uint64(1))), 8, 0.03)
    assert fast == gauss_markov(np.uint64(bits(np.uint64(Draw(1, "a", "imu", 8, 20.0).key), np.uint64(1))), 8, 0.015)


def test_covariances_have_noise_and_drift_in_them():
    assert variances(ErrorModel(noise=(3.0, 1.0, 0.0), drift=(4.0, 0.0, 2.0))) == pytest.approx((25.0, 1.0, 4.0))
