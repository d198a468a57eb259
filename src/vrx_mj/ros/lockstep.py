"""Time that waits: physics goes on only when every topic of a list has answered the last clock."""

from collections import deque
from collections.abc import Sequence

from vrx_mj.ros.inbox import Command

__all__ = ["STEP", "Lockstep"]

STEP = "/vrx_mj/step"
"""The service by which time goes on where no topics are listed."""

LONGEST = 1024
"""Answers of one topic that wait for their clock, at most."""


class Lockstep:
    """Answers by topic; each clock takes one of each, in the order in which they came."""

    def __init__(self, topics: Sequence[str]) -> None:
        """Without topics, time goes on by `/vrx_mj/step` alone."""
        self.topics = tuple(topics)
        self._answers: dict[str, deque[Command]] = {topic: deque(maxlen=LONGEST) for topic in topics}

    def keep(self, command: Command) -> bool:
        """Keep a command for its clock, if its topic is one of the list."""
        if command.topic not in self._answers:
            return False
        self._answers[command.topic].append(command)
        return True

    def answers(self) -> list[Command] | None:
        """One answer of each topic, or None while one is missing."""
        if not self._answers or not all(self._answers.values()):
            return None
        return [waiting.popleft() for waiting in self._answers.values()]

    def begin(self) -> None:
        """Forget what was answered: time begins anew."""
        for waiting in self._answers.values():
            waiting.clear()

    @property
    def missing(self) -> tuple[str, ...]:
        """What time waits for: topics, or the service."""
        if not self._answers:
            return (STEP,)
        return tuple(topic for topic, waiting in self._answers.items() if not waiting)
