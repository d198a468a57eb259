"""The referee: phases, times and collisions, which are alike in all tasks; the rest is in a task's rules.

As in VRX a phase begins by the clock, one transition at a time: `ready` after the initial duration, `running` after the
ready one. The task ends when its rules end it, or when its time is up.

What the rules of tasks do to the world, and what they sum up.
"""

import json
import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from vrx_mj.config.loading import fault_text
from vrx_mj.config.wording import literal
from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, StateError
from vrx_mj.model.tasks import TaskBase, followed_things
from vrx_mj.tasks.frame import Count, Frame, Message, Phase, TaskStatus


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


_adapter = cache(TypeAdapter[Any])
_DUMP, _STATUS = _adapter(dict[str, Any]), _adapter(TaskStatus)

_DEAD_TIME_VRX3 = 3.0
"""Dead time after a collision in VRX 3 [s], which does not read the value of a world (ScoringPlugin.cc)."""


Dump = dict[str, Any]
"""State of a task as plain data, as JSON holds it."""


def dead_time(task: TaskBase) -> float:
    """How long after a counted collision none counts [s]: in VRX the value of the world, cut to whole seconds."""
    return _DEAD_TIME_VRX3 if task.profile == "vrx3" else float(math.floor(task.collision_buffer))


@dataclass(frozen=True)
class Verdict:
    """What follows from a frame."""

    actions: tuple[Action, ...]
    lines: tuple[tuple[str, str], ...]
    """Lines of the log: text and level."""


def parsed_dump(text: str) -> Dump:
    """A dump from its JSON.

    Raises:
        StateError: it is invalid.
    """
    try:
        _DUMP.validate_json(text, strict=True)  # its depth is bounded
    except ValidationError as error:
        raise StateError(f"the state of the task is damaged: {fault_text(error)}") from None
    parsed: Dump = json.loads(text)
    return parsed


def _same_length(first: object, given: object) -> bool:
    """Whether a list is as long as at first, if it was not empty, and so are those in it."""
    if not isinstance(first, list) or not first:
        return True
    return isinstance(given, list) and len(given) == len(first) and all(map(_same_length, first, given))


Outputs = dict[str, Any]
"""What a team may read of its task, by topic: plain data, as JSON holds it."""


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
    watches_early = False
    """Whether `update` sees the frames before the task runs, too."""

    @property
    def progress(self) -> Mapping[str, object]:
        """How far the parts of the task are, such as gates, for maps and recordings: plain data."""
        return {}

    def enter(self, phase: Phase, frame: Frame, referee: "Referee") -> None:
        """Enter `ready`, `running` or `finished` (by `referee.status.timed_out` or not) at this frame."""

    def update(self, frame: Frame, referee: "Referee") -> None:
        """Look at a frame, while the task runs; the frame at which it begins comes after `enter`."""

    def take_hit(self, other: str, frame: Frame, referee: "Referee") -> None:
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
        raise CommandError(f"{self.title} takes no message {literal(topic)}; known: {self.message}")


