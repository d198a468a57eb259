import math
import re
import xml.etree.ElementTree as ET
from dataclasses import fields, replace

import numpy as np
import pytest

from fingerprints import FONTS, check, placed
from trees import partial
from vrx_mj.draw.course import (
    Course,
    MapBoat,
    MapDock,
    MapObject,
    MapPlacard,
    MapScene,
    course_of,
    symbols_of,
    zone_corners,
)
from vrx_mj.draw.map import chart, draw_map
from vrx_mj.draw.plan import view_of
from vrx_mj.model.tasks import Box

SVG = "{http://www.w3.org/2000/svg}"


def thing(name, x, y, yaw=0.0):
    return {"name": name, "pose": [x, y, 0.0, 0.0, 0.0, yaw]}


def world(task, *objects, docks=(), boats=(), **rows):
    return partial({"floats": [], "task": task, "objects": objects, "docks": docks, "boats": boats, **rows})


GATES = [{"left": "red_0", "right": "green_0"}, {"left": "red_1", "right": "white_1"}]
BUOYS = (thing("red_0", 10, 0), thing("green_0", 0, 0), thing("red_1", 20, 30), thing("white_1", 20, 40))
ZONE = {"center": [4.0, 1.0, 0.25], "size": [2.0, 1.0, 2.0]}
UNLIT = {"light_buoy": None, "color_sequence": ["red", "green", "blue"]}
OUTER = {"center": [-4.0, 1.0, 0.25], "size": [1.0, 5.0, 2.0]}
BAYS = [
    {
        "name": "bay1",
        "placard": "d/p1",
        "symbol": "red_cross",
        "dock_allowed": True,
        "internal": ZONE,
        "external": OUTER,
    }
]


@pytest.mark.parametrize(
    "task",
    [
        {"type": "navigation_course", "gates": GATES},
        {"type": "gymkhana", "channel": {"gates": GATES}, "pinger": {"x": 1.0, "y": 2.0}},
    ],
)
def test_gates_are_crossed_with_the_left_buoy_to_starboard(task):
    """Red in the east of green: northwards. Red in the south of white: eastwards."""
    first, second = course_of(world(task, *BUOYS)).gates
    assert (first.number, first.left, first.right, first.middle) == (1, (10, 0), (0, 0), (5, 0))
    assert first.yaw == pytest.approx(math.pi / 2)
    assert (second.number, second.middle) == (2, (20, 35))
    assert second.yaw == pytest.approx(0.0)


def test_zones_of_a_turned_dock_lie_where_the_dock_has_them():
    """At (10, 20), turned by 90 degrees: the dock's x goes north, its y west."""
    task = {"type": "dock", "anchor": "d/base", "bays": BAYS, **UNLIT}
    (bay,) = course_of(world(task, docks=[thing("d/base", 10, 20, math.pi / 2)])).bays
    np.testing.assert_allclose(bay.internal[:, :2], [[9.5, 23], [9.5, 25], [8.5, 25], [8.5, 23]], atol=1e-12)
    np.testing.assert_allclose(bay.external[:, :2].mean(axis=0), [9, 16], atol=1e-12)
    np.testing.assert_allclose(np.ptp(bay.external[:, :2], axis=0), [5, 1], atol=1e-12)
    assert bay.right
    assert bay.symbol == "red_cross"


def test_a_zone_is_drawn_at_its_bottom_but_not_under_water():
    assert set(zone_corners(Box(**ZONE))[:, 2]) == {0.0}
    assert set(zone_corners(Box(center=(0, 0, 3), size=(1, 1, 2)))[:, 2]) == {2.0}


def test_animals_have_their_goals_and_the_radius_of_engagement():
    rows = [{"name": "turtle", "goal": "circumnavigate_counterclockwise"}, {"name": "croc", "goal": "avoid"}]
    task = {"type": "wildlife", "animals": rows, "engagement_distance": 10.0}
    turtle, croc = course_of(world(task, thing("turtle", 1, 2), thing("croc", 3, 4))).animals
    assert (turtle.x, turtle.y, turtle.radius, turtle.goal) == (1, 2, 10.0, "circumnavigate_counterclockwise")
    assert (croc.x, croc.y, croc.goal) == (3, 4, "avoid")


