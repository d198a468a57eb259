"""Tasks of perception: name and locate objects, find a beacon that lies still, and stay with one that swims.

References: VRX perception_scoring_plugin.cc, VRX 3 AcousticPerceptionScoringPlugin.cc and
AcousticTrackingScoringPlugin.cc.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, quote
from vrx_mj.model import tasks
from vrx_mj.tasks.referee import (
    Count,
    Frame,
    Outputs,
    PlaceObject,
    Pose,
    Referee,
    RunningMean,
    SetPinger,
)

_MISSED_ERROR = 10.0
"""Error of an object that was not reported [m]."""
_MAX_ERROR = 2.0
"""Largest error of a reported object [m]."""
_LANDMARK_KEYS = frozenset({"type", "x", "y"})
"""Keys of a report."""
_PINGER_PERIOD = 0.1
"""Least time between two messages of where the moving beacon is [s]; VRX's."""


def ahead_of(boat: Pose, pose: Sequence[float]) -> tuple[float, float, float, float, float, float]:
    """A pose in the world, given in the boat's frame of which only the yaw turns: x, y, z [m], roll, pitch, yaw."""
    x, y, z, roll, pitch, yaw = pose
    cos, sin = math.cos(boat.yaw), math.sin(boat.yaw)
    return (boat.x + cos * x - sin * y, boat.y + sin * x + cos * y, boat.z + z, roll, pitch, boat.yaw + yaw)


@dataclass
class PerceptionState:
    """State of each object, in the order of the task."""

    shown: list[bool]
    """Whether they are up now."""
    errors: list[float]
    """The least error of the reports of each [m], `_MISSED_ERROR` without any."""
    round_time: float = 0.0
    """When this round of the sequence began, in elapsed time [s]."""
    gone: Count = 0
    """Number of objects that have been up in this round and are gone."""
    attempts: Count = 0
    """Number of reports that are taken now: one for each object that is up, whatever its type."""
    total: float = 0.0
    """Sum of the errors of those that are gone [m]."""
    found: list[bool] = field(default_factory=list)
    """Whether there was a report of each."""


class Perception(Referee):
    """The score is the sum of errors [m] while it runs, and at its end their mean."""

    title, message = "perception", "landmark"

    def __init__(self, task: tasks.Perception) -> None:
        self._objects, self._loops = task.objects, task.loop_forever
        super().__init__(task, self._round(0.0))

    @property
    def parts(self) -> dict[str, object]:
        """Which objects are up, and the errors [m] of the reports."""
        return {
            "objects": [thing.name for thing in self._objects],
            "up": self.state.shown,
            "errors": self.state.errors,
        }

    def update(self, frame: Frame) -> None:
        """Take the reports, then show and hide objects."""
        for message in frame.messages:
            self._report(message.content, frame)
        own = self.state
        for index, thing in enumerate(self._objects):
            past = self.status.elapsed - own.round_time - thing.time
            if own.shown[index] and past > thing.duration + EARLY:
                self._hide(index)
            elif not own.shown[index] and EARLY < past < thing.duration:
                self._show(index, frame)
        if own.gone == len(self._objects):
            self.set_score(self.state.total / len(self._objects))
            if self._loops:
                self.state = self._round(self.status.elapsed)
            else:
                self.finish()

    @property
    def outputs(self) -> Outputs:
        """The types that reports name."""
        return {"types": sorted({thing.type for thing in self._objects})}

    def checked_content(self, content: object) -> object:
        """A report of a landmark: its type, x and y [m, ENU]."""
        if not isinstance(content, Mapping) or set(content) != _LANDMARK_KEYS:
            what = (
                f"the keys {', '.join(map(str, content)) or 'none'}" if isinstance(content, Mapping) else quote(content)
            )
            needs = "type, and x and y [m] or latitude and longitude [degrees]"
            raise CommandError(f"invalid landmark: the keys {needs} are needed, got {what}")
        if not isinstance(content["type"], str):
            raise CommandError(
                f"invalid landmark type {content['type']!r}: a name is needed, as in 'mb_marker_buoy_red'"
            )
        return {"type": content["type"], "x": _metres("x", content["x"]), "y": _metres("y", content["y"])}

    def _round(self, start: float) -> PerceptionState:
        count = len(self._objects)
        return PerceptionState([False] * count, [_MISSED_ERROR] * count, round_time=start, found=[False] * count)

    def _report(self, landmark: Mapping[str, Any], frame: Frame) -> None:
        """Each report uses up an attempt, right or wrong, and counts for all objects of its type that are up."""
        own = self.state
        if not own.attempts:
            self.log(f"landmark {landmark['type']} ignored: no attempts left", "WARN")
            return
        own.attempts -= 1
        hits = [
            index for index, thing in enumerate(self._objects) if thing.type == landmark["type"] and own.shown[index]
        ]
        for index in hits:
            name = self._objects[index].name
            error = math.hypot(landmark["x"] - frame.poses[name].x, landmark["y"] - frame.poses[name].y)
            own.errors[index], own.found[index] = min(_MAX_ERROR, own.errors[index], error), True
            self.log(f"landmark {name} found, error {error:.2f} m")
        if not hits:
            self.log(f"landmark {landmark['type']} is not present now", "WARN")

    def _show(self, index: int, frame: Frame) -> None:
        thing = self._objects[index]
        self.state.shown[index] = True
        self.state.attempts += 1
        self.act(PlaceObject(thing.name, ahead_of(frame.poses[self.boat], thing.pose)))
        self.log(f"landmark {thing.name} appears")

    def _hide(self, index: int) -> None:
        own, thing = self.state, self._objects[index]
        own.shown[index] = False
        own.attempts = max(0, own.attempts - 1)
        own.gone += 1
        own.total += own.errors[index]
        self.act(PlaceObject(thing.name, thing.stash))
        self.set_score(own.total)
        result = f"error {own.errors[index]:.2f} m" if own.found[index] else f"not found, {_MISSED_ERROR:g} m"
        self.log(f"landmark {thing.name} disappears: {result}")


