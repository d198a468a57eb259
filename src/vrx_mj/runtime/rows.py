"""Kernels over the rows of a batch: each row is a run of its own, advanced by the same `advance` as a `Simulation`.

A row has its `MjData` and its part of every table that changes. Its sea may differ from the world's: `RowSeas`.

What callers of a batch give is checked here too: rows, seeds, values and commands.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import CommandError, quote
from vrx_mj.libmujoco import c_function
from vrx_mj.model.water import Sea
from vrx_mj.physics.kernel import allocating_kernel, expanded_kernel, kernel
from vrx_mj.physics.lanes import sync_lanes
from vrx_mj.physics.motion import motion
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.vessel import Work
from vrx_mj.physics.waves import random_heights, random_phases, stretch_waves, surface_height
from vrx_mj.physics.wind import air_velocity
from vrx_mj.runtime.loop import MAX_STATE, advance, advance_free, advance_vrx, advance_vrx_sea
from vrx_mj.runtime.views import row_views, views
from vrx_mj.sensors.sea import wave_table

Rows = npt.ArrayLike | None
"""Which rows: a mask (n,) of truths, their numbers, or None for all."""


MAX_VALUE = 1e6
"""Largest value of an argument of `Batch.vary`, in its unit."""
_TINY = float(np.nextafter(0.0, 1.0))
ARGUMENTS: Mapping[str, tuple[str, str, float]] = {
    "wind_speed": ("wind", "mean", -np.inf), "wind_direction": ("wind", "direction", -np.inf),
    "gusts": ("wind", "gain", 0.0), "waves": ("waves", "amplitude", 0.0),
    "wave_period": ("waves", "frequency", _TINY), "wave_band": ("waves", "frequency", 0.0),
    "wave_direction": ("waves", "direction", -np.inf), "wave_spread": ("waves", "direction", 0.0),
    "wave_phases": ("waves", "phase", -np.inf), "mass": ("hulls", "mass", _TINY), "thrust": ("thrusters", "gain", 0.0),
}  # fmt: skip
"""Arguments of `Batch.vary`: table and column in which each is, or the product with a factor, and its least value."""
FEATURES = 13
"""Number of values of a boat: position (3) [m, ENU], quaternion (4), velocity [m/s] and angular velocity [rad/s], body
axes."""
_LENGTH_ARGUMENTS = ("wave_period", "wave_band")
"""Arguments that change wavelengths, by the dispersion of deep water."""


def which_rows(n: int, rows: Rows) -> IntArray:
    """Return the numbers of the rows, of `n`, that are meant.

    Raises:
        CommandError: neither a mask nor numbers of rows.
    """
    if rows is None:
        return np.arange(n)
    given = _array(rows)
    if given.dtype == bool and given.shape == (n,):
        return np.flatnonzero(given)
    if given.size == 0:
        return np.zeros(0, np.int64)
    if given.ndim == 1 and np.issubdtype(given.dtype, np.integer) and (given >= 0).all() and (given < n).all():
        return given.astype(np.int64)
    raise CommandError(f"invalid rows {quote(rows)}: a mask of {n} booleans, or numbers from 0 to {n - 1}, is needed")


def _array(values: object) -> npt.NDArray[Any]:
    """The values as an array; one of no dimensions if they make none."""
    try:
        return np.asarray(values)
    except ValueError:  # lists of several lengths
        return np.array(None)


def row_seeds(which: IntArray, seed: Any) -> IntArray:
    """Return a seed for each of these rows: those given, or a number s and s + i in row i.

    Raises:
        CommandError: neither one whole number nor as many as there are rows.
    """
    one = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if one and 0 <= seed < 2**63 - int(which.max(initial=0)):
        return int(seed) + which
    given = _array(seed)
    if given.shape != which.shape or not np.issubdtype(given.dtype, np.integer) or (given < 0).any():
        raise CommandError(f"invalid seed {quote(seed)}: one whole number, or {len(which)} of them, is needed")
    return given.astype(np.int64)


def as_numbers(what: str, values: npt.ArrayLike) -> FloatArray:
    """Return the values as an array.

    Raises:
        CommandError: they are not numbers.
    """
    try:
        given = np.asarray(values)
        if given.dtype.kind in "biuf" or (given.dtype.kind == "O" and values is not None):
            return given.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise CommandError(f"invalid {what} {quote(values)}: an array of numbers is needed")


def row_vectors(what: str, values: npt.ArrayLike, count: int, size: int = 6) -> FloatArray:
    """Return `size` numbers for each of `count` rows, (count, size).

    Raises:
        CommandError: another shape, or numbers that no state may have.
    """
    given = as_numbers(what, values)
    if given.shape not in {(size,), (count, size)} or not (np.abs(given) < MAX_STATE).all():
        text = f"{(count, size)} or {(size,)}, of numbers below {MAX_STATE:g}, is needed"
        raise CommandError(f"invalid {what} of shape {given.shape}: {text}")
    return np.broadcast_to(given, (count, size))


def row_values(what: str, value: npt.ArrayLike, count: int, least: float, most: float = MAX_VALUE) -> FloatArray:
    """Return a number for each of `count` rows, (count,).

    Raises:
        CommandError: another shape, or numbers that are not finite, below `least` or above `most`.
    """
    given = as_numbers(what, value)
    if given.shape not in {(), (count,)} or not (np.isfinite(given) & (given >= least)).all():
        at_least = "" if least < 0 else " of 0 or more" if least == 0 else " above 0"
        raise CommandError(f"invalid {what} {quote(value)}: one finite number{at_least}, or {count} of them, is needed")
    if (np.abs(given) > most).any():
        raise CommandError(f"invalid {what} {quote(value)}: at most {most:g}")
    return np.broadcast_to(given, (count,)).copy()


def varied_values(count: int, given: Mapping[str, Any]) -> dict[str, FloatArray]:
    """Return which `ARGUMENTS` were given, by name, a number for each of `count` rows, without phases.

    Raises:
        CommandError: another shape, or numbers that are not finite, or too small or too large.
    """
    return {name: row_values(name, given[name], count, least) for name, (_, column, least) in ARGUMENTS.items()
            if given.get(name) is not None and column != "phase"}  # fmt: skip


_mj_reset_data = c_function("mj_resetData", types.void, types.uintp, types.uintp)
_mj_forward = c_function("mj_forward", types.void, types.uintp, types.uintp)


@allocating_kernel
def advance_rows(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int,
) -> None:  # fmt: skip
    """Advance the rows from `first` up to `last` by `steps` physics steps of `dt` [s].

    `done` holds the steps done of each row, fewer where MuJoCo is needed and the row has no data of it, -1 where it has
    diverged; such a row stays, as one does that is not `going`. `qpos` and `qvel`, (n, nq) and (n, nv), and `time` [s],
    (n,), follow.
    """
    _advance_rows(first, last, runs, qpos, qvel, time, done, going, dt, steps, advance)


@allocating_kernel
def advance_rows_vrx(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int,
) -> None:  # fmt: skip
    """`advance_rows` for the worlds of `advance_vrx`."""
    _advance_rows(first, last, runs, qpos, qvel, time, done, going, dt, steps, advance_vrx)


@allocating_kernel
def advance_rows_vrx_sea(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int,
) -> None:  # fmt: skip
    """`advance_rows` for the worlds of `advance_vrx_sea`."""
    _advance_rows(first, last, runs, qpos, qvel, time, done, going, dt, steps, advance_vrx_sea)


ROW_LOOPS = advance_rows, advance_rows_vrx, advance_rows_vrx_sea
"""The loops of rows, by the number in `LoopArrays.loop`."""


@expanded_kernel
def _advance_rows(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int, advance: Callable[..., int],
) -> None:  # fmt: skip
    """`advance_rows` by one of the loops."""
    for i in range(first, last):
        if done[i] < 0 or not going[i]:
            continue
        done[i] = advance(runs, i, time[i], dt, steps)
        for _ in range(steps if done[i] < 0 else done[i]):  # as MuJoCo adds it up
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
        if runs[i].data != 0:
            _mj_forward(runs[i].model, runs[i].data)


@kernel
def observe_rows(first: int, last: int, hulls: Table, qpos: FloatArray, qvel: FloatArray, features: FloatArray) -> None:
    """Write what is seen of every boat of the rows from `first` up to `last` to `features`, (n, boats, FEATURES)."""
    for i in range(first, last):
        for k in range(hulls.shape[1]):
            _observe(hulls[0, k], qpos[i], qvel[i], features[i, k])


@kernel
def advance_free_row(
    runs: Table, run: int, row: int, time: FloatArray, done: IntArray, features: FloatArray, dt: float, steps: int,
    damping: FloatArray, work: Work,
) -> None:  # fmt: skip
    """Advance a row without MuJoCo, as far as nothing is near, and write what is seen of its boats.

    This is what a thread of a graphics processor does; arguments are those of `advance_rows` and `loop.advance_free`.
    `run` is the thread's among `runs`: threads that share a row and its `work` have each its own state of it.
    """
    if done[row] >= 0:
        now = time[row]
        made = advance_free(runs, run, now, dt, steps, damping, work)
        for _ in range(steps if made < 0 else made):
            now += dt
        if work is not None:
            sync_lanes()  # others still have to read where they began
        done[row], time[row] = made, now
    a = views(runs[run])
    for k in range(a.hulls.size):
        _observe(a.hulls[k], a.qpos, a.qvel, features[row, k])


@kernel
def observe_row(runs: Table, row: int, time: float, wind: FloatArray, surface: FloatArray) -> None:
    """Write the wind's velocity along x and y, (2,), and the height of the sea at every boat, (boats,), of a row."""
    a = row_views(runs[row])
    wind[0], wind[1] = air_velocity(a.wind[0], a.wind_state[0], a.air_state)
    for k in range(a.hulls.size):
        at = a.hulls[k].qpos
        surface[k] = surface_height(a.waves, a.sea[0], a.qpos[at], a.qpos[at + 1], time, a.own_waves)


