"""Domain randomisation: wind, sea, mass and thrust, drawn anew for every episode."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import IntArray
from vrx_mj.errors import shown
from vrx_mj.rl.options import is_number
from vrx_mj.runtime.batch import Batch

__all__ = ["VARIED", "Range", "Variety", "ranges_of"]

Range = float | Sequence[float] | None
"""A number, or the least and the greatest of which one is drawn evenly; None: as the world has it."""

LARGEST = 1e6
"""What is varied, at most, in its unit."""
PERIODS = (0.8, 1.4)
"""Factor of the waves' periods by default: from 4 to 7 s where the world has 5."""
BAND = (0.5, 1.2)
"""Factor of the width of the waves' band by default."""
SPREAD = (0.0, 1.5)
"""Factor of the spread of the waves' directions by default."""
TURN = (-np.pi, np.pi)
"""Any direction or phase [rad]."""
VARIED: Mapping[str, Range] = {
    "wind_speed": None, "gusts": None, "waves": None, "wave_period": PERIODS, "wave_band": BAND,
    "wave_direction": TURN, "wave_spread": SPREAD, "wave_phase": TURN, "mass": None, "thrust": None,
}  # fmt: skip
"""What is varied, and what it is by default."""
SIGNED = {"wave_direction", "wave_phase"}
"""Of these, what may be below 0."""
LEAST = {"mass": 1e-3, "wave_period": 1e-3}
"""What is varied, at least; else 0."""


class Variety:
    """What is varied, and how."""

    def __init__(self, batch: Any, ranges: Mapping[str, Range]) -> None:
        """Take a `Batch`, or what stands for one, and the ranges by the names of `VARIED`.

        Raises:
            gymnasium.error.Error: a range is invalid, or a boat with so much mass does not float upright.
        """
        self._ranges = {name: _range(name, value) for name, value in ranges.items() if value is not None}
        if "mass" in self._ranges:
            _check_mass(batch, ranges["mass"], self._ranges["mass"][1])
        if "wind_speed" in self._ranges:
            self._ranges["wind_direction"] = TURN
        self._waves = len(batch.waves(0))
        self._drawn = {name: np.zeros((batch.n, *self._shape(name))) for name in self._ranges}

    def _shape(self, name: str) -> tuple[int, ...]:
        return (self._waves,) if name == "wave_phase" else ()

    def draw(self, batch: Batch, rows: IntArray, random: Sequence[np.random.Generator]) -> None:
        """Draw for these rows, whose generators are given, what holds from their next reset on."""
        changed: dict[str, Any] = {}
        for name, (low, high) in self._ranges.items():
            shape = self._shape(name)
            drawn = np.array([own.uniform(low, high, shape or None) for own in random]).reshape(-1, *shape)
            changed["wave_phases" if shape else name] = drawn
            self._drawn[name][rows] = drawn
        batch.vary(rows, **changed)

    def facts(self) -> dict[str, npt.NDArray[Any]]:
        """What was drawn last, by the names of the options, (n,) or, of phases, (n, waves)."""
        return {name: values.copy() for name, values in self._drawn.items()}


def ranges_of(problem: str, given: Mapping[str, Range]) -> dict[str, Range]:
    """Ranges of all that is varied; gymnasium.error.Error: nothing is called so."""
    strange = [name for name in given if name not in VARIED]
    if strange:
        raise gymnasium.error.Error(f"{problem} has no option {strange[0]}")
    return {**VARIED, **given}


def _range(name: str, value: Any) -> tuple[float, float]:
    pair = tuple(value) if isinstance(value, Sequence | np.ndarray) else (value, value)
    least = -LARGEST if name in SIGNED else LEAST.get(name, 0.0)
    if len(pair) != 2 or not all(map(is_number, pair)) or not least <= pair[0] <= pair[1] <= LARGEST:
        number = "a number" if name in SIGNED else f"a number of {least:g} or more"
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: {number}, or a pair (least, greatest), is needed")
    return float(pair[0]), float(pair[1])


def _check_mass(batch: Batch, given: Range, most: float) -> None:
    """gymnasium.error.Error: of a boat with `most` times its mass an end goes under water, on a calm."""
    limits = batch.largest_masses
    boat = int(np.argmin(limits))
    if most > limits[boat]:
        text = f"at most {limits[boat]:.3g} is needed; with more an end of {batch.boats[boat]} goes under water"
        raise gymnasium.error.Error(f"invalid mass {shown(given)}: {text}")
