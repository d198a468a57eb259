"""Many worlds at once: rows of one model, each with a seed, a state and, if wanted, a wind, sea and boat of its own."""

import time as clock
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_number, check_kind, check_name, whole
from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import CommandError, DivergedError, shown
from vrx_mj.exits import check_exit, delays_exit
from vrx_mj.frames import in_world_axes
from vrx_mj.libmujoco import without_timers
from vrx_mj.mjcf.world import World
from vrx_mj.physics.noise import stream_key
from vrx_mj.runtime.bodies import write_pose
from vrx_mj.runtime.crowding import check_room
from vrx_mj.runtime.hull import energy_of
from vrx_mj.runtime.limits import ThreadPool, thread_count
from vrx_mj.runtime.loop_arrays import LoopArrays, air_key, gust_phases
from vrx_mj.runtime.physics_models import stepping_models
from vrx_mj.runtime.row_arguments import Rows, as_numbers, row_seeds, row_vectors, varied, which_rows
from vrx_mj.runtime.row_tables import SEPARATE, RowTables, allocating, check_memory
from vrx_mj.runtime.rows import advance_rows, advance_rows_vrx, observe_rows, reset_rows, write_rows
from vrx_mj.runtime.state import STATE_VERSION, State, rows_divergence_message
from vrx_mj.runtime.timing import MOST_STEPS, whole_steps
from vrx_mj.runtime.turns import Turn, advancing, in_turn
from vrx_mj.runtime.views import ARRAYS, STATE
from vrx_mj.runtime.warmup import announced

_SLICE = 0.05
"""Wall time of a call into the loop, about [s]: Ctrl-C acts between two."""
_LOWEST = {"wind_direction": -np.inf, "wind_speed": -np.inf, "mass": np.nextafter(0.0, 1.0)}
"""What is varied, at least, where that is not 0."""
_MOST = 10**6
"""Rows, or threads, of a batch."""


