"""Many worlds at once: rows of one model, each with a seed, a state and, if wanted, a wind, sea and boat of its own."""

import time as clock
from collections.abc import Callable, Mapping
from functools import partial
from numbers import Real
from typing import Any, Literal, get_args

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_int, as_number, check_kind, check_name
from vrx_mj.arrays import BoolArray, FloatArray, IntArray, read_only
from vrx_mj.errors import CommandError, DivergedError, quote
from vrx_mj.frames import in_world_axes
from vrx_mj.libmujoco import without_timers
from vrx_mj.mjcf.world import World
from vrx_mj.physics.free_body import SOLVE_WORK
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.commands import channels_of
from vrx_mj.runtime.hull import energy_of
from vrx_mj.runtime.limits import ThreadPool, thread_count
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.row_tables import (
    SEPARATE,
    Equilibrium,
    RowTables,
    Seeds,
    Values,
    Variation,
    allocating,
    check_free,
    check_memory,
    free_bodies,
    row_bytes,
)
from vrx_mj.runtime.rows import (
    FEATURES,
    ROW_LOOPS,
    Rows,
    as_numbers,
    command_rows,
    observe_rows,
    row_heights,
    row_seeds,
    row_vectors,
    varied_values,
    which_rows,
    write_rows,
)
from vrx_mj.runtime.run_lock import RunLock, advancing, with_run_lock
from vrx_mj.runtime.running_world import FreeBodies, write_pose
from vrx_mj.runtime.state import STATE_VERSION, State, rows_divergence_message
from vrx_mj.runtime.stepping_models import check_room, stepping_models
from vrx_mj.runtime.timing import MOST_STEPS, whole_steps
from vrx_mj.runtime.views import ARRAYS, STATE
from vrx_mj.runtime.warmup import compile_notice
from vrx_mj.signals import check_exit, delays_exit

_CALL_TIME = 0.05
"""Wall time of one call of the compiled loop [s]: Ctrl-C works between two."""
MAX_ROWS = 10**6
"""Largest number of rows, and of threads, of a batch."""

Engine = Literal["mujoco", "free"]
"""Integrator of the rows of a batch."""


