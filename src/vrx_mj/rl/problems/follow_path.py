"""Follow the path: through gates, one after the other."""

from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.mjcf.world import World
from vrx_mj.rl.problem import Entry, Judged, Problem, Start, open_water
from vrx_mj.rl.seen import Seen

__all__ = ["FollowPath"]

COUNT = 6
LEGS = (15.0, 25.0)
"""From one gate to the next [m]."""
BEND = np.radians(40.0)
"""Between one gate and the next, either way, at most [rad]."""
WIDTH = 10.0
"""Of a gate [m]; VRX's are 10 to 20 m wide."""


class FollowPath(Problem):
    """Six gates 10 m wide, 15 to 25 m apart, on a path that bends by up to 40 degrees at each.

    A gate is a line between two points; no buoys float there. Crossing the line forwards between its ends passes the
    gate; to cross its continuation misses it. Either way the next one counts, and the last one ends the episode.

    Reward: 0.1 for every m by which the middle of the present gate has come nearer, 2 for a gate that is passed and
    another one if the gate before it was, -2 for one that is missed. `info`: `passed` and `missed`, how many; at the
    start `gates`, x, y [m] of the middle and course [rad] of each.
    """

    world = open_water()
    duration = 120.0
    entries = (
        Entry("present gate's port end ahead [m]", 10.0), Entry("present gate's port end to port [m]", 10.0),
        Entry("present gate's starboard end ahead [m]", 10.0), Entry("present gate's starboard end to port [m]", 10.0),
        Entry("middle of the next gate ahead [m]", 10.0), Entry("middle of the next gate to port [m]", 10.0),
        Entry("whether a gate follows the present one", 1.0),
    )  # fmt: skip

    def __init__(self, n: int, world: World) -> None:
        super().__init__(n, world)
        self._gates, self._at, self._all = np.zeros((n, COUNT, 3)), np.zeros(n, np.int64), np.arange(n)
        self._passed, self._missed = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self._in_a_row = np.zeros(n, np.bool_)
        self._gap, self._along, self._aside = np.zeros(n), np.zeros(n), np.zeros(n)

    def start(self, row: int, random: np.random.Generator) -> Start:
        """A path that begins ahead of the boat."""
        place, course = np.zeros(2), random.uniform(-np.pi, np.pi)
        heading = course
        for number in range(COUNT):
            bend = random.uniform(-BEND, BEND)
            place = place + random.uniform(*LEGS) * np.array([np.cos(course + bend), np.sin(course + bend)])
            course += bend
            self._gates[row, number] = *place, course
        return 0.0, 0.0, heading

    def begin(self, rows: IntArray, seen: Seen) -> None:
        """The first gate is the present one."""
        for array in (self._at, self._passed, self._missed, self._in_a_row):
            array[rows] = 0
        self._note(rows, seen)

    def observe(self, seen: Seen) -> FloatArray:
        """The ends of the present gate and the middle of the next from the boat."""
        x, y, course = self._present().T
        left, right = x - 0.5 * WIDTH * np.sin(course), x + 0.5 * WIDTH * np.sin(course)
        up, down = y + 0.5 * WIDTH * np.cos(course), y - 0.5 * WIDTH * np.cos(course)
        after = self._gates[self._all, np.minimum(self._at + 1, COUNT - 1)].T
        more = (self._at < COUNT - 1).astype(np.float64)
        return np.stack((*seen.toward(left, up), *seen.toward(right, down), *seen.toward(*after[:2]), more), axis=1)

    def judge(self, seen: Seen, going: BoolArray) -> Judged:
        """See whether the line was crossed since the step before, and where."""
        along, aside = seen.beyond(*self._present().T)
        x, y, _ = self._present().T
        reward = 0.1 * (self._gap - np.hypot(x - seen.x, y - seen.y))
        over = (self._along < 0.0) & (along >= 0.0) & (self._at < COUNT)
        share = np.where(over, -self._along / np.where(over, along - self._along, 1.0), 0.0)
        passed = over & (np.abs(self._aside + share * (aside - self._aside)) <= 0.5 * WIDTH)
        reward += np.where(over, np.where(passed, 2.0 + self._in_a_row, -2.0), 0.0)
        self._passed += passed
        self._missed += over & ~passed
        self._in_a_row = np.where(over, passed, self._in_a_row)
        self._at += over
        self._note(self._all, seen)
        return Judged(reward, self._at >= COUNT)

    def drawn(self) -> dict[str, npt.NDArray[Any]]:
        """The gates, (n, 6, 3): x, y [m] of the middle and course [rad] of each."""
        return {"gates": self._gates.copy()}

    def facts(self) -> dict[str, npt.NDArray[Any]]:
        """What became of the gates."""
        return {"passed": self._passed.copy(), "missed": self._missed.copy()}

    def _present(self) -> FloatArray:
        return self._gates[self._all, np.minimum(self._at, COUNT - 1)]

    def _note(self, rows: IntArray, seen: Seen) -> None:
        x, y, _ = self._present().T
        along, aside = seen.beyond(*self._present().T)
        for kept, now in ((self._gap, np.hypot(x - seen.x, y - seen.y)), (self._along, along), (self._aside, aside)):
            kept[rows] = now[rows]
