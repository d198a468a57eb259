"""Gymkhana: a channel, then a beacon among obstacles (VRX gymkhana_scoring_plugin.cc).

The channel is a task of its own, with its own collisions, dead time and penalty: the navigation course, and in VRX 3
the path with points, which cannot fail.
"""

from dataclasses import dataclass, field, fields
from typing import Any

from vrx_mj.model import tasks
from vrx_mj.model.world import tree_of
from vrx_mj.tasks.frame import Frame, Phase, TaskStatus
from vrx_mj.tasks.gates import FAILURE, FollowPath, NavigationCourse
from vrx_mj.tasks.referee import Outputs, Referee, Rules
from vrx_mj.tasks.rules import RunningMean, SetPinger
from vrx_mj.tasks.stationkeeping import distance


def _channel_referee(task: tasks.Gymkhana) -> Referee:
    """The referee of the channel; points as in VRX 3, where a world cannot set them."""
    base = {own.name: getattr(task, own.name) for own in fields(tasks.TaskBase)}
    base |= vars(task.channel) | {"name": f"{task.name}_channel", "locked": False, "held": False}
    if task.profile == "vrx3":
        path = tasks.FollowPath(**base | {"type": "follow_path", "points_per_gate_crossed": 10.0, "bonus": 1.0})
        return Referee(path, FollowPath(path))
    course = tasks.Navigation(**base | {"type": "navigation_course"})
    return Referee(course, NavigationCourse(course))


@dataclass
class GymkhanaState(RunningMean):
    """Sums over the frames since the run began, the way through the channel included."""

    channel: dict[str, Any] = field(default_factory=dict)
    """What the channel's referee dumped."""


class Gymkhana(Rules):
    """The score is `FAILURE` until the channel is finished, then the mean distance to the beacon [m]."""

    title = "the gymkhana"
    watches_early = True

    def __init__(self, task: tasks.Gymkhana) -> None:
        self._boat, self._pinger = task.boat, task.pinger
        self._penalty = task.obstacle_penalty
        self._may_fail = task.profile != "vrx3"
        self._channel = _channel_referee(task)
        self._sums = GymkhanaState()

    @property
    def state(self) -> GymkhanaState:
        """All that changes, the channel's included."""
        own = self._sums
        return GymkhanaState(own.frames, own.total, own.error, self._channel.dump())

    @state.setter
    def state(self, state: GymkhanaState) -> None:
        self._channel.load(state.channel)
        self._sums = GymkhanaState(state.frames, state.total, state.error)

    @property
    def progress(self) -> dict[str, object]:
        """What became of the gates."""
        return self._channel.progress

    def enter(self, phase: Phase, frame: Frame, referee: Referee) -> None:
        """Put the beacon in its place; at the end, let the channel's time be up too."""
        if phase == "ready":
            referee.act(SetPinger(self._boat, (self._pinger.x, self._pinger.y, self._pinger.z)))
        if phase == "finished":
            self._watch_channel(frame, referee)

    def update(self, frame: Frame, referee: Referee) -> None:
        """Watch the channel, and take the distance of a frame into the mean."""
        self._watch_channel(frame, referee)
        if referee.status.phase != "running":
            return
        channel, mean = self._channel, self._sums.add(distance(frame.poses[self._boat], self._pinger))
        referee.set_score(mean if channel.is_over else FAILURE)
        if self._may_fail and channel.is_over and channel.status.score == FAILURE:
            referee.set_score(FAILURE)
            referee.finish()

    def timeout_score(self, status: TaskStatus) -> float | None:
        """The mean with penalties, which are added only here; a channel that ran out of time has failed without."""
        if self._may_fail and not self._channel.is_over:
            return FAILURE
        return status.score + status.collisions * self._penalty

    def check(self, state: GymkhanaState) -> None:
        """The channel's referee can take its part.

        Raises:
            StateError: it cannot.
        """
        self._channel.check(state.channel)

    def outputs(self, status: TaskStatus) -> Outputs:
        """The beacon's place from `ready` on, the distances while it runs, and how the channel goes."""
        if status.phase == "initial":
            return {"channel": self._channel.info}
        return {
            "goal": tree_of(self._pinger),
            "pose_error": self._sums.error,
            "mean_pose_error": self._sums.mean,
            "channel": self._channel.info,
        }

    def _watch_channel(self, frame: Frame, referee: Referee) -> None:
        for text, level in self._channel.look(frame).lines:
            referee.log(text, level)
