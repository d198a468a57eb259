"""Our node: what is published, what is listened to, and who else is there. One thread alone calls it.

Subscriptions are emptied by asking them, and not by an executor of rclpy: that one visits all of them for every message
that comes, and costs twice as much at a hundred subscriptions.
"""

import logging
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.cdr import decode, encode, kind
from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.messages import stamp
from vrx_mj.ros.offer import Input, Output, Sent, Table
from vrx_mj.ros.ros2.installed import message_class

__all__ = ["Node"]

DEPTH = 10
"""Messages that publishers and subscriptions keep, as Gazebo's bridge."""
ROSOUT_DEPTH = 1000
MOST_TAKEN = DEPTH
"""Messages of a topic that are taken at once."""
LARGEST = 1 << 20
"""Of a message that comes [bytes]."""
WANTED_PERIOD = 0.1
GRAPH_PERIOD = 1.0
"""Wall time between two looks at who else is there [s]."""
LEVELS = {"INFO": 20, "WARN": 30, "ERROR": 40}
"""Of rcl_interfaces/Log."""
OURS = ("/rosout", "/parameter_events")
CLOCK = "/clock"
SOMEBODY = "ROS 2"

_logger = logging.getLogger(__name__)


class _Out(NamedTuple):
    output: Output
    publisher: Any


class _In(NamedTuple):
    entry: Input
    subscription: Any


