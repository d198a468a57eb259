"""Checks of recordings: when and where two diverge, and a task's score computed again from the referee's frames."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError, RecordError, StateError
from vrx_mj.recording.parts import FRAMES
from vrx_mj.recording.reader import Record, read_record
from vrx_mj.runtime.state import State
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.referee import Frame, FrameLayout, Referee, parsed_dump

_IDENTITY = ("fleet", "seed", "world", "world_sha256")
"""Properties that make two runs different ones; versions and platform may differ."""


@dataclass(frozen=True)
class Difference:
    """The first place where two recordings differ."""

    row: int
    """Number of the row, from 0."""
    time: float
    """Simulated time [s]."""
    column: str
    """Name of the first column that differs."""
    first: float
    """Value in the first recording."""
    second: float
    """Value in the second recording."""
    columns: int
    """Number of columns that differ in this row."""

    def __str__(self) -> str:
        more = f", and {self.columns - 1} more columns" if self.columns > 1 else ""
        return (
            f"they diverge at {self.time:.3f} s (row {self.row}) in {self.column}: "
            f"{self.first!r} and {self.second!r}, {abs(self.first - self.second):.2g} apart{more}"
        )


@dataclass(frozen=True)
class Comparison:
    """Result of comparing two recordings."""

    first: Path
    """One recording."""
    second: Path
    """The other recording."""
    common: int
    """Rows that both have."""
    columns: int
    """Columns that both have."""
    complete: bool
    """Whether both have the same rows and columns."""
    differences: tuple[str, ...]
    """Everything that differs besides the rows, in words."""
    parting: Difference | None
    """The first place where the motions diverge, in what both have; None: nowhere."""
    notes: tuple[str, ...] = ()
    """Remarks on what was not compared."""

    @property
    def equal(self) -> bool:
        """Whether all of the motion is the same, bit for bit; names of worlds and fleets, and seeds, may differ."""
        return self.complete and self.parting is None

    def __str__(self) -> str:
        lines = list(self.differences)
        if self.parting is not None:
            lines.append(str(self.parting))
        elif self.complete:
            lines.append(f"equal bit for bit: {self.common} rows")
        elif self.common and self.columns:
            both = f"{self.common} rows of {self.columns} columns"
            lines.append(f"the rows that both have are equal bit for bit: {both}")
        return "\n".join([*lines, *self.notes])


def compare(first: str | Path | Record, second: str | Path | Record) -> Comparison:
    """Compare two recordings row by row, bit by bit, in the columns that both have."""
    a, b = (item if isinstance(item, Record) else read_record(item) for item in (first, second))
    common = min(len(a.rows), len(b.rows))
    names, others = (record.layout.names() for record in (a, b))
    shared = [name for name in names if name in set(others)]
    sensors = f"{len(a.sensors)} sensors in the first recording, {len(b.sensors)} in the second"
    return Comparison(
        first=a.path,
        second=b.path,
        common=common,
        columns=len(shared),
        complete=names == others and len(a.rows) == len(b.rows),
        differences=tuple(_word_differences(a, b)),
        parting=_first_parting(_columns(a, shared)[:common], _columns(b, shared)[:common], shared),
        notes=(f"readings of sensors are not compared: {sensors}",) if a.sensors or b.sensors else (),
    )


def _columns(record: Record, names: Sequence[str]) -> FloatArray:
    """Columns of these names of a recording's rows, the time first."""
    own = {name: index for index, name in enumerate(record.layout.names())}
    return np.ascontiguousarray(record.rows[:, [own[name] for name in names]])


