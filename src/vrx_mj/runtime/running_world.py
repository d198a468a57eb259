"""A world with everything that changes while it runs, and the poses and velocities of its bodies by name.

The parts of a `Simulation` share it. Bodies are boats, floating objects and floating docks.
"""

import contextlib
import dataclasses
import time as clock
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arguments import as_numbers, as_text, check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError, DivergedError, StateError
from vrx_mj.frames import in_world_axes, quaternion, rotation_matrix
from vrx_mj.libmujoco import without_timers
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.mjcf.world import World
from vrx_mj.model.numbers import run_numbers, with_numbers
from vrx_mj.model.world import checked_parameters
from vrx_mj.runtime.commands import CommandNames
from vrx_mj.runtime.forces import RunCopy
from vrx_mj.runtime.hull import Hull, Propeller, hull_of, thrusters
from vrx_mj.runtime.loop import LOOPS, MAX_STATE
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.run_lock import RunLock
from vrx_mj.runtime.sensing import Displays, Sensing
from vrx_mj.runtime.state import (
    STATE_VERSION,
    State,
    divergence_message,
    integration_state,
    save_last_good_state,
    set_integration_state,
)
from vrx_mj.runtime.stepping_models import PhysicsModels, crowding_message, fitting, most_contacts
from vrx_mj.runtime.subscriptions import ContactSampler, Sampler, Subscriptions
from vrx_mj.runtime.task_runner import Decision, TaskRunner
from vrx_mj.runtime.timing import steps_to_multiple, stride_of
from vrx_mj.runtime.warmup import compile_notice
from vrx_mj.runtime.weather import Sea, Wind
from vrx_mj.signals import check_exit
from vrx_mj.tasks.referee import Action, LightUp, PlaceObject, Release, SetPinger, ShowSymbol

_CALL_TIME = 0.05
"""Wall time of one call of the compiled loop [s], so that Ctrl-C works."""
_DRAIN_PERIOD = 0.5
"""Wall time [s] after which sampled rows go to the recorders."""
_AT_REST = (0.0,) * 6
"""Velocity of an object that a task has placed."""


