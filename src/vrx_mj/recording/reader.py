"""Read a recording back: arrays to the last bit, also from a run that was killed, and readings of sensors."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, starmap
from pathlib import Path
from typing import Any, Self, overload

import numpy as np
from pydantic import ValidationError

from vrx_mj.arguments import as_flag, as_number, as_path, as_text, check_name
from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.errors import RecordError, quote, warn
from vrx_mj.frames import in_world_axes
from vrx_mj.model.world import Parameters, other_physics
from vrx_mj.recording.boat_sets import (
    MAX_NUMBER,
    BoatSet,
    Head,
    SentMessages,
    all_rows,
    head_of,
    joint_layout,
    numbered_blocks,
    parsed_json,
    read_boat_sets,
    sound_rows,
)
from vrx_mj.recording.parts import (
    COMPANIES,
    EVENTS,
    FRAMES,
    ROWS,
    RUN,
    STATES,
    Part,
    allowance,
    parsed_file,
    unpack_files,
    validator,
)
from vrx_mj.recording.record_scene import MovingBody, RecordedSensor, RowLayout
from vrx_mj.runtime.subscriptions import Touch
from vrx_mj.sensors import SENSOR_KINDS
from vrx_mj.sensors.readings import Image, PointCloud, Reading
from vrx_mj.sensors.view import intrinsics
from vrx_mj.tasks.referee import Message

RecordedFrame = tuple[int, FloatArray, tuple[Message, ...]]
"""Number of the boat set, the frame's row, and its messages."""
READ_ENTITIES = (RUN, ROWS, STATES, EVENTS, COMPANIES, FRAMES)
"""Entities that are read; all others are for looking at."""
READ_COLUMNS = (
    "head", "files", "block", "company", "time", "blob", "sent", "sim_time", "TextLog:text", "TextLog:level",
    "touch",
)  # fmt: skip
"""Columns of these entities that are read."""
_READING_CELLS: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "camera": {"blob": ("EncodedImage:blob", "|u1")},
    "points": {"points": ("Points3D:positions", "<f4"), "intensity": ("intensity", "|u1"), "ring": ("ring", "|u1")},
    "numbers": {"numbers": ("numbers", "|u1")},
}
"""Columns of the data of readings, by their form: name, column and kind of numbers."""
READING_COLUMNS = ("time", "sequence", *{name for cells in _READING_CELLS.values() for name, _ in cells.values()})
"""Columns of a recording that give readings back."""


@dataclass(frozen=True)
class Event:
    """Something that happened."""

    time: float
    """Simulated time [s], to a nanosecond."""
    text: str
    """Description of the event."""
    level: str
    """INFO, WARN or ERROR, as rerun has it."""
    touch: Touch | None = None
    """The touch of a boat that it is about."""


@dataclass(frozen=True)
class SavedState:
    """A state from which the run can go on."""

    time: float
    """Simulated time [s]."""
    blob: bytes
    """The state as bytes, for `State.from_bytes`."""


@dataclass(frozen=True, eq=False)
class Track:
    """Motion of one boat or object: a row per recorded time, NaN while it was absent."""

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


