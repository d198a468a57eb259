"""From a running simulation to a recording, and back to a simulation or into rerun's viewer.

A recording is appended to its file while the run goes on, and encoded when it is closed. A process that is killed
leaves a file that reads up to its last flush.
"""

import contextlib
import gc
import json
import math
import subprocess
import tempfile
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.arguments import as_flag, as_path, check_kind, check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.draw.display import no_window
from vrx_mj.errors import CommandError, RecordError, quote, warn
from vrx_mj.mjcf.objects import ball_names
from vrx_mj.model.world import tree_of
from vrx_mj.outputs import begins, writing
from vrx_mj.recording.boat_sets import BoatSetHead
from vrx_mj.recording.checks import rescore
from vrx_mj.recording.packing import plain_rows
from vrx_mj.recording.parts import (
    COMPANIES,
    EVENTS,
    FRAMES,
    MAGIC,
    ROWS,
    RUN,
    STATES,
    Cell,
    RawFile,
    copy_without_views,
    pack_files,
    viewer_binary,
    viewer_environment,
)
from vrx_mj.recording.reader import Record, data_fields, read_record
from vrx_mj.recording.record_scene import FORMAT, RecordedSensor, RecordScene
from vrx_mj.recording.simulation_scene import Choices, check_columns, scene_of
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.state import State
from vrx_mj.runtime.subscriptions import Touch
from vrx_mj.sensors.readings import Reading
from vrx_mj.tasks.referee import Message
from vrx_mj.unix import release_memory

_JPEG_QUALITY = 75
"""Quality of the JPEG pictures, of 100."""
_POSE_RATE = 20.0
"""Rate of rows [Hz, simulated time]."""
_ALL = "all"
"""The word for every sensor: of a boat, or of all boats."""


