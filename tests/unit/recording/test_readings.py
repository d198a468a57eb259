"""Readings of a recorded sensor: in the order of their times, whatever the order in the file."""

import numpy as np

from vrx_mj.config.sensors import ErrorModel, ImuConfig, PingerConfig
from vrx_mj.recording.reader import RecordedReadings
from vrx_mj.recording.record_scene import RecordedSensor

PLACE = (0.0, 0.0, 0.0)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def numbers(*values):
    return np.array(values, "<f8").view(np.uint8)


def pinger(*rows):
    """Readings of a pinger, given as time, number and range."""
    config = PingerConfig(name="pinger", link="l")
    sensor = RecordedSensor("a", "pinger", "pinger", "a/pinger", 1.0, PLACE, AXES, config)
    columns = {
        "time": [[time] for time, _, _ in rows],
        "sequence": [[number] for _, number, _ in rows],
        "numbers": [numbers(distance, 0.5, -0.25) for _, _, distance in rows],
    }
    return RecordedReadings(sensor, columns)


def test_readings_are_in_the_order_of_their_times():
    found = pinger((2.0, 2, 20.0), (0.0, 0, 10.0), (1.0, 1, 15.0))
    assert found.time.tolist() == [0.0, 1.0, 2.0]
    assert found.sequence.tolist() == [0, 1, 2]
    assert [(one.time, one.sequence, one.data.range) for one in found] == [(0, 0, 10), (1, 1, 15), (2, 2, 20)]
    assert [one.data.range for one in found[1:]] == [15.0, 20.0]
    assert (found[0].name, found[0].frame, found[0].data.bearing) == ("pinger", "a/pinger", 0.5)


def test_a_units_covariances_follow_from_its_configuration():
    """A recording holds ten numbers of each reading: older ones are read, too."""
    config = ImuConfig(name="imu", link="l", angular_velocity=ErrorModel(noise=(0.1, 0.2, 0.3)))
    sensor = RecordedSensor("a", "imu", "imu", "a/l", 15.0, PLACE, AXES, config)
    columns = {"time": [[0.0]], "sequence": [[0]], "numbers": [numbers(1, 0, 0, 0, 0.5, 0, 0, 0, 0, 9.8)]}
    data = RecordedReadings(sensor, columns)[0].data
    assert data.angular_velocity.tolist() == [0.5, 0.0, 0.0]
    assert np.allclose(np.reshape(data.angular_velocity_covariance, (3, 3)), np.diag([0.01, 0.04, 0.09]))
    assert data.orientation_covariance == (0.0,) * 9
