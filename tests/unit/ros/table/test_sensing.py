"""Readings as messages: layouts of bytes, and where arrows point."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from trees import partial
from vrx_mj.config.sensors import (
    AnemometerConfig,
    CameraConfig,
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
from vrx_mj.ros import cdr
from vrx_mj.ros.interface import Output
from vrx_mj.ros.messages import decode, encode
from vrx_mj.ros.table.sensing import sensor_topics
from vrx_mj.sensors import truth
from vrx_mj.sensors.instruments import Draw, fix, inertia
from vrx_mj.sensors.readings import (
    ApparentWind,
    Echo,
    Heading,
    Image,
    Label,
    Labels,
    Place,
    PointCloud,
    Reading,
    Sound,
    Truth,
)
from vrx_mj.sensors.view import intrinsics


def outputs(config):
    """The outputs of a boat a with this sensor alone."""
    sensor = SimpleNamespace(config=config, name=config.name, boat="a", frame=f"a/{config.link}")
    world = SimpleNamespace(parameters=partial({"georeference": {}}))
    host = SimpleNamespace(sim=SimpleNamespace(mounted=lambda _boat: [sensor], world=world))
    return [entry for entry in sensor_topics(host, "a") if isinstance(entry, Output)]


def made(config, tail, data, dialect="vrx"):
    """The message that an output of a sensor makes of a reading."""
    output = next(one for one in outputs(config) if one.name.endswith(tail) and dialect in one.dialects)
    return output.make(Reading(config.name, config.type, 1.5, 3, f"a/{config.link}", data))


def test_a_cloud_is_one_row_of_points_of_22_bytes():
    """As of velodyne's plugin since 1.0.10."""
    points = np.arange(15, dtype=np.float32).reshape(5, 3)
    cloud = PointCloud(points, np.zeros(5, np.float32), np.arange(5, dtype=np.uint16))
    message = made(LidarConfig(name="lidar", link="lidar"), "/points", cloud)
    assert (message.height, message.width, message.point_step, message.row_step) == (1, 5, 22, 110)
    assert len(message.data) == message.height * message.row_step
    offsets = {field.name: field.offset for field in message.fields}
    for number in range(5):
        row = message.data[number * message.point_step :].tobytes()
        assert np.frombuffer(row, "<f4", 1, offsets["y"])[0] == points[number, 1]
        assert np.frombuffer(row, "<u2", 1, offsets["ring"])[0] == number
        assert np.frombuffer(row, "<f4", 1, offsets["time"])[0] == 0.0


@pytest.mark.parametrize("azimuth", [(-math.pi, math.pi), (0.5, -1.0), (3.0, 4.0)])
def test_gz_sims_cloud_has_a_row_for_each_ring_and_a_point_for_each_ray(azimuth):
    """Layout and infinities as gz-sensors 8 has them; both ends of a full turn are rays of their own."""
    config = LidarConfig(name="lidar", link="lidar", rings=3, samples=9, azimuth=azimuth)
    ways = np.linspace(*azimuth, 9)
    rays = [(ring, sample) for sample in range(9) for ring in range(3) if (ring, sample) != (1, 4)]
    points = [[(2 + s) * math.cos(ways[s]), (2 + s) * math.sin(ways[s]), 0.1 * ring] for ring, s in rays]
    rings = np.array([ring for ring, _ in rays], np.uint16)
    message = made(config, "/points", PointCloud(np.array(points, np.float32), np.zeros(26, np.float32), rings), "vrx3")
    assert (message.height, message.width, message.point_step, message.row_step) == (3, 9, 32, 288)
    assert [(field.name, field.offset) for field in message.fields] == [
        ("x", 0), ("y", 4), ("z", 8), ("intensity", 16), ("ring", 24),
    ]  # fmt: skip
    rows = message.data.view("<f4").reshape(3, 9, 8)
    expected = np.broadcast_to(2.0 + np.arange(9), (3, 9)).copy()
    expected[1, 4] = np.inf
    assert np.hypot(rows[..., 0], rows[..., 1]) == pytest.approx(expected)
    assert message.data.reshape(3, 9, 32)[..., 24].tolist() == [[0] * 9, [1] * 9, [2] * 9]
    assert not message.is_dense


@pytest.mark.parametrize(("bearing", "elevation"), [(0.0, 0.0), (0.7, 0.0), (0.0, -0.4), (-2.5, 0.3)])
def test_the_marker_of_a_pinger_points_to_where_it_is_heard(bearing, elevation):
    message = made(PingerConfig(name="pinger", link="pinger"), "/marker/signal", Sound(12.0, bearing, elevation))
    turn = message.pose.orientation
    ahead = rotation_matrix((turn.w, turn.x, turn.y, turn.z))[:, 0]
    level = math.cos(elevation)
    assert ahead == pytest.approx((level * math.cos(bearing), level * math.sin(bearing), math.sin(elevation)))
    assert message.scale.x == 12.0


