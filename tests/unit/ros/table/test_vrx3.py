import contextlib
import math
import random
from types import SimpleNamespace

import numpy as np
import pytest

import vrx_mj
from integration.sailing import CALM
from integration.sensing import SYDNEY
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.errors import CommandError
from vrx_mj.ros import cdr
from vrx_mj.ros.interface import CONVERSIONS, PACKAGES, Inbox
from vrx_mj.ros.messages import is_known, new
from vrx_mj.ros.ros_server import RosServer
from vrx_mj.ros.table.sensing import TOPICS, middle_ring
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
    "/vrx_mj/markers": "visualization_msgs/MarkerArray",
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
        self.subscribed_topics, self.sent, self.table = frozenset(wanted), [], None

    def offer(self, table):
        self.table = table

    def publish(self, batch):
        self.sent += batch


class Vrx(Fake):
    """The same on ROS 1."""

    dialect = "vrx"


def server(sim, *transports):
    lines = []
    inbox = Inbox()
    commands, command = {}, sim.command_all

    def spied(given):
        commands.update(given.get("wamv", {}))
        command(given)

    sim.command_all = spied
    made = RosServer(sim, transports, inbox, report=lambda level, text: lines.append(text))
    return SimpleNamespace(server=made, inbox=inbox, lines=lines, sim=sim, transport=transports[0], commands=commands)


def compiled(sensors, profile="vrx"):
    fleet = {"boats": [{"name": "wamv", "pose": [0, 0, -0.1, 0, 0, 0]}], "thrusters": "H", "sensors": sensors}
    world = {"physics": {"profile": profile}, "sea": CALM, "wind": {}, "georeference": SYDNEY}
    return vrx_mj.compile_world(world, fleet=fleet)


@pytest.fixture(scope="module")
def world():
    return compiled("vrx")


@pytest.fixture
def opened():
    """Stations that are closed in the end."""
    with contextlib.ExitStack() as stack:

        def make(*arguments):
            served = server(*arguments)
            stack.callback(served.server.close)
            return served

        yield make


@pytest.fixture
def served(world, opened):
    return opened(Simulation(world), Fake())


@pytest.fixture(scope="module")
def table(world):
    served = server(Simulation(world), Fake())
    served.server.close()
    return served.transport.table


def give(served, topic, data, sender="/client"):
    message = data if not isinstance(data, float | bool) else SimpleNamespace(data=data)
    served.inbox.message(topic, message, sender, "vrx3")
    served.server.receive()


def run(served, seconds):
    end = served.sim.time + seconds - 1e-6
    while served.sim.time < end:
        served.server.tick()
        served.server.receive()


def test_a_boat_has_vrx_3s_topics_and_types(table):
    assert {name: output.type for name, output in table.outputs.items()} == OUTPUTS
    assert {name: entry.type for name, entry in table.inputs.items()} == INPUTS
    assert {name: one.type.rpartition("/")[2] for name, one in table.services.items()} == {
        "/world/world/create": "SpawnEntity",
        "/world/world/remove": "DeleteEntity",
        "/world/world/set_pose": "SetEntityPose",
    }


def test_every_type_is_one_of_ros_2s(table):
    for entry in (*table.outputs.values(), *table.inputs.values()):
        assert is_known(entry.type, cdr.typestore)
        assert entry.type.partition("/")[0] in PACKAGES
    assert all(is_known(type_name, cdr.typestore) for type_name, _ in CONVERSIONS.values())
    vrx3_topics = [topic for topics in TOPICS.values() for topic in topics.made if topic.vrx3]
    assert all(is_known(topic.type, cdr.typestore) or topic.type in CONVERSIONS for topic in vrx3_topics)


def test_what_is_told_when_it_changes_can_be_compared(table):
    """Which is done by ROS 1's bytes."""
    assert all(is_known(output.type) for output in table.outputs.values() if output.rate == 0.0)


def test_every_message_without_a_reading_can_be_sent(table):
    plain = [output for output in table.outputs.values() if output.sensor is None or output.blind]
    assert len(plain) > 10
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
    served.server.command("wamv", {"right": 0.9})
    run(served, 4.0)
    pushed = served.sim.observe()["wamv"]
    give(served, "/wamv/thrusters/left/thrust", 0.0)
    run(served, 4.0)
    slowed = served.sim.observe()["wamv"]
    assert pushed.angular_velocity[2] < -0.05  # only the port engine still pushes: to starboard
    assert abs(slowed.angular_velocity[2]) < 0.5 * abs(pushed.angular_velocity[2])


