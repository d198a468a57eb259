"""The table on ROS 2: our node on the rclpy that the user has, and the thread in which it lives."""

import importlib
import logging
import math
import os
import platform
import re
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from types import ModuleType
from typing import Any, Generic, NamedTuple, TypeVar

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.packages import install_command
from vrx_mj.ros.cdr import decode, encode, fields, kind
from vrx_mj.ros.interface import PACKAGES, Delivery, Dialect, Inbox, Input, Output, RosInterface, Service, Traffic
from vrx_mj.ros.limits import Mailbox
from vrx_mj.ros.messages import PADDING, Message, stamp
from vrx_mj.ros.network import Notices, is_loopback

_WHEELS = ("ros-jazzy-rclpy", "ros-jazzy-rmw-fastrtps-cpp", "ros-jazzy-common-interfaces")
"""Wheels of rclpy."""
_NODE = "vrx_mj"
"""Name of the node."""
_HALVES = ("Request", "Response")
"""Suffixes of the types of the two messages of a service."""
_QUEUE_DEPTH = 10
"""Number of messages that publishers and subscriptions keep, as Gazebo's bridge, and that are taken at once."""
_ROSOUT_DEPTH = 1000
"""Number of log messages that are kept."""
_MAX_INCOMING = 1 << 20
"""Largest incoming message [bytes]."""
_WANTED_PERIOD = 0.1
"""Wall time between two checks which topics are wanted [s]."""
_GRAPH_PERIOD = 1.0
"""Wall time between two checks of the other nodes [s]."""
_OURS = ("/rosout", "/parameter_events")
"""Topics that every node has."""
_CLOCK = "/clock"
"""Topic of the clock."""
_SOMEBODY, _NAMELESS = "ROS 2", "_NODE_NAME_UNKNOWN_"
"""Name of a sender that is not known, and what ROS 2 calls a node without a name."""
RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
"""Environment variable of the range of discovery."""
_POLL_PERIOD = 0.01
"""Longest wall time between two reads of subscriptions [s]."""
_MOST_LINES = 64
"""Largest number of log lines that wait."""
_CLOSE_TIMEOUT = 2.0
"""Wall time for closing [s]."""
_EXAMPLES = {
    "ros_gz_interfaces": "/vrx/task/info and range_bearing",
    "tf2_msgs": "/tf and /tf_static",
    "vision_msgs": "labels of cameras",
    "visualization_msgs": "/vrx_mj/markers",
}
"""Topics that are missing without a package, in messages."""


def load_rclpy() -> Any:
    """The module rclpy.

    Raises:
        NetworkError: it is not there, or for another Python; and what to do.
    """
    try:
        return importlib.import_module("rclpy")
    except ImportError as error:
        raise NetworkError(_advice(error)) from error


def _advice(error: ImportError) -> str:
    own = ".".join(platform.python_version_tuple()[:2])
    found = [re.search(r"/ros/.*python(3\.\d+)/", f"{path}/") for path in sys.path]
    versions = sorted({match[1] for match in found if match} - {own})
    if versions:
        distro = os.environ.get("ROS_DISTRO", "here").title()
        return (
            f"ROS 2 {distro} is for Python {' or '.join(versions)}, and this is Python {own}: install vrx_mj with "
            "that Python, 3.11 or newer; Jazzy has 3.12"
        )
    what = "is not installed" if error.name == "rclpy" else f"cannot be imported ({str(error).partition(chr(10))[0]})"
    return (
        f"ROS 2's rclpy {what}: source ROS 2, as '. /opt/ros/jazzy/setup.bash', and run vrx-mj with the same Python "
        f"(Jazzy's is 3.12, this is {own}); without ROS on this machine: {install_command(*_WHEELS)}"
    )


def _module(name: str) -> ModuleType | None:
    """The user's module of this name; None where it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def has_package(package: str) -> bool:
    """Whether there are messages of a package."""
    return _module(f"{package}.msg") is not None


@cache
def message_class(type_name: str) -> Any | None:
    """The user's class of a type, `sensor_msgs/Imu`; None where it is missing, or has other fields than ours."""
    package, _, name = type_name.partition("/")
    found = getattr(_module(f"{package}.msg"), name, None)
    return found if _has_fields(found, type_name) else None


@cache
def service_class(type_name: str) -> Any | None:
    """The user's class of a service; None where it is missing, or has other fields than ours."""
    package, _, name = type_name.partition("/")
    found = getattr(_module(f"{package}.srv"), name, None)
    halves = found is not None and all(_has_fields(getattr(found, half), f"{type_name}{half}") for half in _HALVES)
    return found if halves else None


