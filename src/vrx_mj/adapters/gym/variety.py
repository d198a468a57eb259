"""Domain randomisation: wind, waves, mass and thrust, drawn anew for every episode."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from vrx_mj.adapters.gym.options import is_number
from vrx_mj.errors import shown
from vrx_mj.runtime.batch import Batch

__all__ = ["Range", "Variety"]

Range = float | Sequence[float] | None
"""A number, or the least and the greatest of which one is drawn evenly; None: as the world has it."""


LARGEST = 1e6
"""What is varied, at most, in its unit."""


class Variety:
    """What is varied, and how."""

    waves: npt.NDArray[np.float64]
    """(n,) factor of the waves' amplitudes in each row, as last drawn."""

    def __init__(self, n: int, *, wind_speed: Range, gusts: Range, waves: Range, mass: Range, thrust: Range) -> None:
        self.waves = np.ones(n)
        given = {"wind_speed": wind_speed, "gusts": gusts, "waves": waves, "mass": mass, "thrust": thrust}
        self._ranges = {name: _range(name, value) for name, value in given.items() if value is not None}
        if "wind_speed" in self._ranges:
            self._ranges["wind_direction"] = (-np.pi, np.pi)

    def draw(self, batch: Batch, rows: npt.NDArray[np.int64], random: Sequence[np.random.Generator]) -> None:
        """Draw for these rows, whose generators are given, what holds from their next reset on."""
        for name, (low, high) in self._ranges.items():
            drawn = np.array([own.uniform(low, high) for own in random])
            batch.vary(rows, **{name: drawn})
            if name == "waves":
                self.waves[rows] = drawn


def _range(name: str, value: Any) -> tuple[float, float]:
    pair = tuple(value) if isinstance(value, Sequence | np.ndarray) else (value, value)
    least = 1e-3 if name == "mass" else 0.0
    if len(pair) != 2 or not all(map(is_number, pair)) or not least <= pair[0] <= pair[1] <= LARGEST:
        text = f"a number of {least:g} or more, or a pair (least, greatest), is needed"
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: {text}")
    return float(pair[0]), float(pair[1])
