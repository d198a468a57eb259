"""What follows a path: its row for the loop, and its waypoints."""

import math
from typing import Any

from vrx_mj.config.objects import path_points
from vrx_mj.mjcf.placement import PlacedObject

__all__ = ["follower_row"]

Row = dict[str, Any]
TURNS_FIRST = "vrx3"
"""The profile whose worlds use Gazebo's TrajectoryFollower."""


def follower_row(item: PlacedObject, profile: str, start: int) -> tuple[Row, list[Row]]:
    """The row of a thing with a path in `FOLLOWER`, and those of its waypoints, which begin at row `start`."""
    path = item.path
    assert path is not None, f"{item.name} follows no path"
    points = path_points(path, item.pose)
    turns_first = profile == TURNS_FIRST if path.turns_first is None else path.turns_first
    row = {
        "force": path.force,
        "torque": path.torque,
        "tolerance": math.radians(path.bearing_tolerance),
        "reach": path.range_tolerance,
        "turns_first": int(turns_first),
        "loop": int(path.loop),
        "waypoint_start": start,
        "waypoint_count": len(points),
    }
    return row, [{"position": list(point)} for point in points]