class RecordWriter(contextlib.AbstractContextManager["RecordWriter"]):
    """A recording being written. `close` it, or use it in a `with` statement."""

    def __init__(self, path: str | Path, scene: RecordScene) -> None:
        self.path = as_path("path", path)
        """The file."""
        self._ended = f"the recording '{self.path}' is closed"
        self._boat_set = 0
        self._scenes: list[RecordScene] = []
        self._take(scene)
        with writing("the recording", self.path, RecordError):
            self._file = RawFile(self.path)
        self._finish = weakref.finalize(self, finish, self.path, self._file, self._scenes)
        head = {
            "format": FORMAT,
            "timestep": scene.timestep,
            "properties": dict(scene.properties),
            "wind_direction": list(scene.parameters.wind.direction),
            "layout": asdict(scene.layout()),
            "sensors": tree_of(scene.sensors),
            "begun": scene.begun or 0.0,
            "sea": scene.sea_height is not None,
            "follow": scene.follow,
        }
        self._append(RUN, {"head": [json.dumps(head)], "files": [pack_files(scene.files)]})

    def rows(self, block: FloatArray) -> None:
        """Record rows (n, columns), in the order of time. They are copied."""
        rows = np.atleast_2d(np.asarray(block, np.float64))
        if rows.shape[1] != self._width:
            raise RecordError(f"rows of {rows.shape[1]} columns for '{self.path}', which has {self._width}")
        if len(rows):
            self._append(ROWS, {"block": [plain_rows(rows)], "company": [np.array([self._boat_set])]})

    def change_scene(self, scene: RecordScene) -> None:
        """Boats have come or gone: later rows and frames are of this scene, which begins now."""
        assert scene.begun is not None, "boats come and go at a time"
        self._boat_set += 1
        files = {name: content for name, content in scene.files.items() if self.scene.files.get(name) != content}
        world = scene.properties["world_sha256"]
        head = json.dumps(asdict(BoatSetHead(self._boat_set, scene.layout(), world, tuple(sorted(scene.files)))))
        scene = replace(scene, earlier=self.scene.roster())
        self._append(COMPANIES, {"time": [np.array([scene.begun])], "head": [head], "files": [pack_files(files)]})
        self._take(scene)

    def event(self, t: float, text: str, level: str = "INFO", touch: str = "") -> None:
        """Record that something happened at simulated time `t` [s]; `touch`: the JSON of a `Touch` that it is about."""
        columns: dict[str, list[Cell]] = {"sim_time": [np.array([round(t * 1e6) * 1000])]}
        said = text.encode("utf-8", "replace").decode()
        self._append(EVENTS, columns | {"TextLog:text": [said], "TextLog:level": [level], "touch": [touch]})

    def touch(self, touch: Touch) -> None:
        """Record that a boat has touched something, when that is over: as an event, a mark, and an arrow."""
        self.event(touch.time, str(touch), "WARN", json.dumps(asdict(touch)))

    def frame(self, t: float, row: FloatArray, messages: Sequence[Message]) -> None:
        """Record a frame that a task's referee looked at, at simulated time `t` [s], with what its team sent."""
        sent = [[0, [[message.topic, message.content] for message in messages]]] if messages else []
        block = plain_rows(np.atleast_2d(np.asarray(row, np.float64)))
        self._append(FRAMES, {"block": [block], "sent": [json.dumps(sent)], "company": [np.array([self._boat_set])]})

    def state(self, t: float, blob: bytes) -> None:
        """Record a state at simulated time `t` [s] from which the run can go on."""
        self._append(STATES, {"time": [np.array([float(t)])], "blob": [bytes(blob)]})

    def reading(self, boat: str, reading: Reading) -> None:
        """Record what a boat's sensor measured; it must be among the scene's sensors."""
        sensor = self._sensors[boat, reading.name]
        self._append(sensor.readings_path, _reading_columns(sensor, reading))

    def close(self) -> None:
        """Encode what was recorded, with the blueprint and the table of contents. Once; later calls do nothing."""
        self._finish()

    def _take(self, scene: RecordScene) -> None:
        self.scene = scene
        """The scene that is recorded now."""
        self._scenes.append(replace(scene, files={}))
        self._width = scene.layout().width
        self._sensors = {(sensor.boat, sensor.name): sensor for sensor in scene.sensors}

    def _append(self, entity: str, columns: Mapping[str, Sequence[Cell]]) -> None:
        if not self._finish.alive:
            raise RecordError(self._ended)
        try:
            self._file.append(entity, columns)
        except OSError as error:
            self._finish.detach()
            self._ended = f"cannot write the recording '{self.path}': {error.strerror}"
            raise RecordError(self._ended) from error

    def __exit__(self, *_: object) -> None:
        self.close()


def finish(path: Path, file: RawFile, scenes: Sequence[RecordScene]) -> None:
    """Encode the run in a file, in its place; where there is no room for it, it stays as it is."""
    release_memory()  # also the code of what the run needed, before the viewer's library is loaded
    collecting = gc.isenabled()
    gc.disable()  # to look for what may go takes a tenth of the time, and nothing may
    from vrx_mj.recording.encoding import UnwrittenError, encode

    try:
        file.close()
        encode(path, scenes, path)
    except (OSError, UnwrittenError) as error:
        warn(f"{error}; what was written is intact, and vrx-mj replay opens it", 2)
    finally:
        if collecting:
            gc.enable()
    release_memory(code=False)  # of what was encoded, before what comes after the run


def _reading_columns(sensor: RecordedSensor, reading: Reading) -> dict[str, list[Cell]]:
    """Cells that give a reading back: its picture, its points, or its numbers as the fields of its class list them."""
    columns: dict[str, list[Cell]] = {"time": [np.array([reading.time])], "sequence": [np.array([reading.sequence])]}
    if sensor.type == "camera":
        if reading.data.labels is not None:
            seen = [(one.category_id, *one.box) for one in reading.data.labels.objects]
            columns["labels"] = [np.ravel(seen).astype("<i4")]
        return columns | {"EncodedImage:blob": [reading.data.jpeg(_JPEG_QUALITY)]}
    if sensor.gives_points:
        cloud = reading.data  # as bytes: rerun takes numbers one by one
        numbers = {"intensity": [cloud.intensity.astype("<f4").tobytes()], "ring": [cloud.ring.astype("<u2").tobytes()]}
        return columns | {"Points3D:positions": [cloud.points.astype("<f4")]} | numbers
    values = np.concatenate([np.ravel(field) for field in data_fields(reading)])
    return columns | {"numbers": [values.astype("<f8").tobytes()]}


