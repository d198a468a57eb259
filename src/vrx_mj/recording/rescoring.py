"""The score of a recorded task, computed again from the frames that its referee saw."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from vrx_mj.errors import CommandError, RecordError, StateError
from vrx_mj.recording.parts import FRAMES
from vrx_mj.recording.reader import Record, read_record
from vrx_mj.runtime.state import State
from vrx_mj.tasks.frame import Frame, FrameLayout, TaskStatus
from vrx_mj.tasks.referee import Referee, parsed_dump
from vrx_mj.tasks.registry import make_referee


@dataclass(frozen=True)
class Scored:
    """A task as a recording has it."""

    referee: Referee
    """Referee of the task, after the last frame."""
    events: tuple[tuple[float, str, str], ...]
    """Lines of the referee over all of the recording: time [s], text, level."""

    @property
    def status(self) -> TaskStatus:
        """Phase, times, collisions and score at the end."""
        return self.referee.status


def rescore(source: str | Path | Record) -> Scored:
    """Have a task's referee look at a recording: the score is that of the run, to the last bit.

    A recording that began in the middle of a run goes on from the status that the run had then.

    Raises:
        RecordError: the file is not a recording, or its world has no task.
    """
    referee, looks = _looks(source if isinstance(source, Record) else read_record(source))
    return Scored(referee, tuple((frame.time, *line) for frame, lines in looks for line in lines))


def scored_frames(recorded: Record) -> Iterator[tuple[float, Referee]]:
    """The time [s] of every frame of a recording, and the referee, always the same, after its look at it.

    Raises:
        RecordError: the recording is of a world without a task.
    """
    referee, looks = _looks(recorded)
    return ((frame.time, referee) for frame, _ in looks)


def _looks(recorded: Record) -> tuple[Referee, Iterator[tuple[Frame, Sequence[tuple[str, str]]]]]:
    """The referee, and every frame that it has not seen, when it looks at it, with its lines: text and level."""
    task, begun = recorded.companies[0].parameters.task, -1.0
    if task is None:
        raise RecordError(f"'{recorded.path}' has no score: its world, {recorded.properties.get('world')}, has no task")
    referee = make_referee(task)
    if recorded.states and recorded.states[0].time > 0.0:
        begun = recorded.states[0].time
        try:
            restore_referee(referee, recorded.states[0].blob)
        except StateError as error:
            problem = "begins with a state that its task cannot go on from"
            raise StateError(f"'{recorded.path}' {problem}: {error}") from error
    later = (frame for frame in _frames_of(recorded, referee) if frame.time > begun + 1e-9)
    return referee, ((frame, referee.look(frame).lines) for frame in later)


def _frames_of(recorded: Record, referee: Referee) -> Iterator[Frame]:
    """The frames of a recording, for the referee of its task.

    Raises:
        RecordError: one is not of this task.
    """
    layouts = [FrameLayout.of(boat_set.parameters.task, referee.watched) for boat_set in recorded.companies]
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
    """Have a referee go on from a saved state of the run.

    Raises:
        StateError: the state is of another task, or of a run without one.
    """
    text = State.from_bytes(blob).task
    if not text:
        raise StateError("a state without a task")
    referee.load(parsed_dump(text))
