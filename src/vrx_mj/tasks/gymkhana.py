"""Gymkhana: a channel, then a beacon among obstacles (VRX gymkhana_scoring_plugin.cc).

The channel is a task of its own, with its own collisions, dead time and penalty: the navigation course, and in VRX 3
the path with points, which cannot fail.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.tasks.actions import SetPinger
from vrx_mj.tasks.follow_path import FollowPath
from vrx_mj.tasks.frame import Frame
from vrx_mj.tasks.kinds import Count
from vrx_mj.tasks.navigation import FAILURE, NavigationCourse
from vrx_mj.tasks.referee import Referee
from vrx_mj.tasks.rules import Desk, Outputs, PlainRules
from vrx_mj.tasks.sheet import Phase, Sheet
from vrx_mj.tasks.stationkeeping import pose_error

__all__ = ["Gymkhana"]


def channel_referee(task: Mapping[str, Any]) -> Referee:
    """The referee of the channel; points as in VRX 3, where a world cannot say them."""
    points = {"points_per_gate_crossed": 10.0, "bonus": 1.0}
    own = {"type": "navigation_course", "name": f"{task['name']}_channel", "locked": False, "held": False}
    part = {**task, **points, **task["channel"], **own}
    if task["profile"] == "vrx3":
        return Referee({**part, "type": "follow_path"}, FollowPath(part))
    return Referee(part, NavigationCourse(part))


@dataclass
class State:
    """Sums over the frames since the run began, the way through the channel included."""

    frames: Count = 0
    total: float = 0.0
    """Of the distances to the beacon [m]."""
    error: float = 0.0
    """The last [m]."""
    channel: dict[str, Any] = field(default_factory=dict)
    """What the channel's referee dumped."""


class Gymkhana(PlainRules):
    """The score is `FAILURE` until the channel is finished, then the mean distance to the beacon [m]."""

    title = "the gymkhana"

    def __init__(self, task: Mapping[str, Any]) -> None:
        self._boat, self._pinger = task["boat"], task["pinger"]
        self._penalty = float(task["obstacle_penalty"])
        self._may_fail = task["profile"] != "vrx3"
        self._channel = channel_referee(task)
        self._sums = State()
        self.watched = self._channel.watched

    @property
    def state(self) -> State:
        """All that changes, the channel's included."""
        own = self._sums
        return State(own.frames, own.total, own.error, self._channel.dump())

    @state.setter
    def state(self, state: State) -> None:
        self._channel.load(state.channel)
        self._sums = State(state.frames, state.total, state.error)

    @property
    def progress(self) -> dict[str, Any]:
        """What became of the gates."""
        return self._channel.progress

    def enter(self, phase: Phase, frame: Frame, desk: Desk) -> None:
        """Put the beacon in its place; at the end, let the channel's time be up too."""
        if phase == "ready":
            desk.act(SetPinger(self._boat, (self._pinger["x"], self._pinger["y"], self._pinger["z"])))
        if phase == "finished":
            self._watch_channel(frame, desk)

    def update(self, frame: Frame, desk: Desk) -> None:
        """Watch the channel, and take the distance of a frame into the mean."""
        self._watch_channel(frame, desk)
        if desk.sheet.phase != "running":
            return
        own, channel = self._sums, self._channel
        own.error = pose_error(frame.stands[self._boat], self._pinger, heading=False)
        own.frames, own.total = own.frames + 1, own.total + own.error
        desk.set_score(own.total / own.frames if channel.finished else FAILURE)
        if self._may_fail and channel.finished and channel.sheet.score == FAILURE:
            desk.set_score(FAILURE)
            desk.finish()

    def timeout_score(self, sheet: Sheet) -> float | None:
        """The mean with penalties, which are added only here; a channel that ran out of time has failed without."""
        if self._may_fail and not self._channel.finished:
            return FAILURE
        return sheet.score + sheet.collisions * self._penalty

    def check(self, state: State) -> None:
        """The channel's referee can take its part.

        Raises:
            StateError: it cannot.
        """
        self._channel.check(state.channel)

    def outputs(self, sheet: Sheet) -> Outputs:
        """The beacon's place from `ready` on, the distances while it runs, and how the channel goes."""
        if sheet.phase == "initial":
            return {"channel": self._channel.info}
        own = self._sums
        mean = own.total / own.frames if own.frames else 0.0
        return {
            "goal": self._pinger,
            "pose_error": own.error,
            "mean_pose_error": mean,
            "channel": self._channel.info,
        }

    def _watch_channel(self, frame: Frame, desk: Desk) -> None:
        for text, level in self._channel.look(frame).lines:
            desk.tell(text, level)