@contextlib.contextmanager
def record(
    sim: Simulation,
    path: str | Path,
    *,
    sea: bool = True,
    sensors: str | Sequence[str] = (),
    follow: str | None = None,
) -> Iterator[RecordWriter]:
    """Record everything that `sim` does inside the `with` statement to a rerun file.

    Without `sea` the water's surface is left out, which takes most of the file and of the work. Every reading of the
    `sensors` is recorded, or as many per second as given: `["wamv1:front_left_camera@5", "wamv1:lidar_wamv", "wamv2"]`.
    A boat stands for all of its sensors, "all" for all sensors. Pictures and points at 5 per second take some MB per
    minute. The motion stays the same bit for bit.

    After an exception, including Ctrl-C, the recording is completed and the exception continues. Even a killed process
    leaves a file that can be read up to its last second.

    The camera follows the boat `follow`, or else the whole fleet.

    Spawned boats, objects and docks appear in the recording, but not the sensors of spawned boats. Removed ones
    disappear, and so do readings of their sensors.

    Raises:
        RecordError: the file cannot be written.
        UnknownNameError: no such boat or sensor.
        CommandError: `sim` is not a simulation, or a sensor's rate is not above 0, or above its own.
    """
    check_kind("record", sim, Simulation, "a simulation, as Simulation(world)")
    mounted = sim.world.parameters.sensors
    rates = {boat: {one.name: one.config.rate for one in mounted if one.boat == boat} for boat in sim.boats}
    choices = choices_of(sensors, rates) if not isinstance(sensors, str) or sensors else {}
    if follow is not None:
        check_name("boat", follow, sim.boats)
    writer = RunWriter(path, sim, choices, sea=sea, follow=follow)
    with writer, contextlib.ExitStack() as stack:
        sim.attach(writer, rate=_POSE_RATE)
        stack.callback(sim.detach, writer)
        sim.event(f"{sim.world.name}, fleet {sim.world.parameters.fleet}, seed {sim.seed}: recording starts")
        for (boat, sensor), chosen in choices.items():
            taken = sim.subscribe(boat, sensor, _reading_recorder(writer, boat), rate=chosen)
            stack.callback(sim.unsubscribe, taken)
        stack.callback(sim.unwatch_contacts, sim.watch_contacts(writer.touch, ended=True))
        yield writer


class RunWriter(RecordWriter):
    """Writes the recording of a simulation, and looks at it again when boats or objects have come or gone."""

    def __init__(
        self, path: str | Path, sim: Simulation, choices: Choices, *, sea: bool, follow: str | None = None
    ) -> None:
        self._sim, self._choices = sim, choices
        shown = sim.sea.height if as_flag("sea", sea) else None
        super().__init__(path, replace(scene_of(sim, choices), begun=sim.time, sea_height=shown, follow=follow))
        release_memory(code=False)  # of the model that was looked at

    def boats_changed(self) -> None:
        """Boats, objects or docks have come or gone."""
        self._choices = {own: rate for own, rate in self._choices.items() if own[0] in self._sim.boats}
        self.change_scene(_changed_scene(self.scene, self._sim, self._choices, self._sim.time))


def _changed_scene(before: RecordScene, sim: Simulation, choices: Choices, begun: float) -> RecordScene:
    """Scene that is recorded from `begun` [s] on, after boats, objects or docks have come or gone."""
    there = sim.world.parameters
    names = {item.name for table in (there.boats, there.objects, there.docks) for item in table}
    new = names - {body.name for body in before.bodies} - ball_names(there)
    now = scene_of(sim, choices, looks_of=[part.name for part in sim.world.pieces.parts if part.name in new])
    looks = {one.display.name: one.surfaces for one in before.displays}
    displays = tuple(replace(one, surfaces=looks.get(one.display.name, one.surfaces)) for one in now.displays)
    return replace(now, begun=begun, follow=before.follow, displays=displays, sea_height=before.sea_height)


