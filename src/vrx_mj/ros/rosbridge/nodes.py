"""What rosapi answers about topics, services, types and parameters, and tf2_web_republisher for ROSLIB.TFClient."""

import asyncio
import inspect
import itertools
import json
import math
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from vrx_mj.arguments import check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.frames import conjugate, quaternion_product, rotation_matrix, rotation_vector
from vrx_mj.ros.graph import Graph, Service, Wire
from vrx_mj.ros.interface import Answer
from vrx_mj.ros.messages import (
    INTEGERS,
    MOMENT,
    SPAN,
    Message,
    definition,
    fields,
    full_name,
    known_type,
    known_types,
    new,
    ros1_name,
    stamp,
    typestore,
)
from vrx_mj.ros.parameters import plain
from vrx_mj.ros.rosbridge.codec import absolute, json_bytes
from vrx_mj.ros.rosbridge.topics import Services
from vrx_mj.ros.table.boats import transform

_EXAMPLES = dict.fromkeys(INTEGERS, "0") | {"float32": "0.0", "float64": "0.0", "bool": "False", "string": ""}
"""Examples of values, by type."""
_TIME_DETAILS = {
    "fieldnames": ["secs", "nsecs"],
    "fieldtypes": ["int32", "int32"],
    "fieldarraylen": [-1, -1],
    "examples": ["0", "0"],
    "constnames": [],
    "constvalues": [],
}
"""Answer of rosapi about time and duration."""
_ACTION_TOPICS = frozenset({"cancel", "feedback", "goal", "result", "status"})
"""Topics of an action."""
_CONVERSIONS: Mapping[str, Callable[[str], str]] = {
    "type": ros1_name,
    "topic": absolute,
    "service": absolute,
    "node": absolute,
    "name": lambda name: "/" if name == "/" else absolute(name),
}
"""Conversions of arguments, by name."""
_PACKAGE = "tf2_web_republisher"
"""Package of the republisher of frames."""
_ARRAY, _PROGRESS = f"{_PACKAGE}/TFArray", f"{_PACKAGE}/TFSubscriptionActionFeedback"
_GOAL, _CANCEL, _FEEDBACK = (f"/{_PACKAGE}/{name}" for name in ("goal", "cancel", "feedback"))
_STATIC_TOPIC, _MOVING_TOPIC, _FRAMES_TYPE = "/tf_static", "/tf", "tf2_msgs/TFMessage"
"""Topics of static and of moving frames, and their type."""
_RATES = 0.1, 100.0
"""Least and largest rate of messages for one page [Hz of wall time]."""
_MOST_ASKED, _MOST_SOURCES, _MOST_FRAMES, _MAX_DEPTH = 64, 256, 10_000, 100
"""Largest numbers of requests that are served, of which the oldest is dropped; of frames of each; of known frames; and
of frames in each other."""
_LEAST_TIMEOUT = 1.0
"""Least wall time without a listener after which a request ends [s]."""
_ACTIVE = 1
"""Status ACTIVE of actionlib_msgs/GoalStatus."""


def _typedefs(type_name: str) -> list[dict[str, object]]:
    """A message type, then those that it uses; UnknownNameError: the type is unknown."""
    waiting, definitions = [known_type(type_name)], {}
    while waiting:
        name = waiting.pop(0)
        if name in definitions:
            continue
        definitions[name] = {"type": name} | (_TIME_DETAILS if name in {MOMENT, SPAN} else _typedef(name))
        if name not in {MOMENT, SPAN}:
            waiting += [one.type for one in fields(name).values() if "/" in one.type or one.type in {MOMENT, SPAN}]
    return list(definitions.values())


def _typedef(name: str) -> dict[str, object]:
    parts = fields(name).values()
    constants = typestore().fielddefs[full_name(name)][0]
    return {
        "fieldnames": [field.name for field in parts],
        "fieldtypes": [ros1_name(field.type) if "/" in field.type else field.type for field in parts],
        "fieldarraylen": [field.length for field in parts],
        "examples": ["[]" if field.length >= 0 else _EXAMPLES.get(field.type, "{}") for field in parts],
        "constnames": [key for key, _, _ in constants],
        "constvalues": [str(value) for _, _, value in constants],
    }


_Values = dict[str, Any]