def test_a_command_by_vrxs_names_ends_it(served):
    give(served, "/wamv/thrusters/left/thrust", 200.0)
    served.server.command("wamv", {"left": 0.0})
    run(served, 2.0)
    assert served.commands["left"] == 0.0


def test_time_that_begins_again_ends_it(served, world):
    give(served, "/wamv/thrusters/left/thrust", 200.0)
    served.server.reset_simulation()
    run(served, 2.0)
    untouched = Simulation(world)
    untouched.advance(round(2.0 / untouched.timestep))
    assert served.sim.observe()["wamv"].position.tolist() == untouched.observe()["wamv"].position.tolist()


@pytest.mark.parametrize("newtons", [math.nan, math.inf, -math.inf])
def test_a_thrust_that_is_no_number_is_refused(served, newtons):
    give(served, "/wamv/thrusters/left/thrust", newtons)
    assert served.lines == [
        (
            f"/wamv/thrusters/left/thrust from /client: invalid thrust {newtons} N for left of wamv: "
            "a finite number is needed"
        )
    ]
    assert served.commands == {}


def test_a_thrust_beyond_the_engines_is_told_once(served):
    for _ in range(3):
        give(served, "/wamv/thrusters/left/thrust", 2000.0)
    assert served.lines == ["left of wamv is 2000 N, outside -100 to 242.7 N: it is clamped to this range"]


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


def test_every_frame_has_vrx3s_name_too(table):
    """VRX 3's launch file puts `wamv/` before `wamv/base_link`: its programs ask for `wamv/wamv/base_link`."""
    frames = {topic: table.outputs[topic].make().transforms for topic in ("/tf", "/tf_static")}
    parents = {one.child_frame_id: one for moving_or_not in frames.values() for one in moving_or_not}
    plain = {name for name in parents if name.startswith("wamv/") and not name.startswith("wamv/wamv/")}
    assert {"wamv/gps_wamv_link", "wamv/left_engine_link", "wamv/left_propeller_link"} <= plain
    for name in plain | {"wamv/base_link"}:
        prefixed = parents[f"wamv/{name}"]
        assert prefixed.header.frame_id == name
        assert prefixed.transform == new("geometry_msgs/Transform", rotation={"w": 1.0})
    assert not any(name.startswith("wamv/wamv/wamv/") for name in parents)


def test_ros1_has_no_names_of_vrx3(world):
    with contextlib.closing(server(Simulation(world), Vrx()).server) as one:
        still = one.table.outputs["/tf_static"].make().transforms
    assert not [frame for frame in still if frame.child_frame_id.startswith("wamv/wamv/")]


BALL = (
    '<sdf version="1.6"><model name="ball"><link name="l"><inertial><mass>50</mass></inertial><collision name="c">'
    "<geometry><sphere><radius>0.5</radius></sphere></geometry></collision></link></model></sdf>"
)


def ask(served, service, type_name, **fields):
    """Whether a service of gz sim has done what it was asked, as its response says in bytes of ROS 2."""
    got = []
    request = cdr.kind(f"ros_gz_interfaces/{type_name}Request")(**fields)
    served.inbox.call(f"/world/world/{service}", request, "/client", lambda *answer: got.append(answer))
    served.server.receive()
    ((response, _),) = got
    name = f"ros_gz_interfaces/{type_name}Response"
    return cdr.decode(cdr.encode(response, name), name).success


def factory(name="", sdf=BALL, x=0.0, **fields):
    empty = {"allow_renaming": False, "sdf_filename": "", "clone_name": "", "relative_to": ""}
    pose = new("geometry_msgs/Pose", position={"x": x, "y": 5.0}, orientation={"w": 1.0})
    return cdr.kind("ros_gz_interfaces/EntityFactory")(name=name, sdf=sdf, pose=pose, **empty | fields)


def entity(name):
    return cdr.kind("ros_gz_interfaces/Entity")(id=0, name=name, type=2)


