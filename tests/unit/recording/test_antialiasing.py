"""Smoothed edges: stairs become slopes, and nothing else changes."""

import numpy as np
import pytest

from vrx_mj.recording.antialiasing import antialias


def edge(slope, side=64):
    """A white half plane above a line, one sample to a pixel."""
    row, column = np.mgrid[:side, :side]
    return np.repeat((row - side / 2 > slope * (column - side / 2))[..., None] * np.uint8(255), 4, axis=2)


@pytest.mark.parametrize("slope", [0.1, 0.25, 0.5, -0.4])
def test_the_stairs_of_a_slanted_edge_become_a_slope(slope):
    drawn = edge(slope)
    steps = [
        np.abs(np.diff(picture[..., 1].astype(int), axis=1))[10:-10, 10:-10] for picture in (drawn, antialias(drawn))
    ]
    assert steps[0].max() == 255
    assert steps[1].max() <= 128
    assert antialias(drawn).mean() == pytest.approx(drawn.mean(), abs=1.0)


def test_upright_and_level_edges_and_soft_slopes_stay_and_the_picture_is_turned_over():
    drawn = np.zeros((40, 60, 4), np.uint8)
    drawn[:20, 30:] = 200
    drawn[20:, :, 2] = 4 * np.arange(20, dtype=np.uint8)[:, None]
    drawn[19:21] = 0
    assert np.array_equal(antialias(drawn)[:18], drawn[::-1, :, :3][:18])
    assert np.array_equal(antialias(drawn)[26:], drawn[::-1, :, :3][26:])


def test_all_pixels_but_those_of_the_border_are_smoothed():
    drawn = np.repeat(np.random.default_rng(0).integers(0, 2, (24, 27, 1)).astype(np.uint8) * 255, 4, axis=2)
    changed = (antialias(drawn) != drawn[::-1, :, :3]).any(axis=2)
    inner = changed[1:-1, 1:-1]
    assert inner.any(axis=0).all()
    assert inner.any(axis=1).all()
    assert np.count_nonzero(changed) == np.count_nonzero(inner)
