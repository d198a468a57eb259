"""The rules of a task, the part that differs from task to task, and what they do to the world."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from vrx_mj.errors import CommandError, shown
from vrx_mj.tasks.frame import Count, Frame, Phase, TaskStatus


@dataclass(frozen=True, slots=True)
class Release:
    """Let go of the boat."""

    boat: str


@dataclass(frozen=True, slots=True)
class PlaceObject:
    """Put a floating object somewhere, at rest."""

    name: str
    pose: tuple[float, float, float, float, float, float]
    """x, y, z [m], roll, pitch, yaw [rad], ENU."""


@dataclass(frozen=True, slots=True)
class LightUp:
    """Have a light buoy show three colours in turn, from a second later on."""

    name: str
    colors: tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class ShowSymbol:
    """Have a placard show a symbol."""

    placard: str
    symbol: str
    """Symbol, such as `red_circle`."""


@dataclass(frozen=True, slots=True)
class SetPinger:
    """Put the beacon that all receivers of a boat hear somewhere."""

    boat: str
    position: tuple[float, float, float]
    """Position [m, ENU]."""


Action = Release | PlaceObject | LightUp | ShowSymbol | SetPinger


Outputs = dict[str, Any]
"""What a team may read of its task, by topic: plain data, as JSON holds it."""


class TaskContext(Protocol):
    """What rules may read and do while the referee looks at a frame."""

    status: TaskStatus
    """Time, phase, collisions and score."""

    def set_score(self, score: float) -> None:
        """Write the score; ignored unless the task is running, as in VRX."""

    def finish(self) -> None:
        """End the task, not timed out."""

    def act(self, action: Action) -> None:
        """Do something to the world, at this frame."""

    def log(self, text: str, level: str = "INFO") -> None:
        """Write a line into the log."""


class Rules:
    """One task's rules. All that changes is in `state`, a dataclass of numbers, strings, lists and dicts.

    By default phases and hits change nothing, the score stays when time is up, and no messages are taken.
    """

    state: Any
    counts_hits = True
    """Whether a hit goes into the count of collisions."""
    title = "the task"
    """Name in error messages."""
    message = "none"
    """Topic of the message that a team may send."""

    @property
    def progress(self) -> Mapping[str, object]:
        """How far the parts of the task are, such as gates, for maps and recordings: plain data."""
        return {}

    def enter(self, phase: Phase, frame: Frame, context: TaskContext) -> None:
        """Enter `ready`, `running` or `finished` (by `context.status.timed_out` or not) at this frame."""

    def update(self, frame: Frame, context: TaskContext) -> None:
        """Look at a frame, in any phase; the frame at which a phase begins comes after `enter`."""

    def hit(self, other: str, frame: Frame, context: TaskContext) -> None:
        """Take a hit by the boat, outside the dead time after the hit before; `status.collisions` counts it."""

    def timeout_score(self, status: TaskStatus) -> float | None:
        """The score of a run whose time is up, None for the one that it has; only one above 0 counts, as in VRX."""
        return None

    def check(self, state: Any) -> None:
        """Check of a saved `state` what types of fields and lengths of lists leave open.

        Raises:
            StateError: it cannot be a state of these rules.
        """

    def outputs(self, status: TaskStatus) -> Outputs:
        """What the team sees now besides phase, times and score."""
        return {}

    def accept(self, topic: str, content: object) -> object:
        """Check what the team sends; returns it as `Frame.messages` shall hold it.

        Raises:
            CommandError: the task takes no such message, or its content is wrong.
        """
        raise CommandError(f"{self.title} takes no message {shown(topic)}; known: {self.message}")


@dataclass
class RunningMean:
    """Sums over the frames since the run began."""

    frames: Count = 0
    """Number of frames."""
    total: float = 0.0
    """Sum of the errors [m]."""
    error: float = 0.0
    """Error of the last frame [m]."""

    @property
    def mean(self) -> float:
        """Mean error [m]; 0 before the first frame."""
        return self.total / self.frames if self.frames else 0.0

    def add(self, error: float) -> float:
        """Take in the error of a frame [m]; returns the mean."""
        self.frames, self.total, self.error = self.frames + 1, self.total + error, error
        return self.mean
