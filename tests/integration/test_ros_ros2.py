"""ROS 2 with the rclpy of its wheels: who has none is told how to install them."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from needs import RCLPY, ROS2_HOME, ROS2_SITE, needs

BEGIN = f"import sys; sys.path.append({str(ROS2_SITE)!r}); "
"""At the end: numpy stays our own."""


def environment(tmp_path):
    """Of a program: this machine alone, a domain of this test process, and logs in a folder of the test's own."""
    libraries = [ROS2_HOME / "lib", *sorted(ROS2_SITE.glob("ros_*.libs"))]
    return os.environ | {
        "LD_LIBRARY_PATH": os.pathsep.join(map(str, libraries)),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
        "ROS_LOG_DIR": str(tmp_path),
        "PYTHONPATH": str(Path(__file__).parents[1]),
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }


def started(tmp_path, code, *arguments, **how):
    """A program of Python that may import rclpy and vrx_mj."""
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN + code, *map(str, arguments)], env=environment(tmp_path), text=True, **how
    )


pytestmark = [needs(RCLPY), pytest.mark.slow]

HERE = Path(__file__).parent / "ros2"
TIMEOUT = 240
RUN = "import runpy; sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
SERVE = "from vrx_mj.cli import main; sys.argv[0] = 'vrx-mj'; main()"
WORLD = """
sea: {model: none}
wind: {}
georeference: {latitude: -33.72, longitude: 150.68}
"""
FLEET = """
boats: [{name: wamv, pose: [0, 0, -0.1, 0, 0, 0]}]
thrusters: H
sensors: [gps, imu, ground_truth, camera]
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the transport and a node before it saw."""
    with started(
        tmp_path_factory.mktemp("ros2"), RUN, HERE / "exchange.py", stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as program:
        out, err = program.communicate(timeout=TIMEOUT)
    assert program.returncode == 0, err
    return json.loads(out)


def test_it_says_where_it_is_and_what_is_missing(told):
    first, *missing = told["lines"]
    assert first.startswith("ROS 2: node /vrx_mj in domain ")
    assert first.endswith(" by rmw_fastrtps_cpp, ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST")
    assert missing[0] == (
        "ROS 2: ros_gz_interfaces is not installed (apt-get install ros-jazzy-ros-gz-interfaces): its topics, as "
        "/vrx/task/info and range_bearing, are not published"
    )
    assert "/params" not in told["topics"]


def test_readings_arrive_as_they_were(told):
    assert told["imu"] == [0.25, "wamv/link"]
    assert told["stamp"] == [12, 500_000_000]
    assert told["image"] == [6, bytes(range(72)).hex()]
    assert told["info"] == [[0.5], [float(number) for number in range(9)]]


def test_who_comes_late_gets_the_latched_messages(told):
    assert told["goal"] == [-33.5, 150.5]
    assert told["markers"] == [[7, "wamv/link", ""]]  # its mesh file is ROS 2's alone


def test_only_what_somebody_listens_to_is_wanted(told):
    assert told["wanted at first"] == []
    assert told["wanted"] == ["/goal", "/image", "/imu", "/info", "/markers"]


def test_commands_come_in_order_with_their_sender(told):
    thrusts = [one for one in told["commands"] if one[0] != "/fire"]
    assert thrusts == [["/wamv/thrusters/left/thrust", value, "/client", "vrx3"] for value in (1.5, 2.5, 3.5)]
    assert ["/fire", True, "/client", "vrx3"] in told["commands"]


def test_a_service_is_answered_and_one_that_failed_too(told):
    called = ["/world/bay/set", True]
    assert told["calls"] == [called, [True, "set"], called, [False, ""]]


def test_a_topic_that_nobody_here_listens_to_is_told_of(told):
    assert told["unknown_publishers"] == ["/wamv/thrusters/left/thurst", "std_msgs/String", "/client", "vrx3"]


def test_a_new_table_withdraws_what_is_not_in_it(told):
    assert "/image" in told["topics in the end"]
    assert not {"/imu", "/info"} & set(told["topics in the end"])


def test_publishing_does_not_hold_up_the_simulation(told):
    """It is handed over: 1 ms is far more than a lock takes, and less than ROS 2 can take for an image."""
    assert told["cost"] < 1e-3


def test_it_counts_and_closes(told):
    assert told["sent"] > 0
    assert told["clients"] == 1
    assert told["closing"] < 2.0
    assert told["threads"] == []


@pytest.mark.render
def test_a_boat_is_driven_and_nothing_is_left_behind(tmp_path):
    for name, text in (("world", WORLD), ("fleet", FLEET)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    arguments = (
        "serve",
        tmp_path / "world.yaml",
        "--fleet",
        tmp_path / "fleet.yaml",
        "--ros2",
        "--localization",
        "--duration",
        600,
    )
    with started(tmp_path, SERVE, *arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as served:
        with started(tmp_path, RUN, HERE / "drive.py", stdout=subprocess.PIPE, stderr=subprocess.PIPE) as driver:
            out, err = driver.communicate(timeout=TIMEOUT)
        served.send_signal(signal.SIGINT)
        log = served.communicate(timeout=30)[0]
    assert driver.returncode == 0, err + log
    told = json.loads(out)
    assert 0.5 < told["speed"] < 5.0  # after 3 s; a thrust that ended after 1 s gives less
    assert told["image"] == [1280, 720, 3 * 1280 * 720, "wamv/front_camera_link"]
    assert "<robot" in told["robot"]
    assert told["frames"] == ["wamv/odom", "wamv/base_link", True]
    assert max(map(abs, told["apart"])) < 0.6  # both come at 30 and 10 Hz, of a boat that goes 2 m/s
    assert served.returncode == 0, log
    assert "by VRX 3's names" in log
    assert "Traceback" not in log
