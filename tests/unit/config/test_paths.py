"""Paths, fields, markers and lights: what world and object files say of them."""

import math

import pytest

from vrx_mj.config.docks import LIGHT_PATTERNS, SYMBOLS
from vrx_mj.config.objects import PathConfig, load_object, path_points
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError

AT = (3.0, -2.0, 0.0, 0.0, 0.0, math.pi / 2)


def message(**world):
    with pytest.raises(ConfigError) as caught:
        load_world(world)
    return str(caught.value)


def swimming(path, model="ball"):
    return {"objects": [{"name": "a", "model": model, "path": path}]}


def test_a_circle_has_eight_points_from_the_east_counter_clockwise():
    points = path_points(PathConfig(circle={"radius": 2.0}), AT)
    expected = [(3.0 + 2.0 * math.cos(math.pi / 4 * i), -2.0 + 2.0 * math.sin(math.pi / 4 * i)) for i in range(8)]
    assert points == [pytest.approx(point) for point in expected]


def test_a_line_leads_from_the_start_along_its_direction_from_the_bow():
    points = path_points(PathConfig(line={"length": 4.0, "direction": math.pi / 2}), AT)
    assert points == [pytest.approx((3.0, -2.0)), pytest.approx((-1.0, -2.0))]


def test_waypoints_are_places_in_the_world():
    path = PathConfig(waypoints=((1.0, 2.0), (3.0, 4.0), (5.0, 6.0)))
    assert path_points(path, AT) == [(1.0, 2.0), (3.0, 4.0), (5.0, 6.0)]


def test_a_path_may_start_in_its_middle():
    path = PathConfig(waypoints=((1.0, 2.0), (3.0, 4.0), (5.0, 6.0)), start=1)
    assert path_points(path, AT) == [(3.0, 4.0), (5.0, 6.0), (1.0, 2.0)]
    assert path_points(path.model_copy(update={"loop": False}), AT) == [(3.0, 4.0), (5.0, 6.0)]


@pytest.mark.usefixtures("ours")
@pytest.mark.parametrize(
    ("path", "text"),
    [
        ({}, "<world>: objects[0].path.waypoints: required unless circle or line is given"),
        (
            {"circle": {"radius": 1}, "line": {"length": 2}},
            "<world>: objects[0].path.line: give waypoints, circle or line, not circle and line",
        ),
        (
            {"line": {"length": 2}, "start": 2},
            "<world>: objects[0].path.start: must be below 2, the number of waypoints, got 2",
        ),
        ({"circle": {"radius": 0}}, "<world>: objects[0].path.circle.radius: must be above 0, got 0"),
        ({"waypoints": []}, "<world>: objects[0].path.waypoints: must not be empty"),
    ],
)
def test_a_wrong_path_says_what_is_wrong(path, text):
    assert message(**swimming(path)) == text


@pytest.mark.usefixtures("ours")
def test_only_what_floats_swims():
    text = message(**swimming({"circle": {"radius": 1}}, model="post"))
    assert text == "<world>: objects[0].path: 'post' does not float, so it cannot follow a path"


def test_animals_swim_to_their_places_in_sydney_and_static_ones_nowhere():
    for name, east in (("crocodile", -554.0), ("platypus", -514.0), ("turtle", -474.0)):
        path = load_object(f"{name}_buoy").path
        assert path is not None
        assert path.waypoints == ((east, 172.0), (east + 2.0, 168.0))
        assert (path.force, path.torque, path.loop) == (10.0, 1.0, True)
        assert load_object(f"{name}_static").path is None


@pytest.mark.usefixtures("here")
def test_a_light_is_made_of_visuals_with_names(here):
    text = "extends: ball\nvisuals: [{name: lamp, type: sphere, radius: 0.1}]\nlight: {panels: [lamp, lamb]}\n"
    (here / "mine.yaml").write_text(text, "utf-8")
    with pytest.raises(ConfigError) as caught:
        load_object("mine")
    assert str(caught.value) == "mine.yaml:3:24: light.panels[1]: no visual named 'lamb'; did you mean 'lamp'?"


@pytest.mark.usefixtures("here")
def test_off_is_a_colour_of_lights(here):
    text = (
        "extends: ball\nvisuals: [{name: lamp, type: sphere, radius: 0.1}]\n"
        "light: {panels: [lamp], pattern: [red, off, yellow]}\n"
    )
    (here / "mine.yaml").write_text(text, "utf-8")
    light = load_object("mine").light
    assert light is not None
    assert light.pattern == ("red", "off", "yellow")


def test_vrxs_patterns_and_symbols_in_vrxs_order():
    assert len(LIGHT_PATTERNS) == len(set(LIGHT_PATTERNS)) == 36
    assert LIGHT_PATTERNS[:4] == (
        ("red", "green", "red"), ("red", "green", "blue"), ("red", "green", "yellow"), ("red", "blue", "red"),
    )  # fmt: skip
    assert all(a != b != c for a, b, c in LIGHT_PATTERNS)
    assert SYMBOLS[:5] == ("blue_circle", "blue_cross", "blue_triangle", "blue_rectangle", "green_circle")
    assert (len(set(SYMBOLS)), SYMBOLS[-1]) == (16, "yellow_rectangle")


@pytest.mark.usefixtures("ours")
@pytest.mark.parametrize(
    ("field", "text"),
    [
        ({"objects": []}, "<world>: fields[0].objects: must not be empty"),
        (
            {"objects": [{"model": "pair", "count": 2}]},
            "<world>: fields[0].objects[0].model: 'pair' is made of other objects; a field needs single objects",
        ),
        (
            {"objects": [{"model": "ball", "count": 0}]},
            "<world>: fields[0].objects[0].count: must be at least 1, got 0",
        ),
    ],
)
def test_a_wrong_field_says_what_is_wrong(field, text):
    assert message(fields=[{"name": "f", **field}]) == text


@pytest.mark.usefixtures("ours")
def test_a_field_has_a_name_of_its_own():
    field = {"name": "f", "objects": [{"model": "ball", "count": 1}]}
    text = message(objects=[{"name": "f", "model": "ball"}], fields=[field])
    assert text == "<world>: fields[0].name: duplicate name 'f'"


def test_markers_are_round():
    text = message(markers={"scaling": [0.2, 0.3, 2.0]})
    assert text == ("<world>: markers.scaling: the first two must be equal, since markers are round; got [0.2, 0.3, 2]")


@pytest.mark.parametrize(
    ("model", "path", "drifts"),
    [
        ("mb_marker_buoy_red", {}, True),
        ("mb_marker_buoy_red", {"path": {"circle": {"radius": 3}}}, False),
        ("crocodile_buoy", {}, False),
        ("crocodile_buoy", {"path": None}, True),
        ("post", {}, False),
    ],
)
def test_a_rope_is_for_what_floats_and_swims_no_path_of_its_own_or_of_its_model(model, path, drifts):
    world = {"physics": {"profile": "marine"}, "objects": [{"name": "o", "model": model, "mooring": {}, **path}]}
    if drifts:
        assert load_world(world).objects[0].mooring is not None
        return
    with pytest.raises(ConfigError, match=rf"mooring: has no effect: '{model}' does not float, or follows a path"):
        load_world(world)
