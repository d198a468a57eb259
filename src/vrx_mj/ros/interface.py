"""What a simulation offers to networks, whichever they are, and what they bring for it.

An interface is made once for the boats that there are, and again when boats come or go. Every function in it is
called by the simulation's own thread.

VRX 3's topics on ROS 2 carry the same content in messages of their own.
"""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from vrx_mj.ros import cdr, messages
from vrx_mj.ros.cdr import kind
from vrx_mj.ros.limits import Mailbox
from vrx_mj.ros.messages import Message, new, stamp
from vrx_mj.sensors.view import CATEGORY_NAMES

Dialect = Literal["vrx", "vrx3"]
"""Names and types of topics: VRX's on ROS 1, or VRX 3's on ROS 2."""
VRX: tuple[Dialect, ...] = ("vrx",)
"""Dialect of VRX, on ROS 1."""
VRX3: tuple[Dialect, ...] = ("vrx3",)
"""Dialect of VRX 3, on ROS 2."""
BOTH = VRX + VRX3
"""Both dialects."""
ROSOUT, LOG = "/rosout", "rosgraph_msgs/Log"
"""Topic of log messages, and their type."""
LEVELS = {"DEBUG": 1, "INFO": 2, "WARN": 4, "ERROR": 8, "FATAL": 16}
"""Levels of rosgraph_msgs/Log."""
MOST_CALLS = 256
"""Largest number of calls of services that wait; more are refused."""
MOST_UNKNOWN_PUBLISHERS = 256
"""Largest number of publishers of unknown topics that are kept."""
PACKAGES = (
    "geometry_msgs",
    "nav_msgs",
    "rcl_interfaces",
    "ros_gz_interfaces",
    "rosgraph_msgs",
    "sensor_msgs",
    "std_msgs",
    "tf2_msgs",
    "vision_msgs",
    "visualization_msgs",
)
"""Packages of the types that VRX 3's topics have."""
_KINDS = {bool: (1, "bool_value"), int: (2, "integer_value"), float: (3, "double_value"), str: (4, "string_value")}
"""Numbers of rcl_interfaces/ParameterType, and the fields that hold the values."""


@dataclass(frozen=True, eq=False)
class Output:
    """A topic that the simulation publishes."""

    name: str
    """Absolute, as `/wamv/joint_states`."""
    type: str
    """ROS 1 name of the message type, such as `sensor_msgs/JointState`."""
    make: Callable[..., Message | None]
    """Gives the present message, a list of several, or None for none; of a sensor it takes the reading."""
    rate: float = 0.0
    """Messages per simulated second; 0: whenever there is a new one."""
    sensor: tuple[str, str] | None = None
    """Boat and sensor whose readings it carries."""
    blind: Callable[[], Message | None] | None = None
    """Gives the present message without a reading, where nothing else needs one: a camera's info needs no picture."""
    latched: bool = False
    """Whether who subscribes later gets the last message."""
    dialects: tuple[Dialect, ...] = VRX
    """Dialects that have this topic."""
    recorded: Literal["rows", "states", "nowhere"] = "states"
    """Part of a recording from which its messages can be made: its rows, its saved states, or nothing."""


@dataclass(frozen=True, eq=False)
class Input:
    """A topic to which the simulation subscribes."""

    name: str
    type: str
    take: Callable[[Message], None]
    """Raises a VrxError with what is wrong with a message."""
    boat: str | None = None
    """The boat that it commands."""
    dialects: tuple[Dialect, ...] = VRX
    """Dialects that have this topic."""


@dataclass(frozen=True, eq=False)
class Service:
    """A service of the simulation."""

    name: str
    type: str
    """ROS 1 name of the service type, such as `std_srvs/Empty`."""
    do: Callable[[Message], Mapping[str, object] | None]
    """Does what is asked and gives fields of the response; an exception fails the call."""
    reports: bool = False
    """Whether the response says how the call went: `success`, and `status_message` where its type has that."""
    dialects: tuple[Dialect, ...] = VRX
    """Dialects that have this service."""

    def answer(self, request: Message) -> Message:
        """Carry out a request; returns the response."""
        return self._response(True, "done", self.do(request) or {})

    def failure(self, why: str) -> Message | None:
        """The response that says why a call failed; None: the call has none, and fails."""
        return self._response(False, why, {}) if self.reports else None

    def _response(self, success: bool, text: str, fields: Mapping[str, object]) -> Message:
        kind = f"{self.type}Response"
        types = cdr if self.dialects == VRX3 else messages
        report = {"success": success, "status_message": f"{self.name.rpartition('/')[2]}: {text}"}
        has = types.kind(kind).__dataclass_fields__ if self.reports else ()
        values = {**{name: value for name, value in report.items() if name in has}, **fields}
        return types.new(kind, **values)


