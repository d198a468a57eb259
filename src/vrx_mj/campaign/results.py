"""Results of trials: what is noted while they run, a small JSON for each cell in the folder, and all of them as CSV."""

import csv
import faulthandler
import io
import json
import time
from collections.abc import Iterable, Mapping, MutableSequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from vrx_mj.arrays import FloatArray
from vrx_mj.campaign.plan import Cell, State, folder_name
from vrx_mj.errors import RecordError
from vrx_mj.outputs import write_files

FORMAT = 1
"""Version of the files; others are refused."""
LOG = "log.txt"
"""What a trial printed, with the traceback of a controller that raised."""
_RESULT = "result.json"
Tree = dict[str, Any]
"""Content of a JSON file."""
WHAT = "the campaign"
"""What is written, for messages."""
_COLUMNS = (
    "controller", "world", "seed", "state", "task", "score", "unit", "better", "timed_out", "collisions", "elapsed",
    "sim_time", "wall_time", "state_sha256", "error",
)  # fmt: skip


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
    world_sha256: str = ""
    platform: str = ""
    """What bit-equality depends on."""
    tracks: Mapping[str, list[list[float]]] = field(default_factory=dict)
    """x and y [m] of each boat's way."""
    recording: str | None = None
    """Name of its recording's file in the cell's folder; None without one."""

    @property
    def has_failed(self) -> bool:
        """Whether the trial has no result: it failed, or was lost."""
        return self.state in {"failed", "lost"}

    @property
    def score(self) -> float | None:
        """The task's score; None where the trial failed, its task has not started, or the world has no task."""
        return float(self.task["score"]) if self.task is not None and self.state in {"cut", "finished"} else None


def write_result(folder: Path, result: Result) -> None:
    """Write a cell's result into its folder; a reader meanwhile sees all of it or nothing."""
    write_json(folder / _RESULT, {"format": FORMAT, **asdict(result)})


def read_result(folder: Path) -> Result | None:
    """The result in a cell's folder; None where it is missing or cut short.

    Raises:
        RecordError: it is of another version.
    """
    file = folder / _RESULT
    try:
        tree = read_json(file)
        return Result(**{**tree, "cell": Cell(**tree["cell"])})
    except (FileNotFoundError, ValueError, TypeError, KeyError):
        return None


def read_results(folder: Path, cells: Iterable[Cell]) -> dict[Cell, Result]:
    """The results of these cells, as far as there are any; errors are those of `read_result`."""
    found = ((cell, read_result(folder / cell.folder)) for cell in cells)
    return {cell: result for cell, result in found if result is not None and result.cell == cell}


def read_sketches(folder: Path, worlds: Iterable[str]) -> dict[str, Tree]:
    """The sketches of these worlds, as far as there are any."""
    files = {world: sketch_file(folder, world) for world in worlds}
    return {world: read_json(file) for world, file in files.items() if file.is_file()}


def sketch_file(folder: Path, world: str) -> Path:
    """The file of what is in a world, for its map on the page."""
    return folder / "worlds" / f"{folder_name(world)}.json"


def write_csv(file: Path, results: Iterable[Result]) -> None:
    """All results as a table, a line for each."""
    text = io.StringIO()
    writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_row(result) for result in results)
    write_text(file, text.getvalue())


def _row(result: Result) -> dict[str, object]:
    task = result.task or {}
    return {
        **asdict(result.cell),
        "state": result.state,
        "task": task.get("type"),
        "score": result.score,
        **{key: task.get(key) for key in ("unit", "better", "timed_out", "elapsed")},
        "collisions": task.get("num_collisions"),
        "sim_time": result.sim_time,
        "wall_time": round(result.wall_time, 3),
        "state_sha256": result.state_sha256,
        "error": result.error,
    }


def write_json(file: Path, tree: Mapping[str, object]) -> None:
    """Write a file as a whole: there is never half of one."""
    write_text(file, json.dumps(tree, ensure_ascii=False, allow_nan=False) + "\n")


def read_json(file: Path) -> Tree:
    """What `write_json` wrote, without its version.

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


END, ALLOWED, REACHED, GROUP = 0, 1, 2, 3
"""Slots of the memory that a trial shares: when it must have ended, by the monotonic clock, the wall time that it may
take, the simulated time that it has reached [s], and the process group of the program that sails it, or 0."""
_Point = tuple[float, float]
_APART = 0.3
"""Places nearer than this to the one kept before are left out while sailing [m]."""
TOLERANCE = 0.2
"""How far a simplified track may be from the true one [m]."""
MOST = 400
"""Points of a simplified track, at most."""


class Stopwatch:
    """Reports to the campaign how far the trial is, and ends this process when its time is up."""

    def __init__(self, shared: MutableSequence[float]) -> None:
        self._shared = shared

    def allow(self, wall: float) -> None:
        """Let the trial take this wall time [s] from now on; then it writes to its log where it is, and ends."""
        self._shared[ALLOWED], self._shared[END] = wall, time.monotonic() + wall
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
        if not places or abs(x - places[-1][0]) + abs(y - places[-1][1]) > _APART:
            places.append((x, y))

    def lines(self) -> dict[str, list[list[float]]]:
        """The track of each boat, x and y [m] to a decimetre."""
        return {boat: simplified_track(places) for boat, places in self._places.items()}


def simplified_track(places: list[_Point]) -> list[list[float]]:
    """A line through few of these places (Douglas and Peucker 1973), with a tolerance that keeps it short enough."""
    from shapely import LineString

    tolerance, points = TOLERANCE, places
    while len(points) > 2 and (len(points) > MOST or tolerance == TOLERANCE):
        points = list(LineString(points).simplify(tolerance, preserve_topology=False).coords)
        tolerance *= 1.5
    return [[round(x, 1), round(y, 1)] for x, y in points]
