"""What the node tf2_web_republisher does for pages that show frames, as by ROSLIB.TFClient: a service and an action."""

import asyncio
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.frames import conjugate, quaternion_product, rotation_matrix, rotation_vector
from vrx_mj.ros.graph import Graph, Service, Wire
from vrx_mj.ros.interface import Answer
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.table.boats import transform

_PACKAGE = "tf2_web_republisher"
_ARRAY, _PROGRESS = f"{_PACKAGE}/TFArray", f"{_PACKAGE}/TFSubscriptionActionFeedback"
_GOAL, _CANCEL, _FEEDBACK = (f"/{_PACKAGE}/{name}" for name in ("goal", "cancel", "feedback"))
_STILL, _MOVING, _FRAMES = "/tf_static", "/tf", "tf2_msgs/TFMessage"
_RATES = 0.1, 100.0
"""Messages per second of wall time for one page, from and to [Hz]."""
_MOST_ASKED, _MOST_SOURCES, _MOST_FRAMES, _DEEPEST = 64, 256, 10_000, 100
"""Requests that are served, the oldest of which goes; frames that each has; frames that are known; in each other."""
_LEAST_TIMEOUT = 1.0
"""Wall time for which nobody may listen before a request ends [s]."""
_ACTIVE = 1
"""Status ACTIVE of actionlib_msgs/GoalStatus."""


