"""What boats measure: types of sensors, one record each, from a moment of the world to readings.

The runtime decides when a sensor measures. Types with a measurement of their own have it in their module.
"""

import math
from collections.abc import Mapping

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import BallShooterConfig, CameraConfig, LidarConfig, P3dConfig, PingerConfig
from vrx_mj.sensors.instruments import (
    ANEMOMETER,
    ECHO_SOUNDER,
    GNSS_COMPASS,
    GPS,
    IMU,
    Draw,
    Plot,
    RecordedNumbers,
    SensorKind,
)
from vrx_mj.sensors.readings import Place, Scan, Shooter, Sound, Truth

_MOST_SHOTS = 1000.0
_CAMERA = SensorKind(CameraConfig, lambda now: now.picture())
_BALL_SHOOTER = SensorKind(
    BallShooterConfig,
    lambda now: Shooter(round(float(now.marks[0]))),
    RecordedNumbers(
        lambda _: 1,
        lambda numbers, _: Shooter(round(float(numbers[0]))),
        problem=lambda numbers: "" if 0.0 <= numbers[0] <= _MOST_SHOTS else f"{numbers[0]:g} shots",
    ),
    start_marks=lambda config: (float(config.shots),),
    plots=(Plot("shots", "Shots left", lambda data: data.shots_left),),
)


def truth(config: P3dConfig, place: Place, draw: Draw) -> Truth:
    """Pose and twist, both in world axes; the noise, if there is any, is on the six components of the twist alone."""
    noise = [draw.error(axis, config.noise) for axis in range(6)]
    return Truth(place.position, place.orientation, place.velocity + noise[:3], place.spin + noise[3:])


_P3D = SensorKind(
    P3dConfig,
    lambda now: truth(now.config, now.place, now.draw),
    RecordedNumbers(lambda _: 13, lambda numbers, _: Truth(numbers[:3], numbers[3:7], numbers[7:10], numbers[10:])),
)


def sense_sound(config: PingerConfig, place: Place, beacon: FloatArray, draw: Draw) -> Sound:
    """Range, bearing and elevation of a beacon [m, ENU], from `place` and in its axes."""
    x, y, z = place.rotation.T @ (beacon - place.position)
    return Sound(
        math.hypot(x, y, z) + draw.error(0, config.range_noise),
        math.atan2(y, x) + draw.error(1, config.bearing_noise),
        math.atan2(z, math.hypot(x, y)) + draw.error(2, config.elevation_noise),
    )


_PINGER = SensorKind(
    PingerConfig,
    lambda now: sense_sound(now.config, now.place, now.marks, now.draw),
    RecordedNumbers(lambda _: 3, lambda numbers, _: Sound(*(float(value) for value in numbers))),
    start_marks=lambda config: config.beacon,
    plots=(
        Plot("range", "Beacon range [m]", lambda data: data.range),
        Plot("bearing", "Beacon bearing [deg]", lambda data: np.degrees(data.bearing)),
    ),
)


def _scan(numbers: FloatArray, _config: LidarConfig) -> Scan:
    return Scan(numbers[:-5].astype(np.float32), *(float(value) for value in numbers[-5:]))


def _wrong_scan(numbers: FloatArray) -> str:
    ranges = numbers[:-5]
    wild = ranges[~((ranges >= 0.0) & (ranges <= np.finfo(np.float32).max) | (ranges == np.inf))]
    return f"a range of {wild[0]:g} m" if wild.size else ""


_LIDAR = SensorKind(
    LidarConfig,
    lambda now: now.scan(),
    # of a planar scan: clouds are held as points
    RecordedNumbers(lambda config: 5 + int(config.samples), _scan, problem=_wrong_scan),
)
SENSOR_KINDS: Mapping[str, SensorKind] = {
    kind.type: kind
    for kind in (_CAMERA, _LIDAR, IMU, _PINGER, GPS, _BALL_SHOOTER, _P3D, ANEMOMETER, GNSS_COMPASS, ECHO_SOUNDER)
}
"""Kinds of sensors, by type."""
