"""Acoustics: find a beacon that lies still, or stay with one that swims.

VRX 3's AcousticPerceptionScoringPlugin.cc and AcousticTrackingScoringPlugin.cc.
"""

import math
from dataclasses import dataclass

from vrx_mj.constants import EARLY
from vrx_mj.model import tasks
from vrx_mj.tasks.frame import Frame, TaskStatus
from vrx_mj.tasks.referee import Outputs, Referee, Rules, RunningMean, SetPinger

_PINGER_PERIOD = 0.1
"""Least time between two messages of where the moving beacon is [s]; VRX's."""


@dataclass
class AcousticPerceptionState:
    """What the boat has done so far."""

    distance: float | None = None
    """Distance to the beacon [m], in space; None before the first frame, at which the beacon is put to its place."""


class AcousticPerception(Rules):
    """The score is the time until the boat is within `goal_tolerance` of the beacon; a run in vain has the full time.

    As in VRX the distance is taken in space, so that a deep beacon leaves less room, and the task ends in any phase: a
    boat that gets there before it runs has 0 s. The last VRX 3 also leaves a run in vain at 0 s, the best score of all;
    here it is as it was before.
    """

    title = "acoustic perception"
    watches_early = True
    state: AcousticPerceptionState

    def __init__(self, task: tasks.AcousticPerception) -> None:
        self.state = AcousticPerceptionState()
        self._boat, self._tolerance = task.boat, task.goal_tolerance
        self._pinger = (task.pinger.x, task.pinger.y, task.pinger.z)

    def update(self, frame: Frame, referee: Referee) -> None:
        """Look whether the boat is there."""
        own = self.state
        if own.distance is None:
            referee.act(SetPinger(self._boat, self._pinger))
        boat = frame.poses[self._boat]
        own.distance = math.dist((boat.x, boat.y, boat.z), self._pinger)
        referee.set_score(referee.status.elapsed)
        if own.distance <= self._tolerance:
            referee.log(
                f"{self._boat} is {own.distance:.2f} m from the beacon: found after {referee.status.elapsed:.2f} s"
            )
            referee.finish()

    def timeout_score(self, status: TaskStatus) -> float | None:
        """The full time."""
        return status.duration


@dataclass
class AcousticTrackingState(RunningMean):
    """Sums over the frames since the run began."""

    due: float = 0.0
    """Time at which the beacon of the receivers is placed next [s]."""


class AcousticTracking(Rules):
    """The score is the mean horizontal distance to the beacon [m], at time-out with a penalty for every collision.

    VRX's quirk is kept: receivers hear the beacon `pinger_depth` above the water, not below it.
    """

    title = "acoustic tracking"
    state: AcousticTrackingState

    def __init__(self, task: tasks.AcousticTracking) -> None:
        self.state = AcousticTrackingState()
        self._boat, self._pinger = task.boat, task.pinger
        self._height, self._penalty = task.pinger_depth, task.obstacle_penalty

    def update(self, frame: Frame, referee: Referee) -> None:
        """Take the distance of a frame into the mean, and have the beacon sound from where it is."""
        own, boat, pinger = self.state, frame.poses[self._boat], frame.poses[self._pinger]
        if frame.time >= own.due - EARLY:
            own.due = frame.time + _PINGER_PERIOD
            referee.act(SetPinger(self._boat, (pinger.x, pinger.y, self._height)))
        referee.set_score(own.add(math.hypot(pinger.x - boat.x, pinger.y - boat.y)))

    def timeout_score(self, status: TaskStatus) -> float | None:
        """The mean and the penalties, also those of collisions before the run began, as in VRX."""
        return status.score + self._penalty * status.collisions

    def outputs(self, status: TaskStatus) -> Outputs:
        """The errors, once it runs."""
        if not self.state.frames:
            return {}
        return {"pose_error": self.state.error, "mean_pose_error": self.state.mean}
