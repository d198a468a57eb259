"""Tasks of courses: hold a pose, visit waypoints, and pass gates (navigation course, path with points, gymkhana).

The `left` marker of VRX's files comes to starboard of a boat that crosses the gate as it should: red right returning.
References: VRX navigation_scoring_plugin.cc of gazebo_classic, and VRX 3 NavigationScoringPlugin.cc.

Gymkhana (VRX gymkhana_scoring_plugin.cc) has its channel as a task of its own, with its own collisions, dead time and
penalty: the navigation course, and in VRX 3 the path with points, which cannot fail.

Station-keeping is scored for the whole run, and waypoints may be visited in any order (VRX
stationkeeping_scoring_plugin.cc and wayfinding_scoring_plugin.cc).
"""

import math
from dataclasses import dataclass, field, fields
from typing import Any, Literal, NamedTuple

from vrx_mj.errors import StateError
from vrx_mj.model import tasks
from vrx_mj.model.world import tree_of
from vrx_mj.tasks.referee import Frame, Outputs, Phase, Pose, Referee, RunningMean, SetPinger

FAILURE_SCORE = 200.0
"""The score of a run that failed or whose time was up, though no run of 300 s scores as much."""


def pose_error(pose: Pose, goal: tasks.Goal, *, heading: bool = True) -> float:
    """Error of a pose [m]: e = d + 0.75^d h, with d the horizontal distance [m] and h that of the headings [rad].

    VRX's quirk is kept: h = pi - ||goal - yaw| - pi| holds up to two full turns apart, beyond which it is negative.
    """
    away = distance(pose, goal)
    if not heading:
        return away
    apart = math.pi - abs(abs(goal.yaw - pose.yaw) - math.pi)
    return away + math.pow(0.75, away) * apart


def distance(pose: Pose, goal: tasks.Goal | tasks.Pinger) -> float:
    """Horizontal distance [m]."""
    return math.hypot(goal.x - pose.x, goal.y - pose.y)


class Stationkeeping(Referee):
    """The score is the mean error [m], the approach to the goal included."""

    title = "station-keeping"

    def __init__(self, task: tasks.Stationkeeping) -> None:
        super().__init__(task, RunningMean())
        self._goal, self._heading, self._goal_output = task.goal, task.heading, tree_of(task.goal)

    def update(self, frame: Frame) -> None:
        """Take the error of a frame into the mean."""
        error = pose_error(frame.poses[self.boat], self._goal, heading=self._heading)
        self.set_score(self.state.add(error))

    @property
    def outputs(self) -> Outputs:
        """The goal from `ready` on, and the errors while it runs."""
        if self.status.phase == "initial":
            return {}
        return {"goal": dict(self._goal_output), **self.state.outputs}


@dataclass
class WayfindingState:
    """Least errors of the waypoints."""

    errors: list[float] = field(default_factory=list)
    """Least error of each waypoint since the run began [m], as station-keeping has them; none before."""


class Wayfinding(Referee):
    """The score is the mean over the waypoints of the least error [m]; the run lasts until time is up."""

    title = "wayfinding"

    def __init__(self, task: tasks.Wayfinding) -> None:
        super().__init__(task, WayfindingState())
        self._waypoints, self._waypoint_outputs = task.waypoints, tree_of(task.waypoints)

    @property
    def parts(self) -> dict[str, object]:
        """The least errors [m]."""
        return {"waypoints": self.state.errors}

    def update(self, frame: Frame) -> None:
        """Take the errors of a frame, where they are less than those before."""
        boat = frame.poses[self.boat]
        now = [pose_error(boat, waypoint) for waypoint in self._waypoints]
        self.state.errors = list(map(min, self.state.errors or now, now))
        self.set_score(sum(self.state.errors) / len(self.state.errors))

    def enter(self, phase: Phase, frame: Frame) -> None:
        """Log the smallest errors at the end."""
        if phase == "finished":
            for number, error in enumerate(self.state.errors, start=1):
                self.log(f"waypoint {number} of {len(self._waypoints)}: smallest error {error:.2f} m")

    def check_state(self, state: WayfindingState) -> None:
        """Check that there is an error for each waypoint, or none yet.

        Raises:
            StateError: there are more or fewer.
        """
        if len(state.errors) not in {0, len(self._waypoints)}:
            raise StateError(f"the state does not fit the task: {len(state.errors)} of {len(self._waypoints)} errors")

    @property
    def outputs(self) -> Outputs:
        """The waypoints from `ready` on, and the errors while it runs."""
        if self.status.phase == "initial":
            return {}
        errors = {"min_errors": list(self.state.errors), "mean_error": self.status.score}
        return {"waypoints": [dict(each) for each in self._waypoint_outputs], **(errors if self.state.errors else {})}