def test_services_of_gz_sim_spawn_move_and_remove(served):
    assert ask(served, "create", "SpawnEntity", entity_factory=factory("ball", x=3.0))
    assert ask(served, "create", "SpawnEntity", entity_factory=factory("ball", x=6.0, allow_renaming=True))
    place = served.server.bodies.model
    assert [place(name).position[0] for name in ("ball", "ball_1")] == pytest.approx([3.0, 6.0])
    pose = new("geometry_msgs/Pose", position={"x": 9.0}, orientation={"w": 1.0})
    assert ask(served, "set_pose", "SetEntityPose", entity=entity("ball"), pose=pose)
    assert place("ball").position[:2] == pytest.approx([9.0, 0.0])
    assert ask(served, "remove", "DeleteEntity", entity=entity("ball"))
    assert "ball" not in served.server.bodies.models


@pytest.mark.parametrize(
    ("service", "type_name", "fields", "why"),
    [
        ("create", "SpawnEntity", {"entity_factory": factory()},
         "entity_factory: name and sdf are needed; sdf_filename and clone_name are not supported"),
        ("create", "SpawnEntity", {"entity_factory": factory("x", "", sdf_filename="/etc/passwd")},
         "entity_factory: name and sdf are needed; sdf_filename and clone_name are not supported"),
        ("remove", "DeleteEntity", {"entity": entity("")}, "entity.name is needed: entities have no id"),
        ("set_pose", "SetEntityPose",
         {"entity": entity("wamv"), "pose": new("geometry_msgs/Pose", position={"x": math.nan})},
         "invalid pose.position [nan, 0.0, 0.0]: finite numbers are needed"),
    ],
)  # fmt: skip
def test_what_gz_sims_services_refuse_is_told(served, service, type_name, fields, why):
    assert not ask(served, service, type_name, **fields)
    assert served.lines[-1] == f"/world/world/{service}, called by /client: {why}"


def test_imu_has_the_same_content(table):
    data = Inertia(np.array([0.5, 0.5, 0.5, 0.5]), np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 9.8]))
    told = table.outputs["/wamv/sensors/imu/imu/data"].make(Reading("imu", "imu", 1.0, 1, "wamv/imu_wamv_link", data))
    back = cdr.decode(cdr.encode(told, "sensor_msgs/Imu"), "sensor_msgs/Imu")
    assert (back.angular_velocity.z, back.linear_acceleration.z, back.orientation.w) == (3.0, 9.8, 0.5)


def test_the_scan_is_the_ring_halfway_up():
    """Second implementation: each ray by itself."""
    config = LidarConfig(name="l", link="l", rings=4, samples=9, azimuth=(-math.pi, math.pi), range=(0.1, 50.0))
    ways = [-math.pi + 2 * math.pi / 8 * number for number in range(9)]
    rays = [(ring, way, 1.0 + ring + 0.1 * number) for number, way in enumerate(ways) for ring in range(4)]
    rays = [ray for ray in rays if ray[:2] != (2, ways[3])]  # no return
    points = np.array([(r * math.cos(way), r * math.sin(way), 0.0) for _, way, r in rays], np.float32)
    rings = np.array([ring for ring, _, _ in rays], np.uint16)
    scan = middle_ring(PointCloud(points, np.zeros(len(rays), np.float32), rings), config)
    expected = [3.0 + 0.1 * number for number in range(9)]
    expected[3] = math.inf
    assert scan.ranges.tolist() == pytest.approx(expected)
    assert (scan.angle_min, scan.angle_max, scan.angle_increment) == pytest.approx((-math.pi, math.pi, math.pi / 4))


def test_mutated_messages_are_taken_or_refused(served, table):
    """5,000 of them on all topics in, from bytes to the simulation; what is no VrxError would end it."""
    draw, refused = random.Random(15), 0
    for number in range(5000):
        entry = list(table.inputs.values())[number % len(table.inputs)]
        raw = bytearray(cdr.encode(new(entry.type), entry.type))
        for _ in range(draw.randint(1, 4)):
            raw[draw.randrange(len(raw))] = draw.randrange(256)
        del raw[draw.randint(4, len(raw)) if draw.random() < 0.2 else len(raw) :]
        try:
            message = cdr.decode(bytes(raw), entry.type)
        except CommandError:
            refused += 1
            continue
        give(served, entry.name, message)
    assert 500 < refused < 4500
    run(served, 1.0)  # it goes on: nothing became NaN