@dataclass
class _Asked:
    """What a page wants to have."""

    topic: str
    type: str
    """Type of the topic's messages."""
    wanted: Message
    """A TFSubscriptionGoal, or a request of the service, which has its fields."""
    make: Callable[[list[Message]], Message]
    """Makes the topic's message of transforms."""
    timeout: float = _LEAST_TIMEOUT
    heard: float = -math.inf
    """When somebody was last seen to listen [s]."""
    sent: dict[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    """Position and quaternion of each frame, as sent last."""


class Republisher(Wire):
    """Frames by their names, as they are known last, and the pages that ask for them: a wire of the graph."""

    def __init__(self, graph: Graph) -> None:
        self._graph, self._numbers = graph, itertools.count()
        self._frames: dict[str, tuple[str, FloatArray, FloatArray]] = {}
        """Parent of each, position and quaternion in that."""
        self._asked: dict[str, _Asked] = {}

    def open(self) -> None:
        """Offer the service; topics come with the first page that uses them."""
        self._graph.wires.append(self)
        service = Service(self._graph.node, f"{_PACKAGE}/RepublishTFs", self._serve)
        self._graph.provide("/republish_tfs", service)

    def registration_changed(self, kind: str, name: str) -> None:
        """A page that is about to publish a goal has somebody who listens."""
        if kind == "publisher" and name == _GOAL and not self._graph.is_local("subscriber", _GOAL):
            node, register = self._graph.node, self._graph.register
            register("subscriber", _GOAL, node, f"{_PACKAGE}/TFSubscriptionActionGoal")
            register("subscriber", _CANCEL, node, "actionlib_msgs/GoalID")
            register("publisher", _FEEDBACK, node, _PROGRESS)
            self.listened |= {_GOAL, _CANCEL}

    def deliver(self, name: str, type_name: str, message: Message) -> None:
        """Take frames, goals, and the end of goals."""
        if name in {_MOVING, _STILL} and self._asked:
            for one in message.transforms:
                self._keep(one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/"), one.transform)
        elif name == _CANCEL:
            self._end(message.id)
        elif name == _GOAL:
            status = {"goal_id": message.goal_id, "status": _ACTIVE}
            asked = _Asked(_FEEDBACK, _PROGRESS, message.goal, lambda found: new(
                _PROGRESS, header=message.header, status=status, feedback={"transforms": found}))  # fmt: skip
            try:
                self._begin(message.goal_id.id, asked)
            except CommandError as error:
                self._graph.notices.write("WARN", "goal", _GOAL, f"{_GOAL}: {error}")

    def _serve(self, request: Message, _caller: str, answer: Answer) -> None:
        topic = f"/{_PACKAGE}/tf_repub_{next(self._numbers)}"
        timeout = max(request.timeout.sec + 1e-9 * request.timeout.nanosec, _LEAST_TIMEOUT)
        try:
            self._begin(topic, _Asked(topic, _ARRAY, request, lambda found: new(_ARRAY, transforms=found), timeout))
        except CommandError as error:
            answer(None, str(error))
        else:
            answer(new(f"{_PACKAGE}/RepublishTFsResponse", topic_name=topic), "")

    def _begin(self, key: str, asked: _Asked) -> None:
        wanted, (low, high) = asked.wanted, _RATES
        if not low <= wanted.rate <= high or len(wanted.source_frames) > _MOST_SOURCES:
            what = f"rate {wanted.rate:g} Hz of {len(wanted.source_frames)} frames"
            raise CommandError(f"invalid {what}; allowed: {low:g} to {high:g} Hz, {_MOST_SOURCES} frames")
        if len(self._asked) >= _MOST_ASKED:
            self._end(next(iter(self._asked)))
        self._asked[key] = asked
        if asked.topic != _FEEDBACK:
            self._graph.register("publisher", asked.topic, self._graph.node, _ARRAY)
        if not {_MOVING, _STILL} <= self.listened:
            self.listened |= {_MOVING, _STILL}
            for name in (_STILL, _MOVING):
                self._graph.register("subscriber", name, self._graph.node, _FRAMES)
                for message in self._graph.latched_messages(name):
                    self.deliver(name, _FRAMES, message)
        asked.heard = asyncio.get_running_loop().time()
        self._send(key, asked)

    def _send(self, key: str, asked: _Asked) -> None:
        """Send what has moved, again and again until nobody listens."""
        loop = asyncio.get_running_loop()
        is_heard = bool(self._graph.registrations.apis("subscriber", asked.topic))
        if is_heard:
            asked.heard = loop.time()
        if self._asked.get(key) is not asked:
            return
        if loop.time() - asked.heard > asked.timeout:
            self._end(key)
            return
        moved = self._transforms_of_moved(asked) if is_heard else []
        if moved:
            self._graph.publish(asked.topic, asked.type, asked.make(moved), self._graph.node)
        loop.call_later(1.0 / asked.wanted.rate, self._send, key, asked)

    def _end(self, key: str) -> None:
        asked = self._asked.pop(key, None)
        if asked is not None and asked.topic != _FEEDBACK:
            self._graph.unregister("publisher", asked.topic, self._graph.node)
        if not self._asked:
            self.listened -= {_MOVING, _STILL}
            self._frames.clear()
            for name in (_MOVING, _STILL):
                self._graph.unregister("subscriber", name, self._graph.node)

    def _transforms_of_moved(self, asked: _Asked) -> list[Message]:
        wanted, found = asked.wanted, []
        target = wanted.target_frame.lstrip("/")
        base, at, turn = self._in_root(target)
        for source in wanted.source_frames:
            root, place, by = self._in_root(source.lstrip("/"))
            if root != base or not root:
                continue
            place, by = rotation_matrix(turn).T @ (place - at), quaternion_product(conjugate(turn), by)
            before, was = asked.sent.get(source, (np.full(3, np.inf), by))
            angle = np.linalg.norm(rotation_vector(quaternion_product(conjugate(was), by)))
            if math.dist(place, before) > wanted.trans_thres or angle > wanted.angular_thres:
                asked.sent[source] = place, by
                found.append(transform(self._graph.time, target, source.lstrip("/"), place, by))
        return found

    def _keep(self, parent: str, child: str, moved: Message) -> None:
        at, turn = moved.translation, moved.rotation
        place, by = np.array([at.x, at.y, at.z]), np.array([turn.w, turn.x, turn.y, turn.z])
        is_sound = abs(np.linalg.norm(by) - 1.0) < 0.01 and np.isfinite(place).all()  # tf2 takes no others
        if is_sound and (child in self._frames or len(self._frames) < _MOST_FRAMES):
            self._frames[child] = parent, place, by

    def _in_root(self, frame: str) -> tuple[str, FloatArray, FloatArray]:
        """The root of a frame's tree, position and quaternion in that; an empty name for a loop."""
        place, turn = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        for _ in range(_DEEPEST):
            if frame not in self._frames:
                return frame, place, turn
            frame, at, by = self._frames[frame]
            place, turn = at + rotation_matrix(by) @ place, quaternion_product(by, turn)
        return "", place, turn
