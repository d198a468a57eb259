"""Writes a recording while the run goes on: it is appended to the file as it comes, and encoded when it is closed.

A process that is killed leaves a file that reads up to its last flush.
"""

from __future__ import annotations

import dataclasses
import json
import warnings
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from vrx_mj.arguments import as_path
from vrx_mj.arrays import FloatArray
from vrx_mj.errors import RecordError, VrxWarning
from vrx_mj.model.world import tree_of
from vrx_mj.recording.boat_sets import boat_set_cells
from vrx_mj.recording.packing import plain_rows
from vrx_mj.recording.parts import COMPANIES, EVENTS, FRAMES, ROWS, RUN, STATES, Cell, RawFile, pack_files
from vrx_mj.recording.reader import data_fields
from vrx_mj.recording.record_scene import FORMAT, RecordedSensor, RecordScene
from vrx_mj.runtime.subscriptions import Touch
from vrx_mj.sensors.readings import Reading
from vrx_mj.tasks.frame import Message
from vrx_mj.unix import release_memory

_QUALITY = 75
"""Quality of the JPEG pictures, of 100."""


class RecordWriter:
    """A recording being written. `close` it, or use it in a `with` statement."""

    def __init__(self, path: str | Path, scene: RecordScene) -> None:
        self._path = as_path("path", path)
        self._boat_set = 0
        self._take(scene)
        self._scenes: list[RecordScene] = []
        try:
            self._file = RawFile(self._path)
        except OSError as error:
            raise self._error(error) from error
        self._finish = weakref.finalize(self, finish, self._path, self._file, self._scenes)
        head = {
            "format": FORMAT,
            "timestep": scene.timestep,
            "properties": dict(scene.properties),
            "wind_direction": list(scene.parameters.wind.direction),
            "layout": scene.layout().to_json(),
            "sensors": tree_of(scene.sensors),
            "begun": scene.begun or 0.0,
            "sea": scene.sea_height is not None,
            "follow": scene.follow,
        }
        self._append(RUN, {"head": [json.dumps(head)], "files": [pack_files(scene.files)]})
        self._scenes.append(dataclasses.replace(scene, files={}))

    @property
    def path(self) -> Path:
        """The file."""
        return self._path

    @property
    def scene(self) -> RecordScene:
        """What is recorded now."""
        return self._scene

    def rows(self, block: FloatArray) -> None:
        """Record rows (n, columns), in the order of time. They are copied."""
        rows = np.atleast_2d(np.asarray(block, np.float64))
        if rows.shape[1] != self._width:
            raise RecordError(f"rows of {rows.shape[1]} columns for '{self._path}', which has {self._width}")
        if len(rows):
            self._append(ROWS, {"block": [plain_rows(rows)], "company": [np.array([self._boat_set])]})

    def change_scene(self, scene: RecordScene) -> None:
        """Boats have come or gone: later rows and frames are of this scene, which begins now."""
        assert scene.begun is not None, "boats come and go at a time"
        self._boat_set += 1
        head, files = boat_set_cells(scene, self._scene, self._boat_set)
        scene = dataclasses.replace(scene, earlier=self._scene.roster())
        self._append(COMPANIES, {"time": [np.array([scene.begun])], "head": [head], "files": [files]})
        self._take(scene)
        self._scenes.append(dataclasses.replace(scene, files={}))

    def event(self, t: float, text: str, level: str = "INFO", touch: str = "") -> None:
        """Record that something happened at simulated time `t` [s]; `touch`: the JSON of a `Touch` that it is about."""
        columns: dict[str, list[Cell]] = {"sim_time": [np.array([round(t * 1e6) * 1000])]}
        self._append(EVENTS, columns | {"TextLog:text": [text], "TextLog:level": [level], "touch": [touch]})

    def touch(self, touch: Touch) -> None:
        """Record that a boat has touched something, when that is over: as an event, a mark, and an arrow."""
        self.event(touch.time, str(touch), "WARN", json.dumps(dataclasses.asdict(touch)))

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
        self._scene, self._width = scene, scene.layout().width
        self._sensors = {(sensor.boat, sensor.name): sensor for sensor in scene.sensors}

    def _append(self, entity: str, columns: Mapping[str, Sequence[Cell]]) -> None:
        if not self._finish.alive:
            raise RecordError(f"the recording '{self._path}' is closed")
        try:
            self._file.append(entity, columns)
        except OSError as error:
            self._finish.detach()
            raise self._error(error) from error

    def _error(self, error: OSError) -> RecordError:
        return RecordError(f"cannot write the recording '{self._path}': {error.strerror}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def finish(path: Path, file: RawFile, scenes: Sequence[RecordScene]) -> None:
    """Encode the run in a file, in its place; where there is no room for it, it stays as it is."""
    release_memory()  # also the code of what the run needed, before the viewer's library is loaded
    from vrx_mj.recording.encoding import UnwrittenError, encode

    try:
        file.close()
        encode(path, scenes, path)
    except (OSError, UnwrittenError) as error:
        warnings.warn(f"{error}; what is in it reads, and vrx-mj replay shows it", VrxWarning, stacklevel=2)


def _reading_columns(sensor: RecordedSensor, reading: Reading) -> dict[str, list[Cell]]:
    """Cells that give a reading back: its picture, its points, or its numbers as the fields of its class list them."""
    columns: dict[str, list[Cell]] = {"time": [np.array([reading.time])], "sequence": [np.array([reading.sequence])]}
    if sensor.type == "camera":
        if reading.data.labels is not None:
            seen = [(one.category_id, *one.box) for one in reading.data.labels.objects]
            columns["labels"] = [np.ravel(seen).astype("<i4")]
        return columns | {"EncodedImage:blob": [reading.data.jpeg(_QUALITY)]}
    if sensor.gives_points:
        cloud = reading.data  # as bytes: rerun takes numbers one by one
        numbers = {"intensity": [cloud.intensity.astype("<f4").tobytes()], "ring": [cloud.ring.astype("<u2").tobytes()]}
        return columns | {"Points3D:positions": [cloud.points.astype("<f4")]} | numbers
    values = np.concatenate([np.ravel(field) for field in data_fields(reading)])
    return columns | {"numbers": [values.astype("<f8").tobytes()]}
