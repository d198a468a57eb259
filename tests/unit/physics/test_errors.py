"""Errors of sensors: drift as a Gauss-Markov process that any moment can be asked for, and white noise beside it."""

import math

import numpy as np
import pytest

from vrx_mj.physics.noise import axis_error, gauss_markov

KEY, COUNT = np.uint64(0x1234_5678_9ABC_DEF0), 4000
NEAR = 4.0 / math.sqrt(COUNT)
"""Four standard deviations of a correlation of so many independent pairs."""


def drifts(reversion, key=KEY):
    return np.array([gauss_markov(key, index, reversion) for index in range(COUNT)])


def test_a_drift_loses_its_memory_at_its_rate():
    """Neighbours correlate by exp(-reversion); here a moment apart, and four."""
    drift = drifts(0.5)
    assert np.var(drift) == pytest.approx(1.0, abs=4.0 * NEAR)
    for apart in (1, 4):
        correlation = np.mean(drift[apart:] * drift[:-apart]) / np.var(drift)
        assert correlation == pytest.approx(math.exp(-0.5 * apart), abs=2.0 * NEAR)


def test_a_moment_s_drift_does_not_depend_on_what_was_asked_before():
    assert [gauss_markov(KEY, index, 0.01) for index in (77, 3, 77)] == [drifts(0.01)[k] for k in (77, 3, 77)]


def errors(axis=0, **sizes):
    given = {"offset": 0.0, "drift": 0.0, "reversion": 50.0, "noise": 0.0, **sizes}
    return np.array([axis_error(KEY, axis, index, *given.values()) for index in range(COUNT)])


def test_noise_and_drift_know_nothing_of_each_other_nor_of_other_axes():
    """With so fast a drift both are white: each of their own stream."""
    found = [errors(noise=1.0), errors(drift=1.0), errors(1, noise=1.0), errors(1, drift=1.0), errors(2, noise=1.0)]
    correlations = np.corrcoef(found) - np.eye(5)
    assert np.abs(correlations).max() < NEAR


def test_offset_drift_and_noise_add_up():
    whole = errors(offset=2.0, drift=0.5, noise=0.25)
    assert whole == pytest.approx(2.0 + errors(drift=0.5) + errors(noise=0.25))
    assert errors(offset=2.0).tolist() == [2.0] * COUNT
