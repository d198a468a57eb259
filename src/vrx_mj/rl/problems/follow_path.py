"""Follow the path: through gates, one after the other."""

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.rl.problem import Entry, Judged, Spot, Team, point
from vrx_mj.rl.problems.poses import Course
from vrx_mj.rl.refereed import Rows

_BETWEEN = (15.0, 25.0)
"""Distances from one gate to the next, least and greatest [m]."""
_BEND = np.radians(40.0)
"""Greatest bend between one gate and the next, either way [rad]."""
_WIDTH = 10.0
"""Width of a gate [m]; VRX's are 10 to 20 m wide."""


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
    entries = (
        *point("present gate's port end", 10.0),
        *point("present gate's starboard end", 10.0),
        *point("middle of the next gate", 10.0),
        Entry("whether a gate follows the present one", 1.0),
    )  # fmt: skip

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
            bend = random.uniform(-_BEND, _BEND)
            place = place + random.uniform(*_BETWEEN) * np.array([np.cos(course + bend), np.sin(course + bend)])
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
        left, right = x - 0.5 * _WIDTH * np.sin(course), x + 0.5 * _WIDTH * np.sin(course)
        up, down = y + 0.5 * _WIDTH * np.cos(course), y - 0.5 * _WIDTH * np.cos(course)
        next_x, next_y, _ = self._point(1)
        parts = (*team.toward(left, up), *team.toward(right, down), *team.toward(next_x, next_y), self._more())
        return np.stack(parts, axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """See whether the line was crossed since the step before, and where."""
        gap, along, aside = self._measures(team)
        reward = 0.1 * (self._gap - gap)
        over = (self._along < 0.0) & (along >= 0.0) & (self._at < self.count)
        share = np.where(over, -self._along / np.where(over, along - self._along, 1.0), 0.0)
        passed = over & (np.abs(self._aside + share * (aside - self._aside)) <= 0.5 * _WIDTH)
        reward += np.where(over, np.where(passed, 2.0 + self._in_a_row, -2.0), 0.0)
        self._passed += passed
        self._missed += over & ~passed
        self._in_a_row = np.where(over, passed, self._in_a_row)
        self._at += over
        self._gap, self._along, self._aside = self._measures(team)
        return Judged(reward, self._at >= self.count)

    def episode_facts(self) -> dict[str, npt.NDArray[np.generic]]:
        """The gates, (n, 6, 3): x, y [m] of the middle and course [rad] of each."""
        return {"gates": self._points}

    def facts(self) -> dict[str, npt.NDArray[np.generic]]:
        """How many gates were passed, and how many missed."""
        return {"passed": self._passed, "missed": self._missed}

    def _measures(self, team: Team) -> tuple[FloatArray, FloatArray, FloatArray]:
        """How far the boats are from the present gates' middles, along and to port of their courses [m]."""
        x, y, course = self._point(0)
        return np.hypot(x - team.x, y - team.y), *team.beyond(x, y, course)
