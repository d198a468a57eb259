"""Geodesy against pymap3d."""

import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.config.geodesy import enu_to_geodetic

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
