"""Geodesy against pymap3d."""

import math

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.config.world import Georeference
from vrx_mj.frames import compass, enu_to_geodetic, geodetic_to_enu

SYDNEY = (-33.724223, 150.679736, 0.0)


@given(
    place=st.tuples(st.floats(-89, 89), st.floats(-179, 179), st.floats(-50, 3000)),
    point=st.tuples(st.floats(-5000, 5000), st.floats(-5000, 5000), st.floats(-100, 100)),
)
def test_a_point_of_a_tangent_plane_is_where_pymap3d_has_it(place, point):
    latitude, longitude, altitude = enu_to_geodetic(*point, *place)
    expected = pymap3d.enu2geodetic(*point, *place)
    assert latitude == pytest.approx(expected[0], abs=2e-12)  # 0.2 micrometres
    assert longitude == pytest.approx(expected[1], abs=1e-11)
    assert altitude == pytest.approx(expected[2], abs=5e-8)  # what pymap3d's own formula leaves


def test_the_origin_is_where_it_is():
    assert enu_to_geodetic(0.0, 0.0, 0.0, *SYDNEY) == pytest.approx(SYDNEY, abs=1e-9)


def test_there_and_back():
    east, north, up = -529.69, 168.64, 1.5
    latitude, longitude, altitude = enu_to_geodetic(east, north, up, *SYDNEY)
    back = pymap3d.geodetic2enu(latitude, longitude, altitude, *SYDNEY)
    assert back == pytest.approx((east, north, up), abs=1e-8)


@pytest.mark.parametrize("heading", [0.0, 30.0, -135.0])
def test_a_world_s_axes_may_be_turned_against_east_and_north(heading):
    """There by our formulas, back by pymap3d's."""
    earth = Georeference(latitude=-33.7, longitude=150.7, elevation=12.0, heading=heading)
    place = (250.0, -80.0, 3.0)
    latitude, longitude, altitude = earth.to_geodetic(*place)
    assert earth.to_enu(latitude, longitude, altitude) == pytest.approx(place, abs=1e-6)
    east, north, up = earth.to_east_north_up(1.0, 0.0, 0.5)
    assert (east, north) == pytest.approx((math.cos(math.radians(heading)), math.sin(math.radians(heading))))
    assert up == 0.5
    assert earth.from_east_north_up(east, north, up) == pytest.approx((1.0, 0.0, 0.5))


@pytest.mark.parametrize(
    ("degrees", "bearing"), [(0, 90), (90, 0), (180, 270), (-90, 180), (89, 1), (91, 359), (600, 210)]
)
def test_a_compass_counts_clockwise_from_north(degrees, bearing):
    assert compass(math.radians(degrees)) == pytest.approx(bearing, abs=1e-9)
    assert compass(np.radians([degrees, degrees + 720.0])) == pytest.approx(bearing, abs=1e-9)


def test_a_place_without_an_altitude_is_on_the_level_of_the_origin():
    earth = Georeference(latitude=-33.7, longitude=150.7, elevation=50.0)
    assert earth.to_enu(-33.7, 150.7) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert earth.to_enu(-33.7, 150.7, 60.0)[2] == pytest.approx(10.0)


@pytest.mark.parametrize("place", [(-33.7, 150.67, 0.0), (0.0, 179.999, -5.0), (89.0, -20.0, 100.0)])
def test_a_place_in_the_tangent_plane_is_that_of_pymap3d_to_the_last_bit(place):
    latitude, longitude, altitude = place
    there = latitude + 0.01, longitude - 0.02, altitude + 3.0
    assert geodetic_to_enu(*there, place) == tuple(map(float, pymap3d.geodetic2enu(*there, *place)))
