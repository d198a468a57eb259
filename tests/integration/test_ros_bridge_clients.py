"""The real clients of rosbridge, roslibpy and roslibjs, each in one process that does all that users do."""

import base64
import json
import math
import subprocess
import sys
from pathlib import Path

import pytest

import roslibjs
from bridged import COVARIANCE, PIXELS, Bridged, image, imu, publishing
from vrx_mj.ros import messages

SCRIPTS = Path(__file__).parent / "rosbridge"
TIME = 60.0
MAKE = {
    "/clock": lambda time: messages.new("rosgraph_msgs/Clock", clock=messages.stamp(time)),
    "/wamv/sensors/imu/data": lambda time: imu(time=time),
    "/wamv/sensors/camera/image_raw": lambda _: image(),
}
NULLED = [None if math.isnan(value) else value for value in COVARIANCE]
OURS = {
    "/clock": "rosgraph_msgs/Clock",
    "/rosout": "rosgraph_msgs/Log",
    "/vrx/task/info": "std_msgs/String",
    "/wamv/cmd_vel": "geometry_msgs/Twist",
    "/wamv/joint_states": "sensor_msgs/JointState",
    "/wamv/sensors/camera/image_raw": "sensor_msgs/Image",
    "/wamv/sensors/imu/data": "sensor_msgs/Imu",
    "/wamv/thrusters/left_thrust_cmd": "std_msgs/Float32",
    "/wind/speed": "std_msgs/Float64",
}
PARAMETERS = ["/use_sim_time", "/wamv/gains/limits", "/wamv/gains/p", "/wamv/robot_description"]


def run(command):
    """What a script prints, and the server that it talked with."""
    with Bridged() as bridged:
        bridged.send("/vrx/task/info", messages.new("std_msgs/String", data="ready"))
        with publishing(bridged, MAKE):
            command = [str(part) for part in [*command, bridged.bridge.port]]
            done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=TIME, check=False)
        assert done.returncode == 0, done.stderr[-3000:]
        assert done.stderr == ""
        bridged.wait(lambda b: b.wires.traffic.clients == 0)
        assert bridged.wires.subscribed_topics == frozenset()
        return json.loads(done.stdout), bridged


def check_services(seen):
    assert seen["reset"] == {}
    assert seen["fire"] == {"success": True, "message": "away"}
    assert seen["sum"] == {"sum": 42}
    assert seen["parameter"] == {"limit": 2.5}
    assert seen["parameters"] == PARAMETERS
    assert [part["type"] for part in seen["request"]] == ["gazebo_msgs/DeleteModelRequest"]
    assert seen["response"][0]["fieldtypes"] == ["bool", "string"]
    assert seen["nodes"][0] == "/gazebo"
    assert len(seen["nodes"]) == 3
    assert seen["node"]["subscribing"] == ["/wamv/cmd_vel", "/wamv/thrusters/left_thrust_cmd"]


def test_roslibpy_does_everything():
    seen, bridged = run([sys.executable, SCRIPTS / "everything.py"])
    assert seen["imu"]["orientation_covariance"] == NULLED
    assert seen["imu"]["header"]["frame_id"] == seen["relative"] == "wamv/imu_link"
    assert seen["throttled"]["seconds"] >= 0.6  # three times 200 ms between four
    assert base64.b64decode(seen["image"]) == PIXELS.tobytes()
    assert (seen["latched"], seen["talk"]) == ("ready", "ahoy")
    assert seen["refused"] == "no model named 'wamx'; known: wamv"
    assert seen["table parameter"] == {"p": 1.5, "limits": [1, 2]}
    assert set(OURS) < set(seen["topics"])
    assert seen["topic type"] == "geometry_msgs/Twist"
    assert seen["topics for type"] == ["/wamv/thruster/left", "/wamv/thrusters/left_thrust_cmd"]
    assert {"/gazebo/reset_world", "/wamv/fire", "/rosapi/topics"} < set(seen["services"])
    assert (seen["service type"], seen["services for type"]) == ("std_srvs/Trigger", ["/gazebo/reset_world"])
    assert [part["type"] for part in seen["message"]] == [
        "sensor_msgs/Imu",
        "std_msgs/Header",
        "geometry_msgs/Quaternion",
        "geometry_msgs/Vector3",
        "time",
    ]
    assert seen["time"].keys() == {"secs", "nsecs"}
    assert seen["action servers"] == {"action_servers": []}
    check_services(seen)
    assert [(topic, message.data) for topic, message in bridged.came] == [("/wamv/thrusters/left_thrust_cmd", 5.0)]
    assert [unknown[:2] for unknown in bridged.unknown_publishers] == [("/wamv/thruster/left", "std_msgs/Float32")]


@pytest.mark.slow
def test_roslibjs_does_everything():
    seen, bridged = run(["node", SCRIPTS / "everything.mjs", roslibjs.installed()])
    assert seen["none"]["orientation_covariance"] == seen["png"]["orientation_covariance"] == NULLED
    assert seen["cbor"]["orientation_covariance"] == ["0.5", "0", "NaN", "0", "1", "0", "0", "0", "1"]
    assert seen["cbor"]["header"]["frame_id"] == "wamv/imu_link"
    raw = messages.decode(base64.b64decode(seen["raw"]["bytes"]), "sensor_msgs/Imu")
    assert raw.header.stamp.sec == seen["raw"]["secs"]
    assert raw.orientation.w == 1.0
    assert base64.b64decode(seen["image"]) == bytes(seen["pixels"]) == PIXELS.tobytes()
    assert 200.0 <= seen["throttled"] < 5000.0  # twice 100 ms between three
    assert (seen["latched"], seen["talk"]) == ("ready", "ahoy")
    assert seen["publishers"] == seen["nodes"][1:2]
    assert seen["refused"] == "no model named 'x'; known: wamv"
    assert seen["slow"] == {"success": True, "message": "later"}
    listed = dict(zip(seen["topics"]["topics"], seen["topics"]["types"], strict=True))
    assert listed == OURS | {"/talk": "std_msgs/String"}
    assert (seen["topicType"], seen["topicsForType"]) == ("geometry_msgs/Twist", ["/wamv/cmd_vel"])
    assert {"/gazebo/reset_world", "/slow"} < set(seen["services"])
    assert (seen["serviceType"], seen["servicesForType"]) == ("std_srvs/Trigger", ["/gazebo/reset_world"])
    assert seen["imu"]["header"] == {"seq": "uint32", "stamp": "time", "frame_id": "string"}
    assert seen["imu"]["orientation_covariance"] == ["float64"]
    assert seen["actionServers"] == []
    assert seen["text"].startswith("geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n=")
    assert seen["status"] == "auth: this server has no authentication; leave it out"
    check_services(seen)
    (topic, twist), = bridged.came  # fmt: skip
    assert (topic, twist.linear.x, twist.linear.y, twist.angular.z) == ("/wamv/cmd_vel", 1.0, 0.0, -0.5)
