"""Station-keeping: hold a pose for the whole run (VRX stationkeeping_scoring_plugin.cc)."""

import math

from vrx_mj.model import tasks
from vrx_mj.model.world import tree_of
from vrx_mj.tasks.frame import Frame, Pose, TaskStatus
from vrx_mj.tasks.referee import Outputs, Referee, Rules
from vrx_mj.tasks.rules import RunningMean


def pose_error(pose: Pose, goal: tasks.Goal, *, heading: bool = True) -> float:
    """Error of a pose [m]: e = d + 0.75^d h, with d the horizontal distance [m] and h that of the headings [rad].

    VRX's quirk is kept: h = pi - ||goal - yaw| - pi| holds up to two full turns apart, beyond which it is negative.
    """
    away = distance(pose, goal)
    if not heading:
        return away
    apart = math.pi - abs(abs(goal.yaw - pose.yaw) - math.pi)
    return away + math.pow(0.75, away) * apart


def distance(pose: Pose, goal: tasks.Goal | tasks.Pinger) -> float:
    """Horizontal distance [m]."""
    return math.hypot(goal.x - pose.x, goal.y - pose.y)


class Stationkeeping(Rules):
    """The score is the mean error [m]; the way to the goal counts."""

    title = "station-keeping"

    def __init__(self, task: tasks.Stationkeeping) -> None:
        self.state = RunningMean()
        self._boat, self._goal, self._heading = task.boat, task.goal, task.heading

    def update(self, frame: Frame, referee: Referee) -> None:
        """Take the error of a frame into the mean."""
        error = pose_error(frame.poses[self._boat], self._goal, heading=self._heading)
        referee.set_score(self.state.add(error))

    def outputs(self, status: TaskStatus) -> Outputs:
        """The goal from `ready` on, and the errors while it runs."""
        if status.phase == "initial":
            return {}
        return {"goal": tree_of(self._goal), "pose_error": self.state.error, "mean_pose_error": status.score}
