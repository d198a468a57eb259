"""An echo sounder: how far along its beam the bottom is."""

import math

from vrx_mj.config.sensors import EchoSounderConfig, LidarConfig
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Echo


def beam(config: EchoSounderConfig) -> LidarConfig:
    """The lidar of one ray that meets what the sounder does."""
    straight = (0.0, 0.0)
    return LidarConfig(
        name=config.name, link=config.link, output="scan", rings=1, samples=1,
        azimuth=straight, elevation=straight, range=config.range,
    )  # fmt: skip


def bottom_distance(place: Place, level: float, depth: float | None) -> float:
    """How far a flat bottom is along the x axis of a place [m]; inf in deep water (None), and for a beam that rises.

    Args:
        place: of the transducer.
        level: height of the mean water [m].
        depth: of the water [m]; None: deep.
    """
    down = -float(place.rotation[2, 0])
    if depth is None or down <= 0.0:
        return math.inf
    return (float(place.position[2]) - level + depth) / down


def echo(config: EchoSounderConfig, distance: float, draw: Draw) -> Echo:
    """What a sounder measures at a true distance [m]; inf where it is out of range."""
    found, (near, far) = distance + draw.error(0, config.noise), config.range
    return _echo(found if near <= found <= far else math.inf, config)


def _echo(distance: float, config: EchoSounderConfig) -> Echo:
    return Echo(distance, *config.range, config.field_of_view)


ECHO_SOUNDER = SensorKind(
    EchoSounderConfig,
    lambda now: echo(now.config, now.echo(), now.draw),
    RecordedNumbers(
        lambda _: 1,
        lambda numbers, config: _echo(float(numbers[0]), config),
        1,
        lambda numbers: "" if numbers[0] >= 0.0 else f"a range of {numbers[0]:g} m",
    ),
    plots=(
        Plot("depth", "Depth under transducer [m]", lambda data: data.range if data.range < math.inf else math.nan),
    ),
)
