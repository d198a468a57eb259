"""An inertial unit, as Hector's plugin for Gazebo: differences between one measurement and the next."""

import math

import numpy as np
import numpy.typing as npt

from vrx_mj.config.sensors import ImuConfig
from vrx_mj.sensors.errors import Draw, axis_of, errors
from vrx_mj.sensors.places import Place, conjugate, product, rotation_vector
from vrx_mj.sensors.readings import Inertia

__all__ = ["inertia"]

_ACCELERATION, _ANGULAR_VELOCITY, _HEADING = 0, 3, 6
"""First axes of the errors."""


def inertia(
    config: ImuConfig, place: Place, before: Place | None, interval: float, gravity: npt.NDArray[np.float64], draw: Draw
) -> Inertia:
    """What a unit at `place` says, that was at the place `before` an `interval` [s] ago.

    The angular rate is the turn since then over the interval, the acceleration the change of velocity over the
    interval less `gravity` [m/s2, world axes]: both are means over the interval, in the sensor's present axes. The
    first measurement has nothing before it: it gives the rate of this moment, and no change of velocity.
    """
    down = place.rotation.T
    if before is None or interval <= 0.0:
        rate, change = down @ place.spin, np.zeros(3)
    else:
        rate = rotation_vector(product(conjugate(before.orientation), place.orientation)) / interval
        change = (place.velocity - before.velocity) / interval
    yaw = _heading_error(config, draw)
    return Inertia(
        product(yaw, place.orientation),
        rate + errors(config.angular_velocity, draw, _ANGULAR_VELOCITY),
        down @ (change - gravity) + errors(config.acceleration, draw, _ACCELERATION),
    )


def _heading_error(config: ImuConfig, draw: Draw) -> npt.NDArray[np.float64]:
    """(4,) quaternion of the heading's error: a turn about the world's z axis."""
    half = axis_of(config.heading, draw, _HEADING, 2) / 2.0
    return np.array([math.cos(half), 0.0, 0.0, math.sin(half)])
