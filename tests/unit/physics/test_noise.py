"""Random numbers by key and counter."""

import math

import numpy as np
import pytest

from vrx_mj.physics.noise import axis_error, bits, gamma_variates, gauss_markov, normal, stream_key, uniform

COUNT = 20_000
KEY = 2191722514422524094
GAMMA = ["0x1.1c40d3a220951p+1", "0x1.9510e3c8bf183p-1", "0x1.0000000000000p+0", "0x1.e28e9c72fd285p-1"]


def draw(function, key):
    return np.array([function(np.uint64(key), np.uint64(n)) for n in range(COUNT)])


def test_the_mixing_is_splitmix64():
    """The published first numbers of the seed 1234567."""
    known = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431]
    assert [int(bits(np.uint64(1234567), np.uint64(n))) for n in range(4)] == known


def test_uniform_numbers_fill_their_interval():
    values = draw(uniform, stream_key(1, "a"))
    assert 0 <= values.min() < 1e-3
    assert 0.999 < values.max() < 1
    counts, _ = np.histogram(values, 20, (0, 1))
    chi2 = np.sum((counts - COUNT / 20) ** 2) / (COUNT / 20)
    assert chi2 < 43.8  # 19 degrees of freedom, 0.1 %


def test_normal_numbers_have_the_normal_moments():
    values = draw(normal, stream_key(1, "b"))
    four_sigma = 4 / COUNT**0.5
    assert np.mean(values) == pytest.approx(0, abs=four_sigma)
    assert np.var(values) == pytest.approx(1, abs=four_sigma * 2**0.5)
    assert np.mean(values**3) == pytest.approx(0, abs=four_sigma * 15**0.5)
    assert np.mean(values**4) == pytest.approx(3, abs=four_sigma * 96**0.5)
    assert np.corrcoef(values[1:], values[:-1])[0, 1] == pytest.approx(0, abs=four_sigma)


@pytest.mark.parametrize("shape", [1.0, 1.8, 30.0])
def test_gamma_numbers_have_the_moments_of_their_distribution(shape):
    """Mean 1, variance 1 / k, third and fourth central moments 2 / k^2 and 3 / k^2 + 6 / k^3."""
    values = np.empty(COUNT)
    gamma_variates(np.uint64(stream_key(1, "c")), np.full(COUNT, shape), values)
    variance, fourth = 1.0 / shape, 3.0 / shape**2 + 6.0 / shape**3
    assert np.mean(values) == pytest.approx(1.0, abs=4.0 * math.sqrt(variance / COUNT))
    assert np.var(values) == pytest.approx(variance, abs=4.0 * math.sqrt((fourth - variance**2) / COUNT))
    assert np.mean((values - 1.0) ** 3) == pytest.approx(2.0 / shape**2, rel=0.2)
    assert np.corrcoef(values[1:], values[:-1])[0, 1] == pytest.approx(0, abs=4 / COUNT**0.5)


def test_gamma_numbers_are_the_same_everywhere():
    """Their values are made of products and square roots alone; a shape of 0 draws nothing."""
    values = np.empty(4)
    gamma_variates(np.uint64(KEY), np.array([1.0, 2.5, 0.0, 40.0]), values)
    assert [value.hex() for value in values.tolist()] == GAMMA


def test_streams_do_not_resemble_each_other():
    first, second = draw(normal, stream_key(1, "wamv1")), draw(normal, stream_key(1, "wamv2"))
    assert np.corrcoef(first, second)[0, 1] == pytest.approx(0, abs=4 / COUNT**0.5)


def test_keys_are_the_same_everywhere():
    assert stream_key(15, "wind") == KEY


def test_keys_tell_seeds_names_and_lives_apart():
    names = [(), ("a",), ("b",), ("a", "b"), ("ab",), ("a", 1), ("a", "1"), (1,), (11,), (1, 1)]
    keys = {stream_key(seed, *name) for seed in (0, 1, -1) for name in names}
    assert len(keys) == 3 * len(names)
    assert all(0 <= key < 2**64 for key in keys)


# Errors of sensors: drift as a Gauss-Markov process that any moment can be asked for, and white noise beside it


ERROR_KEY, ERROR_COUNT = np.uint64(0x1234_5678_9ABC_DEF0), 4000
NEAR = 4.0 / math.sqrt(ERROR_COUNT)
"""Four standard deviations of a correlation of so many independent pairs."""


def drifts(reversion, key=ERROR_KEY):
    return np.array([gauss_markov(key, index, reversion) for index in range(ERROR_COUNT)])


def test_a_drift_loses_its_memory_at_its_rate():
    """Neighbours correlate by exp(-reversion); here a moment apart, and four."""
    drift = drifts(0.5)
    assert np.var(drift) == pytest.approx(1.0, abs=4.0 * NEAR)
    for apart in (1, 4):
        correlation = np.mean(drift[apart:] * drift[:-apart]) / np.var(drift)
        assert correlation == pytest.approx(math.exp(-0.5 * apart), abs=2.0 * NEAR)


def test_a_moment_s_drift_does_not_depend_on_what_was_asked_before():
    assert [gauss_markov(ERROR_KEY, index, 0.01) for index in (77, 3, 77)] == [drifts(0.01)[k] for k in (77, 3, 77)]


def errors(axis=0, **sizes):
    given = {"offset": 0.0, "drift": 0.0, "reversion": 50.0, "noise": 0.0, **sizes}
    return np.array([axis_error(ERROR_KEY, axis, index, *given.values()) for index in range(ERROR_COUNT)])


def test_noise_and_drift_know_nothing_of_each_other_nor_of_other_axes():
    """With so fast a drift both are white: each of their own stream."""
    found = [errors(noise=1.0), errors(drift=1.0), errors(1, noise=1.0), errors(1, drift=1.0), errors(2, noise=1.0)]
    correlations = np.corrcoef(found) - np.eye(5)
    assert np.abs(correlations).max() < NEAR


def test_offset_drift_and_noise_add_up():
    whole = errors(offset=2.0, drift=0.5, noise=0.25)
    assert whole == pytest.approx(2.0 + errors(drift=0.5) + errors(noise=0.25))
    assert errors(offset=2.0).tolist() == [2.0] * ERROR_COUNT
