"""What episodes are drawn from: a generator of random numbers for every row, and what differs between episodes."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from vrx_mj.arrays import IntArray
from vrx_mj.errors import shown
from vrx_mj.rl.options import is_number
from vrx_mj.rl.refereed import RefereedRow, Rows
from vrx_mj.runtime.batch import Batch

Seeds = int | Sequence[int | None] | None
"""One for row 0, and the next ones for the others; one for each row, None for a row that goes on; or None for all."""
Range = float | Sequence[float] | None
"""A number, or the least and the greatest of which one is drawn evenly; None: as the world has it."""

_GREATEST = 1e6
"""Greatest value of anything that is varied, in its unit."""
_PERIODS = (0.8, 1.4)
"""Factor of the waves' periods by default: from 4 to 7 s where the world has 5."""
_BAND = (0.5, 1.2)
"""Factor of the width of the waves' band by default."""
_SPREAD = (0.0, 1.5)
"""Factor of the spread of the waves' directions by default."""
_FULL_TURN = (-np.pi, np.pi)
"""Any direction or phase [rad]."""
VARIED: Mapping[str, Range] = {
    "wind_speed": None, "gusts": None, "waves": None, "wave_period": _PERIODS, "wave_band": _BAND,
    "wave_direction": _FULL_TURN, "wave_spread": _SPREAD, "wave_phase": _FULL_TURN, "mass": None, "thrust": None,
}  # fmt: skip
"""What can be varied, and its range by default."""
_LEAST = {"wave_direction": -_GREATEST, "wave_phase": -_GREATEST, "mass": 1e-3, "wave_period": 1e-3}
"""Least values of what is varied where they are not 0."""


class Generators:
    """What the rows draw their episodes from; row i of seed s is a generator of seed s + i alone."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._random: list[np.random.Generator] = []

    def check_begun(self) -> None:
        """gymnasium.error.ResetNeeded: `reset` was not called."""
        if not self._random:
            raise gymnasium.error.ResetNeeded("call reset() before step() or render()")

    def of(self, rows: IntArray) -> list[np.random.Generator]:
        """Generators of some rows."""
        return [self._random[row] for row in rows.tolist()]

    def seed(self, rows: IntArray, seed: Seeds) -> None:
        """Give rows generators of their own.

        Raises:
            gymnasium.error.Error: not as many seeds as rows, or one is invalid; then no row has another generator.
        """
        if seed is None and self._random:
            return
        seeds = _seeds_of_rows(seed, self._n)
        wanted = [row for row in rows.tolist() if seeds[row] is not None] if self._random else range(self._n)
        fresh = {row: seeding.np_random(seeds[row])[0] for row in wanted}
        self._random = [fresh[row] if row in fresh else self._random[row] for row in range(self._n)]

    def use(self, row: int, random: np.random.Generator) -> None:
        """Have a row draw from this one from now on."""
        if not self._random:
            self._random = [seeding.np_random(None)[0] for _ in range(self._n)]
        self._random[row] = random


def _seeds_of_rows(seed: object, n: int) -> list[int | None]:
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


class Variety:
    """Domain randomisation: wind, sea, mass and thrust, drawn anew for every episode."""

    def __init__(self, rows: Rows, problem: str, given: Mapping[str, Range]) -> None:
        """Take the ranges that differ from `VARIED`; a world with a referee is as it is.

        Raises:
            gymnasium.error.Error: a name or a range is invalid, or a boat with so much mass does not float upright.
        """
        unknown = [name for name in given if name not in VARIED]
        if unknown:
            raise gymnasium.error.Error(f"{problem} has no option {unknown[0]}")
        if isinstance(rows, RefereedRow) and given:
            raise gymnasium.error.Error(f"{problem} has no option {next(iter(given))}: its world cannot be varied")
        ranges = {**VARIED, **given} if isinstance(rows, Batch) else {}
        self._ranges = {name: _range(name, value) for name, value in ranges.items() if value is not None}
        if isinstance(rows, Batch) and "mass" in self._ranges:
            _check_mass(rows, ranges["mass"], self._ranges["mass"][1])
        if "wind_speed" in self._ranges:
            self._ranges["wind_direction"] = _FULL_TURN
        self._rows, self._waves = rows, len(rows.waves(0))
        self._drawn = {name: np.zeros((rows.n, *self._shape(name))) for name in self._ranges}

    def _shape(self, name: str) -> tuple[int, ...]:
        return (self._waves,) if name == "wave_phase" else ()

    def draw(self, rows: IntArray, random: Sequence[np.random.Generator]) -> None:
        """Draw for these rows, whose generators are given, what holds from their next reset on."""
        changed: dict[str, Any] = {}
        for name, (low, high) in self._ranges.items():
            shape = self._shape(name)
            drawn = np.array([own.uniform(low, high, shape or None) for own in random]).reshape(-1, *shape)
            changed["wave_phases" if shape else name] = drawn
            self._drawn[name][rows] = drawn
        if isinstance(self._rows, Batch):
            self._rows.vary(rows, **changed)

    def facts(self) -> dict[str, npt.NDArray[np.generic]]:
        """What was drawn last, by the names of the options, (n,) or, of phases, (n, waves)."""
        return dict(self._drawn)


def _range(name: str, value: object) -> tuple[float, float]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    pair = tuple(value) if isinstance(value, Sequence) else (value, value)
    least = _LEAST.get(name, 0.0)
    if len(pair) != 2 or not all(map(is_number, pair)) or not least <= pair[0] <= pair[1] <= _GREATEST:
        number = "a number" if least == -_GREATEST else f"a number of {least:g} or more"
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: {number}, or a pair (least, greatest), is needed")
    return float(pair[0]), float(pair[1])


def _check_mass(batch: Batch, given: Range, most: float) -> None:
    """gymnasium.error.Error: with `most` times its mass an end of a boat goes under water, on a calm."""
    limits = batch.largest_masses
    boat = int(np.argmin(limits))
    if most > limits[boat]:
        text = f"at most {limits[boat]:.3g} is needed; with more an end of {batch.boats[boat]} goes under water"
        raise gymnasium.error.Error(f"invalid mass {shown(given)}: {text}")
