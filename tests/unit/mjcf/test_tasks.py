"""Tasks resolved in their worlds, what tells of touches, and the lock: by hand, and in plain MuJoCo."""

import math
from dataclasses import fields, replace

import mujoco
import pytest

from vrx_mj.config.objects import ObjectConfig
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.objects import PlacedObject
from vrx_mj.mjcf.tasks import _RESOLVERS, thing_touches
from vrx_mj.model import world as model_world
from vrx_mj.model.tasks import BOAT, AcousticTracking, followed_things
from vrx_mj.model.world import tree_of
from vrx_mj.runtime.stepping_models import stepping_models

EARTH = {"georeference": {"latitude": -33.724223, "longitude": 150.679736}}
COURSE = {"name": "c", "model": "short_navigation_course0", "pose": [30, 5, 0, 0, 0, math.pi / 2]}
DOCK = {"name": "d", "model": "dock_2022", "pose": [60, 0, 0, 0, 0, 0.5]}
RED = {"name": "red", "model": "mb_marker_buoy_red", "pose": [40, 5, 0, 0, 0, 0]}
CROCODILE = {"name": "croc", "model": "crocodile_buoy", "pose": [20, 5, 0, 0, 0, 0]}
LIGHT = {"name": "light", "model": "robotx_light_buoy", "pose": [20, 15, 0.25, 0, 0, 0]}
GATE_NAMES = [{"left": f"c/red_bound_{i}", "right": f"c/green_bound_{i}"} for i in range(3)]
HERE = {"type": "stationkeeping", "goal_cart": [1, 2, 0.5]}


def task_of(task, *objects, fleet=None, **more):
    return tree_of(compile_world({"objects": list(objects), "task": task, **more}, fleet=fleet).parameters)["task"]


def refusal(task, *objects, **more):
    with pytest.raises(ConfigError) as caught:
        task_of(task, *objects, **more)
    return str(caught.value)


def test_a_world_without_a_task_has_none():
    world = compile_world("sydney_regatta")
    assert (tree_of(world.parameters)["task"], tree_of(world.parameters)["waypoints"]) == (None, [])
    assert not any(word in world.mjcf for word in ("<sensor>", "carrier", "<weld"))


def test_what_all_tasks_have():
    task = task_of({**HERE, "name": "mine", "ready_state_duration": 3, "locked": False})
    assert task == {
        "type": "stationkeeping",
        "name": "mine",
        "boat": "wamv",
        "profile": "vrx",
        "durations": [10.0, 3.0, 300.0],
        "collision_buffer": 3.0,
        "locked": False,
        "held": False,
        "fixed": {},
        "rivals": [],
        "goal": {"x": 1.0, "y": 2.0, "yaw": 0.5, "latitude": None, "longitude": None},
        "heading": True,
    }


def test_a_task_is_called_as_its_type_is_written():
    task = task_of({**HERE, "type": "station_keeping"})
    assert (task["type"], task["name"]) == ("stationkeeping", "station_keeping")


def test_the_goal_of_vrx_is_where_its_plugin_puts_it():
    goal = task_of({"type": "stationkeeping", "goal": [-33.722702498, 150.67402097002, 3.14159]}, **EARTH)["goal"]
    assert (goal["x"], goal["y"]) == pytest.approx((-529.69, 168.64), abs=0.005)  # the check values have two decimals
    assert (goal["yaw"], goal["latitude"], goal["longitude"]) == (3.14159, -33.722702498, 150.67402097002)


def test_the_same_place_both_ways():
    there = task_of({"type": "wayfinding", "waypoints": [[-33.7226766699, 150.6740630167, 1.2]]}, **EARTH)["waypoints"][
        0
    ]
    back = task_of({"type": "wayfinding", "waypoints_cart": [[there["x"], there["y"], 1.2]]}, **EARTH)["waypoints"][0]
    assert back == pytest.approx(there, abs=1e-7)  # the ground bends away from the plane: centimetres at 500 m


