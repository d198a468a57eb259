"""The referee: phases, times and collisions, which all tasks share, and the frames that it sees.

As in VRX a phase begins by the clock, one transition at a time: `ready` after the initial duration, `running` after
the ready one. The task ends when its rules end it, or when its time is up. A frame says where things are, what the
boat touched and what its team sent; rules of a task say what that does to the world and to the score.
"""

import json
import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from vrx_mj.config.loading import fault_text
from vrx_mj.config.tree import literal
from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, StateError
from vrx_mj.frames import Vector, heading
from vrx_mj.model.tasks import TaskBase, followed_things

Count = Annotated[int, Field(ge=0, le=1 << 53)]
"""A number of things."""
Place = Annotated[list[float], Field(min_length=3, max_length=3)]
"""x, y, z [m]."""


Phase = Literal["initial", "ready", "running", "finished"]
FRAME_RATE = 20.0
"""Frames per simulated second [Hz], at least: the next rate above that divides a second into whole steps.

Recordings have rows at the same steps, so that a recording gives the score that the run gave."""
_POSE = 7
"""Numbers of a pose: position and quaternion."""
_DEAD_TIME_VRX3 = 3.0
"""Dead time after a collision in VRX 3 [s], which does not read the value of a world (ScoringPlugin.cc)."""


def has_started(phase: str) -> bool:
    """Whether a task in a phase has started: before that it has no score."""
    return phase in ("running", "finished")


def score_text(phase: str, score: float | None, unit: str = "") -> str:
    """The score in words; before the task has started there is no score."""
    return f"score {score:.4g} {unit}".rstrip() if has_started(phase) else "no score yet"


