"""A simulation that is served: it takes what networks bring, advances, and gives them what they listen to.

Only this touches the simulation, and only between two calls of `advance`.
"""

import math
import tempfile
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, ConfigError, SensorError, VrxError, shorten
from vrx_mj.formats.gazebo.sdf_objects import model_of_text
from vrx_mj.formats.urdf.reader import in_namespace
from vrx_mj.frames import compose
from vrx_mj.ros.diagnosis import Diagnosis
from vrx_mj.ros.interface import (
    Call,
    Command,
    Delivery,
    Dialect,
    Inbox,
    Input,
    Output,
    RosInterface,
    Transport,
    dialect_of,
    publishers_of,
)
from vrx_mj.ros.messages import Message, encode
from vrx_mj.ros.steering import Steering
from vrx_mj.ros.table import CLOCK, make_tables
from vrx_mj.ros.table.boats import Localization, Source, description
from vrx_mj.ros.table.host import BoatOutputs, Bodies, CmdVel, InitialPoses, Scenery
from vrx_mj.ros.table.world import TASK_INFO
from vrx_mj.runtime.applied import AppliedForces
from vrx_mj.runtime.observation import Observation
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.subscriptions import Subscription
from vrx_mj.runtime.timing import Schedule, sample_number, steps_to_time
from vrx_mj.sensors.readings import Reading

_NEWS_RATE = 10.0
"""Rate at which outputs without a rate are checked [Hz, simulated time]."""
_STEP_SERVICE = "/vrx_mj/step"
"""Service that advances time where no topics are listed."""
MOST_ANSWERS = 1024
"""Largest number of answers of one topic that wait for their clock."""
CLOCK_RATE = 100.0
"""Rate at which the clock is published and commands are taken [Hz, simulated time]."""
_ALL_STEPS = 1 << 62
"""Number of steps of a step without end."""
_LONGEST_STEP = 3600.0
"""Longest step of the service `/vrx_mj/step` [s]."""
_LARGEST_TEXT = 1 << 24
"""Longest URDF or SDF of a boat that joins [characters]."""


class Publisher:
    """Outputs of a table on their way to transports."""

    def __init__(self, sim: Simulation, transports: Sequence[Transport], report: Callable[[str, str], None]) -> None:
        self._sim, self._transports, self._report = sim, transports, report
        self._table, self._wanted = RosInterface(), frozenset[str]()
        self._read: dict[tuple[str, str], Subscription] = {}
        self._failed: set[tuple[str, str]] = set()
        self._batch: list[Delivery] = []
        self._schedule = Schedule()
        self._last: dict[str, tuple[Message, bytes]] = {}

    def offer(self, table: RosInterface) -> None:
        """Make messages of this table from now on."""
        self._table = table
        self._schedule.keep(table.outputs)
        self._last = {name: last for name, last in self._last.items() if name in table.outputs}
        for key in [key for key in self._read if key[0] not in self._sim.boats]:
            del self._read[key]  # the simulation ended these itself
        self._wanted = frozenset()

    def begin(self) -> None:
        """Time began anew."""
        self._schedule = Schedule()
        self._last.clear()

    def deliver(self) -> None:
        """Send what is due at the present time; the clock goes last, for those who answer it."""
        self._listen()
        time = self._sim.time
        for output in self._table.outputs.values():
            make = output.make if output.sensor is None else output.blind
            if make is not None and output.sensor not in self._read and self._is_due(output, time):
                self._make(output, make, time)
        self._send()

    def repeat(self, name: str) -> None:
        """Send the present message of an output out of turn, if somebody listens and there is such an output."""
        output = self._table.outputs.get(name)
        if output is not None and output.sensor is None and name in self._wanted:
            self._make(output, output.make, self._sim.time)
            self._send()

    def _send(self) -> None:
        batch, self._batch = self._batch, []
        batch.sort(key=lambda sent: sent.output.name == CLOCK)
        for transport in self._transports if batch else ():
            transport.publish(batch)

    def _listen(self) -> None:
        """Read the sensors that somebody listens to, and no others."""
        wanted = frozenset().union(*(transport.subscribed_topics for transport in self._transports))
        if wanted == self._wanted:
            return
        self._wanted = wanted
        outputs = [self._table.outputs[name] for name in wanted if name in self._table.outputs]
        keys = {output.sensor for output in outputs if output.sensor and not output.blind} - self._failed
        for key in self._read.keys() - keys:
            self._sim.unsubscribe(self._read.pop(key))
        for key in sorted(keys - self._read.keys()):
            self._subscribe(key)

    def _subscribe(self, key: tuple[str, str]) -> None:
        """Try a reading first: a sensor that cannot measure here is reported once, and left out."""
        boat, sensor = key
        try:
            self._sim.sense(boat)[sensor]
        except SensorError as error:
            self._failed.add(key)
            self._report("ERROR", str(error))
            return
        outputs = [output for output in self._table.outputs.values() if output.sensor == key]

        def take(reading: Reading) -> None:
            for output in outputs:
                if output.name in self._wanted and (message := output.make(reading)) is not None:
                    self._batch.append(Delivery(output, message, reading.time))

        self._read[key] = self._sim.subscribe(boat, sensor, take)

    def _is_new(self, output: Output, message: Message) -> bool:
        """Whether the message differs from the last one of an output that has no rate."""
        last, written = self._last.get(output.name, (None, b""))
        if message is last:
            return False
        now = sha256(encode(message, output.type)).digest()
        self._last[output.name] = message, now
        return now != written

    def _is_due(self, output: Output, time: float) -> bool:
        due = self._schedule.take(output.name, output.rate or _NEWS_RATE, time)
        return due and (output.latched or output.name in self._wanted)

    def _make(self, output: Output, make: Callable[[], Message | None], time: float) -> None:
        made = make()
        for message in made if isinstance(made, list) else [] if made is None else [made]:
            if output.rate or self._is_new(output, message):
                self._batch.append(Delivery(output, message, time))