CAMERA = CameraConfig(name="eye", link="eye", labels=True)
MASK = np.array([[0, 0, 300, 300], [0, 7, 300, 300], [7, 7, 7, 0]], np.uint16)
SEEN = Image(
    np.zeros((3, 4, 3), np.uint8),
    intrinsics(CAMERA),
    Labels(
        (Label("b", "boat", 2, 7, (0, 1, 3, 2), 4), Label("m", "mb_marker_buoy_red", 6, 300, (2, 0, 2, 2), 4)), MASK
    ),
)


def test_a_camera_with_labels_tells_boxes_and_their_numbers_in_the_mask():
    message = made(CAMERA, "/labels", SEEN)
    assert (message.header.frame_id, message.header.stamp.sec, len(message.detections)) == ("a/eye", 1, 2)
    boat, buoy = message.detections
    assert [(one.id, one.score) for one in (*boat.results, *buoy.results)] == [(2, 1.0), (6, 1.0)]
    assert (boat.bbox.center.x, boat.bbox.center.y, boat.bbox.size_x, boat.bbox.size_y) == (1.5, 2.0, 3.0, 2.0)
    assert (buoy.bbox.center.x, buoy.bbox.center.y, buoy.bbox.size_x, buoy.bbox.size_y) == (3.0, 1.0, 2.0, 2.0)
    assert (boat.header.seq, buoy.header.seq, buoy.header.frame_id) == (7, 300, "a/eye")
    back = decode(encode(message, "vision_msgs/Detection2DArray"), "vision_msgs/Detection2DArray")
    assert [one.bbox.center.x for one in back.detections] == [1.5, 3.0]


def test_ros_2s_detections_have_names_of_classes():
    message = made(CAMERA, "/labels", SEEN, "vrx3")
    kind = "vision_msgs/Detection2DArray"
    boat, buoy = cdr.decode(cdr.encode(message, kind), kind).detections
    told = [(one.id, one.results[0].hypothesis.class_id, one.results[0].hypothesis.score) for one in (boat, buoy)]
    assert told == [("7", "boat", 1.0), ("300", "mb_marker_buoy_red", 1.0)]
    assert (buoy.bbox.center.position.x, buoy.bbox.center.position.y, buoy.bbox.size_y) == (3.0, 1.0, 2.0)


def test_a_mask_is_a_picture_of_16_bits():
    message = made(CAMERA, "/labels/mask", SEEN)
    assert (message.height, message.width, message.step, message.encoding) == (3, 4, 8, "mono16")
    assert message.is_bigendian == 0
    assert np.array_equal(np.frombuffer(message.data.tobytes(), "<u2").reshape(3, 4), MASK)
    line = made(CAMERA, "/labels/mask", replace(SEEN, labels=replace(SEEN.labels, mask=MASK[:1])))
    assert (line.height, line.width, line.step, len(line.data)) == (1, 4, 8, 8)


def test_without_labels_there_is_nothing_to_tell():
    """As in recorded pictures; and a camera that has none has no such topics."""
    bare = Image(SEEN.rgb, SEEN.info)
    assert made(CAMERA, "/labels", bare) is made(CAMERA, "/labels", bare, "vrx3") is None
    assert made(CAMERA, "/labels/mask", bare) is None
    names = [
        {one.name for one in outputs(CameraConfig(name="eye", link="eye", labels=labels))} for labels in (False, True)
    ]
    assert names[1] - names[0] == {
        "/a/sensors/eye/labels", "/a/sensors/eye/labels/mask",
        "/a/sensors/cameras/eye_sensor/labels", "/a/sensors/cameras/eye_sensor/labels/mask",
    }  # fmt: skip


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


def test_the_truths_twist_is_in_the_worlds_axes_and_on_ros_2_in_the_boats():
    """Of a boat that heads and goes north."""
    config, half = P3dConfig(name="p3d", link="base_link"), math.sqrt(0.5)
    north = Truth(np.zeros(3), np.array([half, 0.0, 0.0, half]), np.array([0.0, 2.0, 0.0]), np.array([0.3, 0.0, 0.1]))
    for tail, dialect, linear, angular in (
        ("/p3d", "vrx", (0, 2, 0), (0.3, 0, 0.1)),
        ("/ground_truth_odometry", "vrx3", (2, 0, 0), (0, -0.3, 0.1)),
    ):
        twist = made(config, tail, north, dialect).twist.twist
        assert (twist.linear.x, twist.linear.y, twist.linear.z) == pytest.approx(linear)
        assert (twist.angular.x, twist.angular.y, twist.angular.z) == pytest.approx(angular)
