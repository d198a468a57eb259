"""A wind sensor that moves with its boat: the apparent wind."""

import math
from collections.abc import Callable

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import AnemometerConfig
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import ApparentWind


def apparent_wind(air: Callable[[float, float], FloatArray], time: float, level: float, place: Place) -> FloatArray:
    """Velocity (3,) of the air past a place that moves [m/s], in its axes.

    Args:
        air: the wind's velocity (3,) [m/s, world] at a time [s] and a height above the water [m].
        time: of the moment [s].
        level: height of the mean water [m].
        place: where, and how it moves.
    """
    height = max(0.0, float(place.position[2]) - level)
    return np.asarray(place.rotation.T @ (air(time, height) - place.velocity))


def wind_reading(config: AnemometerConfig, flow: FloatArray, draw: Draw) -> ApparentWind:
    """What a sensor measures of the air that streams past it, (3,) [m/s] in its axes: what is along its x and y."""
    ahead, port = (draw.error(axis, config.noise) - float(flow[axis]) for axis in (0, 1))
    return ApparentWind(math.hypot(ahead, port), math.atan2(port, ahead))


ANEMOMETER = SensorKind(
    AnemometerConfig,
    lambda now: wind_reading(now.config, now.wind, now.draw),
    RecordedNumbers(lambda _: 2, lambda numbers, _: ApparentWind(*numbers.tolist())),
    plots=(
        Plot("apparent_wind", "Apparent wind [m/s]", lambda data: data.speed),
        Plot("wind_angle", "Apparent wind angle [deg]", lambda data: math.degrees(data.angle)),
    ),
)
