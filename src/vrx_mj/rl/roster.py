"""Which boats are in the water: some join late, leave early, are lost, or are done."""

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.rl.problem import Problem, Spot, Team
from vrx_mj.rl.refereed import Rows

__all__ = ["CAPSIZED", "SUNK", "Roster", "Watch"]

Random = list[np.random.Generator]
SUNK = 2.0
"""A boat is sunk when it is so much deeper under the surface at its place than where it floats at rest [m]."""
CAPSIZED = np.radians(90.0)
"""A boat has capsized when its mast leans by more than this from the vertical [rad]."""
AWAY, BESIDE = 1e4, 200.0
"""Absent boats float so far north-east of all, and so far from each other [m]; waves and wind move them."""
FREE = 8.0
"""A boat joins at a place that no other is nearer to [m]."""
TRIES = 20
"""Places that are tried in a step; a boat that finds none waits for the next."""
NEVER = 1 << 62
"""Step in which a boat leaves that does not."""


class Watch:
    """Which boats of a batch are lost, (n, boats)."""

    def __init__(self, batch: Rows) -> None:
        self._batch = batch
        self._rest = np.zeros((batch.n, len(batch.boats)))

    def launch(self, boat: int, rows: IntArray, spots: FloatArray) -> None:
        """Put a boat of some rows on the water, at spots, (rows, 4)."""
        name = self._batch.boats[boat]
        poses, velocities = self._batch.afloat(name, spots[:, :3], rows)
        velocities[:, 0] += spots[:, 3]
        self._batch.set_boat(name, pose=poses, velocity=velocities, rows=rows)
        self._rest[rows, boat] = 0.0
        self._rest[rows, boat] = self._heights()[rows, boat]

    def sunk(self) -> BoolArray:
        """Which boats are under water."""
        deep: BoolArray = self._heights() - self._rest < -SUNK
        return deep

    def capsized(self) -> BoolArray:
        """Which boats lie upside down, or nearly so."""
        features = self._batch.features
        x, y = features[..., 4], features[..., 5]
        over: BoolArray = 1.0 - 2.0 * (x * x + y * y) < np.cos(CAPSIZED)
        return over

    def _heights(self) -> FloatArray:
        """Heights of the boats' origins over the surface [m]; NaN of those that have diverged."""
        features = self._batch.features
        heights: FloatArray = features[..., 2] - self._batch.sea_height(features[..., 0], features[..., 1])
        return heights


class Roster:
    """The boats of `n` worlds: who is present, (n, boats), and when each joins and leaves, in steps."""

    def __init__(self, problem: Problem, watch: Watch, *, moving: tuple[float, float] | None, most: int) -> None:
        """Take the chances, 0 to 1, that a boat joins late and leaves early, and the steps of an episode.

        Without chances nothing is drawn, and boats whose episodes have ended stay where they are.
        """
        self._problem, self._watch, self._moving, self._most = problem, watch, moving, most
        shape = problem.n, problem.size
        self.present = np.zeros(shape, np.bool_)
        self._joins, self._leaves = np.zeros(shape, np.int64), np.full(shape, NEVER)

    def begin(self, rows: IntArray, random: Random) -> None:
        """Draw who is there from the start of an episode, and put the boats of these rows where they belong.

        A boat that joins does so in the first half of an episode, one that leaves in the second; the anchor stays.
        """
        spots = [self._problem.start(row, own) for row, own in zip(rows.tolist(), random, strict=True)]
        if self._moving is not None:
            for row, own in zip(rows.tolist(), random, strict=True):
                self._draw(row, own, *self._moving)
        self.present[rows] = self._joins[rows] == 0
        for boat in range(self._problem.size):
            here = self.present[rows, boat]
            if self._problem.placed:
                self._put(boat, rows[here], np.array([own[boat] for own in spots]).reshape(-1, 4)[here])
            self._park(boat, rows[~here])

    def due(self, steps: IntArray) -> BoolArray:
        """Which boats have to leave now, (n, boats), by the steps of each row."""
        return self.present & (self._leaves <= steps[:, None])

    def join(self, steps: IntArray, going: BoolArray, team: Team, generators: Random) -> BoolArray:
        """Put boats into the water whose time has come, where there is room; which they are, (n, boats)."""
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
        if self._moving is not None:
            for boat in range(gone.shape[1]):
                self._park(boat, np.flatnonzero(gone[:, boat]))

    def _park(self, boat: int, rows: IntArray) -> None:
        """Put a boat of some rows out of sight."""
        place = AWAY + BESIDE * boat, AWAY, 0.0, 0.0
        self._put(boat, rows, np.array([place] * len(rows)))

    def _draw(self, row: int, random: np.random.Generator, joining: float, leaving: float) -> None:
        boats, half = self.present.shape[1], max(1, self._most // 2)
        late, early = random.random(boats) < joining, random.random(boats) < leaving
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
        if len(rows):
            self._watch.launch(boat, rows, spots)