@dataclass(frozen=True, eq=False, kw_only=True)
class Record(Head):
    """Content of a recording: its header and all recorded data."""

    path: Path
    """The file that was read."""
    companies: tuple[BoatSet, ...]
    """The boat sets: the first, and one for each time that a boat joined or left."""
    events: tuple[Event, ...]
    """Events in order of time."""
    states: tuple[SavedState, ...]
    """States from which the run can go on."""
    frames: tuple[RecordedFrame, ...]
    """Frames of the referee of the world's task: boat set, a row of `tasks.layout`, and what was sent with it."""
    rows: FloatArray
    """Recorded rows, (n, columns); `layout.names()` names the columns. NaN while a body was absent."""
    row_companies: IntArray
    """Number of the boat set of each row, (n,)."""
    complete: bool
    """Whether the recording was closed; False if its run was killed."""
    has_views: bool
    """Whether the file opens with its views."""

    @property
    def physics_version(self) -> object:
        """`constants.PHYSICS_VERSION` of the run; 1 if the file does not give it."""
        return self.properties.get("physics_version", 1)

    def warn_of_physics(self) -> None:
        """Warn if the run used another version of the physics than this one."""
        if other := other_physics(self.physics_version):
            warn(f"'{self.path}' is {other}", 3)

    @property
    def time(self) -> FloatArray:
        """Simulated times (n,) [s]."""
        return self.rows[:, 0]

    @property
    def wind(self) -> FloatArray:
        """Wind speeds (n,) [m/s]."""
        return self.rows[:, 1]

    @property
    def wind_angle(self) -> FloatArray:
        """Angle of the wind off `wind_direction` at each time, (n,) [rad], counter-clockwise; 0 unless it turns."""
        angles: FloatArray = self.rows[:, self.layout.wind_angle].sum(axis=1)
        return angles

    @cached_property
    def boats(self) -> Mapping[str, Track]:
        """Track of each boat, by name."""
        return self._tracks("boat")

    @cached_property
    def objects(self) -> Mapping[str, Track]:
        """Track of each object, by name."""
        return self._tracks("object")

    @cached_property
    def balls(self) -> Mapping[str, Track]:
        """Track of each ball, by `boat/shooter`; it is deep under water until it is shot."""
        return self._tracks("ball")

    def _tracks(self, kind: str) -> dict[str, Track]:
        return {body.name: _track(self.rows, self.layout, body) for body in self.layout.bodies if body.kind == kind}

    @property
    def parameters(self) -> Parameters:
        """The parameters of the world that the recording begins in."""
        return self.companies[0].world.parameters

    @property
    def files(self) -> Mapping[str, bytes]:
        """The saved form of the world that the recording begins in, by relative path."""
        return self.companies[0].files

    def without_divergence(self) -> Record:
        """The recording without rows of a diverged state, such as the last one of a run."""
        fine = sound_rows(self.rows, self.row_companies, [boat_set.layout for boat_set in self.companies])
        if fine.all():
            return self
        return replace(self, rows=self.rows[fine], row_companies=self.row_companies[fine])

    def state_at(self, time: float) -> SavedState:
        """The last state saved at or before `time` [s]."""
        moment = as_number(time)
        if math.isnan(moment):
            raise RecordError(f"invalid time {quote(time)}: a number of seconds is needed")
        before = [state for state in self.states if state.time <= moment + 1e-9]
        if not before:
            first = f"; the first is at {self.states[0].time:g} s" if self.states else ""
            raise RecordError(f"'{self.path}' has no state at or before {moment:g} s{first}")
        return before[-1]

    def readings(self, boat: str, sensor: str) -> RecordedReadings:
        """Readings of a sensor, in order of time.

        Raises:
            UnknownNameError: nothing of such a sensor was recorded.
            RecordError: the file is damaged.
        """
        known = {f"{one.boat}:{one.name}": one for one in self.sensors}
        for name in (boat, sensor):
            as_text("recorded sensor", name)
        check_name("recorded sensor", f"{boat}:{sensor}", known)
        (found,) = read_readings(self.path, [known[f"{boat}:{sensor}"]])
        return found


def read_record(path: str | Path, *, whole: bool = False) -> Record:
    """The recording in a file; with `whole`, the parts that only viewers need are parsed too.

    The file is parsed in a process of its own, and all that is in it is checked: it may be damaged, or a stranger's.

    Raises:
        RecordError: the file is missing, not a recording, damaged, or of another version.
        CommandError: `path` is not a path.
    """
    file = as_path("path", path)
    parsed = parsed_file(file, READ_COLUMNS, READ_ENTITIES, whole=as_flag("whole", whole))
    if not parsed.of(RUN):
        raise RecordError(f"'{file}' is not a recording of vrx_mj: it is a rerun file of something else")
    run, most = parsed.of(RUN)[0], allowance(file.stat().st_size)
    with _damage_of(file):
        heads, blobs = run.texts("head"), run.blobs("files")
        if not heads or not blobs:
            raise RecordError(f"{RUN}: empty")
        head, files = head_of(heads[0]), unpack_files(blobs[0], most)
        sha256 = str(head.properties.get("world_sha256", ""))
        companies = read_boat_sets(BoatSet(head.layout, sha256, files), parsed.of(COMPANIES), most)
        layouts = [boat_set.layout for boat_set in companies]
        rows, numbers = all_rows(parsed.of(ROWS), layouts, most)
        frames = read_frames(parsed.of(FRAMES), len(companies), most)
        if not all((np.abs(row) < MAX_NUMBER).all() for _, row, _ in frames):
            raise RecordError(f"{FRAMES}: block: a number is not finite, or huge")
        return Record(
            **{**vars(head), "layout": joint_layout(layouts)},
            path=file,
            companies=companies,
            events=all_events(parsed.of(EVENTS)),
            states=all_states(parsed.of(STATES)),
            frames=frames,
            rows=rows,
            row_companies=numbers,
            complete=parsed.footer,
            has_views=parsed.views,
        )