class Rosapi:
    """Answers in the form of rosapi's service types, by the names of their fields."""

    def __init__(self, graph: Graph, services: Services) -> None:
        self._graph, self._services = graph, services

    def provide(self) -> None:
        """Register all services."""
        for method_name in vars(Rosapi):
            if method_name.startswith("_on_"):
                name = method_name.removeprefix("_on_")
                words = name.replace("action_servers", "get_action_servers").split("_")
                type_name = "".join(word.capitalize() for word in words)
                answer = partial(self._answer, getattr(self, method_name))
                self._services.build_in(f"/rosapi/{name}", f"rosapi/{type_name}", answer)

    def _answer(self, method: Callable[..., object], asked: object) -> object:
        """Answer of a method whose parameters are the request's fields; a request may also be a list of these.

        An answer about parameters of this process is made at once: that is time of the client.
        """
        parameters = inspect.signature(method).parameters.values()
        fields = {one.name.rstrip("_"): one.default for one in parameters}
        given = dict(zip(fields, asked, strict=False)) if isinstance(asked, list) else asked
        answer = method(*(_argument(given, name, default) for name, default in fields.items()))
        is_here = "param" in method.__name__ and self._graph.remote_master is None
        return _result(answer) if is_here and inspect.iscoroutine(answer) else answer

    def _on_topics(self) -> _Values:
        types = self._graph.topics()
        return {"topics": list(types), "types": list(types.values())}

    def _on_topics_for_type(self, type_: str) -> _Values:
        return {"topics": [name for name, kind in self._graph.topics().items() if kind == type_]}

    def _on_topics_and_raw_types(self) -> _Values:
        types = self._graph.topics()
        texts = [definition(kind) if kind in known_types() else "" for kind in types.values()]
        return {"topics": list(types), "types": list(types.values()), "typedefs_full_text": texts}

    def _on_topic_type(self, topic: str) -> _Values:
        return {"type": self._graph.type_of(topic) or ""}

    def _on_services(self) -> _Values:
        return {"services": sorted(self._graph.registrations.names("service"))}

    def _on_services_for_type(self, type_: str) -> _Values:
        known = sorted(self._graph.services.items())
        return {"services": [name for name, service in known if ros1_name(service.type) == type_]}

    def _on_service_type(self, service: str) -> _Values | Awaitable[_Values]:
        known = self._graph.services.get(service)
        if known is None and self._graph.registrations.apis("service", service):
            return self._type_elsewhere(service)
        return {"type": ros1_name(known.type) if known else ""}

    async def _type_elsewhere(self, name: str) -> _Values:
        assert self._graph.remote_call is not None, "who else has registered it"
        type_name, _ = await self._graph.remote_call(name, None)
        return {"type": type_name}

    def _on_service_node(self, service: str) -> _Values:
        return {"node": self._node(service)}

    def _on_service_host(self, service: str) -> _Values:
        self._node(service)
        return {"host": self._services.host(service)}

    def _on_service_request_details(self, type_: str) -> _Values:
        return {"typedefs": _typedefs(f"{type_}Request")}

    def _on_service_response_details(self, type_: str) -> _Values:
        return {"typedefs": _typedefs(f"{type_}Response")}

    def _on_message_details(self, type_: str) -> _Values:
        return {"typedefs": _typedefs(type_)}

    def _on_nodes(self) -> _Values:
        nodes = self._graph.registrations.nodes
        return {"nodes": sorted(nodes, key=lambda node: (node != self._graph.node, node))}

    def _on_node_details(self, node: str) -> _Values:
        known = self._graph.registrations
        check_name("node", node, known.nodes)
        names = {"subscribing": "subscriber", "publishing": "publisher", "services": "service"}
        return {
            key: sorted(name for name in known.names(kind) if node in self._holders(kind, name))
            for key, kind in names.items()
        }

    def _on_publishers(self, topic: str) -> _Values:
        return {"publishers": self._holders("publisher", topic)}

    def _on_subscribers(self, topic: str) -> _Values:
        return {"subscribers": self._holders("subscriber", topic)}

    def _on_action_servers(self) -> _Values:
        parts: dict[str, set[str]] = {}
        for name in self._graph.topics():
            space, _, last = name.rpartition("/")
            parts.setdefault(space, set()).add(last)
        return {"action_servers": [space for space, names in parts.items() if names >= _ACTION_TOPICS]}

    def _on_get_time(self) -> _Values:
        now = stamp(self._graph.time)
        return {"time": {"secs": now.sec, "nsecs": now.nanosec}}

    async def _on_get_param_names(self) -> _Values:
        return {"names": sorted(await self._master("getParamNames") or [])}

    async def _on_get_param(self, name: str, default: str = "") -> _Values:
        value = await self._master("getParam", name)
        try:
            return {"value": default or "null" if value is None else json_bytes(value).decode("ascii")}
        except TypeError as error:
            raise CommandError(f"get_param: {error}") from error

    async def _on_set_param(self, name: str, value: str) -> _Values:
        try:
            decoded = json.loads(value)
        except (ValueError, RecursionError) as error:
            raise CommandError(f"set_param: value {value[:60]!r} is not JSON: {error}") from error
        if await self._master("setParam", name, plain(decoded)) is None:
            raise CommandError(f"{name}: the master does not set this parameter")
        return {}

    async def _on_has_param(self, name: str) -> _Values:
        return {"exists": bool(await self._master("hasParam", name))}

    async def _on_delete_param(self, name: str) -> _Values:
        if await self._master("deleteParam", name) is None:
            raise CommandError(f"{name}: no such parameter")
        return {}

    async def _on_search_param(self, name: str) -> _Values:
        return {"global_name": str(await self._master("searchParam", name.strip("/")) or "")}

    async def _master(self, method: str, *values: Any) -> Any:
        """The value that the master answers about parameters, ours or another process's; None where it fails."""
        graph = self._graph
        if graph.remote_master is not None:
            return await graph.remote_master(method, values)
        calls: Mapping[str, Callable[..., object]] = {
            "getParamNames": graph.parameters.names,
            "getParam": graph.parameters.get,
            "hasParam": graph.parameters.has,
            "searchParam": partial(graph.parameters.search, graph.node),
            "setParam": partial(graph.set_parameter, setter=""),
            "deleteParam": graph.delete_parameter,
        }
        try:
            found = calls[method](*values)
        except KeyError:
            return None
        return method in {"setParam", "deleteParam"} or found

    def _holders(self, kind: str, name: str) -> list[str]:
        nodes = self._graph.registrations.holders(kind, name)
        return sorted(nodes, key=lambda node: (node != self._graph.node, node))

    def _node(self, service: str) -> str:
        holders = self._holders("service", service)
        if not holders:
            raise UnknownNameError("service", service, self._graph.registrations.names("service"))
        return holders[0]


