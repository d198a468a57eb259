"""What of ROS 2 can be seen without it: what users are told, and what the transport does while its thread is busy."""

import platform
import sys
import threading
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from vrx_mj.errors import NetworkError
from vrx_mj.packages import install_command
from vrx_mj.ros import ros2 as ros2_node
from vrx_mj.ros.cdr import encode, fields
from vrx_mj.ros.interface import Delivery, Inbox, Output, RosInterface, Service
from vrx_mj.ros.limits import MOST_WAITING
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros2 import RANGE_VARIABLE, Ros2

OWN = ".".join(platform.python_version_tuple()[:2])
WHEELS = install_command("ros-jazzy-rclpy", "ros-jazzy-rmw-fastrtps-cpp", "ros-jazzy-common-interfaces")
LONGEST = 10.0
PLAIN = Output("/wamv/joint_states", "sensor_msgs/JointState", lambda: None)
DATUM = "robot_localization/SetDatum"
GOAL = Output("/vrx/stationkeeping/goal", "geometry_msgs/PoseStamped", lambda: None, latched=True)


def test_without_rclpy_users_are_told_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(NetworkError) as caught:
        Ros2(Inbox()).start()
    assert str(caught.value) == (
        "ROS 2's rclpy is not installed: source ROS 2, as '. /opt/ros/jazzy/setup.bash', and run vrx-mj with the same "
        f"Python (Jazzy's is 3.12, this is {OWN}); without ROS on this machine: {WHEELS}"
    )


