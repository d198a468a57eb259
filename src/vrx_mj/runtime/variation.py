"""Parameters in which rows of a batch differ from their world, as `Batch.vary` sets them."""

import warnings
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import check_kind
from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import VrxWarning
from vrx_mj.mjcf.world import World
from vrx_mj.model.numbers import Number, numbers_of, with_numbers
from vrx_mj.model.world import Parameters
from vrx_mj.runtime.row_arguments import row_values
from vrx_mj.runtime.row_tables import RowTables
from vrx_mj.runtime.rows import RowSeas

_COLUMNS: Mapping[str, tuple[str, str]] = {
    "wind_speed": ("wind", "mean"), "wind_direction": ("wind", "direction"), "gusts": ("wind", "gain"),
    "waves": ("waves", "amplitude"), "wave_period": ("waves", "frequency"), "wave_band": ("waves", "frequency"),
    "wave_direction": ("waves", "direction"), "wave_spread": ("waves", "direction"), "wave_phases": ("waves", "phase"),
    "mass": ("hulls", "mass"), "thrust": ("thrusters", "gain"),
}  # fmt: skip
"""Arguments of `Batch.vary`: table and column in which each is, or the product with a factor."""
_SHARED = {"waves", "wave_period", "wave_band", "wave_direction", "wave_spread"}
"""Arguments whose column also follows from another argument, or from a number."""
_WINDS = {"wind.mean": "wind_speed", "wind.direction": "wind_direction", "wind.gain": "gusts"}
"""Numbers that are arguments, too."""
_ROOTS = ("sea", "current", "wind", "air", "moorings", "ropes", "hulls", "stations", "thrusters")
"""Fields of a world from which the tables of a row are made."""