@contextlib.contextmanager
def _damage_of(file: Path) -> Iterator[None]:
    """Around the reading of what is in a file: an error names the file."""
    try:
        yield
    except RecordError as error:
        raise RecordError(f"'{file}' is damaged: {error}") from error


def read_readings(file: Path, sensors: Sequence[RecordedSensor]) -> list[RecordedReadings]:
    """The readings of each of some recorded sensors of a file.

    Raises:
        RecordError: the file is damaged.
    """
    parsed = parsed_file(file, READING_COLUMNS, [sensor.readings_path for sensor in sensors])
    with _damage_of(file):
        return [RecordedReadings.of(sensor, parsed.of(sensor.readings_path)) for sensor in sensors]


def all_events(parts: Sequence[Part]) -> tuple[Event, ...]:
    """Events in the order of time.

    Raises:
        RecordError: one is damaged.
    """
    return tuple(sorted(chain.from_iterable(map(_events, parts)), key=lambda event: event.time))


def _events(part: Part) -> Iterator[Event]:
    times, texts = part.numbers("sim_time", "i"), part.texts("TextLog:text")
    for time, text, level, touch in zip(times, texts, part.texts("TextLog:level"), part.texts("touch"), strict=True):
        try:
            yield Event(time / 1e9, text, level, validator(Touch).validate_json(touch) if touch else None)
        except ValidationError as error:
            raise RecordError(f"{EVENTS}: touch: {error.errors()[0]['msg']}") from None


def all_states(parts: Sequence[Part]) -> tuple[SavedState, ...]:
    """States in the order of time."""
    pairs = chain.from_iterable(zip(part.times("time"), part.blobs("blob"), strict=True) for part in parts)
    return tuple(sorted(starmap(SavedState, pairs), key=lambda state: state.time))


def read_frames(parts: Sequence[Part], count: int, most: int) -> tuple[RecordedFrame, ...]:
    """Boat sets, of so many, rows and messages of all frames, in the order of time; `most`: bytes of the rows.

    Raises:
        RecordError: one is damaged.
    """
    found: list[RecordedFrame] = []
    texts = [text for part in parts for text in part.texts("sent")]
    for (boat_set, rows), text in zip(numbered_blocks(parts, count, most), texts, strict=True):
        messages = parsed_json(SentMessages, "sent", text)
        sent = {number: tuple(Message(*one) for one in several) for number, several in messages}
        found += [(boat_set, row, sent.get(number, ())) for number, row in enumerate(rows)]
    return tuple(sorted(found, key=lambda frame: float(frame[1][0])))


def _track(rows: FloatArray, layout: RowLayout, body: MovingBody) -> Track:
    """One body's columns."""
    pose, velocity = rows[:, layout.pose(body)], rows[:, layout.velocity(body)]
    mine = [(i, name) for i, (boat, name) in enumerate(layout.thrusters) if boat == body.name]
    thrust, angle = rows[:, layout.thrust], rows[:, layout.angle]
    return Track(
        name=body.name,
        position=pose[:, :3],
        quaternion=pose[:, 3:],
        velocity=in_world_axes(pose[:, 3:] * (1.0, -1.0, -1.0, -1.0), velocity[:, :3]),
        angular_velocity=velocity[:, 3:],
        thrust={name: thrust[:, i] for i, name in mine},
        angle={name: angle[:, i] for i, name in mine},
    )


