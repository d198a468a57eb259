import dataclasses
import json
import math

import pytest

from trees import task_of
from vrx_mj.campaign.page import map_svg, sketch_of
from vrx_mj.mjcf.compile import compile_world

WORLD = {
    "extends": "ocean",
    "objects": [
        {"name": "red", "model": "mb_marker_buoy_red", "pose": [10, 5, 0, 0, 0, 0]},
        {"name": "green", "model": "mb_marker_buoy_green", "pose": [10, -5, 0, 0, 0, 0]},
    ],
    "docks": [{"name": "pier", "pose": [20, 0, 0, 0, 0, math.pi / 2], "layout": "XX\n"}],
    "task": {"type": "wayfinding", "waypoints_cart": [[5, 6, 0.5], [7, 8, 1.0]]},
}
KINDS = ("shore", "docks", "objects", "boats", "waypoints", "gates", "bays", "paths", "circles", "beacons")
BARE = {kind: [] for kind in KINDS}


@pytest.fixture(scope="module")
def world():
    return compile_world(WORLD)


def test_a_sketch_holds_what_a_map_shows(world):
    sketch = sketch_of(world)
    assert json.loads(json.dumps(sketch)) == sketch
    assert [(item["name"], item["spot"]) for item in sketch["objects"]] == [
        ("red", [10.0, 5.0]),
        ("green", [10.0, -5.0]),
    ]
    assert sketch["objects"][0]["color"] > "#c00000" > sketch["objects"][1]["color"]
    assert sketch["waypoints"] == [[5.0, 6.0, 0.5], [7.0, 8.0, 1.0]]
    assert [dock["name"] for dock in sketch["docks"]] == ["pier"]
    assert sketch["task"]["type"] == "wayfinding"


def with_task(world, **task):
    """The same world with another task, as far as its sketch wants to know it."""
    task = task_of({"name": "any", "boat": "wamv", **task})
    return dataclasses.replace(world, parameters=dataclasses.replace(world.parameters, task=task))


def test_gates_and_animals_are_found_by_the_names_of_their_objects(world):
    animals = [{"name": "red", "goal": "avoid"}]
    gates = [{"left": "red", "right": "green"}]
    sketch = sketch_of(with_task(world, type="navigation_course", gates=gates))
    assert sketch["gates"] == [{"left": [10.0, 5.0], "right": [10.0, -5.0], "yaw": math.pi}]
    sketch = sketch_of(with_task(world, type="wildlife", animals=animals, engagement_distance=10.0))
    assert sketch["circles"] == [{"x": 10.0, "y": 5.0, "radius": 10.0, "title": "red: avoid"}]


def test_bays_are_turned_with_their_dock(world):
    zone = {"center": [2.0, 0.0, 0.0], "size": [4.0, 2.0, 1.0]}
    bay = {
        "name": "bay1",
        "placard": None,
        "symbol": "red_circle",
        "dock_allowed": True,
        "internal": zone,
        "external": zone,
    }
    (drawn,) = sketch_of(
        with_task(world, type="dock", anchor="pier", bays=[bay], light_buoy=None, color_sequence=["off"] * 3)
    )["bays"]
    assert drawn == {"corners": [[21, 0], [21, 4], [19, 4], [19, 0]], "allowed": True, "title": "bay1: red circle"}


def test_a_gates_arrow_points_the_way_it_counts():
    gate = {"left": [10.0, 5.0], "right": [10.0, -5.0], "yaw": math.pi}
    marks = map_svg("w", {**BARE, "gates": [gate]}, [], [])
    arrow = marks[marks.index('class="arrow" d="M') + len('class="arrow" d="M') :]
    tip_x, tip_y = map(float, arrow[: arrow.index("L")].split())
    assert (tip_x < 10.0, tip_y) == (True, 0.0)


def test_land_lies_left_of_its_shore_and_lakes_are_water():
    square = [[-90.0, -90.0], [90.0, -90.0], [90.0, 90.0], [-90.0, 90.0]]
    lake = [[-50.0, -50.0], [-50.0, 50.0], [50.0, 50.0], [50.0, -50.0]]
    boats = [{"name": "wamv", "x": x, "y": x, "yaw": 0.0} for x in (-80.0, 80.0)]
    marks = map_svg("w", {**BARE, "boats": boats, "shore": [square, lake]}, [], [])
    land = marks[marks.index("land") : marks.index("/>")]
    assert (land.count("M"), land.count("Z")) == (2, 2)
    assert map_svg("w", {**BARE, "boats": boats}, [], []).count("land") == 0
