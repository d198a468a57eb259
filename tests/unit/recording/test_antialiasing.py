"""Smoothed edges: stairs become slopes, and nothing else changes."""

import numpy as np
import pytest

from fingerprints import check
from vrx_mj.recording.antialiasing import antialias, blend, fill_sky, write_yuv


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


def test_pictures_are_smoothed_filled_and_blended_as_they_were():
    random = np.random.default_rng(7)
    steps = np.kron(random.integers(0, 256, (12, 9, 4), np.uint8), np.ones((3, 4, 1), np.uint8))
    soft = np.clip(128 + 40 * np.cumsum(random.normal(size=(30, 44, 4)), axis=1) / 3, 0, 255).astype(np.uint8)
    slants = [edge(slope, 24) // divisor for slope, divisor in ((0.07, 1), (0.2, 3), (-0.6, 7), (1.5, 11), (-4.0, 2))]
    sky = np.arange(1, 6 * 8 * 8 + 1, dtype=np.uint32).reshape(48, 8)
    skies = []
    for turn in random.normal(size=(6, 3, 3)):
        drawn = random.integers(0, 3, (11, 26), np.uint32)
        fill_sky(drawn, sky, np.ascontiguousarray(np.linalg.qr(turn)[0]), 0.9, 0.6)
        skies.append(drawn)
    planes, place = np.empty((18, 10), np.uint8), random.integers(0, 256, (12, 10, 3), np.uint8)
    write_yuv(place, planes)
    blend(place, random.integers(0, 256, (12, 10, 4), np.uint8))
    smoothed = [antialias(drawn) for drawn in (steps, soft, *slants)]
    check("antialiasing", "pictures", smoothed=smoothed, skies=skies, planes=planes, blended=place)
