"""A world that runs."""

import dataclasses
import time as clock
import weakref
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from threading import get_ident

import mujoco
import numpy as np

from vrx_mj.arguments import as_seed, check_kind, whole
from vrx_mj.errors import CommandError, DivergedError, StateError
from vrx_mj.libmujoco import untimed
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.bodies import FreeBodies
from vrx_mj.runtime.commands import Commands, Helm
from vrx_mj.runtime.crowding import crowded, fitting, most_contacts
from vrx_mj.runtime.divergence import divergence_message, save_last_good_state
from vrx_mj.runtime.durations import MOST_STEPS, steps_to_second, whole_steps
from vrx_mj.runtime.instruments import Instruments
from vrx_mj.runtime.loop import advance
from vrx_mj.runtime.observation import Observation
from vrx_mj.runtime.physics_models import PhysicsModels
from vrx_mj.runtime.poses import Poses
from vrx_mj.runtime.recorders import Recorders
from vrx_mj.runtime.rig import Rig, drawing_model
from vrx_mj.runtime.sampling import Sampler
from vrx_mj.runtime.sensing import Sensing
from vrx_mj.runtime.signals import Signals
from vrx_mj.runtime.spawning import Spawning, rig_of
from vrx_mj.runtime.state import STATE_VERSION, State
from vrx_mj.runtime.subscriptions import Subscriptions
from vrx_mj.runtime.task_actions import SimulationTaskActions
from vrx_mj.runtime.task_runner import TaskRunner
from vrx_mj.runtime.tasked import Tasked
from vrx_mj.runtime.thrusters import Thruster, thrusters
from vrx_mj.runtime.turns import HOLDER, Turn, in_turn
from vrx_mj.runtime.warmup import announced
from vrx_mj.runtime.weather import Sea, Wind

SLICE = 0.05
"""Wall time [s] of one call of the compiled loop, so that Ctrl-C works."""
DRAIN = 0.5
"""Wall time [s] after which sampled rows go to the recorders."""
LOOP: Callable[..., int] = advance
"""The compiled loop; its many arguments are the rig's."""
SIGNATURE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


