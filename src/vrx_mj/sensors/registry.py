"""The types of sensors, one record each; those with a measurement of their own have it in their module."""

from collections.abc import Mapping

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import BallShooterConfig, CameraConfig, LidarConfig
from vrx_mj.sensors.gps import GPS
from vrx_mj.sensors.imu import IMU
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.pinger import PINGER
from vrx_mj.sensors.readings import Scan, Shooter
from vrx_mj.sensors.truth import P3D

__all__ = ["SENSOR_KINDS"]

MOST_SHOTS = 1000.0


def _scan(numbers: FloatArray, _config: LidarConfig) -> Scan:
    return Scan(numbers[:-5].astype(np.float32), *(float(value) for value in numbers[-5:]))


def _wrong_shots(numbers: FloatArray) -> str:
    return "" if 0.0 <= numbers[0] <= MOST_SHOTS else f"{numbers[0]:g} shots"


CAMERA = SensorKind(CameraConfig, lambda measurement: measurement.picture())
LIDAR = SensorKind(
    LidarConfig,
    lambda measurement: measurement.scan(),
    RecordedNumbers(lambda config: 5 + int(config.samples), _scan),  # of a planar scan: clouds are held as points
)
BALL_SHOOTER = SensorKind(
    BallShooterConfig,
    lambda measurement: Shooter(round(float(measurement.marks[0]))),
    RecordedNumbers(lambda _: 1, lambda numbers, _: Shooter(round(float(numbers[0]))), problem=_wrong_shots),
    start_marks=lambda config: (float(config.shots),),
    plots=(Plot("shots", "Shots left", lambda data: data.shots_left),),
)
SENSOR_KINDS: Mapping[str, SensorKind] = {
    kind.type: kind for kind in (CAMERA, LIDAR, IMU, PINGER, GPS, BALL_SHOOTER, P3D)
}
"""All of them by type."""
