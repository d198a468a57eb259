"""A satellite receiver, as Hector's plugin for Gazebo: position on WGS84 and velocity north-west-up.

Hector takes the Earth for flat: degrees are metres over the radii of curvature at the world's origin, and the height
is z. Ours is the ellipsoid. At 1 km from the origin of VRX's Sydney the two differ by 0.08 m in height (the world's
water is a plane, which rises over the ellipsoid) and by at most 0.06 m on the ground; at 100 m by less than 1 mm.
"""

from functools import lru_cache

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import ErrorModel, GpsConfig
from vrx_mj.frames import Geodetic
from vrx_mj.sensors.errors import Draw, errors, variances
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Fix

__all__ = ["GPS", "fix"]

_POSITION, _VELOCITY = 0, 3
"""First axes of the errors."""


def fix(config: GpsConfig, place: Place, earth: Geodetic, draw: Draw) -> Fix:
    """What a receiver at `place` measures.

    Errors are along the world's axes, as Hector's. The velocity's axes are level at the world's origin: at 1 km they
    lean 0.01 degrees. The covariance's are east, north and up; it has the drift in it.
    """
    latitude, longitude, altitude = earth.to_geodetic(*(place.position + errors(config.position, draw, _POSITION)))
    east, north, up = earth.to_east_north_up(*(place.velocity + errors(config.velocity, draw, _VELOCITY)))
    return Fix(latitude, longitude, altitude, np.array([north, -east, up]), _covariance(config.position, earth))


@lru_cache(maxsize=256)
def _covariance(model: ErrorModel, earth: Geodetic) -> tuple[float, ...]:
    """(9,) of the position's errors along east, north and up."""
    turn = np.array([earth.to_east_north_up(*axis) for axis in np.eye(3)]).T
    covariance = turn @ np.diag(variances(model)) @ turn.T
    return tuple(float(value) for value in covariance.flat)


def _recorded(numbers: FloatArray, _config: GpsConfig) -> Fix:
    latitude, longitude, altitude = (float(value) for value in numbers[:3])
    return Fix(latitude, longitude, altitude, numbers[3:6], tuple(float(value) for value in numbers[6:]))


GPS = SensorKind(
    GpsConfig,
    lambda measurement: fix(measurement.config, measurement.place, measurement.earth, measurement.draw),
    RecordedNumbers(lambda _: 15, _recorded),
    plots=(
        Plot("latitude", "Latitude [deg]", lambda data: data.latitude),
        Plot("longitude", "Longitude [deg]", lambda data: data.longitude),
    ),
)