class Referee:
    """One task of a compiled world under way."""

    def __init__(self, task: TaskBase, rules: Rules) -> None:
        initial, ready, running = task.durations
        self.type, self.name, self.boat = task.type, task.name, task.boat
        self.buffer = dead_time(task)
        self.watched = (task.boat, *(name for name in followed_things(task) if name != task.boat))
        self.held_throughout = task.held
        self.locked = task.locked
        self._start = TaskStatus(initial, initial + ready, running)
        self._rules = rules
        self._first = asdict(rules.state)
        self.restart()

    def restart(self) -> None:
        """Begin anew."""
        self.status = replace(self._start)
        self._load_rules(self._first)
        self._actions: list[Action] = []
        self._lines: list[tuple[str, str]] = []

    @property
    def is_over(self) -> bool:
        """Whether it is over."""
        return self.status.phase == "finished"

    def look(self, frame: Frame) -> Verdict:
        """Take in a frame; frames come in the order of time, each once."""
        self._frame = frame
        if not self.is_over:
            self._count_hits(frame)
            self._advance(frame)
        if self.status.phase == "running" or (self._rules.watches_early and not self.is_over):
            self._rules.update(frame, self)
        verdict = Verdict(tuple(self._actions), tuple(self._lines))
        self._actions, self._lines = [], []
        return verdict

    def accept(self, topic: str, content: object) -> Message:
        """A message of the team, checked.

        Raises:
            CommandError: the task takes no such message, or its content is wrong.
        """
        return Message(topic, self._rules.accept(topic, content))

    @property
    def outputs(self) -> Outputs:
        """What the team sees besides phase, times and score."""
        return self._rules.outputs(self.status)

    @property
    def info(self) -> dict[str, object]:
        """What VRX's `/vrx/task/info` has: phase, times [s], collisions and score; and which boat has the task."""
        return {"type": self.type, "name": self.name, "boat": self.boat, **self.status.info()}

    @property
    def progress(self) -> Outputs:
        """How far the parts of the task are, as `gates`: plain data, empty where the rules have none."""
        return deepcopy(dict(self._rules.progress))

    # What rules call

    def set_score(self, score: float) -> None:
        """Write the score; ignored unless the task is running, as in VRX."""
        if self.status.phase == "running":
            self.status.score = score

    def finish(self) -> None:
        """End the task, not timed out."""
        self._enter("finished")

    def act(self, action: Action) -> None:
        """Do something to the world, at this frame."""
        self._actions.append(action)

    def log(self, text: str, level: str = "INFO") -> None:
        """Write a line into the log."""
        self._lines.append((text, level))

    # State

    def dump(self) -> dict[str, object]:
        """All that changes, as plain data."""
        return {"type": self.type, "sheet": dict(vars(self.status)), "rules": asdict(self._rules.state)}

    def load(self, state: Dump) -> None:
        """Go on from what `dump` gave.

        Raises:
            StateError: it is of another task.
        """
        self.check(state)
        self._load_rules(state["rules"])
        self.status = TaskStatus(**state["sheet"])

    def check(self, state: Mapping[str, object]) -> None:
        """Check that `load` can take this.

        Raises:
            StateError: it is of another task.
        """
        if state.get("type") != self.type:
            raise StateError(f"the state is of the task {literal(state.get('type'))}, not '{self.type}'")
        self._fitting(_STATUS, "sheet", asdict(self._start), state)
        self._rules.check(self._fitting(_adapter(self._rules.state.__class__), "rules", self._first, state))

    # Inside

    def _fitting(
        self, kind: TypeAdapter[object], name: str, first: Mapping[str, object], state: Mapping[str, object]
    ) -> object:
        """A part of a state as what it is a dump of; lists that are not empty at `first` keep their lengths."""
        given, trouble = state.get(name), f"the state does not fit the task '{self.type}': {name}"
        if not isinstance(given, Mapping):
            raise StateError(f"{trouble}: expected keys and values, got {literal(given)}")
        if wrong := sorted(first.keys() ^ given.keys()):
            raise StateError(f"{trouble}: unknown or missing: {', '.join(wrong)}")
        try:
            part = kind.validate_json(json.dumps(given), strict=True)
        except ValidationError as error:
            raise StateError(f"{trouble}: {fault_text(error)}") from None
        if not all(_same_length(first[key], given[key]) for key in first):
            raise StateError(f"{trouble}: a list of another length")
        return part

    def _advance(self, frame: Frame) -> None:
        """Let the clock bring the next phase, if it is due; one at a frame."""
        status, now = self.status, frame.time + EARLY
        if status.phase == "running":
            status.elapsed = frame.time - status.running_time
            if now - status.running_time >= status.duration:
                self._time_out()
        elif status.phase == "ready" and now >= status.running_time:
            self._enter("running")
        elif status.phase == "initial" and now >= status.ready_time:
            self._enter("ready")

    def _enter(self, phase: Phase) -> None:
        self.status.phase = phase
        self.log(f"{self.name}: {self.status.summary()}")
        if phase == "ready" and self.locked and not self.held_throughout:
            self.act(Release(self.boat))
        self._rules.enter(phase, self._frame, self)

    def _time_out(self) -> None:
        """VRX's quirk is kept: a score for running out of time counts if it is above 0."""
        score = self._rules.timeout_score(self.status)
        self.status.elapsed, self.status.timed_out = self.status.duration, True
        if score is not None and score > 0.0:
            self.set_score(score)
        self._enter("finished")

    def _count_hits(self, frame: Frame) -> None:
        """Count a collision unless the dead time after the last one is not over; at most one at a frame."""
        other = max(frame.touches, key=lambda name: (frame.touches[name], name), default=None)
        if other is None or frame.touches[other] - self.status.last_hit <= self.buffer:
            return
        self.status.last_hit = frame.touches[other]
        number = ""
        if self._rules.counts_hits:
            self.status.collisions += 1
            number = f", collision {self.status.collisions}"
        self.log(f"{self.name}: {self.boat} hits {other}{number}", "WARN")
        self._rules.take_hit(other, frame, self)

    def _load_rules(self, state: Mapping[str, object]) -> None:
        self._rules.state = type(self._rules.state)(**deepcopy(dict(state)))
