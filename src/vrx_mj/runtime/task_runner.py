"""The task of a run: frames for its referee at a fixed rate, what the referee does to the world, and the score.

Frames are taken at absolute steps, with or without a recording, so that a score depends on the motion alone.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from vrx_mj.arguments import as_text
from vrx_mj.arrays import FloatArray
from vrx_mj.config.loading import fault_text
from vrx_mj.errors import CommandError, StateError, quote
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.timing import steps_to_multiple
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.referee import FrameLayout, Message, Referee, Verdict, frame_stride, parsed_dump

_NEVER = 1 << 62
"""Number of steps to the next frame without a task, or after its end."""
Event = tuple[float, str, str]
"""Time [s], text and level of a line that the referee wrote."""
TaskObservation = Mapping[str, Any]
"""Phase, times, score and outputs of a task, as a team sees them."""


@dataclass(frozen=True)
class Notes:
    """Part of a dump that is not the referee's own."""

    seen: Annotated[int, Field(ge=-1, le=1 << 53)]
    """Number of the step of the last frame."""
    sent: list[tuple[str, Any]]
    """Messages for the next frame: topic and content."""
    lines: list[Event]
    """Lines of the referee's log: time [s], text and level."""


_NOTES: TypeAdapter[Notes] = TypeAdapter(Notes)


class Decision(NamedTuple):
    """Result of a frame of a task."""

    row: FloatArray
    """Row of the frame, as `FrameLayout` has it."""
    messages: tuple[Message, ...]
    """Messages that the referee has read."""
    verdict: Verdict


class TaskRunner:
    """Runs the task of a world: frames for its referee, and what that decides; without a task it does nothing."""

    def __init__(self, world: World, arrays: LoopArrays, pose: Callable[[str], FloatArray]) -> None:
        """The referee of a world's task; `pose` gives position and quaternion, (7,), of a body by its name."""
        task = world.parameters.task
        self.referee: Referee | None = make_referee(task) if task else None
        self.bind(world, arrays, pose)
        self._earth = world.parameters.georeference
        self._stride = frame_stride(arrays.timestep)
        self.reset()

    def bind(self, world: World, arrays: LoopArrays, pose: Callable[[str], FloatArray]) -> None:
        """Go on in a world in which boats have come or gone: others can be touched now."""
        self._arrays, self._pose = arrays, pose
        self.layout = FrameLayout((), ())
        if self.referee:
            self.layout = FrameLayout.of(world.parameters.task, self.referee.watched)

    def reset(self) -> None:
        """Begin the task anew."""
        self._seen = -1
        self._sent: list[Message] = []
        self._record: list[Event] = []
        if self.referee:
            self.referee.restart()

    @property
    def over(self) -> bool:
        """Whether there is no task, or it is finished."""
        return self.referee is None or self.referee.is_over

    def steps(self, time: float) -> int:
        """Steps from `time` [s] to the next frame."""
        if self.over:
            return _NEVER
        return steps_to_multiple(time, self._arrays.timestep, self._stride)

    def look(self, time: float) -> Decision | None:
        """Pass the present frame, `time` [s], to the referee; None unless one is due that it has not seen."""
        if self.referee is None or self.referee.is_over:
            return None
        step = round(time / self._arrays.timestep)
        if step == self._seen or step % self._stride:
            return None
        self._seen = step
        row = np.concatenate(([time], *(self._pose(name) for name in self.layout.watched), self._arrays.touches))
        messages, self._sent = tuple(self._sent), []
        verdict = self.referee.look(self.layout.frame(row.tolist(), messages))
        self._record += [(time, text, level) for text, level in verdict.lines]
        return Decision(row, messages, verdict)

    def send(self, topic: str, content: object) -> None:
        """Send something to the task; it arrives at the next frame.

        Raises:
            CommandError: the world has no task, or it takes no such message.
        """
        as_text("topic", topic)
        if self.referee is None:
            raise CommandError(f"{quote(topic)} cannot be sent: this world has no task")
        try:
            plain = json.loads(json.dumps(content, allow_nan=False))
        except (TypeError, ValueError, RecursionError) as error:
            raise CommandError(
                f"invalid message {quote(topic)}: plain data with finite numbers is needed: {error}"
            ) from None
        self._sent.append(self.referee.accept(topic, self._in_world(plain)))

    def observe(self) -> TaskObservation:
        """Observation of the task for the team."""
        assert self.referee is not None, "a world without a task"
        return {
            **self.referee.info,
            **{topic: self._on_earth(output) for topic, output in self.referee.outputs.items()},
        }

    @property
    def events(self) -> tuple[Event, ...]:
        """Lines of the referee's log so far: time [s], text and level."""
        return tuple(self._record)

    def dump(self) -> str:
        """All that changes, as JSON."""
        if self.referee is None:
            return ""
        sent = [[message.topic, message.content] for message in self._sent]
        return json.dumps({"seen": self._seen, "sent": sent, "lines": self._record, **self.referee.dump()})

    def load(self, text: str) -> None:
        """Go on from what `dump` gave.

        Raises:
            StateError: it is of another task.
        """
        self.check(text)
        if self.referee is None:
            return
        state = parsed_dump(text)
        self.referee.load(state)
        self._seen = int(state["seen"])
        self._sent = [Message(topic, content) for topic, content in state["sent"]]
        self._record = [(time, line, level) for time, line, level in state["lines"]]

    def check(self, text: str) -> None:
        """Check that `load` can take this.

        Raises:
            StateError: it is of another task, or damaged.
        """
        if (self.referee is None) != (not text):
            raise StateError("the state does not fit this run: only one of them has a task")
        if self.referee is None:
            return
        state = parsed_dump(text)
        try:
            notes: Notes = _NOTES.validate_json(text, strict=True)
            for topic, content in notes.sent:
                self.referee.accept(topic, content)
        except (ValidationError, CommandError) as error:
            why = fault_text(error) if isinstance(error, ValidationError) else str(error)
            raise StateError(f"the state of the task '{self.referee.type}' is damaged: {why}") from None
        self.referee.check(state)

    def _on_earth(self, output: object) -> object:
        """An output with latitude and longitude [degrees] where a moving thing's are left open, and yaws from east."""
        if isinstance(output, list):
            return [self._on_earth(item) for item in output]
        if self._earth is None or not isinstance(output, dict):
            return output
        if "yaw" in output:
            output = {**output, "yaw_from_east": output["yaw"] + self._earth.x_from_east}
        if output.get("latitude", 0.0) is not None:
            return output
        latitude, longitude, _ = self._earth.to_geodetic(output["x"], output["y"], output.get("z", 0.0))
        return {**output, "latitude": latitude, "longitude": longitude}

    def _in_world(self, content: object) -> object:
        """The content with x and y [m, ENU] instead of latitude and longitude [degrees]."""
        if not isinstance(content, dict) or not {"latitude", "longitude"} <= content.keys() or self._earth is None:
            return content
        rest = {key: value for key, value in content.items() if key not in ("latitude", "longitude", "altitude")}
        try:
            x, y, _ = self._earth.to_enu(float(content["latitude"]), float(content["longitude"]))
        except (TypeError, ValueError):
            return content
        return {**rest, "x": x, "y": y}