class Batch:
    """`n` independent copies (rows) of one world, advanced in parallel on all cores.

    Row i moves exactly as a `Simulation` of the same world and seed, whatever the number of rows and threads. A batch
    has no tasks, sensors or recordings; a `Simulation` has them, and can continue from the state that `get_state(row)`
    returns. A row whose parameters `vary` has changed belongs to a different world.

    Threads that share a batch take turns; while one advances, the methods of all others raise a CommandError.

    A copy, including a pickled one, continues like the original, bit for bit.
    """

    @delays_exit()
    def __init__(
        self, world: World, n: int, *, seed: Seeds = None, threads: int | None = None,
        engine: Engine = "mujoco",
    ) -> None:  # fmt: skip
        """Create the rows of a world.

        Args:
            world: the world of every row; it must have no task (`compile_world({"extends": name, "task": None})`).
            n: number of rows.
            seed: seed of the rows, as in `reset`.
            threads: number of threads; by default OMP_NUM_THREADS, SLURM_CPUS_PER_TASK or the number of cores.
            engine: what integrates. `mujoco`; or `free`, for worlds in which all that moves are single free bodies:
                their own step, which is MuJoCo's to rounding (1e-12 m after 10 s), about 2 to 4 times as fast, with
                2.5 kB a row instead of 490. From when a row comes within reach of anything MuJoCo steps it, until the
                next look finds it clear.

        Raises:
            CommandError: `world` is not a World or has a task, `n` or `threads` is below 1, there is no memory for so
                many rows, or the engine cannot step this world.
        """
        check_kind("Batch", world, World, "a World, as compile_world returns it")
        counts: dict[str, Any] = {"n": n, "threads": 1 if threads is None else threads}
        for name, count in counts.items():
            value = as_number(count)
            if not isinstance(count, Real) or not value >= 1 or value % 1 != 0:
                raise CommandError(f"invalid {name} {quote(count)}: a whole number above 0 is needed")
            if value > MAX_ROWS:
                raise CommandError(f"invalid {name} {quote(count)}: at most {MAX_ROWS} are possible")
        if world.parameters.task:
            text = 'compile it without one, {"extends": name, "task": None}'
            raise CommandError(f"the world {world.name} has a task, and a Batch has no referee: {text}")
        check_name("engine", engine, get_args(Engine))
        self.world, self.n, self.engine = world, int(n), engine
        self._world_id = world.sha256
        model, contact_free = stepping_models(world)
        arrays = self._arrays = LoopArrays(world, model, contact_free, mujoco.MjData(model))
        arrays.reset(0)
        if engine == "free":
            check_free(arrays, world.name)
            arrays.free_bodies = free_bodies(arrays, contact_free, arrays.hulls, arrays.vessels)
            solved = (arrays.free_bodies["float"] >= 0) & (arrays.free_bodies["diagonal"] == 0)
            arrays.solve_work = np.zeros(int(solved.any()), SOLVE_WORK)
        self._bodies, self._pool = FreeBodies(world, arrays), ThreadPool(int(threads or thread_count()))
        check_memory(self.n, row_bytes(arrays))
        with allocating(self.n, arrays.data):
            self._rows = RowTables(arrays, self.n, world.parameters.sea)
        self._variation, self._equilibrium = Variation(world, self._rows), Equilibrium(self._rows)
        self._channels = channels_of(world)
        columns = [(one.row, one.column != "command") for one in self._channels]
        self._thrusters, self._angles = np.array(columns, np.int64).reshape(-1, 2).T.copy()
        self._seeds, self._going = np.zeros(self.n, np.int64), np.ones(self.n, np.bool_)
        self._pace, self._run_lock = 1e-5, RunLock("batch")
        self._loop = ROW_LOOPS[arrays.loop]
        with compile_notice(self._loop):
            self.reset(seed=seed)
            self.advance(0)

    def __reduce__(self) -> tuple[Callable[..., "Batch"], tuple[World, int], tuple[Any, ...]]:
        carried = self._seeds, self._rows.snapshot(), self._variation.snapshot()
        return partial(type(self), threads=self.threads, engine=self.engine), (self.world, self.n), carried

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self._seeds, rows, variation = state
        self._rows.restore(*rows)
        self._variation.restore(*variation)
        self._observe()

    # What it is

    @property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats in every row, in the order of the second axis of `features`."""
        return self.world.boats

    @property
    def timestep(self) -> float:
        """Physics step [s]."""
        return self._arrays.timestep

    @property
    def threads(self) -> int:
        """Number of threads that advance the rows."""
        return self._pool.threads

    @property
    def seeds(self) -> IntArray:
        """Seed of the current run of each row, (n,)."""
        return self._seeds.copy()

    @property
    def channels(self) -> tuple[tuple[str, str], ...]:
        """Boat and name of every command, in the order that `command` takes: thrusts, then steering angles."""
        return tuple((channel.boat, channel.name) for channel in self._channels)

    @property
    def largest(self) -> FloatArray:
        """Least and greatest effective value of every command, (channels, 2): share of full power, N, or angle [rad].

        Values outside are clamped. A row whose thrusters `vary` has changed has its own limits.
        """
        return np.array([channel.limits for channel in self._channels]).reshape(-1, 2)

    @property
    def time(self) -> FloatArray:
        """Simulated time of each row, (n,) [s]."""
        return self._rows.time.copy()

    @property
    def diverged(self) -> BoolArray:
        """Whether the state of each row is not finite or too large, (n,); such a row stops until it is reset."""
        return self._rows.done < 0

    @property
    def features(self) -> FloatArray:
        """State of every boat, (n, boats, 13), as a read-only view whose content changes with the next call.

        The columns are position (3) [m, ENU] and quaternion (4) (w, x, y, z) of the boat's `base_link` origin, its
        velocity (3) [m/s] and angular velocity (3) [rad/s] in body axes.
        """
        return read_only(self._rows.features)

    @property
    def qpos(self) -> FloatArray:
        """Generalized positions of MuJoCo's model in every row, (n, nq), a read-only view.

        `set_boat` moves boats, and `set_object` objects.
        """
        return read_only(self._rows.qpos)

    @property
    def wind(self) -> FloatArray:
        """Wind velocity along x and y in each row, (n, 2) [m/s], in the direction of the air's motion."""
        stacks = self._rows.stacks
        speed: FloatArray = stacks["wind_state"]["speed"]
        velocity: FloatArray = speed * stacks["wind"]["direction"][:, 0]
        angle = stacks["air_state"]["angle"]
        if not angle.shape[1]:
            return velocity
        cos, sin = np.cos(angle[:, 0]), np.sin(angle[:, 0])
        east, north = velocity.T
        return np.stack((cos * east - sin * north, sin * east + cos * north), axis=1)

    def energy(self, boat: str) -> FloatArray:
        """Electric energy that a boat's measured propellers have drawn since each row's reset, (n,) [J].

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the power of none of its propellers is known.
        """
        check_name("boat", boat, self.boats)
        return energy_of(self._arrays, boat, self.boats.index(boat), self._rows.stacks["propeller_state"])

    # Running

    @with_run_lock
    def reset(self, rows: Rows = None, *, seed: Seeds = None) -> None:
        """Reset rows to their start; parameters changed by `vary` are kept.

        Args:
            rows: mask or numbers of the rows; by default all.
            seed: one seed for each of these rows, or a number s for s + i in row i; by default the world's seed.

        Raises:
            CommandError: a row does not exist, or the seeds are not whole numbers, one for each of these rows.
        """
        which, stacks, arrays = which_rows(self.n, rows), self._rows.stacks, self._arrays
        self._seeds[which] = row_seeds(which, self.world.seed if seed is None else seed)
        for name in SEPARATE:
            stacks[name][which] = getattr(arrays, name)
        for row, own in zip(which, self._seeds[which].tolist(), strict=True):
            for (table, column), drawn in arrays.streams(own).items():
                stacks[table][column][row] = drawn
        stacks["wind_state"]["speed"][which, 0] = stacks["wind"]["mean"][which, 0]
        self._variation.draw_phases(which, self._seeds)
        self._rows.reset(which)
        self._observe()

    @with_run_lock
    def command(self, values: npt.ArrayLike, rows: Rows = None) -> None:
        """Set thrusts and steering angles of rows, (rows, channels), in the order of `channels`.

        Units and durations are those of `Simulation.command`: shares of full power, or N in profile vrx3.

        Raises:
            CommandError: the shape is wrong, or a number is not finite.
        """
        self._give(which_rows(self.n, rows), values, hold=0.0)

    def step(self, values: Values = None, *, duration: float, rows: Rows = None) -> None:
        """Advance rows by simulated time [s], a multiple of the timestep, under commands (rows, channels).

        A command holds for the whole duration. Errors are those of `command` and `advance`.
        """
        self._run_lock.check("step")
        steps = whole_steps(duration, self.timestep)
        if values is not None:
            self._give(which_rows(self.n, rows), values, hold=(steps + 0.5) * self.timestep)
        self.advance(steps, rows)

    @advancing
    def advance(self, steps: int, rows: Rows = None) -> None:
        """Advance rows, by default all, by a number of physics steps under their last commands.

        Raises:
            CommandError: `steps` is not a whole number of 0 or more, or a row does not exist.
            DivergedError: the state of some rows is not finite or too large; they stop until they are reset, and the
                others have been advanced.
        """
        left = as_int("number of steps", steps, 0, MOST_STEPS)
        self._going[:] = rows is None
        if rows is not None:
            self._going[which_rows(self.n, rows)] = True
        before = self.diverged
        while True:
            check_exit()
            count = min(left, max(1, int(_CALL_TIME * self.threads / (self._pace * self.n))))
            turns = min(self._pool.turns(self.n, count * self._pace), max(count, 1))
            work = partial(self._advance, steps=count // turns)
            begun = clock.perf_counter()
            with without_timers:
                self._pool.share(self.n, work, count * self._pace / turns, turns)
            count = count // turns * turns
            left -= count
            if count:
                pace = (clock.perf_counter() - begun) * self.threads / (count * max(1, int(self._going.sum())))
                self._pace += 0.2 * (pace - self._pace)
            if left <= 0:
                break
        new = np.flatnonzero(self.diverged & ~before)
        if len(new):
            raise DivergedError(rows_divergence_message(new, float(self._rows.time[new[0]])))

    @with_run_lock
    def set_boat(
        self,
        boat: str,
        *,
        pose: Values = None,
        velocity: Values = None,
        rows: Rows = None,
    ) -> None:
        """Set the pose or the velocity of a boat in some rows; what is not given is kept.

        Args:
            boat: name of the boat.
            pose: x, y, z, roll, pitch, yaw of its `base_link` origin, (rows, 6) or (6,) [m, rad, ENU].
            velocity: u, v, w, p, q, r of that origin, (rows, 6) or (6,) [m/s, rad/s], body axes.
            rows: mask or numbers of the rows; by default all.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the shape is wrong, or a number is not finite or too large.
        """
        check_name("boat", boat, self.boats)
        which, number = which_rows(self.n, rows), self.boats.index(boat)
        self._move(boat, which, pose, velocity, self._arrays.hulls["qpos"].tolist())
        if pose is not None:
            for table, own in self._arrays.state_of_waves(number).items():
                self._rows.stacks[table][which, own] = 0.0
        self._write(which)

    @with_run_lock
    def set_object(
        self,
        name: str,
        *,
        pose: Values = None,
        velocity: Values = None,
        rows: Rows = None,
    ) -> None:
        """Set the pose or the velocity of a floating object, or of the frame of a floating dock, in some rows.

        Arguments but the name are those of `set_boat`. A reset brings it back.

        Raises:
            UnknownNameError: no floating object or dock has that name.
            CommandError: it is fixed, the shape is wrong, a number is not finite or too large, or there are too many
                contacts there.
        """
        self._bodies.check_object(name)
        which = which_rows(self.n, rows)
        self._move(name, which, pose, velocity, [qpos for qpos, _ in self._bodies.address.values()])
        self._rows.start_floating(which, partial(self._bodies.start_floating, name))
        self._write(which)

    @with_run_lock
    def observe_object(self, name: str, rows: Rows = None) -> FloatArray:
        """State of a floating object, or of the frame of a floating dock, in some rows: (rows, 13), as in `features`.

        Raises:
            UnknownNameError: no floating object or dock has that name.
            CommandError: a row does not exist.
        """
        check_name("floating object", name, self._bodies.floating)
        which, item = which_rows(self.n, rows), np.zeros((1, 1), self._arrays.hulls.dtype)
        item["qpos"], item["dof"] = self._bodies.address[name]
        found = np.empty((len(which), 1, FEATURES))
        observe_rows(0, len(which), item, self._rows.qpos[which], self._rows.qvel[which], found)
        return found[:, 0]

    @with_run_lock
    def vary(
        self,
        rows: Rows = None,
        *,
        wind_speed: Values = None,
        wind_direction: Values = None,
        gusts: Values = None,
        waves: Values = None,
        wave_period: Values = None,
        wave_band: Values = None,
        wave_direction: Values = None,
        wave_spread: Values = None,
        wave_phases: Values = None,
        mass: Values = None,
        thrust: Values = None,
        parameters: Mapping[str, npt.ArrayLike] | None = None,
    ) -> None:
        """Change parameters of rows, which must be reset afterwards; each is one number, or one for each of these rows.

        A run that goes on is affected at once by some, such as the mean wind, and by the others from its reset on.

        Args:
            rows: mask or numbers of the rows; by default all.
            wind_speed: mean wind [m/s].
            wind_direction: direction of the air's motion [rad], counter-clockwise from x.
            gusts: standard deviation of the gusts [m/s].
            waves: factor of all waves' amplitudes, 0 for none.
            wave_period: factor of all waves' periods; lengths change with them, heights do not.
            wave_band: factor of the width of the spectrum's band, in logarithms of frequency: 0 for one period.
            wave_direction: direction in which the sea travels [rad], counter-clockwise from x.
            wave_spread: factor of the angles between the waves and that direction: 0 for a long-crested sea.
            wave_phases: phase of each wave at the origin at time 0 [rad], (waves,) or (rows, waves). In these rows
                the waves' energies are not drawn either.
            mass: factor of every boat's mass and inertia; such a row has its own model. Above `largest_masses` a
                boat capsizes or sinks.
            thrust: factor of all thrusters' forces.
            parameters: values of numbers by name, as `vrx_mj.parameters` lists them:
                `{"wamv.hull.drag_linear.surge": [40, 60]}`. Such a row is a run of a world that was compiled with these
                numbers. This takes about a millisecond per row.

        Raises:
            UnknownNameError: no number of the boats or the weather has a name in `parameters`.
            CommandError: the shape is wrong, a number is not finite or out of its range, `parameters` has a number of
                the MJCF or of a battery, the sea does not allow it, as the periods in shallow water and most of a
                Stokes wave, or there is no memory for the models of rows with a mass of their own.
        """
        which = which_rows(self.n, rows)
        given = varied_values(len(which), locals())
        self._variation.change(which, given, wave_phases, {} if parameters is None else parameters)

    @with_run_lock
    def get_state(self, row: int) -> State:
        """Complete state of a row; a `Simulation` of the same world continues from it exactly as the row does.

        A `Simulation` rejects the state of a row that differs from its world because of `vary`.

        Raises:
            CommandError: the row does not exist.
        """
        row = as_int("row", row, 0, self.n - 1)
        stacks, arrays, time = self._rows.stacks, self._arrays, float(self._rows.time[row])
        moving = b"".join(stacks[name][row].tobytes() for name, array in ARRAYS.items() if array.use == STATE)
        ours, flat = moving + arrays.sample_clocks.pack(), self._rows.integration_state(row)
        varied = self._variation.differences(row)
        return State(
            STATE_VERSION, self._world_id, int(self._seeds[row]), time, flat, ours, arrays.moving, varied=varied
        )

    # The water

    @property
    def largest_masses(self) -> FloatArray:
        """Factor of its mass up to which each boat floats at rest in calm water, (boats,); above it, an end sinks."""
        return self._equilibrium.largest_masses()

    @with_run_lock
    def waves(self, row: int) -> Table:
        """Waves of a row's sea, a copy: records of amplitude [m], wavenumber, frequency, direction and phase [rad]."""
        return self._rows.part("waves", as_int("row", row, 0, self.n - 1))

    @with_run_lock
    def sea_height(self, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        """Height [m] of each row's sea at points x, y, (n, points) [m, ENU], at the row's current time.

        Raises:
            CommandError: the points are not numbers, or do not have that shape.
        """
        east, north = (np.ascontiguousarray(as_numbers(name, value)) for name, value in (("x", x), ("y", y)))
        if east.ndim != 2 or east.shape != north.shape or len(east) != self.n:
            text = f"({self.n}, points) of both is needed"
            raise CommandError(f"invalid x and y of shapes {east.shape} and {north.shape}: {text}")
        out, stacks = np.empty(east.shape), self._rows.stacks
        row_heights(stacks["waves"], stacks["own_waves"], stacks["sea"], east, north, self._rows.time, out)
        return out

    @with_run_lock
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
        floating = [
            self._equilibrium.pose(row, number, (x, y, yaw))
            for row, (x, y, yaw) in zip(which.tolist(), spots.tolist(), strict=True)
        ]
        poses, velocities = (np.array([pair[k] for pair in floating]).reshape(-1, 6) for k in range(2))
        return poses, velocities

    # Inside

    def _move(self, name: str, which: IntArray, pose: Values, velocity: Values, near: list[int]) -> None:
        """Give a free body a pose or a velocity in rows, near bodies whose places begin there in `qpos`."""
        places = None if pose is None else row_vectors(f"pose of {name}", pose, len(which))
        moving = None if velocity is None else row_vectors(f"velocity of {name}", velocity, len(which))
        data, (qpos, dof) = self._rows, self._bodies.address[name]
        if places is not None:
            new = data.qpos[which]
            for row, place in zip(new, places.tolist(), strict=True):
                write_pose(row, qpos, place)
            check_room(self._arrays.model, new, np.array(near, np.int64))
            data.qpos[which] = new
        if moving is not None:
            turns = data.qpos[which, qpos + 3 : qpos + 7]
            data.qvel[which, dof : dof + 3] = in_world_axes(turns, moving[:, :3])
            data.qvel[which, dof + 3 : dof + 6] = moving[:, 3:]
            data.qvel[which, self._bodies.rates.get(name, slice(0))] = 0.0

    def _write(self, which: IntArray) -> None:
        """Let rows go on from their `qpos` and `qvel`."""
        write_rows(which, self._rows.runs, self._rows.qpos, self._rows.qvel)
        self._observe()

    def _advance(self, first: int, last: int, steps: int) -> None:
        rows, dt = self._rows, self.timestep
        own = rows.runs, rows.qpos, rows.qvel, rows.time, rows.done, self._going, dt
        self._loop(first, last, *own, steps)
        stopped = self._going[first:last] & (rows.done[first:last] >= 0) & (rows.done[first:last] < steps)
        for row in (first + np.flatnonzero(stopped)).tolist():  # something is near
            rows.give_data(row)
            self._loop(row, row + 1, *own, steps - int(rows.done[row]))
        observe_rows(first, last, rows.stacks["hulls"], rows.qpos, rows.qvel, rows.features)

    def _observe(self) -> None:
        rows = self._rows
        observe_rows(0, self.n, rows.stacks["hulls"], rows.qpos, rows.qvel, rows.features)

    def _give(self, which: IntArray, values: npt.ArrayLike, hold: float) -> None:
        """Command rows; a thrust lasts for its thruster's timeout, and at least `hold` [s]."""
        given = as_numbers("commands", values)
        if given.shape != (len(which), len(self._channels)):
            needed = (len(which), len(self._channels))
            raise CommandError(f"invalid commands of shape {given.shape}: {needed} is needed")
        for row, column in np.argwhere(~np.isfinite(given)):
            self._channels[column].number(float(given[row, column]), f" in row {which[row]}")
        rows = self._rows
        command_rows(which, rows.runs, rows.time, np.ascontiguousarray(given), self._thrusters, self._angles, hold)