class FreeBodies:
    """Everything in a world that has a free joint."""

    def __init__(self, world: World, arrays: LoopArrays) -> None:
        self._data, self._arrays = arrays.data, arrays
        self._boats, self._thrusters = world.boats, world.parameters.thrusters
        self._hulls: dict[str, Hull] = {}
        floating = [item.name for item in world.parameters.objects if item.kind == "floating"]
        self.objects = tuple(floating)
        docks = [dock.name for dock in world.parameters.docks if dock.dynamic]
        self.floating = (*self.objects, *docks)
        self.address: dict[str, tuple[int, int]] = {}
        """Where the position of each begins in `qpos`, and its velocity in `qvel`."""
        linked = [item for item in world.parameters.objects if item.links]
        body = {item.name: int(arrays.model.body(item.body).id) for item in linked}
        self.anchored = {item.name: body[item.name] for item in linked if item.kind == "static"}
        self.rates = {name: _joint_rates(arrays.model, own) for name, own in body.items()}
        """Where in `qvel` the rates of the joints of each are that has any."""
        roots = arrays.blocks[arrays.blocks["parent"] < 0]
        for names, rows in ((world.boats, arrays.hulls), (self.objects, arrays.floats), (docks, roots)):
            for name, row in zip(names, rows, strict=True):
                self.address[name] = (int(row["qpos"]), int(row["dof"]))
        fixed = world.parameters.task.fixed if world.parameters.task else {}
        self._fixed = {name: np.array([*pose[:3], *quaternion(*pose[3:])]) for name, pose in fixed.items()}

    def check_object(self, name: str, advice: str = "") -> None:
        """Check that a floating object or dock has this name.

        Raises:
            UnknownNameError: none has.
            CommandError: what has it is fixed.
        """
        if as_text("name", name) in self._arrays.fixed:
            raise CommandError(f"{name} cannot be moved: it is fixed{advice}")
        check_name("floating object", name, self.floating)

    def pose(self, name: str) -> FloatArray:
        """Position [m] and quaternion (w, x, y, z), (7,), of a link's origin, or of a dock's frame."""
        if name in self._fixed:
            return self._fixed[name]
        qpos, _ = self.address[name]
        return self._data.qpos[qpos : qpos + 7]  # type: ignore[no-any-return]

    def observe(self, name: str, **known: Mapping[str, Any]) -> BoatObservation:
        """Pose and velocity of a link's origin, with what else is known of a boat."""
        qpos, dof = self.address[name]
        pose, motion = self._data.qpos[qpos : qpos + 7].copy(), self._data.qvel[dof : dof + 6].copy()
        linear = rotation_matrix(pose[3:]).T @ motion[:3]
        return BoatObservation(pose[:3], pose[3:], linear, motion[3:], hull=self._hull(name), **known)

    def _hull(self, name: str) -> Hull | None:
        """The figures of a boat, which do not change; nothing else has any."""
        if name in self._boats and name not in self._hulls:
            number = self._boats.index(name)
            names = {item.name: row for row, item in enumerate(self._thrusters) if item.hull == number}
            self._hulls[name] = hull_of(self._arrays, self._arrays.hulls[number], names)
        return self._hulls.get(name)

    def set_motion(self, name: str, pose: Sequence[float] | None, velocity: Sequence[float] | None) -> None:
        """Set pose [m, rad, ENU] and velocity [m/s, rad/s, body axes] of a link's origin."""
        qpos, dof = self.address[name]
        motion = None if velocity is None else as_numbers(f"velocity of {name}", velocity, 6, MAX_STATE)
        if pose is not None:
            write_pose(self._data.qpos, qpos, as_numbers(f"pose of {name}", pose, 6, MAX_STATE))
        if motion is not None:
            turn = self._data.qpos[qpos + 3 : qpos + 7]
            self._data.qvel[dof : dof + 3] = in_world_axes(turn, np.array(motion[:3]))
            self._data.qvel[dof + 3 : dof + 6] = motion[3:]
            self._data.qvel[self.rates.get(name, slice(0))] = 0.0  # as in Gazebo: all links get the velocity

    def start_floating(self, name: str, height: Callable[[float, float], float]) -> None:
        """Start an object or a dock where it is now, with the surface at `height(x, y)` [m]."""
        if name in self.anchored:
            self._arrays.start_links_floating(self.anchored[name], height)
            return
        qpos, _ = self.address[name]
        if name in self.objects:
            row = self.objects.index(name)
            self._arrays.start_floating(row, height(*self._data.qpos[qpos : qpos + 2]))
            self._arrays.start_links_floating(self._arrays.floats["body"][row], height)
            return
        for row in self._arrays.tree_rows(qpos):
            x, y, _ = self._data.xipos[self._arrays.blocks["body"][row]]
            self._arrays.block_state[row] = (height(x, y), 0)

    def worst(self) -> str:
        """Name of the first body whose state is not finite, or else the fastest."""
        worst, name = -1.0, "the world"
        for candidate, (qpos, dof) in self.address.items():
            values = np.concatenate((self._data.qpos[qpos : qpos + 7], self._data.qvel[dof : dof + 6]))
            if not np.isfinite(values).all():
                return candidate
            if (size := float(np.abs(values).max())) > worst:
                worst, name = size, candidate
        return name


def _joint_rates(model: mujoco.MjModel, body: int) -> slice:
    """Where in `qvel` the rates of the joints are by which others hang on a body, after those of its free joint."""
    dofs = np.flatnonzero(model.body_rootid[model.dof_bodyid] == model.body_rootid[body])
    return slice(int(dofs[0]) + int(model.body_dofnum[body]), int(dofs[-1]) + 1)


