"""Station-keeping: hold a pose for the whole run (VRX stationkeeping_scoring_plugin.cc).

Wayfinding: come near to every waypoint, in any order (VRX wayfinding_scoring_plugin.cc).
"""

import math
from dataclasses import dataclass, field

from vrx_mj.errors import StateError
from vrx_mj.model import tasks
from vrx_mj.model.world import tree_of
from vrx_mj.tasks.frame import Frame, Phase, Pose, TaskStatus
from vrx_mj.tasks.referee import Outputs, Referee, Rules, RunningMean


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
        self._shown = tree_of(task.goal)

    def update(self, frame: Frame, referee: Referee) -> None:
        """Take the error of a frame into the mean."""
        error = pose_error(frame.poses[self._boat], self._goal, heading=self._heading)
        referee.set_score(self.state.add(error))

    def outputs(self, status: TaskStatus) -> Outputs:
        """The goal from `ready` on, and the errors while it runs."""
        if status.phase == "initial":
            return {}
        return {"goal": dict(self._shown), "pose_error": self.state.error, "mean_pose_error": status.score}


@dataclass
class WayfindingState:
    """The least errors."""

    errors: list[float] = field(default_factory=list)
    """Least error of each waypoint since the run began [m], as station-keeping has them; none before."""


class Wayfinding(Rules):
    """The score is the mean over the waypoints of the least error [m]; the run lasts until time is up."""

    title = "wayfinding"

    def __init__(self, task: tasks.Wayfinding) -> None:
        self.state = WayfindingState()
        self._boat, self._waypoints, self._shown = task.boat, task.waypoints, tree_of(task.waypoints)

    @property
    def progress(self) -> dict[str, object]:
        """The least errors [m]."""
        return {"waypoints": self.state.errors}

    def update(self, frame: Frame, referee: Referee) -> None:
        """Take the errors of a frame, where they are less than those before."""
        boat = frame.poses[self._boat]
        now = [pose_error(boat, waypoint) for waypoint in self._waypoints]
        self.state.errors = list(map(min, self.state.errors or now, now))
        referee.set_score(sum(self.state.errors) / len(self.state.errors))

    def enter(self, phase: Phase, frame: Frame, referee: Referee) -> None:
        """Log at the end how near the boat came."""
        if phase == "finished":
            for number, error in enumerate(self.state.errors, start=1):
                referee.log(f"waypoint {number} of {len(self._waypoints)}: least error {error:.2f} m")

    def check(self, state: WayfindingState) -> None:
        """There is an error for each waypoint, or none yet.

        Raises:
            StateError: there are more or less.
        """
        if len(state.errors) not in {0, len(self._waypoints)}:
            raise StateError(f"the state does not fit the task: {len(state.errors)} of {len(self._waypoints)} errors")

    def outputs(self, status: TaskStatus) -> Outputs:
        """The waypoints from `ready` on, and the errors while it runs."""
        if status.phase == "initial":
            return {}
        return {
            "waypoints": [dict(each) for each in self._shown],
            "min_errors": list(self.state.errors),
            "mean_error": status.score,
        }
