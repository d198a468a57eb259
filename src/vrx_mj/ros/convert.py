"""Converts a recording to a bag: the topics of a served simulation for which the recording contains the data."""

import heapq
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, cast

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.errors import RecordError
from vrx_mj.frames import rotation_matrix
from vrx_mj.recording.boat_sets import BoatSet, columns_in
from vrx_mj.recording.reader import Event, Record, RecordedReadings, SavedState, read_readings, read_record
from vrx_mj.recording.simulation_scene import check_columns
from vrx_mj.ros.bags import COMMAND_TYPE, Bag
from vrx_mj.ros.interface import Output
from vrx_mj.ros.messages import Message, encode, new
from vrx_mj.ros.parameters import command_topic
from vrx_mj.ros.table import make_tables
from vrx_mj.ros.table.boats import description
from vrx_mj.ros.table.host import Bodies, Host, Scenery, odometry
from vrx_mj.runtime.observation import BoatObservation, Observation
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.state import State
from vrx_mj.runtime.timing import Schedule

_Progress = Callable[[float, float], None]
"""Takes the recorded time that is reached and that of the end [s]."""
_ROW_RATE = 1e3
"""Rate of `/clock` [Hz]: above that of rows, so that each row has one."""
_ODOMETRY, _ODOMETRY_RATE = "nav_msgs/Odometry", 10.0
"""Type of odometry, and its rate [Hz]."""
_P3D = "sensors/position/p3d_wamv"
"""VRX's topic of a boat's true position, for a boat without that sensor."""
_KEPT_SIMULATIONS = 2
"""Number of boat sets whose simulation is kept: rows and states of two alternate where boats come or go."""


def convert(source: str | Path, target: str | Path, progress: _Progress | None = None) -> int:
    """Write a recording into a bag; the number of its messages. `progress` is called at every row of the recording.

    Raises:
        RecordError: the source is not a recording, or the bag cannot be written.
    """
    recorded = read_record(source).without_divergence()
    bag = Bag(target)
    bag.start()
    try:
        return Conversion(recorded, bag).run(progress)
    finally:
        bag.close()


class Moment:
    """A moment of a recording: as much of a simulation as the outputs of the table ask of one.

    What does not move is asked of a simulation of the recorded world; so is the task, of the last saved state,
    and before the first of that one.
    """

    def __init__(self, recorded: Record, boat_set: BoatSet) -> None:
        """Begin with the boat set's world, before any row."""
        self.layout, self.time, self.data = boat_set.layout, 0.0, SimpleNamespace()
        self.columns = columns_in(recorded.layout, boat_set.layout)
        east, north = recorded.wind_direction
        self.wind = SimpleNamespace(speed=0.0, direction=math.atan2(north, east))
        self._sim = Simulation(boat_set.world)
        check_columns(boat_set, self._sim.model)
        self._thrusters = {boat: self._sim.observe()[boat].thrusters for boat in self._sim.boats}
        self._row = self._sim.row()
        self.show(self._row)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._sim, name)

    def show(self, row: FloatArray) -> None:
        """Go to the moment of a row in the boat set's columns."""
        self._row, self.time, self.wind.speed = row, float(row[0]), float(row[1])
        self.data = SimpleNamespace(qpos=row[self.layout.qpos], qvel=row[self.layout.qvel], time=self.time)

    def observe(self) -> Observation:
        """The boats as the row has them; what else is observed is of the last saved state."""
        seen = self._sim.observe()
        hulls = zip(self._sim.boats, self._sim.world.parameters.hulls, strict=True)
        return Observation([(boat, self._with_motion(seen[boat], hull.joint)) for boat, hull in hulls], seen.task)

    def resume(self, saved: SavedState) -> None:
        """Set the task to a saved state."""
        self._sim.set_state(State.from_bytes(saved.blob))

    def steering(self, boat: str) -> dict[str, float]:
        """How far each of a boat's engines and rudders is turned [rad]."""
        return self._engines(boat, self.layout.angle)

    def thrust(self, boat: str) -> dict[str, float]:
        """Force of each of a boat's engines and rudders [N]."""
        return self._engines(boat, self.layout.thrust)

    def commands(self, boat: str) -> Iterator[tuple[str, float]]:
        """Commands that would have made a boat's engines push and turn as they did."""
        thrust, angle = self.thrust(boat), self.steering(boat)
        for name in self._sim.command_names(boat):
            if name.endswith(ANGLE_SUFFIX):
                yield name, angle[name.removesuffix(ANGLE_SUFFIX)]
            elif name in self._thrusters[boat]:
                yield name, self._thrusters[boat][name].command(thrust[name])

    def _with_motion(self, seen: BoatObservation, joint: str) -> BoatObservation:
        """An observation of a boat with the pose and velocity that the row has for its free joint."""
        axes = self._sim.model.joint(joint)
        qpos, dof = int(axes.qposadr[0]), int(axes.dofadr[0])
        pose, motion = self.data.qpos[qpos : qpos + 7].copy(), self.data.qvel[dof : dof + 6].copy()
        linear = rotation_matrix(pose[3:]).T @ motion[:3]
        return replace(seen, position=pose[:3], quaternion=pose[3:], velocity=linear, angular_velocity=motion[3:])

    def _engines(self, boat: str, columns: slice) -> dict[str, float]:
        values = self._row[columns]
        return {name: float(values[i]) for i, (owner, name) in enumerate(self.layout.thrusters) if owner == boat}


