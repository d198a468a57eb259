import logging
import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from fingerprints import FONTS, check, placed
from trees import make_world, partial
from vrx_mj.draw.course import MapBoat, MapDock, MapObject, MapScene, map_of, nice_length
from vrx_mj.draw.map import chart, draw_map
from vrx_mj.draw.plan import _boat, view_of
from vrx_mj.draw.style import Thing, boat_color, font_warnings_hidden, hex_color, label
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.world import World
from vrx_mj.model.water import Sea, Wind

SHORE = (
    np.array([[-80.0, -60.0], [120.0, -60.0], [120.0, 90.0], [-80.0, 90.0]]),
    np.array([[-50.0, -40.0], [-50.0, 70.0], [100.0, 70.0], [100.0, -40.0]]),
)
SCENE = MapScene(
    title="课程 with 三艘船, $5",
    shore=SHORE,
    docks=(MapDock("码头", np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]]), 0.3),),
    objects=tuple(MapObject(f"浮标_{i}", "buoy", 3.0 * i, 12.0, (0.8, 0.1, 0.1), 0.6) for i in range(12)),
    boats=(
        MapBoat("wamv1", 10.0, -10.0, 1.0, "#d1495b"),
        MapBoat("wamv2", -20.0, 20.0, 3.0, (0.1, 0.5, 0.6)),
    ),
    waypoints=((30.0, 30.0, 0.0), (40.0, 5.0, 1.5)),
    wind=partial({"direction": [-0.5, math.sqrt(0.75)], "mean": 5.0}, Wind),
    sea=partial({"direction": [1.0, 0.0], "period": 7.0, "significant_height": 0.35}, Sea),
)
WORLD = make_world(
    mjcf="""<mujoco><worldbody><body name="buoy/link" pos="3 4 0"><freejoint/>
    <geom type="cylinder" size="0.5 1" rgba="0.9 0.1 0.1 1" group="2"/>
    <geom type="sphere" size="0.2" pos="0 0 1" rgba="1 1 1 1" group="2"/>
    <geom type="box" size="9 9 9" rgba="0 0 1 1" group="3"/></body></worldbody></mujoco>""",
    assets={},
    parameters=partial(
        {
            "georeference": None,
            "name": "bay",
            "fleet": "duo",
            "task": None,
            "floats": [],
            "shoreline": [[[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]],
            "wind": {"direction": [0.0, 1.0], "mean": 3.0},
            "sea": {"direction": [1.0, 0.0], "period": 5.0, "significant_height": 0.2, "waves": [{}]},
            "waypoints": [[1.0, 2.0, 0.5]],
            "objects": [
                {
                    "name": "buoy",
                    "model": "round",
                    "kind": "floating",
                    "body": "buoy/link",
                    "pose": [3.0, 4.0, 0, 0, 0, 0],
                }
            ],
            "docks": [
                {"name": "pier", "cells": [[0, 0], [1, 0]], "block": 2.0, "pose": [10.0, 0.0, 0, 0, 0, math.pi / 2]}
            ],
            "boats": [
                {"name": "wamv1", "robot": "wamv", "pose": [1.0, 2.0, 0.1, 0, 0, 0.5], "color": None},
                {"name": "wamv2", "robot": "skiff", "pose": [5.0, 2.0, 0.1, 0, 0, 1.5], "color": [0.1, 0.2, 0.3, 1.0]},
            ],
        }
    ),
)


def pixels(path):
    from matplotlib.image import imread

    return imread(path)[..., :3]


def test_a_map_is_a_picture_of_the_size_asked_for(tmp_path):
    draw_map(SCENE, tmp_path / "图" / "地图.png", size=(1200, 800))
    picture = pixels(tmp_path / "图" / "地图.png")
    assert picture.shape == (800, 1200, 3)
    for color in ("#dbe9f0", "#e9e2cd", "#d1495b", "#9aa3ab"):  # water, land, boat, dock
        wanted = np.array([int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        assert np.any(np.all(np.abs(picture - wanted) < 0.01, axis=2)), color


def test_the_same_scene_gives_the_same_bytes(tmp_path):
    draw_map(SCENE, tmp_path / "a.png")
    draw_map(SCENE, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    "scene",
    [
        MapScene("nothing"),
        MapScene("land only", shore=SHORE),
        MapScene("one boat", boats=(MapBoat("wamv", 0.0, 0.0, 0.0, "red"),)),
        replace(SCENE, boats=tuple(MapBoat(f"wamv{i}", 9.0 * i, 0.0, 0.0, "red") for i in range(100))),
        replace(SCENE, objects=tuple(MapObject("x", f"kind{i}", 0.0, 0.0, (0, 0, 0), 1) for i in range(40))),
    ],
)
def test_every_scene_can_be_drawn(tmp_path, scene):
    draw_map(scene, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 5_000


def test_small_courses_are_named_once_and_wide_ones_part_by_part(tmp_path, monkeypatch):
    names = []

    def noted(axes, things, pixel):
        names.extend(thing.name for thing in things if thing.name)

    monkeypatch.setattr("vrx_mj.draw.plan.label", noted)
    parts = [
        ("tent/chair", 0.0),
        ("tent/table", 1.0),
        ("course/a/gate", 0.0),
        ("course/b", 300.0),
        ("pier/sign", 9.0),
    ]
    objects = tuple(MapObject(name, "x", x, 5.0, (0, 0, 0), 1.0) for name, x in parts)
    dock = MapDock("pier/base", np.zeros((1, 2)), 0.0)
    draw_map(MapScene("names", objects=objects, docks=(dock,)), tmp_path / "map.png")
    assert names == ["pier", "tent", "gate", "b", "sign"]


@pytest.mark.parametrize("suffix", ["svg", "pdf"])
def test_a_map_can_be_a_drawing(tmp_path, suffix):
    draw_map(SCENE, tmp_path / f"map.{suffix}")
    assert (tmp_path / f"map.{suffix}").stat().st_size > 5_000


def test_other_formats_are_refused(tmp_path):
    with pytest.raises(VrxError, match=r"^invalid file name 'map\.doc' for a map: it must end in \.png, \.pdf, \.svg$"):
        draw_map(SCENE, tmp_path / "map.doc")


def test_a_world_becomes_a_scene():
    scene = map_of(WORLD)
    assert scene.title == "bay with duo"
    assert (scene.wind, scene.sea) == (WORLD.parameters.wind, WORLD.parameters.sea)
    assert scene.waypoints == ((1.0, 2.0, 0.5),)
    assert scene.objects == (MapObject("buoy", "round", 3.0, 4.0, pytest.approx((0.9, 0.1, 0.1)), pytest.approx(1.0)),)
    assert [(boat.name, boat.yaw) for boat in scene.boats] == [("wamv1", 0.5), ("wamv2 (skiff)", 1.5)]
    assert scene.boats[1].color == hex_color(boat_color(1, (0.1, 0.2, 0.3)))
    np.testing.assert_allclose(scene.docks[0].cells, [[10.0, 0.0], [10.0, 2.0]], atol=1e-12)
    np.testing.assert_array_equal(scene.shore[0], [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]])


@pytest.mark.parametrize("name", ["blue_projectile", "wamv1/ball_shooter"])  # the regatta's own, and a shooter's
def test_parked_balls_are_not_on_the_map(name):
    here = WORLD.parameters
    ball = replace(here.objects[0], name=name, model="blue_projectile")
    there = partial({**vars(here), "objects": [*here.objects, ball]})
    assert map_of(World(WORLD.pieces, there)).objects == map_of(WORLD).objects


def test_still_air_and_a_calm_sea_have_no_arrows():
    calm = partial({**vars(WORLD.parameters.sea), "waves": []}, Sea)
    there = partial({**vars(WORLD.parameters), "wind": {"direction": [1.0, 0.0], "mean": 0.0}, "sea": calm})
    scene = map_of(World(WORLD.pieces, there))
    assert scene.wind is None
    assert scene.sea is None


@pytest.mark.parametrize(("most", "length"), [(1.0, 1.0), (1.99, 1.0), (4.9, 2.0), (70.0, 50.0), (0.3, 0.2)])
def test_scale_bars_have_round_lengths(most, length):
    assert nice_length(most) == pytest.approx(length)


def test_an_object_far_from_everything_does_not_widen_the_plan():
    near, far = (
        MapObject("near", "x", 20.0, 0.0, (0, 0, 0), 1.0),
        MapObject("far", "x", 500.0, 0.0, (0, 0, 0), 1.0),
    )
    boat = MapBoat("wamv", 0.0, 0.0, 0.0, "red")
    west, east = chart(MapScene("s", objects=(near, far), boats=(boat,)), (800, 600)).axes[0].get_xlim()
    assert west < 0.0
    assert 20.0 < east < 100.0


@pytest.mark.parametrize("aspect", [0.5, 1.0, 1.45])
@pytest.mark.parametrize("place", [(400.0, 0.0), (0.0, 400.0), (3.0, 4.0)])
def test_a_plan_has_the_shape_of_its_picture_and_all_boats_in_it(aspect, place):
    boats = (MapBoat("one", 0.0, 0.0, 0.0, "red"), MapBoat("other", *place, 0.0, "blue"))
    west, south, east, north = view_of(MapScene(title="bay", boats=boats), aspect)
    assert (east - west) / (north - south) == pytest.approx(aspect)
    assert all(west < boat.x < east and south < boat.y < north for boat in boats)
    assert (west + east, south + north) == pytest.approx(place)


def test_fonts_without_a_weight_are_no_news(caplog):
    fonts = logging.getLogger("matplotlib.font_manager")
    with font_warnings_hidden():
        fonts.warning("findfont: Failed to find font weight bold for WenQuanYi Zen Hei, now using 500.")
        fonts.warning("findfont: something else")
    fonts.warning("findfont: Failed to find font weight %s", "bold")
    assert [record.getMessage() for record in caplog.records] == [
        "findfont: something else",
        "findfont: Failed to find font weight bold",
    ]


@pytest.mark.parametrize("size", [(1600, 1100), (1100, 760), (640, 480)])
def test_words_under_the_compass_stay_beside_the_plan_and_on_the_picture(size):
    sea = partial({"direction": [-1.0, 0.35], "period": 12.5, "significant_height": 10.25}, Sea)
    wind = partial({"direction": [-0.94, 0.34], "mean": 12.0}, Wind)
    with font_warnings_hidden():
        figure = chart(replace(SCENE, sea=sea, wind=wind), size)
    plan, panel = figure.axes[:2]
    boxes = [text.get_window_extent() for text in panel.texts if text.get_text()]
    assert len(boxes) == 7  # four quarters, waves, wind, and what their degrees are
    assert min(box.x0 for box in boxes) > plan.get_window_extent().x1
    assert max(box.x1 for box in boxes) <= size[0]
    far = MapScene(title="marina", boats=(MapBoat("cora", 10.0, -1370.0, 0.4, "#d1495b"),))
    assert chart(far, size).axes[0].yaxis.label.get_window_extent().x0 >= 0.0


def test_a_boat_is_the_same_on_both_sides_of_its_heading():
    axes = Figure().add_subplot()
    _boat(axes, MapBoat("a", 3.0, -2.0, 0.7, "red"), 2.0)
    (hull,) = (patch for patch in axes.patches if isinstance(patch, Polygon))
    corners = (hull.get_xy() - (3.0, -2.0)) @ [[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]]
    mirrored = {(round(x, 9), round(-y, 9) + 0.0) for x, y in corners}
    assert {(round(x, 9), round(y, 9) + 0.0) for x, y in corners} == mirrored
    assert corners[:, 0].max() == pytest.approx(-corners[:, 0].min())


def test_a_map_is_drawn_as_it_was():
    docks = (replace(SCENE.docks[0], name="pier"),)  # letters that matplotlib carries
    turned = replace(SCENE, title="turned", x_from_east=0.4, docks=docks, objects=())
    many = tuple(MapObject(f"x{i}", f"kind{i}", 3.0 * i, 0.0, (0.1, 0, 0), 1, i % 2 == 0) for i in range(18))
    rows = replace(turned, title="rows", objects=many, wind=None)
    for scene, size in ((turned, (1100, 760)), (rows, (700, 500)), (MapScene("empty", shore=SHORE), (400, 300))):
        check("draw", scene.title, rounding=FONTS, map=placed(chart(scene, size)))


@pytest.mark.parametrize(
    ("place", "sides"),
    [
        ((50.0, 50.0), ("left", "center")),
        ((99.0, 50.0), ("right", "center")),
        ((99.0, 1.0), ("right", "bottom")),
        ((1.0, 1.0), ("left", "bottom")),
        ((1.0, 99.0), ("left", "top")),
        ((99.0, 99.0), ("right", "top")),
    ],
)
def test_a_name_stands_beside_its_thing_and_within_the_frame(place, sides):
    axes = Figure(figsize=(4, 4), dpi=100).add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 100), ylim=(0, 100))
    label(axes, [Thing("name", *place, 1.0)], 0.25)
    (text,) = axes.texts
    assert (text.get_ha(), text.get_va()) == sides
    box, frame = text.get_window_extent(), axes.get_window_extent()
    assert box.x0 > frame.x0
    assert box.y0 > frame.y0
    assert box.x1 < frame.x1
    assert box.y1 < frame.y1


def test_a_name_that_fits_nowhere_is_left_out_unless_it_must_be_there():
    axes = Figure(figsize=(0.3, 0.3), dpi=100).add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 100), ylim=(0, 100))
    label(axes, [Thing("a long name", 50.0, 50.0, 1.0), Thing("", 5.0, 5.0, 1.0)], 3.0)
    assert not axes.texts
    label(axes, [Thing("another long name", 50.0, 50.0, 1.0, must=True)], 3.0)
    assert [text.get_text() for text in axes.texts] == ["another long name"]


def test_names_give_way_to_each_other_and_to_things():
    axes = Figure(figsize=(4, 4), dpi=100).add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 100), ylim=(0, 100))
    label(axes, [Thing("one", 50.0, 50.0, 1.0), Thing("two", 50.0, 50.0, 1.0), Thing("", 40.0, 50.0, 6.0)], 0.25)
    assert [(text.get_ha(), text.get_va()) for text in axes.texts] == [("left", "center"), ("center", "bottom")]
    label(axes, [Thing("on it", 20.0, 20.0, 0.0)], 0.25)
    assert (axes.texts[-1].get_ha(), axes.texts[-1].get_position()) == ("center", (20.0, 20.0))
