"""The node on a made-up rclpy: what it creates, sends, takes and says."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from vrx_mj.errors import NetworkError
from vrx_mj.ros import ros2
from vrx_mj.ros.cdr import decode, encode
from vrx_mj.ros.interface import Delivery, Inbox, Input, Output, RosInterface, Service
from vrx_mj.ros.messages import new

CLOCK = Output("/clock", "std_msgs/Float64", lambda: None)
GOAL = Output("/goal", "std_msgs/String", lambda: None, latched=True)
STRANGE = Output("/strange", "std_msgs/Empty", lambda: None)
THRUST = Input("/thrust", "std_msgs/Float64", lambda _: None)
DATUM = Service("/datum", "robot_localization/SetDatum", lambda _: None)


class Handle:
    """A publisher, subscription or service, with what it got."""

    def __init__(self, kind, name, *rest):
        self.kind, self.name, self.rest, self.sent, self.waiting, self.listeners = kind, name, rest, [], [], 0
        self.handle, self.msg_type, self.publish = self, kind, self.sent.append
        self.take_message = lambda kind, raw: (self.waiting.pop(0), kind, raw) if self.waiting else None
        self.service_take_request = lambda _: (None, None)
        self.srv_type = SimpleNamespace(Request=None)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def get_subscription_count(self):
        return self.listeners


class Ros:
    """rclpy and its node: what was created and destroyed, and who else is there."""

    def __init__(self):
        self.log, self.handles, self.others, self.topics, self.nodes, self.asked = [], {}, {}, {}, [], []
        self.signals, self.parameter = MagicMock(), MagicMock()
        self.Context = lambda: "context"
        self.qos = SimpleNamespace(
            QoSProfile=lambda depth: SimpleNamespace(depth=depth, durability=0),
            DurabilityPolicy=SimpleNamespace(TRANSIENT_LOCAL=1),
        )
        self.destroy_publisher = self.destroy_subscription = self.destroy_service = self.destroyed
        self.get_node_names = lambda: self.nodes
        self.get_topic_names_and_types = self.topics.items
        self.get_publishers_info_by_topic = lambda topic: self.others.get(topic, [])
        self.count_publishers = lambda topic: len(self.others.get(topic, []))
        self.count_subscribers = lambda topic: topic == "/wanted"
        self.destroy_node = lambda: self.log.append("left")

    def init(self, **options):
        self.log.append(("init", options["args"], options["context"]))

    def create_node(self, name, **options):
        self.log.append((name, options["context"], options["enable_rosout"], options["start_parameter_services"]))
        return self

    def shutdown(self, context):
        self.log.append(("shutdown", context))

    def destroyed(self, handle):
        self.log.append(("destroyed", handle.name))

    def made(self, what, kind, name, *rest):
        self.log.append((what, kind, name, *rest))
        self.handles[name] = Handle(kind, name, *rest)
        return self.handles[name]

    def create_publisher(self, kind, name, profile):
        return self.made("publisher", kind, name, profile.depth, profile.durability)

    def create_subscription(self, kind, name, _called, depth, raw):
        return self.made("subscription", kind, name, depth, raw)

    def create_service(self, kind, name, _called):
        return self.made("service", kind, name)


class Scene:
    def __init__(self, monkeypatch):
        self.now = 100.0
        monkeypatch.setattr(ros2, "message_class", lambda name: None if name == STRANGE.type else name)
        monkeypatch.setattr(ros2, "service_class", lambda name: name)
        monkeypatch.setattr(ros2.importlib, "import_module", lambda _: None)
        clock = SimpleNamespace(monotonic=lambda: self.now, time=lambda: 12.5)
        monkeypatch.setattr(ros2, "time", clock)
        self.ros, self.inbox = Ros(), Inbox()
        self.node = ros2.Node(self.ros, self.inbox)
        self.notices = []
        self.node._notices = SimpleNamespace(write=lambda *notice: self.notices.append(notice))

    def offer(self, *entries):
        """What a table with these entries has the node do."""
        kinds = [{one.name: one for one in entries if isinstance(one, kind)} for kind in (Output, Input, Service)]
        self.ros.log.clear()
        self.node.offer(RosInterface(*kinds))
        return list(self.ros.log)


@pytest.fixture
def scene(monkeypatch):
    return Scene(monkeypatch)


def node_info(namespace, name):
    return SimpleNamespace(node_namespace=namespace, node_name=name)


def data(number):
    return encode(new("std_msgs/Float64", data=number), "std_msgs/Float64")


def test_a_node_opens_logs_and_leaves(scene):
    assert scene.ros.log == [
        ("init", [], "context"),
        ("vrx_mj", "context", False, False),
        ("publisher", "rcl_interfaces/Log", "/rosout", 1000, 1),
    ]
    scene.node.log("WARN", "aground")
    (raw,) = scene.ros.handles["/rosout"].sent
    line = decode(raw, "rcl_interfaces/Log")
    assert (line.stamp.sec, line.stamp.nanosec) == (12, 500_000_000)
    assert (line.level, line.name, line.msg, line.file, line.function, line.line) == (
        30, "vrx_mj", "aground", "", "", 0,
    )  # fmt: skip
    scene.node.close()
    assert scene.ros.log[3:] == ["left", ("shutdown", "context")]
    assert (scene.node.clients, scene.node.sent) == (0, 0)


def test_what_rclpy_raises_is_an_error_of_the_network():
    ros = Ros()
    ros.create_node = MagicMock(side_effect=RuntimeError("no domain"))
    with pytest.raises(NetworkError, match=r"^ROS 2 does not start: no domain$"):
        ros2.Node(ros, Inbox())


def test_without_a_class_for_log_lines_there_are_none(monkeypatch):
    scene = Scene(monkeypatch)
    scene.node._rosout = None
    scene.node.log("INFO", "nobody reads this")
    assert scene.ros.handles["/rosout"].sent == []


def test_a_table_is_offered_and_what_leaves_it_is_withdrawn(scene):
    assert scene.offer(CLOCK, GOAL, STRANGE, THRUST, DATUM) == [
        ("publisher", "std_msgs/Float64", "/clock", 10, 0),
        ("publisher", "std_msgs/String", "/goal", 1, 1),
        ("subscription", "std_msgs/Float64", "/thrust", 10, True),
        ("service", "robot_localization/SetDatum", "/datum"),
    ]
    assert scene.offer(CLOCK, GOAL, STRANGE, THRUST, DATUM) == []
    volatile = Output("/goal", "std_msgs/String", lambda: None)
    retyped = Input("/thrust", "std_msgs/String", lambda _: None)
    assert scene.offer(volatile, retyped) == [
        ("destroyed", "/clock"),
        ("destroyed", "/goal"),
        ("publisher", "std_msgs/String", "/goal", 10, 0),
        ("destroyed", "/thrust"),
        ("subscription", "std_msgs/String", "/thrust", 10, True),
        ("destroyed", "/datum"),
    ]


def test_messages_go_to_listeners_and_latched_ones_always(scene):
    scene.offer(CLOCK, GOAL)
    number, text = new("std_msgs/Float64", data=2.5), new("std_msgs/String", data="gate")
    batch = [Delivery(STRANGE, new("std_msgs/Empty"), 0.0), Delivery(CLOCK, number, 0.0), Delivery(GOAL, text, 0.0)]
    scene.node.publish(batch)
    assert scene.ros.handles["/clock"].sent == []
    assert scene.ros.handles["/goal"].sent == [encode(text, "std_msgs/String")]
    scene.ros.handles["/clock"].listeners = 1
    for later, topics in ((0.09, set()), (0.11, {"/clock"})):  # looked for every 0.1 s
        scene.now = 100.0 + later
        scene.node.look()
        assert scene.node.subscribed_topics == topics
    scene.node.publish(batch)
    assert scene.ros.handles["/clock"].sent == [data(2.5)]
    assert scene.node.sent == len(data(2.5)) + 2 * len(encode(text, "std_msgs/String"))


def test_a_turn_takes_ten_messages_of_a_topic_with_their_sender(scene):
    scene.offer(THRUST)
    scene.ros.others["/thrust"] = [node_info("/team/", "pilot")]
    scene.ros.handles["/thrust"].waiting += [data(float(number)) for number in range(12)]
    for expected in ([9.0], [11.0]):  # the newest command of a topic counts
        scene.node.take()
        commands, _, _ = scene.inbox.drain()
        assert [command.message.data for command in commands][-1:] == expected
        assert {(command.topic, command.sender, command.dialect) for command in commands} == {
            ("/thrust", "/team/pilot", "vrx3")
        }
    assert scene.notices == []


def test_messages_that_are_too_long_or_broken_are_reported(scene):
    scene.offer(THRUST)
    scene.ros.others["/thrust"] = [node_info("/", "one"), node_info("/", "two")]
    limit = 1 << 20
    scene.ros.handles["/thrust"].waiting += [bytes(limit + 1), b"\0\1\0\0"]
    scene.node.take()
    size, broken = scene.notices
    assert size == (
        "WARN", "size", "/thrust", f"/thrust from ROS 2: a message of {limit + 1} bytes; at most {limit} are allowed"
    )  # fmt: skip
    assert broken[:3] == ("WARN", "decode", "/thrust")
    assert broken[3].startswith("/thrust from ROS 2: ")
    scene.ros.handles["/thrust"].waiting += [bytes(limit)]
    scene.node.take()
    assert [notice[1] for notice in scene.notices].count("size") == 1


def test_other_nodes_are_looked_for_every_second(scene):
    scene.offer(CLOCK, THRUST)
    scene.ros.nodes = ["vrx_mj", "pilot", "rviz"]
    pilot, nameless = node_info("/", "pilot"), node_info("", "_NODE_NAME_UNKNOWN_")
    scene.ros.others |= {"/clock": [node_info("/", "vrx_mj"), node_info("/", "gazebo")], "/fire": [pilot, nameless]}
    scene.ros.others |= {topic: [pilot] for topic in ("/thrust", "/rosout", "/parameter_events", "/wanted")}
    scene.ros.topics |= {topic: ["std_msgs/msg/Empty"] for topic in scene.ros.others}
    for now, clients, reports in ((100.2, 2, 1), (101.15, 2, 1), (101.25, 2, 2)):
        scene.now = now
        scene.node.look()
        assert scene.node.clients == clients
        assert len(scene.notices) == reports
    text = "/clock has another publisher (/gazebo, /vrx_mj): give one of them another ROS_DOMAIN_ID"
    assert scene.notices[0] == ("WARN", "clock", "/gazebo, /vrx_mj", text)
    _, _, unknown = scene.inbox.drain()
    assert {tuple(one) for one in unknown} == {("/fire", "std_msgs/Empty", "/pilot", "vrx3")}
    scene.ros.others["/clock"], scene.ros.nodes = [node_info("/", "vrx_mj")], []
    scene.now += 2.0
    scene.node.look()
    assert (len(scene.notices), scene.node.clients) == (2, 0)


def test_a_sender_is_asked_for_again_after_the_next_look(scene):
    scene.offer(THRUST)
    scene.ros.others["/thrust"] = [node_info("/", "one")]
    assert scene.node._sender("/thrust") == "/one"
    scene.ros.others["/thrust"] = [node_info("/", "two")]
    assert scene.node._sender("/thrust") == "/one"
    scene.now += 5.0
    scene.node.look()
    assert scene.node._sender("/thrust") == "/two"
