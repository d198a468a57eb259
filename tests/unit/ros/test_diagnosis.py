"""What goes wrong for users of VRX is told, once."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest

import vrx_mj
from ros_scene import call, run, served
from trees import partial
from vrx_mj.frames import quaternion
from vrx_mj.physics.tables import NEWTONS
from vrx_mj.ros import diagnosis
from vrx_mj.ros.diagnosis import Diagnosis, TopicHints, meant_topic
from vrx_mj.ros.interface import Command
from vrx_mj.ros.messages import new
from vrx_mj.ros.table import make_tables
from vrx_mj.ros.table.boats import boat_inputs
from vrx_mj.ros.table.world import elsewhere, topics_of
from vrx_mj.runtime.observation import BoatObservation


@pytest.mark.parametrize(
    ("topic", "hint"),
    [
        ("/wamv/thrusters/left_thrust_cmd", "did you mean /wamv1/thrusters/left_thrust_cmd?"),
        ("/wamv2/thrusters/lft_thrust_cmd", "did you mean /wamv2/thrusters/left_thrust_cmd?"),
        ("/x/y/cmd_vel", "did you mean /wamv1/cmd_vel?"),
        ("/wamv1/cmd_val", "did you mean /wamv1/cmd_vel?"),
        ("/wamv1/left_thrust_cmd", "did you mean /wamv1/thrusters/left_thrust_cmd?"),
        ("/wamv2/thruster/left_thrust_cmd", "did you mean /wamv2/thrusters/left_thrust_cmd?"),
        ("/wamv1/thrusters/left_thrust", "did you mean /wamv1/thrusters/left_thrust_cmd?"),
    ],
)
def test_who_publishes_where_no_boat_listens_is_told_what_was_meant(scene, topic, hint):
    scene.inbox.unknown_publisher(topic, "std_msgs/Float32", "/rostopic_1")
    scene.inbox.unknown_publisher("/rosbag/other", "std_msgs/Float32", "/rostopic_1")
    scene.server.receive()
    assert scene.told[-1] == f"{topic} has a publisher, /rostopic_1, but no subscriber: {hint}"


@pytest.mark.parametrize("dialect", ["vrx", "vrx3"])
def test_a_thruster_that_cannot_be_turned_has_no_topic_of_its_angle(dialect):
    fleet = {"robot": "heron", "sensors": "none", "boats": [{"name": "heron", "pose": [0, 0, 0, 0, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world({"physics": {"profile": "vrx"}}, fleet=fleet))
    host = SimpleNamespace(sim=sim, cmd_vel="off")
    topics = [entry.name for entry in boat_inputs(host, "heron") if "thrusters/" in entry.name]
    assert sorted(topics) == sorted(
        f"/heron/thrusters/{side}{end}" for side in ("left", "right") for end in ("_thrust_cmd", "/thrust")
    )
    told = []
    seen = Diagnosis(sim, lambda _level, text: told.append(text))
    topic = {"vrx": "/heron/thrusters/left_thrust_angle", "vrx3": "/heron/thrusters/left/pos"}[dialect]
    seen.unknown_publisher(SimpleNamespace(topic=topic, type="*", sender="/a"), SimpleNamespace(inputs={}))
    assert told == [f"{topic} has a publisher, /a, but no subscriber: left of heron cannot be turned"]


def test_a_command_that_comes_too_rarely_is_told(scene):
    for _ in range(5):
        scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=0.5), "/rostopic_1")
        run(scene, 2.0)
    slow = "/wamv1/thrusters/left_thrust_cmd arrives every 2 s, but a thrust lasts 1 s: it is on 50 % of the time; "
    assert scene.told == [f"{slow}publish with -r 2 or more"]


def test_two_programs_that_drive_one_thruster_are_told_once(scene):
    def send(sender, value):
        scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=value), sender)
        run(scene, 0.1)

    for sender in ("/first", "/first", "/second", "/third", "/third"):  # one after the other
        send(sender, 0.5)
    assert scene.told == []
    for _ in range(3):
        send("/pid", 0.2)
        send("/mixer", -0.2)
    both = "is published by /pid and /mixer: each message replaces the other's"
    assert scene.told == [f"/wamv1/thrusters/left_thrust_cmd {both}"]


def test_commands_beyond_what_engines_do_are_told_once(scene):
    for _ in range(3):
        scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=5.0), "/test")
        scene.inbox.message("/wamv1/thrusters/left_thrust_angle", new("std_msgs/Float32", data=3.0), "/test")
        run(scene, 0.1)
    assert sorted(scene.told) == [
        "left of wamv1 is 5, outside -1 to 1: the force is clamped to 250 N ahead, 100 N astern",
        "left_angle of wamv1 is 3 rad: the angle is clamped to 1.571 rad",
    ]


def test_a_boat_that_has_capsized_is_told_once_until_it_is_upright_again(scene):
    scene.sim.set_boat("wamv1", pose=(-520, 190, 0.5, math.pi, 0, 0))
    run(scene, 1.1)
    assert scene.told[0].endswith("wamv1 has capsized; right it with /gazebo/set_model_state")
    assert len([line for line in scene.told if "capsized" in line]) == 1


def test_a_boat_that_spins_is_told(scene):
    scene.sim.set_boat("wamv1", velocity=(0, 0, 0, 0, 0, 40))
    scene.server.diagnosis.look()
    assert scene.told == [
        "t = 0.0 s: wamv1 spins at 40 rad/s, more than 12: check masses, inertias and floats of its robot"
    ]


def test_a_held_boat_says_until_when(course):
    scene = served(vrx_mj.compile_world("stationkeeping_task"))
    scene.inbox.message("/wamv/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=0.5), "/test")
    scene.server.receive()
    assert scene.told == ["wamv is held by its task until t = 10 s: thrust has no effect until then"]


def test_a_boat_that_is_put_into_another_is_told(scene):
    place = scene.sim.observe()["wamv1"].position
    pose = {"position": {"x": place[0] + 0.5, "y": place[1], "z": place[2]}}
    call(
        scene, "/gazebo/set_model_state", "gazebo_msgs/SetModelState", model_state={"model_name": "wamv2", "pose": pose}
    )
    assert len(scene.told) == 1
    assert re.fullmatch(r"wamv1 and wamv2 overlap by \d\.\d\d m: move one of them", scene.told[0])


def test_a_gps_in_a_world_without_georeference_is_told_once_and_not_published():
    fleet = {"usv_count": 9, "layout": "line", "sensors": ["gps", "imu"]}
    scene = served(vrx_mj.compile_world("ocean", fleet=fleet))
    boats = ", ".join(f"wamv{number}" for number in range(1, 9))
    text = f"the world ocean has no georeference: the GPS topics of {boats} and 1 more are not published"
    assert scene.told == [f"{text}; add `georeference` to the world's file"]
    outputs = scene.network.table.outputs
    assert not [name for name in outputs if "gps" in name]
    assert "/wamv9/sensors/imu/imu/data" in outputs
    call(scene, "/gazebo/delete_model", "gazebo_msgs/DeleteModel", model_name="wamv9")
    assert len([line for line in scene.told if "GPS" in line]) == 1


HERE = {"georeference": {}, "boats": [{"name": "a"}]}


class Quiet:
    """A simulation of one boat, in which nothing touches anything."""

    boats, model = ("a",), None
    data = SimpleNamespace(contact=())
    world = SimpleNamespace(
        parameters=partial(
            {"georeference": {}, "boats": [{"name": "a"}], "thrusters": [{"hull": 0, "name": "left", "timeout": 1.0}]}
        )
    )

    def __init__(self):
        self.time = 0.0

    def mounted(self, boat):
        return ()


@pytest.mark.parametrize(
    ("gaps", "told"), [([2.0] * 5, 1), ([0.5, 2.0] * 3, 0), ([2.0, 2.0, 0.5] * 2, 0), ([0.9] * 6, 0)]
)
def test_commands_are_too_rare_if_each_comes_after_the_one_before_has_run_out(gaps, told):
    """A controller that pauses now and then is none that is too slow."""
    sim, lines = Quiet(), []
    diagnosis = Diagnosis(sim, lambda _level, text: lines.append(text))
    for gap in gaps:
        diagnosis.note_command(Command("/a/thrusters/left_thrust_cmd", None, "me"))
        sim.time += gap
    assert len(lines) == told


def turned(roll, pitch=0.0, spin=0.0):
    """What is seen of a boat at the origin [rad, rad/s]."""
    attitude = np.array(quaternion(roll, pitch, 0.7))
    return BoatObservation(np.zeros(3), attitude, np.zeros(3), np.array([0.0, 0.0, spin]))


@pytest.mark.parametrize(("roll", "pitch", "told"), [(0.4, 1.5, 0), (1.5, -0.3, 0), (3.0, 0.2, 1), (-2.0, 0.0, 1)])
def test_a_boat_has_capsized_when_its_mast_points_down(roll, pitch, told):
    sim, lines = Quiet(), []
    diagnosis = Diagnosis(sim, lambda _level, text: lines.append(text))
    sim.observe = lambda: {"a": turned(roll, pitch, spin=1.0)}
    diagnosis.look()
    assert len(lines) == told


def test_a_boat_that_capsized_is_said_to_be_upright_before_it_capsizes_again():
    sim, lines = Quiet(), []
    watch = Diagnosis(sim, lambda level, text: lines.append((level, text.partition(": ")[2].partition(";")[0])))
    for number, roll in enumerate((0.0, 2.0, 2.0, 0.0, 0.0, 2.0)):
        sim.time = float(number + 1)
        sim.observe = lambda roll=roll: {"a": turned(roll)}
        watch.look()
    capsized = ("WARN", "a has capsized")
    assert lines == [capsized, ("INFO", "a is upright again"), capsized]


@pytest.mark.parametrize(
    ("touches", "told"),
    [("1", 0), ("11", 1), ("101010", 0), ("1111" * 5, 1), ("11011001100110", 1), ("11" + "0" * 10 + "11", 3)],
)
def test_a_boat_is_aground_once_until_it_is_free_for_ten_seconds(monkeypatch, touches, told):
    sim, lines, looks = Quiet(), [], iter(touches)
    monkeypatch.setattr(diagnosis, "_touching_land", lambda _: {"a"} if next(looks) == "1" else set())
    sim.observe = lambda: {"a": turned(0.0)}
    watch = Diagnosis(sim, lambda _level, text: lines.append(text))
    for number in range(len(touches)):
        sim.time = float(number + 1)
        watch.look()
    assert [line.partition(": ")[2] for line in lines] == ["a is aground", "a is afloat again", "a is aground"][:told]


def test_the_unit_of_a_command_is_the_thrusters_however_weak_it_is():
    row = {"hull": 0, "name": "left", "mapping": NEWTONS, "max_command": 1.0, "max_forward": 1.0, "max_reverse": -0.5}
    sim, lines = Quiet(), []
    sim.world, sim.task = SimpleNamespace(parameters=partial({**HERE, "thrusters": [row]})), None
    diagnosis = Diagnosis(sim, lambda _level, text: lines.append(text))
    diagnosis.check_commands("a", {"left": 0.9})
    diagnosis.check_commands("a", {"left": -0.7})
    assert lines == ["left of a is -0.7 N, outside -0.5 to 1: the force is clamped to 1 N ahead, 0.5 N astern"]


# Topics without a subscriber: which one is meant


BOATS = ("wamv1", "wamv2", "escort")


@pytest.fixture(scope="module")
def tables():
    """The tables of both dialects for three boats, one of them with other thrusters."""
    boats = [{"name": name, "pose": [0, 12 * i, 0, 0, 0, 0]} for i, name in enumerate(BOATS)]
    fleet = {"sensors": "none", "boats": [*boats[:2], {**boats[2], "thrusters": "X"}]}
    return make_tables(served(vrx_mj.compile_world("ocean", fleet=fleet)).server, clock_rate=100.0)


def misspelt(name):
    """Names that are one slip away: a letter left out or doubled, another case, an outer segment left out or added."""
    _, boat, *rest = name.split("/")
    for i, segment in enumerate(rest):
        for j in range(1, len(segment)):
            for slip in (segment[:j] + segment[j + 1 :], segment[:j] + segment[j : j + 1] + segment[j:]):
                yield "/".join(["", boat, *rest[:i], slip, *rest[i + 1 :]])
        yield "/".join(["", boat, *rest[:i], segment.upper(), *rest[i + 1 :]])
    if len(rest) > 1:
        yield "/".join(["", boat, *rest[1:]])
    yield f"/{boat}/{boat}/{'/'.join(rest)}"
    yield f"/ns{name}"


@pytest.mark.parametrize("dialect", ["vrx", "vrx3"])
def test_a_name_that_is_one_slip_away_is_that_of_the_same_boat(tables, dialect):
    inputs = tables[dialect].inputs
    tried = 0
    for name, entry in inputs.items():
        for topic in misspelt(name):
            if topic not in inputs:
                assert meant_topic(topic, entry.type, inputs, BOATS) == name, topic
                tried += 1
    assert tried > 200


@pytest.mark.parametrize(
    ("topic", "kind", "hint"),
    [
        ("/wamv1/cmd_val", "*", "did you mean /wamv1/cmd_vel?"),
        ("/wamv_2/cmd_vel", "geometry_msgs/Twist", "did you mean /wamv2/cmd_vel?"),
        ("/thrusters/left_thrust_cmd", "*", "did you mean /wamv1/thrusters/left_thrust_cmd?"),
        ("/escort/thrusters/left_thrust_cmd", "*", "did you mean /escort/thrusters/left_rear_thrust_cmd?"),
        ("/wamv2/left", "std_msgs/Float32", "did you mean /wamv2/thrusters/left_thrust_cmd?"),
        ("/wamv2/left", "std_msgs/String", ""),
        ("/wamv1/thrusters/left/thrust", "std_msgs/Float64", "did you mean /wamv1/thrusters/left_thrust_cmd?"),
        ("/escort/thrusters/thrust_left_front_cmd", "*", "did you mean /escort/thrusters/left_front_thrust_cmd?"),
        ("/formation", "std_msgs/String", "did you mean /swarm/formation?"),
        ("/x/formation", "std_msgs/String", "did you mean /swarm/formation?"),
        ("/x/formation", "std_msgs/Bool", ""),  # two slips and another type
        ("/wamv1/cmd", "geometry_msgs/Twist", "did you mean /wamv1/cmd_vel?"),
        ("/wamv1/cmd", "std_msgs/String", ""),
        ("/vrx/a/b", "*", "this world has no such topic"),
        ("/vrx/perception/landmark", "*", "it belongs to perception tasks; this world has none"),
        (
            "/vrx/scan_dock/placard_symbol",
            "*",
            "it belongs to dock, scan_and_dock, scan_dock_deliver tasks; this world has none",
        ),
        ("/wamv7/shooters/x", "*", "topics of boats begin with /wamv1/"),
        ("/wamv1/odom", "nav_msgs/Odometry", ""),
        ("/wamv1/path", "*", ""),
        ("/chatter", "std_msgs/String", ""),
        ("/", "*", ""),
        ("/wamv1/" + "x" * 300, "*", ""),
    ],
)
def test_hints(tables, topic, kind, hint):
    assert TopicHints()(topic, kind, tables["vrx"], BOATS) == hint


@pytest.mark.parametrize("own", ["stationkeeping", "perception", "scan_dock_deliver"])
def test_no_topic_of_the_worlds_own_task_is_said_to_be_anothers(own):
    world = SimpleNamespace(parameters=SimpleNamespace(task=None))
    host = SimpleNamespace(sim=SimpleNamespace(task={"type": own}, world=world))
    found = elsewhere(host)
    assert not found.keys() & {one.name for one in topics_of(host, own)}
    assert "/vrx/wayfinding/waypoints" in found


def test_classic_names_on_ros_2_lead_to_those_of_vrx_3(tables):
    hints, classic = TopicHints(), "/wamv2/thrusters/left_thrust_cmd"
    assert hints(classic, "std_msgs/Float32", tables["vrx3"], BOATS) == "did you mean /wamv2/thrusters/left/thrust?"
    assert hints("/wamv3/cmd_vel", "*", tables["vrx3"], BOATS) == "did you mean /wamv1/cmd_vel?"
