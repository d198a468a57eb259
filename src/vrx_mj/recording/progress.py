"""How a task goes, in a recording: gates, bays and circles in their colours, score and collisions, and words.

A second referee looks at the frames as they are written. It sees what the first one saw, so that it comes to the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.draw.course import gate_rows, poses_of
from vrx_mj.recording.course import (
    FATES,
    GATES,
    animal_color,
    animal_path,
    bay_color,
    bays_path,
    gate_lines,
)
from vrx_mj.recording.marks import TaskMarks
from vrx_mj.recording.moving import times
from vrx_mj.recording.officiated import Seen, take_up
from vrx_mj.recording.still import static
from vrx_mj.recording.telling import words
from vrx_mj.tasks.frame import Frame, FrameLayout, Message, Pose
from vrx_mj.tasks.registry import TASK_KINDS, make_referee

__all__ = ["PLOT", "WORDS", "TaskChunks", "task_chunks"]

Ends = Sequence[tuple[Pose, Pose]]
"""Of gates: their buoys."""
Maker = Callable[[Sequence[Any]], Any]
"""From the values of an entity's rows to rerun's columns."""

PLOT = "/plots/task"
"""Score and collisions."""
WORDS = "/task"
"""What is told of the task in words."""
PLOT_EVERY, WORDS_EVERY, DRIFT_EVERY = 0.5, 1.0, 5.0
"""Least time between two points of the plot, two texts, and two places of gates whose buoys drift [s]."""
DRIFT = 0.5
"""By how much a buoy must have drifted for its gate to be drawn anew [m]."""
BLOCK = 20.0
"""How much simulated time waits to be written at once [s]: blocks cost more than what is in them."""
SCORE_COLOR, HITS_COLOR = (255, 214, 64), (255, 84, 48)


def task_chunks(parameters: Mapping[str, Any]) -> Iterator[Chunk]:
    """Names and colours of the plot's series, if the world has a task."""
    task = parameters.get("task")
    if task:
        meaning = TASK_KINDS[task["type"]]
        names = [f"score [{meaning.unit}]", "collisions"]
        mode = rr.components.InterpolationMode.StepAfter
        colors = [SCORE_COLOR, HITS_COLOR]
        lines = rr.SeriesLines(names=names, colors=colors, widths=[2.0] * 2, interpolation_mode=mode)
        yield static(PLOT, lines)


