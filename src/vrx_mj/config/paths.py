"""Paths of things that swim by themselves: animals, and beacons that a boat is to follow."""

import math
from collections.abc import Sequence
from typing import Annotated, Self

from pydantic import Field, model_validator

from vrx_mj.config.base import Config, Coordinate, NonNegative, NotEmpty, Positive, Switch, faults, numbers
from vrx_mj.config.poses import Pose, rotation

__all__ = ["CirclePath", "LinePath", "PathConfig", "path_points"]

POINTS = 8
"""Of a circle: VRX's follow_plugin.cc."""

Point = Annotated[tuple[Coordinate, Coordinate], numbers("x y")]


class CirclePath(Config):
    """A circle round where the thing starts, counter-clockwise, as eight waypoints; the first lies to the east."""

    radius: Positive
    """Radius of the circle [m]."""


class LinePath(Config):
    """To and fro between where the thing starts and another place."""

    length: Positive
    """Distance between the two [m]."""
    direction: float = 0.0
    """Direction of the other place [rad], counter-clockwise from the thing's own x axis at the start."""


class PathConfig(Config):
    """What a floating thing follows: VRX's follow_plugin, or the TrajectoryFollower of the worlds of 2023."""

    waypoints: Annotated[tuple[Point, ...], NotEmpty] | None = None
    """Places in the world [m]."""
    circle: CirclePath | None = None
    """A circle around where it starts."""
    line: LinePath | None = None
    """To and fro along a line from where it starts."""
    force: NonNegative = 10.0
    """Force with which it swims, along its x axis [N]."""
    torque: NonNegative = 1.0
    """Torque with which it turns toward its waypoint [N m]."""
    bearing_tolerance: Annotated[float, Field(ge=0, le=180)] = 2.0
    """How far off its bow a waypoint may be before it turns [degrees]."""
    range_tolerance: Positive = 0.5
    """Distance at which a waypoint is reached [m]."""
    loop: Switch = True
    """Whether it goes on to the first waypoint after the last one; else it stays there."""
    start: Annotated[int, Field(ge=0)] = 0
    """The waypoint that it swims to first, counted from 0."""
    turns_first: Switch | None = None
    """Whether it swims only while its waypoint is within the tolerance of its bow; by default in profile vrx3 alone."""

    @model_validator(mode="after")
    def _is_one_path(self) -> Self:
        given = [key for key in ("waypoints", "circle", "line") if getattr(self, key) is not None]
        if not given:
            raise faults((("waypoints",), "a path needs `waypoints`, a `circle` or a `line`"))
        if len(given) > 1:
            raise faults(((given[1],), f"give one shape of a path; this one already has {given[0]}"))
        count = {"waypoints": len(self.waypoints or ()), "circle": POINTS, "line": 2}[given[0]]
        if self.start >= count:
            raise faults((("start",), f"must be below {count}, the number of waypoints, got {self.start}"))
        return self


def path_points(path: PathConfig, pose: Pose) -> list[tuple[float, float]]:
    """The waypoints [m] of a thing that starts at a pose in the world, in the order in which it swims to them."""
    points = _points(path, pose)
    return [*points[path.start :], *(points[: path.start] if path.loop else ())]


def _points(path: PathConfig, pose: Pose) -> Sequence[tuple[float, float]]:
    x, y = pose[:2]
    if path.waypoints is not None:
        return path.waypoints
    if path.circle is not None:
        r, step = path.circle.radius, math.tau / POINTS
        return [(x + r * math.cos(step * i), y + r * math.sin(step * i)) for i in range(POINTS)]
    assert path.line is not None
    cos, sin = math.cos(path.line.direction), math.sin(path.line.direction)
    turn = rotation(*pose[3:])
    ahead = [path.line.length * (turn[i][0] * cos + turn[i][1] * sin) for i in (0, 1)]
    return [(x, y), (x + ahead[0], y + ahead[1])]
