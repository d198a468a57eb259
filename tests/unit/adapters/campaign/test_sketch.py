import json
import math

import pytest

from vrx_mj.adapters.campaign.drawing import draw
from vrx_mj.adapters.campaign.sketch import sketch_of
from vrx_mj.compiler.compile import compile_world

WORLD = {
    "extends": "ocean",
    "objects": [
        {"name": "red", "model": "mb_marker_buoy_red", "pose": [10, 5, 0, 0, 0, 0]},
        {"name": "green", "model": "mb_marker_buoy_green", "pose": [10, -5, 0, 0, 0, 0]},
    ],
    "docks": [{"name": "pier", "pose": [20, 0, 0, 0, 0, math.pi / 2], "layout": "XX\n"}],
    "task": {"type": "wayfinding", "waypoints_cart": [[5, 6, 0.5], [7, 8, 1.0]]},
}


@pytest.fixture(scope="module")
def world():
    return compile_world(WORLD)


def test_a_sketch_holds_what_a_map_shows(world):
    sketch = sketch_of(world)
    assert json.loads(json.dumps(sketch)) == sketch
    assert [(item["name"], item["x"], item["y"]) for item in sketch["objects"]] == [
        ("red", 10.0, 5.0),
        ("green", 10.0, -5.0),
    ]
    assert sketch["objects"][0]["color"] > "#c00000" > sketch["objects"][1]["color"]
    assert sketch["waypoints"] == [[5.0, 6.0, 0.5], [7.0, 8.0, 1.0]]
    assert [dock["name"] for dock in sketch["docks"]] == ["pier"]
    assert sketch["task"]["type"] == "wayfinding"


def test_gates_and_animals_are_found_by_the_names_of_their_objects(world):
    task = {
        "type": "x", "name": "x", "gates": [{"left": "red", "right": "green"}],
        "animals": [{"name": "red", "goal": "avoid"}], "engagement_distance": 10.0,
        "pinger": {"x": 1.0, "y": 2.0, "z": 0.0},
    }  # fmt: skip
    parameters = {**world.parameters, "task": task}
    sketch = sketch_of(type(world)(world.mjcf, world.assets, parameters))
    assert sketch["gates"] == [[10.0, 5.0, 10.0, -5.0]]
    assert sketch["circles"] == [{"x": 10.0, "y": 5.0, "radius": 10.0, "goal": "avoid"}]
    assert sketch["pinger"] == [1.0, 2.0]


def test_bays_are_turned_with_their_dock(world):
    inside = {"center": [2.0, 0.0, 0.0], "size": [4.0, 2.0, 1.0]}
    bay = {"name": "bay1", "symbol": "red_circle", "dock_allowed": True, "internal": inside}
    parameters = {**world.parameters, "task": {"type": "dock", "name": "dock", "anchor": "pier", "bays": [bay]}}
    (drawn,) = sketch_of(type(world)(world.mjcf, world.assets, parameters))["bays"]
    assert drawn == {"corners": [[21, 0], [21, 4], [19, 4], [19, 0]], "allowed": True, "told": "bay1: red circle"}


def test_objects_of_perception_are_shown_where_they_appear(world):
    shown = {"name": "red", "pose": [3.0, 1.0, 0.7, 0.0, 0.0, 0.0]}
    boat = {**world.parameters["boats"][0], "pose": [2.0, 4.0, 0.0, 0.0, 0.0, math.pi / 2]}
    task = {"type": "perception", "name": "perception", "boat": boat["name"], "objects": [shown]}
    sketch = sketch_of(type(world)(world.mjcf, world.assets, {**world.parameters, "boats": [boat], "task": task}))
    red, green = sketch["objects"]
    assert (red["x"], red["y"]) == pytest.approx((1.0, 7.0))  # ahead is north, to port is west
    assert (green["x"], green["y"]) == (10.0, -5.0)


def test_a_gates_arrow_has_its_left_buoy_to_starboard():
    empty = {key: [] for key in ("docks", "objects", "waypoints", "circles", "bays", "shore", "boats")}
    marks = draw({**empty, "gates": [[10.0, 5.0, 10.0, -5.0]], "cell": 2.0, "pinger": None}, [], []).marks
    arrow = marks[marks.index('class="arrow" d="M') + len('class="arrow" d="M') :]
    tip_x, tip_y = map(float, arrow[: arrow.index("L")].split())
    assert (tip_x < 10.0, tip_y) == (True, 0.0)  # to the west, the buoy in the north to starboard


def test_land_lies_left_of_its_shore_and_lakes_are_water():
    square = [[-90.0, -90.0], [90.0, -90.0], [90.0, 90.0], [-90.0, 90.0]]
    lake = [[-50.0, -50.0], [-50.0, 50.0], [50.0, 50.0], [50.0, -50.0]]
    empty = {key: [] for key in ("docks", "objects", "waypoints", "gates", "circles", "bays")}
    boats = [{"name": "wamv", "x": x, "y": x, "yaw": 0.0} for x in (-80.0, 80.0)]
    bare = {**empty, "boats": boats, "cell": 2.0, "pinger": None, "shore": [square, lake]}
    marks = draw(bare, [], []).marks
    land = marks[marks.index("land") : marks.index("/>")]
    assert (land.count("M"), land.count("Z")) == (2, 2)
    assert draw({**bare, "shore": []}, [], []).marks.count("land") == 0