Side = Literal["outside", "before", "after"]
_Passage = Literal["forwards", "backwards"]
_GateStatus = Literal["ahead", "crossed", "missed", "backwards"]
"""Status of a gate: `missed` if a later one was passed before it."""


class Gate(NamedTuple):
    """Position of a gate at a moment; buoys drift."""

    x: float
    """Middle of the gate [m], east."""
    y: float
    """Middle of the gate [m], north."""
    yaw: float
    """Direction in which to cross it [rad], counter-clockwise from x."""
    width: float
    """Width [m]; as in VRX between the buoys' origins in space, so that their heights count."""


def gate_between(left: Pose, right: Pose) -> Gate:
    """The gate of two buoys."""
    across_x, across_y = left.x - right.x, left.y - right.y
    width = math.hypot(across_x, across_y, left.z - right.z)
    yaw = math.atan2(across_x, -across_y)
    return Gate((left.x + right.x) / 2.0, (left.y + right.y) / 2.0, yaw, width)


def side_of(gate: Gate, x: float, y: float) -> Side:
    """Where a point is: in the strip of the gate's width `before` it or `after` it, or `outside` of the strip."""
    east, north = x - gate.x, y - gate.y
    along_x, along_y = math.cos(gate.yaw), math.sin(gate.yaw)
    if abs(north * along_x - east * along_y) > gate.width / 2.0:
        return "outside"
    return "after" if east * along_x + north * along_y >= 0.0 else "before"


def passage(gate: tasks.Gate, before: str, boat: str, frame: Frame) -> tuple[Side, _Passage | None]:
    """Where the boat is in a gate now, and whether it has passed it since it was at `before`."""
    poses = frame.poses
    place = poses[boat]
    now = side_of(gate_between(poses[gate.left], poses[gate.right]), place.x, place.y)
    if now == "after" and before == "before":
        return now, "forwards"
    return now, "backwards" if now == "before" and before == "after" else None


@dataclass
class GatesState:
    """State of each gate, in their order."""

    gates: list[_GateStatus] = field(default_factory=list)
    """Status of each gate: see `_GateStatus`."""
    sides: list[Side] = field(default_factory=list)
    """Side of each gate on which the boat was at the frame before."""


class _GateRules(Referee):
    """State and progress of a course of gates."""

    def __init__(self, task: tasks.Navigation | tasks.FollowPath) -> None:
        self._gates, self._penalty = task.gates, task.obstacle_penalty
        super().__init__(task, GatesState(["ahead"] * len(self._gates), ["outside"] * len(self._gates)))

    @property
    def parts(self) -> dict[str, object]:
        """Status of each gate."""
        return {"gates": self.state.gates}


class NavigationCourse(_GateRules):
    """The score is the time per gate [s] with penalties; a gate out of turn, or crossed backwards, is a failure."""

    title = "the navigation course"

    def update(self, frame: Frame) -> None:
        """Look at the gates that are still ahead."""
        status, gates = self.status, self.state.gates
        spent = status.elapsed + status.collisions * self._penalty
        self.set_score(min(status.duration, spent) / len(gates))
        for index, gate in enumerate(gates):
            if gate == "ahead" and self._judge(index, frame):
                self.set_score(FAILURE_SCORE)
                self.finish()
                return
        if "ahead" not in gates:
            self.finish()

    def timeout_score(self) -> float | None:
        """Score of a failure, as time is up."""
        return FAILURE_SCORE

    def _judge(self, index: int, frame: Frame) -> bool:
        """Note whether the boat passes a gate; whether that ends the run as a failure."""
        own = self.state
        own.sides[index], way = passage(self._gates[index], own.sides[index], self.boat, frame)
        if way is None:
            return False
        own.gates[index] = "crossed" if way == "forwards" else "backwards"
        if way == "backwards":
            self.log(f"gate {index + 1} crossed backwards: failed", "WARN")
            return True
        if "ahead" in own.gates[:index]:
            missed = own.gates.index("ahead")
            own.gates[missed:index] = ["missed"] * (index - missed)
            self.log(f"gate {index + 1} crossed before gate {missed + 1}: failed", "WARN")
            return True
        self.log(f"gate {index + 1} of {len(own.gates)} crossed, {self.status.elapsed:.1f} s")
        return False


