"""The tables of a batch: what each row has of its own, and how it is copied."""

import warnings
from collections.abc import Mapping
from functools import partial
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import VrxWarning
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.ballast import with_scaled_mass
from vrx_mj.runtime.commands import channels_of
from vrx_mj.runtime.floating import Afloat
from vrx_mj.runtime.loop_arrays import LoopArrays, mujoco_arrays, point_models
from vrx_mj.runtime.row_memory import allocating
from vrx_mj.runtime.row_seas import RowSeas
from vrx_mj.runtime.rows import FEATURES
from vrx_mj.runtime.state import integration_state, set_integration_state
from vrx_mj.runtime.views import ARRAYS, OWN, RUN, STATE, point, point_rows

__all__ = ["SEPARATE", "RowTables"]

SEPARATE = tuple(name for name, array in ARRAYS.items() if array.use in {STATE, OWN})
"""Tables of which every row has its own part."""
STACKED = (*SEPARATE, "wind", "waves", "hulls", "thrusters")
"""Tables of which rows may have their own part."""
CARRIED = ("_seeds", "_time", "_done", "_qpos", "_qvel", "_stacks", "_seas", "_varied")
"""What a copy of a batch has besides its world and MuJoCo's states."""
VARIED: dict[str, tuple[str, str]] = {
    "wind_speed": ("wind", "mean"), "wind_direction": ("wind", "direction"), "gusts": ("wind", "gain"),
    "waves": ("waves", "amplitude"), "wave_period": ("waves", "frequency"), "wave_band": ("waves", "frequency"),
    "wave_direction": ("waves", "direction"), "wave_spread": ("waves", "direction"), "wave_phases": ("waves", "phase"),
    "mass": ("hulls", "mass"), "thrust": ("thrusters", "gain"),
}  # fmt: skip
"""What `Batch.vary` changes: table and column of a rig in which it is, or the product with a factor; of phases the
largest."""
SHARED = {"wave_period", "wave_band", "wave_direction", "wave_spread"}
"""Of these, those that share a column."""