class RecordingHost:
    """A host whose table has outputs only: nothing commands a recording."""

    cmd_vel, truth, paused = "thrust", True, True

    def __init__(self, sim: Simulation, bodies: Bodies, scenery: Scenery) -> None:
        self.sim, self.bodies, self.scenery = sim, bodies, scenery

    def __getattr__(self, name: str) -> Any:
        def never(*_arguments: object) -> Any:
            raise AssertionError(f"a recording cannot {name}")

        return never

    def description(self, boat: str) -> str:
        """A boat's URDF; a VrxError where the files that it was made of are not here."""
        return description(self.sim.world, boat)

    def further(self, _boat: str) -> Sequence[Output]:
        """A recording has no other topics."""
        return ()


class SegmentOutputs(NamedTuple):
    """The topics of a recording while its bodies are the same."""

    moment: Moment
    bodies: Bodies
    moving: Sequence[Output]
    """Made of rows."""
    saved: Sequence[Output]
    """Made of saved states."""
    measured: Mapping[tuple[str, str], Sequence[Output]]
    """Topics made of readings, by boat and sensor."""
    places: Mapping[str, str]
    """Topics of where a boat is and how it moves, of boats whose own sensor for that was not recorded."""


class Conversion:
    """Writes a recording into a bag."""

    def __init__(self, recorded: Record, bag: Bag) -> None:
        self._recorded, self._bag = recorded, bag
        self._boat_sets = {one.layout: one for one in recorded.companies[::-1]}
        """Boat sets by their layouts: those of one layout have the same outputs."""
        self._known: dict[str, SegmentOutputs] = {}
        self._schedule = Schedule()
        self._last: dict[str, bytes] = {}
        self._count = 0

    def run(self, progress: _Progress | None = None) -> int:
        """Write all in the order of time; the number of messages."""
        recorded = self._recorded
        end = float(recorded.time[-1]) if len(recorded.time) else 0.0
        rows = zip(recorded.row_companies.tolist(), recorded.rows, strict=True)
        readings = read_readings(recorded.path, recorded.sensors) if recorded.sensors else ()
        streams: list[Iterator[tuple[float, int, int, Callable[[float], None]]]] = [
            ((float(row[0]), 0, i, partial(self._write_row, number, row)) for i, (number, row) in enumerate(rows)),
            ((saved.time, 1, i, partial(self._write_state, saved)) for i, saved in enumerate(recorded.states)),
            *(self._readings(number, found) for number, found in enumerate(readings, 2)),
            ((event.time, 1 << 20, i, partial(self._log, event)) for i, event in enumerate(recorded.events)),
        ]
        for time, _, _, write in heapq.merge(*streams, key=lambda item: item[:3]):
            write(time)
            if progress is not None:
                progress(time, end)
        return self._count

    def _readings(
        self, number: int, readings: RecordedReadings
    ) -> Iterator[tuple[float, int, int, Callable[[float], None]]]:
        for i, time in enumerate(readings.time):
            yield float(time), number, i, partial(self._write_reading, readings, i)

    def _log(self, event: Event, _time: float) -> None:
        self._bag.log(event.level, event.text)

    def _write_row(self, number: int, row: FloatArray, time: float) -> None:
        segment = self._segment(self._boat_sets[self._recorded.companies[number].layout])
        segment.moment.show(row[segment.moment.columns])
        for output in segment.moving:
            self._output(output, time)
        for boat, topic in segment.places.items():
            if self._schedule.take(topic, _ODOMETRY_RATE, time):
                self._write(topic, _ODOMETRY, _odometry(segment.bodies, boat, time), time)
        for boat in segment.moment.boats:
            for name, value in segment.moment.commands(boat):
                self._write(command_topic(boat, name), COMMAND_TYPE, new(COMMAND_TYPE, data=value), time)

    def _write_state(self, saved: SavedState, time: float) -> None:
        world = State.from_bytes(saved.blob).world
        boat_set = next((one for one in self._recorded.companies if one.world_sha256 == world), None)
        if boat_set is None:
            raise RecordError(f"'{self._recorded.path}' is damaged: its state at {time:g} s belongs to another world")
        segment = self._segment(boat_set)
        segment.moment.resume(saved)
        before, segment.moment.time = segment.moment.time, time
        for output in segment.saved:
            self._output(output, time)
        segment.moment.time = before

    def _write_reading(self, readings: RecordedReadings, i: int, time: float) -> None:
        key, reading = (readings.sensor.boat, readings.sensor.name), readings[i]
        segment = next((segment for segment in reversed(self._known.values()) if key in segment.measured), None)
        for output in segment.measured[key] if segment else ():
            message = output.make(reading)
            if message is not None:
                self._write(output.name, output.type, message, time, latched=output.latched)

    def _output(self, output: Output, time: float) -> None:
        """Write an output if it is due; one without a rate, if it is new."""
        if output.rate > 0.0 and not self._schedule.take(output.name, output.rate, time):
            return
        message = output.make()
        if message is None:
            return
        if output.rate == 0.0:
            raw = encode(message, output.type)
            if self._last.get(output.name) == raw:
                return
            self._last[output.name] = raw
        self._write(output.name, output.type, message, time, latched=output.latched)

    def _write(self, topic: str, kind: str, message: Message, time: float, *, latched: bool = False) -> None:
        self._bag.write(topic, kind, message, time, latched=latched)
        self._count += 1

    def _segment(self, boat_set: BoatSet) -> SegmentOutputs:
        """The topics while this boat set sails."""
        name = boat_set.world_sha256
        segment = self._known.pop(name, None) or _outputs_of(self._recorded, boat_set)
        self._known[name] = segment
        while len(self._known) > _KEPT_SIMULATIONS:
            del self._known[next(iter(self._known))]
        return segment


