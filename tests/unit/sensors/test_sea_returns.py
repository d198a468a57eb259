"""Where rays meet the sea, against a fine march along them."""

import math

import numpy as np
import pytest

from unit.physics.rows import sea
from vrx_mj.physics.waves import pms_components, surface_height
from vrx_mj.sensors.lidar import sea_distance

T = 30.0
FAR = 130.0
STEP = 0.002


def rough_sea(gain, *, tau=0.0, level=0.0):
    rows = pms_components(3, 2.5, 0.4, 0.0, gain, 5.0, (1.0, 0.3)) if gain else []
    waves, surface = sea(rows, tau=tau, level=level)
    return waves, surface.reshape(1)


def unit(azimuth, elevation):
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def gap(waves, rough, origin, along, s):
    x, y, z = origin + s * along
    return z - surface_height(waves, rough[0], x, y, T)


def marched(waves, rough, origin, along, begin):
    """The first point under water in steps of 2 mm, then halved."""
    s = np.arange(begin, FAR, STEP)
    x, y, z = origin[:, None] + along[:, None] * s
    height = np.full_like(s, rough["level"][0])
    share = 1.0 if rough["tau"][0] <= 0 else 1.0 - math.exp(-T / rough["tau"][0])
    for wave in waves:
        phase = wave["wavenumber"] * (wave["direction"] @ (x, y)) - wave["frequency"] * T
        height += share * wave["amplitude"] * np.cos(phase)
    under = np.flatnonzero(z < height)
    if not len(under):
        return math.inf
    low, high = s[under[0] - 1], s[under[0]]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if gap(waves, rough, origin, along, middle) > 0 else (low, middle)
    return high


@pytest.mark.parametrize(("gain", "tau", "level"), [(0.3, 0.0, 0.0), (1.0, 20.0, -0.4), (2.0, 0.0, 1.0)])
def test_rays_meet_the_waves_where_a_fine_march_does(gain, tau, level):
    waves, rough = rough_sea(gain, tau=tau, level=level)
    draw = np.random.default_rng(int(10 * gain))
    hits = 0
    for _ in range(60):
        origin = np.array([*draw.uniform(-50, 50, 2), level + draw.uniform(0.5, 6)])
        along = unit(draw.uniform(-3, 3), draw.uniform(-0.6, 0.05))
        if gap(waves, rough, origin, along, 0.1) <= 0.01:
            continue
        expected = marched(waves, rough, origin, along, 0.1)
        found = sea_distance(waves, rough[0], T, origin, along, 0.1, FAR)
        # a ray stops 1e-9 m over the water, and grazing ones go far in that height
        assert found == pytest.approx(expected, abs=1e-6)
        hits += math.isfinite(found)
    assert hits > 30


@pytest.mark.parametrize("elevation", [-1.5, -0.5, -0.1])
def test_calm_water_is_a_plane(elevation):
    waves, calm = rough_sea(0.0, level=0.5)
    found = sea_distance(waves, calm[0], T, np.array([3.0, 4.0, 2.5]), unit(1.0, elevation), 0.1, FAR)
    assert found == pytest.approx(2.0 / math.sin(-elevation), rel=1e-12)


def test_the_sea_grows_with_its_ramp():
    waves, rough = rough_sea(1.0, tau=1e9)
    found = sea_distance(waves, rough[0], T, np.array([0.0, 0.0, 2.0]), unit(0.0, -0.5), 0.1, FAR)
    assert found == pytest.approx(2.0 / math.sin(0.5), rel=1e-6)


@pytest.mark.parametrize("gain", [0.0, 1.0])
def test_rays_upward_beyond_the_range_or_from_under_water_do_not_return(gain):
    waves, rough = rough_sea(gain)
    for height, elevation in ((2.0, 0.5), (5.0, -0.001), (-3.0, -0.5), (-3.0, 0.5)):
        origin = np.array([0.0, 0.0, height])
        assert sea_distance(waves, rough[0], T, origin, unit(0.5, elevation), 0.1, FAR) == math.inf