class Variation:
    """What the rows of a batch have otherwise than their world."""

    def __init__(self, world: World, rows: RowTables) -> None:
        """Start with all rows as the world is."""
        self._world, self._rows = world, rows
        arrays = rows.arrays
        self.seas = RowSeas(arrays.waves, world.parameters.sea, rows.n)
        wind = arrays.wind[0]
        self._usual = dict.fromkeys(_COLUMNS, 1.0) | {
            "wind_speed": float(wind["mean"]), "gusts": float(wind["gain"]), "wave_phases": 0.0,
            "wind_direction": float(np.arctan2(wind["direction"][1], wind["direction"][0])),
            "wave_direction": self.seas.course,
        }  # fmt: skip
        self._values = {name: np.full(rows.n, usual) for name, usual in self._usual.items()}
        """Arguments, of each row; of phases, the largest."""
        self._own: list[dict[str, float]] = [{} for _ in range(rows.n)]
        """Numbers by name, of each row."""

    @cached_property
    def _numbers(self) -> dict[str, Number]:
        """Numbers that only the loop's tables have: what MuJoCo's model has too, as masses, rows share."""
        known = numbers_of(self._world.parameters)
        return {name: number for name, number in known.items() if number.path[0] in _ROOTS and not number.in_mjcf}

    def change(
        self,
        which: IntArray,
        given: dict[str, FloatArray],
        phases: npt.ArrayLike | None,
        numbers: Mapping[str, npt.ArrayLike],
    ) -> None:
        """Change rows: `given` are values by argument and `numbers` by name; errors are those of `Batch.vary`."""
        check_kind("parameters", numbers, Mapping, "a mapping of arrays, as {'wamv.hull.drag_linear.surge': [40, 60]}")
        each = {name: row_values(name, value, len(which), -np.inf, np.inf) for name, value in numbers.items()}
        own = [{name: float(values[k]) for name, values in each.items()} for k in range(len(which) if each else 0)]
        worlds = [
            with_numbers(self._world.parameters, self._own[row] | more, self._numbers)
            for row, more in zip(which.tolist(), own, strict=False)
        ]
        given = {_WINDS[name]: each[name] for name in _WINDS if name in each} | given
        self._warn_of_no_effect(given)
        for row, more, parameters in zip(which.tolist(), own, worlds, strict=False):
            self._own[row] |= {name: value for name, value in more.items() if name not in _WINDS}
            self._set_tables(row, parameters)
        for name, values in given.items():
            self._values[name][which] = values
        if phases is not None or any(name.startswith("wave") for name in given):
            waves = self.seas.change(which, given, phases)
            self._values["wave_phases"][which] = np.abs(waves["phase"]).max(axis=1, initial=0.0)
            self._rows.separate("waves")[which] = waves
        wind = self._rows.stacks["wind"]
        for name, column in (("wind_speed", "mean"), ("gusts", "gain")):
            if name in given:
                wind[column][which, 0] = given[name]
        if "wind_direction" in given:
            toward = given["wind_direction"]
            wind["direction"][which, 0] = np.stack((np.cos(toward), np.sin(toward)), axis=1)
        if "thrust" in given:
            self._rows.separate("thrusters")["gain"][which] = given["thrust"][:, None]
        if "mass" in given:
            self._rows.weigh(which, given["mass"])

    def draw_phases(self, which: IntArray, seeds: IntArray) -> None:
        """Draw the phases of rows' waves from their seeds, where the sea is random and none were given."""
        if self.seas.drawn.any():
            self._rows.separate("waves")[which] = self.seas.draw(which, seeds)

    def snapshot(self) -> tuple[Any, ...]:
        """What a copy needs for `restore`."""
        return self.seas, self._values, self._own

    def restore(self, seas: RowSeas, values: dict[str, FloatArray], own: list[dict[str, float]]) -> None:
        """Go on as the variation does of which this is the `snapshot`."""
        self.seas, self._values, self._own = seas, values, own
        for row, numbers in enumerate(own):
            if numbers:
                self._set_tables(row, with_numbers(self._world.parameters, numbers, self._numbers))

    def _set_tables(self, row: int, parameters: Parameters) -> None:
        """Give a row the tables of its world with other numbers."""
        arrays = self._rows.arrays.with_parameters(parameters, self._world.seed)
        self._rows.set_parameters(row, arrays)
        if any(name.startswith("sea.waves.") for name in self._own[row]):
            self.seas.set_waves(row, arrays.waves)
            self._rows.separate("waves")[row] = self.seas.waves(np.array([row]))[0]

    def differences(self, row: int) -> dict[str, tuple[float, float]]:
        """Values of a row and of the world, of each parameter in which they differ."""
        found = {}
        for name, (table, column) in _COLUMNS.items():
            own, common = self._rows.part(table, row)[column], getattr(self._rows.arrays, table)[column]
            value, usual = float(self._values[name][row]), self._usual[name]
            if name == "wave_phases" and self.seas.drawn[row]:
                continue
            if own.tobytes() != common.tobytes() and (name not in _SHARED or value != usual):
                found[name] = value, usual
        for name, value in sorted(self._own[row].items()):
            if value != self._numbers[name].value:
                found[name] = value, self._numbers[name].value
        return found

    def _warn_of_no_effect(self, given: Mapping[str, FloatArray]) -> None:
        """Warn of parameters that change nothing: wind where it pushes nothing, waves where the sea has none."""
        arrays, name = self._rows.arrays, self._world.name
        pushed = any(table["wind"].any() for table in (arrays.hulls, arrays.floats, arrays.blocks))
        pushed |= len(arrays.windage) > 0 or len(arrays.sail_curves) > 0
        if not pushed and (idle := [key for key in ("wind_speed", "gusts") if key in given and given[key].any()]):
            text = f"{' and '.join(idle)} without effect: the wind pushes nothing in world {name}"
            warnings.warn(f"{text}; give it `wind` with `objects`, or its robot `wind`", VrxWarning, stacklevel=5)
        if not arrays.waves["amplitude"].any() and "waves" in given and given["waves"].any():
            warnings.warn(f"waves without effect: the sea of world {name} has none", VrxWarning, stacklevel=5)
