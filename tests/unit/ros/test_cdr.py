import contextlib
import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros import cdr
from vrx_mj.ros.interface import parameters
from vrx_mj.ros.messages import decode, encode, is_known, new, stamp
from vrx_mj.ros.table.host import header

GOLDEN = json.loads((Path(__file__).parents[2] / "golden/ros/cdr.json").read_text(encoding="utf-8"))["bytes"]
HEAD = header(12.5, "wamv/base_link")
INFO = new(
    "sensor_msgs/CameraInfo",
    header=HEAD,
    height=4,
    width=6,
    distortion_model="plumb_bob",
    D=np.array([0.5, 0.25]),
    K=np.arange(9.0),
    R=1.0 + np.arange(9.0),
    P=2.0 * np.arange(12.0),
)
IMU = new(
    "sensor_msgs/Imu",
    header=HEAD,
    orientation={"x": 0.1, "y": 0.2, "z": 0.3, "w": 0.9},
    linear_acceleration={"x": 1.0, "y": 2.0, "z": 9.8},
)
JOINTS = new(
    "sensor_msgs/JointState",
    header=HEAD,
    name=["a", "bcd"],
    position=np.array([1.0, 2.0]),
    velocity=np.array([0.0, 0.5]),
)
POSE = new("geometry_msgs/PoseStamped", header=HEAD, pose={"position": {"x": -33.7, "y": 150.6, "z": 1.0},
                                                           "orientation": {"w": 1.0}})  # fmt: skip
MADE = {
    "sensor_msgs/CameraInfo": INFO,
    "sensor_msgs/Imu": IMU,
    "sensor_msgs/JointState": JOINTS,
    "geometry_msgs/PoseStamped": POSE,
    "std_msgs/Float32": new("std_msgs/Float32", data=0.1),
    "std_msgs/Bool": new("std_msgs/Bool", data=True),
    "rosgraph_msgs/Clock": new("rosgraph_msgs/Clock", clock=stamp(7.000000009)),
}
VALUES = {"bool": True, "int": 7, "float": 0.5, "str": "ready"}


@pytest.mark.parametrize("type_name", sorted(MADE))
def test_ros_1s_messages_become_the_bytes_that_rclpy_writes(type_name):
    assert same(cdr.encode(MADE[type_name], type_name), type_name, bytes.fromhex(GOLDEN[type_name]))


@pytest.mark.parametrize("name", sorted(VALUES))
def test_parameters_become_the_bytes_that_rclpy_writes(name):
    (one,) = parameters(HEAD, {name: VALUES[name]}).params
    theirs = bytes.fromhex(GOLDEN[f"rcl_interfaces/Parameter {name}"])
    assert same(cdr.encode(one, "rcl_interfaces/Parameter"), "rcl_interfaces/Parameter", theirs)


def same(ours, type_name, theirs):
    """Whether bytes are equal but for gaps that align numbers and up to eight after: rclpy leaves anything there."""
    understood = cdr.encode(cdr.decode(theirs, type_name), type_name)
    return understood == ours and 0 <= len(theirs) - len(ours) <= 8


def test_every_type_of_vrx_3s_that_only_ros_2_has_is_known():
    for name in ("ParamVec", "StringVec", "Float32Array", "Contacts"):
        assert is_known(f"ros_gz_interfaces/{name}", cdr.typestore)
        assert not is_known(f"ros_gz_interfaces/{name}")


HASHES = {
    "BoundingBox2D": "RIHS01_008eacbb0cf8f26e83795547bed013eec3675485ef386ec056d80eaaf1c1ce2f",
    "Detection2D": "RIHS01_0d12b69df5c593b3455b7346fac8205437a7d4bcb09b9e0e0b2dde787ded38ea",
}
"""Of code that ROS 2's generators wrote for vision_msgs."""


@pytest.mark.parametrize("name", HASHES)
def test_types_of_vision_are_those_of_ros_2(name):
    assert cdr.typestore().hash_rihs01(f"vision_msgs/msg/{name}") == HASHES[name]


def test_fields_tell_which_have_messages_in_them():
    assert cdr.fields("ros_gz_interfaces/ParamVec") == (
        ("header", "std_msgs/Header"),
        ("params", "rcl_interfaces/Parameter"),
    )
    assert cdr.fields("sensor_msgs/PointField")[:2] == (("name", None), ("offset", None))


@given(st.floats(), st.floats(allow_nan=False), st.text(st.characters(codec="utf-8", exclude_characters="\0")))
def test_messages_come_back(x, y, frame):
    pose = new("geometry_msgs/PoseStamped", header={"frame_id": frame}, pose={"position": {"x": x, "y": y}})
    back = cdr.decode(cdr.encode(pose, "geometry_msgs/PoseStamped"), "geometry_msgs/PoseStamped")
    assert back.header.frame_id == frame
    assert back.pose.position.y == y
    assert back.pose.position.x == x or (math.isnan(x) and math.isnan(back.pose.position.x))


@given(st.binary(max_size=200))
def test_bytes_that_are_no_message_are_refused_and_nothing_else(raw):
    for type_name in ("ros_gz_interfaces/StringVec", "geometry_msgs/PoseStamped", "std_msgs/Float64"):
        with contextlib.suppress(CommandError):
            cdr.decode(raw, type_name)


def test_a_list_longer_than_any_is_refused_before_memory_is_taken():
    raw = bytes.fromhex("00010000") + bytes(12) + (1 << 30).to_bytes(4, "little")
    with pytest.raises(CommandError, match=r"^20 bytes are not a ros_gz_interfaces/StringVec: "):
        cdr.decode(raw, "ros_gz_interfaces/StringVec")


def test_bytes_of_another_encoding_are_refused_with_what_they_begin_with():
    with pytest.raises(CommandError) as caught:
        cdr.decode(bytes.fromhex("0003000000000000"), "std_msgs/Float64")
    assert str(caught.value) == (
        "8 bytes are not a std_msgs/Float64: they begin with 00 03 00 00, which is not plain CDR"
    )


def test_big_endian_bytes_are_read():
    assert cdr.decode(bytes.fromhex("00000000c004000000000000"), "std_msgs/Float64").data == -2.5


def test_ros_1s_own_bytes_stay_as_they_are():
    assert decode(encode(INFO, "sensor_msgs/CameraInfo"), "sensor_msgs/CameraInfo").K.tolist() == list(range(9))


def test_what_only_ros_2_has_of_a_message_is_empty():
    place = {"position": {"x": 1.0, "y": 2.0, "z": 3.0}, "orientation": {"w": 1.0}}
    points = [new("geometry_msgs/Point", x=float(x)) for x in range(3)]
    marker = new("visualization_msgs/Marker", header=HEAD, ns="shore", id=4, type=11, pose=place, points=points)
    raw = cdr.encode(new("visualization_msgs/MarkerArray", markers=[marker]), "visualization_msgs/MarkerArray")
    (read,) = cdr.decode(raw, "visualization_msgs/MarkerArray").markers
    assert (read.header.frame_id, read.ns, read.id, read.type) == ("wamv/base_link", "shore", 4, 11)
    assert [point.x for point in read.points] == [0.0, 1.0, 2.0]
    assert (read.pose.position.z, read.pose.orientation.w) == (3.0, 1.0)
    assert (read.uv_coordinates, read.mesh_file.filename) == ([], "")