def test_a_goal_at_a_latitude_faces_from_east_in_a_turned_world():
    """The yaw beside a latitude counts from true east, that beside x and y from the world's x."""
    for heading in (30.0, -100.0):
        earth = {"georeference": {**EARTH["georeference"], "heading": heading}}
        place = [*EARTH["georeference"].values(), 1.0]
        goal = task_of({"type": "stationkeeping", "goal": place}, **earth)["goal"]
        assert math.remainder(goal["yaw"] - (1.0 - math.radians(heading)), math.tau) == pytest.approx(0.0, abs=1e-9)
        assert (goal["x"], goal["y"]) == pytest.approx((0.0, 0.0), abs=1e-6)
        assert task_of(HERE, **earth)["goal"]["yaw"] == 0.5


def test_maps_get_the_waypoints_of_the_task():
    world = compile_world({"task": {"type": "wayfinding", "waypoints_cart": [[1, 2, 0.5], [3, 4, 0]]}})
    assert tree_of(world.parameters)["waypoints"] == [[1.0, 2.0, 0.5], [3.0, 4.0, 0.0]]
    assert tree_of(compile_world({"task": HERE}).parameters)["waypoints"] == [[1.0, 2.0, 0.5]]


def test_the_scored_boat_is_the_fleets_first_or_the_named_one():
    fleet = {"boats": [{"name": "ann", "pose": [0, 0, 0.1, 0, 0, 0]}, {"name": "bob", "pose": [20, 0, 0.1, 0, 0, 0]}]}
    first, named = task_of(HERE, fleet=fleet), task_of({**HERE, "boat": "bob"}, fleet=fleet)
    assert (first["boat"], first["rivals"]) == ("ann", ["bob"])
    assert (named["boat"], named["rivals"]) == ("bob", ["ann"])


def test_shown_objects_know_their_type_and_where_they_wait():
    task = task_of({"type": "perception", "objects": [{"time": 5, "name": "red", "pose": [8, 0, 1, 0, 0, 0.5]}]}, RED)
    assert task["held"] is True
    assert task["objects"] == [
        {
            "time": 5.0,
            "duration": 5.0,
            "type": "mb_marker_buoy_red",
            "name": "red",
            "pose": [8.0, 0.0, 1.0, 0.0, 0.0, 0.5],
            "stash": [40.0, 5.0, 0.0, 0.0, 0.0, 0.0],
        }
    ]


def test_gates_are_found_among_the_parts_of_the_course():
    task = task_of({"type": "navigation_course", "course": "c"}, COURSE, RED)
    assert (task["gates"], task["obstacle_penalty"]) == (GATE_NAMES, 10.0)


def test_the_partners_of_red_buoys_have_any_colour_and_the_numbers_order_them():
    parts = [
        ("red_bound_10", 0),
        ("black_bound_10", 5),
        ("red_bound_2", 10),
        ("white_bound_2", 15),
        ("red_bound_3", 20),
    ]
    placed = [{"name": name, "model": "mb_marker_buoy_red", "pose": [20, y, 0, 0, 0, 0]} for name, y in parts]
    with pytest.warns(VrxWarning, match="^the world: ignored for lack of a partner: red_bound_3$"):
        task = task_of({"type": "follow_path"}, *placed)
    pairs = [(gate["left"], gate["right"]) for gate in task["gates"]]
    assert pairs == [("red_bound_2", "white_bound_2"), ("red_bound_10", "black_bound_10")]
    assert (task["points_per_gate_crossed"], task["bonus"], task["obstacle_penalty"]) == (10.0, 1.0, 3.0)


def test_gates_of_ones_own():
    gates = [["green_bound_1", "red_bound_1"]]
    channel = {"course": "c", "gates": gates, "obstacle_penalty": 2}
    task = task_of({"type": "gymkhana", "channel": channel, "pinger": [9, 8, -2]}, COURSE, **EARTH)
    own = [{"left": "c/green_bound_1", "right": "c/red_bound_1"}]
    assert task["channel"] == {"gates": own, "obstacle_penalty": 2.0, "collision_buffer": 10.0}
    assert (task["pinger"]["x"], task["pinger"]["y"], task["pinger"]["z"]) == (9.0, 8.0, -2.0)
    assert task["pinger"]["latitude"] == pytest.approx(-33.724223 + 8 / 110_917, abs=1e-7)  # m per degree here


