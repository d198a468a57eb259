"""A receiver of an acoustic beacon, as VRX's acoustic_pinger_plugin."""

import math

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import PingerConfig
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Sound

__all__ = ["sound"]


def sound(config: PingerConfig, place: Place, beacon: FloatArray, draw: Draw) -> Sound:
    """Range, bearing and elevation of a beacon [m, ENU], from `place` and in its axes."""
    x, y, z = place.rotation.T @ (beacon - place.position)
    return Sound(
        math.hypot(x, y, z) + draw.error(0, config.range_noise),
        math.atan2(y, x) + draw.error(1, config.bearing_noise),
        math.atan2(z, math.hypot(x, y)) + draw.error(2, config.elevation_noise),
    )
