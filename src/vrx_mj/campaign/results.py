"""Results of trials: what is noted while they run, a database of them in the campaign's folder, and all as CSV."""

import csv
import faulthandler
import io
import json
import signal
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping, MutableSequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.campaign.plan import Cell, State, folder_name
from vrx_mj.errors import RecordError
from vrx_mj.outputs import write_files

FORMAT = 1
"""Version of the files; others are refused."""
LOG = "log.txt"
"""Name of the file of what a trial printed, with the traceback of a controller that raised."""
DATABASE = "results.sqlite"
_OLD_RESULT_FILE = "result.json"
"""File that version 0.1 wrote for each cell in place of the database."""
Tree = dict[str, Any]
"""Content of a JSON file."""
WHAT = "the campaign"
"""Name of what is written, in messages."""
_DATABASE_FORMAT = 2
_COLUMNS: Mapping[str, str] = {
    **dict.fromkeys(("controller", "world"), "text not null"), "seed": "integer not null",
    **dict.fromkeys(("state", "task", "task_name"), "text"), "score": "real", "unit": "text", "better": "text",
    "timed_out": "boolean", "collisions": "integer", **dict.fromkeys(("elapsed", "sim_time", "wall_time"), "real"),
    **dict.fromkeys(("state_sha256", "poses_sha256", "world_sha256", "platform", "recording"), "text"),
    "parameters": "text", "error": "text",
}  # fmt: skip
"""Columns of the table `trials`, and their types."""
_SCHEMA = f"""
begin;
create table trials ({", ".join(f"{name} {kind}" for name, kind in _COLUMNS.items())},
  primary key (controller, world, seed));
create table details (controller text not null, world text not null, seed integer not null, tracks text, events text,
  primary key (controller, world, seed));
pragma user_version = {_DATABASE_FORMAT};
commit;
"""
_TASK_COLUMNS: Mapping[str, str] = {
    "task": "type", "task_name": "name", "unit": "unit", "better": "better", "timed_out": "timed_out",
    "collisions": "num_collisions", "elapsed": "elapsed",
}  # fmt: skip
"""Columns of what a result has of its task."""
TIME_UP = getattr(signal, "SIGUSR2", None)
"""Signal with which the campaign ends a trial whose time is up; Windows has none, and the trial ends itself."""
END, ALLOWED, REACHED, GROUP = 0, 1, 2, 3
"""Slots of the memory that a trial shares: when it must have ended, by the monotonic clock, the wall time that it may
take, the simulated time that it has reached [s], and the process group of the program that sails it, or 0."""
_MIN_SPACING = 0.3
"""Places nearer than this to the one kept before are left out while sailing [m]."""
TRACK_TOLERANCE = 0.2
"""How far a simplified track may be from the true one [m]."""
MAX_TRACK_POINTS = 400
"""Points of a simplified track, at most."""


@dataclass(frozen=True)
class Result:
    """How a trial ended."""

    cell: Cell
    state: State = "finished"
    error: str | None = None
    """Error that ended the trial; None where it did not fail."""
    task: Mapping[str, Any] | None = None
    """type, name, state, score, unit, better, elapsed, timed_out, num_collisions, events; None without a task."""
    sim_time: float = 0.0
    """Simulated time [s]."""
    wall_time: float = 0.0
    """Wall time [s]."""
    state_sha256: str = ""
    """Fingerprint of the last state: equal runs have equal ones."""
    poses_sha256: str = ""
    """Fingerprint of where the boats ended and how far they went: equal where two seeds gave the same motion."""
    world_sha256: str = ""
    platform: str = ""
    """Platform, on which bit-equality depends."""
    tracks: Mapping[str, list[list[float]]] = field(default_factory=dict)
    """x and y [m] of each boat's way."""
    recording: str | None = None
    """Name of its recording's file in the cell's folder; None without one."""
    parameters: Mapping[str, float] = field(default_factory=dict)
    """Values of the quantities that `--vary` draws, by their names there."""

    @property
    def has_failed(self) -> bool:
        """Whether the trial has no result: it failed, or was lost."""
        return self.state in {"failed", "lost"}

    def outline(self) -> "Result":
        """The result without tracks and the events of its task, as `ResultStore.results` gives it."""
        return replace(self, tracks={}, task=self.task and {**self.task, "events": ()})

    @property
    def score(self) -> float | None:
        """The task's score; None where the trial failed, its task has not started, or the world has no task."""
        return float(self.task["score"]) if self.task is not None and self.state in {"cut", "finished"} else None


