"""Score: a world's own task, as its referee scores it."""

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.rl.problem import Entry, Facts, Judged, Problem, RefereedRow, Spot, Team
from vrx_mj.runtime.task_runner import TaskObservation
from vrx_mj.tasks import TASK_KINDS

_COMMON_OUTPUTS = ("type", "name", "boat", "state", "elapsed_time", "num_collisions", "score")
"""Outputs that all tasks have."""


_LOSS = 100.0
"""What the scored boat forfeits by sinking or capsizing, in the unit of its task's score."""


class Score(Problem):
    """Any world with a task: its boats start where the fleet has them, and one of them is scored.

    Reward of that boat: by how much the task's score has become better in the step, in its unit; their sum is the
    score, less where less is better. The others have none of their own; the team's is the same. The end of the task
    ends the episode, and so does the loss of the boat, which forfeits 100. Only the task's state is observed;
    its own outputs (a goal, a pinger's range) are in `info["outputs"]`, beside `score`, `state` and
    `num_collisions`. Messages and shots are not among the actions.
    """

    entries = (
        Entry("x since the start [m]", 20.0), Entry("y since the start [m]", 20.0),
        Entry("cosine of the heading", 1.0), Entry("sine of the heading", 1.0),
        Entry("whether the task runs", 1.0), Entry("time left of the task [s]", 100.0),
        Entry("whether this boat is scored", 1.0),
    )  # fmt: skip
    fixed = placed = False

    def __init__(self, row: RefereedRow) -> None:
        super().__init__(row)
        self._row = row
        task = row.world.parameters.task
        assert task is not None, "a world without a task"
        self.duration = sum(task.durations) + 1.0  # the referee ends it before
        self.anchor = row.boats.index(str(self._task["boat"]))
        better = TASK_KINDS[str(self._task["type"])].better
        self._sign = 1.0 if better == "higher" else -1.0
        features = row.features[0]
        self._first = features[:, :2].copy()
        w, x, y, z = features[:, 3:7].T
        self._yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        self._score = 0.0

    @property
    def _task(self) -> TaskObservation:
        task = self._row.sim.task
        assert task is not None, "a world without a task"
        return task

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """Where the fleet has them."""
        return [self.entrance(row, boat, random) for boat in range(self.size)]

    def entrance(self, row: int, boat: int, random: np.random.Generator) -> Spot:
        """Draw nothing: a boat joins where the fleet has it."""
        x, y = self._first[boat].tolist()
        return x, y, float(self._yaw[boat]), 0.0

    def begin(self, who: BoolArray, team: Team) -> None:
        """The score at present."""
        self._score = float(self._task["score"])

    def observe(self, team: Team) -> FloatArray:
        """The way, the heading, and the task's state."""
        task, every = self._task, np.ones_like(team.x)
        east, north = team.x - self._first[:, 0], team.y - self._first[:, 1]
        scored = np.arange(self.size) == self.anchor
        runs, left = every * (task["state"] == "running"), every * float(task["remaining_time"])
        return np.stack((east, north, np.cos(team.yaw), np.sin(team.yaw), runs, left, every * scored), axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Gain by the change of the score."""
        score = float(self._task["score"])
        change: FloatArray = np.where(going, self._sign * (score - self._score) + 0.0, 0.0)  # no -0
        self._score = score
        own = np.where(np.arange(self.size) == self.anchor, change[:, None], 0.0)
        return Judged(own, team.present & self._row.sim.task_is_over, change)

    def forfeit(self, left: IntArray) -> FloatArray:
        """Penalty of the scored boat, more than most tasks pay."""
        return np.where(np.arange(self.size) == self.anchor, _LOSS, 0.0)[None] * (left > 0)[:, None]

    def facts(self) -> Facts:
        """The score and the other outputs of the task."""
        task = self._task
        outputs = np.empty(1, object)
        outputs[0] = {name: value for name, value in task.items() if name not in _COMMON_OUTPUTS}
        common = {name: np.array([task[name]]) for name in ("score", "state", "num_collisions")}
        return {**common, "outputs": outputs}
