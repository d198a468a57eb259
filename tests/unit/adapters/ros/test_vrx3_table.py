import contextlib
import math
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="pip install 'vrx-mj[ros1]'")

import vrx_mj
from integration.sailing import CALM
from vrx_mj.adapters.ros import cdr
from vrx_mj.adapters.ros.inbox import Inbox
from vrx_mj.adapters.ros.messages import is_known, new, stamp
from vrx_mj.adapters.ros.offer import Input, Output, Service, Table
from vrx_mj.adapters.ros.station import Station
from vrx_mj.adapters.ros.table.bodies import header
from vrx_mj.adapters.ros.table.vrx3 import PACKAGES, RETOLD, make_vrx3_table
from vrx_mj.adapters.ros.table.vrx3_sensors import middle_ring
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.errors import CommandError
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.readings import Inertia, PointCloud, Reading, Sound

FLOAT64, TF = "std_msgs/Float64", "tf2_msgs/TFMessage"
CAMERAS = ("front_left_camera", "front_right_camera", "middle_right_camera")
OUTPUTS = {
    "/clock": "rosgraph_msgs/Clock",
    "/tf": TF,
    "/tf_static": TF,
    "/vrx/debug/wind/speed": "std_msgs/Float32",
    "/vrx/debug/wind/direction": "std_msgs/Float32",
    "/vrx/contacts": "ros_gz_interfaces/Contacts",
    "/wamv/joint_states": "sensor_msgs/JointState",
    "/wamv/pose": TF,
    "/wamv/pose_static": TF,
    "/wamv/robot_description": "std_msgs/String",
    "/wamv/sensors/gps/gps/fix": "sensor_msgs/NavSatFix",
    "/wamv/sensors/imu/imu/data": "sensor_msgs/Imu",
    "/wamv/sensors/lidars/lidar_wamv_sensor/points": "sensor_msgs/PointCloud2",
    "/wamv/sensors/lidars/lidar_wamv_sensor/scan": "sensor_msgs/LaserScan",
    "/wamv/sensors/acoustics/receiver/range_bearing": "ros_gz_interfaces/ParamVec",
}
for _camera in CAMERAS:
    for _part in ("", "/optical"):
        OUTPUTS[f"/wamv/sensors/cameras/{_camera}_sensor{_part}/image_raw"] = "sensor_msgs/Image"
        OUTPUTS[f"/wamv/sensors/cameras/{_camera}_sensor{_part}/camera_info"] = "sensor_msgs/CameraInfo"
INPUTS = {
    "/cmd_vel": "geometry_msgs/Twist",
    "/wamv/cmd_vel": "geometry_msgs/Twist",
    "/wamv/thrusters/left/thrust": FLOAT64,
    "/wamv/thrusters/right/thrust": FLOAT64,
    "/wamv/thrusters/left/pos": FLOAT64,
    "/wamv/thrusters/right/pos": FLOAT64,
    "/wamv/shooters/ball_shooter/fire": "std_msgs/Bool",
    "/pinger/set_pinger_position": "geometry_msgs/Vector3",
}
"""vrx-robot.md 4.11, with what is ours: cmd_vel and robot_description."""


class Fake:
    """A transport that keeps what it is given."""

    title, dialect = "ROS 2", "vrx3"

    def __init__(self, *wanted):
        self.wanted, self.sent, self.table = frozenset(wanted), [], None

    def offer(self, table):
        self.table = table

    def publish(self, batch):
        self.sent += batch


def station(sim, *transports):
    lines = []
    inbox = Inbox()
    commands, command = {}, sim.command_all

    def spied(given):
        commands.update(given.get("wamv", {}))
        command(given)

    sim.command_all = spied
    made = Station(sim, transports, inbox, tell=lambda level, text: lines.append(text))
    return SimpleNamespace(station=made, inbox=inbox, lines=lines, sim=sim, transport=transports[0], commands=commands)


def compiled(sensors, profile="vrx"):
    fleet = {"boats": [{"name": "wamv", "pose": [0, 0, -0.1, 0, 0, 0]}], "thrusters": "H", "sensors": sensors}
    return vrx_mj.compile_world({"physics": {"profile": profile}, "sea": CALM, "wind": {}}, fleet=fleet)


@pytest.fixture(scope="module")
def world():
    return compiled("vrx")


@pytest.fixture
def opened():
    """Stations that are closed in the end."""
    with contextlib.ExitStack() as stack:

        def make(*arguments):
            served = station(*arguments)
            stack.callback(served.station.close)
            return served

        yield make


@pytest.fixture
def served(world, opened):
    return opened(Simulation(world), Fake())


@pytest.fixture(scope="module")
def table(world):
    served = station(Simulation(world), Fake())
    served.station.close()
    return served.transport.table