@allocating_kernel
def command_rows(
    which: IntArray, runs: Table, time: FloatArray, values: FloatArray, thrusters: IntArray, angles: IntArray,
    hold: float,
) -> None:  # fmt: skip
    """`command_row` for some rows, with a row of `values` for each."""
    for number, i in enumerate(which):
        command_row(runs, i, time[i], values[number], thrusters, angles, hold)


@kernel
def command_row(
    runs: Table, row: int, time: float, values: FloatArray, thrusters: IntArray, angles: IntArray, hold: float
) -> None:
    """Give a row values of all channels, those of `thrusters`, which `angles` (0 or 1) steer; a thrust lasts `hold`."""
    a = views(runs[row])
    for k in range(thrusters.size):
        own, timeout = a.thruster_state[thrusters[k]], a.thrusters[thrusters[k]].timeout
        if angles[k] != 0:
            own.angle_target = values[k]
        else:
            own.command = values[k]
            own.expires = time + (max(timeout, hold) if timeout > 0.0 else math.inf)


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
_CHANGE = np.dtype([("period", _f), ("band", _f), ("spread", _f), ("turn", _f)], align=True)
"""The sea of a row: factors of periods, the band's width and the spread of directions, and a turn [rad]."""
_UNCHANGED = np.array((1.0, 1.0, 1.0, 0.0), _CHANGE)


