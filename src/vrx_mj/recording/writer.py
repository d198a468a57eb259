"""Writes a recording while the run goes on.

A thread of ours feeds chunks to rerun's file writer, which appends each one at once: a process that is killed
leaves a file that reads up to its last flush. No recording stream of rerun's is open meanwhile. The caller
only copies a block of rows into a queue.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import queue
import subprocess
import tempfile
import threading
import time
import uuid
import warnings
import weakref
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from vrx_mj.arguments import as_path
from vrx_mj.arrays import FloatArray
from vrx_mj.errors import RecordError, VrxError, VrxWarning
from vrx_mj.recording.packing import pack_rows
from vrx_mj.recording.record_scene import RecordScene
from vrx_mj.recording.viewer import viewer_binary, viewer_environment
from vrx_mj.runtime.subscriptions import Touch
from vrx_mj.sensors.readings import Reading
from vrx_mj.tasks.frame import Message

if TYPE_CHECKING:
    from rerun.chunk import Chunk

__all__ = ["APPLICATION", "RecordWriter", "join_views"]

APPLICATION = "vrx_mj"
FLUSH = 1.0
"""Wall time between flushes [s]."""
FLUSH_BYTES = 16 << 20
"""Rows and readings that wait for a flush, at most [bytes]."""
WAITING = 64
"""Blocks and readings in the queue before the caller waits."""

JOIN_SECONDS = 600.0
"""Longest that joining may take."""
MANY_CHUNKS = 4000
"""Recordings of more chunks are compacted when they are closed: a viewer opens those faster."""

KINDS = ("rows", "event", "touch", "state", "reading", "frame", "scene")
"""Kinds of items in the queue."""

Item = tuple[str, Any]


class RecordWriter:
    """A recording being written. `close` it, or use it in a `with` statement."""

    def __init__(self, path: str | Path, scene: RecordScene) -> None:
        self._path = as_path("path", path)
        self._scene, self._width = scene, scene.layout().width
        try:  # fail now, not in the thread
            with self._path.open("wb"):
                pass
        except OSError as error:
            raise RecordError(f"cannot write the recording '{self._path}': {error.strerror}") from error
        self._work = Work(self._path, scene)
        self._finish = weakref.finalize(self, self._work.finish)

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
        rows = np.array(block, np.float64, order="C", ndmin=2)
        if rows.shape[1] != self._width:
            raise RecordError(f"rows of {rows.shape[1]} columns for '{self._path}', which has {self._width}")
        if len(rows):
            self._put(("rows", rows))

    def go_on(self, scene: RecordScene) -> None:
        """Boats have come or gone: later rows and frames are of this scene, which begins now."""
        scene = dataclasses.replace(scene, earlier=self._scene.roster())
        self._put(("scene", scene))
        self._scene, self._width = scene, scene.layout().width
        self._work.last = scene

    def event(self, t: float, text: str, level: str = "INFO", touch: str = "") -> None:
        """Record that something happened at simulated time `t` [s]; `touch`: the JSON of a `Touch` that it is about."""
        self._put(("event", (float(t), text, level, touch)))

    def touch(self, touch: Touch) -> None:
        """Record that a boat touches something: as an event, as a mark in the plots, and as an arrow at its point."""
        self.event(touch.time, str(touch), "WARN", json.dumps(dataclasses.asdict(touch)))
        self._put(("touch", dataclasses.replace(touch)))  # it may go on

    def frame(self, t: float, row: FloatArray, messages: Sequence[Message]) -> None:
        """Record a frame that a task's referee looked at, at simulated time `t` [s], with what its team sent."""
        sent = [[message.topic, message.content] for message in messages]
        self._put(("frame", (float(t), np.array(row, np.float64), sent)))

    def state(self, t: float, blob: bytes) -> None:
        """Record a state at simulated time `t` [s] from which the run can go on."""
        self._put(("state", (float(t), bytes(blob))))

    def reading(self, boat: str, reading: Reading) -> None:
        """Record what a boat's sensor measured; it must be among the scene's sensors."""
        self._put(("reading", (boat, reading)))

    def close(self) -> None:
        """Write what is left, then the blueprint and the table of contents. Once; later calls do nothing."""
        self._finish()

    def _put(self, item: Item) -> None:
        if not self._finish.alive:
            raise RecordError(f"the recording '{self._path}' is closed")
        self._work.put(item)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def held_bytes(kind: str, value: Any) -> int:
    """Memory that a row block or a reading holds until it is written, about."""
    if kind == "reading":
        return sum(part.nbytes for part in vars(value[1].data).values() if isinstance(part, np.ndarray))
    return value.nbytes if kind == "rows" else 0