class RowTables:
    """The part of a batch that holds its rows."""

    world: World
    """World of every row."""
    n: int
    """Number of rows."""
    _model: mujoco.MjModel
    _rig: LoopArrays
    _own_models: dict[int, tuple[mujoco.MjModel, mujoco.MjModel]]
    _masses: FloatArray
    _varied: dict[str, FloatArray]

    @property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats."""
        raise NotImplementedError

    @property
    def threads(self) -> int:
        """Number of threads."""
        raise NotImplementedError

    def _observe(self) -> None:
        """Make the features follow the state."""
        raise NotImplementedError

    def __reduce__(self) -> tuple[Any, tuple[World, int], dict[str, Any]]:
        flats = [self._flat(row) for row in range(self.n)]
        carried = {name: getattr(self, name) for name in CARRIED}
        kind: Any = type(self)
        return (
            partial(kind, threads=self.threads),
            (self.world, self.n),
            {"masses": self._masses, "mujoco": flats} | carried,
        )

    def __setstate__(self, state: dict[str, Any]) -> None:
        heavy = np.flatnonzero(state["masses"] != 1.0)
        self._weigh(heavy, state["masses"][heavy])
        for name in CARRIED:
            setattr(self, name, state[name])
        point_rows(self._runs, **self._stacks)
        for row, flat in enumerate(state["mujoco"]):
            set_integration_state(self._model_of(row), self._data[row], flat)
        self._observe()

    def _warn_of_no_effect(self, given: Mapping[str, FloatArray]) -> None:
        """Warn of parameters that change nothing: wind where it pushes nothing, waves where the sea has none."""
        rig, name = self._rig, self.world.name
        pushed = any(table["wind"].any() for table in (rig.hulls, rig.floats, rig.blocks))
        if not pushed and (idle := [key for key in ("wind_speed", "gusts") if key in given and given[key].any()]):
            text = f"{' and '.join(idle)} without effect: the wind pushes nothing in world {name}"
            warnings.warn(f"{text}; give it `wind` with `objects`, or its robot `wind`", VrxWarning, stacklevel=4)
        if not rig.waves["amplitude"].any() and "waves" in given and given["waves"].any():
            warnings.warn(f"waves without effect: the sea of world {name} has none", VrxWarning, stacklevel=4)

    def _model_of(self, row: int) -> mujoco.MjModel:
        return self._own_models.get(row, (self._model,))[0]

    def _flat(self, row: int) -> FloatArray:
        """MuJoCo's state of a row."""
        return integration_state(self._model_of(row), self._data[row])

    def _build(self) -> None:
        """Data and stacks of all rows."""
        rig, model = self._rig, self._model
        self._data = [mujoco.MjData(model) for _ in range(self.n)]
        self._runs = np.zeros(self.n, RUN)
        shared = rig.by_name(np.zeros(3, np.int64), np.zeros((0, rig.columns)))
        self._shared = {name: array[None] for name, array in shared.items()}
        point_rows(self._runs, **self._shared)
        for row, data in enumerate(self._data):
            run = self._runs[row : row + 1]
            point_models(run, model, rig.contact_free, data)
            point(run, **mujoco_arrays(data))
        self._seeds = np.zeros(self.n, np.int64)
        self._time, self._done = np.zeros(self.n), np.zeros(self.n, np.int64)
        self._going = np.ones(self.n, np.bool_)
        self._qpos, self._qvel = np.zeros((self.n, model.nq)), np.zeros((self.n, model.nv))
        self._features = np.zeros((self.n, len(self.boats), FEATURES))
        self._stacks = {name: self._shared[name] for name in STACKED}
        for name in (*SEPARATE, "wind"):
            self._separate(name)
        self._seas = RowSeas(rig.waves, self.world.parameters.sea, self.n)
        self._varied = {name: np.full(self.n, usual) for name, usual in self._usual().items()}
        self._afloat = Afloat(rig)
        self._channels = tuple(one for one in channels_of(self.world, rig.thrusters) if one.acts)

    def _separate(self, name: str) -> npt.NDArray[Any]:
        """The stack of a table in which every row has its own part."""
        stack = self._stacks[name]
        if not len(stack) == self.n > 1:
            stack = self._stacks[name] = np.repeat(stack, self.n, axis=0)
            point_rows(self._runs, **{name: stack})
        return stack

    def _usual(self) -> dict[str, float]:
        """The world's own values of what `vary` changes."""
        wind = self._rig.wind[0]
        toward = float(np.arctan2(wind["direction"][1], wind["direction"][0]))
        return {"wind_speed": float(wind["mean"]), "wind_direction": toward, "gusts": float(wind["gain"]),
                "waves": 1.0, "wave_period": 1.0, "wave_band": 1.0, "wave_direction": self._seas.course,
                "wave_spread": 1.0, "wave_phases": 0.0, "mass": 1.0, "thrust": 1.0}  # fmt: skip

    def _differences(self, row: int) -> dict[str, tuple[float, float]]:
        """Parameters in which a row differs from its world, as a state has them."""
        usual, found = self._usual(), {}
        for name, (table, column) in VARIED.items():
            stack = self._stacks[table]
            own, common = stack[row if len(stack) > 1 else 0][column], getattr(self._rig, table)[column]
            value = float(self._varied[name][row])
            if own.tobytes() != common.tobytes() and (name not in SHARED or value != usual[name]):
                found[name] = value, usual[name]
        return found

    def _vary_wind(self, which: IntArray, given: dict[str, FloatArray]) -> None:
        """Give rows winds of their own."""
        for name, column in (("wind_speed", "mean"), ("gusts", "gain")):
            if name in given:
                self._stacks["wind"][column][which, 0] = given[name]
        if "wind_direction" in given:
            toward = given["wind_direction"]
            self._stacks["wind"]["direction"][which, 0] = np.stack((np.cos(toward), np.sin(toward)), axis=1)

    def _weigh(self, which: IntArray, factors: FloatArray) -> None:
        """Give rows models of their own with all boats' masses and inertias times a factor."""
        hulls = self._separate("hulls")
        self._masses[which] = factors
        boats = self._rig.hulls["body"].tolist()
        for row, factor in zip(which.tolist(), factors.tolist(), strict=True):
            with allocating(self.n, self._rig.data):
                pair = tuple(with_scaled_mass(model, boats, factor) for model in (self._model, self._rig.contact_free))
            self._own_models[row] = pair[0], pair[1]
            point_models(self._runs[row], *self._own_models[row], self._data[row])
            hulls["mass"][row] = self._rig.hulls["mass"] * factor
