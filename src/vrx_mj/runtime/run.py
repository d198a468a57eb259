"""A whole run: a controller at its rate, a duration, and the summary at the end."""

import inspect
import math
import platform
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib import import_module, metadata
from typing import Any, cast

import mujoco
import numpy as np

from vrx_mj.arguments import as_number, check_kind, check_name
from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import CommandError, UnknownNameError, VrxError, first_names, quote, warn
from vrx_mj.model.boats import Vessel
from vrx_mj.model.world import Parameters
from vrx_mj.runtime.commands import channels_of, clipped_commands
from vrx_mj.runtime.limits import processor
from vrx_mj.runtime.observation import TASK, BoatObservation, Observation
from vrx_mj.runtime.rows import as_numbers
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.subscriptions import Touch
from vrx_mj.runtime.task_runner import Event
from vrx_mj.tasks import TASK_KINDS
from vrx_mj.tasks.referee import frame_stride, has_started

FASTEST_SPIN = 12.0
"""Rate of turn [rad/s] that no boat reaches by itself: two turns a second."""
_PLANING_FN = 1.0
"""Froude number from which a boat planes (Faltinsen, Hydrodynamics of High-Speed Marine Vehicles, 2005, 1.1)."""
_DEFAULT_DURATION = 60.0
"""Duration of a run of a world without a task [s]."""
_PHASES = 3
"""Phases of a task, each of which begins at a frame: it may end that many frames late."""
CONTROL_RATE = 10.0
"""Calls of a controller per simulated second [Hz]."""
_FIRE = "fire"
"""Key of a boat's commands that shoots: its value is true, or the ball shooter's name."""


def tilt(boat: BoatObservation) -> float:
    """Angle between a boat's mast and the vertical [rad]."""
    _, x, y, _ = boat.quaternion.tolist()
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y))))


def is_capsized(boat: BoatObservation) -> bool:
    """Whether a boat's mast points downward."""
    return tilt(boat) > math.pi / 2


def spin(boat: BoatObservation) -> float:
    """Rate of turn about whatever axis [rad/s]."""
    return math.hypot(*boat.angular_velocity.tolist())


class MotionWarnings:
    """Warnings of boats that capsize, spin, or are faster than their resistance is modelled, once for each boat."""

    def __init__(self, world: Parameters) -> None:
        self.lines: list[str] = []
        """Warnings so far."""
        self._reported: set[tuple[str, str]] = set()
        self._world = world
        rows = zip(world.boats, world.hulls, strict=True)
        self._vessels = {boat.name: hull.vessel for boat, hull in rows if hull.vessel}

    def warn(self, seen: Observation, time: float) -> None:
        """Warn of what is wrong at a time [s] and was not reported of that boat before."""
        for name, boat in seen.items():
            if is_capsized(boat):
                angle = math.degrees(tilt(boat))
                self._warn(
                    name, "capsized", f"has capsized at t = {time:.1f} s: it is {angle:.0f} degrees from upright"
                )
            if (rate := spin(boat)) > FASTEST_SPIN:
                text = f"spins at {rate:.3g} rad/s at t = {time:.1f} s, more than {FASTEST_SPIN:g}"
                self._warn(name, "spins", f"{text}: check masses, inertias and floats of its robot")
            if name in self._vessels and (text := _too_fast(self._world, self._vessels[name], boat)):
                self._warn(name, "fast", f"{text} at t = {time:.1f} s")

    def _warn(self, boat: str, what: str, text: str) -> None:
        if (boat, what) not in self._reported:
            self._reported.add((boat, what))
            self.lines.append(f"{boat} {text}")
            warn(self.lines[-1], 4)


def harmless_speeds(world: Parameters) -> list[float]:
    """Speeds forward over ground [m/s], by boat, up to which `MotionWarnings` do not call it fast."""
    current = math.hypot(*world.current.mean) if world.current else 0.0
    return [_fastest(world, own.vessel) - current - 1e-9 if own.vessel else math.inf for own in world.hulls]


def is_unusual(features: FloatArray, speeds: FloatArray) -> BoolArray:
    """Whether `MotionWarnings` may have to warn, (n,), of boats with `Batch.features`, (n, boats, 13).

    `speeds` are the `harmless_speeds` of each row [m/s], (n, boats).
    """
    tilted = (features[..., 4:6] ** 2).sum(axis=-1) > 0.5 - 1e-9  # at right angles
    spinning = (features[..., 10:] ** 2).sum(axis=-1) > FASTEST_SPIN**2 - 1e-9
    return (tilted | spinning | (features[..., 7] > speeds)).any(axis=1)  # type: ignore[no-any-return]