def test_animals_have_goals_by_their_models():
    platypus, turtle = ({**CROCODILE, "name": n, "model": f"{n}_buoy", "pose": [x, 0, 0, 0, 0, 0]} for n, x in (
        ("platypus", 40), ("turtle", 60)))  # fmt: skip
    task = task_of({"type": "wildlife"}, CROCODILE, RED, platypus, turtle)
    assert task["animals"] == [
        {"name": "croc", "model": "crocodile_buoy", "goal": "avoid"},
        {"name": "platypus", "model": "platypus_buoy", "goal": "circumnavigate_clockwise"},
        {"name": "turtle", "model": "turtle_buoy", "goal": "circumnavigate_counterclockwise"},
    ]
    own = task_of({"type": "wildlife", "animals": [{"name": "red", "goal": "avoid"}]}, RED)["animals"]
    assert own == [{"name": "red", "model": "mb_marker_buoy_red", "goal": "avoid"}]


def test_acoustic_tasks():
    pinger = task_of({"type": "acoustic_perception", "pinger": [9, 8, -2]})["pinger"]
    assert pinger == {"x": 9.0, "y": 8.0, "z": -2.0, "latitude": None, "longitude": None}
    task = task_of({"type": "acoustic_tracking", "pinger": "red"}, RED)
    assert (task["pinger"], task["pinger_depth"], task["obstacle_penalty"]) == ("red", 2.0, 1.0)


BAYS = [
    {"symbol": "red_circle"},
    {"symbol": "blue_cross", "dock_allowed": True},
    {"name": "bay3", "symbol": "green_circle"},
]


def test_bays_and_holes_are_those_of_the_dock():
    task = task_of({"type": "scan_dock_deliver", "dock": "d", "bays": BAYS, "light_buoy": "light"}, DOCK, LIGHT)
    assert (task["anchor"], task["fixed"]["d/base"]) == ("d/base", pytest.approx([60, 0, 0, 0, 0, 0.5]))
    second = task["bays"][1]
    assert (second["name"], second["placard"]) == ("bay2", "d/dock_2022_placard2")
    assert (second["symbol"], second["dock_allowed"]) == ("blue_cross", True)
    assert second["internal"] == {"center": [1.45, 9.0, 0.25], "size": [4.0, 1.5, 2.0]}
    assert second["external"] == {"center": [-3.55, 9.0, 0.25], "size": [1.5, 5.5, 2.0]}
    points = [(hole["bay"], hole["size"], hole["points"]) for hole in task["holes"]]
    assert points == [(f"bay{i}", size, value) for i in (1, 2, 3) for size, value in (("big", 5.0), ("small", 10.0))]
    assert task["balls"] == ["wamv/ball_shooter"]


def test_only_targets_that_are_asked_for_count():
    plain = task_of({"type": "dock", "dock": "d", "bays": BAYS}, DOCK)
    assert (plain["holes"], plain["light_buoy"], plain["enable_color_checker"]) == ([], None, False)
    target = {"bay": 2, "size": "small", "points": 7}
    holes = task_of({"type": "dock", "dock": "d", "bays": BAYS, "targets": [target]}, DOCK)["holes"]
    assert [(hole["bay"], hole["size"], hole["points"]) for hole in holes] == [("bay2", "small", 7.0)]


def test_a_name_that_no_resolver_looks_up_must_be_in_the_world(monkeypatch):
    monkeypatch.delitem(_RESOLVERS, "pinger")
    text = refusal({"type": "acoustic_tracking", "pinger": "read"}, RED)
    assert text == "<world>: task.pinger: no object or dock named 'read'; did you mean 'red'?"
    assert task_of({"type": "acoustic_tracking", "pinger": "red"}, RED)["pinger"] == "red"


def test_a_name_may_be_that_of_another_boat(monkeypatch):
    """As a task of two boats has it: its rules get the other one's poses."""
    pinger = next(each for each in fields(AcousticTracking) if each.name == "pinger")
    monkeypatch.setattr(pinger, "metadata", {"name_of": BOAT})
    monkeypatch.delitem(_RESOLVERS, "pinger")
    task, fleet = {"type": "acoustic_tracking", "pinger": "wamv3"}, {"positions": [{"x": 0, "y": 0}, {"x": 9, "y": 0}]}
    assert refusal(task, fleet=fleet) == "<world>: task.pinger: no boat named 'wamv3'; did you mean 'wamv2'?"
    world = compile_world({"task": {**task, "pinger": "wamv2"}}, fleet=fleet)
    assert "wamv2" in followed_things(world.parameters.task)
    assert list(model_world._task(world.parameters, replace(world.parameters.task, pinger="buoy"))) == [
        "task.pinger: there is no boat 'buoy'"
    ]