def _outputs_of(recorded: Record, boat_set: BoatSet) -> SegmentOutputs:
    """The topics of a boat set, by where their messages come from."""
    moment = Moment(recorded, boat_set)
    own = (state for state in recorded.states if State.from_bytes(state.blob).world == boat_set.world_sha256)
    if first := next(own, None):  # what the run's seed draws holds from the first row on
        moment.resume(first)
    sim = cast("Simulation", moment)
    bodies = Bodies(sim)
    host = RecordingHost(sim, bodies, Scenery(recorded.parameters, recorded.boats))
    outputs = make_tables(cast("Host", host), clock_rate=_ROW_RATE)["vrx"].outputs.values()
    there = {(boat, sensor.name) for boat in sim.boats for sensor in sim.mounted(boat)}
    recorded_ones = [(one.boat, one.name) for one in recorded.sensors]
    measured: dict[tuple[str, str], list[Output]] = {key: [] for key in recorded_ones if key in there}
    places = {boat: f"/{boat}/{_P3D}" for boat in sim.boats}
    for output in outputs:
        if output.sensor is not None:
            boat = output.sensor[0]
            if output.sensor in measured:
                measured[output.sensor].append(output)
            if output.type == _ODOMETRY:
                places[boat] = output.name
    known = {output.name for several in measured.values() for output in several}
    places = {boat: topic for boat, topic in places.items() if topic not in known}
    unmeasured = [output for output in outputs if output.sensor is None]
    moving = [output for output in unmeasured if output.recorded == "rows"]
    saved = [output for output in unmeasured if output.recorded == "states"]
    return SegmentOutputs(moment, bodies, moving, saved, measured, places)


def _odometry(bodies: Bodies, boat: str, time: float) -> Message:
    """nav_msgs/Odometry as VRX's P3D publishes it: of `base_link` in `map`, velocities in the axes of the world."""
    placed = bodies.model(boat)
    return odometry(time, f"{boat}/base_link", placed.position, placed.quaternion, placed.velocity, placed.spin)
