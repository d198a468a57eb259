"""Marks in the plots of a recording: when boats touched something, and what became of gates and of the score."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.draw.course import gate_rows
from vrx_mj.recording.moving import times
from vrx_mj.recording.still import static
from vrx_mj.tasks.referee import Referee
from vrx_mj.tasks.registry import TASK_KINDS

__all__ = ["MARKS", "Mark", "TaskMarks", "legend_chunks", "mark_chunks"]

Mark = tuple[float, str]
"""Simulated time [s], and its kind."""
MARKS = "/marks"
KINDS: Mapping[str, tuple[tuple[int, int, int], str]] = {
    "contacts": ((255, 70, 60), "cross"),
    "gates passed": ((70, 220, 110), "up"),
    "gates missed": ((170, 170, 180), "down"),
    "score changes": ((255, 214, 64), "diamond"),
}
"""Colour and marker shape of each kind of mark."""
SIZE = 5.0
"""Size of a mark [points]."""


class TaskMarks:
    """Marks of a task, and the lines that its referee does not say: gates missed, and changes of a score of points."""

    def __init__(self, task: Mapping[str, Any]) -> None:
        self._points = TASK_KINDS[task["type"]].unit == "points"
        self._gates = ["ahead"] * len(gate_rows(task))
        self._score = 0.0
        self._marks: list[Mark] = []
        self._lines: list[tuple[float, str, str]] = []

    def take_up(self, referee: Referee) -> None:
        """Begin in the middle of a run."""
        self._gates = list(referee.progress.get("gates", ()))
        self._score = referee.status.score

    def look(self, time: float, referee: Referee) -> None:
        """See what has changed at `time` [s]."""
        now = list(referee.progress.get("gates", ()))
        for number, (before, fate) in enumerate(zip(self._gates, now, strict=False), 1):
            if fate != before:
                self._marks.append((time, "gates passed" if fate == "crossed" else "gates missed"))
            if fate != before and fate == "missed":
                self._lines.append((time, f"gate {number} of {len(now)} missed", "WARN"))
        score = referee.status.score
        if self._points and score != self._score:
            self._marks.append((time, "score changes"))
            self._lines.append((time, f"score {score:g} points, {score - self._score:+g}", "INFO"))
        self._gates, self._score = now, score

    def chunks(self) -> Iterator[Chunk]:
        """What has come since the last call."""
        marks, lines = self._marks, self._lines
        self._marks, self._lines = [], []
        yield from mark_chunks(marks)
        if lines:
            time, text, level = zip(*lines, strict=True)
            yield Chunk.from_columns("/events/task", [times(time)], rr.TextLog.columns(text=text, level=level))


def legend_chunks(parameters: Mapping[str, Any]) -> Iterator[Chunk]:
    """Names, colours and shapes of the marks that a world may have."""
    task = parameters.get("task") or {}
    gates = bool(task) and bool(gate_rows(task))
    points = bool(task) and TASK_KINDS[task["type"]].unit == "points"
    shown = {"contacts": True, "gates passed": gates, "gates missed": gates, "score changes": points}
    for kind, (color, shape) in KINDS.items():
        if shown[kind]:
            style = rr.SeriesPoints(names=[kind], colors=[color], markers=[shape], marker_sizes=[SIZE])
            yield static(path_of(kind), style)


def mark_chunks(marks: Sequence[Mark]) -> Iterator[Chunk]:
    """Marks on the line of zero."""
    for kind in dict.fromkeys(kind for _, kind in marks):
        at = [time for time, own in marks if own == kind]
        yield Chunk.from_columns(path_of(kind), [times(at)], rr.Scalars.columns(scalars=[0.0] * len(at)))


def path_of(kind: str) -> str:
    """The entity of marks of a kind."""
    return f"{MARKS}/{kind.replace(' ', '_')}"