def write_pose(qpos: FloatArray, at: int, pose: Sequence[float]) -> None:
    """Write x, y, z [m], roll, pitch and yaw [rad] as the position and quaternion of a free joint."""
    qpos[at : at + 3] = pose[:3]
    qpos[at + 3 : at + 7] = quaternion(*pose[3:])


_Six = Sequence[float] | None


def loop_arrays_of(world: World, physics_models: PhysicsModels, known: LoopArrays | None = None) -> LoopArrays:
    """A world's arrays, with models and data of its own; `known`: those of one that differs by what came or went."""
    model, contact_free = physics_models.models(world)
    return LoopArrays(world, model, contact_free, mujoco.MjData(model), known=known)


class RunningWorld:
    """A world, its tables, and the parts that measure, record, score and steer it.

    `world`, `arrays`, `bodies`, `commands` and `thrusters` are new objects after something came or went; others are
    kept.
    """

    def __init__(self, world: World) -> None:
        self.first = world
        self.seed = world.seed
        self.run_lock = RunLock("simulation")
        self.physics_models = PhysicsModels()
        self.thrusters: dict[str, dict[str, Propeller]] = {}
        self._take(world, loop_arrays_of(world, self.physics_models))
        self.sampler = Sampler(self.arrays.columns, self.arrays.timestep)
        self._run = self.arrays.run(self.sampler.table, self.sampler.buffer)
        self.sea, self.wind = Sea(self.arrays), Wind(self.arrays)
        own = weakref.proxy(self)  # a run that nobody holds goes at once, with its models and its drawing context
        self.sensing = Sensing(
            world, self.arrays, self.wind, self.drawing, lambda: own.renew_arguments(), self.run_lock,  # noqa: PLW0108
        )  # fmt: skip
        self.displays = Displays(self.sensing)
        contacts = ContactSampler(lambda: own.world.boats, lambda: own.arrays)
        self.subscriptions = Subscriptions(self.arrays.sensors, self.sensing.read, self.arrays.timestep, contacts)
        self.task_runner = TaskRunner(world, self.arrays, self.bodies.pose)
        self._pace, self._drained = 1e-5, 0.0

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.arrays.data.time)

    # Worlds

    def _take(self, world: World, arrays: LoopArrays) -> None:
        """Make a world and its arrays the present ones."""
        self.world, self.arrays, self._data = world, arrays, arrays.data
        self._most_contacts, self._second = most_contacts(arrays.model), stride_of(1.0, arrays.timestep)
        self.commands = CommandNames(world)
        known, fleet = self.thrusters, self.commands.thrusters
        self.thrusters = {boat: known.get(boat) or thrusters(arrays, rows) for boat, rows in fleet.items()}
        self.bodies = FreeBodies(world, arrays)
        self.drawing = cache(partial(drawing_model, world))

    def bind(self, world: World, arrays: LoopArrays) -> None:
        """Go over to a world that has other boats, objects or docks, with everything that users may hold."""
        with self.run_lock.boats_lock:
            self._take(world, arrays)
            self.sea.bind(arrays)
            self.wind.bind(arrays)
            self.sensing.bind(world, arrays, self.drawing)
            self.subscriptions.bind(arrays.sensors)
            self.task_runner.bind(world, arrays, self.bodies.pose)
            self.sampler.resize(arrays.columns)

    def enter(self, world: World, arrays: LoopArrays, line: str) -> None:
        """Go on in a world that has something more or less, from the moment of its arrays; `line` goes into the log."""
        self.bind(world, arrays)
        self.renew_arguments()
        for listener in self.sampler.listeners:
            listener.boats_changed()
        self.event(line)
        self.keep()

    def check_idle(self, call: str) -> None:
        """Refuse a call while the run advances, or hands over a reading.

        Raises:
            CommandError: it does.
        """
        self.run_lock.check(call)
        self.subscriptions.check_idle(call)
        self.run_lock.check_own(call)

    # Advancing

    def compile(self) -> None:
        """Compile the loop, if it is not compiled yet."""
        with compile_notice(self._loop):
            self._loop(self._run.table, 0, self.time, self.arrays.timestep, 0)

    def advance(self, left: int) -> None:
        """Advance by a number of steps, and stop where a reading, a frame of the task or a kept state is due.

        Raises:
            DivergedError: the state became NaN or too large.
        """
        timestep, now = self.arrays.timestep, self.time
        if (decision := self.task_runner.look(now)) is not None:
            self._carry_out(decision)
        self.subscriptions.deliver(now)
        while left > 0:
            check_exit()
            second = steps_to_multiple(now, timestep, self._second)
            heard = min(self.subscriptions.steps(now), self.task_runner.steps(now))
            count = min(left, second, max(1, int(_CALL_TIME / self._pace)), heard)
            begun = clock.perf_counter()
            with without_timers:
                done = int(self._loop(self._run.table, 0, now, timestep, count))
            now = self.time
            if done < 0:
                self._raise_divergence()
            if self._data.ncon > self._most_contacts:
                raise DivergedError(f"{crowding_message(self._data.ncon)} (t = {self.time:g} s)")
            if done:
                self._pace += 0.2 * ((clock.perf_counter() - begun) / done - self._pace)
            left -= done
            if done < count or begun - self._drained > _DRAIN_PERIOD:
                self.sampler.drain()
                self._drained = begun
            if (decision := self.task_runner.look(now)) is not None:
                self._carry_out(decision)
            if done == second:
                self.keep()
            self.subscriptions.deliver(now)

    def renew_arguments(self) -> None:
        """Give the loop the present arrays."""
        self._run = self.arrays.run(self.sampler.table, self.sampler.buffer, self._run)
        self.run_copy = cache(partial(RunCopy, self.arrays))
        self._loop: Callable[..., int] = LOOPS[self.arrays.loop]

    def _raise_divergence(self) -> None:
        self.sampler.drain()
        good = dataclasses.replace(self._last_good, world=self.world.sha256)
        kept = save_last_good_state(good)
        message = divergence_message(self.bodies.worst(), self.time, self.arrays.timestep, good, kept)
        self.event(message, "ERROR")
        raise DivergedError(message)

    # States

    def restart(self, seed: int, numbers: Mapping[str, object]) -> None:
        """Begin the run of a seed, with the boats, objects and docks of the first world, and numbers of its own.

        Raises:
            VrxError: the world has no such number, or a value is outside its range.
        """
        world = self.first
        if numbers:
            own = with_numbers(world.parameters, numbers, run_numbers(world.numbers))
            world = dataclasses.replace(world, parameters=checked_parameters(own))
        self.seed = seed
        if self.world is not world:
            self.thrusters = {}  # a boat that was spawned may have had the name of another
            known = self.world.pieces is world.pieces
            arrays = self.arrays if known else loop_arrays_of(world, self.physics_models)
            self.bind(world, arrays.with_parameters(world.parameters, seed))
        mujoco.mj_resetData(self.arrays.model, self.arrays.data)
        self.arrays.reset(seed)
        self.wind.forget()
        self.task_runner.reset()
        self._settle()

    def moment(self) -> State:
        """The state without its world's fingerprint, which takes 50 ms once for every world."""
        arrays = self.arrays
        flat = integration_state(arrays.model, arrays.data)
        task = self.task_runner.dump()
        return State(STATE_VERSION, "", self.seed, self.time, flat, arrays.pack(), arrays.moving, task)

    def check(self, state: State) -> None:
        """Check that the run can go on from a state.

        Raises:
            StateError: it is of another world or other boats, or damaged.
        """
        if state.world == self.first.sha256 != self.world.sha256:
            raise StateError(f"the state at t = {state.time:g} s has other {self._difference()}, then set_state")
        state.check(self.world.sha256, self._last_good)
        self.arrays.check(state.mujoco, state.ours)
        self.task_runner.check(state.task)

    def _difference(self) -> str:
        """Differences of the first world from the present one, and how to return to it."""
        if self.first.boats != self.world.boats:
            return f"boats than the simulation: call reset(), which restores {', '.join(self.first.boats)}"
        return "objects or docks than the simulation: call reset(), which restores those of the world"

    def restore(self, state: State) -> None:
        """Go to a state that was checked."""
        mujoco.mj_resetData(self.arrays.model, self.arrays.data)  # parked balls sleep again
        set_integration_state(self.arrays.model, self.arrays.data, state.mujoco)
        self.arrays.unpack(state.ours)
        self.task_runner.load(state.task)
        self.seed = state.seed
        self.arrays.key(state.seed)
        self.wind.forget()
        self._settle()

    def _settle(self) -> None:
        """Begin anew from a state that was set."""
        self.arrays.refresh()
        self.sensing.begin(self.seed)
        self.subscriptions.begin(self.time)
        self.renew_arguments()
        self.derive()
        self.keep()

    def derive(self) -> None:
        """Make what follows from the state, and what sensors see of it, follow a state that was set."""
        with fitting(self._data):
            mujoco.mj_forward(self.arrays.model, self._data)
        if self._data.ncon > self._most_contacts:
            raise CommandError(crowding_message(self._data.ncon))
        self.sensing.renew()

    def keep(self) -> None:
        """Keep the present state, and give it to the listeners."""
        self._last_good = self.moment()
        if self.sampler.listeners:
            blob = dataclasses.replace(self._last_good, world=self.world.sha256).to_bytes()
            for listener in self.sampler.listeners:
                listener.state(self.time, blob)

    @contextlib.contextmanager
    def undone_if_crowded(self) -> Iterator[None]:
        """Context that moves bodies by hand: it is undone if they cannot be there."""
        before = self.moment()
        try:
            yield
        except CommandError:
            self.restore(before)
            raise

    # Poses

    def set_boat(self, name: str, pose: _Six, velocity: _Six) -> None:
        """Set the pose or the velocity of a boat; with a pose its task releases it."""
        check_name("boat", name, self.world.boats)
        with self.undone_if_crowded():
            self.bodies.set_motion(name, pose, velocity)
            if pose is not None:
                self.arrays.release(name)
            self.derive()
        if pose is not None:
            for table, rows in self.arrays.state_of_waves(self.world.boats.index(name)).items():
                getattr(self.arrays, table)[rows] = 0.0

    def set_object(self, name: str, pose: _Six, velocity: _Six) -> None:
        """Set the pose or the velocity of a floating object or dock, and let the water have it there."""
        self.bodies.check_object(name, "; remove it, and spawn it elsewhere")
        with self.undone_if_crowded():
            self.bodies.set_motion(name, pose, velocity)
            self.derive()
        self.bodies.start_floating(name, lambda x, y: float(self.sea.height(x, y, self.time)))

    # What the task does

    def _carry_out(self, decision: Decision) -> None:
        """Give the listeners a frame of the task, and do what its referee has decided."""
        for listener in self.sampler.listeners:
            listener.frame(self.time, decision.row, decision.messages)
        for text, level in decision.verdict.lines:
            self.event(text, level)
        for action in decision.verdict.actions:
            self._act(action)

    def _act(self, action: Action) -> None:
        match action:
            case Release(boat):
                self.arrays.release(boat)
            case PlaceObject(name, pose):
                self.set_object(name, pose, _AT_REST)
            case SetPinger(boat, position):
                for sensor in self.sensing.of_kind(boat, "pinger"):
                    self.sensing.set_beacon(boat, sensor, position)
            case LightUp(name, colors):
                self.displays.set_light(name, colors)
            case ShowSymbol(placard, symbol):
                self.displays.set_placard(placard, symbol)

    def event(self, text: str, level: str = "INFO") -> None:
        """Give the listeners a line of the log."""
        for listener in self.sampler.listeners:
            listener.event(self.time, text, level)