def _word_differences(a: Record, b: Record) -> list[str]:
    """Differences in what the recordings are, before any row."""
    pairs = [(key, a.properties.get(key), b.properties.get(key)) for key in _IDENTITY]
    pairs.append(("physics_version", a.physics_version, b.physics_version))
    found = [f"{key}: {one!r} and {other!r}" for key, one, other in pairs if one != other]
    if a.timestep != b.timestep:
        found.append(f"timestep: {a.timestep} s and {b.timestep} s")
    for record, other in ((a, b), (b, a)):
        if only := set(record.layout.names()) - set(other.layout.names()):
            found.append(f"only '{record.path}' has {', '.join(sorted(only)[:6])}")
    if len(a.rows) != len(b.rows):
        found.append(f"rows: {len(a.rows)} and {len(b.rows)}")
    return found


def _first_parting(first: FloatArray, second: FloatArray, names: Sequence[str]) -> Difference | None:
    """The first of the rows (n, columns), and of the columns of these names, whose bits differ."""
    differs = first.view(np.uint64) != second.view(np.uint64)
    if not differs.any():
        return None
    row = int(np.argmax(differs.any(axis=1)))
    columns = np.flatnonzero(differs[row])
    return Difference(
        row=row,
        time=float(first[row, 0]),
        column=names[columns[0]],
        first=float(first[row, columns[0]]),
        second=float(second[row, columns[0]]),
        columns=len(columns),
    )


def rescore(source: str | Path | Record) -> tuple[Referee, tuple[tuple[float, str, str], ...]]:
    """Score a recording by its task's referee; the score equals that of the run bit for bit.

    Returns the referee after the last frame, and its lines over all of the recording: time [s], text, level.

    A recording that began in the middle of a run goes on from the status that the run had then.

    Raises:
        RecordError: the file is not a recording, or its world has no task.
    """
    referee, looks = looks_again(source if isinstance(source, Record) else read_record(source))
    return referee, tuple((frame.time, *line) for frame, lines in looks for line in lines)


def looks_again(recorded: Record) -> tuple[Referee, Iterator[tuple[Frame, Sequence[tuple[str, str]]]]]:
    """The referee, and every frame that it has not seen, when it looks at it, with its lines: text and level.

    Raises:
        RecordError: the recording is of a world without a task.
    """
    task, begun = recorded.parameters.task, -1.0
    if task is None:
        raise RecordError(f"'{recorded.path}' has no score: its world, {recorded.properties.get('world')}, has no task")
    referee = make_referee(task)
    if recorded.states and recorded.states[0].time > 0.0:
        begun = recorded.states[0].time
        try:
            restore_referee(referee, recorded.states[0].blob)
        except StateError as error:
            problem = "begins with a state from which its task cannot continue"
            raise StateError(f"'{recorded.path}' {problem}: {error}") from error
    later = (frame for frame in _frames_of(recorded, referee) if frame.time > begun + 1e-9)
    return referee, ((frame, referee.look(frame).lines) for frame in later)


def _frames_of(recorded: Record, referee: Referee) -> Iterator[Frame]:
    """The frames of a recording, for the referee of its task.

    Raises:
        RecordError: one is not of this task.
    """
    layouts = [FrameLayout.of(boat_set.world.parameters.task, referee.watched) for boat_set in recorded.companies]
    for boat_set, row, messages in recorded.frames:
        if len(row) != layouts[boat_set].width:
            problem = f"a frame of {len(row)} numbers instead of {layouts[boat_set].width}"
            raise RecordError(f"'{recorded.path}' is damaged: {FRAMES}: {problem}")
        try:
            sent = tuple(referee.accept(message.topic, message.content) for message in messages)
        except CommandError as error:
            raise RecordError(f"'{recorded.path}' is damaged: {FRAMES}: sent: {error}") from None
        yield layouts[boat_set].frame(row.tolist(), sent)


def restore_referee(referee: Referee, blob: bytes) -> None:
    """Restore a referee from a saved state of the run.

    Raises:
        StateError: the state is of another task, or of a run without one.
    """
    text = State.from_bytes(blob).task
    if not text:
        raise StateError("a state without a task")
    referee.load(parsed_dump(text))
