"""The rows of a batch: what each has of its own, its memory, its water, and how they are copied."""

import copy
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property, partial
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import check_kind, check_name, whole
from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import CommandError, VrxWarning
from vrx_mj.mjcf.world import World
from vrx_mj.model.numbers import Number, numbers_of
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.commands import channels_of
from vrx_mj.runtime.floating import Afloat
from vrx_mj.runtime.limits import total_memory
from vrx_mj.runtime.loop_arrays import LoopArrays, mujoco_arrays, point_models
from vrx_mj.runtime.row_arguments import Rows, as_numbers, row_values, row_vectors, which_rows
from vrx_mj.runtime.rows import FEATURES, RowSeas, row_heights
from vrx_mj.runtime.state import integration_state, set_integration_state
from vrx_mj.runtime.turns import Turn, in_turn
from vrx_mj.runtime.views import ARRAYS, OWN, RUN, STATE, point, point_rows

_FIXED = 455_000
"""Memory of any row [bytes]: MuJoCo's `mjData` itself, mostly statistics of its solver; measured with MuJoCo 4.0."""


_OUT_OF_MEMORY = "Caught an unknown exception!"
"""Words of the RuntimeError by which MuJoCo's bindings of MuJoCo 4.0 may report a failed allocation."""


def check_memory(n: int, data: mujoco.MjData) -> None:
    """Check that `n` rows like this one fit into the memory of this machine or container: else it ends the process.

    Raises:
        CommandError: they do not.
    """
    each, most = _FIXED + int(data.nbuffer), total_memory()
    if n * each > most:
        text = f"{_size(n * each)} are needed, {_size(each)} a row, and at most {_size(most)} can be had"
        raise CommandError(f"no memory for {n} rows: {text}; make fewer rows")


@contextmanager
def allocating(n: int, data: mujoco.MjData) -> Iterator[None]:
    """Around what allocates the memory of `n` rows like this one.

    Raises:
        CommandError: the system has refused it, as because of a limit (`ulimit -v`).
    """
    try:
        yield
    except (MemoryError, RuntimeError, mujoco.FatalError) as error:
        if isinstance(error, RuntimeError) and str(error) != _OUT_OF_MEMORY:
            raise
        each = _FIXED + int(data.nbuffer) + int(data.narena)
        text = f"{_size(n * each)} of address space are needed, {_size(each)} a row"
        raise CommandError(
            f"no memory for {n} rows: {text}; make fewer rows, or raise the limit (ulimit -v)"
        ) from error


def _size(count: float) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{count / 1e6:.2f} MB"


def _with_scaled_mass(model: mujoco.MjModel, roots: Iterable[int], factor: float) -> mujoco.MjModel:
    """A model like another, with mass and inertia of some bodies, and of all that hangs on them, times a factor."""
    own, chosen = copy.copy(model), set(roots)
    bodies = [body for body in range(model.nbody) if int(model.body_rootid[body]) in chosen]
    own.body_mass[bodies] *= factor
    own.body_inertia[bodies] *= factor
    mujoco.mj_setConst(own, mujoco.MjData(own))
    return own


SEPARATE = tuple(name for name, array in ARRAYS.items() if array.use in {STATE, OWN})
"""Tables of which every row has its own part."""
_NUMBERED = ("current", "air", "hulls", "stations", "moorings", "ropes")
"""Tables whose numbers `Batch.vary` sets by name; the wind's and the waves' it sets by arguments."""
_STACKED = (*SEPARATE, *_NUMBERED, "wind", "gust_bands", "waves", "thrusters")
"""Tables of which rows may have their own part."""
_CARRIED = ("_seeds", "_time", "_done", "_qpos", "_qvel", "_stacks", "_seas", "_varied")
"""What a copy of a batch has besides its world and MuJoCo's states."""
_VARIED: dict[str, tuple[str, str]] = {
    "wind_speed": ("wind", "mean"), "wind_direction": ("wind", "direction"), "gusts": ("wind", "gain"),
    "waves": ("waves", "amplitude"), "wave_period": ("waves", "frequency"), "wave_band": ("waves", "frequency"),
    "wave_direction": ("waves", "direction"), "wave_spread": ("waves", "direction"), "wave_phases": ("waves", "phase"),
    "mass": ("hulls", "mass"), "thrust": ("thrusters", "gain"),
}  # fmt: skip
"""What `Batch.vary` changes: table and column in which it is, or the product with a factor; of phases the
largest."""
_SHARED = {"wave_period", "wave_band", "wave_direction", "wave_spread"}
"""Of these, those that share a column."""


def _place(number: Number) -> tuple[str, int, str, tuple[Any, ...]]:
    """Table, row, column and part of a number; of one that lies deeper, the part has names."""
    table, *path = number.path
    index, column, *part = path if isinstance(path[0], int) else (0, *path)
    return str(table), int(index), str(column), tuple(part)


