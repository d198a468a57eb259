"""The types of tasks, one record each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from vrx_mj.errors import UnknownNameError
from vrx_mj.model.tasks import TaskBase
from vrx_mj.tasks.acoustics import AcousticPerception, AcousticTracking
from vrx_mj.tasks.dock import Docking
from vrx_mj.tasks.gates import FollowPath, NavigationCourse
from vrx_mj.tasks.gymkhana import Gymkhana
from vrx_mj.tasks.perception import Perception
from vrx_mj.tasks.referee import Referee
from vrx_mj.tasks.rules import Rules
from vrx_mj.tasks.stationkeeping import Stationkeeping
from vrx_mj.tasks.wayfinding import Wayfinding
from vrx_mj.tasks.wildlife import Wildlife


@dataclass(frozen=True)
class TaskKind:
    """A type of task: its rules, and what its score is (VRX's competition documents)."""

    rules: Callable[[Any], Rules]
    """Makes the rules from the task's parameters."""
    unit: str
    """Unit of the score."""
    better: Literal["lower", "higher"]
    """Which scores are better."""


TASK_KINDS: Mapping[str, TaskKind] = {
    "stationkeeping": TaskKind(Stationkeeping, "m", "lower"),
    "wayfinding": TaskKind(Wayfinding, "m", "lower"),
    "perception": TaskKind(Perception, "m", "lower"),
    "navigation_course": TaskKind(NavigationCourse, "s", "lower"),
    "follow_path": TaskKind(FollowPath, "points", "higher"),
    "dock": TaskKind(Docking, "points", "higher"),
    "scan_and_dock": TaskKind(Docking, "points", "higher"),
    "scan_dock_deliver": TaskKind(Docking, "points", "higher"),
    "wildlife": TaskKind(Wildlife, "s", "lower"),
    "gymkhana": TaskKind(Gymkhana, "m", "lower"),
    "acoustic_perception": TaskKind(AcousticPerception, "s", "lower"),
    "acoustic_tracking": TaskKind(AcousticTracking, "m", "lower"),
}
"""All of them by type."""


def make_referee(task: TaskBase) -> Referee:
    """The referee of a task.

    Raises:
        UnknownNameError: no task is of this type.
    """
    if task.type not in TASK_KINDS:
        raise UnknownNameError("task type", task.type, TASK_KINDS)
    return Referee(task, TASK_KINDS[task.type].rules(task))
