"""From the parts of a run, as it appended them, to a rerun file; and a robot at rest whose joints move in turn.

The parts are read from the file once, some at a time, and go as chunks into another, which takes its place at the end.
"""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Iterable, Iterator
from pathlib import Path

import mujoco
import numpy as np
import rerun as rr
from rerun.archetypes import RecordingInfo
from rerun.chunk import Chunk, LazyChunkStream

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import RecordError
from vrx_mj.outputs import atomic_write
from vrx_mj.recording.blueprint import save_views
from vrx_mj.recording.eyes import plan_chunks
from vrx_mj.recording.motion_chunks import (
    MovingChunks,
    event_chunk,
    part_chunk,
    part_poses,
    sensed_chunks,
    sensor_chunks,
    transforms,
)
from vrx_mj.recording.packing import pack_rows, shape_of, unpack_rows
from vrx_mj.recording.parts import (
    APPLICATION,
    COMPANIES,
    EVENTS,
    FRAMES,
    ROWS,
    STATES,
    Part,
    raw_parts,
    viewer_binary,
    viewer_environment,
)
from vrx_mj.recording.reader import all_events, all_states, read_frames
from vrx_mj.recording.record_scene import RecordedPart, RecordScene
from vrx_mj.recording.simulation_scene import geom_surface, hanging_part
from vrx_mj.recording.static_chunks import change_chunks, looks_chunks, still_chunks
from vrx_mj.recording.task_chunks import TaskChunks, frame_chunk, task_chunks, touch_chunks
from vrx_mj.recording.timeline import static, times

_JOIN_TIMEOUT = 600.0
"""Longest time that rerun may take to join files [s]."""
MOST_ROWS, _MOST_BYTES = 2560, 64 << 20
"""Largest numbers of rows and bytes that become chunks together: over two minutes, as each chunk takes 1 kB more."""
_APPLICATION = "vrx_mj robot"
_ROOT = "/robot"
_SWEEP_TIME, _SWEEP_ROWS = 2.0, 40
"""Time [s] in which a joint goes to its upper limit, to its lower one and back, and the rows in it."""


class UnwrittenError(RecordError):
    """A file that cannot be written, such as for lack of room."""


def encode(raw: Path, scenes: Iterable[RecordScene], target: Path) -> None:
    """Write the run in a file to another, or to the same.

    Args:
        raw: the file, as `RecordWriter` appended to it.
        scenes: the scene at the start, and one for each time that boats or objects came or went.
        target: is written whole or not at all.

    Raises:
        UnwrittenError: it cannot be written.
        RecordError: what is in the file is damaged.
    """
    encoder = Encoder(iter(scenes))
    parent = target.absolute().parent
    with (
        atomic_write(target, "the recording", UnwrittenError) as draft,
        tempfile.TemporaryDirectory(dir=parent, prefix=".record-") as folder,  # on the same disk
    ):
        bare = Path(folder) / "bare.rrd"
        try:
            _write_chunks(encoder.chunks(raw_parts(raw)), bare, APPLICATION)
        except OSError:
            if encoder.error is None:
                raise
            raise RecordError(f"cannot write the recording '{raw}': {encoder.error}") from encoder.error
        join_views(bare, encoder.save_views(bare.with_name("views.rbl")), draft)


def _write_chunks(chunks: Iterable[Chunk], file: Path, application: str) -> None:
    """Write chunks to a file.

    Raises:
        OSError: it cannot be written, or there was an error while they were made.
    """
    try:
        stream = LazyChunkStream.from_iter(chunks)
        stream.write_rrd(file, application_id=application, recording_id=str(uuid.uuid4()))
    except RuntimeError as error:  # of a place or a disk, as rerun raises it
        raise OSError(str(error)) from error


def join_views(recording: Path, views: Path, output: Path) -> None:
    """Write a file with its blueprint, an `.rbl` file, before it, and a table of contents of both.

    Raises:
        OSError: it cannot be written.
    """
    command = [str(viewer_binary()), "rrd", "route", str(views), str(recording), "-o", str(output)]
    done = subprocess.run(command, capture_output=True, timeout=_JOIN_TIMEOUT, check=False, env=viewer_environment())
    if done.returncode != 0:
        errors = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise OSError(f"rerun cannot finish it: {errors[-1] if errors else done.returncode}")