def log_message(time: float, level: str, node: str, text: str) -> Message:
    """A line for people of a node at a moment [s]; of an unknown level it is an error."""
    number = LEVELS.get(level, LEVELS["ERROR"])
    return new(LOG, header={"stamp": stamp(time)}, level=number, name=node, msg=text)


Entry = Output | Input | Service
"""A topic or a service."""


@dataclass(frozen=True)
class RosInterface:
    """All that a simulation offers, by name."""

    outputs: Mapping[str, Output] = field(default_factory=dict)
    inputs: Mapping[str, Input] = field(default_factory=dict)
    services: Mapping[str, Service] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """Numbers, strings, lists and mappings, by absolute name."""
    elsewhere: Mapping[str, str] = field(default_factory=dict)
    """Topics and services that only other worlds have, and a text that says what they are."""


class Delivery(NamedTuple):
    """A message on its way out."""

    output: Output
    message: Message
    time: float
    """Simulated time [s]."""


class Traffic(NamedTuple):
    """Traffic of a transport since it started."""

    clients: int
    """Connected now."""
    sent: int
    """Bytes sent."""
    dropped: int
    """Messages that were thrown away because a client did not keep up."""


class Transport(Protocol):
    """A network on which a table is offered. Its methods are called by the simulation's thread, and none may block it.

    What comes in goes to the inbox that it was made with.
    """

    def start(self) -> Sequence[str]:
        """Open it; returns lines for people with its address. NetworkError: it cannot be opened, and why."""

    def offer(self, table: RosInterface) -> None:
        """Offer this table from now on, and nothing else: what is new in it is announced, what is gone withdrawn."""

    @property
    def subscribed_topics(self) -> frozenset[str]:
        """Names of the outputs that somebody listens to now; only these are made."""

    def publish(self, batch: Sequence[Delivery]) -> None:
        """Send messages of one moment to who listens. One that is latched is kept, and sent in any case."""

    def log(self, level: str, text: str) -> None:
        """Show people on the network a line: `INFO`, `WARN` or `ERROR`."""

    @property
    def traffic(self) -> Traffic:
        """Traffic since the start."""

    def close(self) -> None:
        """Withdraw all, close every connection, and wait until that is done: 2 s at most."""


def dialect_of(transport: Transport) -> Dialect:
    """The dialect of the table that is offered on a transport: its attribute `dialect`, else VRX's."""
    dialect: Dialect = getattr(transport, "dialect", "vrx")
    return dialect


def publishers_of(transport: Transport, topic: str) -> Sequence[str]:
    """Publishers of a topic on a transport now, from its method `publishers`; none without one, as in a bag."""
    ask: Callable[[str], Sequence[str]] | None = getattr(transport, "publishers", None)
    return ask(topic) if ask else ()


Answer = Callable[[Message | None, str], None]
"""Takes the response, or None and the reason. It is called by the simulation's thread."""


class Command(NamedTuple):
    """A message on one of the table's inputs."""

    topic: str
    message: Message
    sender: str
    """Sender, for people: a node's name, or an address."""
    dialect: Dialect = "vrx"
    """Dialect of the table that has the topic."""


class Call(NamedTuple):
    """A call of one of the table's services."""

    service: str
    request: Message
    caller: str
    answer: Answer


class UnknownTopicPublisher(NamedTuple):
    """Somebody who publishes on a topic to which the simulation does not subscribe."""

    topic: str
    type: str
    sender: str
    dialect: Dialect = "vrx"