def _metres(key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise CommandError(f"invalid {key} {quote(value)} of a landmark: a number of metres is needed")
    return float(value)


@dataclass
class AcousticPerceptionState:
    """Progress of the boat."""

    distance: float | None = None
    """Distance to the beacon [m], in space; None before the first frame, at which the beacon is put to its place."""


class AcousticPerception(Referee):
    """The score is the time until the boat is within `goal_tolerance` of the beacon; a run in vain has the full time.

    As in VRX the distance is taken in space, so that a deep beacon leaves less room, and the task ends in any phase: a
    boat that gets there before it runs has 0 s. The last VRX 3 also leaves a run in vain at 0 s, the best score of all;
    here it is as it was before.
    """

    title = "acoustic perception"
    watches_early = True
    state: AcousticPerceptionState

    def __init__(self, task: tasks.AcousticPerception) -> None:
        super().__init__(task, AcousticPerceptionState())
        self._tolerance = task.goal_tolerance
        self._pinger = (task.pinger.x, task.pinger.y, task.pinger.z)

    def update(self, frame: Frame) -> None:
        """Look whether the boat is there."""
        own = self.state
        if own.distance is None:
            self.act(SetPinger(self.boat, self._pinger))
        boat = frame.poses[self.boat]
        own.distance = math.dist((boat.x, boat.y, boat.z), self._pinger)
        self.set_score(self.status.elapsed)
        if own.distance <= self._tolerance:
            self.log(f"{self.boat} is {own.distance:.2f} m from the beacon: found after {self.status.elapsed:.2f} s")
            self.finish()

    def timeout_score(self) -> float | None:
        """The full time."""
        return self.status.duration


@dataclass
class AcousticTrackingState(RunningMean):
    """Sums over the frames since the run began."""

    due: float = 0.0
    """Time at which the beacon of the receivers is placed next [s]."""


class AcousticTracking(Referee):
    """The score is the mean horizontal distance to the beacon [m], at time-out with a penalty for every collision.

    VRX's quirk is kept: receivers hear the beacon `pinger_depth` above the water, not below it.
    """

    title = "acoustic tracking"
    state: AcousticTrackingState

    def __init__(self, task: tasks.AcousticTracking) -> None:
        super().__init__(task, AcousticTrackingState())
        self._pinger, self._height, self._penalty = task.pinger, task.pinger_depth, task.obstacle_penalty

    def update(self, frame: Frame) -> None:
        """Take the distance of a frame into the mean, and have the beacon sound from where it is."""
        own, boat, pinger = self.state, frame.poses[self.boat], frame.poses[self._pinger]
        if frame.time >= own.due - EARLY:
            own.due = frame.time + _PINGER_PERIOD
            self.act(SetPinger(self.boat, (pinger.x, pinger.y, self._height)))
        self.set_score(own.add(math.hypot(pinger.x - boat.x, pinger.y - boat.y)))

    def timeout_score(self) -> float | None:
        """The mean and the penalties, also those of collisions before the run began, as in VRX."""
        return self.status.score + self._penalty * self.status.collisions

    @property
    def outputs(self) -> Outputs:
        """The errors, once it runs."""
        return self.state.outputs