class ResultStore(AbstractContextManager["ResultStore"]):
    """The database of results in a campaign's folder, which one process writes, and others may read meanwhile.

    A result is there as a whole or not at all, whatever ends the process, and once for each cell.
    """

    def __init__(self, folder: Path, *, writes: bool = False) -> None:
        """Open it to read, or to write, when it is made if need be.

        Raises:
            RecordError: it is missing, damaged, of another version, or cannot be written.
        """
        self._file, self._writes = folder / DATABASE, writes
        is_new = writes and not _is_begun(self._file)
        with self._one_line_errors():
            mode = "rwc" if writes else "rw"
            self._base = sqlite3.connect(f"{self._file.absolute().as_uri()}?mode={mode}", timeout=60.0, uri=True)
            if is_new:
                self._base.executescript(_SCHEMA)
            version = self._base.execute("pragma user_version").fetchone()[0]
        if version != _DATABASE_FORMAT:
            self._base.close()
            raise RecordError(
                f"{self._file} has format {version}; this version reads {_DATABASE_FORMAT}: use the vrx_mj that wrote "
                "it, or --restart"
            )
        if writes:
            with self._one_line_errors():
                self._base.execute("pragma journal_mode = wal")  # readers do not wait
                self._base.execute("pragma synchronous = normal")  # a power cut may take the last rows, not the file

    def __exit__(self, *_: object) -> None:
        with suppress(sqlite3.OperationalError):  # somebody reads
            if self._writes:
                self._base.execute("pragma journal_mode = delete")  # one file again
        self._base.close()

    def add(self, *results: Result) -> None:
        """Store results; those that their cells had before go.

        Raises:
            RecordError: they cannot be written.
        """
        rows = [tuple(_row(result).values()) for result in results]
        details = [
            (*vars(result.cell).values(), json.dumps(result.tracks), json.dumps((result.task or {}).get("events")))
            for result in results
        ]
        with self._one_line_errors(), self._base:
            self._base.executemany(f"replace into trials values ({', '.join('?' * len(_COLUMNS))})", rows)
            self._base.executemany("replace into details values (?, ?, ?, ?, ?)", details)

    def results(self) -> Iterator[Result]:
        """All results, without their tracks and the events of their tasks."""
        with self._one_line_errors():
            for row in self._base.execute(f"select {', '.join(_COLUMNS)} from trials"):
                yield _result(dict(zip(_COLUMNS, row, strict=True)))

    def tracks(self, cells: Iterable[Cell]) -> dict[Cell, Mapping[str, list[list[float]]]]:
        """Tracks of the boats of these cells, as far as they have a result."""
        query, found = "select tracks from details where controller = ? and world = ? and seed = ?", {}
        with self._one_line_errors():
            for cell in cells:
                for (text,) in self._base.execute(query, (cell.controller, cell.world, cell.seed)):
                    found[cell] = json.loads(text)
        return found

    @contextmanager
    def _one_line_errors(self) -> Iterator[None]:
        """Raise errors of the database as errors of one line."""
        try:
            yield
        except sqlite3.Error as error:
            reason = error if self._file.is_file() else "it is gone"
            raise RecordError(
                f"cannot use the results {self._file}: {reason}; free the disk or stop what else writes there, and "
                "repeat the command, or give --restart"
            ) from None


def _is_begun(file: Path) -> bool:
    """Whether a database was begun: who only looks for one leaves an empty file, and so may a power cut."""
    return file.is_file() and file.stat().st_size > 0


def read_results(folder: Path, cells: Iterable[Cell]) -> dict[Cell, Result]:
    """The results of these cells, as far as there are any, without tracks; version 0.1 has a file for each.

    Raises:
        RecordError: they are damaged, or of another version.
    """
    if _is_begun(folder / DATABASE):
        with ResultStore(folder) as store:
            found = {result.cell: result for result in store.results()}
        return {cell: found[cell] for cell in cells if cell in found}
    former = ((cell, _former_result(folder / cell.folder)) for cell in cells)
    return {cell: result for cell, result in former if result is not None and result.cell == cell}


def _former_result(folder: Path) -> Result | None:
    """The result that version 0.1 has in a cell's folder; None where it is missing or cut short.

    Raises:
        RecordError: it is of another version.
    """
    try:
        tree = read_json(folder / _OLD_RESULT_FILE)
        phase = tree["task"]["state"] if tree["task"] else "finished"
        ended = {"finished": "finished", "running": "cut"}.get(phase, "not started")
        return Result(**{**tree, "cell": Cell(**tree["cell"]), "state": "failed" if tree["error"] else ended})
    except (FileNotFoundError, ValueError, TypeError, KeyError):
        return None


