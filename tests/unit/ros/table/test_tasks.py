"""Tasks by VRX 3's names, from what a task of every kind publishes."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from trees import partial
from vrx_mj.errors import CommandError
from vrx_mj.ros import cdr
from vrx_mj.ros.interface import Input, Output
from vrx_mj.ros.messages import new
from vrx_mj.ros.table.host import header
from vrx_mj.ros.table.world import task_topics
from vrx_mj.tasks import TASK_KINDS

PLACE = {"latitude": -33.7, "longitude": 150.6, "altitude": 1.5, "yaw": 2 * math.atan2(0.6, 0.8)}
TASK = {
    "name": "wayfinding",
    "state": "running",
    "ready_time": 10.0,
    "running_time": 20.0,
    "elapsed_time": 12.25,
    "remaining_time": 287.75,
    "timed_out": False,
    "num_collisions": 2,
    "score": 4.5,
    "goal": PLACE,
    "pose_error": 0.1,
    "mean_pose_error": 3.0,
    "waypoints": [PLACE],
    "min_errors": [1.0, 2.5],
    "mean_error": 1.75,
    "animals": [{**PLACE, "name": "platypus"}, {**PLACE, "name": "turtle"}],
    "color_sequence_open": True,
}
"""All that any task publishes."""
KINDS = ("gymkhana", "stationkeeping", "wayfinding", "wildlife", "perception", "scan_dock_deliver", "acoustic_tracking")
NEW = {
    "/vrx/task/info": "ros_gz_interfaces/ParamVec",
    "/vrx/stationkeeping/goal": "geometry_msgs/PoseStamped",
    "/vrx/stationkeeping/pose_error": "std_msgs/Float32",
    "/vrx/stationkeeping/mean_pose_error": "std_msgs/Float32",
    "/vrx/gymkhana_blackbox/goal": "geometry_msgs/PoseStamped",
    "/vrx/gymkhana_blackbox/pose_error": "std_msgs/Float32",
    "/vrx/gymkhana_blackbox/mean_pose_error": "std_msgs/Float32",
    "/vrx/acoustic_tracking/pose_error": "std_msgs/Float32",
    "/vrx/acoustic_tracking/mean_pose_error": "std_msgs/Float32",
    "/vrx/wayfinding/waypoints": "geometry_msgs/PoseArray",
    "/vrx/wayfinding/min_errors": "ros_gz_interfaces/Float32Array",
    "/vrx/wayfinding/mean_error": "std_msgs/Float32",
    "/vrx/wildlife/animal0/pose": "geometry_msgs/PoseStamped",
    "/vrx/wildlife/animal1/pose": "geometry_msgs/PoseStamped",
}


@pytest.fixture
def tasks(monkeypatch):
    """VRX 3's table of all tasks at once; `received` is what the simulation gets."""
    monkeypatch.setenv("VRX_DEBUG", "false")  # no contacts
    outputs, inputs, received, task = {}, {}, [], {**TASK, "channel": TASK}
    parameters = partial({"task": {"type": "wildlife", "animals": [{}, {}]}})

    def send(kind, content):
        received.append((kind, content))
        task["color_sequence_open"] = False

    for kind in KINDS:
        task["type"] = kind
        sim = SimpleNamespace(task=task, time=42.5, world=SimpleNamespace(parameters=parameters), send=send)
        host = SimpleNamespace(sim=sim)
        entries = [entry for entry in task_topics(host) if "vrx3" in entry.dialects]
        outputs |= {entry.name: entry for entry in entries if isinstance(entry, Output)}
        inputs |= {entry.name: entry for entry in entries if isinstance(entry, Input)}
    return SimpleNamespace(outputs=outputs, inputs=inputs, received=received, make=lambda name: sent(outputs[name]))


def sent(output):
    """The message as it arrives."""
    return cdr.decode(cdr.encode(output.make(), output.type), output.type)


def test_tasks_have_vrx_3s_topics_and_types(tasks):
    assert {name: output.type for name, output in tasks.outputs.items()} == NEW
    assert {name: entry.type for name, entry in tasks.inputs.items()} == {
        "/vrx/perception/landmark": "geometry_msgs/PoseStamped",
        "/vrx/scan_dock_deliver/color_sequence": "ros_gz_interfaces/StringVec",
    }