def test_what_swims_has_its_waypoints_also_without_a_task():
    followers = [
        {"waypoint_start": 0, "waypoint_count": 1, "loop": 0},
        {"waypoint_start": 1, "waypoint_count": 2, "loop": 1},
    ]
    points = [{"position": [float(i), -float(i)]} for i in range(3)]
    floats = [{"body": "buoy/link", "follower": -1}, {"body": "pinger/link", "follower": 1}]
    parameters = world(None, thing("pinger", 5, 6), followers=followers, floats=floats, path_points=points)
    (path,) = course_of(parameters).paths
    assert (path.name, path.start, path.closed) == ("pinger", (5, 6), True)
    np.testing.assert_array_equal(path.points, [[1, -1], [2, -2]])


@pytest.mark.parametrize(
    ("task", "name", "radius"),
    [
        ({"type": "acoustic_perception", "pinger": {"x": 3.0, "y": 4.0}, "goal_tolerance": 2.5}, "beacon", 2.5),
        ({"type": "gymkhana", "pinger": {"x": 3.0, "y": 4.0}, "channel": {"gates": []}}, "black box", 0.0),
        ({"type": "acoustic_tracking", "pinger": "whale"}, "whale", 0.0),
    ],
)
def test_beacons_lie_still_or_start_where_what_carries_them_does(task, name, radius):
    (beacon,) = course_of(world(task, thing("whale", 3.0, 4.0))).beacons
    assert (beacon.name, beacon.x, beacon.y, beacon.radius) == (name, 3.0, 4.0, radius)


def test_objects_come_up_before_the_boat_as_it_heads():
    """8 m ahead and 2 m to the left of a boat that heads north."""
    shown = {"time": 5.0, "duration": 3.0, "type": "buoy", "name": "red", "pose": [8.0, 2.0, 1.0, 0, 0, 0]}
    task = {"type": "perception", "objects": [shown], "boat": "wamv"}
    (showing,) = course_of(world(task, boats=[thing("wamv", 100, 50, math.pi / 2)])).showings
    assert (showing.x, showing.y) == pytest.approx((98, 58))
    assert (showing.start, showing.end) == (5.0, 8.0)


def test_lights_and_placards_show_what_the_task_tells_them():
    lights = [{"name": "buoy", "pattern": ["off"] * 3}, {"name": "other", "pattern": ["red", "green", "red"]}]
    placards = [{"name": "d/p1", "symbol": "blue_circle"}, {"name": "d/p2", "symbol": "blue_circle"}]
    task = {
        "type": "dock",
        "anchor": "d",
        "bays": BAYS,
        "light_buoy": "buoy",
        "color_sequence": ["blue", "Green", "yellow"],
    }
    things = (thing("buoy", 1, 2), thing("other", 3, 4))
    parameters = world(task, *things, docks=[thing("d", 0, 0)], lights=lights, placards=placards)
    assert [light.colors for light in course_of(parameters).lights] == [
        ("blue", "green", "yellow"),
        ("red", "green", "red"),
    ]
    assert symbols_of(parameters) == {"d/p1": "red_cross", "d/p2": "blue_circle"}
    alone = partial({**vars(parameters), "task": None})
    assert [light.name for light in course_of(alone).lights] == ["other"]  # dark ones: no dots