def _fastest(world: Parameters, vessel: Vessel) -> float:
    """Speed up to which a boat's resistance is modelled [m/s]."""
    return vessel.resistance[-1][0] if vessel.resistance else _PLANING_FN * math.sqrt(world.sea.gravity * vessel.length)


def _too_fast(world: Parameters, vessel: Vessel, boat: BoatObservation) -> str:
    """How a boat of profile `marine` goes faster than its resistance is modelled; empty if it does not."""
    east, north = world.current.mean if world.current else (0.0, 0.0)
    speed = boat.velocity[0] - east * math.cos(boat.heading) - north * math.sin(boat.heading)
    fastest = _fastest(world, vessel)
    if vessel.resistance and speed > fastest:
        return f"makes {speed:.3g} m/s, more than the {fastest:g} m/s at which its `resistance` ends"
    if speed > fastest:
        froude = speed / math.sqrt(world.sea.gravity * vessel.length)
        text = f"makes {speed:.3g} m/s on a waterline of {vessel.length:.3g} m, a Froude number of {froude:.3g}"
        return f"{text}: planing, above {_PLANING_FN:g}, is not modelled without a `resistance`"
    return ""


Controller = Callable[[Observation, float], Mapping[str, Any] | None]
"""`controller(obs, t) -> {boat: {thruster: command}}`; `"fire": True` among them shoots, and what is under `"task"`
goes to the task, `{topic: content}`."""


@dataclass(frozen=True)
class BoatSummary:
    """Pose, course and distance of a boat at the end of a run."""

    robot: str
    """Kind of boat: a name, or the path that the fleet gives."""
    position: tuple[float, float, float]
    """Position (x, y, z) [m, ENU]."""
    heading: float
    """Heading [rad], counter-clockwise from the world's x axis, from -pi to pi."""
    distance: float
    """Distance over ground [m], sampled at the control rate."""
    heading_compass: float
    """Heading [degrees], clockwise from true north, from 0 to 360."""
    course_compass: float
    """Course over ground [degrees], clockwise from true north, from 0 to 360."""


@dataclass(frozen=True)
class TaskSummary:
    """Result of a task."""

    type: str
    """Type of the task."""
    name: str
    """Name of the task: VRX's task_name."""
    state: str
    """Phase of the task: initial, ready, running or finished."""
    score: float | None
    """The score, in `unit`; None before the task has started."""
    unit: str
    """Unit of the score."""
    better: str
    """Whether a `lower` or a `higher` score is better."""
    elapsed: float
    """Time since the task began to run [s]."""
    timed_out: bool
    """Whether the time ran out before the task was done."""
    num_collisions: int
    """Collisions that counted."""
    events: tuple[Event, ...]
    """Messages of the referee: simulated time [s], text and level."""


@dataclass(frozen=True)
class Summary:
    """Settings and result of a run; equal runs on one platform have the same `state_sha256`."""

    world: str
    """Name of the world."""
    fleet: str
    """Name of the fleet."""
    seed: int
    """Seed of the run."""
    steps: int
    """Physics steps that were made."""
    sim_time: float
    """Simulated time at the end [s]."""
    wall_time: float
    """Wall time of the run [s]."""
    real_time_factor: float
    """Simulated seconds per second of wall time."""
    state_sha256: str
    """Fingerprint of the final state."""
    physics_version: int
    """`constants.PHYSICS_VERSION`; runs of different ones differ."""
    platform: str
    """Kind of machine and versions for which equal runs are equal to the last bit."""
    interrupted: bool
    """Whether Ctrl-C ended the run."""
    boats: dict[str, BoatSummary]
    """Pose and distance of each boat, by name."""
    task: TaskSummary | None = None
    """Result of the world's task; None if it has none."""
    warnings: tuple[str, ...] = ()
    """Boats that capsized, or spun faster than boats do, with the time at which it was first seen."""
    touches: tuple[Touch, ...] = ()
    """Touches of boats, by pair, also before the task starts and after its end; the largest force first."""

    def as_dict(self) -> dict[str, object]:
        """The summary as plain data for JSON."""
        return asdict(self)


