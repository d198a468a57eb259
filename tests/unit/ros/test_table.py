"""The table of topics and services, held against the list of VRX's tutorial, and what goes out."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from ros_scene import run, served
from vrx_mj.ros.messages import is_known, new

TUTORIAL = json.loads((Path(__file__).parents[2] / "golden" / "ros" / "tutorial.json").read_text("utf-8"))
ERRORS = ("pose_error", "mean_pose_error", "rms_error")


# The list


def _excepted(name):
    return any(name == part or name.endswith(f"/{part}") for part in TUTORIAL["exceptions"])


def test_the_tutorials_list_is_ours_but_for_the_exceptions(course):
    table = served(course).network.table
    topics = {entry.name: entry.type for entry in (*table.outputs.values(), *table.inputs.values())}
    services = {service.name: service.type for service in table.services.values()}
    theirs = {name: kind for name, kind in TUTORIAL["topics"].items() if not _excepted(name)}
    assert {name: kind for name, kind in topics.items() if name not in TUTORIAL["ours"]} == theirs
    assert {name: kind for name, kind in services.items() if name not in TUTORIAL["ours"]} == TUTORIAL["services"]


def test_every_exception_and_every_addition_has_a_reason_and_is_one(course):
    table = served(course).network.table
    ours = {*table.outputs, *table.inputs, *table.services}
    assert all(len(reason) > 10 for reason in (*TUTORIAL["exceptions"].values(), *TUTORIAL["ours"].values()))
    assert not [name for name in ours if _excepted(name)]
    assert set(TUTORIAL["ours"]) <= ours
    assert all(
        any(name == part or name.endswith(f"/{part}") for name in TUTORIAL["topics"]) for part in TUTORIAL["exceptions"]
    )


@pytest.mark.parametrize(
    ("world", "names"),
    [
        (
            "stationkeeping_task",
            ["station_keeping/goal", *(f"station_keeping/{error}" for error in ERRORS)],
        ),
        ("wayfinding_task", ["wayfinding/waypoints", "wayfinding/min_errors", "wayfinding/mean_error"]),
        ("perception_task", ["perception/landmark"]),
        ("wildlife_task", ["wildlife/animals/poses"]),
        ("scan_dock_deliver", ["scan_dock_deliver/color_sequence", "scan_dock/placard_symbol"]),
        (
            "gymkhana",
            [
                "gymkhana_channel/task/info",
                "gymkhana_blackbox/goal",
                "gymkhana_blackbox/mean_pose_error",
                "gymkhana_blackbox/task/info",
                "gymkhana_channel/debug/contact",
            ],
        ),
    ],
)
def test_tasks_have_vrxs_topics(world, names):
    table = served(vrx_mj.compile_world(world)).network.table
    known = {**table.outputs, **table.inputs, **table.services}
    assert {f"/vrx/{name}" for name in (*names, "task/info", "debug/contact")} <= known.keys()
    assert all(is_known(entry.type) for entry in (*table.outputs.values(), *table.inputs.values()))


def test_debug_topics_are_silent_where_vrx_debug_is_false(monkeypatch):
    monkeypatch.setenv("VRX_DEBUG", "false")
    assert not [
        name for name in served(vrx_mj.compile_world("stationkeeping_task")).network.table.outputs if "debug" in name
    ]


# What goes out


def test_only_what_is_wanted_is_made_and_as_often_as_it_says(scene):
    scene.network.subscribed_topics = frozenset({"/clock", "/wamv1/sensors/imu/imu/data", "/wamv1/joint_states"})
    run(scene, 2.0)
    rates = {
        name: len(sent) / 2.0 for name, sent in scene.network.got.items() if name in scene.network.subscribed_topics
    }
    assert rates == {"/clock": 100.0, "/wamv1/sensors/imu/imu/data": 15.0, "/wamv1/joint_states": 100.0}
    latched = {name for name, output in scene.network.table.outputs.items() if output.latched}
    assert scene.network.got.keys() - scene.network.subscribed_topics <= latched
    assert scene.network.got["/tf_static"][0].message.transforms


def test_a_reading_is_the_sensors_own(scene):
    scene.network.subscribed_topics = frozenset({"/wamv1/sensors/imu/imu/data", "/wamv1/sensors/gps/gps/fix"})
    run(scene, 1.0)
    names = {sensor.config.type: sensor.name for sensor in scene.sim.mounted("wamv1")}
    reading = scene.sim.sense("wamv1")[names["imu"]]
    message = scene.network.got["/wamv1/sensors/imu/imu/data"][-1].message
    assert message.header.frame_id == reading.frame == "wamv1/imu_wamv_link"
    assert message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec == pytest.approx(reading.time, abs=1e-9)
    told = (message.orientation.w, message.orientation.x, message.orientation.y, message.orientation.z)
    assert told == tuple(reading.data.orientation)
    fix = scene.network.got["/wamv1/sensors/gps/gps/fix"][-1].message
    assert (fix.latitude, fix.longitude) == (
        scene.sim.sense("wamv1")[names["gps"]].data.latitude, scene.sim.sense("wamv1")[names["gps"]].data.longitude,
    )  # fmt: skip


def test_the_clock_comes_last_of_a_moment(scene):
    order = []
    scene.network.publish = lambda batch: order.extend(sent.output.name for sent in batch)
    scene.network.subscribed_topics = frozenset(scene.network.table.outputs)
    scene.server.tick()
    assert order[-1] == "/clock"


def test_model_states_tell_where_boats_are_and_how_they_move_in_the_world(scene):
    scene.sim.set_boat("wamv1", velocity=(2.0, 0.0, 0.0, 0.0, 0.0, 0.3))
    scene.network.subscribed_topics = frozenset({"/gazebo/model_states", "/gazebo/link_states"})
    scene.server.tick()
    states = scene.network.got["/gazebo/model_states"][-1].message
    index, seen = states.name.index("wamv1"), scene.sim.observe()["wamv1"]
    position, linear = states.pose[index].position, states.twist[index].linear
    assert (position.x, position.y, position.z) == pytest.approx(tuple(seen.position), abs=1e-9)
    along = linear.x * math.cos(seen.heading) + linear.y * math.sin(seen.heading)
    assert along == pytest.approx(seen.velocity[0], abs=0.01)
    assert states.twist[index].angular.z == pytest.approx(seen.angular_velocity[2], abs=1e-3)
    assert "wamv1::wamv1/base_link" in scene.network.got["/gazebo/link_states"][-1].message.name


def test_the_frame_of_a_steered_engine_turns(scene):
    scene.inbox.message("/wamv1/thrusters/left_thrust_angle", new("std_msgs/Float32", data=0.5), "/test")
    scene.network.subscribed_topics = frozenset({"/tf", "/wamv1/joint_states"})
    run(scene, 3.0)
    joints = scene.network.got["/wamv1/joint_states"][-1].message
    angle = dict(zip(joints.name, joints.position, strict=True))["wamv1/left_chasis_engine_joint"]
    assert angle == pytest.approx(0.5, abs=0.05)
    frames = {frame.child_frame_id: frame.transform for frame in scene.network.got["/tf"][-1].message.transforms}
    assert 2.0 * math.asin(frames["wamv1/left_engine_link"].rotation.z) == pytest.approx(angle, abs=1e-6)
    assert "wamv1/base_link" not in frames  # where the boat is stays untold unless --truth says so


def test_ground_truth_is_of_the_boats_own_frame_in_map():
    fleet = {"usv_count": 2, "layout": "line", "sensors": ["ground_truth"]}
    topics = {boat: f"/{boat}/sensors/position/p3d_wamv" for boat in ("wamv1", "wamv2")}
    scene = served(vrx_mj.compile_world("ocean", fleet=fleet), wanted=set(topics.values()))
    run(scene, 0.2)
    for boat, topic in topics.items():
        odometry = scene.network.got[topic][-1].message
        assert (odometry.header.frame_id, odometry.child_frame_id) == ("map", f"{boat}/base_link")
        assert odometry.pose.pose.position.y == pytest.approx(scene.sim.observe()[boat].position[1], abs=0.1)
    assert scene.told == []  # two boats whose readings are in `map` share no frame of theirs


def test_readings_are_in_the_frames_that_vrx_gives_them(bay):
    """vrx-robot's table of topics, for each boat of a fleet; the pinger's frame has the boat's name here."""
    frames = {
        "gps/gps/fix": "gps_wamv_link", "gps/gps/fix_velocity": "gps_wamv_link", "imu/imu/data": "imu_wamv_link",
        "pingers/pinger/range_bearing": "pinger", "pingers/pinger/marker/signal": "pinger",
    }  # fmt: skip
    topics = {
        f"/{boat}/sensors/{tail}": f"{boat}/{frame}" for boat in ("wamv1", "wamv2") for tail, frame in frames.items()
    }
    scene = served(bay, wanted=set(topics))
    run(scene, 1.1)
    found = {topic: scene.network.got[topic][-1].message.header.frame_id for topic in topics}
    assert found == topics


