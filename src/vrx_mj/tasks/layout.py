"""Frames as rows of numbers, so that a recording holds what the referee saw, to the last bit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vrx_mj.tasks.frame import FRAME_RATE, Frame, Message, Stand

__all__ = ["FrameLayout", "frame_stride"]

POSE = 7
"""Numbers of a stand: position and quaternion."""


@dataclass(frozen=True)
class FrameLayout:
    """Columns of a row: time, then x, y, z, qw, qx, qy, qz of every watched body, then times of touches."""

    watched: tuple[str, ...]
    rivals: tuple[str, ...]
    """What the boat may touch; the time [s] of its last touch is negative until there was one."""

    @property
    def width(self) -> int:
        """Number of columns."""
        return 1 + POSE * len(self.watched) + len(self.rivals)

    def frame(self, row: Sequence[float], messages: Sequence[Message] = ()) -> Frame:
        """The frame of a row."""
        numbers = [float(number) for number in row]
        stands, start = {}, 1
        for name in self.watched:
            x, y, z, *turn = numbers[start : start + POSE]
            stands[name] = Stand(x, y, z, (turn[0], turn[1], turn[2], turn[3]))
            start += POSE
        touches = {name: time for name, time in zip(self.rivals, numbers[start:], strict=True) if time >= 0.0}
        return Frame(numbers[0], stands, touches, tuple(messages))

    @staticmethod
    def of(task: Mapping[str, Any], watched: Sequence[str]) -> "FrameLayout":
        """The layout of a task's frames."""
        return FrameLayout(tuple(watched), tuple(task["rivals"]))


def frame_stride(timestep: float) -> int:
    """Physics steps of `timestep` [s] from frame to frame: the most that divide a second and give `FRAME_RATE`."""
    per_second = round(1.0 / timestep)
    most = max(1, int(per_second / FRAME_RATE))
    if abs(per_second * timestep - 1.0) > 1e-9:
        return most
    return next(stride for stride in range(most, 0, -1) if per_second % stride == 0)