def full_scene():
    """A map with one of everything."""
    shown = {"time": 5.0, "duration": 3.0, "type": "buoy", "name": "red_1", "pose": [8.0, 2.0, 1.0, 0, 0, 0]}
    goals = ("avoid", "circumnavigate_clockwise", "circumnavigate_counterclockwise")
    animals = [{"name": f"a{i}", "goal": goal} for i, goal in enumerate(goals)]
    tasks = [
        {"type": "navigation_course", "gates": GATES},
        {"type": "dock", "anchor": "d", "bays": BAYS, **UNLIT},
        {"type": "acoustic_perception", "pinger": {"x": -20.0, "y": 10.0}, "goal_tolerance": 3.0},
        {"type": "perception", "boat": "wamv", "objects": [shown]},
        {"type": "wildlife", "animals": animals, "engagement_distance": 10.0},
    ]
    objects = (*BUOYS, *(thing(f"a{i}", -40 + 25 * i, -30) for i in range(3)), thing("light", 40, 40))
    path = {"waypoint_start": 0, "waypoint_count": 3, "loop": 1}
    parameters = world(
        None, *objects, docks=[thing("d", 40, 0, 1.0)], boats=[thing("wamv", 0, -10)], followers=[path],
        floats=[{"body": "a1/link", "follower": 0}],
        path_points=[{"position": [x, -30.0 + x]} for x in (-15.0, 0.0, 9.0)],
        lights=[{"name": "light", "pattern": ["red", "green", "yellow"]}],
    )  # fmt: skip
    courses = [course_of(partial({**vars(parameters), "task": task})) for task in tasks]
    laid_out = {part.name: sum((getattr(one, part.name) for one in courses), ()) for part in fields(Course)}
    laid_out |= {part: getattr(courses[0], part) for part in ("lights", "paths")}
    return MapScene(
        title="all of it",
        docks=(MapDock("d", np.array([[40.0, 0.0], [42.0, 0.0]]), 1.0),),
        objects=tuple(MapObject(item["name"], "buoy", *item["pose"][:2], (0.8, 0.1, 0.1), 0.6) for item in objects),
        boats=(MapBoat("wamv", 0.0, -10.0, 0.0, "#d1495b"),),
        placards=(MapPlacard("p1", 41.0, 0.0, "red_cross"), MapPlacard("p2", 41.2, 0.0, "blue_triangle")),
        course=Course(**laid_out),
    )


def test_a_map_of_everything_is_the_same_bytes_twice_and_shows_it(tmp_path):
    from matplotlib.image import imread

    draw_map(full_scene(), tmp_path / "a.png", size=(900, 650))
    draw_map(full_scene(), tmp_path / "b.png", size=(900, 650))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    picture = imread(tmp_path / "a.png")[..., :3]
    for color in ("#0f7b5f", "#2a9d3a", "#c0392b", "#1c6fb5", "#5a4fa3", "#b3261e"):  # gate, bay, animals, path, beacon
        wanted = np.array([int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        assert np.any(np.all(np.abs(picture - wanted) < 0.02, axis=2)), color


def test_names_in_an_svg_are_texts_with_one_style_for_their_edges(tmp_path):
    draw_map(full_scene(), tmp_path / "a.svg", size=(900, 650))
    draw_map(full_scene(), tmp_path / "b.svg", size=(900, 650))
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    root = ET.parse(tmp_path / "a.svg").getroot()
    groups = [group for group in root.iter(f"{SVG}g") if group.get("id", "").startswith("halo")]
    assert len({group.get("id") for group in groups}) == len(groups)
    names = [text.text for group in groups for text in group.iter(f"{SVG}text")]
    assert {"wamv", "d"} <= {*names}
    assert len(names) == len(groups)
    assert "[id^=halo] text{paint-order: stroke;" in next(root.iter(f"{SVG}style")).text


def test_dashed_lines_begin_with_a_whole_dash(tmp_path):
    draw_map(full_scene(), tmp_path / "a.svg", size=(900, 650))
    found = re.findall(r"stroke-dasharray: [^;]+; stroke-dashoffset: ([^;]+)", (tmp_path / "a.svg").read_text())
    assert len(found) == 4  # a bay, an animal, a path and the way to it
    assert {*found} == {"0"}


def test_a_plan_holds_the_course_but_not_where_objects_wait_to_come_up():
    scene = full_scene()
    far = MapObject("red_1", "buoy", 900.0, 900.0, (0.8, 0.1, 0.1), 0.6)
    plain = replace(scene, objects=())
    west, south, east, north = view_of(plain, 1.4)
    assert view_of(replace(plain, objects=(far,)), 1.4) == (west, south, east, north)
    assert all(west < x < east and south < y < north for x, y in scene.course.spots())


def test_a_map_of_everything_is_drawn_as_it_was():
    scene = full_scene()
    boats = (*scene.boats, MapBoat("b", 8.0, -30.0, 2.0, (0.1, 0.5, 0.6)))
    wrong = tuple(replace(bay, right=False) for bay in scene.course.bays)
    far = [replace(light, colors=light.colors[::-1], x=80.0) for light in scene.course.lights]
    goal = replace(
        scene, waypoints=((5.0, 5.0, 1.0),), boats=boats, course=replace(scene.course, bays=wrong, lights=tuple(far))
    )
    for name, one, size in (("all", scene, (900, 650)), ("small", goal, (500, 700))):
        check("draw", name, rounding=FONTS, scene=one, map=placed(chart(one, size)))
