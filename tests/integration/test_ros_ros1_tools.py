"""Debian's ROS 1 tools, rospy, roslaunch and rosbag against our own master and node."""

import re
import signal
import time
from xmlrpc.client import ServerProxy

import pytest
from rosbags.highlevel import AnyReader

from ros1_served import LEFT, Served, free_port, needs_tools, running, small_table, tools, until

pytestmark = [pytest.mark.slow, needs_tools]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("ros_home")


@pytest.fixture(scope="module")
def served():
    with Served(free_port(), small_table("wamv", "wamv2")) as one:
        yield one


def test_topics_are_listed_described_echoed_and_measured(served, home):
    said = tools(
        "rostopic list; rostopic type /wamv/imu; rostopic info /wamv/imu; rostopic find std_msgs/Float32;"
        "rostopic hz /wamv/imu | grep -m 1 'average rate' & rostopic bw /wamv/imu | grep -m 1 -A 1 'average:' &"
        "rostopic echo -n 1 /course; rostopic echo -n 1 /wamv2/imu/header/frame_id; wait",
        served.port,
        home,
    )
    assert said.startswith(f"/clock\n/course\n/rosout\n/wamv/imu\n{LEFT}\n/wamv2/imu\n/wamv2/thrusters")
    uri = re.search(r"node /gazebo at (\S+)", served.lines[0])[1]
    assert f"sensor_msgs/Imu\nType: sensor_msgs/Imu\n\nPublishers: \n * /gazebo ({uri})\n" in said
    assert f"{LEFT}\n/wamv2/thrusters/left_thrust_cmd\n" in said
    assert 'data: "gate 3"\n---\n' in said
    assert '"wamv2"\n---\n' in said
    rate = float(re.search(r"average rate: ([\d.]+)", said)[1])
    assert 20.0 < rate <= 55.0  # 50 Hz on an idle machine; one sleep and one tick of a busy machine less
    assert re.search(r"average: [\d.]+KB/s\n\s*mean: 0.3\dKB", said)


def test_services_nodes_and_parameters(served, home):
    script = """
import rostopic, rosservice, rosnode, rosparam
def run(main, line):
    print("$", line)
    try:
        main(line.split(" ", 3))
    except SystemExit as end:
        print("exit", end.code)
for line in ["rosservice list", "rosservice type /trigger", "rosservice info /trigger", "rosservice uri /trigger"]:
    run(rosservice.rosservicemain, line)
for line in ["rosnode list", "rosnode info /gazebo", "rosnode machine"]:
    run(rosnode.rosnodemain, line)
for line in ["rosparam get /wamv/gains", "rosparam set /mine/deep {a: 1, b: [x, 2.5, true]}", "rosparam get /mine",
             "rosparam delete /mine/deep/a", "rosparam get /mine/deep", "rosparam list /wamv", "rosparam get /none"]:
    run(rosparam.yamlmain, line)
"""
    said = tools(script, served.port, home, shell="/usr/bin/python3")
    assert "/failing\n/gazebo/get_loggers\n/gazebo/reset_world\n/gazebo/set_logger_level\n/trigger\n" in said
    assert "$ rosservice type /trigger\nstd_srvs/Trigger\n" in said
    assert re.search(r"Node: /gazebo\nURI: rosrpc://127\.0\.0\.1:\d+\nType: std_srvs/Trigger\nArgs: \n", said)
    assert "$ rosnode list\n/gazebo\n" in said
    assert f"Subscriptions: \n * {LEFT} [unknown type]" in said
    assert "Pid: " in said
    assert "$ rosparam get /wamv/gains\nnames: [a, b]\np: 1.5\n" in said.replace(
        "names:\n- a\n- b\n", "names: [a, b]\n"
    )
    assert "deep:\n  a: 1\n  b:\n  - x\n  - 2.5\n  - true\n" in said
    assert "$ rosparam get /mine/deep\nb:\n- x\n- 2.5\n- true\n" in said
    assert "/wamv/gains/names\n/wamv/gains/p\n" in said
    assert "ERROR: Parameter [/none] is not set" in said


def test_commands_and_calls_arrive_and_their_errors_return(served, home):
    served.commands.clear()
    said = tools(
        f'rostopic pub -1 {LEFT} std_msgs/Float32 "data: 0.5" & '
        'rosservice call /gazebo/reset_world "{}"; rosservice call /trigger; rosservice call /failing;'
        "rosservice call /gazebo/set_logger_level ros.vrx_mj warn; rosservice call /gazebo/get_loggers;"
        "rosnode ping -c 1 /gazebo; wait",
        served.port,
        home,
    )
    until(lambda: served.commands, "the thruster's command")
    (command,) = served.commands
    assert (command.topic, command.message.data) == (LEFT, 0.5)
    assert command.sender.startswith("/rostopic_")
    assert [name for name, caller in served.called if "rosservice" in caller][:2] == ["/gazebo/reset_world", "/trigger"]
    assert 'success: True\nmessage: "ok"\n' in said
    assert "ERROR: service [/failing] responded with an error: b'no boat is named wamv9'" in said
    assert 'name: "ros.vrx_mj"\n    level: "warn"\n' in said
    assert "xmlrpc reply from" in said