def _recorded_scenes(record: Record) -> Iterator[RecordScene]:
    """Scenes rebuilt from the recorded worlds: the first one, and one for each change of boats or objects.

    Raises:
        RecordError, StateError: the recording holds no world, or is damaged.
    """
    scene: RecordScene | None = None
    for number, boat_set in enumerate(record.companies):
        sim = Simulation(boat_set.world)
        check_columns(boat_set, sim.model)
        if scene is None:
            if record.states:
                sim.set_state(State.from_bytes(record.states[0].blob))
            shown = sim.sea.height if record.sea else None
            scene = replace(scene_of(sim), begun=record.begun, sea_height=shown, follow=record.follow)
        else:
            own = record.time[record.row_companies == number]
            begun = float(own[0]) if len(own) else scene.begun or 0.0
            scene = replace(_changed_scene(scene, sim, {}, begun), earlier=scene.roster())
        sensors = tuple(sensor for sensor in record.sensors if sensor.boat in sim.boats)
        scene = replace(scene, sensors=sensors, properties=record.properties)
        yield scene


def resume(path: str | Path, time: float) -> Simulation:
    """A simulation at the last recorded second not after simulated `time` [s] of a recording.

    Raises:
        RecordError: the file is not a recording, or has no state that early.
    """
    recorded = read_record(path)
    state = State.from_bytes(recorded.state_at(time).blob)
    own = (one for one in recorded.companies if one.world_sha256 == state.world)
    sim = Simulation(next(own, recorded.companies[0]).world)
    sim.set_state(state)
    return sim


def _reading_recorder(writer: RecordWriter, boat: str) -> Callable[[Reading], None]:
    """A function that records a boat's readings, and a ball shooter's shots as events."""
    left: dict[str, int] = {}

    def take(reading: Reading) -> None:
        writer.reading(boat, reading)
        if reading.type == "ball_shooter":
            shots = reading.data.shots_left
            if shots < left.get(reading.name, shots):
                writer.event(reading.time, f"{boat} {reading.name}: a shot, {shots} left")
            left[reading.name] = shots

    return take


_Rates = Mapping[str, Mapping[str, float]]
"""Measurements per second by boat and sensor."""


def choices_of(words: str | Sequence[str], rates: _Rates) -> Choices:
    """The sensors that are meant, each once, in the order in which they are named; the last rate given counts.

    A word is `boat:sensor`, a boat for all of its sensors, or `all`; the sensor alone belongs to the boat named
    last, or to the only one. `@5` after any of them asks for 5 readings per second, of several sensors for at most 5.

    Raises:
        UnknownNameError: no such boat, or no such sensor on it.
        CommandError: a rate is not above 0, or above the sensor's own.
    """
    given: Any = [words] if isinstance(words, str) else words
    if not isinstance(given, Sequence) or not all(isinstance(word, str) for word in given):
        raise CommandError(
            f"invalid sensors {quote(words)}: text, or a list of it, is needed, as in wamv1:lidar_wamv@5"
        )
    found: dict[tuple[str, str], float] = {}
    boat = next(iter(rates)) if len(rates) == 1 else None
    for word in ",".join(given).replace(" ", "").split(",") if given else ():
        name, most = _name_and_rate(word)
        own, colon, sensor = name.partition(":")
        if not colon:
            own, sensor = (boat, name) if boat is not None and name not in {_ALL, *rates} else (name, _ALL)
        for each in rates if name == _ALL else (own,):
            found |= _rates(each, sensor, most, rates)
        boat = own if name != _ALL else boat if len(rates) == 1 else None
    return found