def run(
    sim: Simulation,
    duration: float | None = None,
    *,
    controller: Controller | None = None,
    control_rate: float = CONTROL_RATE,
    progress: Callable[[float], None] | None = None,
    advance: Callable[[int], None] | None = None,
) -> Summary:
    """Run for `duration` [s] of simulated time, or until the world's task is finished, and return a summary.

    Without a duration the run ends with the task, at its time-out at the latest, or after one minute in a world
    without a task. With a duration the run continues after the task's end.

    The controller is called `control_rate` times per simulated second, at the nearest step; its commands act
    as in `Simulation.command`. Ctrl-C ends the run early and sets `interrupted` in the summary. `advance` replaces
    `Simulation.advance`: it has to call it, and may inspect the simulation in between.

    Warns:
        VrxWarning: a boat capsizes, or spins faster than boats do; once for each boat, and `warnings` of the summary
            has it, too.

    Raises:
        CommandError: `sim` is not a Simulation, the duration is not a multiple of the timestep, the rate is not above
            0, or the controller returned invalid commands.
        VrxError: the controller cannot be called with observations and a time.
        DivergedError: the state became NaN or too large.
    """
    _check_arguments(sim, controller, control_rate, progress, advance)
    controller = controller and _of_simulation(controller, sim)
    steps = sim.steps_in(planned_duration(sim) if duration is None else duration)
    way = dict.fromkeys(sim.boats, 0.0)
    before, begun, interrupted = sim.observe(), clock.perf_counter(), False
    done, touches, upsets = 0, list[Touch](), MotionWarnings(sim.world.parameters)
    watch = sim.watch_contacts(touches.append)
    try:
        for count in steps_of_calls(steps, sim.timestep, control_rate):
            if controller is not None:
                obey(sim, controller(before, sim.time))
            (advance or sim.advance)(count)
            done += count
            now = sim.observe()
            for boat in way:
                way[boat] += float(np.hypot(*(now[boat].position - before[boat].position)[:2]))
            before = now
            upsets.warn(now, sim.time)
            if progress is not None:
                progress(done * sim.timestep)
            if duration is None and sim.task_is_over:
                break
    except KeyboardInterrupt:
        interrupted = True
        sim.event("interrupted", "WARN")
    finally:
        sim.unwatch_contacts(watch)
    wall = clock.perf_counter() - begun
    return summarize(sim, done, wall, way, interrupted=interrupted, warned=upsets.lines, touches=touches)


def steps_of_calls(steps: int, timestep: float, rate: float = CONTROL_RATE) -> Iterator[int]:
    """Numbers of steps after each call of a controller with this rate [Hz], `steps` together."""
    per_call, done, calls = 1.0 / (rate * timestep), 0, 0
    while done < steps:
        calls += 1
        count = min(max(round(calls * per_call), done + 1), steps) - done
        done += count
        yield count


def takes_rows(controller: object) -> bool:
    """Whether a controller has `rows = True`: it takes `Batch.features` and gives what `Batch.command` takes."""
    return getattr(controller, "rows", False) is True


def _of_simulation(controller: Controller, sim: Simulation) -> Controller:
    """A controller as `run` calls it: a simulation is the only row of one that takes rows."""
    if not takes_rows(controller):
        return controller
    channels = channels_of(sim.world)

    def control(_seen: Observation, time: float) -> dict[str, dict[str, float]]:
        given: Any = controller
        values = as_numbers("commands", given(sim.features[None], time))
        if values.shape != (1, len(channels)):
            needed = (1, len(channels))
            raise CommandError(f"invalid commands of shape {values.shape}: {needed} is needed")
        commands: dict[str, dict[str, float]] = {}
        for channel, value in zip(channels, values[0].tolist(), strict=True):
            commands.setdefault(channel.boat, {})[channel.name] = value
        return commands

    return control


def planned_duration(sim: Simulation) -> float:
    """How long a run lasts at most by default [s]: until the task's time is up, or a minute."""
    task = sim.task
    if task is None:
        return _DEFAULT_DURATION
    end = float(task["running_time"] + task["remaining_time"] + task["elapsed_time"])
    stride = frame_stride(sim.timestep)
    frames = math.ceil(end / (stride * sim.timestep) - 1e-6) + _PHASES
    return max(1, frames * stride - round(sim.time / sim.timestep)) * sim.timestep