@pytest.mark.parametrize(("written", "published"), [(120, 120.0), (180, 180.0), (270, -90.0), (-90, -90.0)])
def test_the_direction_of_the_wind_is_from_minus_180_to_180_degrees_and_on_ros_2_to_360(written, published):
    world = vrx_mj.compile_world({"extends": "ocean", "wind": {"direction": written, "mean_velocity": 6.0}})
    for dialect, expected in (("vrx", published), ("vrx3", written % 360)):
        scene = served(world, wanted={"/vrx/debug/wind/direction"}, dialect=dialect)
        run(scene, 0.2)
        assert scene.network.got["/vrx/debug/wind/direction"][-1].message.data == pytest.approx(expected)


def test_the_wind_is_the_simulations_own():
    world = {"extends": "ocean", "wind": {"direction": 120, "mean_velocity": 6.0, "var_gain": 3.0, "seed": 3}}
    scene = served(vrx_mj.compile_world(world), wanted={"/vrx/debug/wind/speed", "/vrx/debug/wind/direction"})
    run(scene, 1.0)
    speed = scene.network.got["/vrx/debug/wind/speed"][-1]
    assert speed.message.data == pytest.approx(float(np.hypot(*scene.sim.wind.velocity(speed.time)[:2])), abs=1e-12)
    assert scene.network.got["/vrx/debug/wind/direction"][-1].message.data == pytest.approx(120.0)
