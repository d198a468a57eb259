"""What a `Simulation` offers of its world's task."""

from typing import Any

from vrx_mj.runtime.task_runner import TaskObservation, TaskRunner
from vrx_mj.runtime.turns import Turn, in_turn

__all__ = ["Tasked"]


class Tasked:
    """The part of a simulation that is scored."""

    _task_runner: TaskRunner
    _turn: Turn

    @property
    def task(self) -> TaskObservation | None:
        """Phase, times, score and outputs of the world's task; None if it has none."""
        return self._task_runner.observe() if self._task_runner.referee else None

    @property
    def task_is_over(self) -> bool:
        """Whether the world's task is finished; False if it has none."""
        return self._task_runner.referee is not None and self._task_runner.over

    @property
    def task_events(self) -> tuple[tuple[float, str, str], ...]:
        """Messages of the referee so far: simulated time [s], text and level."""
        return self._task_runner.events

    @in_turn
    def send(self, topic: str, content: Any) -> None:
        """Send a message to the task, such as a landmark that was found; the referee reads it at its next update.

        Raises:
            CommandError: the world has no task, or the task takes no such message.
        """
        self._task_runner.send(topic, content)
