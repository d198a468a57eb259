"""A generator of random numbers for every row."""

from collections.abc import Sequence

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

__all__ = ["Generators", "Seeds"]

Seeds = int | Sequence[int | None] | None
"""One for row 0, and the next ones for the others; one for each row, None for a row that goes on; or None for all."""


class Generators:
    """What the rows draw their episodes from; row i of seed s is a generator of seed s + i alone."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._random: list[np.random.Generator] = []

    def check_begun(self) -> None:
        """gymnasium.error.ResetNeeded: there are none yet."""
        if not self._random:
            raise gymnasium.error.ResetNeeded("call reset() before step() or render()")

    def of(self, rows: npt.NDArray[np.int64]) -> list[np.random.Generator]:
        """Those of some rows."""
        return [self._random[row] for row in rows.tolist()]

    def seed(self, rows: npt.NDArray[np.int64], seed: Seeds) -> None:
        """Give rows generators of their own; gymnasium.error.Error: not as many seeds as rows."""
        if seed is None and self._random:
            return
        seeds = (
            [None if seed is None else seed + row for row in range(self._n)]
            if seed is None or isinstance(seed, int | np.integer)
            else list(seed)
        )
        if len(seeds) != self._n:
            raise gymnasium.error.Error(f"{len(seeds)} seeds for {self._n} rows: one for each is needed, or one")
        if not self._random:
            self._random = [seeding.np_random(own)[0] for own in seeds]
        for row in rows.tolist():
            if seeds[row] is not None:
                self._random[row] = seeding.np_random(seeds[row])[0]

    def use(self, row: int, random: np.random.Generator) -> None:
        """Have a row draw from this one from now on."""
        if not self._random:
            self._random = [seeding.np_random(None)[0] for _ in range(self._n)]
        self._random[row] = random
