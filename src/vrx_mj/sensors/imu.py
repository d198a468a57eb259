"""An inertial unit, as Hector's plugin for Gazebo: differences between one measurement and the next."""

import math
from functools import lru_cache

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import ErrorModel, ImuConfig
from vrx_mj.frames import conjugate, quaternion_product, rotation_vector
from vrx_mj.sensors.errors import Draw, axis_of, covariance, errors, variances
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Inertia

_Covariances = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""(9,) each: of the orientation, the angular velocity and the linear acceleration."""

_ACCELERATION, _ANGULAR_VELOCITY, _HEADING, _TILT = 0, 3, 6, 9
"""First axes of the errors."""
_NO_ERRORS = ErrorModel()


def inertia(
    config: ImuConfig,
    place: Place,
    before: Place | None,
    interval: float,
    gravity: FloatArray,
    draw: Draw,
    x_from_east: float = 0.0,
) -> Inertia:
    """What a unit at `place` measures, that was at the place `before` an `interval` [s] ago.

    The angular rate is the turn since then over the interval, the acceleration the change of velocity over the
    interval less `gravity` [m/s2, world axes]: both are means over the interval, in the sensor's present axes. The
    first measurement has nothing before it: it gives the rate of this moment, and no change of velocity. The
    orientation is in axes east, north and up (REP 103), by the angle of the world's x axis `x_from_east` [rad].
    """
    down = place.rotation.T
    if before is None or interval <= 0.0:
        rate, change = down @ place.spin, np.zeros(3)
    else:
        rate = rotation_vector(quaternion_product(conjugate(before.orientation), place.orientation)) / interval
        change = (place.velocity - before.velocity) / interval
    return Inertia(
        _with_errors(config, place.orientation, draw, x_from_east),
        rate + errors(config.angular_velocity, draw, _ANGULAR_VELOCITY),
        down @ (change - gravity) + errors(config.acceleration, draw, _ACCELERATION),
        *_covariances(config),
    )


@lru_cache(maxsize=256)
def _covariances(config: ImuConfig) -> _Covariances:
    """The covariances of a unit's errors, drifts included; offsets are not in a covariance.

    Roll and pitch are about the unit's axes and yaw about the vertical: for a level unit, those of its x, y and z.
    """
    roll, pitch, _ = variances(config.tilt)
    return (
        covariance(roll, pitch, variances(config.heading)[2]),
        covariance(*variances(config.angular_velocity)),
        covariance(*variances(config.acceleration)),
    )


def _with_errors(config: ImuConfig, orientation: FloatArray, draw: Draw, x_from_east: float) -> FloatArray:
    """(4,) the orientation from east, with the heading's error about the z axis and others about its own x and y."""
    turned = quaternion_product(_turn(axis_of(config.heading, draw, _HEADING, 2) + x_from_east, 3), orientation)
    if config.tilt == _NO_ERRORS:
        return turned
    for axis in (0, 1):
        turned = quaternion_product(turned, _turn(axis_of(config.tilt, draw, _TILT, axis), 1 + axis))
    return turned


def _turn(angle: float, place: int) -> FloatArray:
    """(4,) quaternion of a turn [rad] about the axis that has this place in it."""
    quaternion = np.array([math.cos(angle / 2.0), 0.0, 0.0, 0.0])
    quaternion[place] = math.sin(angle / 2.0)
    return quaternion


IMU = SensorKind(
    ImuConfig,
    lambda now: inertia(now.config, now.place, now.place_before, now.interval, now.gravity, now.draw, now.x_from_east),
    RecordedNumbers(
        lambda _: 10,
        lambda numbers, config: Inertia(numbers[:4], numbers[4:7], numbers[7:], *_covariances(config)),
        fields=3,
    ),
    plots=(
        Plot("acceleration", "Acceleration [m/s2]", lambda data: data.linear_acceleration, axes=True),
        Plot("turning", "Turning [deg/s]", lambda data: np.degrees(data.angular_velocity), axes=True),
    ),
)