def load_controller(name: str, seed: int | Sequence[int], sim: Simulation | None = None) -> Controller:
    """The controller `module:function`, or `module:Class`, which is made and whose `reset(seed)` is called.

    One that takes rows gets a sequence of seeds there; with `sim` it is returned as a controller of that simulation.

    Raises:
        VrxError: the module does not exist, or has nothing by that name.
    """
    module_name, attribute = split_name(name)
    try:
        module = import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise
        raise VrxError(f"no module named '{module_name}' for the controller '{name}'") from error
    found = getattr(module, attribute, None)
    if found is None:
        known = sorted(other for other, value in vars(module).items() if callable(value) and other[0] != "_")
        raise UnknownNameError(f"controller in the module {module_name}", attribute, known)
    controller: Any = found() if inspect.isclass(found) else found
    _check_callable(name, controller)
    if hasattr(controller, "reset"):
        controller.reset(np.atleast_1d(seed) if takes_rows(controller) else seed)
    return _of_simulation(controller, sim) if sim else cast("Controller", controller)


def split_name(name: str) -> tuple[str, str]:
    """Module and attribute of a controller's name; VrxError: it is not `module:function`."""
    module, _, attribute = name.partition(":")
    if not (attribute.isidentifier() and all(part.isidentifier() or part[:1].isdigit() for part in module.split("."))):
        raise VrxError(f"invalid controller '{name}': module:function is needed, as in my_boat:controller")
    return module, attribute


def _check_arguments(sim: object, controller: object, rate: object, progress: object, advance: object) -> None:
    """Whether there is a controller, or none, to be called at such a rate, and the other functions can be called."""
    check_kind("run", sim, Simulation, "a simulation, as Simulation(world)")
    if controller is not None:
        _check_callable(getattr(controller, "__name__", quote(controller).strip("'")), controller)
    for name, given in (("progress", progress), ("advance", advance)):
        if given is not None and not callable(given):
            raise CommandError(f"invalid {name} {quote(given)}: a function is needed")
    if not 0.0 < as_number(rate) < math.inf:
        raise CommandError(f"invalid control_rate {quote(rate)}: a number of calls per second above 0 is needed")


def _check_callable(name: str, controller: object) -> None:
    """Whether it can be called with the observations and the time."""
    if not callable(controller):
        raise VrxError(f"invalid controller '{name}': a function, or a class with __call__, is needed")
    try:
        takes = inspect.signature(controller)
    except (TypeError, ValueError):  # of something compiled
        return
    try:
        takes.bind({}, 0.0)
    except TypeError:
        raise VrxError(
            f"invalid controller '{name}{takes}': two arguments are needed, the observations by boat and the time [s]"
        ) from None


def steady(sim: Simulation, thrust: Mapping[str, float]) -> Controller:
    """A controller that gives every boat the same commands for ever, each those that it takes.

    Raises:
        UnknownNameError: no boat takes one of them.
    """
    takes = {boat: sim.command_names(boat) for boat in sim.boats}
    known = {name for names in takes.values() for name in names}
    whose = f"thruster of {', '.join(sim.boats[:3])}" if sim.boats else "thruster"
    for name in thrust:
        check_name(whose, name, sorted(known))
    commands = {boat: {name: thrust[name] for name in thrust if name in names} for boat, names in takes.items()}
    clipped = [text for boat, own in commands.items() for _, text in clipped_commands(sim.world, boat, own)]
    if clipped:
        more = f"; and {len(clipped) - 1} more" if len(clipped) > 1 else ""
        warn(f"{clipped[0]}{more}", 2)
    return lambda _observation, _time: commands


@cache
def fingerprint() -> str:
    """Platform on which bit-equality depends: processor, system, and versions of the libraries that compute."""
    core = mujoco.mj_versionString()  # pip updates it without the package `mujoco`
    versions = " ".join([f"mujoco-{core}", *(f"{name}-{metadata.version(name)}" for name in ("numba", "numpy"))])
    return f"{processor()}; {platform.system()} {platform.machine()}; python-{platform.python_version()} {versions}"


def obey(sim: Simulation, commands: Mapping[str, Any] | None) -> None:
    """Command what a controller returned.

    Raises:
        CommandError: it is nonsense.
        UnknownNameError: no such boat or thruster.
    """
    for boat, values in _commands(commands).items():
        if boat == TASK:
            _send(sim, values)
        elif isinstance(values, Mapping) and _FIRE in values:
            sim.command_all({boat: {name: value for name, value in values.items() if name != _FIRE}})
            if values[_FIRE]:
                sim.fire(boat, values[_FIRE] if isinstance(values[_FIRE], str) else None)
        else:
            sim.command_all({boat: values})


def _send(sim: Simulation, messages: object) -> None:
    """Send a controller's messages to the task, each topic with a content or a list of them."""
    if not isinstance(messages, Mapping):
        raise CommandError(f"the controller sent {quote(messages)} to the task: a mapping by topic is needed")
    for topic, content in messages.items():
        several = isinstance(content, list) and content and all(isinstance(item, Mapping | list) for item in content)
        for item in content if several else [content]:
            sim.send(topic, item)


