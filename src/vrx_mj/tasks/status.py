"""The status of a task: phase, times, collisions and score; and types of what rules keep."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

__all__ = ["Count", "Phase", "Place", "TaskStatus"]

Count = Annotated[int, Field(ge=0, le=1 << 53)]
"""A number of things."""
Place = Annotated[list[float], Field(min_length=3, max_length=3)]
"""x, y, z [m]."""


Phase = Literal["initial", "ready", "running", "finished"]


@dataclass
class TaskStatus:
    """What every task has, as VRX's `/vrx/task/info` has it. Times are simulated, from the world's start [s]."""

    ready_time: float
    """When the task becomes ready."""
    running_time: float
    """When it starts to run."""
    duration: float
    """For how long it may run."""
    phase: Phase = "initial"
    elapsed: float = 0.0
    """Since it began to run."""
    score: float = 0.0
    collisions: Count = 0
    last_hit: float = 0.0
    """When the last collision was counted; 0 at the start, as in VRX, so that early ones are not counted."""
    timed_out: bool = False

    @property
    def remaining(self) -> float:
        """Until it times out."""
        return self.duration - self.elapsed

    def info(self) -> dict[str, object]:
        """By the names of VRX's task message; times in s."""
        return {
            "state": self.phase,
            "ready_time": self.ready_time,
            "running_time": self.running_time,
            "elapsed_time": self.elapsed,
            "remaining_time": self.remaining,
            "timed_out": self.timed_out,
            "num_collisions": self.collisions,
            "score": self.score,
        }

    def summary(self) -> str:
        """The phase in words, at the end with time and score."""
        if self.phase != "finished":
            return self.phase
        cause = "time is up" if self.timed_out else "finished"
        return f"{cause} after {self.elapsed:.1f} s, score {self.score:.3f}, collisions {self.collisions}"
