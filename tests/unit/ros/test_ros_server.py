"""What networks ask of a served simulation: commands and services."""

import math
import xml.etree.ElementTree as ET

import pytest

import vrx_mj
from ros_scene import call, run, served
from vrx_mj.ros.messages import new

# What comes in


def test_a_command_moves_its_boat_and_only_that_for_a_second(scene):
    before = scene.sim.observe()
    scene.inbox.message("/wamv2/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=1.0), "/test")
    scene.inbox.message("/wamv2/thrusters/right_thrust_cmd", new("std_msgs/Float32", data=1.0), "/test")
    run(scene, 1.5)
    after = scene.sim.observe()
    moved = [math.dist(before[boat].position[:2], after[boat].position[:2]) for boat in scene.sim.boats]
    assert moved[1] > 5.0 * moved[0] > 0.0
    assert scene.sim._live.arrays.thruster_state["thrust"][-1] < 1.0  # the timeout has passed


def test_cmd_vel_is_vrxs_twist_to_thrust(scene):
    scene.inbox.message("/wamv1/cmd_vel", new("geometry_msgs/Twist", linear={"x": 0.5}, angular={"z": 1.0}), "/test")
    scene.server.receive()
    rows = scene.sim._live.commands.thrusters["wamv1"]
    commands = scene.sim._live.arrays.thruster_state["command"]
    assert [commands[rows[name]] for name in ("left", "right", "lateral")] == [-0.5, 1.5, 0.0]


def test_cmd_drive_of_2018_is_the_thrust_of_both_sides(course):
    scene = served(course)
    for topic, left, right in (("/cmd_drive", 0.25, -0.5), ("/wamv/cmd_drive", 1.0, 0.75)):
        scene.inbox.message(topic, new("usv_gazebo_plugins/UsvDrive", left=left, right=right), "/test")
        scene.server.receive()
        rows = scene.sim._live.commands.thrusters["wamv"]
        commands = scene.sim._live.arrays.thruster_state["command"]
        assert [commands[rows[name]] for name in ("left", "right", "lateral")] == [left, right, 0.0]
    scene.inbox.message("/cmd_drive", new("usv_gazebo_plugins/UsvDrive", left=float("nan")), "/test")
    scene.server.receive()
    assert scene.told[-1].startswith("/cmd_drive from /test: ")
    assert commands[rows["left"]] == 1.0


def twist(scene, boat, speed):
    message = new("geometry_msgs/Twist", linear={"x": speed}, angular={"z": 0.0})
    scene.inbox.message(f"/{boat}/cmd_vel", message, "/guidance")


@pytest.mark.parametrize("cmd_vel", ["thrust", "velocity"])
@pytest.mark.parametrize("topic", ["left_thrust_cmd", "right_thrust_angle"])
def test_cmd_vel_leaves_a_boat_alone_that_somebody_commands_by_thrusts(bay, topic, cmd_vel):
    alone, mixed = served(bay, cmd_vel=cmd_vel), served(bay, cmd_vel=cmd_vel)
    mixed.network.published[f"/wamv1/thrusters/{topic}"] = ["/mixer", "/other"]
    for scene in (alone, mixed):
        for _ in range(3):
            for boat in ("wamv2", "wamv1") if scene is mixed else ("wamv2",):
                twist(scene, boat, 1.0)
            run(scene, 0.5)
    assert mixed.told == [f"/wamv1/cmd_vel does not drive wamv1: /mixer publishes /wamv1/thrusters/{topic}"]
    assert mixed.sim.data.qpos.tobytes() == alone.sim.data.qpos.tobytes()


def test_cmd_vel_that_is_off_is_no_topic(bay):
    scene = served(bay, cmd_vel="off")
    assert not [name for name in scene.network.table.inputs if name.endswith("cmd_vel")]
    scene.inbox.unknown_publisher("/wamv1/cmd_vel", "geometry_msgs/Twist", "/guidance")
    scene.server.receive()
    off = "cmd_vel is off; enable it with --cmd-vel thrust or velocity"
    assert scene.told == [f"/wamv1/cmd_vel has a publisher, /guidance, but no subscriber: {off}"]


def test_cmd_vel_as_a_velocity_is_kept(bay):
    scene = served(bay, cmd_vel="velocity")
    for _ in range(80):
        scene.inbox.message(
            "/wamv1/cmd_vel", new("geometry_msgs/Twist", linear={"x": 1.2}, angular={"z": 0.1}), "/test"
        )
        run(scene, 0.2)
    seen = scene.sim.observe()["wamv1"]
    assert seen.velocity[0] == pytest.approx(1.2, abs=0.15)
    assert seen.angular_velocity[2] == pytest.approx(0.1, abs=0.05)


def test_a_formation_is_kept_and_told(scene):
    scene.inbox.message("/swarm/formation", new("std_msgs/String", data='{"shape": "line", "spacing": 15}'), "/test")
    scene.server.receive()
    assert scene.told[-1] == "formation: line, 15 m apart, led by wamv1"
    scene.inbox.message("/swarm/formation", new("std_msgs/String", data="off"), "/test")
    scene.server.receive()
    assert scene.told[-1] == "formation: off"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "wegde",
            (
                "formation: shape: expected circle, line, column, wedge, grid or random, got 'wegde'; "
                "did you mean 'wedge'?"
            ),
        ),
        ("wedge 12", "formation 'wedge 12': '12' is not name=value, as in wedge spacing=12"),
        ("wedge spacing=wide", "formation: spacing: expected a number, got 'wide'"),
        (
            "wedge gap=3",
            "no parameter of a formation named 'gap'; known: shape, spacing, leader, path, speed, radius, apart",
        ),
        (
            '{"shape": "wedge", "path": [[0]]}',
            "formation: path[0]: expected 2 numbers [x, y], got [0]",
        ),
        ('{"shape": "wedge", "leader": "boat"}', "no boat named 'boat'; known: wamv1, wamv2"),
        ("wedge spacing=2", "invalid spacing 2 m: more than the 7 m that boats keep apart is needed"),
    ],
)
def test_a_wrong_formation_is_told(scene, text, message):
    scene.inbox.message("/swarm/formation", new("std_msgs/String", data=text), "/pilot")
    scene.server.receive()
    assert scene.told[-1] == f"/swarm/formation from /pilot: {message}"


