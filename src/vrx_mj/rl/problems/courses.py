"""Problems of courses: hold a pose, visit poses in turn, and follow a path through gates."""

from typing import ClassVar

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.rl.problem import Entry, Facts, Judged, Problem, Rows, Spot, Team, point, pose_error, turn_to, wrap_angle

_GOAL_DISTANCE = 10.0
"""Greatest distance of the pose to hold from the start [m]."""
_LEG_LENGTHS = (10.0, 25.0)
"""Distances from one waypoint to the next, least and greatest [m]."""
_WAYPOINT_TOLERANCE = 1.5
"""A waypoint is reached when VRX's error of its pose is below this [m]."""
_GATE_DISTANCES = (15.0, 25.0)
"""Least and largest distance from one gate to the next [m]."""
_MAX_BEND = np.radians(40.0)
"""Largest bend between one gate and the next, either way [rad]."""
_GATE_WIDTH = 10.0
"""Width of a gate [m]; VRX's are 10 to 20 m wide."""


class StationKeeping(Problem):
    """The goal is drawn within 10 m of the start, with any heading.

    Reward: -0.1 e in each step, with e VRX's error of the pose [m]. Nothing but the loss of the boat ends an episode
    before its time is up; it forfeits 0.1 (e + 10) for each step left. `info`: `pose_error` [m], and `mean_pose_error`
    [m] since the start, which is VRX's score; at the start `goal`, x, y [m] and heading [rad].
    """

    duration = 60.0
    row_arrays = ("_goal", "_error", "_sum", "_steps")
    entries = (*point("goal", 10.0), *point("goal", 1.0), *turn_to("the goal's heading"))  # fmt: skip
    start_facts = ("goal",)

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        self._goal = np.zeros((self.n, 3))
        self._error, self._sum, self._steps = np.zeros((self.n, 1)), np.zeros((self.n, 1)), np.zeros(self.n, np.int64)

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """Goals are spread evenly over the disc; the boat starts at the origin."""
        distance, bearing = _GOAL_DISTANCE * np.sqrt(random.random()), random.uniform(-np.pi, np.pi)
        heading = random.uniform(-np.pi, np.pi)
        self._goal[row] = distance * np.cos(bearing), distance * np.sin(bearing), heading
        return [(0.0, 0.0, random.uniform(-np.pi, np.pi), 0.0)]

    def begin(self, who: BoolArray, team: Team) -> None:
        """The mean starts anew."""
        self._sum[who], self._steps[who[:, 0]] = 0.0, 0
        self._error = np.where(who, self._now(team), self._error)

    def observe(self, team: Team) -> FloatArray:
        """The goal from the boat, from afar and close up."""
        x, y, yaw = self._goal.T[:, :, None]
        turn, way = wrap_angle(yaw - team.yaw), team.toward(x, y)
        return np.stack((*way, *way, np.sin(turn), np.cos(turn)), axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Lose by the error."""
        self._error = self._now(team)
        self._sum += np.where(going[:, None], self._error, 0.0)
        self._steps += going
        return Judged(-0.1 * self._error, np.zeros_like(team.present))

    def forfeit(self, left: IntArray) -> FloatArray:
        """The error that the boat has, and 10 m more, for all steps left."""
        return 0.1 * (self._error + _GOAL_DISTANCE) * left[:, None]

    def facts(self) -> Facts:
        """Errors of pose, now and in the mean."""
        return {"pose_error": self._error, "mean_pose_error": self._sum / np.maximum(self._steps, 1)[:, None]}

    def _now(self, team: Team) -> FloatArray:
        return pose_error(team, *self._goal.T[:, :, None])


class Course(Problem):
    """A chain of places, x, y [m] and a direction [rad] each, of which one after the other counts."""

    row_arrays: ClassVar[tuple[str, ...]] = ("_points", "_at")
    count: ClassVar[int]
    """Number of places."""

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        self._points = np.zeros((self.n, self.count, 3))
        self._at = np.zeros((self.n, 1), np.int64)

    def _point(self, later: int) -> FloatArray:
        """Place (3, n, 1): x, y [m] and direction [rad] of the present one, or of one after it."""
        at = np.minimum(self._at + later, self.count - 1)[:, :, None]
        points: FloatArray = np.take_along_axis(self._points, at, axis=1)
        return points.transpose(2, 0, 1)

    def _more(self) -> FloatArray:
        """Marks (n, 1): 1 where a place follows the present one, else 0."""
        return (self._at < self.count - 1).astype(np.float64)


class Wayfinding(Course):
    """Three poses, each 10 to 25 m from the one before it in any direction, with any heading.

    Reward: 0.1 for every m by which VRX's error of the present pose has become less, and 5 when it is below 1.5 m, upon
    which the next one counts. The last one ends the episode. `info`: `reached`, how many, and `pose_error` [m]; at the
    start `waypoints`, x, y [m] and heading [rad] of each.
    """

    duration = 120.0
    count = 3
    row_arrays = (*Course.row_arrays, "_error")
    entries = (
        *point("present waypoint", 10.0),
        *turn_to("the present waypoint's heading"),
        *point("next waypoint", 10.0),
        Entry("whether a waypoint follows the present one", 1.0),
    )  # fmt: skip

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        self._error = np.zeros((self.n, 1))

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """A chain of waypoints from the origin on."""
        place = np.zeros(2)
        for number in range(self.count):
            bearing = random.uniform(-np.pi, np.pi)
            place = place + random.uniform(*_LEG_LENGTHS) * np.array([np.cos(bearing), np.sin(bearing)])
            self._points[row, number] = *place, random.uniform(-np.pi, np.pi)
        return [(0.0, 0.0, random.uniform(-np.pi, np.pi), 0.0)]

    def begin(self, who: BoolArray, team: Team) -> None:
        """The first waypoint is the present one."""
        self._at[who] = 0
        self._error = np.where(who, self._now(team), self._error)

    def observe(self, team: Team) -> FloatArray:
        """Both waypoints from the boat; after the last one it is the present one."""
        (x, y, yaw), (next_x, next_y, _) = self._point(0), self._point(1)
        angle = wrap_angle(yaw - team.yaw)
        parts = (*team.toward(x, y), np.sin(angle), np.cos(angle), *team.toward(next_x, next_y), self._more())
        return np.stack(parts, axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Gain by what the error has become less."""
        error = self._now(team)
        there = (error < _WAYPOINT_TOLERANCE) & (self._at < self.count)
        reward = 0.1 * (self._error - error) + 5.0 * there
        self._at += there
        self._error = self._now(team)
        return Judged(reward, self._at >= self.count)

    def episode_facts(self) -> Facts:
        """The waypoints, (n, 3, 3): x, y [m] and heading [rad] of each."""
        return {"waypoints": self._points}

    def facts(self) -> Facts:
        """How many waypoints are reached, and how far the present one is."""
        return {"reached": self._at, "pose_error": self._error}

    def _now(self, team: Team) -> FloatArray:
        return pose_error(team, *self._point(0))


class FollowPath(Course):
    """Six gates 10 m wide, 15 to 25 m apart, on a path that bends by up to 40 degrees at each.

    A gate is a line between two points; no buoys float there. Crossing the line forwards between its ends passes the
    gate; to cross its continuation misses it. Either way the next one counts, and the last one ends the episode.

    Reward: 0.1 for every m by which the middle of the present gate has come nearer, 2 for a gate that is passed and
    another one if the gate before it was, -2 for one that is missed. `info`: `passed` and `missed`, how many; at the
    start `gates`, x, y [m] of the middle and course [rad] of each.
    """

    duration = 120.0
    count = 6
    row_arrays = (*Course.row_arrays, "_passed", "_missed", "_in_a_row", "_gap", "_along", "_aside")
    entries = (
        *point("present gate's port end", 10.0),
        *point("present gate's starboard end", 10.0),
        *point("middle of the next gate", 10.0),
        Entry("whether a gate follows the present one", 1.0),
    )  # fmt: skip
    step_facts = ("passed", "missed")

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        self._passed, self._missed = (np.zeros((self.n, 1), np.int64) for _ in range(2))
        self._in_a_row = np.zeros((self.n, 1), np.bool_)
        self._gap, self._along, self._aside = (np.zeros((self.n, 1)) for _ in range(3))

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """A path that begins ahead of the boat."""
        place, course = np.zeros(2), random.uniform(-np.pi, np.pi)
        heading = course
        for number in range(self.count):
            bend = random.uniform(-_MAX_BEND, _MAX_BEND)
            place = place + random.uniform(*_GATE_DISTANCES) * np.array([np.cos(course + bend), np.sin(course + bend)])
            course += bend
            self._points[row, number] = *place, course
        return [(0.0, 0.0, heading, 0.0)]

    def begin(self, who: BoolArray, team: Team) -> None:
        """The first gate is the present one."""
        for array in (self._at, self._passed, self._missed, self._in_a_row):
            array[who] = 0
        now, before = self._measures(team), (self._gap, self._along, self._aside)
        self._gap, self._along, self._aside = (np.where(who, *pair) for pair in zip(now, before, strict=True))

    def observe(self, team: Team) -> FloatArray:
        """The ends of the present gate and the middle of the next from the boat."""
        x, y, course = self._point(0)
        left, right = x - 0.5 * _GATE_WIDTH * np.sin(course), x + 0.5 * _GATE_WIDTH * np.sin(course)
        up, down = y + 0.5 * _GATE_WIDTH * np.cos(course), y - 0.5 * _GATE_WIDTH * np.cos(course)
        next_x, next_y, _ = self._point(1)
        parts = (*team.toward(left, up), *team.toward(right, down), *team.toward(next_x, next_y), self._more())
        return np.stack(parts, axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """See whether the line was crossed since the step before, and where."""
        gap, along, aside = self._measures(team)
        reward = 0.1 * (self._gap - gap)
        over = (self._along < 0.0) & (along >= 0.0) & (self._at < self.count)
        crossed = self._aside * along - aside * self._along  # beside the middle, times how far it went along
        passed = over & (np.abs(crossed) <= 0.5 * _GATE_WIDTH * (along - self._along))
        reward += np.where(over, np.where(passed, 2.0 + self._in_a_row, -2.0), 0.0)
        self._passed += passed
        self._missed += over & ~passed
        self._in_a_row = np.where(over, passed, self._in_a_row)
        self._at += over
        self._gap, self._along, self._aside = self._measures(team)
        return Judged(reward, self._at >= self.count)

    def episode_facts(self) -> Facts:
        """The gates, (n, 6, 3): x, y [m] of the middle and course [rad] of each."""
        return {"gates": self._points}

    def _measures(self, team: Team) -> tuple[FloatArray, FloatArray, FloatArray]:
        """How far the boats are from the present gates' middles, along and to port of their courses [m]."""
        x, y, course = self._point(0)
        return np.hypot(x - team.x, y - team.y), *team.beyond(x, y, course)