class Lockstep:
    """Answers by topic; each clock takes one of each, in the order in which they came."""

    def __init__(self, topics: Sequence[str]) -> None:
        """Without topics, time goes on by `/vrx_mj/step` alone."""
        self._answers: dict[str, deque[Command]] = {topic: deque(maxlen=MOST_ANSWERS) for topic in topics}

    def keep(self, command: Command) -> bool:
        """Keep a command for its clock, if its topic is one of the list."""
        if command.topic not in self._answers:
            return False
        self._answers[command.topic].append(command)
        return True

    def answers(self) -> list[Command] | None:
        """One answer of each topic, or None while one is missing."""
        if not self._answers or not all(self._answers.values()):
            return None
        return [waiting.popleft() for waiting in self._answers.values()]

    def begin(self) -> None:
        """Forget what was answered: time begins anew."""
        for waiting in self._answers.values():
            waiting.clear()

    @property
    def missing(self) -> tuple[str, ...]:
        """Topics, or the service, that simulated time waits for."""
        if not self._answers:
            return (_STEP_SERVICE,)
        return tuple(topic for topic, waiting in self._answers.items() if not waiting)


Report = Callable[[str, str], None]
"""Takes a level and a line for people."""


class Newcomer(NamedTuple):
    """A boat, an object or a dock that joined, as it was given."""

    text: str
    """URDF, or SDF."""
    pose: Sequence[float]
    """x, y, z, roll, pitch, yaw [m, rad]."""
    is_urdf: bool


@contextmanager
def _named_text(name: str) -> Iterator[None]:
    """Around the reading of a text that came over a network: errors name it, not the file that it was written to."""
    try:
        yield
    except ConfigError as error:
        raise ConfigError(
            [problem if problem.file.startswith("<") else replace(problem, file=name) for problem in error.problems]
        ) from None


def _error_text(error: Exception) -> str:
    """An error for who sent what raised it, in one line if it is not a VrxError."""
    return str(error) if isinstance(error, VrxError) else f"{type(error).__name__}: {shorten(error)}"


def _check_length(name: str, kind: str, text: str) -> None:
    """Refuse a text that is too long to be parsed."""
    if len(text) > _LARGEST_TEXT:
        raise CommandError(f"{name}: the {kind} has {len(text)} characters; at most {_LARGEST_TEXT} are allowed")