# Services


def test_reset_world_puts_all_back_while_time_goes_on(scene):
    start = scene.sim.observe()
    scene.sim.set_boat("wamv2", pose=(-500, 230, 0.1, 0, 0, 2.0))
    run(scene, 1.0)
    call(scene, "/gazebo/reset_world", "std_srvs/Empty")
    seen = scene.sim.observe()
    for boat in scene.sim.boats:
        assert tuple(seen[boat].position) == pytest.approx(tuple(start[boat].position), abs=1e-9)
        assert tuple(seen[boat].velocity) == (0.0, 0.0, 0.0)
    assert scene.sim.time == pytest.approx(1.0)


def test_a_boat_joins_with_its_topics_and_leaves_with_them(scene):
    before = {*scene.network.table.outputs, *scene.network.table.inputs}
    urdf = scene.network.table.parameters["/wamv1/robot_description"]
    place = {"position": {"x": -500.0, "y": 220.0, "z": 0.1}}
    told = call(
        scene, "/gazebo/spawn_urdf_model", "gazebo_msgs/SpawnModel",
        model_name="wamv7", model_xml=urdf, robot_namespace="/wamv7", initial_pose=place,
    )  # fmt: skip
    assert (told.success, told.status_message) == (True, "wamv7 joins; its topics begin with /wamv7/")
    gained = {*scene.network.table.outputs, *scene.network.table.inputs} - before
    assert "/wamv7/thrusters/left_thrust_cmd" in gained
    assert all(name.startswith("/wamv7/") for name in gained)
    call(scene, "/gazebo/reset_simulation", "std_srvs/Empty")
    assert scene.sim.boats == ("wamv1", "wamv2", "wamv7")
    assert call(scene, "/gazebo/delete_model", "gazebo_msgs/DeleteModel", model_name="wamv7").success
    assert {*scene.network.table.outputs, *scene.network.table.inputs} == before