class Inbox:
    """Bounded, and safe for any number of threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._commands: Mailbox[Command] = Mailbox(lambda command: (command.topic, command.sender))
        self._calls: list[Call] = []
        self._unknown_publishers: dict[tuple[str, str], UnknownTopicPublisher] = {}

    def message(self, topic: str, message: Message, sender: str, dialect: Dialect = "vrx") -> None:
        """A message has come."""
        self._commands.put([Command(topic, message, sender, dialect)])
        self._arrived.set()

    def call(self, service: str, request: Message, caller: str, answer: Answer) -> None:
        """A service was called; `answer` is called once, now if too many calls wait."""
        with self._lock:
            full = len(self._calls) >= MOST_CALLS
            if not full:
                self._calls.append(Call(service, request, caller, answer))
        if full:
            answer(None, f"{service}: {MOST_CALLS} calls are already waiting")
        self._arrived.set()

    def unknown_publisher(self, topic: str, type_name: str, sender: str, dialect: Dialect = "vrx") -> None:
        """Somebody publishes, or tries to, on a topic to which nothing here subscribes."""
        with self._lock:
            if len(self._unknown_publishers) < MOST_UNKNOWN_PUBLISHERS:
                self._unknown_publishers[topic, sender] = UnknownTopicPublisher(topic, type_name, sender, dialect)

    def wait(self, seconds: float) -> bool:
        """Wait until something came, or so long [s]; whether something came."""
        return self._arrived.wait(seconds)

    @property
    def pending(self) -> bool:
        """Whether something waits."""
        return self._arrived.is_set()

    def drain(self) -> tuple[list[Command], list[Call], list[UnknownTopicPublisher]]:
        """Take all that came, in the order in which it did."""
        self._arrived.clear()
        with self._lock:
            calls, self._calls = self._calls, []
            unknown_publishers, self._unknown_publishers = self._unknown_publishers, {}
        return self._commands.take(), calls, list(unknown_publishers.values())


def parameters(header: Message, values: Mapping[str, str | bool | int | float]) -> Message:
    """Message ros_gz_interfaces/ParamVec of named values."""
    params = [kind("rcl_interfaces/Parameter")(name, _value(value)) for name, value in values.items()]
    return kind("ros_gz_interfaces/ParamVec")(header, params)


def _value(value: str | float) -> Message:
    number, field = _KINDS[type(value)]
    return cdr.new("rcl_interfaces/ParameterValue", type=number, **{field: value})


def with_vrx3(output: Output, *names: str) -> Iterator[Output]:
    """A topic of VRX, and those of these names by which VRX 3 publishes the same."""
    yield output
    yield from (in_vrx3(output, name) for name in names)


def in_vrx3(output: Output, name: str) -> Output:
    """A topic as VRX 3 has it: by its name, with its type for the same content."""
    kind, convert = CONVERSIONS.get(output.type, (output.type, lambda message: message))
    make = partial(_convert, output.make, convert)
    return replace(output, name=name, type=kind, make=make, dialects=VRX3)


def _convert(
    make: Callable[..., Message | None], convert: Callable[[Message], Message], *reading: object
) -> Message | None:
    message = make(*reading)
    return None if message is None else convert(message)


def _pose(message: Message) -> Message:
    """geometry_msgs/Pose with latitude and longitude [degrees] for x and y, as VRX 3's."""
    where = message.pose.position
    position = {"x": where.latitude, "y": where.longitude, "z": where.altitude}
    return new("geometry_msgs/Pose", position=position, orientation=message.pose.orientation)


def _detections(message: Message) -> Message:
    """vision_msgs/Detection2DArray, whose classes have names here; the id is the number of the pixels in the mask."""
    found = []
    for one in message.detections:
        (result,), center = one.results, one.bbox.center
        hypothesis = kind("vision_msgs/ObjectHypothesis")(CATEGORY_NAMES[result.id], result.score)
        results = [kind("vision_msgs/ObjectHypothesisWithPose")(hypothesis, result.pose)]
        pose = kind("vision_msgs/Pose2D")(kind("vision_msgs/Point2D")(center.x, center.y), center.theta)
        box = kind("vision_msgs/BoundingBox2D")(pose, one.bbox.size_x, one.bbox.size_y)
        found.append(kind("vision_msgs/Detection2D")(one.header, results, box, str(one.header.seq)))
    return kind("vision_msgs/Detection2DArray")(message.header, found)


def _fix(message: Message) -> Message:
    """sensor_msgs/NavSatFix, whose covariance is of type 0, unknown, where no errors are configured, as Gazebo's is."""
    return message if message.position_covariance.any() else replace(message, position_covariance_type=0)


CONVERSIONS: Mapping[str, tuple[str, Callable[[Message], Message]]] = {
    "std_msgs/Float64": (
        "std_msgs/Float32",
        lambda one: new("std_msgs/Float32", data=float(np.float32(one.data))),
    ),
    "std_msgs/Float64MultiArray": (
        "ros_gz_interfaces/Float32Array",
        lambda one: kind("ros_gz_interfaces/Float32Array")(np.asarray(one.data, np.float32)),
    ),
    "geographic_msgs/GeoPoseStamped": (
        "geometry_msgs/PoseStamped",
        lambda one: new("geometry_msgs/PoseStamped", header=one.header, pose=_pose(one)),
    ),
    "geographic_msgs/GeoPath": (
        "geometry_msgs/PoseArray",
        lambda one: new("geometry_msgs/PoseArray", header=one.header, poses=[_pose(pose) for pose in one.poses]),
    ),
    "usv_msgs/RangeBearing": (
        "ros_gz_interfaces/ParamVec",
        lambda one: parameters(one.header, {name: getattr(one, name) for name in ("range", "bearing", "elevation")}),
    ),
    "sensor_msgs/NavSatFix": ("sensor_msgs/NavSatFix", _fix),
    "vision_msgs/Detection2DArray": ("vision_msgs/Detection2DArray", _detections),
}
"""VRX 3's type for each of VRX's that differs, and the conversion."""
