"""A recording as moments in time: where everything was between its rows, and the status of the task."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import RecordError
from vrx_mj.recording.boat_sets import BoatSet, columns_in
from vrx_mj.recording.reader import Record
from vrx_mj.recording.rescoring import scored_frames
from vrx_mj.tasks.registry import TASK_KINDS

__all__ = ["Footage", "Instant", "TaskMoment"]


@dataclass(frozen=True, eq=False)
class Instant:
    """All that is drawn of one time."""

    time: float
    """Simulated time [s]."""
    boat_set: int
    """Number of the boats that sail together then, and of their world."""
    qpos: FloatArray
    """Positions, as the model of these boats has them."""
    marks: FloatArray
    """What lights and placards show."""


@dataclass(frozen=True)
class TaskMoment:
    """Status of a task from a time on."""

    time: float
    """Simulated time [s]."""
    task: str
    phase: str
    score: float
    unit: str
    collisions: int
    remaining: float
    """Time until it times out [s]."""


class Footage:
    """A recording that can be asked for any moment of it."""

    def __init__(self, recorded: Record) -> None:
        """Take a recording.

        Raises:
            RecordError: it has no rows, or no world.
        """
        if "scene.json" not in recorded.files:
            raise RecordError(f"'{recorded.path}' has no world to draw: it was not made by a simulation")
        if not len(recorded.time):
            raise RecordError(f"'{recorded.path}' has no motion to draw: it ends before its first row")
        self.recorded = recorded
        self._columns = [columns_in(recorded.layout, boat_set.layout) for boat_set in recorded.companies]

    @property
    def start(self) -> float:
        """Time of the first row [s]."""
        return float(self.recorded.time[0])

    @property
    def end(self) -> float:
        """Time of the last row [s]."""
        return float(self.recorded.time[-1])

    def boat_set(self, number: int) -> BoatSet:
        """The boats that sail together, and their world."""
        return self.recorded.companies[number]

    def at(self, time: float) -> Instant:
        """Everything at a time [s], between two rows on the straight line from one to the other."""
        rows, numbers = self.recorded.rows, self.recorded.row_companies
        after = bisect_right(self.recorded.time, time)
        before = max(after - 1, 0)
        number = int(numbers[before])
        layout, columns = self.boat_set(number).layout, self._columns[number]
        row = rows[before, columns]
        if before < after < len(rows) and numbers[after] == number:
            row = between(row, rows[after, columns], time, [layout.pose(body).start + 3 for body in layout.bodies])
        marks = rows[before, columns][layout.marks]
        return Instant(time, number, row[layout.qpos], marks)

    @cached_property
    def level(self) -> float:
        """Mean height of the water [m]."""
        return self.boat_set(0).parameters.sea.level

    def places(self, moment: Instant) -> dict[str, FloatArray]:
        """Where the boats' origins are at a moment, (3,) [m]."""
        boats = (body for body in self.boat_set(moment.boat_set).layout.bodies if body.kind == "boat")
        return {boat.name: moment.qpos[boat.qpos : boat.qpos + 3] for boat in boats}

    def path(self, boat: str) -> FloatArray:
        """Where a boat was, (n, 4): time [s], east, north [m] and heading [rad], rows in which it was not left out."""
        track = self.recorded.boats[boat]
        there = np.isfinite(track.position[:, 0])
        w, x, y, z = track.quaternion[there].T
        heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
        return np.column_stack([self.recorded.time[there], track.position[there, :2], heading])

    @cached_property
    def task_moments(self) -> tuple[TaskMoment, ...]:
        """Status of the task in the order of time; empty without a task."""
        task = self.recorded.companies[0].parameters.task
        if task is None:
            return ()
        unit = TASK_KINDS[task.type].unit
        return tuple(
            TaskMoment(
                time, one.name, one.status.phase, one.status.score, unit, one.status.collisions, one.status.remaining
            )
            for time, one in scored_frames(self.recorded)
        )

    def task_at(self, time: float) -> TaskMoment | None:
        """Status of the task at a time [s]; None without a task, or before its referee first looked."""
        count = bisect_right(self.task_moments, time + 1e-9, key=lambda one: one.time)
        return self.task_moments[count - 1] if count else None


def between(first: FloatArray, second: FloatArray, time: float, turns: list[int]) -> FloatArray:
    """A row at `time` [s] between two rows, whose first number is their time; `turns` are where quaternions begin."""
    share = (time - first[0]) / (second[0] - first[0])
    row: FloatArray = first + share * (second - first)
    for start in turns:
        part = slice(start, start + 4)
        near = second[part] if float(first[part] @ second[part]) >= 0.0 else -second[part]
        turn = first[part] + share * (near - first[part])
        length = math.sqrt(float(turn @ turn))
        row[part] = turn / length if length > 0.0 else first[part]
    return row
