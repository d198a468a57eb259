"""The truth, as Gazebo's P3D plugin tells it: pose and twist of a link in the world."""

from vrx_mj.config.sensors import P3dConfig
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Truth

__all__ = ["truth"]


def truth(config: P3dConfig, place: Place, draw: Draw) -> Truth:
    """Pose and twist, both in world axes; the noise, if there is any, is on the six components of the twist alone."""
    noise = [draw.error(axis, config.noise) for axis in range(6)]
    return Truth(place.position, place.orientation, place.velocity + noise[:3], place.spin + noise[3:])
