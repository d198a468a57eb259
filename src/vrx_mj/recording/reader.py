"""Reads a recording back: arrays to the last bit, also from a run that was killed."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.arguments import as_number, as_path, as_text
from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import RecordError, UnknownNameError, shown
from vrx_mj.recording.boat_sets import (
    COMPANIES,
    HUGE,
    BoatSet,
    all_rows,
    boat_set_numbers,
    head_of,
    joint_layout,
    read_boat_sets,
    sent_messages,
    sound_rows,
)
from vrx_mj.recording.packing import unpack_rows, unpacked
from vrx_mj.recording.readings import READING_COLUMNS, RecordedReadings
from vrx_mj.recording.record_scene import MovingBody, RecordedSensor, RowLayout
from vrx_mj.recording.rrd_file import Part, allowance, parsed_file
from vrx_mj.tasks.frame import Message

__all__ = ["FRAMES", "Event", "Record", "RecordedFrame", "SavedState", "Track", "read_readings", "read_record"]


RecordedFrame = tuple[int, FloatArray, tuple[Message, ...]]
"""Number of the boat set, the frame's row, and its messages."""


@dataclass(frozen=True)
class Event:
    """Something that happened."""

    time: float
    """Simulated time [s], to a nanosecond."""
    text: str
    """What happened, in words."""
    level: str
    """INFO, WARN or ERROR, as rerun has it."""


@dataclass(frozen=True)
class SavedState:
    """A state from which the run can go on."""

    time: float
    """Simulated time [s]."""
    blob: bytes
    """What `State.from_bytes` reads."""


@dataclass(frozen=True, eq=False)
class Track:
    """What one boat or object did, a row per recorded time; NaN while it was not there."""

    name: str
    """Name of the boat or object."""
    position: FloatArray
    """Positions (n, 3) [m, ENU]."""
    quaternion: FloatArray
    """Quaternions (n, 4): w, x, y, z."""
    velocity: FloatArray
    """Velocities (n, 3) of the body's origin, body axes [m/s]."""
    angular_velocity: FloatArray
    """Angular velocities (n, 3), body axes [rad/s]."""
    thrust: Mapping[str, FloatArray]
    """Thrusts (n,) by thruster [N]; empty for an object."""
    angle: Mapping[str, FloatArray]
    """Steering angle by thruster, (n,) [rad]."""