def test_who_publishes_where_nobody_listens_is_reported(served, home):
    script = (
        "rostopic pub -1 /wamv1/thrusters/left_thrust_cmd std_msgs/Float32 0.5 & "
        "rostopic pub -1 /tf tf2_msgs/TFMessage '[]'; wait"
    )
    tools(script, served.port, home)
    until(lambda: served.unknown_publishers, "the unknown_publisher")
    (unknown_publisher,) = served.unknown_publishers
    assert (unknown_publisher.topic, unknown_publisher.type) == ("/wamv1/thrusters/left_thrust_cmd", "std_msgs/Float32")
    assert unknown_publisher.sender.startswith("/rostopic_")


ROSPY = """
import rospy, std_srvs.srv, threading, time
from sensor_msgs.msg import Imu
from std_msgs.msg import Float32, String
from rosgraph_msgs.msg import Log
rospy.init_node("client")
got = {}
ready = threading.Event()
def take(name):
    def callback(message):
        got.setdefault(name, message)
        if len(got) == 3:
            ready.set()
    return callback
rospy.Subscriber("/wamv/imu", Imu, take("imu"), tcp_nodelay=True)
rospy.Subscriber("/course", String, take("course"))
rospy.Subscriber("/rosout", Log, lambda m: take("log")(m) if m.name == "/gazebo" else None)
latched = rospy.Publisher("/wamv/thrusters/left_thrust_cmd", Float32, latch=True, queue_size=1)
latched.publish(0.75)
rospy.set_param("/cached", 5)
assert rospy.get_param_cached("/cached") == 5
print("ready", flush=True)
assert ready.wait(10), got
print(got["course"].data, got["imu"].header.frame_id, got["log"].msg, got["log"].level)
call = rospy.ServiceProxy("/trigger", std_srvs.srv.Trigger, persistent=True)
print([call().message for _ in range(3)])
try:
    rospy.ServiceProxy("/failing", std_srvs.srv.Trigger)()
except rospy.ServiceException as error:
    print(error)
try:
    rospy.ServiceProxy("/trigger", std_srvs.srv.Empty)()
except rospy.ServiceException as error:
    print(error)
print(rospy.get_param("/wamv/gains"), rospy.search_param("robot_description"))
rospy.set_param("~mine", {"a": [1, 2]})
print(rospy.get_param("/client/mine"))
while rospy.get_param_cached("/cached") == 5:
    time.sleep(0.01)
print(rospy.get_param_cached("/cached"))
rospy.signal_shutdown("done")
"""


def test_a_rospy_program_does_all_of_it(served, home):
    served.commands.clear()
    with running(["/usr/bin/python3", "-c", ROSPY], served.port, home, "ready") as program:
        until(lambda: served.commands, "the latched command")
        with ServerProxy(served.uri) as master:
            master.setParam("/other", "/cached", 6)
        end = time.monotonic() + 20.0
        while program.poll() is None and time.monotonic() < end:
            served.wires.log("ERROR", "boat aground")
            time.sleep(0.1)
        said = program.stdout.read()
    assert served.commands[0].message.data == 0.75
    assert served.commands[0].sender == "/client"
    lines = said.splitlines()
    assert lines[0] == "gate 3 wamv boat aground 8"
    assert lines[1] == "['ok', 'ok', 'ok']"
    assert lines[2].endswith("service [/failing] responded with an error: b'no boat is named wamv9'")
    assert "md5sums do not match" in lines[3]
    assert lines[4:] == ["{'p': 1.5, 'names': ['a', 'b']} /robot_description", "{'a': [1, 2]}", "6"]


LAUNCH = """<launch>
  <param name="/from_launch" value="7"/>
  <rosparam>table: {a: [1, 2]}</rosparam>
  <node name="pilot" pkg="rostopic" type="rostopic" required="true"
        args="pub -1 /wamv2/thrusters/left_thrust_cmd std_msgs/Float32 0.25"/>
</launch>"""


def test_roslaunch_starts_a_node_and_sets_parameters(served, home):
    (home / "pilot.launch").write_text(LAUNCH, encoding="utf-8")
    served.commands.clear()
    said = tools("roslaunch pilot.launch; rosparam get /from_launch; rosparam get /table", served.port, home)
    assert [(one.topic, one.sender) for one in served.commands] == [("/wamv2/thrusters/left_thrust_cmd", "/pilot")], (
        said
    )
    assert "7\na:\n- 1\n- 2\n" in said


def test_rosbag_records_what_is_published(served, home):
    command = ["rosbag", "record", "-O", "run.bag", "/wamv/imu", "/course", "/clock"]
    with running(command, served.port, home) as recorder:
        until(lambda: {"/wamv/imu", "/course", "/clock"} <= served.wires.subscribed_topics, "rosbag's subscriptions")
        time.sleep(0.5)  # of recording
        recorder.send_signal(signal.SIGINT)
        recorder.wait(10.0)
    with AnyReader([home / "run.bag"]) as bag:
        counts = {one.topic: one.msgcount for one in bag.connections}
    assert counts["/course"] == 1
    assert counts["/wamv/imu"] >= 5


def test_rosnode_kill_ends_the_serving(home):
    with Served(free_port(), small_table("wamv")) as one:
        said = tools("rosnode kill /gazebo", one.port, home)
        assert one.ended.wait(5.0), said
    assert re.fullmatch(r"/rosnode shut it down: user request", one.reason)
    assert "killed" in said