def read_sketches(folder: Path, worlds: Iterable[str]) -> dict[str, Tree]:
    """The sketches of these worlds, as far as there are any."""
    files = {world: sketch_file(folder, world) for world in worlds}
    return {world: read_json(file) for world, file in files.items() if file.is_file()}


def sketch_file(folder: Path, world: str) -> Path:
    """The file of what is in a world, for its map on the page."""
    return folder / "worlds" / f"{folder_name(world)}.json"


def write_csv(file: Path, results: Iterable[Result]) -> None:
    """All results as a table, a line for each; quantities that were varied have columns of their own."""
    rows = [_row(result) | dict(result.parameters) for result in results]
    names = dict.fromkeys(name for row in rows for name in row) or _COLUMNS
    text = io.StringIO()
    writer = csv.DictWriter(
        text, [name for name in names if name != "parameters"], lineterminator="\n", extrasaction="ignore"
    )
    writer.writeheader()
    writer.writerows(rows)
    write_text(file, text.getvalue())


def _row(result: Result) -> dict[str, object]:
    """The columns of a result, in their order."""
    task, whole = result.task or {}, {**vars(result), **vars(result.cell)}
    own = {column: task.get(key) for column, key in _TASK_COLUMNS.items()}
    own |= {"score": result.score, "parameters": json.dumps(result.parameters)}
    return {column: own[column] if column in own else whole[column] for column in _COLUMNS}


def _result(row: Mapping[str, Any]) -> Result:
    """The result of a row of columns."""
    task = (
        {key: row[column] for column, key in _TASK_COLUMNS.items()} | {"score": row["score"]} if row["task"] else None
    )
    own = {"cell": Cell(row["controller"], row["world"], row["seed"]), "task": task}
    same = {name: row[name] for name in _COLUMNS if name in Result.__dataclass_fields__}
    return Result(**{**same, **own, "parameters": json.loads(row["parameters"])})


def write_json(file: Path, tree: Mapping[str, object]) -> None:
    """Write a file as a whole: there is never half of one."""
    write_text(file, json.dumps(tree, ensure_ascii=False, allow_nan=False) + "\n")


def read_json(file: Path) -> Tree:
    """Content that `write_json` wrote, without its version.

    Raises:
        RecordError: it is of another version.
        ValueError: it is not JSON.
    """
    tree: Any = json.loads(file.read_text(encoding="utf-8"))
    version = tree.pop("format", None) if isinstance(tree, dict) else None
    if version != FORMAT:
        raise RecordError(f"{file} has format {version}; this version reads {FORMAT}")
    return dict(tree)


def write_text(file: Path, text: str) -> None:
    """Write a file as a whole, and its folder if need be."""
    write_files(file.parent, {file.name: text}, WHAT)


_Point = tuple[float, float]


class Stopwatch:
    """Reports to the campaign how far the trial is, and when it must have ended."""

    def __init__(self, shared: MutableSequence[float]) -> None:
        self._shared = shared

    def allow(self, wall: float) -> None:
        """Set the wall time [s] that the trial may take from now on."""
        self._shared[ALLOWED], self._shared[END] = wall, time.monotonic() + wall
        if TIME_UP is None:
            faulthandler.dump_traceback_later(wall, exit=True)

    def reach(self, moment: float) -> None:
        """Note the simulated time [s]."""
        self._shared[REACHED] = moment

    def lead(self, group: int) -> None:
        """Note the process group of the program that sails the trial; 0: it has ended."""
        self._shared[GROUP] = group


class Tracks:
    """Collects the places of boats while they sail."""

    def __init__(self) -> None:
        self._places: dict[str, list[_Point]] = {}

    def add(self, boat: str, position: FloatArray) -> None:
        """Take a boat's position [m, ENU]."""
        x, y = float(position[0]), float(position[1])
        places = self._places.setdefault(boat, [])
        if not places or abs(x - places[-1][0]) + abs(y - places[-1][1]) > _MIN_SPACING:
            places.append((x, y))

    def lines(self) -> dict[str, list[list[float]]]:
        """The track of each boat, x and y [m] to a decimetre."""
        return {boat: simplified_track(places) for boat, places in self._places.items()}


def simplified_track(places: list[_Point]) -> list[list[float]]:
    """A line through few of these places (Douglas and Peucker 1973), with a tolerance that keeps it short enough."""
    import shapely

    tolerance, points = TRACK_TOLERANCE, np.array(places)
    while len(points) > 2 and (len(points) > MAX_TRACK_POINTS or tolerance == TRACK_TOLERANCE):
        line = shapely.simplify(shapely.linestrings(points), tolerance, preserve_topology=False)
        tolerance, points = 1.5 * tolerance, shapely.get_coordinates(line)
    return points.round(1).tolist()  # type: ignore[no-any-return]
