import math
import warnings
from types import SimpleNamespace

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.control.navigation import Navigator, Spin, TangentPlane, _lever
from vrx_mj.errors import SensorError, VrxWarning
from vrx_mj.frames import rotation_matrix

SYDNEY = (-33.722768, 150.673991)


def turned(yaw, pitch=0.0):
    """Quaternion of a heading and then a pitch."""
    c, s, a, b = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    return np.array([c * a, -s * b, c * b, s * a])


def boat(latitude, longitude, *, altitude=0.1, velocity=(0, 0, 0), yaw=0.0, pitch=0.0, rate=0.0, time=0.0, mount=None):
    fix = SimpleNamespace(latitude=latitude, longitude=longitude, altitude=altitude, velocity=np.array(velocity, float))
    spin = rotation_matrix(turned(yaw, pitch)).T @ (0.0, 0.0, rate)
    inertia = SimpleNamespace(orientation=turned(yaw, pitch), angular_velocity=spin)
    sensors = {
        "gps_wamv": SimpleNamespace(data=fix, time=time, mount=mount),
        "imu_wamv": SimpleNamespace(data=inertia, time=time, mount=None),
    }
    return SimpleNamespace(sensors=sensors)


@pytest.mark.parametrize("latitude", [-60.0, -33.7, 0.0, 21.3, 60.0])
@given(east=st.floats(-500, 500), north=st.floats(-500, 500))
def test_the_plane_is_that_of_pymap3d(latitude, east, north):
    there = pymap3d.enu2geodetic(east, north, 0.0, latitude, 150.0, 0.0)
    found = TangentPlane(latitude, 150.0).local(there[0], there[1])
    # arcs over the ellipsoid differ from a plane's chords by x y tan(latitude) / R: 7 cm at 60 degrees
    assert found == pytest.approx((east, north), abs=0.08)


@given(east=st.floats(-2000, 2000), north=st.floats(-2000, 2000))
def test_to_degrees_and_back(east, north):
    plane = TangentPlane(*SYDNEY)
    assert plane.local(*plane.geodetic(east, north)) == pytest.approx((east, north), abs=1e-6)


def test_the_antimeridian_is_no_wall():
    assert TangentPlane(0.0, 179.9999).local(0.0, -179.9999)[0] == pytest.approx(22.26, abs=0.01)


@pytest.mark.parametrize(("longitude", "east", "there"), [(179.9999, 50.0, -179.99965), (-179.9999, -50.0, 179.99965)])
def test_a_longitude_past_the_antimeridian_is_wrapped(longitude, east, there):
    assert TangentPlane(0.0, longitude).geodetic(east, 0.0)[1] == pytest.approx(there, abs=1e-5)


@pytest.mark.parametrize(("yaw_from_east", "direction"), [(1.0, 1.0), (4.0, 4.0 - math.tau), (-9.0, -9.0 + math.tau)])
def test_the_direction_of_a_place_is_from_east_with_a_fix_and_from_x_by_ground_truth(yaw_from_east, direction):
    place = {"x": 0.0, "y": 0.0, "yaw": 0.3, "yaw_from_east": yaw_from_east}
    navigator = Navigator()
    assert navigator.direction(place) == 0.3
    navigator(boat(*SYDNEY), 0.0)
    assert navigator.direction(place) == pytest.approx(direction)
    assert navigator.direction({"latitude": 0.0, "longitude": 0.0}) == 0.0


def test_the_first_fix_is_the_origin_and_velocity_is_north_west_up():
    seen = Navigator()(boat(*SYDNEY, velocity=(1.0, -2.0, 0.0), yaw=0.5), 0.0)
    assert (seen.x, seen.y, seen.heading) == pytest.approx((0.0, 0.0, 0.5))
    assert (seen.vx, seen.vy) == pytest.approx((2.0, 1.0))
    assert (seen.surge, seen.sway) == pytest.approx(
        (2 * math.cos(0.5) + math.sin(0.5), math.cos(0.5) - 2 * math.sin(0.5))
    )


def test_a_fix_is_carried_on_to_the_present():
    seen = Navigator()(boat(*SYDNEY, velocity=(0.0, -2.0, 0.0), yaw=0.0, rate=0.5, time=10.0), 10.06)
    assert (seen.x, seen.heading) == pytest.approx((0.12, 0.03))


def test_an_antenna_on_a_post_is_not_the_boat():
    mount = SimpleNamespace(position=(-0.85, 0.0, 1.3))
    navigator = Navigator()
    seen = navigator(boat(*SYDNEY, altitude=1.3, yaw=math.pi / 2, rate=0.2, mount=mount), 0.0)
    assert (seen.x, seen.y, seen.z) == pytest.approx((0.0, 0.0, 0.0), abs=1e-7)
    assert (seen.vx, seen.vy) == pytest.approx((-0.17, 0.0), abs=1e-12)  # the antenna rests, so the bow swings west