class FollowPath(_GateRules):
    """The score is in points; none are lost when time is up."""

    title = "the path"

    def __init__(self, task: tasks.FollowPath) -> None:
        super().__init__(task)
        self._points, self._bonus = task.points_per_gate_crossed, task.bonus

    def update(self, frame: Frame) -> None:
        """Look at the gates that are still ahead.

        Until the first gate is crossed no other counts, and it cannot be lost by crossing it backwards.
        """
        own = self.state
        for index, gate in enumerate(own.gates):
            if index > 0 and own.gates[0] == "ahead":
                return
            if gate != "ahead":
                continue
            own.sides[index], way = passage(self._gates[index], own.sides[index], self.boat, frame)
            if way == "forwards" or (way == "backwards" and index > 0):
                self._pass(index, way)

    def take_hit(self, other: str, frame: Frame) -> None:
        """Subtract the penalty of a collision; the score stays at 0 or more."""
        self.set_score(max(0.0, self.status.score - self._penalty))

    def _pass(self, index: int, way: _Passage) -> None:
        """Note that a gate was passed, after which no gate before it counts."""
        gates = self.state.gates
        last = index == len(gates) - 1
        gates[:index] = ["missed" if gate == "ahead" else gate for gate in gates[:index]]
        if way == "forwards":
            gates[index] = "crossed"
            in_a_row = index > 0 and gates[index - 1] == "crossed"
            status = self.status
            self.set_score(status.score + self._points + self._bonus * (in_a_row + last))
            self.log(f"gate {index + 1} of {len(gates)} crossed, {status.elapsed:.1f} s: {status.score:g} points")
        else:
            gates[index] = "backwards"
            self.log(f"gate {index + 1} crossed backwards: no points for it", "WARN")
        if last:
            self.finish()


def _channel_referee(task: tasks.Gymkhana) -> Referee:
    """The referee of the channel; points as in VRX 3, where a world cannot set them."""
    base = {own.name: getattr(task, own.name) for own in fields(tasks.TaskBase)}
    base |= vars(task.channel) | {"name": f"{task.name}_channel", "locked": False, "held": False}
    if task.profile == "vrx3":
        path = tasks.FollowPath(**base | {"type": "follow_path", "points_per_gate_crossed": 10.0, "bonus": 1.0})
        return FollowPath(path)
    return NavigationCourse(tasks.Navigation(**base | {"type": "navigation_course"}))


@dataclass
class GymkhanaState(RunningMean):
    """Sums over the frames since the run began, the way through the channel included."""

    channel: dict[str, Any] = field(default_factory=dict)
    """State of the channel's referee, as it was dumped."""


class Gymkhana(Referee):
    """The score is `FAILURE_SCORE` until the channel is finished, then the mean distance to the beacon [m]."""

    title = "the gymkhana"
    watches_early = True

    def __init__(self, task: tasks.Gymkhana) -> None:
        self._pinger, self._penalty = task.pinger, task.obstacle_penalty
        self._may_fail = task.profile != "vrx3"
        self._channel = _channel_referee(task)
        super().__init__(task, GymkhanaState(channel=self._channel.dump()))

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
    def parts(self) -> dict[str, object]:
        """Status of each gate."""
        return self._channel.progress

    def enter(self, phase: Phase, frame: Frame) -> None:
        """Put the beacon in its place; at the end, let the channel's time be up too."""
        if phase == "ready":
            self.act(SetPinger(self.boat, (self._pinger.x, self._pinger.y, self._pinger.z)))
        if phase == "finished":
            self._watch_channel(frame)

    def update(self, frame: Frame) -> None:
        """Watch the channel, and take the distance of a frame into the mean."""
        self._watch_channel(frame)
        if self.status.phase != "running":
            return
        channel, mean = self._channel, self._sums.add(distance(frame.poses[self.boat], self._pinger))
        self.set_score(mean if channel.is_over else FAILURE_SCORE)
        if self._may_fail and channel.is_over and channel.status.score == FAILURE_SCORE:
            self.set_score(FAILURE_SCORE)
            self.finish()

    def timeout_score(self) -> float | None:
        """The mean with penalties, which are added only here; a channel that ran out of time has failed without."""
        if self._may_fail and not self._channel.is_over:
            return FAILURE_SCORE
        return self.status.score + self.status.collisions * self._penalty

    def check_state(self, state: GymkhanaState) -> None:
        """Check the part of the channel's referee.

        Raises:
            StateError: it does not fit the channel.
        """
        self._channel.check(state.channel)

    @property
    def outputs(self) -> Outputs:
        """The beacon's place from `ready` on, the distances while it runs, and how the channel goes."""
        if self.status.phase == "initial":
            return {"channel": self._channel.info}
        return {"goal": tree_of(self._pinger), **self._sums.outputs, "channel": self._channel.info}

    def _watch_channel(self, frame: Frame) -> None:
        for text, level in self._channel.look(frame).lines:
            self.log(text, level)
