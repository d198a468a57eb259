"""Tasks by VRX 3's names, from messages that stand for theirs."""

from types import SimpleNamespace

import numpy as np
import pytest

from trees import partial
from vrx_mj.errors import CommandError
from vrx_mj.ros import cdr
from vrx_mj.ros.interface import Input, Output, RosInterface, Service
from vrx_mj.ros.messages import new, stamp
from vrx_mj.ros.table.host import header
from vrx_mj.ros.table.vrx3 import make_vrx3_table

INFO = new(
    "vrx_gazebo/Task",
    name="wayfinding",
    state="running",
    ready_time=stamp(10.0),
    running_time=stamp(20.0),
    elapsed_time=stamp(12.25),
    remaining_time=stamp(287.75),
    timed_out=False,
    num_collisions=2,
    score=4.5,
)
GOAL = new(
    "geographic_msgs/GeoPoseStamped",
    header=header(10.0, "platypus"),
    pose={"position": {"latitude": -33.7, "longitude": 150.6, "altitude": 1.5}, "orientation": {"z": 0.6, "w": 0.8}},
)
PATH = new("geographic_msgs/GeoPath", header=header(10.0), poses=[GOAL, GOAL])
OLD = {
    "/vrx/task/info": INFO,
    "/vrx/station_keeping/goal": GOAL,
    "/vrx/station_keeping/pose_error": new("std_msgs/Float64", data=0.1),
    "/vrx/gymkhana_blackbox/goal": GOAL,
    "/vrx/acoustic_tracking/mean_pose_error": new("std_msgs/Float64", data=3.0),
    "/vrx/wayfinding/waypoints": PATH,
    "/vrx/wayfinding/min_errors": new("std_msgs/Float64MultiArray", data=np.array([1.0, 2.5])),
    "/vrx/wayfinding/mean_error": new("std_msgs/Float64", data=1.75),
    "/vrx/wildlife/animals/poses": PATH,
}
NEW = {
    "/vrx/task/info": "ros_gz_interfaces/ParamVec",
    "/vrx/stationkeeping/goal": "geometry_msgs/PoseStamped",
    "/vrx/stationkeeping/pose_error": "std_msgs/Float32",
    "/vrx/gymkhana_blackbox/goal": "geometry_msgs/PoseStamped",
    "/vrx/acoustic_tracking/mean_pose_error": "std_msgs/Float32",
    "/vrx/wayfinding/waypoints": "geometry_msgs/PoseArray",
    "/vrx/wayfinding/min_errors": "ros_gz_interfaces/Float32Array",
    "/vrx/wayfinding/mean_error": "std_msgs/Float32",
    "/vrx/wildlife/animal0/pose": "geometry_msgs/PoseStamped",
    "/vrx/wildlife/animal1/pose": "geometry_msgs/PoseStamped",
}


@pytest.fixture
def tasks():
    """VRX 3's table of all tasks at once, in a world without boats; `said` is what comes in."""
    said = []

    def report(kind):
        return lambda message: said.append((kind, message))

    def colors(request):
        said.append(("colors", (request.color1, request.color2, request.color3)))
        return new("vrx_gazebo/ColorSequenceResponse", success=len(said) == 1)

    sim = SimpleNamespace(
        boats=(),
        time=42.5,
        world=SimpleNamespace(parameters=partial({"task": {"type": "wildlife", "animals": [{}, {}]}})),
        placards=(),
        lights=(),
    )
    old = RosInterface(
        {name: Output(name, "", lambda message=message: message, 1.0) for name, message in OLD.items()},
        {"/vrx/perception/landmark": Input("/vrx/perception/landmark", "", report("landmark"))},
        {
            f"/vrx/{name}/color_sequence": Service(f"/vrx/{name}/color_sequence", "", colors)
            for name in ("scan_dock", "scan_dock_deliver")
        },
    )
    made = make_vrx3_table(SimpleNamespace(sim=sim), old)
    return SimpleNamespace(table=made, said=said, make=lambda name: sent(made.outputs[name]))


def sent(output):
    """The message as it arrives."""
    return cdr.decode(cdr.encode(output.make(), output.type), output.type)


def test_tasks_have_vrx_3s_topics_and_types(tasks):
    made = {name: output.type for name, output in tasks.table.outputs.items() if name != "/vrx/contacts"}
    assert made == NEW
    assert {name: entry.type for name, entry in tasks.table.inputs.items()} == {
        "/vrx/perception/landmark": "geometry_msgs/PoseStamped",
        "/vrx/scan_dock_deliver/color_sequence": "ros_gz_interfaces/StringVec",
    }


def test_task_info_is_parameters(tasks):
    told = tasks.make("/vrx/task/info")
    values = {
        one.name: {1: one.value.bool_value, 2: one.value.integer_value, 3: one.value.double_value,
                   4: one.value.string_value}[one.value.type]
        for one in told.params
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
    assert (told.header.stamp.sec, told.header.stamp.nanosec) == (42, 500_000_000)


@pytest.mark.parametrize("name", ["/vrx/stationkeeping/goal", "/vrx/wildlife/animal1/pose"])
def test_places_have_latitude_and_longitude_for_x_and_y(tasks, name):
    told = tasks.make(name)
    where = told.pose.position
    assert (where.x, where.y, where.z) == (-33.7, 150.6, 1.5)
    assert (told.pose.orientation.z, told.pose.orientation.w) == (0.6, 0.8)
    assert told.header.frame_id == "platypus"


def test_waypoints_are_poses(tasks):
    assert [(pose.position.x, pose.position.y) for pose in tasks.make("/vrx/wayfinding/waypoints").poses] == [
        (-33.7, 150.6)
    ] * 2


def test_errors_are_single(tasks):
    assert tasks.make("/vrx/stationkeeping/pose_error").data == np.float32(0.1)
    assert tasks.make("/vrx/wayfinding/min_errors").data.tolist() == [1.0, 2.5]


def test_animals_come_once_a_second(tasks):
    assert tasks.table.outputs["/vrx/wildlife/animal0/pose"].rate == 1.0


def test_a_landmark_is_reported(tasks):
    pose = new("geometry_msgs/PoseStamped", header=header(1.0, "mb_marker_buoy_red"),
               pose={"position": {"x": -33.5, "y": 150.5}})  # fmt: skip
    tasks.table.inputs["/vrx/perception/landmark"].take(pose)
    ((kind, message),) = tasks.said
    assert kind == "landmark"
    assert message.header.frame_id == "mb_marker_buoy_red"
    assert (message.pose.position.latitude, message.pose.position.longitude) == (-33.5, 150.5)


def test_three_colours_are_reported_once(tasks):
    take = tasks.table.inputs["/vrx/scan_dock_deliver/color_sequence"].take
    take(SimpleNamespace(data=["red", "green", "blue"]))
    assert tasks.said == [("colors", ("red", "green", "blue"))]
    with pytest.raises(CommandError, match=r"^no sequence of colours is accepted now: only one, while the task runs$"):
        take(SimpleNamespace(data=["red", "green", "blue"]))
    with pytest.raises(CommandError, match=r"^2 colours: 3 are needed, as in \['red', 'green', 'blue'\]$"):
        take(SimpleNamespace(data=["red", "green"]))
