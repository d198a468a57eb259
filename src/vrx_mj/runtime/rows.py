"""Kernels over the rows of a batch: each row is a run of its own, advanced by the same `advance` as a `Simulation`.

A row has its `MjData` and its part of every table that changes. Its sea may differ from the world's: `RowSeas`.
"""

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from numba import types

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import CommandError
from vrx_mj.libmujoco import c_function
from vrx_mj.model.water import Sea
from vrx_mj.physics.kernel import allocating_kernel, expanded_kernel, kernel
from vrx_mj.physics.motion import motion
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import random_phases, stretch_waves, surface_height
from vrx_mj.runtime.loop import advance, advance_vrx
from vrx_mj.runtime.row_arguments import as_numbers
from vrx_mj.runtime.views import views

FEATURES = 13
"""Numbers of a boat: position (3) [m, ENU], quaternion (4), velocity [m/s] and angular velocity [rad/s], body axes."""

_mj_reset_data = c_function("mj_resetData", types.void, types.uintp, types.uintp)
_mj_forward = c_function("mj_forward", types.void, types.uintp, types.uintp)


@allocating_kernel
def advance_rows(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int,
) -> None:  # fmt: skip
    """Advance the rows from `first` up to `last` by `steps` physics steps of `dt` [s].

    `done` holds the steps done of each row, -1 where it has diverged; such a row stays, as one does that is not
    `going`. `qpos` and `qvel`, (n, nq) and (n, nv), and `time` [s], (n,), follow.
    """
    _advance_rows(first, last, runs, qpos, qvel, time, done, going, dt, steps, None)


@allocating_kernel
def advance_rows_vrx(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int,
) -> None:  # fmt: skip
    """`advance_rows` for the worlds of `advance_vrx`."""
    _advance_rows(first, last, runs, qpos, qvel, time, done, going, dt, steps, 1)


@expanded_kernel
def _advance_rows(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int, vrx: int | None,
) -> None:  # fmt: skip
    """`advance_rows`; where `vrx` is None, numba leaves out `advance_vrx`, else `advance`."""
    for i in range(first, last):
        if done[i] < 0 or not going[i]:
            continue
        if vrx is None:
            done[i] = advance(runs, i, time[i], dt, steps)
        else:
            done[i] = advance_vrx(runs, i, time[i], dt, steps)
        for _ in range(steps):  # as MuJoCo adds it up
            time[i] += dt
        own = views(runs[i])
        qpos[i], qvel[i] = own.qpos, own.qvel


@allocating_kernel
def reset_rows(which: IntArray, runs: Table, qpos: FloatArray, qvel: FloatArray) -> None:
    """Bring MuJoCo's part of some rows back to the start."""
    for i in which:
        _mj_reset_data(runs[i].model, runs[i].data)
        _mj_forward(runs[i].model, runs[i].data)
        own = views(runs[i])
        qpos[i], qvel[i] = own.qpos, own.qvel


@allocating_kernel
def write_rows(which: IntArray, runs: Table, qpos: FloatArray, qvel: FloatArray) -> None:
    """Write the rows' `qpos` and `qvel` into MuJoCo's part of them."""
    for i in which:
        own = views(runs[i])
        own.qpos[:], own.qvel[:] = qpos[i], qvel[i]
        _mj_forward(runs[i].model, runs[i].data)


@kernel
def observe_rows(first: int, last: int, hulls: Table, qpos: FloatArray, qvel: FloatArray, features: FloatArray) -> None:
    """Write what is seen of every boat of the rows from `first` up to `last` to `features`, (n, boats, FEATURES)."""
    for i in range(first, last):
        for k in range(hulls.shape[1]):
            _observe(hulls[0, k], qpos[i], qvel[i], features[i, k])


@kernel
def _observe(hull: Record, qpos: FloatArray, qvel: FloatArray, out: FloatArray) -> None:
    body = motion(qpos, qvel, hull.qpos, hull.dof)
    for k in range(7):
        out[k] = qpos[hull.qpos + k]
    out[7], out[8], out[9] = body.u, body.v, body.w
    out[10], out[11], out[12] = body.p, body.q, body.r


