"""The table of topics and services, held against the list of VRX's tutorial, and what its functions do."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import vrx_mj

pytest.importorskip("rosbags")

from vrx_mj.adapters.ros.inbox import Inbox
from vrx_mj.adapters.ros.messages import encode, is_known, new
from vrx_mj.adapters.ros.offer import Traffic
from vrx_mj.adapters.ros.station import Station

TUTORIAL = json.loads((Path(__file__).parents[3] / "golden" / "ros" / "tutorial.json").read_text("utf-8"))

SENSORS = ["gps", "imu", "pinger"]
ERRORS = ("pose_error", "mean_pose_error")
STATIONS = []


@pytest.fixture(autouse=True)
def _closed():
    """Close what a test served."""
    yield
    while STATIONS:
        STATIONS.pop().close()


class Fake:
    """A network that wants what it is told to want, and keeps what it gets."""

    title = "fake"

    def __init__(self, wanted=()):
        self.wanted, self.got, self.lines = frozenset(wanted), {}, []

    def start(self):
        return []

    def offer(self, table):
        self.table = table

    def publish(self, batch):
        for sent in batch:
            encode(sent.message, sent.output.type)  # is of its type
            self.got.setdefault(sent.output.name, []).append(sent)

    def log(self, level, text):
        self.lines.append((level, text))

    @property
    def traffic(self):
        return Traffic(0, 0, 0)

    def close(self):
        pass


def served(world, *, wanted=(), **options):
    """A station, its network, its inbox, and what it told."""
    sim = world if isinstance(world, vrx_mj.Simulation) else vrx_mj.Simulation(world)
    network, inbox, told = Fake(wanted), Inbox(), []
    station = Station(sim, [network], inbox, tell=lambda _level, text: told.append(text), **options)
    STATIONS.append(station)
    return SimpleNamespace(sim=sim, station=station, network=network, inbox=inbox, told=told)


def run(scene, seconds):
    """Advance, taking what came."""
    for _ in range(round(seconds * 100)):
        scene.station.receive()
        scene.station.tick()


def call(scene, name, kind, **fields):
    """Call a service; its response, or the reason why there is none."""
    answers = []
    scene.inbox.call(name, new(f"{kind}Request", **fields), "/test", lambda *answer: answers.append(answer))
    scene.station.receive()
    ((response, why),) = answers
    return response if response is not None else why


@pytest.fixture(scope="module")
def course():
    return vrx_mj.compile_world("example_course")


@pytest.fixture(scope="module")
def bay():
    """Two boats on open water, with a GPS, an IMU, ground truth and nothing that draws."""
    return vrx_mj.compile_world(
        {"extends": "sydney_regatta"},
        fleet={
            "usv_count": 2,
            "layout": "line",
            "spacing": 12.0,
            "origin": "spawn",
            "sensors": ["gps", "imu", "pinger"],
        },
    )


@pytest.fixture
def scene(bay):
    return served(bay)


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
        ("gymkhana", ["gymkhana_channel/task/info", "gymkhana_blackbox/goal", "gymkhana_blackbox/mean_pose_error"]),
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
    scene.network.wanted = frozenset({"/clock", "/wamv1/sensors/imu/imu/data", "/wamv1/joint_states"})
    run(scene, 2.0)
    rates = {name: len(sent) / 2.0 for name, sent in scene.network.got.items() if name in scene.network.wanted}
    assert rates == {"/clock": 100.0, "/wamv1/sensors/imu/imu/data": 15.0, "/wamv1/joint_states": 100.0}
    latched = {name for name, output in scene.network.table.outputs.items() if output.latched}
    assert scene.network.got.keys() - scene.network.wanted <= latched
    assert scene.network.got["/tf_static"][0].message.transforms


def test_a_reading_is_the_sensors_own(scene):
    scene.network.wanted = frozenset({"/wamv1/sensors/imu/imu/data", "/wamv1/sensors/gps/gps/fix"})
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
    scene.network.wanted = frozenset(scene.network.table.outputs)
    scene.station.tick()
    assert order[-1] == "/clock"


def test_model_states_tell_where_boats_are_and_how_they_move_in_the_world(scene):
    scene.sim.set_boat("wamv1", velocity=(2.0, 0.0, 0.0, 0.0, 0.0, 0.3))
    scene.network.wanted = frozenset({"/gazebo/model_states", "/gazebo/link_states"})
    scene.station.tick()
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
    scene.network.wanted = frozenset({"/tf", "/wamv1/joint_states"})
    run(scene, 3.0)
    joints = scene.network.got["/wamv1/joint_states"][-1].message
    angle = dict(zip(joints.name, joints.position, strict=True))["wamv1/left_chasis_engine_joint"]
    assert angle == pytest.approx(0.5, abs=0.05)
    frames = {frame.child_frame_id: frame.transform for frame in scene.network.got["/tf"][-1].message.transforms}
    assert 2.0 * math.asin(frames["wamv1/left_engine_link"].rotation.z) == pytest.approx(angle, abs=1e-6)
    assert "wamv1/base_link" not in frames  # where the boat is stays untold unless --truth says so


def test_the_wind_is_the_simulations_own():
    world = {"extends": "ocean", "wind": {"direction": 120, "mean_velocity": 6.0, "var_gain": 3.0, "seed": 3}}
    scene = served(vrx_mj.compile_world(world), wanted={"/vrx/debug/wind/speed", "/vrx/debug/wind/direction"})
    run(scene, 1.0)
    speed = scene.network.got["/vrx/debug/wind/speed"][-1]
    assert speed.message.data == pytest.approx(float(np.hypot(*scene.sim.wind.velocity(speed.time)[:2])), abs=1e-12)
    assert scene.network.got["/vrx/debug/wind/direction"][-1].message.data == pytest.approx(120.0)


# What comes in


def test_a_command_moves_its_boat_and_only_that_for_a_second(scene):
    before = scene.sim.observe()
    scene.inbox.message("/wamv2/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=1.0), "/test")
    scene.inbox.message("/wamv2/thrusters/right_thrust_cmd", new("std_msgs/Float32", data=1.0), "/test")
    run(scene, 1.5)
    after = scene.sim.observe()
    moved = [math.dist(before[boat].position[:2], after[boat].position[:2]) for boat in scene.sim.boats]
    assert moved[1] > 5.0 * moved[0] > 0.0
    assert scene.sim._rig.thruster_state["thrust"][-1] < 1.0  # the timeout has passed


def test_cmd_vel_is_vrxs_twist_to_thrust(scene):
    scene.inbox.message("/wamv1/cmd_vel", new("geometry_msgs/Twist", linear={"x": 0.5}, angular={"z": 1.0}), "/test")
    scene.station.receive()
    rows = scene.sim._helm.thrusters["wamv1"]
    commands = scene.sim._rig.thruster_state["command"]
    assert [commands[rows[name]] for name in ("left", "right", "lateral")] == [-0.5, 1.5, 0.0]


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
    scene.station.receive()
    assert scene.told[-1] == "formation: line, 15 m apart, led by wamv1"
    scene.inbox.message("/swarm/formation", new("std_msgs/String", data="off"), "/test")
    scene.station.receive()
    assert scene.told[-1] == "formation: off"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wegde", "no formation named 'wegde'; did you mean 'wedge'?"),
        ("wedge 12", "formation 'wedge 12': '12' is no name=value, as in wedge spacing=12"),
        ("wedge spacing=wide", "formation: spacing is 'wide': a finite number is needed"),
        (
            "wedge gap=3",
            "no parameter of a formation named 'gap'; known: shape, spacing, leader, path, speed, radius, apart",
        ),
        ('{"shape": "wedge", "path": [[0]]}', "formation: path is [[0]]: pairs of numbers, as [[0, 0], [50, 20]]"),
        ('{"shape": "wedge", "leader": "boat"}', "no boat named 'boat'; known: wamv1, wamv2"),
        ("wedge spacing=2", "spacing 2 m: must be above 7 m, which boats keep apart"),
    ],
)
def test_a_wrong_formation_is_told(scene, text, message):
    scene.inbox.message("/swarm/formation", new("std_msgs/String", data=text), "/pilot")
    scene.station.receive()
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


SDF = (
    "'buoy' is SDF: only boats described by a URDF can join a running world (spawn_urdf_model); buoys, docks and other "
    "objects belong into the world's file"
)
ITS_OWN = "give both the same, or leave the namespace empty"
NAMESPACE = f"model 'x' in the namespace 'y': here a boat's name is its namespace; {ITS_OWN}"
NOWHERE = {"model_name": "wamv1", "pose": {"position": {"x": math.nan}}}
NOT_FINITE = "pose.position is [nan, 0.0, 0.0]: finite numbers are needed"
NO_URDF = "x: what came is no URDF, which has a <robot> element"


@pytest.mark.parametrize(
    ("name", "kind", "fields", "message"),
    [
        ("delete_model", "DeleteModel", {"model_name": "wamv9"}, "no boat named 'wamv9'; did you mean 'wamv2'?"),
        ("get_model_state", "GetModelState", {"model_name": "wamv"}, "no model named 'wamv'; did you mean 'wamv2'?"),
        ("spawn_sdf_model", "SpawnModel", {"model_name": "buoy"}, SDF),
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
    assert scene.station.paused
    stepped = call(scene, "/vrx_mj/step", "vrx_mj_msgs/Step", duration=0.5)
    assert (stepped.success, stepped.sim_time) == (True, pytest.approx(0.5))
    call(scene, "/gazebo/unpause_physics", "std_srvs/Empty")
    assert not scene.station.paused
    why = call(scene, "/vrx_mj/step", "vrx_mj_msgs/Step", duration=-1.0)
    assert why == "a step of -1 s: at least 0, and below 3600"


# What is odd


@pytest.mark.parametrize(
    ("topic", "hint"),
    [
        ("/wamv/thrusters/left_thrust_cmd", "did you mean /wamv1/thrusters/left_thrust_cmd?"),
        ("/wamv2/thrusters/lft_thrust_cmd", "did you mean /wamv2/thrusters/left_thrust_cmd?"),
        ("/x/y/cmd_vel", "did you mean /wamv1/cmd_vel?"),
    ],
)
def test_who_publishes_where_no_boat_listens_is_told_what_was_meant(scene, topic, hint):
    scene.inbox.stranger(topic, "std_msgs/Float32", "/rostopic_1")
    scene.inbox.stranger("/rosbag/other", "std_msgs/Float32", "/rostopic_1")
    scene.station.receive()
    assert scene.told[-1] == f"{topic} has a publisher, /rostopic_1, but no boat: {hint}"


def test_a_command_that_comes_too_rarely_is_told(scene):
    for _ in range(5):
        scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=0.5), "/rostopic_1")
        run(scene, 2.0)
    slow = (
        "/wamv1/thrusters/left_thrust_cmd comes every 2 s and a thrust lasts 1 s: thrust is on 50 % of the time; use "
    )
    assert scene.told == [f"{slow}-r 2 or more"]


def test_commands_beyond_what_engines_do_are_told_once(scene):
    for _ in range(3):
        scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=5.0), "/test")
        scene.inbox.message("/wamv1/thrusters/left_thrust_angle", new("std_msgs/Float32", data=3.0), "/test")
        run(scene, 0.1)
    assert sorted(scene.told) == [
        "left of wamv1 is 5, beyond -1 to 1: the force ends at 250 N ahead, 100 N astern",
        "left_angle of wamv1 is 3 rad: the engine turns to 1.571 rad at most",
    ]


def test_a_boat_that_has_capsized_is_told_once_until_it_is_upright_again(scene):
    scene.sim.set_boat("wamv1", pose=(-520, 190, 0.5, math.pi, 0, 0))
    run(scene, 1.1)
    assert scene.told[0].endswith("wamv1 has capsized; /gazebo/set_model_state rights it")
    assert len([line for line in scene.told if "capsized" in line]) == 1


def test_a_held_boat_says_until_when(course):
    scene = served(vrx_mj.compile_world("stationkeeping_task"))
    scene.inbox.message("/wamv/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=0.5), "/test")
    scene.station.receive()
    assert scene.told == ["wamv is held by its task until t = 10 s: thrust moves it afterwards"]
