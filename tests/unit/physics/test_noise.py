"""Random numbers by key and counter."""

import numpy as np
import pytest

from vrx_mj.physics.noise import bits, normal, stream_key, uniform

COUNT = 20_000
KEY = 2191722514422524094


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
