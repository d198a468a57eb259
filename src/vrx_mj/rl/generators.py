"""A generator of random numbers for every row."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding

from vrx_mj.arrays import IntArray
from vrx_mj.errors import shown

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

    def of(self, rows: IntArray) -> list[np.random.Generator]:
        """Those of some rows."""
        return [self._random[row] for row in rows.tolist()]

    def seed(self, rows: IntArray, seed: Seeds) -> None:
        """Give rows generators of their own.

        Raises:
            gymnasium.error.Error: not as many seeds as rows, or one is none; then no row has another generator.
        """
        if seed is None and self._random:
            return
        seeds = _each(seed, self._n)
        wanted = [row for row in rows.tolist() if seeds[row] is not None] if self._random else range(self._n)
        fresh = {row: seeding.np_random(seeds[row])[0] for row in wanted}
        self._random = [fresh[row] if row in fresh else self._random[row] for row in range(self._n)]

    def use(self, row: int, random: np.random.Generator) -> None:
        """Have a row draw from this one from now on."""
        if not self._random:
            self._random = [seeding.np_random(None)[0] for _ in range(self._n)]
        self._random[row] = random


def _each(seed: Any, n: int) -> list[int | None]:
    """The seed of each row."""
    if seed is None or isinstance(seed, int | np.integer):
        given: list[Any] = [None if seed is None else int(seed) + row for row in range(n)]
    elif isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str | bytes) and np.ndim(seed[:0]) == 1:
        given = list(seed)
    else:
        text = f"a whole number of 0 or more is needed, or one for each of {n} rows"
        raise gymnasium.error.Error(f"invalid seed {shown(seed)}: {text}")
    if len(given) != n:
        raise gymnasium.error.Error(f"{len(given)} seeds for {n} rows: one seed, or one for each row, is needed")
    for row, own in enumerate(given):
        if own is not None and (not isinstance(own, int | np.integer) or own < 0):
            text = "a whole number of 0 or more is needed"
            raise gymnasium.error.Error(f"invalid seed {shown(own)} of row {row}: {text}")
    return [None if own is None else int(own) for own in given]
