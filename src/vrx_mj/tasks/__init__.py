"""Tasks, one record for each type: state machines over a stream of frames, without MuJoCo and without each other."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from vrx_mj.errors import UnknownNameError
from vrx_mj.model.tasks import TaskBase
from vrx_mj.tasks.courses import FollowPath, Gymkhana, NavigationCourse, Stationkeeping, Wayfinding
from vrx_mj.tasks.dock import Docking
from vrx_mj.tasks.perception import AcousticPerception, AcousticTracking, Perception
from vrx_mj.tasks.referee import Referee
from vrx_mj.tasks.wildlife import Wildlife

Form = Literal["number", "numbers", "text", "place", "places"]
"""Form of an output: numbers change from frame to frame, texts and places do not once they are announced."""
_ERRORS: Mapping[str, Form] = {"pose_error": "number", "mean_pose_error": "number"}
"""Outputs of tasks that score an error of the pose."""
_DOCKING: Mapping[str, None] = {"color_sequence_open": None, "symbol": None}
"""Outputs of docking tasks."""


@dataclass(frozen=True)
class TaskKind:
    """A type of task: its rules, what its score is (VRX's competition documents), and what a team may read of it."""

    rules: Callable[[Any], Referee]
    """Makes the referee from the task's compiled form."""
    score: str
    """Meaning of the score."""
    unit: str
    """Unit of the score."""
    better: Literal["lower", "higher"]
    """Which scores are better."""
    outputs: Mapping[str, Form | None] = field(default_factory=dict)
    """Outputs of the rules, by key; ROS has a topic for each with a form."""

    @property
    def meaning(self) -> str:
        """The score, its unit and which scores are better, in a line."""
        unit = "" if self.unit == "points" else f", in {self.unit}"
        return f"{self.score}{unit}; {self.better} is better"


TASK_KINDS: Mapping[str, TaskKind] = {
    "stationkeeping": TaskKind(Stationkeeping, "mean error of the pose", "m", "lower", {"goal": "place", **_ERRORS}),
    "wayfinding": TaskKind(
        Wayfinding,
        "mean of the smallest errors at the waypoints",
        "m",
        "lower",
        {"waypoints": "places", "min_errors": "numbers", "mean_error": "number"},
    ),
    "perception": TaskKind(
        Perception, "mean error of the reported positions (10 for a missed object)", "m", "lower", {"types": None}
    ),
    "navigation_course": TaskKind(NavigationCourse, "time per gate with penalties (200 for a failure)", "s", "lower"),
    "follow_path": TaskKind(FollowPath, "points for gates, minus points for collisions", "points", "higher"),
    "dock": TaskKind(Docking, "points for docking", "points", "higher", _DOCKING),
    "scan_and_dock": TaskKind(Docking, "points for the colours and docking", "points", "higher", _DOCKING),
    "scan_dock_deliver": TaskKind(
        Docking, "points for the colours, docking and the balls", "points", "higher", _DOCKING
    ),
    "wildlife": TaskKind(Wildlife, "time minus bonuses", "s", "lower", {"animals": None}),
    "gymkhana": TaskKind(
        Gymkhana,
        "mean distance to the beacon with penalties (200 without the channel)",
        "m",
        "lower",
        {"channel": None, "goal": "place", **_ERRORS},
    ),
    "acoustic_perception": TaskKind(AcousticPerception, "time until the beacon is reached", "s", "lower"),
    "acoustic_tracking": TaskKind(
        AcousticTracking, "mean horizontal distance to the beacon with penalties", "m", "lower", _ERRORS
    ),
}
"""Types of tasks, by name."""


def make_referee(task: TaskBase) -> Referee:
    """The referee of a task.

    Raises:
        UnknownNameError: no task is of this type.
    """
    if task.type not in TASK_KINDS:
        raise UnknownNameError("task type", task.type, TASK_KINDS)
    return TASK_KINDS[task.type].rules(task)
