"""The rows of a batch: what each has of its own, and its memory."""

import copy
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import CommandError
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.limits import total_memory
from vrx_mj.runtime.loop_arrays import LoopArrays, mujoco_arrays, point_models
from vrx_mj.runtime.rows import FEATURES, reset_rows
from vrx_mj.runtime.state import integration_state, set_integration_state
from vrx_mj.runtime.views import ARRAYS, OWN, PARAMETER, RUN, STATE, point, point_rows

_FIXED = 455_000
"""Memory of any row [bytes]: MuJoCo's `mjData` itself, mostly statistics of its solver; measured with MuJoCo 4.0."""
_OUT_OF_MEMORY = "Caught an unknown exception!"
"""Words of the RuntimeError by which MuJoCo's bindings of MuJoCo 4.0 may report a failed allocation."""
SEPARATE = tuple(name for name, array in ARRAYS.items() if array.use in {STATE, OWN})
"""Tables of which every row has its own part."""
_KEPT: Mapping[str, tuple[str, ...]] = {
    "wind": ("key", "direction", "mean", "gain"), "current": ("key",), "air": ("key",), "gust_bands": ("phase",),
    "hulls": ("mass",), "thrusters": ("gain",), "sea": (),
}  # fmt: skip
"""Tables of the same size in all rows, and their columns that a row's run and its factors set, not its numbers."""

_STACKED = (*SEPARATE, *_KEPT, "waves")
"""Tables of which rows may have a part in a stack."""


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
    """Context in which the memory of `n` rows like this one is allocated.

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


class RowTables:
    """MuJoCo's data of the rows, and the tables of which each may have its own part."""

    def __init__(self, arrays: LoopArrays, n: int) -> None:
        """All `n` rows have the world of these arrays."""
        model = arrays.model
        self.n, self.arrays = n, arrays
        self.data = [mujoco.MjData(model) for _ in range(n)]
        self.runs = np.zeros(n, RUN)
        shared = arrays.by_name(np.zeros(3, np.int64), np.zeros((0, arrays.columns)))
        self.stacks = {name: array[None] for name, array in shared.items()}
        """A table by its name, of all rows, (1, ...), or a part for each, (n, ...)."""
        point_rows(self.runs, **self.stacks)
        for row, data in enumerate(self.data):
            run = self.runs[row : row + 1]
            point_models(run, model, arrays.contact_free, data)
            point(run, **mujoco_arrays(data))
        self.time, self.done = np.zeros(n), np.zeros(n, np.int64)
        self.qpos, self.qvel = np.zeros((n, model.nq)), np.zeros((n, model.nv))
        self.features = np.zeros((n, len(arrays.hulls), FEATURES))
        self.masses = np.ones(n)
        """Factors of the boats' masses."""
        self._models: dict[int, tuple[mujoco.MjModel, mujoco.MjModel]] = {}
        self._own: list[dict[str, Table]] = [{} for _ in range(n)]
        for name in (*SEPARATE, "current", "wind", "gust_bands", "air"):
            self.separate(name)

    def separate(self, name: str) -> Table:
        """The stack of a table in which every row has its own part."""
        stack = self.stacks[name]
        if not len(stack) == self.n > 1:
            stack = self.stacks[name] = np.repeat(stack, self.n, axis=0)
            point_rows(self.runs, **{name: stack})
        return stack

    def part(self, name: str, row: int) -> Table:
        """The table of a row."""
        stack = self.stacks[name]
        part: Table = self._own[row].get(name, stack[row if len(stack) > 1 else 0])
        return part

    def set_parameters(self, row: int, arrays: LoopArrays) -> None:
        """Give a row the numbers of other arrays of its world, `LoopArrays.with_parameters`, but for its waves."""
        for name, array in ARRAYS.items():
            table: Any = vars(arrays).get(name)
            if array.use != PARAMETER or table is vars(self.arrays).get(name) or name == "waves":
                continue
            if name in _KEPT:
                part = self.separate(name)[row]
                kept = {column: part[column].copy() for column in _KEPT[name]}
                part[:] = table
                for column, values in kept.items():
                    part[column] = values
            else:
                usual = self.stacks[name][0]
                same = table.shape == usual.shape and table.tobytes() == usual.tobytes()
                own = self._own[row][name] = usual if same else table
                point(self.runs[row : row + 1], **{name: own})

    def weigh(self, which: IntArray, factors: FloatArray) -> None:
        """Give rows models of their own with all boats' masses and inertias times a factor."""
        arrays, hulls = self.arrays, self.separate("hulls")
        self.masses[which] = factors
        boats = arrays.hulls["body"].tolist()
        for row, factor in zip(which.tolist(), factors.tolist(), strict=True):
            with allocating(self.n, arrays.data):
                stepping, contact_free = (
                    _with_scaled_mass(model, boats, factor) for model in (arrays.model, arrays.contact_free)
                )
            self._models[row] = stepping, contact_free
            point_models(self.runs[row], stepping, contact_free, self.data[row])
            hulls["mass"][row] = arrays.hulls["mass"] * factor

    def reset(self, which: IntArray) -> None:
        """Bring MuJoCo's part of some rows back to the start."""
        self.time[which], self.done[which] = 0.0, 0
        reset_rows(which, self.runs, self.qpos, self.qvel)

    def integration_state(self, row: int) -> FloatArray:
        """MuJoCo's state of a row."""
        return integration_state(self._model(row), self.data[row])

    def snapshot(self) -> tuple[Any, ...]:
        """What a copy needs for `restore`."""
        flats = [self.integration_state(row) for row in range(self.n)]
        stacks = {name: self.stacks[name] for name in _STACKED}
        return self.masses, flats, stacks, self.time, self.done, self.qpos, self.qvel

    def restore(
        self, masses: FloatArray, flats: Sequence[FloatArray], stacks: Mapping[str, Table], *moving: Any
    ) -> None:
        """Go on as the rows do of which this is the `snapshot`."""
        heavy = np.flatnonzero(masses != 1.0)
        self.weigh(heavy, masses[heavy])
        self.time, self.done, self.qpos, self.qvel = moving
        self.stacks.update(stacks)
        point_rows(self.runs, **stacks)
        for row, flat in enumerate(flats):
            set_integration_state(self._model(row), self.data[row], flat)

    def _model(self, row: int) -> mujoco.MjModel:
        return self._models.get(row, (self.arrays.model,))[0]
