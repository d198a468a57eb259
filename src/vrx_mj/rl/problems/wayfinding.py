"""Wayfinding: come to one pose after the other."""

from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.mjcf.world import World
from vrx_mj.rl.problem import Entry, Judged, Problem, Start, open_water
from vrx_mj.rl.seen import Seen, folded, pose_error

__all__ = ["Wayfinding"]

COUNT = 3
LEGS = (10.0, 25.0)
"""From one waypoint to the next [m]."""
REACHED = 1.5
"""A waypoint is reached when VRX's error of its pose is below this [m]."""


class Wayfinding(Problem):
    """Three poses, each 10 to 25 m from the one before it in any direction, with any heading.

    Reward: 0.1 for every m by which VRX's error of the present pose has become less, and 5 when it is below 1.5 m, upon
    which the next one counts. The last one ends the episode. `info`: `reached`, how many, and `pose_error` [m]; at the
    start `waypoints`, x, y [m] and heading [rad] of each.
    """

    world = open_water()
    duration = 120.0
    entries = (
        Entry("present waypoint ahead [m]", 10.0), Entry("present waypoint to port [m]", 10.0),
        Entry("sine of the turn to the present waypoint's heading", 1.0),
        Entry("cosine of the turn to the present waypoint's heading", 1.0),
        Entry("next waypoint ahead [m]", 10.0), Entry("next waypoint to port [m]", 10.0),
        Entry("whether a waypoint follows the present one", 1.0),
    )  # fmt: skip

    def __init__(self, n: int, world: World) -> None:
        super().__init__(n, world)
        self._points, self._at, self._all = np.zeros((n, COUNT, 3)), np.zeros(n, np.int64), np.arange(n)
        self._error = np.zeros(n)

    def start(self, row: int, random: np.random.Generator) -> Start:
        """A chain of waypoints from the origin on."""
        place = np.zeros(2)
        for number in range(COUNT):
            bearing = random.uniform(-np.pi, np.pi)
            place = place + random.uniform(*LEGS) * np.array([np.cos(bearing), np.sin(bearing)])
            self._points[row, number] = *place, random.uniform(-np.pi, np.pi)
        return 0.0, 0.0, random.uniform(-np.pi, np.pi)

    def begin(self, rows: IntArray, seen: Seen) -> None:
        """The first waypoint is the present one."""
        self._at[rows] = 0
        self._error[rows] = self._now(seen)[rows]

    def observe(self, seen: Seen) -> FloatArray:
        """Both waypoints from the boat; where there is no next one it is the present one."""
        x, y, yaw = self._present().T
        turn = folded(yaw - seen.yaw)
        after = self._points[self._all, np.minimum(self._at + 1, COUNT - 1)].T
        more = (self._at < COUNT - 1).astype(np.float64)
        return np.stack((*seen.toward(x, y), np.sin(turn), np.cos(turn), *seen.toward(*after[:2]), more), axis=1)

    def judge(self, seen: Seen, going: BoolArray) -> Judged:
        """Gain by what the error has become less."""
        error = self._now(seen)
        there = (error < REACHED) & (self._at < COUNT)
        reward = 0.1 * (self._error - error) + 5.0 * there
        self._at += there
        self._error = self._now(seen)
        return Judged(reward, self._at >= COUNT)

    def drawn(self) -> dict[str, npt.NDArray[Any]]:
        """The waypoints, (n, 3, 3): x, y [m] and heading [rad] of each."""
        return {"waypoints": self._points.copy()}

    def facts(self) -> dict[str, npt.NDArray[Any]]:
        """How far it is."""
        return {"reached": self._at.copy(), "pose_error": self._error.copy()}

    def _present(self) -> FloatArray:
        return self._points[self._all, np.minimum(self._at, COUNT - 1)]

    def _now(self, seen: Seen) -> FloatArray:
        return pose_error(seen, *self._present().T)
