"""A satellite receiver against pymap3d's inverse and against the flat-earth formula of Hector's plugin."""

import math

import numpy as np
import pymap3d
import pytest

from vrx_mj.config.sensors import ErrorModel, GpsConfig
from vrx_mj.config.world import Georeference
from vrx_mj.sensors.instruments import Draw, errors, fix
from vrx_mj.sensors.readings import Place

SYDNEY = Georeference(latitude=-33.724223, longitude=150.679736)
ELSEWHERE = Georeference(latitude=44.09525149, longitude=9.823435727, elevation=30.0, heading=25.0)
CONFIG = GpsConfig(name="gps", link="gps_link")
DRAW = Draw(1, "a", "gps", 12, 15.0)
EQUATORIAL, FLATTENING = 6378137.0, 1 / 298.257223563  # WGS84


def at(position, velocity=(0.0, 0.0, 0.0)):
    identity = np.array([1.0, 0.0, 0.0, 0.0])
    return Place(np.array(position, float), np.eye(3), identity, np.array(velocity, float), np.zeros(3))


def curvature(latitude):
    """Radii of curvature along the meridian and of the parallel [m], as Hector's plugin computes them."""
    square = 2 * FLATTENING - FLATTENING**2
    ratio = 1 / (1 - square * math.sin(math.radians(latitude)) ** 2)
    vertical = EQUATORIAL * math.sqrt(ratio)
    return vertical * (1 - square) * ratio, vertical * math.cos(math.radians(latitude))


@pytest.mark.parametrize("earth", [SYDNEY, ELSEWHERE], ids=["Sydney", "turned"])
@pytest.mark.parametrize("point", [(0, 0, 0), (-532, 162, 1.2), (3000, -5000, -2), (80_000, 10_000, 0)])
def test_a_fix_leads_back_to_where_it_was_taken(earth, point):
    found = fix(CONFIG, at(point), earth, DRAW)
    assert earth.to_enu(found.latitude, found.longitude, found.altitude) == pytest.approx(point, abs=1e-6)


def test_a_fix_is_where_pymap3d_says():
    found = fix(CONFIG, at((100.0, 200.0, 3.0)), SYDNEY, DRAW)
    expected = pymap3d.enu2geodetic(100.0, 200.0, 3.0, SYDNEY.latitude, SYDNEY.longitude, 0.0)
    assert (found.latitude, found.longitude) == pytest.approx(expected[:2], abs=1e-12)
    assert found.altitude == pytest.approx(expected[2], abs=1e-8)


def test_along_the_x_axis_of_a_turned_world_is_its_heading():
    found = fix(CONFIG, at((100.0, 0.0, 0.0)), ELSEWHERE, DRAW)
    east, north, _ = pymap3d.geodetic2enu(
        found.latitude, found.longitude, 30.0, ELSEWHERE.latitude, ELSEWHERE.longitude, 30.0
    )
    assert math.degrees(math.atan2(north, east)) == pytest.approx(25.0, abs=1e-4)


@pytest.mark.parametrize(("far", "ground", "height"), [(100.0, 0.001, 0.001), (1000.0, 0.061, 0.079)])
def test_a_flat_earth_is_off_by_what_the_description_says(far, ground, height):
    """Largest differences at Sydney over all directions; both are reached, to 2 %, at 1 km."""
    radii, worst = curvature(SYDNEY.latitude), [0.0, 0.0]
    for angle in np.linspace(0.0, 2.0 * math.pi, 73):
        east, north = far * math.cos(angle), far * math.sin(angle)
        found = fix(CONFIG, at((east, north, 0.0)), SYDNEY, DRAW)
        off_north = math.radians(found.latitude - SYDNEY.latitude) * radii[0] - north
        off_east = math.radians(found.longitude - SYDNEY.longitude) * radii[1] - east
        worst = [max(worst[0], math.hypot(off_north, off_east)), max(worst[1], abs(found.altitude))]
    assert worst[0] < ground
    assert worst[1] < height
    if far == 1000.0:
        assert worst == pytest.approx((ground, height), rel=0.02)


def test_the_velocity_is_north_west_up():
    assert fix(CONFIG, at((0, 0, 0), (1.0, 2.0, 3.0)), SYDNEY, DRAW).velocity == pytest.approx((2.0, -1.0, 3.0))


def test_the_velocity_follows_the_worlds_heading():
    north, west, up = fix(CONFIG, at((0, 0, 0), (1.0, 0.0, 0.5)), ELSEWHERE, DRAW).velocity
    turned = math.radians(25.0)
    assert (north, west, up) == pytest.approx((math.sin(turned), -math.cos(turned), 0.5))


def test_errors_are_along_east_north_and_up():
    config = CONFIG.model_copy(update={"position": ErrorModel(offset=(3.0, 4.0, 5.0))})
    found = fix(config, at((10.0, 20.0, 30.0)), ELSEWHERE, DRAW)
    x, y, z = ELSEWHERE.to_enu(found.latitude, found.longitude, found.altitude)
    assert ELSEWHERE.to_east_north_up(x - 10.0, y - 20.0, z - 30.0) == pytest.approx((3.0, 4.0, 5.0))


def test_position_and_velocity_have_errors_of_their_own():
    model = ErrorModel(noise=(0.5, 0.5, 0.5))
    config = CONFIG.model_copy(update={"position": model, "velocity": model})
    found = fix(config, at((0.0, 0.0, 0.0)), SYDNEY, DRAW)
    position = SYDNEY.to_enu(found.latitude, found.longitude, found.altitude)
    assert position == pytest.approx(errors(model, DRAW, 0), abs=1e-6)
    east, north, up = errors(model, DRAW, 3)
    assert found.velocity == pytest.approx((north, -east, up))
    assert abs(position[0] - east) > 1e-3


def test_the_covariance_is_in_east_north_up():
    config = CONFIG.model_copy(update={"position": ErrorModel(noise=(2.0, 1.0, 3.0), drift=(0.0, 0.0, 4.0))})
    level = np.reshape(fix(config, at((0, 0, 0)), SYDNEY, DRAW).position_covariance, (3, 3))
    assert level == pytest.approx(np.diag((4.0, 1.0, 25.0)))
    turned = np.reshape(fix(config, at((0, 0, 0)), ELSEWHERE, DRAW).position_covariance, (3, 3))
    assert (turned == level).all()
    assert fix(CONFIG, at((0, 0, 0)), SYDNEY, DRAW).position_covariance == (0.0,) * 9