def _result(answer: Coroutine[object, None, _Values]) -> _Values:
    """The result of a coroutine that waits for nothing."""
    try:
        answer.send(None)
    except StopIteration as done:
        return dict(done.value)
    raise AssertionError("it waits for something")


def _argument(asked: object, name: str, default: object) -> str:
    value = asked.get(name, default) if isinstance(asked, Mapping) else default
    if not isinstance(value, str):
        raise CommandError(f"{name} is missing, or not a string: the request is {{'{name}': '...'}}")
    return _CONVERSIONS.get(name, str)(value)


@dataclass
class _Request:
    """A message that a page wants."""

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
        self._asked: dict[str, _Request] = {}

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
        if name in {_MOVING_TOPIC, _STATIC_TOPIC} and self._asked:
            for one in message.transforms:
                self._keep(one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/"), one.transform)
        elif name == _CANCEL:
            self._end(message.id)
        elif name == _GOAL:
            status = {"goal_id": message.goal_id, "status": _ACTIVE}
            asked = _Request(_FEEDBACK, _PROGRESS, message.goal, lambda found: new(
                _PROGRESS, header=message.header, status=status, feedback={"transforms": found}))  # fmt: skip
            try:
                self._begin(message.goal_id.id, asked)
            except CommandError as error:
                self._graph.notices.write("WARN", "goal", _GOAL, f"{_GOAL}: {error}")

    def _serve(self, request: Message, _caller: str, answer: Answer) -> None:
        topic = f"/{_PACKAGE}/tf_repub_{next(self._numbers)}"
        timeout = max(request.timeout.sec + 1e-9 * request.timeout.nanosec, _LEAST_TIMEOUT)
        try:
            self._begin(topic, _Request(topic, _ARRAY, request, lambda found: new(_ARRAY, transforms=found), timeout))
        except CommandError as error:
            answer(None, str(error))
        else:
            answer(new(f"{_PACKAGE}/RepublishTFsResponse", topic_name=topic), "")

    def _begin(self, key: str, asked: _Request) -> None:
        wanted, (low, high) = asked.wanted, _RATES
        if not low <= wanted.rate <= high or len(wanted.source_frames) > _MOST_SOURCES:
            what = f"rate {wanted.rate:g} Hz of {len(wanted.source_frames)} frames"
            raise CommandError(f"invalid {what}; allowed: {low:g} to {high:g} Hz, {_MOST_SOURCES} frames")
        if len(self._asked) >= _MOST_ASKED:
            self._end(next(iter(self._asked)))
        self._asked[key] = asked
        if asked.topic != _FEEDBACK:
            self._graph.register("publisher", asked.topic, self._graph.node, _ARRAY)
        if not {_MOVING_TOPIC, _STATIC_TOPIC} <= self.listened:
            self.listened |= {_MOVING_TOPIC, _STATIC_TOPIC}
            for name in (_STATIC_TOPIC, _MOVING_TOPIC):
                self._graph.register("subscriber", name, self._graph.node, _FRAMES_TYPE)
                for message in self._graph.latched_messages(name):
                    self.deliver(name, _FRAMES_TYPE, message)
        asked.heard = asyncio.get_running_loop().time()
        self._send(key, asked)

    def _send(self, key: str, asked: _Request) -> None:
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
            self.listened -= {_MOVING_TOPIC, _STATIC_TOPIC}
            self._frames.clear()
            for name in (_MOVING_TOPIC, _STATIC_TOPIC):
                self._graph.unregister("subscriber", name, self._graph.node)

    def _transforms_of_moved(self, asked: _Request) -> list[Message]:
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
        for _ in range(_MAX_DEPTH):
            if frame not in self._frames:
                return frame, place, turn
            frame, at, by = self._frames[frame]
            place, turn = at + rotation_matrix(by) @ place, quaternion_product(by, turn)
        return "", place, turn
