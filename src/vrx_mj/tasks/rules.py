"""What a task has to say to the referee: the part that differs from task to task."""

from collections.abc import Mapping
from typing import Any, Protocol

from vrx_mj.errors import CommandError, shown
from vrx_mj.tasks.actions import Action
from vrx_mj.tasks.frame import Frame
from vrx_mj.tasks.sheet import Phase, Sheet

__all__ = ["Desk", "Outputs", "PlainRules", "Rules"]

Outputs = dict[str, Any]
"""What a team may read of its task, by topic: plain data, as JSON holds it."""


class Desk(Protocol):
    """What rules may do at the referee's desk."""

    sheet: Sheet
    """Time, phase, collisions and score."""

    def set_score(self, score: float) -> None:
        """Write the score; ignored unless the task is running, as in VRX."""

    def finish(self) -> None:
        """End the task, not timed out."""

    def act(self, action: Action) -> None:
        """Do something to the world, at this frame."""

    def tell(self, text: str, level: str = "INFO") -> None:
        """Write a line into the log."""


class Rules(Protocol):
    """One task's rules. All that changes is in `state`, a dataclass of numbers, strings, lists and dicts."""

    state: Any
    counts_hits: bool
    """Whether a hit goes into the count of collisions."""

    @property
    def progress(self) -> Mapping[str, Any]:
        """How far the parts of the task are, such as gates, for maps and recordings: plain data."""

    @property
    def watched(self) -> tuple[str, ...]:
        """Names of bodies, besides the boat, that every frame must hold."""

    def enter(self, phase: Phase, frame: Frame, desk: Desk) -> None:
        """The task enters `ready`, `running` or `finished` (by `desk.sheet.timed_out` or not) at this frame."""

    def update(self, frame: Frame, desk: Desk) -> None:
        """Look at a frame, in any phase; the frame at which a phase begins comes after `enter`."""

    def hit(self, other: str, frame: Frame, desk: Desk) -> None:
        """The boat has hit something, outside the dead time after the hit before; `sheet.collisions` counts it."""

    def timeout_score(self, sheet: Sheet) -> float | None:
        """The score of a run whose time is up, None for the one that it has; only one above 0 counts, as in VRX."""

    def check(self, state: Any) -> None:
        """Check what kinds of fields and lengths of lists do not tell of a saved `state`.

        Raises:
            StateError: it cannot be a state of these rules.
        """

    def outputs(self, sheet: Sheet) -> Outputs:
        """What the team sees now besides phase, times and score."""

    def accept(self, topic: str, content: Any) -> Any:
        """Check what the team sends; returns it as `Frame.messages` shall hold it.

        Raises:
            CommandError: the task takes no such message, or its content is wrong.
        """


class PlainRules:
    """What most tasks say: phases and hits change nothing, the score stays when time is up, and no messages."""

    state: Any
    watched: tuple[str, ...] = ()
    counts_hits = True
    """Whether a hit goes into the count of collisions."""
    title = "the task"
    """In error messages."""

    @property
    def progress(self) -> Mapping[str, Any]:
        """Nothing that a map could show."""
        return {}

    def enter(self, phase: Phase, frame: Frame, desk: Desk) -> None:
        """Nothing happens between phases."""

    def hit(self, other: str, frame: Frame, desk: Desk) -> None:
        """Collisions cost nothing."""

    def timeout_score(self, sheet: Sheet) -> float | None:
        """The score stays."""
        return None

    def check(self, state: Any) -> None:
        """Kinds and lengths tell all."""

    def outputs(self, sheet: Sheet) -> Outputs:
        """None."""
        return {}

    def accept(self, topic: str, content: Any) -> Any:
        """It takes no messages."""
        raise CommandError(f"{self.title} takes no message {shown(topic)}; known: none")
