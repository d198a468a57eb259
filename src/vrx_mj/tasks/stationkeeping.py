"""Station-keeping: hold a pose for the whole run (VRX stationkeeping_scoring_plugin.cc)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vrx_mj.tasks.frame import Frame, Pose
from vrx_mj.tasks.rules import Outputs, PlainRules, TaskContext
from vrx_mj.tasks.status import Count, TaskStatus

__all__ = ["Stationkeeping", "pose_error"]


def pose_error(pose: Pose, goal: Mapping[str, float], *, heading: bool = True) -> float:
    """Error of a pose [m]: e = d + 0.75^d h, with d the horizontal distance [m] and h that of the headings [rad].

    VRX's quirk is kept: h = pi - ||goal - yaw| - pi| holds up to two full turns apart, beyond which it is negative.
    """
    distance = math.hypot(goal["x"] - pose.x, goal["y"] - pose.y)
    if not heading:
        return distance
    apart = math.pi - abs(abs(goal["yaw"] - pose.yaw) - math.pi)
    return distance + math.pow(0.75, distance) * apart


@dataclass
class StationkeepingState:
    """Sums over the frames since the run began."""

    frames: Count = 0
    total: float = 0.0
    """Of the errors [m]."""
    error: float = 0.0
    """The last [m]."""


class Stationkeeping(PlainRules):
    """The score is the mean error [m]; the way to the goal counts."""

    title = "station-keeping"

    def __init__(self, task: Mapping[str, Any]) -> None:
        self.state = StationkeepingState()
        self._boat, self._goal, self._heading = task["boat"], task["goal"], task["heading"]

    def update(self, frame: Frame, context: TaskContext) -> None:
        """Take the error of a frame into the mean."""
        if context.status.phase != "running":
            return
        own = self.state
        own.error = pose_error(frame.poses[self._boat], self._goal, heading=self._heading)
        own.frames, own.total = own.frames + 1, own.total + own.error
        context.set_score(own.total / own.frames)

    def outputs(self, status: TaskStatus) -> Outputs:
        """The goal from `ready` on, and the errors while it runs."""
        if status.phase == "initial":
            return {}
        return {"goal": self._goal, "pose_error": self.state.error, "mean_pose_error": status.score}
