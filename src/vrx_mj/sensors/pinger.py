"""A receiver of an acoustic beacon, as VRX's acoustic_pinger_plugin."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import PingerConfig
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Sound

__all__ = ["PINGER", "sound"]


def sound(config: PingerConfig, place: Place, beacon: FloatArray, draw: Draw) -> Sound:
    """Range, bearing and elevation of a beacon [m, ENU], from `place` and in its axes."""
    x, y, z = place.rotation.T @ (beacon - place.position)
    return Sound(
        math.hypot(x, y, z) + draw.error(0, config.range_noise),
        math.atan2(y, x) + draw.error(1, config.bearing_noise),
        math.atan2(z, math.hypot(x, y)) + draw.error(2, config.elevation_noise),
    )


PINGER = SensorKind(
    PingerConfig,
    lambda measurement: sound(measurement.config, measurement.place, measurement.marks, measurement.draw),
    RecordedNumbers(lambda _: 3, lambda numbers, _: Sound(*(float(value) for value in numbers))),
    start_marks=lambda _: (0.0, 0.0, 0.0),  # the beacon is at the world's origin, as in VRX
    plots=(
        Plot("range", "Beacon range [m]", lambda data: data.range),
        Plot("bearing", "Beacon bearing [deg]", lambda data: np.degrees(data.bearing)),
    ),
)
