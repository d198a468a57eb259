"""The truth, as Gazebo's P3D plugin publishes it: pose and twist of a link in the world."""

from vrx_mj.config.sensors import P3dConfig
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.kinds import RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Truth

__all__ = ["P3D", "truth"]


def truth(config: P3dConfig, place: Place, draw: Draw) -> Truth:
    """Pose and twist, both in world axes; the noise, if there is any, is on the six components of the twist alone."""
    noise = [draw.error(axis, config.noise) for axis in range(6)]
    return Truth(place.position, place.orientation, place.velocity + noise[:3], place.spin + noise[3:])


P3D = SensorKind(
    P3dConfig,
    lambda measurement: truth(measurement.config, measurement.place, measurement.draw),
    RecordedNumbers(lambda _: 13, lambda numbers, _: Truth(numbers[:3], numbers[3:7], numbers[7:10], numbers[10:])),
)
