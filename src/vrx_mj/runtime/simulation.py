"""A world that runs."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from threading import get_ident

import mujoco
import numpy as np

from vrx_mj.arguments import Names, as_flag, as_int, as_number, as_seed, as_text, check_kind, check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError, StateError, quote
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.commands import Commands
from vrx_mj.runtime.forces import Forces, boat_forces
from vrx_mj.runtime.hull import energy_of
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.runtime.observation import BoatObservation, Observation
from vrx_mj.runtime.rows import FEATURES, observe_rows
from vrx_mj.runtime.run_lock import HOLDER, with_run_lock
from vrx_mj.runtime.running_world import RunningWorld, loop_arrays_of
from vrx_mj.runtime.sensing import Readings, fire
from vrx_mj.runtime.spawning import Roster, Spawning
from vrx_mj.runtime.state import State
from vrx_mj.runtime.subscriptions import ContactWatch, Listener, Subscription, Touch, check_listener
from vrx_mj.runtime.task_runner import Event, TaskObservation
from vrx_mj.runtime.timing import MOST_STEPS, whole_steps
from vrx_mj.runtime.weather import Sea, Wind
from vrx_mj.sensors.readings import Reading
from vrx_mj.signals import delays_exit


class Simulation(Roster):
    """A running world: it takes commands, advances the physics and gives observations.

    The same world, seed and commands give the same motion bit for bit, on the same kind of CPU and with the
    same versions of MuJoCo, numba and vrx_mj.

    Threads that share one take turns: a call waits for the short calls of others. While one thread advances, calls
    that change the run, `get_state`, `forces` and sensors' readings raise a CommandError in all others. These may send
    commands and read the time, the sea, the wind, the task, and poses by `observe`, possibly in the middle of a step.

    A copy, including a pickled one, continues like the original, bit for bit. Recorders, subscriptions, watches
    and changes of `model` are not copied.
    """

    @delays_exit()
    def __init__(self, world: World, *, seed: int | None = None) -> None:
        check_kind("Simulation", world, World, "a World, as compile_world returns it")
        live = self._live = RunningWorld(world)
        self._spawning = Spawning(live)
        self._run_lock, self._sensing, self._subscriptions = live.run_lock, live.sensing, live.subscriptions
        self._sampler, self._task_runner, self._displays = live.sampler, live.task_runner, live.displays
        self.reset(seed)
        live.compile()

    def __reduce__(self) -> tuple[type["Simulation"], tuple[World], tuple[World, State]]:
        return type(self), (self._live.first,), (self.world, self.get_state())

    @delays_exit()
    def __setstate__(self, now: tuple[World, State]) -> None:
        if now[0].sha256 != self._live.first.sha256:
            self._live.bind(now[0], loop_arrays_of(now[0], self._live.physics_models))
        self.set_state(now[1])

    @classmethod
    def load(cls, source: str | Path) -> "Simulation":
        """Simulation of a world that `World.save` or `vrx-mj compile` wrote; StateError if `path` holds none."""
        return cls(World.load(source))

    # What it is

    @property
    def world(self) -> World:
        """The compiled world of this simulation."""
        return self._live.world

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's model of the physics, without visual geoms; changes act from the next `reset` or `set_state`."""
        return self._live.arrays.model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's state; the forces of water, wind and thrusters are written to `xfrc_applied` at every step."""
        return self._live.arrays.data

    @property
    def visual_model(self) -> mujoco.MjModel:
        """MuJoCo's model of the same world with visual geoms; its `qpos` has the same layout."""
        return self._live.drawing()

    @property
    def boats(self) -> Names:
        """Names of the boats."""
        return self._live.world.boats

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._live.time

    @property
    def timestep(self) -> float:
        """Physics step [s]."""
        return self._live.arrays.timestep

    @property
    def seed(self) -> int:
        """Seed of the current run."""
        return self._live.seed

    @property
    def sea(self) -> Sea:
        """Surface of the sea, as in `sim.sea.height(x, y, t)` [m]."""
        return self._live.sea

    @property
    def wind(self) -> Wind:
        """Wind, as in `sim.wind.velocity(t)` [m/s]."""
        return self._live.wind

    def command_names(self, boat: str) -> Names:
        """Names of a boat's commands, its thrusters and their `_angle`; UnknownNameError if no boat has that name."""
        return self._live.commands.names(boat)

    # Running

    @with_run_lock
    def reset(self, seed: int | None = None, *, parameters: Mapping[str, float] | None = None) -> Observation:
        """Restart the run with the world's seed or the given one, and return the first observation.

        Boats, objects and docks are those of the original world of the simulation: spawning and removing are
        undone.

        Args:
            seed: seed of everything random; None: that of the world.
            parameters: values of numbers of the world in this run by name, as `vrx_mj.parameters` lists them. Those of
                batteries, and those that the MJCF contains too, such as masses, cannot be changed. None: those of the
                world.

        Raises:
            CommandError: the seed is not a whole number from 0 to 2^63 - 1, a value of `parameters` is not a number in
                its range or cannot be changed, or the run is being recorded.
            UnknownNameError: the world has no such number.
        """
        numbers = {} if parameters is None else parameters
        check_kind("parameters", numbers, Mapping, "a mapping of numbers, as {'wind.mean': 5.0}")
        self._subscriptions.check_idle("reset")
        self._sampler.check_free("reset")
        self._live.restart(self._live.first.seed if seed is None else as_seed(seed), numbers)
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
            self._live.commands.refuse(boat, given)
        self.command_all({boat: commands})

    def command_all(self, commands: Commands) -> None:
        """Command several boats, as `command` does for one.

        Raises:
            UnknownNameError: a boat or thruster does not exist.
            CommandError: a command is not a finite number.
        """
        with self._run_lock.boats_lock:
            self._live.commands.give(self._live.arrays, commands, self.time, hold=0.0)

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
        if self._run_lock.claim or self._subscriptions.busy:
            self._live.check_idle("step")
        with self._run_lock.boats_lock:
            self._live.commands.give(self._live.arrays, given, self.time, hold=(steps + 0.5) * self.timestep)
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
        claim, thread = self._run_lock.claim, get_ident()
        try:
            if claim.setdefault(HOLDER, thread) is not thread or self._subscriptions.busy:
                self._wait(thread)
            self._live.advance(as_int("number of steps", steps, 0, MOST_STEPS))
        finally:  # with no call, in which Ctrl-C could come first
            if claim and claim[HOLDER] is thread:
                del claim[HOLDER]

    def _wait(self, thread: int) -> None:
        """Refuse to advance in the midst of another call, or wait for the short one of another thread."""
        self._run_lock.check("advance")
        self._subscriptions.check_idle("advance")
        self._run_lock.take("advance", thread)

    # State

    def observe(self) -> Observation:
        """Observation of every boat by name, and of the task as `obs["task"]` if the world has one."""
        live = self._live
        with self._run_lock.boats_lock:
            boats = (
                (boat, live.bodies.observe(boat, sensors=self.sense(boat), thrusters=live.thrusters[boat]))
                for boat in live.world.boats
            )
            return Observation(boats, self.task)

    @property
    def features(self) -> FloatArray:
        """State of every boat, (boats, 13), a copy; the columns are those of `Batch.features`."""
        arrays = self._live.arrays
        out: FloatArray = np.empty((1, len(arrays.hulls), FEATURES))
        observe_rows(0, 1, arrays.hulls[None], arrays.data.qpos[None], arrays.data.qvel[None], out)
        return out.reshape(out.shape[1:])

    @property
    @with_run_lock
    def state_sha256(self) -> str:
        """SHA-256 of everything that moves, equal to `get_state().sha256`."""
        return self._live.moment().sha256

    @with_run_lock
    def get_state(self) -> State:
        """Complete state of the run; a run continued from it equals the uninterrupted one bit for bit."""
        return dataclasses.replace(self._live.moment(), world=self.world.sha256)

    @with_run_lock
    def set_state(self, state: State) -> Observation:
        """Set the state to one that `get_state` returned, here or in another process.

        Raises:
            StateError: it is not a State, is not finite, or belongs to another version, to another world, or to this
                world with other boats, objects or docks.
            CommandError: the run is being recorded, or its bodies overlap in more contacts than MuJoCo has memory for.
        """
        check_kind("set_state", state, State, "a State, as get_state() or State.load(path) returns it", StateError)
        self._subscriptions.check_idle("set_state")
        self._sampler.check_free("set_state")
        self._live.check(state)
        with self._live.undone_if_crowded():
            self._live.restore(state)
        return self.observe()

    # Poses and forces

    @with_run_lock
    def set_boat(
        self, name: str, *, pose: Sequence[float] | None = None, velocity: Sequence[float] | None = None
    ) -> None:
        """Set the pose or the velocity of a boat; what is not given is kept.

        Args:
            name: name of the boat.
            pose: (x, y, z, roll, pitch, yaw) of its `base_link` origin [m, rad, ENU].
            velocity: (u, v, w, p, q, r) of that origin [m/s, rad/s], body axes.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the pose or the velocity is not six finite numbers, or there are too many contacts there.
        """
        self._live.set_boat(name, pose, velocity)

    @with_run_lock
    def release(self, boat: str) -> None:
        """Release a boat that its task holds, as `set_boat` with a pose does; a free boat is not changed."""
        check_name("boat", boat, self.boats)
        self._live.arrays.release(boat)

    @with_run_lock
    def set_object(
        self, name: str, *, pose: Sequence[float] | None = None, velocity: Sequence[float] | None = None
    ) -> None:
        """Set the pose or the velocity of a floating object or of the frame of a floating dock, as `set_boat` does.

        Raises:
            UnknownNameError: no floating object or dock has that name.
            CommandError: it is fixed, the pose or the velocity is not six finite numbers, or there are too many
                contacts there.
        """
        self._live.set_object(name, pose, velocity)

    def observe_object(self, name: str) -> BoatObservation:
        """Pose and velocity of a floating object's link, or of the frame of a floating dock's drawing.

        UnknownNameError if no floating object or dock has that name.
        """
        with self._run_lock.boats_lock:
            check_name("floating object", name, self._live.bodies.floating)
            return self._live.bodies.observe(name)

    @with_run_lock
    def forces(self, boat: str) -> Forces:
        """Forces on a boat in the next step, by name of the effect: force and torque, (6,).

        Forces [N] and torques [N m] are in world axes, about the boat's centre of mass, `.center`. `.total` is their
        sum, all that acts from outside; `hydrostatics` is buoyancy, `gravity` the weight, and `contact` that of the
        last step. Inertial effects are in `.inertial`. A command that is older than its thruster's timeout is 0 there,
        while `thrust` is of the last step. UnknownNameError if no boat has that name.
        """
        check_name("boat", boat, self.boats)
        return boat_forces(self._live.arrays, self._live.run_copy(), self.boats.index(boat), self.time)

    def steering(self, boat: str) -> dict[str, float]:
        """Current angle of each engine and rudder of a boat [rad]; UnknownNameError if no boat has that name."""
        return self._of_thrusters(boat, "angle")

    def thrust(self, boat: str) -> dict[str, float]:
        """Current force of each thruster and rudder of a boat [N]; UnknownNameError if no boat has that name."""
        return self._of_thrusters(boat, "thrust")

    def energy(self, boat: str) -> float:
        """Electric energy that a boat's measured propellers have drawn since the reset [J].

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the power of none of its propellers is known.
        """
        with self._run_lock.boats_lock:
            check_name("boat", boat, self.boats)
            arrays = self._live.arrays
            return float(energy_of(arrays, boat, self.boats.index(boat), arrays.propeller_state))

    def _of_thrusters(self, boat: str, column: str) -> dict[str, float]:
        with self._run_lock.boats_lock:
            check_name("boat", boat, self.boats)
            values = self._live.arrays.thruster_state[column]
            return {name: float(values[row]) for name, row in self._live.commands.thrusters[boat].items()}

    # Sensors

    def sensors(self, boat: str) -> Names:
        """Names of a boat's sensors; UnknownNameError if no boat has that name."""
        return self._sensing.names(boat)

    def mounted(self, boat: str) -> tuple[Mounted, ...]:
        """A boat's sensors with their `config`, `frame` and `mount`; UnknownNameError if no boat has that name."""
        check_name("boat", boat, self.boats)
        return tuple(sensor for sensor in self._live.arrays.sensors if sensor.boat == boat)

    def sense(self, boat: str) -> Readings:
        """Last readings of a boat's sensors by name, each at the sensor's own rate.

        A sensor measures when it is looked up for the first time, and at its rate from then on.

        Raises:
            UnknownNameError: no boat has that name, or, when a reading is looked up, no sensor.
            SensorError: when a reading is looked up: the sensor cannot measure, as a GPS without georeference.
        """
        return self._sensing.readings(boat)

    @with_run_lock
    def labelled(self, boat: str, camera: str) -> Reading:
        """The last picture of a camera as `sense` has it, with labels whether or not the camera has `labels: true`.

        Raises:
            UnknownNameError: no boat has that name, or no camera on it.
        """
        return self._sensing.labelled_image(boat, camera)

    @with_run_lock
    def prepare_sensors(self) -> None:
        """Compile now what the boats' cameras and lidars need on this machine, rather than in their first reading.

        Nothing is measured, and the run stays as it is.
        """
        self._sensing.compile()

    @with_run_lock
    def subscribe(
        self, boat: str, sensor: str, callback: Callable[[Reading], None], *, rate: float | None = None
    ) -> Subscription:
        """Call `callback(reading)` for every measurement of a sensor, or `rate` times per simulated second [Hz].

        The call comes from within `advance`, at the step of the measurement, and must not advance, reset or set the
        state. A reading that is due now comes as soon as the simulation advances.

        Raises:
            UnknownNameError: the boat or the sensor does not exist.
            CommandError: the rate is not above 0, or above the sensor's own.
        """
        check_name("boat", boat, self.boats)
        return self._subscriptions.add(boat, sensor, callback, rate, self.time)

    @with_run_lock
    def unsubscribe(self, subscription: Subscription) -> None:
        """End a subscription that `subscribe` returned."""
        self._subscriptions.remove(subscription)

    @property
    def reading_times(self) -> Mapping[tuple[str, str], float]:
        """Wall time [s] spent so far on readings of subscribed sensors, by boat and sensor."""
        return self._subscriptions.times

    def receivers(self, boat: str) -> Names:
        """Names of a boat's pinger receivers; UnknownNameError if no boat has that name."""
        return tuple(self._sensing.of_kind(boat, "pinger"))

    @with_run_lock
    def set_pinger(self, boat: str, sensor: str, position: Sequence[float]) -> None:
        """Move the beacon that a receiver hears to (x, y, z) [m, ENU]; it starts at the world's origin.

        Raises:
            UnknownNameError: the boat or the receiver does not exist.
            CommandError: the position is not three finite numbers.
        """
        self._sensing.set_beacon(boat, sensor, position)

    def pinger(self, boat: str, sensor: str) -> tuple[float, float, float]:
        """Position (x, y, z) [m, ENU] of the beacon that a receiver hears.

        Raises:
            UnknownNameError: the boat or the receiver does not exist.
        """
        return self._sensing.beacon(boat, sensor)

    @with_run_lock
    def fire(self, boat: str, sensor: str | None = None) -> bool:
        """Shoot a ball and return whether a shot was left; `sensor` may be left out if the boat has one shooter.

        Raises:
            UnknownNameError: the boat or the ball shooter does not exist.
            CommandError: the boat has no ball shooter, or several and `sensor` is not given.
        """
        fired = fire(self._sensing, self._live.arrays, self.sea, boat, sensor)
        self._live.derive()
        return fired

    @with_run_lock
    def watch_contacts(self, tell: Callable[[Touch], None], *, ended: bool = False) -> ContactWatch:
        """Call `tell(touch)` once for every touch of a boat, with the other body, the time and the maximum force.

        The call comes from within `advance`, up to half a second after the touch began, or with `ended` a second after
        it was over, and must not advance, reset or set the state. A touch of less than 0.25 s may be missed.

        Raises:
            CommandError: `tell` cannot be called.
        """
        if not callable(tell):
            raise CommandError(f"invalid tell {quote(tell)}: a function that takes a touch is needed")
        watch = ContactWatch(tell, ended=as_flag("ended", ended))
        self._subscriptions.watch(watch)
        return watch

    @with_run_lock
    def unwatch_contacts(self, watch: ContactWatch) -> None:
        """Stop the calls that `watch_contacts` began."""
        self._subscriptions.unwatch(watch)

    # Recorders

    @with_run_lock
    def attach(self, listener: Listener, *, rate: float) -> None:
        """Attach a listener that gets `rate` rows per simulated second [Hz], one state per second, and events.

        Raises:
            CommandError: it lacks a method of a listener, is already attached, or the rate is not above 0.
        """
        check_listener(listener)
        if any(one is listener for one in self._sampler.listeners):
            raise CommandError(f"invalid listener {quote(listener)}: it is already attached")
        if not 0.0 < as_number(rate) < math.inf:
            raise CommandError(f"invalid rate {quote(rate)}: a number of rows per second above 0 is needed")
        self._sampler.add(listener, as_number(rate))
        self._live.renew_arguments()
        try:
            self._live.keep()
        except BaseException:
            self._sampler.remove(listener)
            self._live.renew_arguments()
            raise

    @with_run_lock
    def detach(self, listener: Listener) -> None:
        """Deliver the remaining rows to a listener and detach it; CommandError if it is not attached."""
        if not any(one is listener for one in self._sampler.listeners):
            raise CommandError(f"invalid listener {quote(listener)}: one that is attached is needed")
        self._live.keep()
        self._sampler.remove(listener)
        listener.rows(self.row()[None])
        self._live.renew_arguments()

    def row(self) -> FloatArray:
        """Row of the current time, as listeners get it."""
        return self._live.arrays.row(self.time)

    @with_run_lock
    def event(self, text: str, level: str = "INFO") -> None:
        """Write a log line to the recordings at the current time; CommandError if it is not text."""
        self._live.event(as_text("text", text), as_text("level", level))

    # Lights and placards

    @property
    def lights(self) -> Names:
        """Names of the world's light buoys."""
        return self._displays.names("light")

    @property
    def placards(self) -> Names:
        """Names of the world's placards."""
        return self._displays.names("placard")

    def showing(self, name: str) -> str:
        """Current colour of a light (`red`, `off`) or symbol of a placard (`red_circle`).

        Raises:
            UnknownNameError: no light or placard has that name.
        """
        return self._displays.showing(name)

    @with_run_lock
    def set_light(self, name: str, colors: Sequence[str]) -> None:
        """Make a light show three colours in turn, each for one second, beginning in one second.

        Raises:
            UnknownNameError: no light has that name.
            CommandError: the colours are not three valid ones.
        """
        self._displays.set_light(name, colors)

    @with_run_lock
    def set_placard(self, name: str, symbol: str) -> None:
        """Make a placard show a symbol, such as `red_circle`.

        Raises:
            UnknownNameError: the placard or the symbol does not exist.
        """
        self._displays.set_placard(name, symbol)

    @with_run_lock
    def shuffle(self, name: str) -> None:
        """Make a light or a placard show the next pattern in VRX's order; UnknownNameError if unknown."""
        self._displays.shuffle(name)

    def paint(self, model: mujoco.MjModel) -> None:
        """Set the colours of lights and placards in a model to be drawn, such as `visual_model`.

        Raises:
            CommandError: it is not a model.
        """
        self._displays.paint(model)

    # The task

    @property
    def task(self) -> TaskObservation | None:
        """Phase, times, score and outputs of the world's task; None if it has none."""
        return self._task_runner.observe() if self._task_runner.referee else None

    @property
    def task_is_over(self) -> bool:
        """Whether the world's task is finished; False if it has none."""
        return self._task_runner.referee is not None and self._task_runner.over

    @property
    def task_events(self) -> tuple[Event, ...]:
        """Messages of the referee so far: simulated time [s], text and level."""
        return self._task_runner.events

    @with_run_lock
    def send(self, topic: str, content: object) -> None:
        """Send a message to the task, such as a landmark that was found; the referee reads it at its next update.

        Raises:
            CommandError: the world has no task, or the task takes no such message.
        """
        self._task_runner.send(topic, content)
