"""Navigation channel: cross all gates in their order (VRX navigation_scoring_plugin.cc of gazebo_classic)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.tasks.frame import Frame
from vrx_mj.tasks.gates import GateFate, Side, marker_names, passage
from vrx_mj.tasks.rules import Desk, PlainRules
from vrx_mj.tasks.sheet import Sheet

__all__ = ["FAILURE", "NavigationCourse"]

FAILURE = 200.0
"""The score of a run that failed or whose time was up, though no run of 300 s scores as much."""


@dataclass
class State:
    """Of the gates, in their order."""

    gates: list[GateFate] = field(default_factory=list)
    """What became of them: see `GateFate`."""
    sides: list[Side] = field(default_factory=list)
    """Where the boat was in them at the frame before: see `Side`."""


class NavigationCourse(PlainRules):
    """The score is the time per gate [s] with penalties; a gate out of turn, or crossed backwards, is a failure."""

    title = "the navigation course"

    def __init__(self, task: Mapping[str, Any]) -> None:
        self._boat, self._gates, self._penalty = task["boat"], task["gates"], task["obstacle_penalty"]
        self.state = State(["ahead"] * len(self._gates), ["outside"] * len(self._gates))
        self.watched = marker_names(self._gates)

    @property
    def progress(self) -> dict[str, Any]:
        """What became of the gates."""
        return {"gates": self.state.gates}

    def update(self, frame: Frame, desk: Desk) -> None:
        """Look at the gates that are still ahead."""
        sheet, fates = desk.sheet, self.state.gates
        if sheet.phase != "running":
            return
        spent = sheet.elapsed + sheet.collisions * self._penalty
        desk.set_score(min(sheet.duration, spent) / len(fates))
        for index, fate in enumerate(fates):
            if fate == "ahead" and self._fails(index, frame, desk):
                desk.set_score(FAILURE)
                desk.finish()
                return
        if "ahead" not in fates:
            desk.finish()

    def timeout_score(self, sheet: Sheet) -> float | None:
        """A failure."""
        return FAILURE

    def _fails(self, index: int, frame: Frame, desk: Desk) -> bool:
        """See whether the boat passes a gate now, and whether it should not have."""
        own = self.state
        own.sides[index], way = passage(self._gates[index], own.sides[index], self._boat, frame)
        if way is None:
            return False
        own.gates[index] = "crossed" if way == "forwards" else "backwards"
        if way == "backwards":
            desk.tell(f"gate {index + 1} crossed backwards: failed", "WARN")
            return True
        if "ahead" in own.gates[:index]:
            missed = own.gates.index("ahead")
            own.gates[missed:index] = ["missed"] * (index - missed)
            desk.tell(f"gate {index + 1} crossed before gate {missed + 1}: failed", "WARN")
            return True
        desk.tell(f"gate {index + 1} of {len(own.gates)} crossed, {desk.sheet.elapsed:.1f} s")
        return False
