"""From a task's parameters to its referee."""

from collections.abc import Callable, Mapping
from typing import Any

from vrx_mj.errors import UnknownNameError
from vrx_mj.tasks.acoustics import AcousticPerception, AcousticTracking
from vrx_mj.tasks.dock import Docking
from vrx_mj.tasks.follow_path import FollowPath
from vrx_mj.tasks.gymkhana import Gymkhana
from vrx_mj.tasks.navigation import NavigationCourse
from vrx_mj.tasks.perception import Perception
from vrx_mj.tasks.referee import Referee
from vrx_mj.tasks.rules import Rules
from vrx_mj.tasks.stationkeeping import Stationkeeping
from vrx_mj.tasks.wayfinding import Wayfinding
from vrx_mj.tasks.wildlife import Wildlife

__all__ = ["RULES", "make_referee"]

RULES: Mapping[str, Callable[[Mapping[str, Any]], Rules]] = {
    "stationkeeping": Stationkeeping,
    "wayfinding": Wayfinding,
    "perception": Perception,
    "navigation_course": NavigationCourse,
    "follow_path": FollowPath,
    "dock": Docking,
    "scan_and_dock": Docking,
    "scan_dock_deliver": Docking,
    "wildlife": Wildlife,
    "gymkhana": Gymkhana,
    "acoustic_perception": AcousticPerception,
    "acoustic_tracking": AcousticTracking,
}
"""Makers of rules from a task's parameters, by type."""


def make_referee(task: Mapping[str, Any]) -> Referee:
    """The referee of a task: `World.tree["task"]`.

    Raises:
        UnknownNameError: no task is of this type.
    """
    if task["type"] not in RULES:
        raise UnknownNameError("task type", str(task["type"]), RULES)
    return Referee(task, RULES[task["type"]](task))
