"""Wayfinding: come near to every waypoint, in any order (VRX wayfinding_scoring_plugin.cc)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.errors import StateError
from vrx_mj.tasks.frame import Frame
from vrx_mj.tasks.rules import Desk, Outputs, PlainRules
from vrx_mj.tasks.sheet import Phase, Sheet
from vrx_mj.tasks.stationkeeping import pose_error

__all__ = ["Wayfinding"]


@dataclass
class State:
    """The least errors."""

    errors: list[float] = field(default_factory=list)
    """Of each waypoint since the run began [m], as station-keeping has them; none before."""


class Wayfinding(PlainRules):
    """The score is the mean over the waypoints of the least error [m]; the run lasts until time is up."""

    title = "wayfinding"

    def __init__(self, task: Mapping[str, Any]) -> None:
        self.state = State()
        self._boat, self._waypoints = task["boat"], list(task["waypoints"])

    @property
    def progress(self) -> dict[str, Any]:
        """The least errors [m]."""
        return {"waypoints": self.state.errors}

    def update(self, frame: Frame, desk: Desk) -> None:
        """Take the errors of a frame, where they are less than those before."""
        if desk.sheet.phase != "running":
            return
        boat = frame.stands[self._boat]
        now = [pose_error(boat, waypoint) for waypoint in self._waypoints]
        self.state.errors = list(map(min, self.state.errors or now, now))
        desk.set_score(sum(self.state.errors) / len(self.state.errors))

    def enter(self, phase: Phase, frame: Frame, desk: Desk) -> None:
        """At the end, say how near the boat came."""
        if phase == "finished":
            for number, error in enumerate(self.state.errors, start=1):
                desk.tell(f"waypoint {number} of {len(self._waypoints)}: least error {error:.2f} m")

    def check(self, state: State) -> None:
        """There is an error for each waypoint, or none yet.

        Raises:
            StateError: there are more or less.
        """
        if len(state.errors) not in {0, len(self._waypoints)}:
            raise StateError(f"the state does not fit the task: {len(state.errors)} of {len(self._waypoints)} errors")

    def outputs(self, sheet: Sheet) -> Outputs:
        """The waypoints from `ready` on, and the errors while it runs."""
        if sheet.phase == "initial":
            return {}
        return {"waypoints": self._waypoints, "min_errors": list(self.state.errors), "mean_error": sheet.score}