@dataclass
class TaskStatus:
    """Status that every task has, as in VRX's `/vrx/task/info`. Times are simulated, from the world's start [s]."""

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
        return heading(*self.quaternion)


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a team to its task."""

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
    """Time [s] of the last touch of the scored boat with each thing that it has touched, by name."""
    messages: tuple[Message, ...] = ()
    """Sent since the frame before, in their order."""


@dataclass(frozen=True)
class FrameLayout:
    """Columns of a row: time, then x, y, z, qw, qx, qy, qz of every watched body, then times of touches."""

    watched: tuple[str, ...]
    rivals: tuple[str, ...]
    """Things that the boat may touch; the time [s] of its last touch is negative until there was one."""

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


@dataclass(frozen=True, slots=True)
class Release:
    """Release the boat."""

    boat: str


@dataclass(frozen=True, slots=True)
class PlaceObject:
    """Put a floating object somewhere, at rest."""

    name: str
    pose: tuple[float, float, float, float, float, float]
    """x, y, z [m], roll, pitch, yaw [rad], ENU."""


@dataclass(frozen=True, slots=True)
class LightUp:
    """Make a light buoy show three colours in turn, from a second later on."""

    name: str
    colors: tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class ShowSymbol:
    """Make a placard show a symbol."""

    placard: str
    symbol: str
    """Symbol, such as `red_circle`."""


@dataclass(frozen=True, slots=True)
class SetPinger:
    """Put the beacon that all receivers of a boat hear somewhere."""

    boat: str
    position: Vector
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

    @property
    def outputs(self) -> "Outputs":
        """Errors that a team observes; empty before the first frame."""
        return {"pose_error": self.error, "mean_pose_error": self.mean} if self.frames else {}

    def add(self, error: float) -> float:
        """Take in the error of a frame [m]; returns the mean."""
        self.frames, self.total, self.error = self.frames + 1, self.total + error, error
        return self.mean


_adapter = cache(TypeAdapter[Any])
_DUMP, _STATUS = _adapter(dict[str, Any]), _adapter(TaskStatus)


Dump = dict[str, Any]
"""State of a task as plain data, as JSON holds it."""


def dead_time(task: TaskBase) -> float:
    """How long after a counted collision none counts [s]: in VRX the value of the world, cut to whole seconds."""
    return _DEAD_TIME_VRX3 if task.profile == "vrx3" else float(math.floor(task.collision_buffer))


@dataclass(frozen=True)
class Verdict:
    """Result of a frame."""

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
"""Data that a team may read of its task, by topic: plain, as JSON holds it."""


class Referee:
    """One task of a compiled world under way; a subclass has the rules of a kind of task.

    By default phases and hits change nothing, the score stays when time is up, and no messages are taken.
    """

    state: Any
    """All that changes besides `status`: a dataclass of numbers, strings, lists and dicts."""
    counts_hits = True
    """Whether a hit goes into the count of collisions."""
    title = "the task"
    """Name in error messages."""
    message: str | None = None
    """Topic of the message that a team may send."""
    watches_early = False
    """Whether `update` sees the frames before the task runs, too."""

    def __init__(self, task: TaskBase, state: Any) -> None:
        """Begin in a state of the rules."""
        initial, ready, running = task.durations
        self.type, self.name, self.boat = task.type, task.name, task.boat
        self.buffer = dead_time(task)
        self.watched = (task.boat, *(name for name in followed_things(task) if name != task.boat))
        self.held_throughout = task.held
        self.locked = task.locked
        self._start = TaskStatus(initial, initial + ready, running)
        self._kind: Any = state.__class__
        self._first = asdict(state)
        self.restart()

    def restart(self) -> None:
        """Begin the task anew."""
        self.status = replace(self._start)
        self._load_state(self._first)
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
        if self.status.phase == "running" or (self.watches_early and not self.is_over):
            self.update(frame)
        verdict = Verdict(tuple(self._actions), tuple(self._lines))
        self._actions, self._lines = [], []
        return verdict

    def accept(self, topic: str, content: object) -> Message:
        """A message of the team, checked.

        Raises:
            CommandError: the task takes no such message, or its content is wrong.
        """
        if topic != self.message:
            raise CommandError(f"{self.title} takes no message {literal(topic)}; known: {self.message or 'none'}")
        return Message(topic, self.checked_content(content))

    @property
    def info(self) -> dict[str, object]:
        """Content of VRX's `/vrx/task/info`: phase, times [s], collisions and score; and which boat has the task."""
        return {"type": self.type, "name": self.name, "boat": self.boat, **self.status.info()}

    @property
    def progress(self) -> Outputs:
        """How far the parts of the task are, as `gates`: plain data, empty where the rules have none."""
        return deepcopy(dict(self.parts))

    # What a kind of task has of its own

    @property
    def parts(self) -> Mapping[str, object]:
        """How far the parts of the task are, such as gates, for maps and recordings: plain data."""
        return {}

    @property
    def outputs(self) -> Outputs:
        """Outputs of the task for the team besides phase, times and score."""
        return {}

    def enter(self, phase: Phase, frame: Frame) -> None:
        """Enter `ready`, `running` or `finished` (by `status.timed_out` or not) at this frame."""

    def update(self, frame: Frame) -> None:
        """Look at a frame, while the task runs; the frame at which it begins comes after `enter`."""

    def take_hit(self, other: str, frame: Frame) -> None:
        """Take a hit by the boat, outside the dead time after the hit before; `status.collisions` counts it."""

    def timeout_score(self) -> float | None:
        """The score of a run whose time is up, None for the one that it has; only one above 0 counts, as in VRX."""
        return None

    def check_state(self, state: Any) -> None:
        """Check of a saved `state` what types of fields and lengths of lists leave open.

        Raises:
            StateError: it cannot be a state of these rules.
        """

    def checked_content(self, content: object) -> object:
        """The content of a `message` as `Frame.messages` shall hold it.

        Raises:
            CommandError: it is wrong.
        """
        return content

    # What it does at a frame

    def set_score(self, score: float) -> None:
        """Write the score; ignored unless the task is running, as in VRX."""
        if self.status.phase == "running":
            self.status.score = score

    def finish(self) -> None:
        """End the task, not timed out."""
        self._enter("finished")

    def act(self, action: Action) -> None:
        """Order an action on the world, at this frame."""
        self._actions.append(action)

    def log(self, text: str, level: str = "INFO") -> None:
        """Write a line into the log."""
        self._lines.append((text, level))

    # State

    def dump(self) -> dict[str, object]:
        """All that changes, as plain data."""
        return {"type": self.type, "sheet": dict(vars(self.status)), "rules": asdict(self.state)}

    def load(self, state: Dump) -> None:
        """Go on from what `dump` gave.

        Raises:
            StateError: it is of another task.
        """
        self.check(state)
        self._load_state(state["rules"])
        self.status = TaskStatus(**state["sheet"])

    def check(self, state: Mapping[str, object]) -> None:
        """Check that `load` can take this.

        Raises:
            StateError: it is of another task.
        """
        if state.get("type") != self.type:
            raise StateError(f"the state is of the task {literal(state.get('type'))}, not '{self.type}'")
        self._fitting(_STATUS, "sheet", asdict(self._start), state)
        self.check_state(self._fitting(_adapter(self._kind), "rules", self._first, state))

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
        """Enter the next phase if it is due, at most one in a frame."""
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
        self.enter(phase, self._frame)

    def _time_out(self) -> None:
        """VRX's quirk is kept: a score for running out of time counts if it is above 0."""
        score = self.timeout_score()
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
        if self.counts_hits:
            self.status.collisions += 1
            number = f", collision {self.status.collisions}"
        self.log(f"{self.name}: {self.boat} hits {other}{number}", "WARN")
        self.take_hit(other, frame)

    def _load_state(self, state: Mapping[str, object]) -> None:
        self.state = self._kind(**deepcopy(dict(state)))
