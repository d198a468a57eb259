"""Reads a recording back: arrays to the last bit, also from a run that was killed."""

from __future__ import annotations

import contextlib
import json
import math
import struct
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.adapters.record.companies import COMPANIES, Company, all_rows, joint_layout, read_companies, unpacked
from vrx_mj.adapters.record.officiated import FRAMES, Found, read_frames
from vrx_mj.adapters.record.readings import RecordedReadings
from vrx_mj.adapters.record.scene import FORMAT, MovingBody, RecordedSensor, RowLayout
from vrx_mj.arguments import as_number, as_path, as_text
from vrx_mj.errors import RecordError, UnknownNameError, shown

__all__ = ["Event", "Record", "SavedState", "Track", "read_record"]

FloatArray = npt.NDArray[np.float64]


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
    """(n, 3) [m, ENU]."""
    quaternion: FloatArray
    """(n, 4): w, x, y, z."""
    velocity: FloatArray
    """(n, 3) [m/s], of the body's origin, body axes."""
    angular_velocity: FloatArray
    """(n, 3) [rad/s], body axes."""
    thrust: Mapping[str, FloatArray]
    """By thruster, (n,) [N]; empty for an object."""
    angle: Mapping[str, FloatArray]
    """Steering angle by thruster, (n,) [rad]."""


