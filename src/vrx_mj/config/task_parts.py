"""What tasks are made of: places, gates, bays, animals."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from vrx_mj.config.base import (
    Config,
    Coordinate,
    Latitude,
    Longitude,
    NonNegative,
    Pose,
    Positive,
    Switch,
    faults,
    numbers,
)
from vrx_mj.config.displays import Symbol
from vrx_mj.config.wording import shown

__all__ = [
    "AnimalConfig",
    "BaySign",
    "Cartesian",
    "ChannelConfig",
    "Geodetic",
    "GymkhanaChannel",
    "ShownObject",
    "TargetConfig",
]


def _gates(value: Any) -> Any:
    """Lists of lists of two names."""
    if isinstance(value, tuple | list):
        return tuple(_gate(item, index) for index, item in enumerate(value))
    return value


def _gate(value: Any, index: int) -> Any:
    if not isinstance(value, tuple | list) or len(value) != 2 or not all(isinstance(name, str) for name in value):
        raise faults(((index,), f"expected two names [left, right], got {shown(value)}"))
    if value[0] == value[1]:
        raise faults(((index,), f"a gate has two sides, got '{value[0]}' twice"))
    return tuple(value)


Gate = tuple[str, str]
Gates = Annotated[tuple[Gate, ...], BeforeValidator(_gates)]
Geodetic = Annotated[tuple[Latitude, Longitude, float], numbers("latitude longitude yaw")]
"""Latitude, longitude [degrees, WGS84] and yaw [rad]."""
Cartesian = Annotated[tuple[Coordinate, Coordinate, float], numbers("x y yaw")]
"""x, y [m] in the world frame and yaw [rad]."""


class ShownObject(Config):
    """An object that shows up before the boat for a while."""

    time: NonNegative
    """Time at which it shows up, from the start of the run [s]."""
    duration: Positive = 5.0
    """Time for which it is shown [s]."""
    type: str | None = None
    """Name that a right report gives it; by default its model."""
    name: str
    """Name of the object in the world, which waits elsewhere."""
    pose: Pose
    """Pose in the boat's frame, of which only the yaw turns [m, rad]."""


class ChannelConfig(Config):
    """A channel of gates."""

    course: str | None = None
    """The object whose parts make the gates; by default the world itself."""
    gates: Gates = ()
    """Names of [left, right] buoys in the order of crossing; by default red_bound_i with its partner i."""


class GymkhanaChannel(ChannelConfig):
    """The channel of a gymkhana."""

    obstacle_penalty: NonNegative = 10.0
    """Penalty for a collision in the channel [s]."""
    collision_buffer: NonNegative = 10.0
    """Dead time after a collision counted in the channel [s]."""


class BaySign(Config):
    """What the placard of a bay shows, and whether it is the right one."""

    name: str | None = None
    """Name of the dock's bay; bays come in the dock's order."""
    symbol: Symbol
    """Symbol on the bay's placard at the start."""
    dock_allowed: Switch = False
    """Whether this is the correct bay."""


class TargetConfig(Config):
    """Points for a ball in a hole."""

    bay: Annotated[int, Field(ge=1)]
    """Number of the bay, from 1."""
    size: Literal["big", "small"]
    """Which hole of the bay's placard."""
    points: NonNegative
    """Points for each ball [points]."""


class AnimalConfig(Config):
    """An animal and what to do about it."""

    name: str
    """Name of the object in the world."""
    goal: Literal["avoid", "circumnavigate_clockwise", "circumnavigate_counterclockwise"] | None = None
    """What to do about it; by default that of its model: avoid a crocodile, circle a platypus clockwise, a turtle
    counterclockwise."""