def summarize(
    sim: Simulation,
    steps: int,
    wall: float,
    way: Mapping[str, float],
    *,
    interrupted: bool = False,
    warned: Sequence[str] = (),
    touches: Sequence[Touch] = (),
) -> Summary:
    """Tell how a run ended that made so many steps in this wall time [s], with the way of every boat [m].

    `warned` are the warnings of how boats moved, `touches` what they touched.
    """
    seen = sim.observe()
    elapsed = steps * sim.timestep
    boats = {
        boat.name: BoatSummary(
            boat.robot,
            tuple(float(value) for value in seen[boat.name].position),  # type: ignore[arg-type]
            seen[boat.name].heading,
            way[boat.name],
            sim.world.parameters.compass(seen[boat.name].heading),
            sim.world.parameters.compass(seen[boat.name].course),
        )
        for boat in sim.world.parameters.boats
    }
    return Summary(
        world=sim.world.name,
        fleet=sim.world.parameters.fleet,
        seed=sim.seed,
        steps=steps,
        sim_time=elapsed,
        wall_time=wall,
        real_time_factor=elapsed / wall if wall > 0.0 else 0.0,
        state_sha256=sim.state_sha256,
        physics_version=PHYSICS_VERSION,
        platform=fingerprint(),
        interrupted=interrupted,
        boats=boats,
        task=_task_summary(sim),
        warnings=tuple(warned),
        touches=_by_pair(touches),
    )


def _by_pair(touches: Sequence[Touch]) -> tuple[Touch, ...]:
    """All touches of each pair as one, with their number."""
    pairs: dict[tuple[str, str], list[Touch]] = {}
    for one in touches:
        pairs.setdefault((one.boat, one.other), []).append(one)
    found = [
        replace(
            max(own, key=lambda one: one.force),
            time=own[0].time,
            duration=sum(one.duration for one in own),
            count=len(own),
        )
        for own in pairs.values()
    ]
    return tuple(sorted(found, key=lambda one: -one.force))


def _task_summary(sim: Simulation) -> TaskSummary | None:
    task = sim.task
    if task is None:
        return None
    meaning = TASK_KINDS[task["type"]]
    return TaskSummary(
        **{name: task[name] for name in ("type", "name", "state", "timed_out", "num_collisions")},
        score=task["score"] if has_started(task["state"]) else None,
        unit=meaning.unit,
        better=meaning.better,
        elapsed=task["elapsed_time"],
        events=sim.task_events,
    )


def names_controllers(sim: Simulation) -> bool:
    """Whether the fleet of a simulation's world names any."""
    return bool(_crews(sim))


def fleet_controller(sim: Simulation) -> Controller | None:
    """Controller that calls every controller that the world's fleet names; None if it names none.

    Each is loaded once, however many boats it has, and is called with the observations of all boats and the time [s].
    Of what it returns the commands for its own boats are taken, and, if it has the boat that is scored, its messages to
    the task.

    Raises:
        VrxError: a controller cannot be loaded; it names the boats that want it.
    """
    crews = _crews(sim)
    if not crews:
        return None
    task = sim.world.parameters.task
    loaded = []
    for name, own in crews.items():
        takes = own | {TASK} if task is not None and task.boat in own else own
        try:
            loaded.append((name, load_controller(name, sim.seed, sim), takes))
        except VrxError as error:
            raise VrxError(f"controller of {first_names(sorted(own))}: {error}") from error

    def controller(obs: Observation, time: float) -> Mapping[str, Any]:
        commands: dict[str, Any] = {}
        for name, steer, takes in loaded:
            given = _commands(steer(obs, time), f"controller {name}")
            commands |= {boat: item for boat, item in given.items() if boat in takes}
        return commands

    return controller


def _crews(sim: Simulation) -> dict[str, set[str]]:
    """The boats of each controller, by its name."""
    crews: dict[str, set[str]] = {}
    for boat in sim.world.parameters.boats:
        if boat.controller is not None:
            crews.setdefault(boat.controller, set()).add(boat.name)
    return crews


def _commands(returned: object, who: str = "controller") -> Mapping[str, Any]:
    if returned is None:
        return {}
    if not isinstance(returned, Mapping):
        raise CommandError(f"the {who} returned {quote(returned)}: a mapping by boat, or None, is needed")
    return returned
