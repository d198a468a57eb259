"""Readings as messages: layouts of bytes, and where arrows point."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from trees import partial
from vrx_mj.config.sensors import (
    AnemometerConfig,
    EchoSounderConfig,
    ErrorModel,
    GnssCompassConfig,
    GpsConfig,
    ImuConfig,
    LidarConfig,
    P3dConfig,
    PingerConfig,
)
from vrx_mj.config.world import Georeference
from vrx_mj.frames import rotation_matrix
from vrx_mj.ros.table.sensing import sensor_outputs
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.gps import fix
from vrx_mj.sensors.imu import inertia
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import ApparentWind, Echo, Heading, PointCloud, Reading, Sound
from vrx_mj.sensors.registry import truth


def made(config, tail, data):
    """The message that an output of a sensor makes of a reading."""
    sensor = SimpleNamespace(config=config, name=config.name, boat="a", frame=f"a/{config.link}")
    world = SimpleNamespace(parameters=partial({"georeference": {}}))
    host = SimpleNamespace(sim=SimpleNamespace(mounted=lambda _boat: [sensor], world=world))
    output = next(one for one in sensor_outputs(host, "a") if one.name.endswith(tail))
    return output.make(Reading(config.name, config.type, 1.5, 3, sensor.frame, data))


def test_a_cloud_is_one_row_of_points_of_18_bytes():
    points = np.arange(15, dtype=np.float32).reshape(5, 3)
    cloud = PointCloud(points, np.zeros(5, np.float32), np.arange(5, dtype=np.uint16))
    message = made(LidarConfig(name="lidar", link="lidar"), "/points", cloud)
    assert (message.height, message.width, message.point_step, message.row_step) == (1, 5, 18, 90)
    assert len(message.data) == message.height * message.row_step
    offsets = {field.name: field.offset for field in message.fields}
    for number in range(5):
        row = message.data[number * message.point_step :].tobytes()
        assert np.frombuffer(row, "<f4", 1, offsets["y"])[0] == points[number, 1]
        assert np.frombuffer(row, "<u2", 1, offsets["ring"])[0] == number


@pytest.mark.parametrize(("bearing", "elevation"), [(0.0, 0.0), (0.7, 0.0), (0.0, -0.4), (-2.5, 0.3)])
def test_the_marker_of_a_pinger_points_to_where_it_is_heard(bearing, elevation):
    message = made(PingerConfig(name="pinger", link="pinger"), "/marker/signal", Sound(12.0, bearing, elevation))
    turn = message.pose.orientation
    ahead = rotation_matrix((turn.w, turn.x, turn.y, turn.z))[:, 0]
    level = math.cos(elevation)
    assert ahead == pytest.approx((level * math.cos(bearing), level * math.sin(bearing), math.sin(elevation)))
    assert message.scale.x == 12.0


AT_REST = Place(np.zeros(3), np.eye(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
DRAW = Draw(1, "a", "x", 0, 15.0)


def diagonal(*values):
    return np.diag(values).reshape(-1).tolist()


def test_an_imu_states_the_variances_of_its_errors():
    errors = {
        "acceleration": ErrorModel(noise=(0.3, 0.3, 0.3), drift=(0.4, 0.4, 0.4)),
        "angular_velocity": ErrorModel(noise=(0.01, 0.02, 0.03)),
        "heading": ErrorModel(drift=(0.0, 0.0, 0.5)),
        "tilt": ErrorModel(noise=(0.1, 0.2, 0.0)),
    }
    config = ImuConfig(name="imu", link="imu", **errors)
    message = made(config, "/data", inertia(config, AT_REST, None, 0.0, np.zeros(3), DRAW))
    assert message.orientation_covariance.tolist() == pytest.approx(diagonal(0.01, 0.04, 0.25))
    assert message.angular_velocity_covariance.tolist() == pytest.approx(diagonal(1e-4, 4e-4, 9e-4))
    assert message.linear_acceleration_covariance.tolist() == pytest.approx(diagonal(0.25, 0.25, 0.25))


@pytest.mark.parametrize("heading", [0.0, 25.0])
@pytest.mark.parametrize("noise", [(0.0, 0.0, 0.0), (2.0, 1.0, 3.0)])  # Hector's plugin says so without errors, too
def test_a_fix_states_its_covariance_which_is_diagonal_in_any_world(noise, heading):
    config = GpsConfig(name="gps", link="gps", position=ErrorModel(noise=noise))
    earth = Georeference(latitude=-33.7, longitude=150.7, elevation=0.0, heading=heading)
    message = made(config, "/fix", fix(config, AT_REST, earth, DRAW))
    assert message.position_covariance_type == 2
    assert message.position_covariance.tolist() == pytest.approx(diagonal(*(value**2 for value in noise)))


def test_apparent_wind_is_the_velocity_of_the_air_past_the_sensor():
    """From ahead to port: it blows astern and to starboard."""
    config = AnemometerConfig(name="wind", link="mast")
    message = made(config, "/wind/apparent_wind", ApparentWind(5.0, math.atan2(4.0, 3.0)))
    assert message.header.frame_id == "a/mast"
    assert (message.vector.x, message.vector.y, message.vector.z) == pytest.approx((-3.0, -4.0, 0.0))


def test_a_compass_states_its_yaw_and_what_it_does_not_measure():
    message = made(GnssCompassConfig(name="gnss", link="mast"), "/gnss/heading", Heading(2.0, 0.3, 4e-4, 9e-4))
    turn = message.orientation
    assert rotation_matrix((turn.w, turn.x, turn.y, turn.z))[:, 0] == pytest.approx((math.cos(2.0), math.sin(2.0), 0.0))
    assert message.orientation_covariance.tolist() == diagonal(1000.0, 1000.0, 4e-4)
    assert message.angular_velocity.z == 0.3
    assert message.angular_velocity_covariance.tolist() == diagonal(1000.0, 1000.0, 9e-4)
    assert message.linear_acceleration_covariance[0] == -1.0


@pytest.mark.parametrize("distance", [7.25, math.inf])
def test_an_echo_is_a_range_of_ultrasound(distance):
    message = made(EchoSounderConfig(name="sonar", link="keel"), "/sonar/range", Echo(distance, 0.5, 80.0, 0.25))
    assert message.radiation_type == message.ULTRASOUND == 0
    assert (message.range, message.min_range, message.max_range, message.field_of_view) == (distance, 0.5, 80.0, 0.25)


def test_the_truth_states_the_variance_of_its_velocities():
    config = P3dConfig(name="p3d", link="base_link", noise=0.1)
    message = made(config, "/p3d", truth(config, AT_REST, DRAW))
    assert message.twist.covariance.tolist() == pytest.approx(diagonal(*[0.01] * 6))
    assert message.pose.covariance.tolist() == [0.0] * 36
