"""The balls of ball shooters: one for each, parked far under water until it is fired, and used again for every shot.

A parked ball sleeps, in MuJoCo's sense: it takes no part in a step until its pose is changed. Nothing else ever falls
asleep, as the tolerance is 0.
"""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet

from vrx_mj.config.objects import load_object
from vrx_mj.mjcf.placement import PlacedObject
from vrx_mj.model.world import Parameters

__all__ = ["BALL", "ball_name", "ball_names", "parked_balls", "spare_ball"]

BALL = "blue_projectile"
"""The object that shooters shoot; VRX's."""
DEPTH = 200.0
"""Of a parked ball under the mean surface [m]: below any ground, and out of sight of cameras and lidars."""
SPACING = 25.0
"""Between parked balls [m]: more than the distance at which the stepping loop looks for contacts."""
COLUMNS = 32


def ball_name(boat: str, shooter: str) -> str:
    """Name of a shooter's ball among the objects of a world."""
    return f"{boat}/{shooter}"


def ball_names(world: Parameters) -> frozenset[str]:
    """Names of the balls among the objects of a compiled world."""
    shooters = (sensor for sensor in world.sensors if sensor.type == "ball_shooter")
    return frozenset(ball_name(sensor.boat, sensor.name) for sensor in shooters)


def parked_balls(shooters: Sequence[tuple[str, str]]) -> list[PlacedObject]:
    """The balls of shooters, each given as (boat, sensor), where they wait: on a grid around the world's origin."""
    config = load_object(BALL)
    left = SPACING * (min(len(shooters), COLUMNS) - 1) / 2.0
    return [
        PlacedObject(
            ball_name(boat, shooter),
            BALL,
            config,
            (SPACING * (index % COLUMNS) - left, SPACING * (index // COLUMNS), -DEPTH, 0.0, 0.0, 0.0),
        )
        for index, (boat, shooter) in enumerate(shooters)
    ]


def spare_ball(boat: str, shooter: str, taken: AbstractSet[tuple[float, ...]]) -> PlacedObject:
    """The ball of a shooter that comes later: south of the grid, at the first place [m] that is not `taken`."""
    index = 0
    while (place := (SPACING * (index % COLUMNS), -SPACING * (1 + index // COLUMNS), -DEPTH)) in taken:
        index += 1
    return PlacedObject(ball_name(boat, shooter), BALL, load_object(BALL), (*place, 0.0, 0.0, 0.0))