class RecordedReadings(Sequence[Reading]):
    """The readings of one sensor in the order of time, each made when it is looked up.

    They equal those of `Simulation.sense` to the last bit, but for pictures, which are JPEG.
    """

    def __init__(self, sensor: RecordedSensor, columns: Mapping[str, Sequence[object]]) -> None:
        """Take arrays for every reading: `time`, `sequence`, and what gives its data.

        That is the bytes `blob`, or the numbers `points` with the bytes `intensity` and `ring`, or the bytes `numbers`.
        """
        self.sensor = sensor
        """The sensor that measured."""
        time = np.array(columns["time"], np.float64).reshape(-1)
        self._order = np.argsort(time, kind="stable")
        self.time: FloatArray = time[self._order]
        """Times (n,) of the measurements [s]."""
        self.sequence = np.array(columns["sequence"], np.int64).reshape(-1)[self._order]
        """Sequence numbers (n,) of the readings."""
        self._columns = columns

    @classmethod
    def of(cls, sensor: RecordedSensor, parts: Sequence[Part]) -> Self:
        """The readings in the chunks of a sensor's entity.

        Raises:
            RecordError: they do not hold readings of such a sensor.
        """
        wanted = _READING_CELLS["camera" if sensor.type == "camera" else "points" if sensor.gives_points else "numbers"]
        columns: dict[str, list[Any]] = {name: [] for name in ("time", "sequence", *wanted)}
        for part in (one for one in parts if not one.static and "time" in one.columns):  # others are shown of them
            found: dict[str, list[Any]] = {"time": part.times("time"), "sequence": part.numbers("sequence", "i")}
            found |= {name: part.arrays(*cells) for name, cells in wanted.items()}
            if len(set(map(len, found.values()))) > 1:
                raise RecordError(f"{part.entity}: columns of unequal length")
            for name, values in found.items():
                columns[name] += values
        _check_readings(sensor, columns)
        return cls(sensor, columns)

    def __len__(self) -> int:
        return len(self.time)

    def pictures(self) -> list[ByteArray]:
        """The JPEG files of a camera."""
        return [self._columns["blob"][index] for index in self._order]

    @overload
    def __getitem__(self, index: int) -> Reading: ...

    @overload
    def __getitem__(self, index: slice) -> list[Reading]: ...

    def __getitem__(self, index: int | slice) -> Reading | list[Reading]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        row = {name: values[self._order[index]] for name, values in self._columns.items()}
        time, sequence, sensor = float(self.time[index]), int(self.sequence[index]), self.sensor
        return Reading(sensor.name, sensor.type, time, sequence, sensor.frame, self._data(row))

    def _data(self, row: Mapping[str, Any]) -> Any:
        """Data of the sensor's reading, from a row of its columns."""
        numbers = SENSOR_KINDS[self.sensor.type].numbers
        if numbers is None:
            camera = self.sensor.config
            assert isinstance(camera, CameraConfig), f"{self.sensor.type}: held as pictures"
            return Image(decode_jpeg(row["blob"], (camera.width, camera.height)), intrinsics(camera))
        if "points" in row:
            return PointCloud(row["points"].reshape(-1, 3), row["intensity"].view("<f4"), row["ring"].view("<u2"))
        return numbers.data(row["numbers"].view("<f8"), self.sensor.config)


def _check_readings(sensor: RecordedSensor, columns: Mapping[str, Sequence[Any]]) -> None:
    """Check that these are columns of readings of a sensor.

    Raises:
        RecordError: they are not.
    """
    if not all(0 <= number < 1 << 32 for number in columns["sequence"]):
        raise RecordError(f"{sensor.readings_path}: sequence: a whole number from 0 is needed")
    if "points" in columns:
        for one, other, third in zip(columns["points"], columns["intensity"], columns["ring"], strict=True):
            if not 4 * len(one) == 3 * len(other) == 6 * len(third):
                raise RecordError(f"{sensor.path}: {len(one)} coordinates, {len(other)} bytes of intensities")
    if (numbers := SENSOR_KINDS[sensor.type].numbers) is None or "numbers" not in columns:
        return
    width = numbers.count(sensor.config)
    for one in columns["numbers"]:
        if len(one) != 8 * width:
            raise RecordError(f"{sensor.readings_path}: numbers: {len(one)} bytes instead of {8 * width}")
        values = one.view("<f8")
        if problem := numbers.problem(values):
            raise RecordError(f"{sensor.readings_path}: numbers: {problem}")
        if (np.isfinite(values) & (np.abs(values) > np.finfo(np.float32).max)).any():
            raise RecordError(f"{sensor.readings_path}: numbers: beyond single precision")


def data_fields(reading: Reading) -> tuple[Any, ...]:
    """The fields of a reading's data that a recording holds: a unit's covariances follow from its configuration."""
    numbers = SENSOR_KINDS[reading.type].numbers
    return tuple(vars(reading.data).values())[: numbers.fields if numbers else None]


def decode_jpeg(blob: ByteArray, size: tuple[int, int]) -> ByteArray:
    """The pixels (height, width, 3) of a JPEG file of a size: width and height.

    Raises:
        RecordError: it is damaged, or of another size.
    """
    from PIL import Image as Pictures

    try:
        with Pictures.open(io.BytesIO(blob.tobytes()), formats=["JPEG"]) as picture:
            if picture.size != size or picture.mode != "RGB":  # before its pixels are made
                raise RecordError(f"a picture of {picture.size[0]}x{picture.size[1]} instead of {size[0]}x{size[1]}")
            return np.array(picture)
    except (OSError, ValueError, SyntaxError, Pictures.DecompressionBombError) as error:
        raise RecordError(f"a picture is damaged: {str(error).splitlines()[0]}") from None
