"""What a referee sees: where things are, what the boat touched, what its team sent, and the status of the task."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field

from vrx_mj.model.tasks import TaskBase

Count = Annotated[int, Field(ge=0, le=1 << 53)]
"""A number of things."""
Place = Annotated[list[float], Field(min_length=3, max_length=3)]
"""x, y, z [m]."""


Phase = Literal["initial", "ready", "running", "finished"]


def has_started(phase: str) -> bool:
    """Whether a task in a phase has started: before that it has no score."""
    return phase in ("running", "finished")


def score_text(phase: str, score: float | None, unit: str = "") -> str:
    """The score in words; before the task has started there is no score."""
    return f"score {score:.4g} {unit}".rstrip() if has_started(phase) else "no score yet"


@dataclass
class TaskStatus:
    """What every task has, as VRX's `/vrx/task/info` has it. Times are simulated, from the world's start [s]."""

    ready_time: float
    """When the task becomes ready."""
    running_time: float
    """When it starts to run."""
    duration: float
    """Longest time for which it may run."""
    phase: Phase = "initial"
    elapsed: float = 0.0
    """Time since it began to run."""
    score: float = 0.0
    collisions: Count = 0
    last_hit: float = 0.0
    """When the last collision was counted; 0 at the start, as in VRX, so that early ones are not counted."""
    timed_out: bool = False

    @property
    def remaining(self) -> float:
        """Time until it times out."""
        return self.duration - self.elapsed

    def info(self) -> dict[str, object]:
        """Status by the names of VRX's task message; times in s."""
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


FRAME_RATE = 20.0
"""Frames per simulated second [Hz], at least: the next rate above that divides a second into whole steps.

Recordings have rows at the same steps, so that a recording gives the score that the run gave."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Position and attitude of a body's link origin."""

    x: float
    """Position [m], east."""
    y: float
    """Position [m], north."""
    z: float
    """Position [m], up."""
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Quaternion (w, x, y, z), body to world."""

    @property
    def yaw(self) -> float:
        """Heading [rad], counter-clockwise from x, in [-pi, pi]."""
        w, x, y, z = self.quaternion
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@dataclass(frozen=True, slots=True)
class Message:
    """What a team sends to its task."""

    topic: str
    content: Any
    """Plain data, as JSON holds it."""


@dataclass(frozen=True, slots=True)
class Frame:
    """The world at one moment, as far as a task wants to know it."""

    time: float
    """Simulated time [s], from the world's start."""
    poses: Mapping[str, Pose]
    """Poses by name of the boat, object or ball; a dock has the name of its placement."""
    touches: Mapping[str, float] = field(default_factory=dict)
    """What the scored boat has touched, by name, and when it last did [s]; nothing that it never touched."""
    messages: tuple[Message, ...] = ()
    """Sent since the frame before, in their order."""


_POSE = 7
"""Numbers of a pose: position and quaternion."""


@dataclass(frozen=True)
class FrameLayout:
    """Columns of a row: time, then x, y, z, qw, qx, qy, qz of every watched body, then times of touches."""

    watched: tuple[str, ...]
    rivals: tuple[str, ...]
    """What the boat may touch; the time [s] of its last touch is negative until there was one."""

    @property
    def width(self) -> int:
        """Number of columns."""
        return 1 + _POSE * len(self.watched) + len(self.rivals)

    def frame(self, row: Sequence[float], messages: Sequence[Message] = ()) -> Frame:
        """The frame of a row."""
        numbers = [float(number) for number in row]
        poses, start = {}, 1
        for name in self.watched:
            x, y, z, *turn = numbers[start : start + _POSE]
            poses[name] = Pose(x, y, z, (turn[0], turn[1], turn[2], turn[3]))
            start += _POSE
        touches = {name: time for name, time in zip(self.rivals, numbers[start:], strict=True) if time >= 0.0}
        return Frame(numbers[0], poses, touches, tuple(messages))

    @staticmethod
    def of(task: TaskBase | None, watched: Sequence[str]) -> "FrameLayout":
        """The layout of a task's frames."""
        return FrameLayout(tuple(watched), task.rivals if task else ())


def frame_stride(timestep: float) -> int:
    """Physics steps of `timestep` [s] from frame to frame: the most that divide a second and give `FRAME_RATE`."""
    per_second = round(1.0 / timestep)
    most = max(1, int(per_second / FRAME_RATE))
    if abs(per_second * timestep - 1.0) > 1e-9:
        return most
    return next(stride for stride in range(most, 0, -1) if per_second % stride == 0)