class Simulation(Spawning, Instruments, Recorders, Signals, Tasked, Poses):
    """A running world: it takes commands, advances the physics and gives observations.

    The same world, seed and commands give the same motion to the last bit, on the same kind of CPU, with the
    same versions of MuJoCo, numba and vrx_mj.

    Threads that share one take turns: a call waits for the short calls of others. While one thread advances, whatever
    changes the run, `get_state`, `forces` and sensors' readings raise a CommandError in all others; they may command,
    and look at the time, the sea, the wind, the task, and poses by `observe`, which may be of the middle of a step.

    A copy, also one that was pickled, continues as the original does, bit for bit. Recorders, subscriptions, watches
    and changes of `model` are not copied.
    """

    def __init__(self, world: World, *, seed: int | None = None) -> None:
        check_kind("Simulation", world, World, "a World, as compile_world returns it")
        self._first = world
        self._thrusters: dict[str, dict[str, Thruster]] = {}
        self._physics_models, self._turn = PhysicsModels(), Turn("simulation")
        self._take(world, rig_of(world, self._physics_models))
        self._sampler = Sampler(self._rig.columns, self._rig.timestep)
        self._pace, self._drained = 1e-5, 0.0
        self._sea, self._wind = Sea(self._rig), Wind(self._rig)
        own = weakref.proxy(self)  # a run that nobody holds goes at once, with its models and its drawing context
        self._sensing = Sensing(world, self._rig, self._drawing, lambda: own._renew_arguments(), self._turn)  # noqa: PLW0108
        self._subscriptions = Subscriptions(self._rig.sensors, self._sensing.read, self.timestep)
        self._task_runner = TaskRunner(world, self._rig, self._bodies.stand)
        self._task_actions = SimulationTaskActions(self, self._sampler)
        self.reset(seed)
        with announced(advance):
            LOOP(*self._arguments, self.time, self.timestep, 0)

    def __reduce__(self) -> tuple[type["Simulation"], tuple[World], tuple[World, State]]:
        return type(self), (self._first,), (self._world, self.get_state())

    def __setstate__(self, now: tuple[World, State]) -> None:
        if now[0].sha256 != self._first.sha256:
            self._bind(now[0], rig_of(now[0], self._physics_models))
        self.set_state(now[1])

    @classmethod
    def load(cls, source: str | Path) -> "Simulation":
        """Simulation of a world that `World.save` or `vrx-mj compile` wrote; StateError if `path` holds none."""
        return cls(World.load(source))

    # What it is

    @property
    def world(self) -> World:
        """The compiled world of this simulation."""
        return self._world

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's model of the physics, without visual geoms; changes act from the next `reset` or `set_state`."""
        return self._model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's state; the forces of water, wind and thrusters are written to `xfrc_applied` at every step."""
        return self._data

    @property
    def visual_model(self) -> mujoco.MjModel:
        """MuJoCo's model of the same world with visual geoms; its `qpos` has the same layout."""
        return self._drawing()

    @property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats."""
        return self._world.boats

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._data.time)

    @property
    def timestep(self) -> float:
        """Physics step [s]."""
        return self._rig.timestep

    @property
    def seed(self) -> int:
        """Seed of the current run."""
        return self._seed

    @property
    def sea(self) -> Sea:
        """Surface of the sea, as in `sim.sea.height(x, y, t)` [m]."""
        return self._sea

    @property
    def wind(self) -> Wind:
        """Wind, as in `sim.wind.velocity(t)` [m/s]."""
        return self._wind

    def command_names(self, boat: str) -> tuple[str, ...]:
        """Names of a boat's commands, its thrusters and their `_angle`; UnknownNameError if no boat has that name."""
        return self._helm.names(boat)

    # Running

    @in_turn
    def reset(self, seed: int | None = None) -> Observation:
        """Restart the run with the world's seed or the given one, and return the first observation.

        The boats are those of the world that was given to the simulation: spawning and removing is undone.

        Raises:
            CommandError: the seed is not a whole number from 0 to 2^63 - 1, or the run is being recorded.
        """
        self._subscriptions.check_idle("reset")
        self._sampler.check_free("reset")
        self._seed = self._first.seed if seed is None else as_seed(seed)
        if self._world is not self._first:
            self._thrusters = {}  # a boat that was spawned may have had the name of another
            self._bind(self._first, rig_of(self._first, self._physics_models))
        mujoco.mj_resetData(self._model, self._data)
        self._rig.reset(self._seed)
        self._wind.forget()
        self._task_runner.reset()
        self._settle()
        return self.observe()

    def command(self, boat: str, *given: object, **commands: float) -> None:
        """Command a boat's thrusters as VRX's topics do: a thrust lasts for the thruster's timeout.

        Thrusts are shares of full power: beyond +-1 the force is that of VRX's mapping, capped. In worlds of profile
        `vrx3` they are forces [N], clamped to the thruster's limits, and last until the next. Angles are in rad,
        clamped to the thruster's limit, and do not time out. Errors are those of `command_all`, and a CommandError if
        a command is `given` without its name.
        """
        check_kind("command", boat, str, "the name of a boat first")
        if given:
            self._helm.refuse(boat, given)
        self.command_all({boat: commands})

    def command_all(self, commands: Commands) -> None:
        """Command several boats, as `command` does for one.

        Raises:
            UnknownNameError: a boat or thruster does not exist.
            CommandError: a command is not a finite number.
        """
        with self._turn.crew:
            self._helm.give(self._rig, commands, self.time, hold=0.0)

    def step(self, commands: Commands | None = None, *, duration: float | None = None) -> Observation:
        """Advance by `duration` [s] of simulated time, one physics step by default, under the given commands.

        A command holds for the whole duration.

        Raises:
            UnknownNameError: a boat or thruster does not exist.
            CommandError: a command is not a finite number, or the duration is not a multiple of the timestep.
            DivergedError: the state became NaN or too large; the message names a file with an earlier state.
        """
        steps = 1 if duration is None else self.steps_in(duration)
        given = {} if commands is None else commands
        if self._turn.claim or self._subscriptions.busy:
            self._check_standing("step")
        with self._turn.crew:
            self._helm.give(self._rig, given, self.time, hold=(steps + 0.5) * self.timestep)
        self.advance(steps)
        return self.observe()

    def steps_in(self, duration: float) -> int:
        """Number of physics steps in a duration [s]; CommandError if the duration is not a multiple of the timestep."""
        return whole_steps(duration, self.timestep)

    def advance(self, steps: int) -> None:
        """Advance by a number of physics steps under the last commands.

        Raises:
            CommandError: `steps` is not a whole number of 0 or more.
            DivergedError: the state became NaN or too large; the message names a file with an earlier state.
        """
        claim, thread = self._turn.claim, get_ident()
        try:
            if claim.setdefault(HOLDER, thread) is not thread or self._subscriptions.busy:
                self._wait(thread)
            self._advance(whole("number of steps", steps, 0, MOST_STEPS))
        finally:  # with no call, in which Ctrl-C could come first
            if claim and claim[HOLDER] is thread:
                del claim[HOLDER]

    def _wait(self, thread: int) -> None:
        """Refuse to advance in the midst of another call, or wait for the short one of another thread."""
        self._turn.check("advance")
        self._subscriptions.check_idle("advance")
        self._turn.take("advance", thread)

    def _advance(self, left: int) -> None:
        self._task_runner.look(self.time, self._task_actions)
        self._subscriptions.deliver(self.time)
        while left > 0:
            second = steps_to_second(self.time, self.timestep)
            heard = min(self._subscriptions.steps(self.time), self._task_runner.steps(self.time))
            count = min(left, second, max(1, int(SLICE / self._pace)), heard)
            begun = clock.perf_counter()
            with untimed():
                done = int(LOOP(*self._arguments, self.time, self.timestep, count))
            if done < 0:
                self._diverged()
            if self._data.ncon > self._most_contacts:
                raise DivergedError(f"{crowded(self._data.ncon)} (t = {self.time:g} s)")
            if done:
                self._pace += 0.2 * ((clock.perf_counter() - begun) / done - self._pace)
            left -= done
            if done < count or begun - self._drained > DRAIN:
                self._sampler.drain()
                self._drained = begun
            self._task_runner.look(self.time, self._task_actions)
            if done == second:
                self._keep()
            self._subscriptions.deliver(self.time)

    # State

    def observe(self) -> Observation:
        """Observation of every boat by name, and of the task as `obs["task"]` if the world has one."""
        with self._turn.crew:
            boats = (
                (boat, self._bodies.observe(boat, sensors=self.sense(boat), thrusters=self._thrusters[boat]))
                for boat in self.boats
            )
            return Observation(boats, self.task)

    @in_turn
    def get_state(self) -> State:
        """Complete state of the run; a run continued from it equals the uninterrupted one bit for bit."""
        return dataclasses.replace(self._moment(), world=self._world.sha256)

    def _moment(self) -> State:
        """The state without its world's fingerprint, which takes 50 ms once for every world."""
        size = mujoco.mj_stateSize(self._model, SIGNATURE)
        flat = np.empty(size)
        mujoco.mj_getState(self._model, self._data, flat, SIGNATURE)
        ours, moving, task = self._rig.pack(), self._rig.moving, self._task_runner.dump()
        return State(STATE_VERSION, "", self._seed, self.time, flat, ours, moving, task)

    @in_turn
    def set_state(self, state: State) -> Observation:
        """Set the state to one that `get_state` returned, here or in another process.

        Raises:
            StateError: it is not a State, is not finite, or belongs to another version, to another world, or to this
                world with other boats.
            CommandError: the run is being recorded, or its bodies overlap in more contacts than MuJoCo has memory for.
        """
        check_kind("set_state", state, State, "a State, as get_state() or State.load(path) returns it", StateError)
        self._subscriptions.check_idle("set_state")
        self._sampler.check_free("set_state")
        if state.world == self._first.sha256 != self._world.sha256:
            boats = ", ".join(self._first.boats)
            raise StateError(
                f"the state at t = {state.time:g} s has other boats than the simulation: call reset(), which restores "
                f"{boats}, then set_state"
            )
        state.check(self._world.sha256)
        self._rig.check(state.mujoco, state.ours)
        self._task_runner.check(state.task)
        with self._unless_crowded():
            self._restore(state)
        return self.observe()

    def _restore(self, state: State) -> None:
        """Go to a state that was checked."""
        mujoco.mj_resetData(self._model, self._data)  # parked balls sleep again
        mujoco.mj_setState(self._model, self._data, state.mujoco, SIGNATURE)
        self._rig.unpack(state.ours)
        self._task_runner.load(state.task)
        self._seed = state.seed
        self._rig.key(state.seed)
        self._wind.forget()
        self._settle()

    # Inside

    def _take(self, world: World, rig: Rig) -> None:
        """Make a world and its rig the present ones."""
        self._world, self._rig = world, rig
        self._model, self._data = rig.model, rig.data
        self._most_contacts = most_contacts(rig.model)
        self._helm = Helm(world.boats, world.parameters["thrusters"])
        known, fleet = self._thrusters, self._helm.thrusters
        self._thrusters = {boat: known.get(boat) or thrusters(rig, rows) for boat, rows in fleet.items()}
        self._bodies = FreeBodies(world, rig)
        self._drawing = cache(partial(drawing_model, world))

    def _bind(self, world: World, rig: Rig) -> None:
        """Go over to a world that has other boats, with everything that users may hold."""
        with self._turn.crew:
            self._take(world, rig)
            self._sea.bind(rig)
            self._wind.bind(rig)
            self._sensing.bind(world, rig, self._drawing)
            self._subscriptions.bind(rig.sensors)
            self._task_runner.bind(world, rig, self._bodies.stand)
            self._sampler.resize(rig.columns)

    def _inhabit(self, world: World, rig: Rig, line: str) -> None:
        """Go on in a world that has other boats, from the moment that its rig is at."""
        self._bind(world, rig)
        self._renew_arguments()
        for listener in self._sampler.listeners:
            listener.boats_changed()
        self.event(line)
        self._keep()

    def _settle(self) -> None:
        """Begin anew from a state that was set."""
        self._rig.refresh()
        self._sensing.begin(self._seed)
        self._subscriptions.begin(self.time)
        self._renew_arguments()
        self._derive()
        self._keep()

    def _derive(self) -> None:
        """Make what follows from the state, and what sensors see of it, follow a state that was set."""
        with fitting(self._data):
            mujoco.mj_forward(self._model, self._data)
        if self._data.ncon > self._most_contacts:
            raise CommandError(crowded(self._data.ncon))
        self._sensing.renew()

    def _renew_arguments(self) -> None:
        self._arguments = self._rig.arguments(self._sampler.table, self._sampler.buffer)

    def _keep(self) -> None:
        self._last_good = self._moment()
        if self._sampler.listeners:
            blob = self.get_state().to_bytes()
            for listener in self._sampler.listeners:
                listener.state(self.time, blob)

    def _diverged(self) -> None:
        self._sampler.drain()
        good = dataclasses.replace(self._last_good, world=self._world.sha256)
        kept = save_last_good_state(good)
        message = divergence_message(self._bodies.broken(), self.time, self.timestep, good, kept)
        self.event(message, "ERROR")
        raise DivergedError(message)