def _has_fields(found: Any | None, type_name: str) -> bool:
    """Whether a class has the fields of ours, and theirs have theirs."""
    known = fields(type_name)
    if found is None or list(found.get_fields_and_field_types()) != [field for field, _ in known if field != PADDING]:
        return False
    return all(inner is None or message_class(inner) for _, inner in known)


Handle = Any
"""A publisher, subscription or service of rclpy."""
_Entry = TypeVar("_Entry", Output, Input, Service)


class _Endpoint(NamedTuple, Generic[_Entry]):
    """Entry of the table that is offered, and rclpy's publisher, subscription or service for it."""

    entry: _Entry
    handle: Handle


class Node:
    """A node of rclpy in a context of its own."""

    def __init__(self, rclpy: Any, inbox: Inbox) -> None:
        """Open it; NetworkError: ROS 2 does not start."""
        self._rclpy, self._inbox = rclpy, inbox
        self._context = rclpy.Context()
        try:
            rclpy.init(args=[], context=self._context, signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
            self._node = rclpy.create_node(
                _NODE,
                context=self._context,
                enable_rosout=False,  # the user's lines are printed already
                start_parameter_services=False,  # no executor would answer
                parameter_overrides=[rclpy.parameter.Parameter("start_type_description_service", value=False)],
            )
        except Exception as error:  # rclpy raises classes of its C extension
            raise NetworkError(f"ROS 2 does not start: {error}") from error
        self._out: dict[str, _Endpoint[Output]] = {}
        self._in: dict[str, _Endpoint[Input]] = {}
        self._services: dict[str, _Endpoint[Service]] = {}
        self._answers: deque[Callable[[], None]] = deque()
        """Responses that are ready, each a function that sends one."""
        self._senders: dict[str, str] = {}
        self._notices = Notices()
        self._looked = self._counted = -math.inf
        self._rosout = self._publisher("rcl_interfaces/Log", "/rosout", latched=True, depth=_ROSOUT_DEPTH)
        self.subscribed_topics: frozenset[str] = frozenset()
        self.clients = self.sent = 0

    def offer(self, table: RosInterface) -> None:
        """Publish, subscribe to and offer what the table has, as far as ROS 2 here has its messages."""
        node = self._node
        _match(
            self._out, table.outputs, node.destroy_publisher,
            lambda output: self._publisher(output.type, output.name, latched=output.latched),
        )  # fmt: skip
        _match(self._in, table.inputs, node.destroy_subscription, self._subscription)
        _match(self._services, table.services, node.destroy_service, self._service)
        self._count()

    def publish(self, batch: Sequence[Delivery]) -> None:
        """Send what somebody listens to, and what is kept for who comes later."""
        for sent in batch:
            out = self._out.get(sent.output.name)
            if out is None or not (out.entry.latched or sent.output.name in self.subscribed_topics):
                continue
            raw = encode(sent.message, sent.output.type)
            out.handle.publish(raw)
            self.sent += len(raw)

    def take(self) -> None:
        """Put what has come into the inbox."""
        for topic, (entry, subscription) in self._in.items():
            for _ in range(_QUEUE_DEPTH):
                with subscription.handle:
                    taken = subscription.handle.take_message(subscription.msg_type, True)
                if taken is None:
                    break
                self._receive(topic, entry, taken[0])
        for name, offered in self._services.items():
            self._take_calls(name, offered)
        while self._answers:
            self._answers.popleft()()

    def _take_calls(self, name: str, offered: _Endpoint[Service]) -> None:
        """Put what was asked of a service into the inbox; its answers are sent by this thread."""
        kind, service = offered.entry.type, offered.handle
        wire = importlib.import_module("rclpy.serialization")
        for _ in range(_QUEUE_DEPTH):
            with service.handle:
                asked, header = service.handle.service_take_request(service.srv_type.Request)
            if header is None:
                break

            def answer(response: Message | None, _why: str, header: Any = header) -> None:
                empty = service.srv_type.Response
                raw = response and encode(response, f"{kind}Response")
                made = wire.deserialize_message(raw, empty) if raw else empty()
                self._answers.append(partial(service.send_response, made, header))

            self._inbox.call(name, decode(wire.serialize_message(asked), f"{kind}Request"), _SOMEBODY, answer)

    def look(self) -> None:
        """See who listens, and now and then who else is there."""
        now = time.monotonic()
        if now - self._counted >= _WANTED_PERIOD:
            self._count()
        if now - self._looked >= _GRAPH_PERIOD:
            self._looked = now
            self._senders.clear()
            self.clients = max(0, len(self._node.get_node_names()) - 1)
            if _CLOCK in self._out and self._node.count_publishers(_CLOCK) > 1:
                others = ", ".join(self.publishers(_CLOCK))
                text = f"{_CLOCK} has another publisher ({others}): give one of them another ROS_DOMAIN_ID"
                self._notices.write("WARN", "clock", others, text)
            for topic, types in self._node.get_topic_names_and_types():
                if topic in self._out or topic in self._in or topic in _OURS or self._node.count_subscribers(topic):
                    continue
                for sender in self.publishers(topic):
                    if not sender.endswith(_NAMELESS):  # else the next look knows it
                        self._inbox.unknown_publisher(topic, types[0].replace("/msg/", "/"), sender, "vrx3")

    def log(self, level: str, text: str) -> None:
        """A line on /rosout."""
        if self._rosout is None:
            return
        line = kind("rcl_interfaces/Log")(
            stamp(time.time()), logging.getLevelNamesMapping()[level], _NODE, text, "", "", 0
        )
        self._rosout.publish(encode(line, "rcl_interfaces/Log"))

    def close(self) -> None:
        """Leave the graph of ROS 2."""
        self._node.destroy_node()
        self._rclpy.shutdown(context=self._context)

    def _receive(self, topic: str, entry: Input, raw: bytes) -> None:
        sender = self._sender(topic)
        if len(raw) > _MAX_INCOMING:
            why = f"a message of {len(raw)} bytes; at most {_MAX_INCOMING} are allowed"
            self._notices.write("WARN", "size", topic, f"{topic} from {sender}: {why}")
            return
        try:
            self._inbox.message(topic, decode(raw, entry.type), sender, "vrx3")
        except CommandError as error:
            self._notices.write("WARN", "decode", topic, f"{topic} from {sender}: {error}")

    def _sender(self, topic: str) -> str:
        """The node that publishes, if it is the only one: messages do not say whose they are.

        A publisher is known some time before the name of its node.
        """
        if topic not in self._senders:
            names = self.publishers(topic)
            if any(name.endswith(_NAMELESS) for name in names):
                return _SOMEBODY
            self._senders[topic] = names[0] if len(names) == 1 else _SOMEBODY
        return self._senders[topic]

    def publishers(self, topic: str) -> list[str]:
        """Nodes that publish a topic; safe to ask from any thread."""
        infos = self._node.get_publishers_info_by_topic(topic)
        return sorted({f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos})

    def _count(self) -> None:
        self._counted = time.monotonic()
        self.subscribed_topics = frozenset(
            name for name, (_, publisher) in self._out.items() if publisher.get_subscription_count() > 0
        )

    def _service(self, service: Service) -> Handle | None:
        found = service_class(service.type)
        return found and self._node.create_service(found, service.name, _nothing)

    def _publisher(self, type_name: str, topic: str, *, latched: bool, depth: int | None = None) -> Handle | None:
        found = self._class(type_name, topic)
        if found is None:
            return None
        qos = self._rclpy.qos
        profile = qos.QoSProfile(depth=depth or (1 if latched else _QUEUE_DEPTH))
        if latched:
            profile.durability = qos.DurabilityPolicy.TRANSIENT_LOCAL
        return self._node.create_publisher(found, topic, profile)

    def _subscription(self, entry: Input) -> Handle | None:
        found = self._class(entry.type, entry.name)
        return found and self._node.create_subscription(found, entry.name, _nothing, _QUEUE_DEPTH, raw=True)

    def _class(self, type_name: str, topic: str) -> Any | None:
        """The user's class of a type; without one the topic is left out."""
        found = message_class(type_name)
        if found is None:
            _logger.debug("%s is not published: %s is not installed", topic, type_name)
        return found


def _match(
    held: dict[str, _Endpoint[_Entry]], entries: Mapping[str, _Entry], destroy: Callable[[Handle], object],
    create: Callable[[_Entry], Handle | None],
) -> None:  # fmt: skip
    """Create and destroy so that each entry of the table whose messages ROS 2 has here is offered, and nothing else."""
    for name, (entry, handle) in list(held.items()):
        other = entries.get(name)
        latched = getattr(entry, "latched", None), getattr(other, "latched", None)
        if other is None or entry.type != other.type or latched[0] != latched[1]:
            del held[name]
            destroy(handle)
    for name, entry in entries.items():
        handle = held[name].handle if name in held else create(entry)
        if handle is not None:
            held[name] = _Endpoint(entry, handle)


def _nothing(_raw: bytes) -> None:
    """Do nothing in the place of a callback, which only an executor would call."""


_logger = logging.getLogger(__name__)


class Ros2:
    """A `Transport` (see `vrx_mj.ros.interface`) by VRX 3's names, on the rclpy of the user's ROS 2."""

    dialect: Dialect = "vrx3"

    def __init__(self, inbox: Inbox, *, host: str = "127.0.0.1", packages: Sequence[str] = PACKAGES) -> None:
        """With a host of loopback the node looks for others on this machine alone.

        Of `packages`, those of the topics' types, `start` says which are missing.
        """
        self._inbox, self._host, self._packages = inbox, host, packages
        self._lock, self._woken, self._closing = threading.Lock(), threading.Event(), False
        self._table: RosInterface | None = None
        self._queue: Mailbox[Delivery] = Mailbox(lambda sent: sent.output.name)
        self._lines: deque[tuple[str, str]] = deque(maxlen=_MOST_LINES)
        self._node: Node | None = None
        self._thread = threading.Thread(target=self._run, name="vrx_mj ROS 2", daemon=True)

    def start(self) -> Sequence[str]:
        """Open the node; returns lines that say where it is, and what this ROS 2 lacks.

        Raises:
            NetworkError: rclpy is missing, or does not start.
        """
        rclpy = load_rclpy()
        if is_loopback(self._host):
            os.environ.setdefault(RANGE_VARIABLE, "LOCALHOST")
        self._node = Node(rclpy, self._inbox)
        self._thread.start()
        domain, distro = os.environ.get("ROS_DOMAIN_ID") or "0", os.environ.get("ROS_DISTRO") or "jazzy"
        by, reach = rclpy.get_rmw_implementation_identifier(), os.environ.get(RANGE_VARIABLE, "SUBNET")
        lines = [f"ROS 2: node /{_NODE} in domain {domain} by {by}, {RANGE_VARIABLE}={reach}"]
        for package in self._packages:
            if not has_package(package):
                shown = f", as {_EXAMPLES[package]}," if package in _EXAMPLES else ""
                debian = f"ros-{distro}-{package.replace('_', '-')}"
                lines.append(
                    f"ROS 2: {package} is not installed (apt-get install {debian}): its topics{shown} are not published"
                )
        return lines

    def offer(self, table: RosInterface) -> None:
        """Offer this table from now on, and nothing else."""
        with self._lock:
            self._table = table
        self._woken.set()

    @property
    def subscribed_topics(self) -> frozenset[str]:
        """Names of the outputs that somebody subscribes to now."""
        return self._node.subscribed_topics if self._node else frozenset()

    def publishers(self, topic: str) -> Sequence[str]:
        """Nodes that publish a topic now."""
        return self._node.publishers(topic) if self._node else ()

    def publish(self, batch: Sequence[Delivery]) -> None:
        """Send messages of one moment to who listens."""
        self._queue.put(batch)
        self._woken.set()

    def log(self, level: str, text: str) -> None:
        """Write a line on /rosout."""
        with self._lock:
            self._lines.append((level, text))

    @property
    def traffic(self) -> Traffic:
        """Traffic since the start."""
        node = self._node
        return Traffic(node.clients, node.sent, self._queue.dropped) if node else Traffic(0, 0, self._queue.dropped)

    def close(self) -> None:
        """Leave ROS 2, and wait until that is done: 2 s at most."""
        self._closing = True
        self._woken.set()
        if self._thread.is_alive():
            self._thread.join(_CLOSE_TIMEOUT)

    def _run(self) -> None:
        node = self._node
        assert node is not None, "the thread begins after the node"
        failed, last = "", False
        while not last:
            self._woken.wait(_POLL_PERIOD)
            self._woken.clear()
            last = self._closing  # what waits is still sent
            try:
                self._work(node)
            except Exception as error:  # rclpy raises classes of its C extension; the simulation goes on without it
                if str(error) != failed:
                    failed = str(error)
                    _logger.exception("ROS 2")
        node.close()

    def _work(self, node: Node) -> None:
        with self._lock:
            table, self._table = self._table, None
            lines = list(self._lines)
            self._lines.clear()
        if table is not None:
            node.offer(table)
        node.publish(self._queue.take())
        for line in lines:
            node.log(*line)
        node.take()
        node.look()
