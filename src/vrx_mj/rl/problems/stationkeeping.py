"""Station-keeping: be at a pose, and stay there."""

from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.mjcf.world import World
from vrx_mj.rl.problem import Entry, Judged, Problem, Start, open_water
from vrx_mj.rl.seen import Seen, folded, pose_error

__all__ = ["StationKeeping"]

RADIUS = 10.0
"""The goal is within this distance of the start [m]."""


class StationKeeping(Problem):
    """The goal is drawn within 10 m of the start, with any heading.

    Reward: -0.1 e in each step, with e VRX's error of the pose [m]. Nothing but the loss of the boat ends an episode
    before its time is up; it forfeits 0.1 (e + 10) for each step left. `info`: `pose_error` [m], and `mean_pose_error`
    [m] since the start, which is VRX's score; at the start `goal`, x, y [m] and heading [rad].
    """

    world = open_water()
    duration = 60.0
    entries = (Entry("goal ahead [m]", 10.0), Entry("goal to port [m]", 10.0), Entry("goal ahead [m]", 1.0),
               Entry("goal to port [m]", 1.0), Entry("sine of the turn to the goal's heading", 1.0),
               Entry("cosine of the turn to the goal's heading", 1.0))  # fmt: skip

    def __init__(self, n: int, world: World) -> None:
        super().__init__(n, world)
        self._x, self._y, self._yaw = np.zeros(n), np.zeros(n), np.zeros(n)
        self._error, self._sum, self._steps = np.zeros(n), np.zeros(n), np.zeros(n, np.int64)

    def start(self, row: int, random: np.random.Generator) -> Start:
        """Goals are spread evenly over the disc; the boat starts at the origin."""
        distance, bearing = RADIUS * np.sqrt(random.random()), random.uniform(-np.pi, np.pi)
        self._x[row], self._y[row] = distance * np.cos(bearing), distance * np.sin(bearing)
        self._yaw[row] = random.uniform(-np.pi, np.pi)
        return 0.0, 0.0, random.uniform(-np.pi, np.pi)

    def begin(self, rows: IntArray, seen: Seen) -> None:
        """The mean starts anew."""
        self._sum[rows], self._steps[rows] = 0.0, 0
        self._error[rows] = pose_error(seen, self._x, self._y, self._yaw)[rows]

    def observe(self, seen: Seen) -> FloatArray:
        """The goal from the boat, from afar and close up."""
        turn, way = folded(self._yaw - seen.yaw), seen.toward(self._x, self._y)
        return np.stack((*way, *way, np.sin(turn), np.cos(turn)), axis=1)

    def judge(self, seen: Seen, going: BoolArray) -> Judged:
        """Lose by the error."""
        self._error = pose_error(seen, self._x, self._y, self._yaw)
        self._sum += np.where(going, self._error, 0.0)
        self._steps += going
        return Judged(-0.1 * self._error, np.zeros(self.n, np.bool_))

    def drawn(self) -> dict[str, npt.NDArray[Any]]:
        """The goals, (n, 3): x, y [m] and heading [rad]."""
        return {"goal": np.stack((self._x, self._y, self._yaw), axis=1)}

    def forfeit(self, left: IntArray) -> FloatArray:
        """The error that the boat has, and 10 m more, for all steps left."""
        lost: FloatArray = 0.1 * (self._error + RADIUS) * left
        return lost

    def facts(self) -> dict[str, npt.NDArray[Any]]:
        """The errors."""
        return {"pose_error": self._error.copy(), "mean_pose_error": self._sum / np.maximum(self._steps, 1)}