class Work:
    """The writing thread and its queue. It does not know the `RecordWriter`, which may be forgotten."""

    def __init__(self, path: Path, scene: RecordScene) -> None:
        self._path = path
        self._scene = self.last = scene
        self._queue: queue.Queue[Item | None] = queue.Queue(WAITING)
        self._error: BaseException | None = None
        self._chunks = 0
        self._track: FloatArray | None = None
        self._result = ""
        from vrx_mj.recording.blueprint import blueprint_bytes

        self._views = blueprint_bytes(scene, APPLICATION)
        pack_rows(np.zeros((1, 1)))  # compiled now, and not while rows wait
        self._thread = threading.Thread(target=self._run, name="vrx_mj record", daemon=True)
        self._thread.start()

    def put(self, item: Item | None) -> None:
        """Hand over, waiting while the queue is full."""
        while True:
            self._check()
            try:
                return self._queue.put(item, timeout=FLUSH)
            except queue.Full:
                continue

    def finish(self) -> None:
        """End the thread; complete the file."""
        if self._thread.is_alive():
            with contextlib.suppress(RecordError):
                self.put(None)
        self._thread.join()
        self._check()
        try:
            self._complete()
        except (VrxError, OSError, subprocess.SubprocessError) as error:
            text = f"{error}; the recording reads, but opens without its views"
            warnings.warn(text, VrxWarning, stacklevel=2)

    def _check(self) -> None:
        if self._error is not None:
            raise RecordError(f"cannot write the recording '{self._path}': {self._error}") from self._error

    def _run(self) -> None:
        from rerun.chunk import LazyChunkStream

        try:
            stream = LazyChunkStream.from_iter(self._stream())
            stream.write_rrd(self._path, application_id=APPLICATION, recording_id=str(uuid.uuid4()))
        except BaseException as error:
            self._error = self._error or error

    def _stream(self) -> Iterator[Chunk]:
        """Every chunk of the file; the file's writer asks for the next when it wrote the last."""
        try:
            for chunk in self._all_chunks():
                self._chunks += 1
                yield chunk
        except Exception as error:
            self._error = error  # rerun's own error has less detail
            raise

    def _all_chunks(self) -> Iterator[Chunk]:
        from vrx_mj.recording.boat_sets import boat_set_chunk
        from vrx_mj.recording.motion_chunks import MovingChunks, event_chunk, state_chunk
        from vrx_mj.recording.sensor_chunks import SensedChunks, sensor_chunks
        from vrx_mj.recording.static_chunks import boat_chunks, change_chunks, still_chunks
        from vrx_mj.recording.task_chunks import TaskChunks, frame_chunk, task_chunks
        from vrx_mj.recording.touch_chunks import touch_chunks
        from vrx_mj.recording.weather_chunks import plan_chunks

        yield from still_chunks(self._scene, self._views)
        yield from boat_chunks(self._scene)
        yield from sensor_chunks(self._scene)
        yield from task_chunks(self._scene.parameters)
        moving, sensed = MovingChunks(self._scene), SensedChunks(self._scene)
        going = TaskChunks(self._scene.parameters)
        before = self._scene
        for batch in self._batches():
            if batch["state"]:  # first: a run killed here can still be resumed
                yield state_chunk(batch["state"])
            if batch["rows"]:
                yield from moving(np.concatenate(batch["rows"]))
                self._track = moving.track
            yield from sensed(batch["reading"])
            if batch["event"]:
                yield event_chunk(batch["event"])
            yield from touch_chunks(batch["touch"])
            if batch["frame"]:
                yield frame_chunk(batch["frame"], moving.boat_set)
            yield from going(batch["state"], batch["frame"])
            for scene in batch["scene"]:
                moving.go_on(scene)
                going.go_on(scene.parameters)
                yield boat_set_chunk(scene, before, moving.boat_set)
                yield from change_chunks(scene, before, self._scene)
                before = scene
        yield from going.rest()
        self._result = going.result
        if self._track is not None:
            yield from plan_chunks(self._scene, self._track)

    def _batches(self) -> Iterator[dict[str, list[Any]]]:
        """What came in since the last flush, by kind, until the end."""
        going = True
        while going:
            batch: dict[str, list[Any]] = {kind: [] for kind in KINDS}
            going = self._gather(batch)
            yield batch

    def _gather(self, batch: dict[str, list[object]]) -> bool:
        """Fill `batch` until the next flush is due, or boats come or go; False if that was the last."""
        due, size = time.monotonic() + FLUSH, 0
        while size < FLUSH_BYTES and (left := due - time.monotonic()) > 0:
            try:
                item = self._queue.get(timeout=left)
            except queue.Empty:
                break
            if item is None:
                return False
            kind, value = item
            batch[kind].append(value)
            if kind == "scene":
                break
            size += held_bytes(kind, value)
        return True

    def _complete(self) -> None:
        """Add the blueprint and the table of contents."""
        from vrx_mj.recording.blueprint import blueprint_bytes

        scene = dataclasses.replace(self._scene, earlier=self.last.roster())  # with the trails of who joined later
        views = blueprint_bytes(scene, APPLICATION, track=self._track, result=self._result)
        with tempfile.TemporaryDirectory(dir=self._path.parent, prefix=".record-") as folder:
            joined = Path(folder) / "joined.rrd"
            join_views(self._path, views, joined, chunks=self._chunks)
            joined.replace(self._path)


def join_views(recording: Path, views: bytes, output: Path, *, chunks: int) -> None:
    """Write `recording`, its blueprint `views` and a table of contents to `output`, alone in its folder."""
    blueprint = output.with_suffix(".rbl")
    blueprint.write_bytes(views)
    how = ["optimize", "--profile", "live"] if chunks > MANY_CHUNKS else ["merge"]
    command = [str(viewer_binary()), "rrd", *how, str(recording), str(blueprint), "-o", str(output)]
    done = subprocess.run(command, capture_output=True, timeout=JOIN_SECONDS, check=False, env=viewer_environment())
    if done.returncode != 0:
        errors = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise RecordError(f"rerun cannot finish '{recording}': {errors[-1] if errors else done.returncode}")
