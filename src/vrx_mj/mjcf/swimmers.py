"""What follows a path: its row for the loop, and its waypoints."""

import math

from vrx_mj.config.objects import path_points
from vrx_mj.mjcf.placement import PlacedObject
from vrx_mj.model.afloat import Follower, PathPoint

__all__ = ["follower_row"]

TURNS_FIRST = "vrx3"
"""The profile whose worlds use Gazebo's TrajectoryFollower."""


def follower_row(item: PlacedObject, profile: str, start: int) -> tuple[Follower, list[PathPoint]]:
    """The row of a thing with a path in `FOLLOWER`, and those of its waypoints, which begin at row `start`."""
    path = item.path
    assert path is not None, f"{item.name} follows no path"
    points = path_points(path, item.pose)
    turns_first = profile == TURNS_FIRST if path.turns_first is None else path.turns_first
    row = Follower(
        force=path.force,
        torque=path.torque,
        tolerance=math.radians(path.bearing_tolerance),
        reach=path.range_tolerance,
        turns_first=1 if turns_first else 0,
        loop=1 if path.loop else 0,
        waypoint_start=start,
        waypoint_count=len(points),
    )
    return row, [PathPoint(position=(point[0], point[1])) for point in points]