@pytest.mark.parametrize("kind", TASK_KINDS)
def test_what_goes_out_at_no_rate_is_latched_and_comes_once_a_second_in_vrx_3(kind, monkeypatch):
    monkeypatch.setenv("VRX_DEBUG", "false")
    world = SimpleNamespace(parameters=partial({"task": {"type": kind, "animals": [{}]}}))
    host = SimpleNamespace(sim=SimpleNamespace(task={**TASK, "type": kind}, world=world))
    outputs = [entry for entry in task_topics(host) if isinstance(entry, Output)]
    classic = [one for one in outputs if "vrx" in one.dialects]
    assert [one.latched for one in classic] == [one.rate == 0.0 for one in classic]
    assert {one.rate for one in outputs if "vrx3" in one.dialects} == {1.0}


def test_task_info_is_parameters(tasks):
    info = tasks.make("/vrx/task/info")
    values = {
        one.name: {1: one.value.bool_value, 2: one.value.integer_value, 3: one.value.double_value,
                   4: one.value.string_value}[one.value.type]
        for one in info.params
    }  # fmt: skip
    assert values == {
        "name": "wayfinding",
        "state": "running",
        "ready_time": 10.0,
        "running_time": 20.0,
        "elapsed_time": 12.25,
        "remaining_time": 287.75,
        "timed_out": False,
        "num_collisions": 2,
        "score": 4.5,
    }
    assert (info.header.stamp.sec, info.header.stamp.nanosec) == (42, 500_000_000)


@pytest.mark.parametrize(("state", "left"), [("initial", 0), ("ready", 0), ("running", 287), ("finished", 287)])
def test_no_time_is_left_before_the_run(state, left):
    host = SimpleNamespace(sim=SimpleNamespace(task={**TASK, "type": "perception", "state": state}))
    info = next(task_topics(host)).make()
    assert info.remaining_time.sec == left


@pytest.mark.parametrize(
    ("name", "frame"), [("/vrx/stationkeeping/goal", ""), ("/vrx/wildlife/animal1/pose", "turtle")]
)
def test_places_have_latitude_and_longitude_for_x_and_y(tasks, name, frame):
    place = tasks.make(name)
    where = place.pose.position
    assert (where.x, where.y, where.z) == (-33.7, 150.6, 1.5)
    assert (place.pose.orientation.z, place.pose.orientation.w) == pytest.approx((0.6, 0.8), abs=1e-15)
    assert place.header.frame_id == frame


def test_waypoints_are_poses(tasks):
    assert [(pose.position.x, pose.position.y) for pose in tasks.make("/vrx/wayfinding/waypoints").poses] == [
        (-33.7, 150.6)
    ]


def test_errors_are_single(tasks):
    assert tasks.make("/vrx/stationkeeping/pose_error").data == np.float32(0.1)
    assert tasks.make("/vrx/wayfinding/min_errors").data.tolist() == [1.0, 2.5]


def test_animals_come_once_a_second(tasks):
    assert tasks.outputs["/vrx/wildlife/animal0/pose"].rate == 1.0


def test_a_landmark_is_reported(tasks):
    pose = new("geometry_msgs/PoseStamped", header=header(1.0, "mb_marker_buoy_red"),
               pose={"position": {"x": -33.5, "y": 150.5}})  # fmt: skip
    tasks.inputs["/vrx/perception/landmark"].take(pose)
    content = {"type": "mb_marker_buoy_red", "latitude": -33.5, "longitude": 150.5}
    assert tasks.received == [("landmark", content)]


def test_three_colours_are_reported_once(tasks):
    take = tasks.inputs["/vrx/scan_dock_deliver/color_sequence"].take
    take(SimpleNamespace(data=["red", "green", "blue"]))
    assert tasks.received == [("color_sequence", ["red", "green", "blue"])]
    with pytest.raises(CommandError, match=r"^a sequence of colours is accepted only once, while the task runs$"):
        take(SimpleNamespace(data=["red", "green", "blue"]))
    with pytest.raises(CommandError, match=r"^2 colours: 3 are needed, as in \['red', 'green', 'blue'\]$"):
        take(SimpleNamespace(data=["red", "green"]))
