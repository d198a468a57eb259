"""Topics without a subscriber: which one is meant."""

import pytest

import vrx_mj
from ros_scene import served
from vrx_mj.ros.diagnosis import TopicHints, meant_topic
from vrx_mj.ros.table import make_tables

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
        ("/vrx/a/b", "*", "topics of boats begin with /wamv1/"),
        ("/wamv1/odom", "nav_msgs/Odometry", ""),
        ("/wamv1/path", "*", ""),
        ("/chatter", "std_msgs/String", ""),
        ("/", "*", ""),
        ("/wamv1/" + "x" * 300, "*", ""),
    ],
)
def test_hints(tables, topic, kind, hint):
    assert TopicHints()(topic, kind, tables["vrx"], BOATS) == hint


def test_classic_names_on_ros_2_lead_to_those_of_vrx_3(tables):
    hints, classic = TopicHints(), "/wamv2/thrusters/left_thrust_cmd"
    assert hints(classic, "std_msgs/Float32", tables["vrx3"], BOATS) == "did you mean /wamv2/thrusters/left/thrust?"
    assert hints("/wamv3/cmd_vel", "*", tables["vrx3"], BOATS) == "did you mean /wamv1/cmd_vel?"