@dataclass(frozen=True, eq=False)
class Record:
    """A recording."""

    path: Path
    """The file that was read."""
    properties: Mapping[str, Any]
    """The run: world, fleet, seed, versions, platform."""
    companies: tuple[BoatSet, ...]
    """The boats that sailed together at first, and one more whenever one joined or left."""
    timestep: float
    """Physics step [s]."""
    wind_direction: tuple[float, float]
    """Unit vector the wind blows toward, east and north."""
    sensors: tuple[RecordedSensor, ...]
    """The sensors whose readings are recorded."""
    events: tuple[Event, ...]
    """What happened, in order of time."""
    states: tuple[SavedState, ...]
    """States from which the run can go on."""
    frames: tuple[RecordedFrame, ...]
    """What the referee of the world's task looked at: boat set, a row of `tasks.layout`, and what was sent with it."""
    layout: RowLayout
    """Which column of `rows` is what."""
    rows: FloatArray
    """Rows (n, columns) as they were; `layout.names()` names the columns. NaN while a body was not there."""
    row_companies: IntArray
    """(n,) numbers of the boat sets that the rows are of."""
    views: bytes
    """The blueprint, as the bytes of an `.rbl` file."""
    complete: bool
    """Whether the recording was closed; a killed run leaves one that was not."""
    has_views: bool
    """Whether the file opens with its views."""

    @property
    def time(self) -> FloatArray:
        """Simulated times (n,) [s]."""
        return self.rows[:, 0]

    @property
    def wind(self) -> FloatArray:
        """Wind speeds (n,) [m/s]."""
        return self.rows[:, 1]

    @cached_property
    def boats(self) -> Mapping[str, Track]:
        """What each boat did, by name."""
        return tracks(self.rows, self.layout, "boat")

    @cached_property
    def objects(self) -> Mapping[str, Track]:
        """What each object did, by name."""
        return tracks(self.rows, self.layout, "object")

    @cached_property
    def balls(self) -> Mapping[str, Track]:
        """Those of ball shooters, by `boat/shooter`; deep under water until they are shot."""
        return tracks(self.rows, self.layout, "ball")

    @property
    def files(self) -> Mapping[str, bytes]:
        """The saved form of the world that the recording begins in, by relative path."""
        return self.companies[0].files

    def sound(self) -> Record:
        """It without rows of a state that had diverged, as the last one of a run may be."""
        fine = sound_rows(self.rows, self.row_companies, [boat_set.layout for boat_set in self.companies])
        if fine.all():
            return self
        return replace(self, rows=self.rows[fine], row_companies=self.row_companies[fine])

    def state_at(self, time: float) -> SavedState:
        """The last state saved at or before `time` [s]."""
        moment = as_number(time)
        if math.isnan(moment):
            raise RecordError(f"invalid time {shown(time)}: a number of seconds is needed")
        before = [state for state in self.states if state.time <= moment + 1e-9]
        if not before:
            first = f"; the first is at {self.states[0].time:g} s" if self.states else ""
            raise RecordError(f"'{self.path}' has no state at or before {moment:g} s{first}")
        return before[-1]

    def readings(self, boat: str, sensor: str) -> RecordedReadings:
        """What a sensor measured, in the order of time.

        Raises:
            UnknownNameError: nothing of such a sensor was recorded.
            RecordError: the file is damaged.
        """
        known = {f"{one.boat}:{one.name}": one for one in self.sensors}
        for name in (boat, sensor):
            as_text("recorded sensor", name)
        if f"{boat}:{sensor}" not in known:
            raise UnknownNameError("recorded sensor", f"{boat}:{sensor}", known)
        (found,) = read_readings(self.path, [known[f"{boat}:{sensor}"]])
        return found


def read_record(path: str | Path, *, whole: bool = False) -> Record:
    """The recording in a file; with `whole`, all that is only for looking at was parsed too.

    The file is parsed in a process of its own, and all that is in it is checked: it may be damaged, or a stranger's.

    Raises:
        RecordError: the file is missing, not a recording, damaged, or of another version.
        CommandError: `path` is not a path.
    """
    file = as_path("path", path)
    parsed = parsed_file(file, COLUMNS, OURS, whole=whole)
    if not parsed.of(RUN):
        raise RecordError(f"'{file}' is not a recording of vrx_mj: it is a rerun file of something else")
    run, most = parsed.of(RUN)[0], allowance(file.stat().st_size)
    with damage_of(file):
        head = head_of(only(run.texts("head")))
        sha256, files = str(head.properties.get("world_sha256", "")), unpacked(only(run.blobs("files")), most)
        companies = read_boat_sets(BoatSet(head.layout, sha256, files), parsed.of(COMPANIES), most)
        layouts = [boat_set.layout for boat_set in companies]
        rows, numbers = all_rows(parsed.of("/record/rows"), layouts, most)
        layout = joint_layout(layouts)
        return Record(
            path=file,
            properties=head.properties,
            companies=companies,
            timestep=head.timestep,
            wind_direction=head.wind_direction,
            sensors=head.sensors,
            events=all_events(parsed.of("/events")),
            states=all_states(parsed.of("/record/states")),
            frames=read_frames(parsed.of(FRAMES), len(companies)),
            layout=layout,
            rows=rows,
            row_companies=numbers,
            views=only(run.blobs("views")),
            complete=parsed.footer,
            has_views=parsed.footer and parsed.views,
        )


RUN = "/record/run"
FRAMES = "/record/frames"
OURS = (RUN, "/record/rows", "/record/states", "/events", COMPANIES, FRAMES)
"""Entities that are read; all others are for looking at."""
COLUMNS = (
    "head", "files", "views", "block", "company", "time", "blob", "sent", "sim_time", "TextLog:text", "TextLog:level",
)  # fmt: skip
"""Their columns."""