def test_a_receiver_that_tells_base_link_has_no_arm():
    mount = SimpleNamespace(position=(-0.85, 0.0, 1.3))
    seen = Navigator()(boat(*SYDNEY, altitude=0.1, yaw=1.0, pitch=0.3, mount=mount), 0.0)
    assert (seen.x, seen.y, seen.z) == pytest.approx((0.0, 0.0, 0.1))


def test_places_and_reports_are_by_degrees_where_there_are_any():
    navigator = Navigator()
    navigator(boat(*SYDNEY), 0.0)
    there = navigator.report(30.0, -40.0)
    assert navigator.place({"x": 1e9, "y": 1e9, **there}) == pytest.approx((30.0, -40.0))
    assert navigator.place({"x": 3.0, "y": 4.0, "latitude": None, "longitude": None}) == (3.0, 4.0)


class Deaf(dict):
    """Sensors whose GPS cannot work."""

    def __getitem__(self, name):
        raise SensorError("gps_wamv cannot measure its position: the world ocean has no georeference")


def true_boat(sensors):
    return SimpleNamespace(
        sensors=sensors,
        position=np.array([3.0, 4.0, 0.1]),
        quaternion=turned(1.0),
        velocity=np.array([2.0, 0.0, 0.0]),
        angular_velocity=np.array([0.0, 0.0, 0.3]),
    )


@pytest.mark.parametrize(
    ("sensors", "why"),
    [
        ({}, "the boat has no GPS"),
        ({"gps": None}, "the boat has no IMU"),
        (Deaf(gps=1, imu=1), "gps_wamv cannot measure its position: the world ocean has no georeference"),
    ],
)
def test_without_a_gps_that_works_there_is_ground_truth_and_one_warning(sensors, why):
    navigator = Navigator()
    with pytest.warns(VrxWarning) as told:
        seen = navigator(true_boat(sensors), 0.0)
    assert [str(one.message) for one in told] == [f"navigation by ground truth: {why}"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        navigator(true_boat(sensors), 1.0)
    assert (seen.x, seen.y, seen.heading, seen.turn) == pytest.approx((3.0, 4.0, 1.0, 0.3))
    assert (seen.vx, seen.vy) == pytest.approx((2 * math.cos(1.0), 2 * math.sin(1.0)))
    assert navigator.report(1.0, 2.0) == {"x": 1.0, "y": 2.0}


@given(yaw=st.floats(-3, 3), pitch=st.floats(-1, 1))
def test_a_rotation_turns_without_stretching(yaw, pitch):
    matrix = rotation_matrix(turned(yaw, pitch))
    assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert matrix[:, 0] == pytest.approx(
        (math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), -math.sin(pitch)), abs=1e-12
    )


def test_a_rate_is_that_of_the_moment_though_units_give_means():
    """Exact while the acceleration is constant; after a pause a mean is the best that is known."""
    spin, turning, rising = Spin(), np.array([0.1, -0.2, 0.3]), np.array([1.0, 2.0, -3.0])
    means = [turning + rising * (t - 0.05) for t in (0.1, 0.2, 0.3)]
    found = [spin(t, mean) for t, mean in zip((0.1, 0.2, 0.3), means, strict=True)]
    assert found[0].tolist() == means[0].tolist()
    for t, rate in zip((0.2, 0.3), found[1:], strict=True):
        assert rate == pytest.approx(turning + rising * t)
    assert spin(0.3, np.zeros(3)).tolist() == found[2].tolist()  # the same reading
    assert spin(0.5, turning + rising * 0.45) == pytest.approx(turning + rising * 0.5)  # one was missed
    assert spin(1.6, means[0]).tolist() == means[0].tolist()


@pytest.mark.parametrize(("altitude", "is_antenna"), [(0.2, False), (0.6, False), (0.7, True), (1.2, True)])
def test_a_fix_is_of_the_antenna_or_of_base_link_by_its_height(altitude, is_antenna):
    mount = SimpleNamespace(position=np.array([-0.85, 0.0, 1.3]))
    navigate = Navigator()
    found = navigate(boat(*SYDNEY, altitude=altitude, mount=mount, yaw=0.5), 0.0)
    assert (found.x, found.y) == pytest.approx((0.0, 0.0), abs=1e-6)  # the frame begins at `base_link`
    assert found.z == pytest.approx(altitude - 1.3 if is_antenna else altitude)
    found = navigate(boat(*SYDNEY, altitude=altitude, mount=mount, yaw=0.5 + math.pi), 0.0)
    assert math.hypot(found.x, found.y) == pytest.approx(1.7 if is_antenna else 0.0, abs=1e-6)


def test_turns_that_are_not_certain_move_the_end_of_a_lever():
    arm, turns = np.array([0.7, -0.2, 1.3]), np.array([[4.0, 1.0, 0.5], [1.0, 3.0, -0.7], [0.5, -0.7, 2.0]])
    moves = np.cross(np.linalg.cholesky(turns).T, arm)  # of three turns with that covariance
    assert _lever(arm, turns) == pytest.approx(moves.T @ moves, rel=1e-12)