class Batch(RowTables):
    """`n` independent copies (rows) of one world, advanced in parallel on all cores.

    Row i moves exactly as a `Simulation` of the same world and seed, whatever the number of rows and threads. A batch
    has no tasks, sensors or recordings; a `Simulation` has them, and can continue from the state that `get_state(row)`
    returns. A row with parameters that `vary` has changed belongs to a different world.

    Threads that share a batch take turns; while one advances, the methods of all others raise a CommandError.

    A copy, also one that was pickled, continues as the original does, bit for bit.
    """

    @delays_exit()
    def __init__(self, world: World, n: int, *, seed: int | Sequence[int] | None = None, threads: int | None = None):
        """Create the rows of a world.

        Args:
            world: the world of every row; it must have no task (`compile_world({"extends": name, "task": None})`).
            n: number of rows.
            seed: seed of the rows, as in `reset`.
            threads: number of threads; by default OMP_NUM_THREADS, SLURM_CPUS_PER_TASK or the number of cores.

        Raises:
            CommandError: `world` is not a World or has a task, `n` or `threads` is below 1, or there is no memory for
                so many rows.
        """
        check_kind("Batch", world, World, "a World, as compile_world returns it")
        counts: dict[str, Any] = {"n": n, "threads": 1 if threads is None else threads}
        for name, count in counts.items():
            value = as_number(count)
            if not isinstance(count, Real) or not value >= 1 or value % 1 != 0:
                raise CommandError(f"invalid {name} {shown(count)}: a whole number above 0 is needed")
            if value > _MOST:
                raise CommandError(f"invalid {name} {shown(count)}: at most {_MOST} are possible")
        if world.parameters.task:
            text = 'compile it without one, {"extends": name, "task": None}'
            raise CommandError(f"the world {world.name} has a task, and a Batch has no referee: {text}")
        self.world, self.n = world, int(n)
        self._world_id = world.sha256
        self._model, contact_free = stepping_models(world)
        self._arrays = LoopArrays(world, self._model, contact_free, mujoco.MjData(self._model))
        self._arrays.reset(0)
        self._pool = ThreadPool(int(threads or thread_count()))
        self._own_models: dict[int, tuple[mujoco.MjModel, mujoco.MjModel]] = {}
        self._masses = np.ones(self.n)
        check_memory(self.n, self._arrays.data)
        with allocating(self.n, self._arrays.data):
            self._build()
        self._pace, self._turn = 1e-5, Turn("batch")
        self._loop = advance_rows_vrx if self._arrays.vrx_only else advance_rows
        with announced(self._loop):
            self.reset(seed=seed)
            self.advance(0)

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
        """Seed of the present run of each row, (n,)."""
        return self._seeds.copy()

    @property
    def channels(self) -> tuple[tuple[str, str], ...]:
        """Boat and name of every command, in the order that `command` takes: thrusts, then steering angles."""
        return tuple((channel.boat, channel.name) for channel in self._channels)

    @property
    def largest(self) -> FloatArray:
        """Least and greatest effective value of every command, (channels, 2): share of full power, N, or angle [rad].

        Values outside are clamped.
        """
        return np.array([channel.limits for channel in self._channels]).reshape(-1, 2)

    @property
    def time(self) -> FloatArray:
        """Simulated time of each row, (n,) [s]."""
        return self._time.copy()

    @property
    def diverged(self) -> BoolArray:
        """Whether the state of each row is not finite or too large, (n,); such a row stops until it is reset."""
        return self._done < 0

    @property
    def features(self) -> FloatArray:
        """State of every boat, (n, boats, 13), as a view whose content changes with the next call.

        The columns are position (3) [m, ENU] and quaternion (4) (w, x, y, z) of the boat's `base_link` origin, its
        velocity (3) [m/s] and angular velocity (3) [rad/s] in body axes.
        """
        return self._features

    @property
    def qpos(self) -> FloatArray:
        """Generalized positions of MuJoCo's model in every row, (n, nq), as a view."""
        return self._qpos

    @property
    def wind(self) -> FloatArray:
        """Wind velocity along x and y in each row, (n, 2) [m/s], in the direction of the air's motion."""
        speed: FloatArray = self._stacks["wind_state"]["speed"]
        velocity: FloatArray = speed * self._stacks["wind"]["direction"][:, 0]
        angle = self._stacks["air_state"]["angle"]
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
        return energy_of(self._arrays, boat, self.boats.index(boat), self._stacks["propeller_state"])

    # Running

    @in_turn
    def reset(self, rows: Rows = None, *, seed: int | Sequence[int] | IntArray | None = None) -> None:
        """Reset rows to their start; parameters changed by `vary` are kept.

        Args:
            rows: mask or numbers of the rows; by default all.
            seed: one seed for each of these rows, or a number s for s + i in row i; by default the world's seed.

        Raises:
            CommandError: a row does not exist, or the seeds are not whole numbers, one for each of these rows.
        """
        which = which_rows(self.n, rows)
        self._seeds[which] = row_seeds(which, self.world.seed if seed is None else seed)
        for name in SEPARATE:
            self._stacks[name][which] = getattr(self._arrays, name)
        wind, wind_seed = self._stacks["wind"], str(self._arrays.wind_seed)
        wind["key"][which, 0] = [stream_key(int(s), "wind", wind_seed) for s in self._seeds[which]]
        current, own_seed = self._stacks["current"], str(self._arrays.current_seed)
        current["key"][which] = [[stream_key(int(s), "current", own_seed)] for s in self._seeds[which]]
        for row in which if len(self._arrays.air) else ():
            run = int(self._seeds[row]), self._arrays.wind_seed
            self._stacks["air"]["key"][row] = air_key(*run)
            self._stacks["gust_bands"]["phase"][row] = gust_phases(*run, len(self._arrays.gust_bands))
        self._stacks["wind_state"]["speed"][which, 0] = wind["mean"][which, 0]
        if self._seas.drawn.any():
            self._separate("waves")[which] = self._seas.draw(which, self._seeds)
        self._time[which], self._done[which] = 0.0, 0
        reset_rows(which, self._runs, self._qpos, self._qvel)
        self._observe()

    @in_turn
    def command(self, values: npt.ArrayLike, rows: Rows = None) -> None:
        """Set thrusts and steering angles of rows, (rows, channels), in the order of `channels`.

        Units and durations are those of `Simulation.command`: shares of full power, or N in profile vrx3.

        Raises:
            CommandError: the shape is wrong, or a number is not finite.
        """
        self._give(which_rows(self.n, rows), values, hold=0.0)

    def step(self, values: npt.ArrayLike | None = None, *, duration: float, rows: Rows = None) -> None:
        """Advance rows by simulated time [s], a multiple of the timestep, under commands (rows, channels).

        A command holds for the whole duration. Errors are those of `command` and `advance`.
        """
        self._turn.check("step")
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
        left = whole("number of steps", steps, 0, MOST_STEPS)
        self._going[:] = rows is None
        if rows is not None:
            self._going[which_rows(self.n, rows)] = True
        before = self.diverged
        while True:
            check_exit()
            count = min(left, max(1, int(_SLICE * self.threads / (self._pace * self.n))))
            begun = clock.perf_counter()
            with without_timers():
                self._pool.share(self.n, lambda first, last, count=count: self._advance(first, last, count))  # type: ignore[misc]
            left -= count
            if count:
                pace = (clock.perf_counter() - begun) * self.threads / (count * max(1, int(self._going.sum())))
                self._pace += 0.2 * (pace - self._pace)
            if left <= 0:
                break
        new = np.flatnonzero(self.diverged & ~before)
        if len(new):
            raise DivergedError(rows_divergence_message(new, float(self._time[new[0]])))

    @in_turn
    def set_boat(
        self,
        boat: str,
        *,
        pose: npt.ArrayLike | None = None,
        velocity: npt.ArrayLike | None = None,
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
        which = which_rows(self.n, rows)
        before = self._qpos[which].copy()
        hull = self._arrays.hulls[self.boats.index(boat)]
        qpos, dof = int(hull["qpos"]), int(hull["dof"])
        if pose is not None:
            for row, place in zip(which, row_vectors(f"pose of {boat}", pose, len(which)), strict=True):
                write_pose(self._qpos[row], qpos, place.tolist())
        if velocity is not None:
            moving = row_vectors(f"velocity of {boat}", velocity, len(which))
            turns = self._qpos[which, qpos + 3 : qpos + 7]
            self._qvel[which, dof : dof + 3] = in_world_axes(turns, moving[:, :3])
            self._qvel[which, dof + 3 : dof + 6] = moving[:, 3:]
        if pose is not None:
            try:
                check_room(self._model, self._qpos[which], self._arrays.hulls["qpos"].astype(np.int64))
            except CommandError:
                self._qpos[which] = before
                raise
            for row in which:
                self._stacks["memory_state"][row][self._arrays.memory_rows(self.boats.index(boat))] = 0.0
        write_rows(which, self._runs, self._qpos, self._qvel)
        self._observe()

    @in_turn
    def vary(
        self,
        rows: Rows = None,
        *,
        wind_speed: npt.ArrayLike | None = None,
        wind_direction: npt.ArrayLike | None = None,
        gusts: npt.ArrayLike | None = None,
        waves: npt.ArrayLike | None = None,
        wave_period: npt.ArrayLike | None = None,
        wave_band: npt.ArrayLike | None = None,
        wave_direction: npt.ArrayLike | None = None,
        wave_spread: npt.ArrayLike | None = None,
        wave_phases: npt.ArrayLike | None = None,
        mass: npt.ArrayLike | None = None,
        thrust: npt.ArrayLike | None = None,
        parameters: Mapping[str, npt.ArrayLike] | None = None,
    ) -> None:
        """Change parameters of rows from their next reset on; each is one number, or one for each of these rows.

        Args:
            rows: mask or numbers of the rows; by default all.
            wind_speed: mean wind [m/s].
            wind_direction: direction of the air's motion [rad], counter-clockwise from x.
            gusts: standard deviation of the gusts [m/s].
            waves: factor of all waves' amplitudes, 0 for none.
            wave_period: factor of all waves' periods; lengths follow, heights stay.
            wave_band: factor of the width of the spectrum's band, in logarithms of frequency: 0 for one period.
            wave_direction: direction in which the sea travels [rad], counter-clockwise from x.
            wave_spread: factor of the angles between the waves and that direction: 0 for a long-crested sea.
            wave_phases: phase of each wave at the origin at time 0 [rad], (waves,) or (rows, waves).
            mass: factor of every boat's mass and inertia; such a row has its own model. Above `largest_masses` a
                boat capsizes or sinks.
            thrust: factor of all thrusters' forces.
            parameters: values of numbers of hulls, stations, current, moorings and ropes by name, as
                `vrx_mj.parameters` lists them: `{"wamv.hull.drag_linear.surge": [40, 60]}`.

        Raises:
            UnknownNameError: no number that rows can have of their own has a name in `parameters`.
            CommandError: the shape is wrong, a number is not finite, or negative (or 0 for `mass` or `wave_period`), or
                there is no memory for the models of rows with a mass of their own.
        """
        which = which_rows(self.n, rows)
        given = varied(
            len(which), wind_speed=wind_speed, gusts=gusts, wind_direction=wind_direction, waves=waves,
            wave_period=wave_period, wave_band=wave_band, wave_direction=wave_direction, wave_spread=wave_spread,
            mass=mass, thrust=thrust,
        )  # fmt: skip
        self._vary_numbers(which, {} if parameters is None else parameters)
        self._warn_of_no_effect(given)
        for name, values in given.items():
            self._varied[name][which] = values
        if wave_phases is not None or any(name.startswith("wave") for name in given):
            own = self._seas.change(which, given, wave_phases)
            self._varied["wave_phases"][which] = np.abs(own["phase"]).max(axis=1, initial=0.0)
            self._separate("waves")[which] = own
        self._vary_wind(which, given)
        if "thrust" in given:
            self._separate("thrusters")["gain"][which] = given["thrust"][:, None]
        if "mass" in given:
            self._weigh(which, given["mass"])

    @in_turn
    def get_state(self, row: int) -> State:
        """Complete state of a row; a `Simulation` of the same world continues from it exactly as the row does.

        No `Simulation` takes the state of a row that differs from its world because of `vary`.

        Raises:
            CommandError: the row does not exist.
        """
        row = whole("row", row, 0, self.n - 1)
        moving = b"".join(self._stacks[name][row].tobytes() for name, array in ARRAYS.items() if array.use == STATE)
        ours, seed = moving + self._arrays.sample_clocks.pack(), int(self._seeds[row])
        return State(
            STATE_VERSION, self._world_id, seed, float(self._time[row]), self._flat(row), ours, self._arrays.moving,
            varied=self._differences(row),
        )  # fmt: skip

    # Inside

    def _advance(self, first: int, last: int, steps: int) -> None:
        self._loop(
            first, last, self._runs, self._qpos, self._qvel, self._time, self._done, self._going, self.timestep, steps
        )
        observe_rows(first, last, self._stacks["hulls"], self._qpos, self._qvel, self._features)

    def _observe(self) -> None:
        observe_rows(0, self.n, self._stacks["hulls"], self._qpos, self._qvel, self._features)

    def _give(self, which: IntArray, values: npt.ArrayLike, hold: float) -> None:
        """Command rows; a thrust lasts for its thruster's timeout, and at least `hold` [s]."""
        given = as_numbers("commands", values)
        if given.shape != (len(which), len(self._channels)):
            needed = (len(which), len(self._channels))
            raise CommandError(f"invalid commands of shape {given.shape}: {needed} is needed")
        for row, column in np.argwhere(~np.isfinite(given)):
            self._channels[column].checked(float(given[row, column]), f" in row {which[row]}")
        state = self._stacks["thruster_state"]
        for number, channel in enumerate(self._channels):
            channel.write(state, (which, channel.row), given[:, number], self._time[which], hold)