class Node:
    """A node of rclpy in a context of its own."""

    def __init__(self, rclpy: Any, inbox: Inbox, name: str) -> None:
        """Open it; NetworkError: ROS 2 does not start."""
        self._rclpy, self._inbox, self._name = rclpy, inbox, name
        self._context = rclpy.Context()
        try:
            rclpy.init(args=[], context=self._context, signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
            self._node = rclpy.create_node(
                name,
                context=self._context,
                enable_rosout=False,  # the user's lines are printed already
                start_parameter_services=False,  # no executor would answer
                parameter_overrides=[rclpy.parameter.Parameter("start_type_description_service", value=False)],
            )
        except Exception as error:  # rclpy raises classes of its C extension
            raise NetworkError(f"ROS 2 does not start: {error}") from error
        self._out: dict[str, _Out] = {}
        self._in: dict[str, _In] = {}
        self._senders: dict[str, str] = {}
        self._told: set[str] = set()
        self._looked = self._counted = 0.0
        self._rosout = self._publisher("rcl_interfaces/Log", "/rosout", latched=True, depth=ROSOUT_DEPTH)
        self.wanted: frozenset[str] = frozenset()
        self.clients = self.sent = 0

    def offer(self, table: Table) -> None:
        """Publish and listen to what the table says, as far as ROS 2 here has its messages."""
        for name in [name for name, out in self._out.items() if not _alike(out.output, table.outputs.get(name))]:
            self._node.destroy_publisher(self._out.pop(name).publisher)
        for name in [name for name, one in self._in.items() if not _alike(one.entry, table.inputs.get(name))]:
            self._node.destroy_subscription(self._in.pop(name).subscription)
        for name, output in table.outputs.items():
            held = self._out.get(name)
            publisher = held.publisher if held else self._publisher(output.type, name, latched=output.latched)
            if publisher is not None:
                self._out[name] = _Out(output, publisher)
        for name, entry in table.inputs.items():
            known = self._in.get(name)
            subscription = known.subscription if known else self._subscription(entry)
            if subscription is not None:
                self._in[name] = _In(entry, subscription)
        self._count()

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send what somebody listens to, and what is kept for who comes later."""
        for sent in batch:
            out = self._out.get(sent.output.name)
            if out is None or not (out.output.latched or sent.output.name in self.wanted):
                continue
            raw = encode(sent.message, sent.output.type)
            out.publisher.publish(raw)
            self.sent += len(raw)

    def take(self) -> None:
        """Put what has come into the inbox."""
        for topic, (entry, subscription) in self._in.items():
            for _ in range(MOST_TAKEN):
                with subscription.handle:
                    taken = subscription.handle.take_message(subscription.msg_type, True)
                if taken is None:
                    break
                self._receive(topic, entry, taken[0])

    def look(self) -> None:
        """See who listens, and now and then who else is there."""
        now = time.monotonic()
        if now - self._counted >= WANTED_PERIOD:
            self._count()
        if now - self._looked >= GRAPH_PERIOD:
            self._looked = now
            self._senders.clear()
            self._look_around()

    def log(self, level: str, text: str) -> None:
        """A line on /rosout."""
        if self._rosout is None:
            return
        line = kind("rcl_interfaces/Log")(stamp(time.time()), LEVELS[level], self._name, text, "", "", 0)
        self._rosout.publish(encode(line, "rcl_interfaces/Log"))

    def close(self) -> None:
        """Leave."""
        self._node.destroy_node()
        self._rclpy.shutdown(context=self._context)

    def _receive(self, topic: str, entry: Input, raw: bytes) -> None:
        sender = self._sender(topic)
        if len(raw) > LARGEST:
            self._once(f"{topic} from {sender}: a message of {len(raw)} bytes; at most {LARGEST} are allowed")
            return
        try:
            message = decode(raw, entry.type)
        except CommandError as error:
            self._once(f"{topic} from {sender}: {error}")
            return
        self._inbox.message(topic, message, sender, "vrx3")

    def _sender(self, topic: str) -> str:
        """The node that publishes, if it is the only one: messages do not say whose they are."""
        if topic not in self._senders:
            names = self._publishing(topic)
            self._senders[topic] = names[0] if len(names) == 1 else SOMEBODY
        return self._senders[topic]

    def _publishing(self, topic: str) -> list[str]:
        infos = self._node.get_publishers_info_by_topic(topic)
        return sorted({f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos})

    def _count(self) -> None:
        self._counted = time.monotonic()
        self.wanted = frozenset(
            name for name, (_, publisher) in self._out.items() if publisher.get_subscription_count() > 0
        )

    def _look_around(self) -> None:
        self.clients = max(0, len(self._node.get_node_names()) - 1)
        if CLOCK in self._out and self._node.count_publishers(CLOCK) > 1:
            others = ", ".join(self._publishing(CLOCK))
            self._once(f"{CLOCK} has another publisher ({others}): give one of them another ROS_DOMAIN_ID")
        for topic, types in self._node.get_topic_names_and_types():
            if topic in self._out or topic in self._in or topic in OURS or self._node.count_subscribers(topic):
                continue
            for sender in self._publishing(topic):
                self._inbox.unknown_publisher(topic, types[0].replace("/msg/", "/"), sender, "vrx3")

    def _publisher(self, type_name: str, topic: str, *, latched: bool, depth: int | None = None) -> Any | None:
        found = self._class(type_name, topic)
        if found is None:
            return None
        qos = self._rclpy.qos
        profile = qos.QoSProfile(depth=depth or (1 if latched else DEPTH))
        if latched:
            profile.durability = qos.DurabilityPolicy.TRANSIENT_LOCAL
        return self._node.create_publisher(found, topic, profile)

    def _subscription(self, entry: Input) -> Any | None:
        found = self._class(entry.type, entry.name)
        return found and self._node.create_subscription(found, entry.name, _nothing, DEPTH, raw=True)

    def _class(self, type_name: str, topic: str) -> Any | None:
        """The user's class of a type; without one the topic is left out."""
        found = message_class(type_name)
        if found is None:
            _logger.debug("%s is not published: no %s here", topic, type_name)
        return found

    def _once(self, text: str) -> None:
        if text not in self._told and len(self._told) < 1000:
            self._told.add(text)
            _logger.warning(text)


def _alike(one: Output | Input, other: Output | Input | None) -> bool:
    """Whether the same publisher or subscription serves both."""
    latched = getattr(one, "latched", None) == getattr(other, "latched", None)
    return other is not None and one.type == other.type and latched


def _nothing(_raw: bytes) -> None:
    """What an executor would call."""
