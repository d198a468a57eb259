"""Who is in the water: boats that come late, go early, or are done."""

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.rl.losses import Watch
from vrx_mj.rl.problems.refereed import RefereedRow
from vrx_mj.rl.team import Spot, Team, TeamProblem
from vrx_mj.runtime.batch import Batch

__all__ = ["Roster"]

Random = list[np.random.Generator]
AWAY, BESIDE = 1e4, 200.0
"""Boats that are not there float so far north-east of all, and so far from each other [m]; waves and wind move them."""
FREE = 8.0
"""A boat joins at a place that no other is nearer to [m]."""
TRIES = 20
"""Places that are tried in a step; a boat that finds none waits for the next."""


class Roster:
    """The boats of `n` worlds: who is present, (n, boats), and when each joins and leaves, in steps."""

    def __init__(
        self,
        batch: Batch | RefereedRow,
        problem: TeamProblem,
        watch: Watch,
        *,
        joining: float,
        leaving: float,
        most: int,
    ) -> None:
        """Take the chances, 0 to 1, that a boat joins late and leaves early, and the steps of an episode."""
        self._problem, self._watch = problem, watch
        self._joining, self._leaving, self._most = joining, leaving, most
        shape = batch.n, len(batch.boats)
        self.present = np.zeros(shape, np.bool_)
        self._joins, self._leaves = np.zeros(shape, np.int64), np.zeros(shape, np.int64)

    def begin(self, rows: IntArray, random: Random) -> None:
        """Draw who is there from the start of an episode, and put the boats of these rows where they belong.

        A boat that joins does so in the first half of an episode, one that leaves in the second; the anchor stays.
        """
        spots = np.array([self._problem.start(row, own) for row, own in zip(rows.tolist(), random, strict=True)])
        for row, own in zip(rows.tolist(), random, strict=True):
            self._draw(row, own)
        self.present[rows] = self._joins[rows] == 0
        for boat in range(self.present.shape[1]):
            here = self.present[rows, boat]
            if self._problem.placed:
                self._put(boat, rows[here], spots[here, boat])
            self.park(boat, rows[~here])

    def due(self, steps: IntArray) -> BoolArray:
        """Who has to leave now, (n, boats), by the steps of each row."""
        return self.present & (self._leaves <= steps[:, None])

    def join(self, steps: IntArray, going: BoolArray, team: Team, generators: Random) -> BoolArray:
        """Put boats into the water whose time has come, where there is room; who they are, (n, boats)."""
        joined = np.zeros_like(self.present)
        waiting = going[:, None] & (self._joins > 0) & (self._joins <= steps[:, None]) & ~self.present
        for row, boat in np.argwhere(waiting).tolist():
            spot = self._free(row, boat, team, joined[row], generators[row])
            if spot is not None:
                self._put(boat, np.array([row]), np.array([spot]))
                team.x[row, boat], team.y[row, boat] = spot[:2]
                joined[row, boat], self._joins[row, boat] = True, 0
        self.present |= joined
        return joined

    def dismiss(self, gone: BoolArray) -> None:
        """Take boats out of the water, for good."""
        self.present &= ~gone
        for boat in range(gone.shape[1]):
            self.park(boat, np.flatnonzero(gone[:, boat]))

    def park(self, boat: int, rows: IntArray) -> None:
        """Put a boat of some rows out of sight."""
        place = AWAY + BESIDE * boat, AWAY, 0.0, 0.0
        self._put(boat, rows, np.array([place] * len(rows)))

    def _draw(self, row: int, random: np.random.Generator) -> None:
        boats, half = self.present.shape[1], max(1, self._most // 2)
        late, early = random.random(boats) < self._joining, random.random(boats) < self._leaving
        late[self._problem.anchor] = early[self._problem.anchor] = False
        self._joins[row] = np.where(late, random.integers(1, half + 1, boats), 0)
        self._leaves[row] = np.where(early, random.integers(half, max(self._most, half + 1), boats), self._most + 1)

    def _free(self, row: int, boat: int, team: Team, joined: BoolArray, random: np.random.Generator) -> Spot | None:
        others = self.present[row] | joined
        for _ in range(TRIES):
            spot = self._problem.entrance(row, boat, random)
            gaps = np.hypot(team.x[row, others] - spot[0], team.y[row, others] - spot[1])
            if (gaps >= FREE).all():
                return spot
        return None

    def _put(self, boat: int, rows: IntArray, spots: FloatArray) -> None:
        if not len(rows):
            return
        self._watch.launch(boat, rows, spots[:, :3], spots[:, 3])