PARTS = "red_bound_0, red_bound_1, red_bound_2, green_bound_0, green_bound_1, green_bound_2"


@pytest.mark.parametrize(
    ("task", "objects", "message"),
    [
        ({**HERE, "boat": "bob"}, [], "task.boat: no boat named 'bob'; known: wamv"),
        (
            {"type": "navigation_course", "course": "c", "gates": [["red_bound_0", "blue"]]},
            [COURSE],
            f"task.gates[0]: course 'c' has no buoy 'blue'; known: {PARTS}",
        ),
        ({"type": "follow_path", "course": "x"}, [COURSE, RED], "task.course: no course named 'x'; known: c"),
        (
            {"type": "gymkhana", "channel": {"gates": [["red", "green"]]}, "pinger": [0, 0, 0]},
            [RED],
            "task.channel.gates[0]: the world has no buoy 'green'; known: red",
        ),
        (
            {"type": "navigation_course"},
            [RED],
            "task.gates: the world has no red_bound_i with a partner i, one of green, white, blue, black; known: red",
        ),
        (
            {"type": "wildlife", "animals": [{"name": "red"}, {"name": "cat"}]},
            [RED],
            (
                "task.animals[0].goal: required for the model mb_marker_buoy_red; "
                "only crocodile, platypus, turtle have goals of their own\n"
                "<world>: task.animals[1].name: no object named 'cat'; known: red"
            ),
        ),
        (
            {"type": "wildlife"},
            [RED],
            "task.animals: the world has no animals; models of animals start with crocodile, platypus, turtle",
        ),
        (
            {"type": "perception", "objects": [{"time": 1, "name": "rod", "pose": [8, 0, 1, 0, 0, 0]}]},
            [RED],
            "task.objects[0].name: no object named 'rod'; known: red",
        ),
        (
            {"type": "acoustic_tracking", "pinger": "post"},
            [{"name": "post", "model": "post", "pose": [20, 0, 0, 0, 0, 0]}],
            "task.pinger: 'post' is static; a floating object is needed",
        ),
        ({"type": "dock", "dock": "x", "bays": BAYS}, [DOCK], "task.dock: no dock named 'x'; known: d"),
        (
            {"type": "dock", "dock": "d", "bays": BAYS[:1], "light_buoy": "red"},
            [DOCK, RED],
            "task.bays: 'd' has 3 bays, bay1, bay2, bay3; got 1\n<world>: task.light_buoy: 'red' has no `light`",
        ),
        (
            {"type": "dock", "dock": "d", "bays": BAYS[::-1], "targets": [{"bay": 4, "size": "big", "points": 1}]},
            [DOCK],
            (
                "task.bays[0].name: this bay of 'd' is 'bay1', not 'bay3'\n"
                "<world>: task.targets[0]: bay 4 of 'd' has no big hole"
            ),
        ),
    ],
)
def test_what_is_not_in_the_world_is_told_with_its_place(task, objects, message):
    assert refusal(task, *objects) == f"<world>: {message}"


def test_a_waypoint_on_land_is_told_with_its_line(tmp_path):
    file = tmp_path / "mine.yaml"
    task = "task:\n  type: wayfinding\n  waypoints_cart:\n    - [-530, 180, 0]\n    - [-540, 146, 0]\n"
    text = f"extends: sydney_regatta\n{task}"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        compile_world(file)
    (problem,) = caught.value.problems
    assert (problem.line, problem.column, problem.key) == (6, 7, "task.waypoints_cart[1]")
    assert problem.message == "on land: x -540.00 m, y 146.00 m is inside the shore of sydney_regatta"


@pytest.mark.parametrize(("x", "overlaps"), [(62.0, True), (40.0, False)])
def test_docks_need_room_of_their_own(x, overlaps):
    drawn = {"name": "mine", "layout": "X X\nXXX\n", "pose": [x, 2, 0, 0, 0, 0.4]}
    if overlaps:
        with pytest.raises(ConfigError) as caught:
            compile_world({"objects": [DOCK], "docks": [drawn]})
        assert str(caught.value) == "<world>: objects[0].pose: the dock 'd/base' overlaps the dock 'mine'"
    else:
        compile_world({"objects": [DOCK], "docks": [drawn]})