class Encoder:
    """Turns parts into chunks."""

    def __init__(self, scenes: Iterator[RecordScene]) -> None:
        self._scenes = scenes
        self._first = self._scene = next(scenes)
        self._boat_set = 0
        self._task, self._end = TaskChunks(self._first.parameters), 0.0
        self.error: Exception | None = None
        """Error that was raised while chunks were made."""

    def save_views(self, file: Path) -> Path:
        """Write the blueprint, with the trails of who joined later, to an `.rbl` file, which is returned."""
        ended = self._end if self._end > (self._first.begun or 0.0) else None
        scene = dataclasses.replace(self._first, earlier=self._scene.roster(), ended=ended)
        save_views(file, scene, self._moving.track, self._task.result)
        return file

    def chunks(self, parts: Iterator[Part]) -> Iterator[Chunk]:
        """All chunks of a file, made one by one as its writer asks for them."""
        try:
            self._moving = MovingChunks(self._first)
            yield part_chunk([next(parts)])
            yield from still_chunks(self._first)
            yield from sensor_chunks(self._first)
            yield from task_chunks(self._first.parameters)
            for batch in _batches(parts):
                yield from self._batch_chunks(batch)
            yield from self._task.chunks(self._end)
            if self._moving.track is not None:
                yield from plan_chunks(self._first, self._moving.track, self._moving.places)
        except Exception as error:
            self.error = error  # rerun's own error has less detail
            raise

    def _batch_chunks(self, batch: _Batch) -> Iterator[Chunk]:
        """Chunks of a batch of parts, then those of the boats and objects that come or go at its end."""
        found = {entity: batch.pop(entity, []) for entity in (STATES, ROWS, EVENTS, FRAMES, COMPANIES)}
        states, frames = all_states(found[STATES]), read_frames(found[FRAMES], self._boat_set + 1, sys.maxsize)
        if states:
            yield part_chunk(found[STATES])
        if blobs := [blob for part in found[ROWS] for blob in part.blobs("block")]:
            rows = np.concatenate([unpack_rows(blob) for blob in blobs])
            self._end = float(rows[-1, 0])
            found[ROWS], blobs = [], []  # a minute of each is several MB
            yield _exact_rows(rows, self._scene, self._boat_set)
            yield from self._moving(rows)
        if events := all_events(found[EVENTS]):
            yield event_chunk(events)
            yield from touch_chunks([event.touch for event in events if event.touch])
        if frames:
            yield frame_chunk(frames)
        self._task.look(states, frames)
        for parts in batch.values():
            yield from sensed_chunks(self._first, parts)
        for part in found[COMPANIES]:
            before, self._scene = self._scene, next(self._scenes)
            self._boat_set += 1
            self._moving.change_scene(self._scene)
            self._task.change_scene(self._scene.parameters)
            yield part_chunk([part])
            yield from change_chunks(self._scene, before, self._first)


_Batch = dict[str, list[Part]]
"""Parts by entity, in the order of time."""


def _batches(parts: Iterable[Part]) -> Iterator[_Batch]:
    """Parts that become chunks together: those of some rows, bytes, or until boats or objects come or go."""
    batch, rows, size = _Batch(), 0, 0
    for part in parts:
        batch.setdefault(part.entity, []).append(part)
        rows += shape_of(part.blobs("block")[0])[0] if part.entity == ROWS else 0
        size += part.size
        if part.entity == COMPANIES or size >= _MOST_BYTES or rows >= MOST_ROWS:
            yield batch
            batch, rows, size = _Batch(), 0, 0
    yield batch


def _exact_rows(rows: FloatArray, scene: RecordScene, boat_set: int) -> Chunk:
    """Rows as they are, to the last bit, with the number of their boat set."""
    layout = scene.layout()
    bodies = [(layout.pose(body).start, layout.velocity(body).start) for body in layout.bodies]
    columns = rr.AnyValues.columns(block=[pack_rows(rows, bodies, scene.timestep)], company=[boat_set])
    return Chunk.from_columns(ROWS, [times(rows[:1, 0])], columns)


def save_joints(model: mujoco.MjModel, name: str, path: Path) -> None:
    """Write a recording of this name, of a robot whose joints sweep the ranges of their controls, each in its turn.

    Raises:
        RecordError: the file cannot be written.
    """
    chunks = list(_chunks(model, name))
    with atomic_write(path, "the recording", RecordError) as draft:
        _write_chunks(chunks, draft, _APPLICATION)


def _chunks(model: mujoco.MjModel, name: str) -> Iterator[Chunk]:
    yield Chunk.from_property("RecordingInfo", RecordingInfo(name=name))
    yield static(_ROOT, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    paths = [_ROOT]
    for body in range(1, model.nbody):
        own = rr.escape_entity_path_part(model.body(body).name)
        paths.append(f"{paths[model.body_parentid[body]]}/{own}")
        geoms = np.flatnonzero(model.geom_bodyid == body).tolist()
        part = hanging_part(model, body, paths[body], (geom_surface(model, geom) for geom in geoms))
        yield from looks_chunks(part.path, None if part.joints else part.pose, part.surfaces, None)
        for joint in part.joints:
            yield _sweep(model, joint.qpos, part)


def _sweep(model: mujoco.MjModel, joint: int, part: RecordedPart) -> Chunk:
    """Poses of a part at the start and while its joint sweeps; `part` is at rest with the joint at 0."""
    share, (low, high), rest = np.linspace(0.0, 1.0, _SWEEP_ROWS), model.actuator_ctrlrange[joint], model.qpos0[joint]
    qpos = np.zeros((1 + _SWEEP_ROWS, model.nq))
    qpos[1:, joint] = np.interp(share, [0.0, 0.25, 0.75, 1.0], [rest, high, low, rest]) - rest
    time = np.concatenate([[0.0], (joint + share) * _SWEEP_TIME])
    return transforms(part.path, time, *part_poses(part, qpos))