def give(served, topic, data, sender="/client"):
    message = data if not isinstance(data, float | bool) else SimpleNamespace(data=data)
    served.inbox.message(topic, message, sender, "vrx3")
    served.station.receive()


def run(served, seconds):
    end = served.sim.time + seconds - 1e-6
    while served.sim.time < end:
        served.station.tick()
        served.station.receive()


def test_a_boat_has_vrx_3s_topics_and_types(table):
    assert {name: output.type for name, output in table.outputs.items()} == OUTPUTS
    assert {name: entry.type for name, entry in table.inputs.items()} == INPUTS
    assert not table.services


def test_every_type_is_one_of_ros_2s(table):
    for entry in (*table.outputs.values(), *table.inputs.values()):
        assert cdr.is_known(entry.type)
        assert entry.type.partition("/")[0] in PACKAGES
    for row in RETOLD:
        assert cdr.is_known(row.type)


def test_what_is_told_when_it_changes_can_be_compared(table):
    """Which is done by ROS 1's bytes."""
    assert all(is_known(output.type) for output in table.outputs.values() if output.rate == 0.0)


def test_every_message_without_a_reading_can_be_sent(table):
    plain = [output for output in table.outputs.values() if output.sensor is None or output.blind]
    assert len(plain) == 16
    for output in plain:
        cdr.encode((output.blind or output.make)(), output.type)


def test_names_of_both_dialects_are_offered_side_by_side(world, opened):
    two, one = Fake(), Fake()
    one.dialect = "vrx"
    opened(Simulation(world), one, two)
    assert "/wamv/thrusters/left_thrust_cmd" in one.table.inputs
    assert "/wamv/thrusters/left/thrust" in two.table.inputs
    assert one.table.inputs["/wamv/shooters/ball_shooter/fire"].type == "std_msgs/Empty"
    assert two.table.inputs["/wamv/shooters/ball_shooter/fire"].type == "std_msgs/Bool"


def test_a_transport_gets_what_it_wants_by_its_own_names(world, opened):
    imu, wind = "/wamv/sensors/imu/imu/data", "/vrx/debug/wind/speed"
    one, two = Fake("/wamv/sensors/gps/gps/fix_velocity", wind), Fake(imu, wind)
    one.dialect = "vrx"
    served = opened(Simulation(world), two, one)
    run(served, 0.5)
    assert {sent.output.name for sent in two.sent if not sent.output.latched} == {imu, wind}
    assert {sent.output.type for sent in two.sent if sent.output.name == wind} == {"std_msgs/Float32"}
    assert {sent.output.type for sent in one.sent if sent.output.name == wind} == {FLOAT64}
    assert sum(sent.output.name == imu for sent in two.sent) == 7  # 15 Hz
    for sent in two.sent:
        cdr.encode(sent.message, sent.output.type)


def test_thrust_is_in_newtons_by_the_thrusters_own_mapping(served):
    give(served, "/wamv/thrusters/left/thrust", 100.0)
    thruster = served.sim.observe()["wamv"].thrusters["left"]
    assert served.commands == {"left": thruster.command(100.0)}
    assert 0.5 < served.commands["left"] < 0.6  # VRX's table: 0.5 gives 80.6 N and 0.75 gives 181.9 N
    assert served.lines == []


def test_thrust_lasts_until_the_next_one(served):
    """VRX's own commands end after a second."""
    give(served, "/wamv/thrusters/left/thrust", 200.0)
    served.station.command("wamv", {"right": 0.9})
    run(served, 4.0)
    pushed = served.sim.observe()["wamv"]
    give(served, "/wamv/thrusters/left/thrust", 0.0)
    run(served, 4.0)
    slowed = served.sim.observe()["wamv"]
    assert pushed.angular_velocity[2] < -0.05  # only the port engine still pushes: to starboard
    assert abs(slowed.angular_velocity[2]) < 0.5 * abs(pushed.angular_velocity[2])


def test_a_command_by_vrxs_names_ends_it(served):
    give(served, "/wamv/thrusters/left/thrust", 200.0)
    served.station.command("wamv", {"left": 0.0})
    run(served, 2.0)
    assert served.commands["left"] == 0.0


def test_time_that_begins_again_ends_it(served, world):
    give(served, "/wamv/thrusters/left/thrust", 200.0)
    served.station.reset_simulation()
    run(served, 2.0)
    untouched = Simulation(world)
    untouched.advance(round(2.0 / untouched.timestep))
    assert served.sim.observe()["wamv"].position.tolist() == untouched.observe()["wamv"].position.tolist()


@pytest.mark.parametrize("newtons", [math.nan, math.inf, -math.inf])
def test_a_thrust_that_is_no_number_is_refused(served, newtons):
    give(served, "/wamv/thrusters/left/thrust", newtons)
    assert served.lines == [
        f"/wamv/thrusters/left/thrust from /client: the thrust left of wamv is {newtons} N: a finite number is needed"
    ]
    assert served.commands == {}