@contextlib.contextmanager
def damage_of(file: Path) -> Iterator[None]:
    """Around the reading of what is in a file: an error names the file."""
    try:
        yield
    except RecordError as error:
        raise RecordError(f"'{file}' is damaged: {error}") from error


def only(cells: Sequence[Any]) -> Any:
    """The first of some cells.

    Raises:
        RecordError: the column is empty.
    """
    if not cells:
        raise RecordError(f"{RUN}: empty")
    return cells[0]


def read_readings(file: Path, sensors: Sequence[RecordedSensor]) -> list[RecordedReadings]:
    """The readings of each of some recorded sensors of a file.

    Raises:
        RecordError: the file is damaged.
    """
    parsed = parsed_file(file, [*READING_COLUMNS], [sensor.readings_path for sensor in sensors])
    with damage_of(file):
        return [RecordedReadings.of(sensor, parsed.of(sensor.readings_path)) for sensor in sensors]


def all_events(parts: Sequence[Part]) -> tuple[Event, ...]:
    """Events in the order of time."""
    events = [
        Event(time / 1e9, text, level)
        for part in parts
        for time, text, level in zip(
            part.numbers("sim_time", "i"), part.texts("TextLog:text"), part.texts("TextLog:level"), strict=True
        )
    ]
    return tuple(sorted(events, key=lambda event: event.time))


def all_states(parts: Sequence[Part]) -> tuple[SavedState, ...]:
    """States in the order of time."""
    states = [
        SavedState(time, blob)
        for part in parts
        for time, blob in zip(part.times("time"), part.blobs("blob"), strict=True)
    ]
    return tuple(sorted(states, key=lambda state: state.time))


def read_frames(parts: Sequence[Part], count: int) -> tuple[RecordedFrame, ...]:
    """Boat sets, of so many, rows and messages of all frames, in the order of time.

    Raises:
        RecordError: one is damaged.
    """
    found = [
        (boat_set, row, messages)
        for part in parts
        for boat_set, blob, sent in zip(
            boat_set_numbers(part, count), part.blobs("block"), part.texts("sent"), strict=True
        )
        for row, messages in _unpacked(blob, sent)
    ]
    return tuple(sorted(found, key=lambda frame: float(frame[1][0])))


def _unpacked(blob: bytes, sent: str) -> Iterator[tuple[FloatArray, tuple[Message, ...]]]:
    messages = {
        number: tuple(Message(topic, content) for topic, content in several) for number, several in sent_messages(sent)
    }
    rows = unpack_rows(blob)
    if not (np.abs(rows) < HUGE).all():
        raise RecordError(f"{FRAMES}: block: a number is not finite, or huge")
    for number, row in enumerate(rows):
        yield row, messages.get(number, ())


def tracks(rows: FloatArray, layout: RowLayout, kind: str) -> dict[str, Track]:
    """Tracks of the boats, or of the objects."""
    return {body.name: track(rows, layout, body) for body in layout.bodies if body.kind == kind}


def track(rows: FloatArray, layout: RowLayout, body: MovingBody) -> Track:
    """One body's columns."""
    pose, velocity = rows[:, layout.pose(body)], rows[:, layout.velocity(body)]
    mine = [(i, name) for i, (boat, name) in enumerate(layout.thrusters) if boat == body.name]
    thrust, angle = rows[:, layout.thrust], rows[:, layout.angle]
    return Track(
        name=body.name,
        position=pose[:, :3],
        quaternion=pose[:, 3:],
        velocity=to_body(pose[:, 3:], velocity[:, :3]),
        angular_velocity=velocity[:, 3:],
        thrust={name: thrust[:, i] for i, name in mine},
        angle={name: angle[:, i] for i, name in mine},
    )


def to_body(quaternion: FloatArray, vector: FloatArray) -> FloatArray:
    """World vectors (n, 3) in the axes of bodies turned by quaternions (n, 4)."""
    w, axis = quaternion[:, :1], -quaternion[:, 1:]
    twice = 2.0 * np.cross(axis, vector)
    return vector + w * twice + np.cross(axis, twice)
