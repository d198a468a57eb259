"""Wayfinding: come near to every waypoint, in any order (VRX wayfinding_scoring_plugin.cc)."""

from dataclasses import dataclass, field

from vrx_mj.errors import StateError
from vrx_mj.model import tasks
from vrx_mj.model.world import tree_of
from vrx_mj.tasks.frame import Frame, Phase, TaskStatus
from vrx_mj.tasks.referee import Outputs, Referee, Rules
from vrx_mj.tasks.stationkeeping import pose_error


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
        self._boat, self._waypoints = task.boat, task.waypoints

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
            "waypoints": tree_of(self._waypoints),
            "min_errors": list(self.state.errors),
            "mean_error": status.score,
        }