@dataclass(frozen=True, eq=False)
class Record:
    """A recording."""

    path: Path
    """The file that was read."""
    properties: Mapping[str, Any]
    """The run: world, fleet, seed, versions, platform."""
    companies: tuple[Company, ...]
    """The boats that sailed together at first, and one more whenever one joined or left."""
    timestep: float
    """Physics step [s]."""
    time: FloatArray
    """(n,) simulated time [s]."""
    wind: FloatArray
    """(n,) wind speed [m/s]."""
    wind_direction: tuple[float, float]
    """Unit vector the wind blows toward, east and north."""
    boats: Mapping[str, Track]
    """What each boat did, by name."""
    objects: Mapping[str, Track]
    """What each object did, by name."""
    balls: Mapping[str, Track]
    """Those of ball shooters, by `boat/shooter`; deep under water until they are shot."""
    sensors: tuple[RecordedSensor, ...]
    """The sensors whose readings are recorded."""
    events: tuple[Event, ...]
    """What happened, in order of time."""
    states: tuple[SavedState, ...]
    """States from which the run can go on."""
    frames: tuple[Found, ...]
    """What the referee of the world's task looked at: company, a row of `tasks.layout`, and what was sent with it."""
    layout: RowLayout
    """Which column of `rows` is what."""
    rows: FloatArray
    """(n, columns): everything recorded, as it was; `layout.names()` names the columns. NaN of who was not there."""
    row_companies: npt.NDArray[np.int64]
    """(n,) numbers of the companies that the rows are of."""
    views: bytes
    """The blueprint, as the bytes of an `.rbl` file."""
    complete: bool
    """Whether the recording was closed; a killed run leaves one that was not."""

    @property
    def files(self) -> Mapping[str, bytes]:
        """The saved form of the world that the recording begins in, by relative path."""
        return self.companies[0].files

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
        """
        known = {f"{one.boat}:{one.name}": one for one in self.sensors}
        for name in (boat, sensor):
            as_text("recorded sensor", name)
        if f"{boat}:{sensor}" not in known:
            raise UnknownNameError("recorded sensor", f"{boat}:{sensor}", known)
        return read_readings(self.path, known[f"{boat}:{sensor}"])


def read_record(path: str | Path) -> Record:
    """The recording in a file.

    Raises:
        RecordError: it is no recording, or cannot be read.
        CommandError: `path` is no path.
    """
    file = as_path("path", path)
    parts, complete = read_parts(file)
    if "/record/run" not in parts:
        raise RecordError(f"'{file}' is not a recording of vrx_mj: it is a rerun file of something else")
    run = parts["/record/run"][0]
    head = json.loads(run["head"][0][0])
    if head["format"] != FORMAT:
        raise RecordError(f"'{file}' is a recording of format {head['format']}; this version reads {FORMAT}")
    sha256, files = head["properties"].get("world_sha256", ""), unpacked(run["files"][0][0])
    first = Company(RowLayout.from_json(head["layout"]), sha256, files)
    companies = read_companies(first, parts.get(COMPANIES, []))
    layouts = [company.layout for company in companies]
    rows, numbers = all_rows(parts.get("/record/rows", []), layouts)
    layout = joint_layout(layouts)
    return Record(
        path=file,
        properties=head["properties"],
        companies=companies,
        timestep=head["timestep"],
        time=rows[:, 0],
        wind=rows[:, 1],
        wind_direction=tuple(head["wind_direction"]),
        boats=tracks(rows, layout, "boat"),
        objects=tracks(rows, layout, "object"),
        balls=tracks(rows, layout, "ball"),
        sensors=tuple(RecordedSensor.from_json(tree) for tree in head.get("sensors", ())),
        events=all_events(parts.get("/events", [])),
        states=all_states(parts.get("/record/states", [])),
        frames=read_frames(parts.get(FRAMES, [])),
        layout=layout,
        rows=rows,
        row_companies=numbers,
        views=run["views"][0][0],
        complete=complete,
    )


OURS = ("/record/run", "/record/rows", "/record/states", "/events", COMPANIES, FRAMES)
"""Entities that are read; all others are for looking at."""


def read_readings(file: Path, sensor: RecordedSensor) -> RecordedReadings:
    """The readings of a recorded sensor."""
    names = READING_COLUMNS
    found: dict[str, list[Any]] = {"time": [], "sequence": []}
    with whole_file(file) as whole:
        try:
            for chunk in chunks_of(whole, sensor.readings_path):
                batch = chunk.to_record_batch()
                for column in (name for name in batch.schema.names if name in names and not chunk.is_static):
                    found.setdefault(names[column], []).extend(lists_of(batch.column(column)))
        except RuntimeError as error:  # it grew, or changed, while it was read
            raise RecordError(f"'{file}' cannot be read: {first_line(error)}") from error
    return RecordedReadings(sensor, found)


READING_COLUMNS = {
    "time": "time",
    "sequence": "sequence",
    "numbers": "numbers",
    "intensity": "intensity",
    "ring": "ring",
    "EncodedImage:blob": "blob",
    "Points3D:positions": "points",
}
"""Columns of a recording that give readings back, and what they hold."""


def lists_of(column: Any) -> Iterator[Any]:
    """An array for every row of a column of lists; of bytes where the list has one block of bytes."""
    for row in column:
        values = row.values
        if hasattr(values[0] if len(values) else None, "as_buffer"):
            yield np.frombuffer(values[0].as_buffer(), np.uint8)
            continue
        while values.type.num_fields:  # points are lists of three, pictures lists of bytes
            values = values.flatten()
        yield values.to_numpy(zero_copy_only=False)


def read_parts(file: Path) -> tuple[dict[str, list[dict[str, Any]]], bool]:
    """Columns of our entities, a dict per chunk, and whether the file is complete."""
    from rerun_bindings import check_for_rrd_footer

    try:
        with whole_file(file) as whole:
            return collected(whole), whole == file and bool(check_for_rrd_footer(str(file)))
    except (ValueError, OSError, RuntimeError) as error:
        raise RecordError(f"'{file}' is not a recording of vrx_mj: {first_line(error)}") from error


def collected(file: Path) -> dict[str, list[dict[str, Any]]]:
    """Columns of our entities, a dict per chunk."""
    parts: dict[str, list[dict[str, Any]]] = {}
    for chunk in chunks_of(file, *OURS):
        parts.setdefault(chunk.entity_path, []).append(chunk.to_record_batch().to_pydict())
    return parts


def chunks_of(file: Path, *entities: str) -> Iterator[Any]:
    """Chunks of some entities."""
    from rerun.chunk import RrdReader

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a file without its table of contents is what a killed run leaves
        yield from RrdReader(file).stream().filter(content=[f"+ {path}" for path in entities])


@contextlib.contextmanager
def whole_file(file: Path) -> Iterator[Path]:
    """`file`, or a copy without its last message where that was cut in the middle."""
    if not file.is_file():
        raise RecordError(f"no recording '{file}'")
    whole, size = whole_bytes(file), file.stat().st_size
    if whole == size:
        yield file
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "whole.rrd"
        with file.open("rb") as source, copy.open("wb") as target:
            target.write(source.read(whole))
        yield copy


FILE_HEADER = 12
"""Bytes before the first message of an rrd file: its mark, version and options."""
MESSAGE_HEADER = struct.Struct("<QQ")
"""Kind and length of a message; kind 0 ends a file."""


def whole_bytes(file: Path) -> int:
    """Length of `file` up to the end of its last whole message; all of it if complete or no rrd file."""
    size = file.stat().st_size
    with file.open("rb") as stream:
        if stream.read(4) != b"RRF2":
            return size
        end = FILE_HEADER
        while end < size:
            stream.seek(end)
            header = stream.read(MESSAGE_HEADER.size)
            if len(header) < MESSAGE_HEADER.size:
                return end
            kind, length = MESSAGE_HEADER.unpack(header)
            if end + MESSAGE_HEADER.size + length > size:
                return end
            if kind == 0:
                return size
            end += MESSAGE_HEADER.size + length
    return size


def first_line(error: BaseException) -> str:
    """What an error says, in one line."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


def all_events(parts: Sequence[Mapping[str, Any]]) -> tuple[Event, ...]:
    """Events in the order of time."""
    events = [
        Event(time.total_seconds(), text[0], level[0])
        for part in parts
        for time, text, level in zip(part["sim_time"], part["TextLog:text"], part["TextLog:level"], strict=True)
    ]
    return tuple(sorted(events, key=lambda event: event.time))


def all_states(parts: Sequence[Mapping[str, Any]]) -> tuple[SavedState, ...]:
    """States in the order of time."""
    states = [
        SavedState(time[0], blob[0]) for part in parts for time, blob in zip(part["time"], part["blob"], strict=True)
    ]
    return tuple(sorted(states, key=lambda state: state.time))


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