class TaskChunks:
    """Turns frames into chunks; nothing where the world has no task."""

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self._parameters = parameters
        self._task: Mapping[str, Any] = parameters.get("task") or {}
        self._begun: float | None = None
        self._now = 0.0
        self._last: dict[str, tuple[float, Any]] = {}
        self._drawn: tuple[float, list[Any], Ends] | None = None
        self._waiting: dict[str, tuple[Maker, list[tuple[float, Any]]]] = {}
        if self._task:
            self._referee, self._marks = make_referee(self._task), TaskMarks(self._task)
            self._layout = FrameLayout.of(self._task, self._referee.watched)

    def go_on(self, parameters: Mapping[str, Any]) -> None:
        """Go on in a world in which boats have come or gone: the scored one can touch others."""
        if self._task:
            self._layout = FrameLayout.of(parameters["task"], self._referee.watched)

    def __call__(self, states: Sequence[tuple[float, bytes]], frames: Sequence[Seen]) -> Iterator[Chunk]:
        """Chunks of the states and frames since the last call, when enough has come or the task is over."""
        if not self._task:
            return
        if self._begun is None and (states or frames):
            self._begin(states)
        for time, row, sent in frames:
            if self._begun is not None and time > self._begun + 1e-9:
                self._look(time, self._layout.frame(row.tolist(), [Message(*message) for message in sent]))
        oldest = min((rows[0][0] for _, rows in self._waiting.values()), default=math.inf)
        if self._waiting and (self._referee.finished or self._now - oldest >= BLOCK):
            yield from self.rest()

    def rest(self) -> Iterator[Chunk]:
        """Chunks of what still waits, and of the last score."""
        if self._begun is not None and self._waiting:
            self._tell(self._now, at_once=True)
        for path, (maker, rows) in self._waiting.items():
            at, values = zip(*rows, strict=True)
            yield Chunk.from_columns(path, [times(at)], maker(values))
        self._waiting = {}
        if self._task:
            yield from self._marks.chunks()

    def _begin(self, states: Sequence[tuple[float, bytes]]) -> None:
        """Go on from the first state, if that is not the beginning of the run."""
        self._begun = -1.0
        if states and states[0][0] > 0.0:
            self._begun, blob = states[0]
            take_up(self._referee, blob)
            self._marks.take_up(self._referee)
            self._now = self._begun
            self._draw(self._begun, poses_of(self._parameters))
            self._tell(self._begun, at_once=True)

    def _look(self, time: float, frame: Frame) -> None:
        """Have the referee look, and take note of what has changed."""
        phase = self._referee.status.phase
        self._referee.look(frame)
        self._marks.look(time, self._referee)
        self._now = time
        self._draw(time, frame.poses)
        self._tell(time, at_once=self._referee.status.phase != phase)

    def _draw(self, time: float, poses: Mapping[str, Pose]) -> None:
        """Gates, bays and circles where they have changed."""
        progress = self._referee.progress
        if "gates" in progress:
            self._draw_gates(time, poses, progress["gates"])
        if "bay" in progress:
            colors = [bay_color(bay, progress) for bay in self._task["bays"]]
            self._change(bays_path(self._task), strip_colors, time, colors)
        for animal in progress.get("animals", ()):
            self._change(animal_path(animal["name"]), strip_colors, time, [animal_color(animal)])

    def _draw_gates(self, time: float, poses: Mapping[str, Pose], fates: Sequence[str]) -> None:
        """All gates, if one has another colour, or has drifted."""
        following = fates.index("ahead") if "ahead" in fates and not self._referee.finished else -1
        colors = [FATES["next" if number == following else fate] for number, fate in enumerate(fates)]
        ends = [(poses[row["left"]], poses[row["right"]]) for row in gate_rows(self._task)]
        drawn = self._drawn
        if drawn and drawn[1] == colors and (time - drawn[0] < DRIFT_EVERY or drift(drawn[2], ends) < DRIFT):
            return
        self._drawn = (time, colors, ends)
        self._add(GATES, gate_columns, time, ([gate_lines(*pair) for pair in ends], colors))
        spots = [gate_lines(*pair)[1][0] for pair in ends]
        self._add(f"{GATES}/numbers", number_columns, time, (spots, colors))

    def _tell(self, time: float, *, at_once: bool) -> None:
        """Score and collisions, and words, unless that was a moment ago."""
        status = self._referee.status
        if at_once or self._due(PLOT, time, PLOT_EVERY):
            self._change(PLOT, scalar_columns, time, (status.score, status.collisions))
        if at_once or self._due(WORDS, time, WORDS_EVERY):
            self._change(WORDS, text_columns, time, words(self._task, self._referee))

    def _due(self, path: str, time: float, every: float) -> bool:
        return path not in self._last or time - self._last[path][0] > every - 1e-6

    def _change(self, path: str, maker: Maker, time: float, value: Any) -> None:
        """Have something written, if it is another than before."""
        if path not in self._last or self._last[path][1] != value:
            self._last[path] = (time, value)
            self._add(path, maker, time, value)

    def _add(self, path: str, maker: Maker, time: float, value: Any) -> None:
        """Have something written; of two values at one time the later counts."""
        rows = self._waiting.setdefault(path, (maker, []))[1]
        if rows and rows[-1][0] == time:
            rows.pop()
        rows.append((time, value))


def drift(before: Ends, now: Ends) -> float:
    """The longest way that a buoy has drifted [m]."""
    pairs = zip(chain.from_iterable(before), chain.from_iterable(now), strict=True)
    return max((math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairs), default=0.0)


def scalar_columns(values: Sequence[Any]) -> Any:
    """Columns of rows of numbers."""
    flat = [float(number) for row in values for number in row]
    return rr.Scalars.columns(scalars=flat).partition([len(row) for row in values])


def text_columns(values: Sequence[Any]) -> Any:
    """Columns of texts in Markdown."""
    return rr.TextDocument.columns(text=values, media_type=["text/markdown"] * len(values))


def strip_colors(values: Sequence[Any]) -> Any:
    """Columns of the colours of lines: one for all of an entity, or one for each."""
    return rr.LineStrips3D.columns(colors=[*chain.from_iterable(values)]).partition([len(row) for row in values])


def gate_columns(values: Sequence[Any]) -> Any:
    """Columns of gates' lines and their colours."""
    strips = [line for gates, _ in values for lines in gates for line in lines]
    colors = [color for gates, row in values for lines, color in zip(gates, row, strict=True) for _ in lines]
    counts = [sum(map(len, gates)) for gates, _ in values]
    return rr.LineStrips3D.columns(strips=strips, colors=colors).partition(counts)


def number_columns(values: Sequence[Any]) -> Any:
    """Columns of where gates' numbers are, and their colours."""
    spots, colors = ([*chain.from_iterable(row[i] for row in values)] for i in (0, 1))
    return rr.Points3D.columns(positions=spots, colors=colors).partition([len(row[1]) for row in values])
