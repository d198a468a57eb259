"""Follow the path: points for gates, in their order but not all of them (VRX 3 NavigationScoringPlugin.cc)."""

from collections.abc import Mapping
from typing import Any

from vrx_mj.tasks.frame import Frame
from vrx_mj.tasks.gates import Passage, marker_names, passage
from vrx_mj.tasks.navigation import State
from vrx_mj.tasks.rules import Desk, PlainRules

__all__ = ["FollowPath"]


class FollowPath(PlainRules):
    """The score is in points; none are lost when time is up."""

    title = "the path"

    def __init__(self, task: Mapping[str, Any]) -> None:
        self._boat, self._gates, self._penalty = task["boat"], task["gates"], task["obstacle_penalty"]
        self._points, self._bonus = task["points_per_gate_crossed"], task["bonus"]
        self.state = State(["ahead"] * len(self._gates), ["outside"] * len(self._gates))
        self.watched = marker_names(self._gates)

    @property
    def progress(self) -> dict[str, Any]:
        """What became of the gates."""
        return {"gates": self.state.gates}

    def update(self, frame: Frame, desk: Desk) -> None:
        """Look at the gates that are still ahead.

        Until the first gate is crossed no other counts, and it cannot be lost by crossing it backwards.
        """
        if desk.sheet.phase != "running":
            return
        own = self.state
        for index, fate in enumerate(own.gates):
            if index > 0 and own.gates[0] == "ahead":
                return
            if fate != "ahead":
                continue
            own.sides[index], way = passage(self._gates[index], own.sides[index], self._boat, frame)
            if way == "forwards" or (way == "backwards" and index > 0):
                self._pass(index, way, desk)

    def hit(self, other: str, frame: Frame, desk: Desk) -> None:
        """Points are lost, but there are never less than 0."""
        desk.set_score(max(0.0, desk.sheet.score - self._penalty))

    def _pass(self, index: int, way: Passage, desk: Desk) -> None:
        """Take note of a gate that was passed, after which no gate before it counts."""
        fates = self.state.gates
        last = index == len(fates) - 1
        fates[:index] = ["missed" if fate == "ahead" else fate for fate in fates[:index]]
        if way == "forwards":
            fates[index] = "crossed"
            in_a_row = index > 0 and fates[index - 1] == "crossed"
            desk.set_score(desk.sheet.score + self._points + self._bonus * (in_a_row + last))
            desk.tell(
                f"gate {index + 1} of {len(fates)} crossed, {desk.sheet.elapsed:.1f} s: {desk.sheet.score:g} points"
            )
        else:
            fates[index] = "backwards"
            desk.tell(f"gate {index + 1} crossed backwards: no points for it", "WARN")
        if last:
            desk.finish()