def test_an_rclpy_that_does_not_load_says_why(monkeypatch, tmp_path):
    (tmp_path / "rclpy.py").write_text("raise ImportError('librcl.so: cannot open\\nmore')", encoding="utf-8")
    monkeypatch.delitem(sys.modules, "rclpy", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(
        NetworkError, match=r"^ROS 2's rclpy cannot be imported \(librcl\.so: cannot open\): source ROS 2, "
    ):
        ros2_node.load_rclpy()


def test_a_ros_2_for_another_python_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    monkeypatch.setattr(sys, "path", [*sys.path, "/opt/ros/humble/lib/python3.10/site-packages"])
    monkeypatch.setenv("ROS_DISTRO", "humble")
    with pytest.raises(NetworkError) as caught:
        ros2_node.load_rclpy()
    assert str(caught.value) == (
        f"ROS 2 Humble is for Python 3.10, and this is Python {OWN}: install vrx_mj with that Python, 3.11 or "
        "newer; Jazzy has 3.12"
    )


@pytest.fixture
def packages(monkeypatch):
    """Packages of messages that stand for the user's: those that they have, by their fields."""
    ros2_node.message_class.cache_clear()

    def install(*type_names, extra=()):
        for type_name in type_names:
            package, _, name = type_name.partition("/")
            told = dict.fromkeys([field for field, _ in fields(type_name)] + list(extra), "")
            module = sys.modules.get(f"{package}.msg") or SimpleNamespace()
            setattr(module, name, SimpleNamespace(get_fields_and_field_types=lambda told=told: told))
            monkeypatch.setitem(sys.modules, package, SimpleNamespace(msg=module))
            monkeypatch.setitem(sys.modules, f"{package}.msg", module)

    yield install
    ros2_node.message_class.cache_clear()


def test_a_class_is_taken_if_it_and_what_is_in_it_have_our_fields(packages):
    packages("builtin_interfaces/Time", "std_msgs/Header", "ros_gz_interfaces/StringVec")
    assert ros2_node.message_class("ros_gz_interfaces/StringVec") is not None
    assert ros2_node.message_class("ros_gz_interfaces/ParamVec") is None


def test_a_class_with_other_fields_is_left_out(packages):
    packages("builtin_interfaces/Time", "ros_gz_interfaces/StringVec")
    packages("std_msgs/Header", extra=["seq"])
    assert ros2_node.message_class("ros_gz_interfaces/StringVec") is None


def test_a_service_with_an_empty_response_is_taken(packages, monkeypatch):
    """rclpy's classes show no field where C needs one."""
    packages("geometry_msgs/Point", "geometry_msgs/Quaternion", "geographic_msgs/GeoPoint", "geographic_msgs/GeoPose")
    halves = {
        "Request": SimpleNamespace(get_fields_and_field_types=lambda: {"geo_pose": ""}),
        "Response": SimpleNamespace(get_fields_and_field_types=dict),
    }
    module = SimpleNamespace(SetDatum=SimpleNamespace(**halves))
    monkeypatch.setitem(sys.modules, "robot_localization", SimpleNamespace(srv=module))
    monkeypatch.setitem(sys.modules, "robot_localization.srv", module)
    assert ros2_node.service_class("robot_localization/SetDatum") is module.SetDatum


def test_calls_that_wait_are_taken_and_answered(monkeypatch):
    wire = SimpleNamespace(serialize_message=lambda asked: encode(asked, f"{DATUM}Request"))
    monkeypatch.setitem(sys.modules, "rclpy.serialization", wire)
    inbox, asked, service = Inbox(), new(f"{DATUM}Request"), MagicMock()
    service.handle.service_take_request.side_effect = [(asked, "one"), (asked, "two"), (None, None)] * 2
    node = ros2_node.Node(MagicMock(), inbox)
    node._services["/datum"] = ros2_node._Endpoint(Service("/datum", DATUM, lambda _: None), service)
    node.take()
    _, calls, _ = inbox.drain()
    assert [call.service for call in calls] == ["/datum", "/datum"]
    for call in calls:
        call.answer(None, "")
    node.take()
    assert [sent.args[1] for sent in service.send_response.call_args_list] == ["one", "two"]


class Node:
    """Stands for the node: it is slow until it is let go."""

    subscribed_topics, clients, sent = frozenset({PLAIN.name}), 1, 7

    def __init__(self, *_):
        self.published, self.lines, self.tables, self.closed = [], [], [], threading.Event()
        self.free, self.begun, self.done = threading.Event(), threading.Event(), threading.Event()
        self.broken = False

    def offer(self, table):
        self.tables.append(table)

    def publish(self, batch):
        if not batch:
            return
        self.begun.set()
        assert self.free.wait(LONGEST)
        self.published += batch
        if self.broken:
            raise RuntimeError("broken")

    def log(self, level, text):
        self.lines.append((level, text))

    def take(self):
        pass

    def look(self):
        if self.published:
            self.done.set()

    def close(self):
        self.closed.set()


@pytest.fixture
def opened(monkeypatch):
    node = Node()
    monkeypatch.setenv(RANGE_VARIABLE, "OFF")
    monkeypatch.setattr(
        ros2_node, "load_rclpy", lambda: SimpleNamespace(get_rmw_implementation_identifier=lambda: "rmw")
    )
    monkeypatch.setattr(ros2_node, "Node", lambda *_: node)
    monkeypatch.setattr(ros2_node, "has_package", lambda name: name != "tf2_msgs")
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    monkeypatch.setenv("ROS_DISTRO", "kilted")
    ros2 = Ros2(Inbox())
    yield SimpleNamespace(ros2=ros2, node=node, lines=ros2.start())
    node.free.set()
    ros2.close()


def sent(output, number):
    return Delivery(output, new("std_msgs/Float64", data=float(number)), 0.1 * number)


def test_lines_say_where_it_is_and_what_to_install(opened):
    missing = (
        "ROS 2: tf2_msgs is not installed (apt-get install ros-kilted-tf2-msgs): its topics, as /tf and /tf_static, "
        "are not published"
    )
    assert opened.lines == [f"ROS 2: node /vrx_mj in domain 7 by rmw, {RANGE_VARIABLE}=OFF", missing]


@pytest.mark.parametrize(
    ("host", "reach"), [("127.0.0.1", "LOCALHOST"), ("localhost", "LOCALHOST"), ("0.0.0.0", "SUBNET")]
)
def test_a_node_of_this_machine_alone_looks_no_further(opened, monkeypatch, host, reach):
    monkeypatch.delenv(RANGE_VARIABLE)
    ros2 = Ros2(Inbox(), host=host)
    assert ros2.start()[0].endswith(f"{RANGE_VARIABLE}={reach}")
    ros2.close()


def test_what_waits_is_bounded_and_what_is_latched_is_kept(opened):
    ros2, node = opened.ros2, opened.node
    ros2.publish([sent(PLAIN, -1)])
    assert node.begun.wait(LONGEST)
    for number in range(3 * MOST_WAITING):
        ros2.publish([sent(PLAIN, number), *([sent(GOAL, number)] if number < 2 else [])])
    assert ros2.traffic.dropped == 2 * MOST_WAITING
    node.free.set()
    assert node.done.wait(LONGEST)
    goals = [one.message.data for one in node.published if one.output is GOAL]
    plain = [one.message.data for one in node.published if one.output is PLAIN]
    assert goals == [0.0, 1.0]
    assert plain == [-1.0, *map(float, range(2 * MOST_WAITING, 3 * MOST_WAITING))]


def test_the_newest_table_and_all_lines_are_passed_on(opened):
    table = RosInterface({PLAIN.name: PLAIN})
    opened.ros2.log("WARN", "aground")
    opened.ros2.offer(table)
    opened.node.free.set()
    opened.ros2.publish([sent(PLAIN, 0)])
    assert opened.node.done.wait(LONGEST)
    assert opened.node.tables == [table]
    assert opened.node.lines == [("WARN", "aground")]
    assert opened.ros2.subscribed_topics == {PLAIN.name}
    assert opened.ros2.traffic == (1, 7, 0)


def test_what_fails_is_told_once_and_the_rest_goes_on(opened, caplog):
    opened.node.broken = True
    opened.node.free.set()
    for number in range(3):
        opened.node.begun.clear()
        opened.ros2.publish([sent(PLAIN, number)])
        assert opened.node.begun.wait(LONGEST)
    opened.ros2.close()
    assert opened.node.closed.is_set()
    assert [record.message for record in caplog.records] == ["ROS 2"]


def test_closing_waits_for_the_node(opened):
    opened.node.free.set()
    opened.ros2.close()
    assert opened.node.closed.is_set()


def test_closing_what_never_opened_does_nothing():
    ros2 = Ros2(Inbox())
    ros2.publish([sent(GOAL, 0)])
    ros2.close()
    assert ros2.subscribed_topics == frozenset()
    assert ros2.traffic == (0, 0, 0)


def test_a_publisher_has_its_nodes_name_as_soon_as_that_is_known():
    names = iter([["_NODE_NAMESPACE_UNKNOWN_/_NODE_NAME_UNKNOWN_"], ["/team/pilot"], []])
    node = SimpleNamespace(_senders={}, publishers=lambda _topic: next(names))
    assert [ros2_node.Node._sender(node, "/fire") for _ in range(3)] == ["ROS 2", "/team/pilot", "/team/pilot"]