def names_of(scene, boat):
    """All names of a boat's links, joints and frames that programs get."""
    robot = ET.fromstring(scene.network.table.parameters[f"/{boat}/robot_description"])
    yield from (element.get("name") for tag in ("link", "joint") for element in robot.findall(tag))
    outputs = scene.network.table.outputs
    yield from outputs[f"/{boat}/joint_states"].make().name
    for topic in ("/tf", "/tf_static"):
        frames = outputs[topic].make().transforms
        yield from (frame.child_frame_id for frame in frames if frame.header.frame_id.startswith(f"{boat}/"))


def test_one_urdf_under_several_names_has_the_names_of_each(scene):
    urdf = scene.network.table.parameters["/wamv1/robot_description"]
    for number, name in enumerate(("guest", "wamv7")):
        place = {"position": {"x": -500.0, "y": 220.0 + 20.0 * number, "z": 0.1}}
        call(scene, "/gazebo/spawn_urdf_model", "gazebo_msgs/SpawnModel",
             model_name=name, model_xml=urdf, initial_pose=place)  # fmt: skip
    for boat in ("wamv1", "guest", "wamv7"):
        found = list(names_of(scene, boat))
        assert len(found) > 30
        assert [one for one in found if not one.startswith(f"{boat}/")] == []


def test_a_fleet_of_one_urdf_has_the_names_of_each_boat(scene, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.urdf").write_text(scene.network.table.parameters["/wamv1/robot_description"], encoding="utf-8")
    boats = [{"name": name, "pose": [0, 20 * i, 0.1, 0, 0, 0]} for i, name in enumerate(("a", "b"))]
    fleet = served(vrx_mj.compile_world("ocean", fleet={"robot": "mine.urdf", "boats": boats}))
    for boat in ("a", "b"):
        assert [one for one in names_of(fleet, boat) if not one.startswith(f"{boat}/")] == []


ITS_OWN = "make both the same, or leave the namespace empty"
NAMESPACE = f"model 'x' in the namespace 'y': a boat's name is its namespace; {ITS_OWN}"
NOWHERE = {"model_name": "wamv1", "pose": {"position": {"x": math.nan}}}
NOT_FINITE = "invalid pose.position [nan, 0.0, 0.0]: finite numbers are needed"
NOBODY = "no boat, object or dock named 'wamv9'; did you mean 'wamv2'?"
NO_URDF = "x: invalid URDF: a <robot> element is needed"


@pytest.mark.parametrize(
    ("name", "kind", "fields", "message"),
    [
        (
            "delete_model",
            "DeleteModel",
            {"model_name": "wamv9"},
            "no boat, object or dock named 'wamv9'; did you mean 'wamv2'?",
        ),
        ("get_model_state", "GetModelState", {"model_name": "wamv"}, "no model named 'wamv'; did you mean 'wamv2'?"),
        ("spawn_urdf_model", "SpawnModel", {"model_name": "x", "model_xml": "hello"}, NO_URDF),
        ("spawn_urdf_model", "SpawnModel", {"model_name": "x", "robot_namespace": "y"}, NAMESPACE),
        ("set_model_state", "SetModelState", {"model_state": NOWHERE}, NOT_FINITE),
    ],
)
def test_a_service_says_why_not(scene, name, kind, fields, message):
    told = call(scene, f"/gazebo/{name}", f"gazebo_msgs/{kind}", **fields)
    assert (told.success, told.status_message) == (False, f"{name}: {message}")


def test_a_state_that_is_set_is_got_and_without_a_twist_the_boat_stops(scene):
    scene.sim.set_boat("wamv1", velocity=(2.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    half = 0.5 * 1.2
    pose = {
        "position": {"x": -520.0, "y": 190.0, "z": 0.0},
        "orientation": {"w": 2.0 * math.cos(half), "z": 2.0 * math.sin(half)},
    }
    assert call(
        scene, "/gazebo/set_model_state", "gazebo_msgs/SetModelState", model_state={"model_name": "wamv1", "pose": pose}
    ).success
    got = call(scene, "/gazebo/get_model_state", "gazebo_msgs/GetModelState", model_name="wamv1")
    assert (got.pose.position.x, got.pose.position.y, got.twist.linear.x) == pytest.approx((-520.0, 190.0, 0.0))
    assert got.pose.orientation.z == pytest.approx(math.sin(half))
    other = call(
        scene, "/gazebo/get_model_state", "gazebo_msgs/GetModelState", model_name="wamv1", relative_entity_name="wamv1"
    )
    assert (other.pose.position.x, other.pose.orientation.w) == pytest.approx((0.0, 1.0))


def test_a_pause_stops_nothing_but_time(scene):
    call(scene, "/gazebo/pause_physics", "std_srvs/Empty")
    assert scene.server.paused
    stepped = call(scene, "/vrx_mj/step", "vrx_mj_msgs/Step", duration=0.5)
    assert (stepped.success, stepped.sim_time) == (True, pytest.approx(0.5))
    call(scene, "/gazebo/unpause_physics", "std_srvs/Empty")
    assert not scene.server.paused
    why = call(scene, "/vrx_mj/step", "vrx_mj_msgs/Step", duration=-1.0)
    assert why == "invalid step -1 s: at least 0 and below 3600 s is needed"


BALL = (
    '<sdf version="1.6"><model name="ball"><link name="l"><inertial><mass>50</mass></inertial><collision name="c">'
    "<geometry><sphere><radius>1e9</radius></sphere></geometry></collision></link></model></sdf>"
)


def test_what_is_spawned_is_held_to_what_files_are(scene):
    response = call(scene, "/gazebo/spawn_sdf_model", "gazebo_msgs/SpawnModel", model_name="ball", model_xml=BALL)
    why = "invalid ball: [0].volume: must be at most 1000000000000, got 4.188790204786391e+27"
    assert (response.success, response.status_message) == (False, f"spawn_sdf_model: {why}")
    assert scene.told[-1] == f"/gazebo/spawn_sdf_model, called by /test: {why}"
    run(scene, 0.1)


def test_a_loop_of_calls_that_fail_is_told_once(scene):
    before = len(scene.told)
    for name in ("gone", "gone", "other", "gone"):
        assert not call(scene, "/gazebo/get_model_state", "gazebo_msgs/GetModelState", model_name=name).success
    assert [line.partition(";")[0] for line in scene.told[before:]] == [
        f"/gazebo/get_model_state, called by /test: no model named '{name}'" for name in ("gone", "other")
    ]


@pytest.mark.parametrize("error", [RecursionError("too\ndeep"), KeyError("x"), MemoryError(), ValueError("a" * 900)])
def test_whatever_a_service_or_a_topic_raises_ends_no_run(scene, monkeypatch, error):
    def fail(*_words, **_more):
        raise error

    monkeypatch.setattr(scene.sim, "spawn_object", fail)
    monkeypatch.setattr(scene.sim, "command_all", fail)
    monkeypatch.setattr(scene.server, "reset_world", fail)
    scene.server._offer()
    response = call(scene, "/gazebo/spawn_sdf_model", "gazebo_msgs/SpawnModel", model_name="a", model_xml=BALL)
    assert not response.success
    assert response.status_message.startswith(f"spawn_sdf_model: {type(error).__name__}: ")
    assert call(scene, "/gazebo/reset_world", "std_srvs/Empty").startswith(f"{type(error).__name__}: ")
    told = len(scene.told)
    scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=1.0), "/test")
    scene.server.receive()
    (line,) = scene.told[told:]
    assert line.startswith(f"/wamv1/thrusters/left_thrust_cmd from /test: {type(error).__name__}: ")
    assert all(len(line) < 300 and line.isprintable() for line in scene.told)
    assert scene.server.tick() > 0