class RosServer:
    """A simulation, its table, and the transports on which that is offered."""

    def __init__(
        self,
        sim: Simulation,
        transports: Sequence[Transport],
        inbox: Inbox,
        *,
        report: Report,
        cmd_vel: CmdVel = "thrust",
        truth: bool = False,
        localization: Source | None = None,
        clock_rate: float = CLOCK_RATE,
        lockstep: Lockstep | None = None,
        further: BoatOutputs = lambda _boat: (),
    ) -> None:
        """Serve a simulation from its present moment on.

        Args:
            sim: the simulation; nothing else may touch it from now on.
            transports: the networks, opened.
            inbox: what they fill.
            report: is given lines for people.
            cmd_vel: what `cmd_vel` commands.
            truth: whether `/tf` has the true poses of boats.
            localization: what boats are localized by, as by robot_localization; None: they are not.
            clock_rate: of `/clock`, per simulated second.
            lockstep: which topics time waits for; None: it does not wait.
            further: gives topics of each boat that not every simulation has, as of NMEA sentences.

        Raises:
            CommandError: the clock's rate is not above 0, or above that of the physics.
        """
        if not 0.0 < clock_rate <= 1.0 / sim.timestep + EARLY:
            raise CommandError(
                f"invalid clock rate {clock_rate:g} Hz: above 0 and at most {1.0 / sim.timestep:g} Hz is needed"
            )
        self.sim, self.cmd_vel, self.truth, self.paused, self.pace = sim, cmd_vel, truth, False, 0.0
        self.sensor_load: Mapping[tuple[str, str], float] = {}
        self.lockstep, self.further = lockstep, further
        self.update_rate = 0.0
        self.bodies, self.scenery = Bodies(sim), Scenery(sim.world.parameters)
        self.applied = AppliedForces(sim, report)
        self.diagnosis = Diagnosis(sim, report)
        self._transports, self._inbox, self._report, self._clock_rate = transports, inbox, report, clock_rate
        self.steering, self._initial_poses = Steering(sim, report), InitialPoses(sim)
        self._joined: dict[str, Newcomer] = {}
        self._left = set[str]()
        self._localization, self._localized = localization, dict[str, Localization]()
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._seen: tuple[float, Observation] | None = None
        dialects = dict.fromkeys(dialect_of(transport) for transport in transports) or {"vrx": None}
        self._publishers: dict[Dialect, Publisher] = {
            dialect: Publisher(sim, [one for one in transports if dialect_of(one) == dialect], report)
            for dialect in dialects
        }
        self._offer()

    @property
    def table(self) -> RosInterface:
        """All that is offered now, on the first of the transports."""
        return next(iter(self._tables.values()))

    @property
    def tables(self) -> Mapping[Dialect, RosInterface]:
        """All that is offered now, by whose names it is."""
        return self._tables

    @property
    def observation(self) -> Observation:
        """Observation of the boats at the present moment."""
        if self._seen is None or self._seen[0] != self.sim.time:
            self._seen = self.sim.time, self.sim.observe()
        return self._seen[1]

    # Time

    def receive(self) -> None:
        """Carry out what networks asked for since the last time."""
        commands, calls, unknown_publishers = self._inbox.drain()
        for command in commands:
            if self.lockstep is None or not self.lockstep.keep(command):
                self._take(command)
        for call in calls:
            self._answer(call)
        for unknown_publisher in unknown_publishers:
            if unknown_publisher.dialect in self._tables:
                self.diagnosis.unknown_publisher(unknown_publisher, self._tables[unknown_publisher.dialect])

    def announce(self) -> None:
        """Publish the present moment, before time goes on."""
        for post in self._publishers.values():
            post.deliver()

    def tick(self) -> int:
        """Advance to the clock's next moment, and publish; the steps made. Lockstep: only if all have answered."""
        if self.lockstep is not None:
            answers = self.lockstep.answers()
            if answers is None:
                return 0
            for command in answers:
                self._take(command)
        return self._advance()

    def _advance(self, most: int = _ALL_STEPS) -> int:
        sim = self.sim
        then = (sample_number(self._clock_rate, sim.time) + 1) / self._clock_rate
        steps = min(most, steps_to_time(then, sim.time, sim.timestep))
        self.steering.steer()
        self.steering.renew()
        self.applied.advance(steps)
        self.announce()
        self.diagnosis.look()
        return steps

    def step(self, duration: float) -> None:
        """Advance by a duration [s] under the present commands; 0: to the clock's next moment.

        Raises:
            CommandError: it is negative, no multiple of the physics' step, or an hour and more.
        """
        if not 0.0 <= duration < _LONGEST_STEP:
            raise CommandError(f"invalid step {duration:g} s: at least 0 and below {_LONGEST_STEP:g} s is needed")
        if duration == 0.0:
            self._advance()
        else:
            self.advance(self.sim.steps_in(duration))

    def advance(self, steps: int) -> None:
        """Advance by a number of physics steps, and publish what is due on the way."""
        while steps > 0:
            steps -= self._advance(steps)

    # What networks ask for

    def _take(self, command: Command) -> None:
        table = self._tables.get(command.dialect)
        entry = table.inputs.get(command.topic) if table is not None else None
        if entry is None:
            return  # its boat has left
        try:
            entry.take(command.message)
        except Exception as error:  # a mistake of ours, too, ends no run
            text = f"{command.topic} from {command.sender}: {_error_text(error)}"
            self.diagnosis.once(f"{command.topic} refused {command.sender}", text)
        else:
            self.diagnosis.note_command(command)

    def _answer(self, call: Call) -> None:
        service = self._services.get(call.service)
        if service is None:
            call.answer(None, f"the service {call.service} no longer exists")
            return
        try:
            response = service.answer(call.request)
        except Exception as error:  # as there
            why = _error_text(error)
            text = f"{call.service}, called by {call.caller}: {why}"
            self.diagnosis.once(text, text)
            call.answer(service.failure(why), why)
        else:
            call.answer(response, "")

    def is_published(self, thrusters: Sequence[Input], cmd_vel: str) -> bool:
        """Whether somebody publishes one of a boat's thrusters' topics; told once, as its `cmd_vel` is left alone."""
        for transport in self._transports:
            for entry in thrusters:
                nodes = publishers_of(transport, entry.name) if dialect_of(transport) in entry.dialects else ()
                if nodes:
                    text = f"{cmd_vel} does not drive {entry.boat}: {nodes[0]} publishes {entry.name}"
                    self.diagnosis.once(f"{entry.boat} mixed", text)
                    return True
        return False

    def command(self, boat: str, commands: Mapping[str, float]) -> None:
        """Command thrusters, as `Simulation.command`."""
        self.sim.command_all({boat: commands})
        self.steering.let_go(boat, commands)
        self.diagnosis.check_commands(boat, commands)

    def push(self, boat: str, thruster: str, force: float) -> None:
        """Command a thruster to push with a force [N] until its next command, or as near to it as it can.

        Raises:
            CommandError: the force is not a finite number.
        """
        if not math.isfinite(force):
            raise CommandError(f"invalid thrust {force} N for {thruster} of {boat}: a finite number is needed")
        own = self.observation[boat].thrusters[thruster]
        command = force if own.in_newtons else own.command(force)
        self.command(boat, {thruster: command})
        self.steering.hold(boat, thruster, command)
        if not own.in_newtons:
            self.diagnosis.check_force(boat, own, force)

    # Who is there

    def description(self, boat: str) -> str:
        """A boat's URDF; a VrxError where the files that it was made of are not here."""
        if boat in self._joined and self._joined[boat].is_urdf:
            return in_namespace(self._joined[boat].text, boat)
        return description(self.sim.world, boat)

    def spawn(self, name: str, urdf: str, pose: Sequence[float]) -> None:
        """Put a boat of this URDF into the world, at (x, y, z, roll, pitch, yaw) [m, rad, ENU].

        Raises:
            VrxError: as `Simulation.spawn`.
        """
        _check_length(name, "URDF", urdf)
        if "<robot" not in urdf:
            raise CommandError(f"{name}: invalid URDF: a <robot> element is needed")
        self._join(name, Newcomer(urdf, pose, is_urdf=True))
        self._report("INFO", f"{name} joins at ({pose[0]:g}, {pose[1]:g}): /{name}/...")

    def spawn_object(self, name: str, sdf: str, pose: Sequence[float]) -> str:
        """Put the model of an SDF text into the world, at (x, y, z, roll, pitch, yaw) [m, rad, ENU].

        What is known here by the model's name is taken from the catalogue; a model with thrusters is a boat. The result
        says what the model is here.

        Raises:
            VrxError: as `Simulation.spawn_object`; the text is no SDF with a model.
        """
        _check_length(name, "SDF", sdf)
        lines = self._join(name, Newcomer(sdf, pose, is_urdf=False))
        self._report("WARN" if lines[1:] else "INFO", "; ".join(lines))
        return "; ".join(lines)

    def remove(self, name: str) -> None:
        """Take a boat, an object or a dock out of the world; errors are those of `Simulation.remove`."""
        self.sim.remove(name)
        if self._joined.pop(name, None) is None:
            self._left.add(name)
        self._update()
        self._report("INFO", f"{name} leaves")

    def _join(self, name: str, newcomer: Newcomer) -> list[str]:
        lines = self._spawn(name, newcomer)
        self._update()
        return lines

    def note_move(self) -> None:
        """Take note that something was put somewhere."""
        self._seen = None
        self.diagnosis.check_overlaps()

    def reset_world(self) -> None:
        """Put boats and floating objects back where they started; time goes on."""
        self._initial_poses.put_back()
        self._seen = None
        self._report("INFO", "the simulation is reset")

    def reset_simulation(self) -> None:
        """Begin again at time 0 with the same seed, and with the boats, objects and docks that there are now.

        Raises:
            CommandError: the run is being recorded: a recording is of one run.
        """
        self.sim.reset(self.sim.seed)
        self.applied.begin()
        for name in self._left:
            self.sim.remove(name)
        for name, newcomer in self._joined.items():
            self._spawn(name, newcomer)
        self.steering.begin()
        self._update()
        for post in self._publishers.values():
            post.begin()
        if self.lockstep is not None:
            self.lockstep.begin()
            self.announce()  # the clock that is to be answered now
        self._report("INFO", "time restarts at 0")

    def _spawn(self, name: str, newcomer: Newcomer) -> list[str]:
        """Add a boat or object; returns lines on what it is."""
        self._folder = self._folder or tempfile.TemporaryDirectory(prefix="vrx_mj_joined_")
        folder, pose, lines = Path(self._folder.name), newcomer.pose, [f"{name} joins"]
        if newcomer.is_urdf:
            file = folder / f"{len(self._joined)}.urdf"
            file.write_text(newcomer.text, encoding="utf-8", errors="replace")
            self.sim.spawn(name, pose=pose, robot=file)
        else:
            with _named_text(f"SDF of {name}"):
                found = model_of_text(newcomer.text, folder / "models")
                x, y, z, roll, pitch, yaw = pose
                pose = compose((x, y, z, roll, pitch, yaw), found.pose)
                if found.is_boat:
                    self.sim.spawn(name, pose=pose, robot=found.model)
                else:
                    self.sim.spawn_object(name, model=found.model, pose=pose)
            lines = [f"{name} joins as {found.title}", *found.notes]
        self._joined[name] = newcomer
        return lines

    def _update(self) -> None:
        """Boats or objects came or went, or time began anew."""
        self._seen = None
        self.bodies.bind()
        self.applied.bind()
        self.steering.bind()
        self._initial_poses.bind()
        self.diagnosis.check_receivers()
        self._offer()
        self.announce()  # what is latched, even while time does not advance

    def _offer(self) -> None:
        waits, localized = self.lockstep is not None, self._localize()
        tables = make_tables(self, clock_rate=self._clock_rate, waits=waits, localized=localized)
        self._services = {**tables["vrx"].services, **tables["vrx3"].services}
        self._tables: dict[Dialect, RosInterface] = {dialect: tables[dialect] for dialect in self._publishers}
        for transport in self._transports:
            transport.offer(self._tables[dialect_of(transport)])
        for dialect, post in self._publishers.items():
            post.offer(self._tables[dialect])

    def _localize(self) -> Mapping[str, Localization]:
        """The localization of each boat that has one; those of boats that were there go on."""
        known, self._localized, source = self._localized, {}, self._localization
        if source is None:
            return {}
        for boat in self.sim.boats:
            try:
                self._localized[boat] = known.get(boat) or Localization(self, boat, source)
            except CommandError as error:
                self.diagnosis.once(f"localization of {boat}", str(error))
        return self._localized

    def close(self) -> None:
        """Publish the task's last info, a trial's score, and throw away what it keeps; the transports stay open."""
        for post in self._publishers.values():
            post.repeat(TASK_INFO)
        if self._folder is not None:
            self._folder.cleanup()