def _name_and_rate(word: str) -> tuple[str, float | None]:
    """A word's name, and its rate if it has one."""
    name, mark, rate = word.partition("@")
    if not mark:
        return name, None
    with contextlib.suppress(ValueError):
        if 0.0 < (value := float(rate)) < math.inf:
            return name, value
    raise CommandError(f"invalid rate '{rate}' in '{word}': readings per second above 0 are needed, as in lidar_wamv@5")


def _rates(boat: str, sensor: str, most: float | None, rates: _Rates) -> dict[tuple[str, str], float]:
    """Readings per second of a sensor of a boat, or of all of them; `most`: as many as are asked for."""
    check_name("boat", boat, rates)
    if sensor == _ALL:
        return {(boat, name): min(own, most or own) for name, own in rates[boat].items()}
    check_name(f"sensor of {boat}", sensor, rates[boat])
    own = rates[boat][sensor]
    if most is not None and most > own:
        raise CommandError(f"{sensor} of {boat} measures at {own:g} Hz: it cannot be recorded at {most:g} Hz")
    return {(boat, sensor): most or own}


def open_viewer(path: str | Path, *, follow: str | None = None, write: Callable[[str], None] = print) -> int:
    """Open a recording in the viewer, which listens to this machine only; returns its exit code.

    Without a display it is served to a browser until Ctrl-C, and `write` is called with lines that say where.

    The camera follows the boat `follow`, or else what it followed when the run was recorded. The file of a killed run
    is encoded first.

    Raises:
        UnknownNameError: unknown boat.
        RecordError: the file is not a recording, or damaged: all of it is parsed before the viewer has it; or the
            viewer does not start.
    """
    from vrx_mj.recording.viewer import LOOPBACK, Server, where_to_look

    record = read_record(path, whole=True)
    record.warn_of_physics()
    with tempfile.TemporaryDirectory() as folder:
        file = viewable(record, follow, Path(folder))
        reason = no_window(mujoco=False)
        if reason is None:
            command = [str(viewer_binary()), str(file), "--bind", LOOPBACK, "--hide-welcome-screen"]
            return subprocess.run(command, check=False, env=viewer_environment()).returncode
        with contextlib.closing(Server(file)) as server, contextlib.suppress(KeyboardInterrupt):
            for line in (*where_to_look(server, reason), "Press Ctrl-C to stop."):
                write(line)
            return server.wait()
        return 0


def viewable(record: Record, follow: str | None, folder: Path) -> Path:
    """A recording as a viewer can open it: its file, or a copy in a folder, encoded, or with a camera on a boat.

    Raises:
        UnknownNameError: unknown boat.
        RecordError: it is damaged.
    """
    from vrx_mj.recording.encoding import encode, join_views

    if follow is not None:
        check_name("boat", follow, record.boats)
    file, copy = record.path, folder / record.path.name
    if begins(file, MAGIC):
        encode(file, _recorded_scenes(replace(record, follow=follow or record.follow)), copy)
    elif follow is None and record.has_views:
        return file
    else:  # a viewer prefers the views in a file
        copy = copy.with_stem(f"{copy.stem}_{follow}") if follow else copy
        bare, views = folder / "bare.rrd", folder / "views.rbl"
        copy_without_views(file, bare)
        _save_views_following(record, follow, views)
        join_views(bare, views, copy)
    return copy


def _save_views_following(record: Record, boat: str | None, file: Path) -> None:
    """Write the blueprint of a recording with a camera that follows a boat, as an `.rbl` file."""
    from vrx_mj.recording.blueprint import save_views
    from vrx_mj.recording.task_chunks import result_of

    scene, ended = next(_recorded_scenes(record)), float(record.time.max(initial=record.begun))
    scene = replace(scene, earlier=tuple(record.boats), follow=boat, ended=ended if ended > record.begun else None)
    result = result_of(rescore(record)[0]) if scene.parameters.task else ""
    places = np.concatenate([track.position[:, :2] for track in record.boats.values()])
    ends = np.array([np.nanmin(places, axis=0), np.nanmax(places, axis=0)]) if len(places) else None
    save_views(file, scene, ends, result)
