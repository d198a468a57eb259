"""Readings as messages: layouts of bytes, and where arrows point."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.adapters.ros.table.sensing import sensor_outputs
from vrx_mj.config.sensors import LidarConfig, PingerConfig
from vrx_mj.physics.motion import rotation_matrix
from vrx_mj.sensors.readings import PointCloud, Reading, Sound


def made(config, tail, data):
    """The message that an output of a sensor makes of a reading."""
    sensor = SimpleNamespace(config=config, name=config.name, boat="a", frame=f"a/{config.link}")
    host = SimpleNamespace(sim=SimpleNamespace(mounted=lambda _boat: [sensor]))
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