_f = np.float64
NOMINAL = np.dtype([("peak", _f), ("direction", _f, (2,)), ("gravity", _f)], align=True)
"""The world's sea: angular frequency of its period [rad/s], its direction, and the gravity of its waves [m/s2]."""
_CHANGE = np.dtype([("amplitude", _f), ("period", _f), ("band", _f), ("spread", _f), ("turn", _f)], align=True)
"""The sea of a row: factors of amplitudes, periods, the band's width and the spread of directions, and a turn [rad]."""
_FACTORS = {"waves": "amplitude", "wave_period": "period", "wave_band": "band", "wave_spread": "spread"}
"""Columns of `_CHANGE` by what `Batch.vary` calls them."""
_LENGTHS = ("wave_period", "wave_band")
"""Arguments that change wavelengths, by the dispersion of deep water."""


class RowSeas:
    """What the sea of each row has of its own."""

    def __init__(self, waves: Table, sea: Sea, n: int) -> None:
        """Take a world's `tables.WAVE` and its sea; all `n` rows have that sea."""
        self._world = np.broadcast_to(waves, (n, len(waves)))
        peak = 2.0 * math.pi / sea.period if sea.period else 1.0
        self._nominal = np.array([(peak, sea.direction, sea.gravity)], NOMINAL)
        self._deep, self._harmonic = sea.depth is None, sea.model == "stokes5"
        self.drawn = np.full(n, sea.random)
        """Which rows have the phases of their seeds."""
        self._change = np.array([(1.0, 1.0, 1.0, 1.0, 0.0)] * n, _CHANGE)
        self._phases = np.zeros((n, len(waves)))

    def set_waves(self, row: int, waves: Table) -> None:
        """Give a row the `tables.WAVE` of a world with other waves."""
        if not self._world.flags.writeable:
            self._world = self._world.copy()
        self._world[row] = waves

    @property
    def course(self) -> float:
        """Direction in which the world's sea travels [rad], counter-clockwise from x."""
        east, north = self._nominal["direction"][0].tolist()
        return math.atan2(north, east)

    def change(self, which: IntArray, given: Mapping[str, FloatArray], phases: npt.ArrayLike | None) -> Table:
        """Change these rows' seas, and return their waves (rows, waves).

        Raises:
            CommandError: the phases do not have the shape (waves,) or (rows, waves), or are not finite.
        """
        fixed = ("waves", *_LENGTHS) if self._harmonic else () if self._deep else _LENGTHS
        for name in fixed:
            if name in given and (given[name] != 1.0).any():
                raise CommandError(
                    f"{name} cannot be varied in {'a Stokes wave' if self._harmonic else 'shallow water'}"
                )
        if phases is not None:
            own, shape = as_numbers("wave_phases", phases), (len(which), self._world.shape[1])
            if own.shape not in {shape, shape[1:]} or not np.isfinite(own).all():
                text = f"{shape} or {shape[1:]}, of finite numbers, is needed"
                raise CommandError(f"invalid wave_phases of shape {own.shape}: {text}")
            self._phases[which] = own
            self.drawn[which] = False
        for name, column in _FACTORS.items():
            if name in given:
                self._change[column][which] = given[name]
        if "wave_direction" in given:
            self._change["turn"][which] = given["wave_direction"] - self.course
        return self.waves(which)

    def draw(self, which: IntArray, seeds: IntArray) -> Table:
        """Draw the phases of rows from their seeds, where none were given, and return their waves (rows, waves)."""
        for row, seed in zip(which.tolist(), seeds[which].tolist(), strict=True):
            if self.drawn[row]:
                self._phases[row] = random_phases(seed, self._world.shape[1])
        return self.waves(which)

    def waves(self, which: IntArray) -> Table:
        """Waves of rows, (rows, waves)."""
        waves = np.zeros((len(which), self._world.shape[1]), self._world.dtype)
        _stretch_rows(self._world[which], self._nominal, self._change[which], self._phases[which], waves)
        return waves


@kernel
def _stretch_rows(world: Table, nominal: Table, change: Table, phases: FloatArray, waves: Table) -> None:
    """Write the waves of every row, (rows, waves)."""
    for i in range(change.size):
        stretch_waves(world[i], nominal[0], change[i], phases[i], waves[i])


@kernel
def row_heights(waves: Table, sea: Table, x: FloatArray, y: FloatArray, t: FloatArray, out: FloatArray) -> None:
    """Write the heights of the rows' seas at points x and y, (rows, points), at times t, (rows,), to `out`."""
    for i in range(t.size):
        own = waves[i] if waves.shape[0] > 1 else waves[0]
        level = sea[i, 0] if sea.shape[0] > 1 else sea[0, 0]
        for k in range(x.shape[1]):
            out[i, k] = surface_height(own, level, x[i, k], y[i, k], t[i])