def test_a_thrust_beyond_the_engines_is_told_once(served):
    for _ in range(3):
        give(served, "/wamv/thrusters/left/thrust", 2000.0)
    assert served.lines == ["left of wamv is 2000 N, beyond -100 to 242.7 N: it gives the nearest of these"]


def test_in_profile_vrx3_the_thrust_goes_straight_to_the_engine(opened):
    served = opened(Simulation(compiled("none", "vrx3")), Fake())
    give(served, "/wamv/thrusters/left/thrust", 321.5)
    assert served.commands == {"left": 321.5}


def test_pos_turns_the_engine(served):
    give(served, "/wamv/thrusters/right/pos", 0.4)
    run(served, 3.0)
    assert served.sim.steering("wamv")["right"] == pytest.approx(0.4, abs=0.02)


def test_only_true_fires(served):
    shots = lambda: served.sim.sense("wamv")["ball_shooter"].data.shots_left  # noqa: E731
    give(served, "/wamv/shooters/ball_shooter/fire", False)
    run(served, 0.2)
    assert shots() == 4
    give(served, "/wamv/shooters/ball_shooter/fire", True)
    run(served, 0.2)
    assert shots() == 3


def test_the_pinger_is_placed_for_all(served):
    give(served, "/pinger/set_pinger_position", new("geometry_msgs/Vector3", x=1.0, y=2.0, z=-3.0))
    assert served.sim.pinger("wamv", "pinger") == pytest.approx((1.0, 2.0, -3.0))


def test_a_beacon_is_heard_as_parameters(table):
    output = table.outputs["/wamv/sensors/acoustics/receiver/range_bearing"]
    told = output.make(Reading("pinger", "pinger", 2.5, 2, "wamv/pinger", Sound(12.0, -0.5, 0.25)))
    assert (told.header.stamp.sec, told.header.stamp.nanosec, told.header.frame_id) == (2, 500_000_000, "wamv/pinger")
    assert {one.name: one.value.double_value for one in told.params} == {
        "range": 12.0,
        "bearing": -0.5,
        "elevation": 0.25,
    }
    assert {one.value.type for one in told.params} == {3}


def test_camera_topics_differ_in_the_frame(table):
    stem = "/wamv/sensors/cameras/front_left_camera_sensor"
    assert table.outputs[f"{stem}/camera_info"].blind().header.frame_id == "wamv/front_left_camera_link"
    assert table.outputs[f"{stem}/optical/camera_info"].blind().header.frame_id == "wamv/front_left_camera_link_optical"


def test_imu_has_the_same_content(table):
    data = Inertia(np.array([0.5, 0.5, 0.5, 0.5]), np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 9.8]))
    told = table.outputs["/wamv/sensors/imu/imu/data"].make(Reading("imu", "imu", 1.0, 1, "wamv/imu_wamv_link", data))
    back = cdr.decode(cdr.encode(told, "sensor_msgs/Imu"), "sensor_msgs/Imu")
    assert (back.angular_velocity.z, back.linear_acceleration.z, back.orientation.w) == (3.0, 9.8, 0.5)


def test_the_scan_is_the_ring_halfway_up():
    """Second implementation: each ray by itself."""
    config = LidarConfig(name="l", link="l", rings=4, samples=9, azimuth=(-math.pi, math.pi), range=(0.1, 50.0))
    ways = [-math.pi + 2 * math.pi / 8 * number for number in range(9)]
    rays = [(ring, way, 1.0 + ring + 0.1 * number) for number, way in enumerate(ways[:8]) for ring in range(4)]
    rays = [ray for ray in rays if ray[:2] != (2, ways[3])]  # no return
    points = np.array([(r * math.cos(way), r * math.sin(way), 0.0) for _, way, r in rays], np.float32)
    rings = np.array([ring for ring, _, _ in rays], np.uint16)
    scan = middle_ring(PointCloud(points, np.zeros(len(rays), np.float32), rings), config)
    expected = [3.0 + 0.1 * number for number in range(8)]
    expected[3] = math.inf
    assert scan.ranges[:8].tolist() == pytest.approx(expected)
    assert (scan.angle_min, scan.angle_max, scan.angle_increment) == pytest.approx((-math.pi, math.pi, math.pi / 4))


# Tasks, by messages that stand for theirs

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
        boats=(), time=42.5, world=SimpleNamespace(parameters={"task": {"animals": [{}, {}]}}), placards=(), lights=()
    )
    old = Table(
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
    with pytest.raises(CommandError, match=r"^no sequence of colours is taken now: one, while the task runs$"):
        take(SimpleNamespace(data=["red", "green", "blue"]))
    with pytest.raises(CommandError, match=r"^2 colours: 3 make a sequence, as \['red', 'green', 'blue'\]$"):
        take(SimpleNamespace(data=["red", "green"]))
