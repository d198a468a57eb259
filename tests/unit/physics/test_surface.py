"""The sea as cameras see it: the same waves as those that push, lit by their own slopes, and flat far away."""

from itertools import pairwise

import numpy as np
import pytest

from unit.physics.rows import sea_of
from vrx_mj.physics import tables
from vrx_mj.physics.surface import HORIZON, draw_surface, fan, fan_triangles, reflectance, ripples
from vrx_mj.physics.tables import table
from vrx_mj.physics.waves import elevation, ramp

EYE, SUN, TIME = np.array([3.0, -2.0, 1.8]), np.array([0.0, 0.6, 0.8]), 7.3
SEA = "W04"
NO_RIPPLES = table(tables.WAVE, [])


@pytest.fixture(scope="module")
def drawn():
    """Points, normals and colours of a rough sea, and the waves."""
    waves, sea = sea_of(SEA)
    distances, spokes = fan()
    count = len(distances) * len(spokes)
    points, normals, palette = (np.zeros((count, width), np.float32) for width in (3, 3, 2))
    half = 0.6
    draw_surface(
        waves, NO_RIPPLES, sea, TIME, EYE, SUN, 0.4, half, distances, spokes, points, normals, palette
    )  # fmt: skip
    return waves, ramp(sea, TIME), points.astype(float), normals.astype(float), palette


def near(points):
    return np.hypot(points[:, 0] - EYE[0], points[:, 1] - EYE[1]) < 15.0


def test_near_the_eye_points_lie_on_the_waves(drawn):
    waves, grown, points, _, _ = drawn
    seen = points[near(points)]
    heights = [grown * elevation(waves, x, y, TIME) for x, y, _ in seen]
    assert np.ptp(heights) > 0.2
    assert seen[:, 2] == pytest.approx(heights, abs=2e-4)  # of 32 bits


def test_near_the_eye_normals_stand_upright_on_the_waves(drawn):
    """Against differences of the heights over a millimetre."""
    waves, grown, points, normals, _ = drawn
    step = 1e-3
    for (x, y, _), normal in zip(points[near(points)], normals[near(points)], strict=True):
        east, north = (
            grown * (elevation(waves, x + dx, y + dy, TIME) - elevation(waves, x - dx, y - dy, TIME)) / (2 * step)
            for dx, dy in ((step, 0.0), (0.0, step))
        )
        expected = np.array([-east, -north, 1.0])
        assert normal == pytest.approx(expected / np.linalg.norm(expected), abs=1e-3)


def test_waves_that_lie_closer_than_the_points_are_not_drawn(drawn):
    _, _, points, normals, palette = drawn
    far = np.hypot(points[:, 0] - EYE[0], points[:, 1] - EYE[1]) > 0.9 * HORIZON
    assert np.abs(points[far, 2]).max() == 0.0
    assert (normals[far] == (0.0, 0.0, 1.0)).all()
    assert ((palette >= 0.01 - 1e-6) & (palette <= 0.99 + 1e-6)).all()


def test_triangles_cover_the_fan_without_empty_ones():
    distances, spokes = fan()
    angle = np.repeat(distances, len(spokes)), np.tile(spokes, len(distances))
    points = np.stack((angle[0] * np.cos(angle[1]), angle[0] * np.sin(angle[1])), axis=1)
    a, b, c = points[fan_triangles()].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    areas = 0.5 * (ux * vy - uy * vx)
    assert (areas > 0.0).all()
    assert areas.sum() == pytest.approx(0.5 * HORIZON**2 * 2.0, rel=1e-3)


def test_water_mirrors_more_the_flatter_it_is_looked_at():
    """Schlick's formula: 2 % from above, and towards all of it along the surface."""
    assert reflectance(1.0) == pytest.approx(0.02)
    found = [reflectance(cosine) for cosine in np.linspace(0.1, 1.0, 10)]
    assert all(one > other for one, other in pairwise(found))
    assert found[0] == pytest.approx(0.02 + 0.98 * 0.9**5)


def test_ripples_are_water_waves_and_a_calm_sea_has_none():
    assert len(ripples(NO_RIPPLES)) == 0
    waves, _ = sea_of(SEA)
    small = ripples(waves)
    assert small["frequency"] == pytest.approx(np.sqrt(9.81 * small["wavenumber"]))
    assert np.hypot(*small["direction"].T) == pytest.approx(1.0)
    assert (small["amplitude"] < 0.1).all()