# Touches


def placed(world, model, body, pose):
    """A model's data at the start, one free body somewhere else: x, y, z [m]."""
    data = mujoco.MjData(model)
    if body is not None:
        start = model.jnt_qposadr[model.body(body).jntadr[0]]
        data.qpos[start : start + 3] = pose
    mujoco.mj_forward(model, data)
    return data


def touched(world, body="wamv/base_link", pose=(0.0, 0.0, 0.1), which=0):
    """Names of the rivals whose sensors fire with the boat there, in the model with shapes or its twin without."""
    data = placed(world, stepping_models(world)[which], body, pose)
    rivals = tree_of(world.parameters)["task"]["rivals"]
    return [name for name, value in zip(rivals, data.sensordata, strict=True) if value > 0]


@pytest.fixture(scope="module")
def harbour():
    fleet = {"boats": [{"name": "wamv", "pose": [0, 0, 0.1, 0, 0, 0]}, {"name": "bob", "pose": [0, 40, 0.1, 0, 0, 0]}]}
    floating = {"name": "raft", "layout": "XXX\n", "dynamic": True, "pose": [-30, 0, 0.1, 0, 0, 0]}
    pier = {"name": "pier", "layout": "XXX\n", "pose": [-60, 0, 0, 0, 0, 0]}
    post = {"name": "post", "model": "post", "pose": [20, -20, 0, 0, 0, 0]}
    world = {"objects": [RED, post, COURSE], "docks": [floating, pier], "task": HERE}
    return compile_world(world, fleet=fleet)


def test_rivals_are_all_that_can_collide(harbour):
    parts = [f"c/{name}" for name in PARTS.split(", ")]
    assert tree_of(harbour.parameters)["task"]["rivals"] == ["red", "post", *parts, "raft", "pier", "bob"]


@pytest.mark.parametrize(
    ("pose", "names"),
    [
        ((0.0, 0.0, 0.1), []),
        ((40.0, 5.5, 0.1), ["red"]),
        ((40.0, 20.0, 0.1), []),
        ((20.0, -20.5, 0.1), ["post"]),
        ((-30.0, 0.0, 0.1), ["raft"]),
        ((-30.0, 4.0, 0.1), ["raft"]),
        ((-60.0, 4.0, 0.1), ["pier"]),
        ((0.5, 40.5, 0.1), ["bob"]),
        ((30.0, 5.5, 0.1), ["c/red_bound_0"]),
    ],
)
def test_a_sensor_fires_where_the_boat_overlaps_a_thing_and_nowhere_else(harbour, pose, names):
    assert touched(harbour, pose=pose) == names
    assert touched(harbour, pose=pose, which=1) == []


def test_another_boat_that_hits_something_is_not_scored(harbour):
    assert touched(harbour, "bob/base_link", (40.0, 5.5, 0.1)) == []


def test_the_shore_is_a_rival():
    world = compile_world({"extends": "sydney_regatta", "task": HERE})
    assert tree_of(world.parameters)["task"]["rivals"][-1] == "terrain"
    assert touched(world, pose=(-532.0, 154.0, 0.3)) == ["terrain"]


def test_a_boat_touches_any_link_of_an_object_that_has_joints():
    link = {"name": "arm", "mass": 1.0, "inertia": (1.0, 1.0, 1.0), "collisions": ({"type": "sphere", "radius": 1.0},)}
    joint = {"name": "hinge", "type": "revolute", "parent": "post", "child": "arm"}
    jointed = ObjectConfig.model_validate({"static": True, "link": "post", "links": (link,), "joints": (joint,)})
    single = ObjectConfig.model_validate({"static": True, "collisions": link["collisions"]})
    items = [PlacedObject(name, name, one, (0.0,) * 6) for name, one in (("crane", jointed), ("pole", single))]
    found = [(touch.name, touch.body, touch.tree) for touch in thing_touches(items, [])]
    assert found == [("crane", "crane/post", True), ("pole", "pole/link", False)]
