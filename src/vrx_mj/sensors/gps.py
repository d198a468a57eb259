"""A satellite receiver, as Hector's plugin for Gazebo: position on WGS84 and velocity north-west-up.

Hector takes the Earth for flat: degrees are metres over the radii of curvature at the world's origin, and the height
is z. Ours is the ellipsoid. At 1 km from the origin of VRX's Sydney the two differ by 0.08 m in height (the world's
water is a plane, which rises over the ellipsoid) and by at most 0.06 m on the ground; at 100 m by less than 1 mm.
"""

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import GpsConfig
from vrx_mj.frames import Geodetic
from vrx_mj.sensors.errors import Draw, covariance, errors, variances
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Fix

_POSITION, _VELOCITY = 0, 3
"""First axes of the errors."""


def fix(config: GpsConfig, place: Place, earth: Geodetic, draw: Draw) -> Fix:
    """What a receiver at `place` measures.

    Errors and their covariance, which has the drift in it, are along east, north and up: Hector's errors are along the
    world's axes. The velocity's axes are level at the world's origin: at 1 km they lean 0.01 degrees.
    """
    position = errors(config.position, draw, _POSITION) + earth.to_east_north_up(*place.position)
    east, north, up = errors(config.velocity, draw, _VELOCITY) + earth.to_east_north_up(*place.velocity)
    spread = covariance(*variances(config.position))
    return Fix(*earth.geodetic(*position), np.array([north, -east, up]), spread)


def _from_numbers(numbers: FloatArray, _config: GpsConfig) -> Fix:
    latitude, longitude, altitude = (float(value) for value in numbers[:3])
    return Fix(latitude, longitude, altitude, numbers[3:6], tuple(float(value) for value in numbers[6:]))


GPS = SensorKind(
    GpsConfig,
    lambda now: fix(now.config, now.place, now.earth, now.draw),
    RecordedNumbers(lambda _: 15, _from_numbers),
    plots=(
        Plot("latitude", "Latitude [deg]", lambda data: data.latitude),
        Plot("longitude", "Longitude [deg]", lambda data: data.longitude),
    ),
)