class RowTables:
    """The part of a batch that holds its rows, and answers questions about their water."""

    world: World
    """World of every row."""
    n: int
    """Number of rows."""
    _model: mujoco.MjModel
    _arrays: LoopArrays
    _own_models: dict[int, tuple[mujoco.MjModel, mujoco.MjModel]]
    _masses: FloatArray
    _varied: dict[str, FloatArray]
    _turn: Turn

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
        carried = {name: getattr(self, name) for name in _CARRIED}
        kind: Any = type(self)
        return (
            partial(kind, threads=self.threads),
            (self.world, self.n),
            {"masses": self._masses, "mujoco": flats} | carried,
        )

    def __setstate__(self, state: dict[str, Any]) -> None:
        heavy = np.flatnonzero(state["masses"] != 1.0)
        self._weigh(heavy, state["masses"][heavy])
        for name in _CARRIED:
            setattr(self, name, state[name])
        point_rows(self._runs, **self._stacks)
        for row, flat in enumerate(state["mujoco"]):
            set_integration_state(self._model_of(row), self._data[row], flat)
        self._observe()

    def _warn_of_no_effect(self, given: Mapping[str, FloatArray]) -> None:
        """Warn of parameters that change nothing: wind where it pushes nothing, waves where the sea has none."""
        arrays, name = self._arrays, self.world.name
        pushed = any(table["wind"].any() for table in (arrays.hulls, arrays.floats, arrays.blocks))
        pushed |= len(arrays.windage) > 0 or len(arrays.sail_curves) > 0
        if not pushed and (idle := [key for key in ("wind_speed", "gusts") if key in given and given[key].any()]):
            text = f"{' and '.join(idle)} without effect: the wind pushes nothing in world {name}"
            warnings.warn(f"{text}; give it `wind` with `objects`, or its robot `wind`", VrxWarning, stacklevel=4)
        if not arrays.waves["amplitude"].any() and "waves" in given and given["waves"].any():
            warnings.warn(f"waves without effect: the sea of world {name} has none", VrxWarning, stacklevel=4)

    def _model_of(self, row: int) -> mujoco.MjModel:
        return self._own_models.get(row, (self._model,))[0]

    def _flat(self, row: int) -> FloatArray:
        """MuJoCo's state of a row."""
        return integration_state(self._model_of(row), self._data[row])

    def _build(self) -> None:
        """Data and stacks of all rows."""
        arrays, model = self._arrays, self._model
        self._data = [mujoco.MjData(model) for _ in range(self.n)]
        self._runs = np.zeros(self.n, RUN)
        shared = arrays.by_name(np.zeros(3, np.int64), np.zeros((0, arrays.columns)))
        self._shared = {name: array[None] for name, array in shared.items()}
        point_rows(self._runs, **self._shared)
        for row, data in enumerate(self._data):
            run = self._runs[row : row + 1]
            point_models(run, model, arrays.contact_free, data)
            point(run, **mujoco_arrays(data))
        self._seeds = np.zeros(self.n, np.int64)
        self._time, self._done = np.zeros(self.n), np.zeros(self.n, np.int64)
        self._going = np.ones(self.n, np.bool_)
        self._qpos, self._qvel = np.zeros((self.n, model.nq)), np.zeros((self.n, model.nv))
        self._features = np.zeros((self.n, len(self.boats), FEATURES))
        self._stacks = {name: self._shared[name] for name in _STACKED}
        for name in (*SEPARATE, "current", "wind", "gust_bands", "air"):
            self._separate(name)
        self._seas = RowSeas(arrays.waves, self.world.parameters.sea, self.n)
        self._varied = {name: np.full(self.n, usual) for name, usual in self._usual().items()}
        self._afloat = Afloat(arrays)
        self._channels = tuple(one for one in channels_of(self.world, arrays.thrusters) if one.acts)

    def _separate(self, name: str) -> Table:
        """The stack of a table in which every row has its own part."""
        stack = self._stacks[name]
        if not len(stack) == self.n > 1:
            stack = self._stacks[name] = np.repeat(stack, self.n, axis=0)
            point_rows(self._runs, **{name: stack})
        return stack

    def _usual(self) -> dict[str, float]:
        """The world's own values of what `vary` changes."""
        wind = self._arrays.wind[0]
        toward = float(np.arctan2(wind["direction"][1], wind["direction"][0]))
        return {"wind_speed": float(wind["mean"]), "wind_direction": toward, "gusts": float(wind["gain"]),
                "waves": 1.0, "wave_period": 1.0, "wave_band": 1.0, "wave_direction": self._seas.course,
                "wave_spread": 1.0, "wave_phases": 0.0, "mass": 1.0, "thrust": 1.0}  # fmt: skip

    def _differences(self, row: int) -> dict[str, tuple[float, float]]:
        """Parameters in which a row differs from its world, as a state has them."""
        usual, found = self._usual(), {}
        for name, (table, column) in _VARIED.items():
            stack = self._stacks[table]
            own, common = stack[row if len(stack) > 1 else 0][column], getattr(self._arrays, table)[column]
            value = float(self._varied[name][row])
            if name == "wave_phases" and self._seas.drawn[row]:
                continue
            if own.tobytes() != common.tobytes() and (name not in _SHARED or value != usual[name]):
                found[name] = value, usual[name]
        for name in sorted(self._varied.keys() - usual.keys()):
            value, common = float(self._varied[name][row]), self._numbers[name].value
            if value != common:
                found[name] = value, common
        return found

    @cached_property
    def _numbers(self) -> dict[str, Number]:
        """Numbers of the world of which rows can have their own."""
        found = {}
        for name, number in numbers_of(self.world.parameters).items():
            table, _, column, part = _place(number)
            is_whole = all(isinstance(step, int) for step in part) and not number.in_mjcf
            if table in _NUMBERED and is_whole and column in getattr(self._arrays, table).dtype.names:
                found[name] = number
        return found

    def _vary_numbers(self, which: IntArray, given: Mapping[str, npt.ArrayLike]) -> None:
        """Give rows numbers of their own, by name."""
        check_kind("parameters", given, Mapping, "a mapping of arrays, as {'wamv.hull.drag_linear.surge': [40, 60]}")
        values = {}
        for name, value in given.items():
            check_name("parameter", name, self._numbers)
            values[name] = row_values(name, value, len(which), -np.inf)
            for one in values[name]:
                self._numbers[name].field_value(one)
        for name, own in values.items():
            table, index, column, part = _place(self._numbers[name])
            self._separate(table)[column][(which, index, *part)] = own
            self._varied.setdefault(name, np.full(self.n, self._numbers[name].value))[which] = own

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
        boats = self._arrays.hulls["body"].tolist()
        for row, factor in zip(which.tolist(), factors.tolist(), strict=True):
            with allocating(self.n, self._arrays.data):
                pair = tuple(
                    _with_scaled_mass(model, boats, factor) for model in (self._model, self._arrays.contact_free)
                )
            self._own_models[row] = pair[0], pair[1]
            point_models(self._runs[row], *self._own_models[row], self._data[row])
            hulls["mass"][row] = self._arrays.hulls["mass"] * factor

    @property
    def largest_masses(self) -> FloatArray:
        """Factor of its mass up to which each boat floats at rest on a calm, (boats,); beyond, an end goes under."""
        return self._afloat.largest_masses()

    @in_turn
    def waves(self, row: int) -> Table:
        """Waves of a row's sea, a copy: records of amplitude [m], wavenumber, frequency, direction and phase [rad]."""
        row = whole("row", row, 0, self.n - 1)
        return self._waves_of(row)

    @in_turn
    def sea_height(self, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        """Height [m] of each row's sea at points x, y, (n, points) [m, ENU], at the row's present time.

        Raises:
            CommandError: the points are not numbers, or do not have that shape.
        """
        east, north = (np.ascontiguousarray(as_numbers(name, value)) for name, value in (("x", x), ("y", y)))
        if east.ndim != 2 or east.shape != north.shape or len(east) != self.n:
            text = f"({self.n}, points) of both is needed"
            raise CommandError(f"invalid x and y of shapes {east.shape} and {north.shape}: {text}")
        out = np.empty(east.shape)
        row_heights(self._stacks["waves"], self._arrays.sea, east, north, self._time, out)
        return out

    @in_turn
    def afloat(self, boat: str, places: npt.ArrayLike, rows: Rows = None) -> tuple[FloatArray, FloatArray]:
        """Poses and velocities, (rows, 6) each as in `set_boat`, with which a boat floats on the rows' present seas.

        Its weight is that of the row, engines included; wind and thrust are left out. A boat that the water cannot
        carry is upright, with its origin at the surface.

        Args:
            boat: name of the boat.
            places: x, y [m] and yaw [rad], (rows, 3).
            rows: mask or numbers of the rows; by default all.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the shape is wrong, or a number is not finite or too large.
        """
        check_name("boat", boat, self.boats)
        which, number = which_rows(self.n, rows), self.boats.index(boat)
        spots = row_vectors(f"places of {boat}", places, len(which), 3)
        times, masses = self._time.tolist(), self._masses.tolist()
        floating = [
            self._afloat.pose(number, self._waves_of(row), (x, y, yaw), times[row], masses[row])
            for row, (x, y, yaw) in zip(which.tolist(), spots.tolist(), strict=True)
        ]
        poses, velocities = (np.array([pair[k] for pair in floating]).reshape(-1, 6) for k in range(2))
        return poses, velocities

    def _waves_of(self, row: int) -> Table:
        waves = self._stacks["waves"]
        own: Table = waves[row if len(waves) > 1 else 0].copy()
        return own