def fixed_arguments(sea: Sea) -> tuple[str, ...]:
    """Names of what `Batch.vary` cannot vary: the harmonics of a Stokes wave, and lengths in shallow water."""
    if sea.is_stokes:
        return ("waves", *_LENGTH_ARGUMENTS, "wave_phases")
    return () if sea.depth is None else _LENGTH_ARGUMENTS


class RowSeas:
    """Parameters of the sea of each row.

    While rows differ in phases and heights alone, they share the world's waves.
    """

    def __init__(self, sea: Sea, n: int) -> None:
        """Take a world's sea; all `n` rows have it."""
        self.table = wave_table(sea)[None]
        """`tables.WAVE` of the world, (1, waves), or of that of each row, (n, waves), where rows have other numbers."""
        self.shared = True
        """Whether all rows have the world's wavelengths, periods and directions."""
        self.own = np.zeros((n, 0))
        """`physics.tables.OwnWaves` of each row, (n, size)."""
        peak = 2.0 * math.pi / sea.period if sea.period else 1.0
        self._nominal = np.array([(peak, sea.direction, sea.gravity)], NOMINAL)
        self._fixed = fixed_arguments(sea)
        self.drawn = np.full(n, sea.random)
        """Which rows have the phases and energies of their seeds."""
        self._change = np.full(n, _UNCHANGED, _CHANGE)

    def _parts(self, size: int) -> FloatArray:
        """`own`, with at least `size` numbers a row."""
        known, phases = self.own.shape[1], slice(1, 1 + self.table.shape[1])
        if known < size:
            more = np.ones((len(self.own), size))
            more[:, phases] = 0.0
            more[:, :known] = self.own
            self.own = more
        return self.own

    def set_waves(self, row: int, waves: Table) -> None:
        """Give a row the `tables.WAVE` of a world with other waves."""
        if len(self.table) < len(self.own):
            self.table = np.repeat(self.table, len(self.own), axis=0)
        self.table[row] = waves
        self.shared = False

    @property
    def course(self) -> float:
        """Direction in which the world's sea travels [rad], counter-clockwise from x."""
        east, north = self._nominal["direction"][0].tolist()
        return math.atan2(north, east)

    def change(self, which: IntArray, given: Mapping[str, FloatArray], phases: npt.ArrayLike | None) -> None:
        """Change these rows' seas.

        Raises:
            CommandError: the phases do not have the shape (waves,) or (rows, waves), or are not finite.
        """
        for name in self._fixed:
            if (phases is not None) if name == "wave_phases" else (name in given and (given[name] != 1.0).any()):
                raise CommandError(
                    f"{name} cannot be varied in {'a Stokes wave' if 'waves' in self._fixed else 'shallow water'}"
                )
        if phases is not None:
            own, shape = as_numbers("wave_phases", phases), (len(which), self.table.shape[1])
            if own.shape not in {shape, shape[1:]} or not np.isfinite(own).all():
                text = f"{shape} or {shape[1:]}, of finite numbers, is needed"
                raise CommandError(f"invalid wave_phases of shape {own.shape}: {text}")
            parts = self._parts(1 + shape[1])
            parts[which, 1 : 1 + shape[1]], parts[which, 1 + shape[1] :] = own, 1.0
            self.drawn[which] = False
        if "waves" in given:
            self._parts(1)[which, 0] = given["waves"]
        for column in ("period", "band", "spread"):
            if (name := f"wave_{column}") in given:
                self._change[column][which] = given[name]
        if "wave_direction" in given:
            self._change["turn"][which] = given["wave_direction"] - self.course
        self.shared = self.shared and bool((self._change[which] == _UNCHANGED).all())

    def draw(self, which: IntArray, seeds: IntArray) -> None:
        """Draw phases and energies of rows from their seeds, where no phases were given."""
        shapes, count = self.table["energy_shape"], self.table.shape[1]
        parts = self._parts(1 + count + (count if shapes.any() else 0))
        for row, seed in zip(which.tolist(), seeds[which].tolist(), strict=True):
            if self.drawn[row]:
                parts[row, 1 : 1 + count] = random_phases(seed, count)
                if parts.shape[1] > 1 + count:
                    parts[row, 1 + count :] = random_heights(seed, shapes[row if len(shapes) > 1 else 0])

    def waves(self, which: IntArray) -> Table:
        """Waves of rows, (rows, waves)."""
        waves = np.zeros((len(which), self.table.shape[1]), self.table.dtype)
        _stretch_rows(which, self.table, self._nominal, self._change, self.own, waves)
        return waves


@kernel
def _stretch_rows(which: IntArray, world: Table, nominal: Table, change: Table, own: FloatArray, waves: Table) -> None:
    """Write the waves of some rows, (rows, waves)."""
    for i in range(which.size):
        row = which[i]
        stretch_waves(world[row if len(world) > 1 else 0], nominal[0], change[row], own[row], waves[i])


@kernel
def row_heights(
    waves: Table, own: FloatArray, sea: Table, x: FloatArray, y: FloatArray, t: FloatArray, out: FloatArray
) -> None:
    """Write the heights of the rows' seas at points x and y, (rows, points), at times t, (rows,), to `out`."""
    for i in range(t.size):
        table, part = waves[i if len(waves) > 1 else 0], own[i if len(own) > 1 else 0]
        level = sea[i, 0] if sea.shape[0] > 1 else sea[0, 0]
        for k in range(x.shape[1]):
            out[i, k] = surface_height(table, level, x[i, k], y[i, k], t[i], part)
