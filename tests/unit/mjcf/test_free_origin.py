"""Fleets that are ashore or far away: the origin that is suggested has all boats afloat nearby."""

import json
import math
import re
import warnings
from functools import cache
from typing import get_args

import numpy as np
import pytest
import shapely
import yaml

from urdf_boats import assemble
from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.layouts import LayoutName
from vrx_mj.config.loading import file_of
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError
from vrx_mj.mjcf.afloat import FARTHEST_ORIGIN, boats_afloat, free_origin
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.objects import place_docks, place_objects

BOX = assemble()  # 4 m long, 1 m wide
SQUARE = np.array([(2, 1), (-2, 1), (-2, -1), (2, -1)], np.float64)
NOTHING = shapely.Polygon()
SUGGESTED = re.compile(r"`origin: (\[.*?\])` moves the whole fleet to free water$", re.MULTILINE)
ADVICE = "move it, or let `--nudge` (in Python `nudge=True`) move it to the nearest free place"


def at(y):
    """A boat's outline abeam."""
    return SQUARE + np.array([0.0, y])


def placed(fleet, config, built=lambda _: BOX):
    """The boats, or the error's text, and the texts of warnings."""
    objects, docks = tuple(place_objects(config.objects)), tuple(place_docks(config.docks, config.objects))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = boats_afloat(config, load_fleet(fleet, config), docks, objects, built, nudge=False)
        except ConfigError as error:
            found = str(error)
    return found, [str(item.message) for item in caught if "bearings" not in str(item.message)]


@pytest.fixture
def bay(tmp_path):
    """A shore along the y axis, land in the east; the spawn pose is 5 m off it and heads for it."""
    (tmp_path / "terrain").mkdir()
    land = {"land": [{"exterior": [[5, -900], [905, -900], [905, 900], [5, 900]], "holes": []}]}
    (tmp_path / "terrain" / "coast.json").write_text(json.dumps(land), encoding="utf-8")
    file = tmp_path / "bay.yaml"
    file.write_text("terrain: coast\nsea: {model: none}\nspawn: {pose: [0, 0, 0, 0, 0, 0]}\n", encoding="utf-8")
    return load_world(file)


def test_a_layout_that_is_ashore_is_an_error_with_an_origin_that_works(bay):
    fleet = {"usv_count": 4, "layout": "circle", "radius": 10, "origin": "spawn"}
    text, _ = placed(fleet, bay)
    assert text == (
        "<fleet>: 'wamv1' is on land, 7.00 m inside the shore of coast; "
        f"{ADVICE}; `origin: [-8, 0, 0]` moves the whole fleet to free water"
    )
    boats, told = placed({**fleet, "origin": [-8, 0, 0]}, bay)
    assert told == []
    assert max(boat.pose[0] for boat in boats) == pytest.approx(2.0)


def test_places_of_the_world_itself_are_only_to_be_moved(bay):
    text, _ = placed({"positions": [{"x": 0, "y": 0}, {"x": 9, "y": 0}]}, bay)
    assert text == f"<fleet>: positions[1]: 'wamv2' is on land, 6.00 m inside the shore of coast; {ADVICE}"


def test_a_fleet_far_from_everything_is_warned_of_with_an_origin_at_the_spawn_pose():
    config = load_world({"sea": {"model": "none"}, "name": "open"})
    fleet = {"positions": [{"x": 500, "y": 0}, {"x": 600, "y": 0}]}
    _, (text,) = placed(fleet, config)
    assert text == (
        "fleet fleet is 500 m from the spawn pose, the nearest thing in world open; more than 300 m; "
        "`origin: [-550, 0, 0]` moves the whole fleet to free water"
    )
    assert placed({**fleet, "origin": [-550, 0, 0]}, config)[1] == []


@pytest.mark.slow
def test_where_there_is_no_room_none_is_suggested():
    wall = shapely.box(-2000, -2000, 2000, 2000) - shapely.box(-3, -3, 3, 3)
    line = np.stack([SQUARE, at(10)])
    assert free_origin(line, (0.0, 0.0, 0.0), wall, NOTHING, water=(0.0, 0.0)) is None
    twice = np.stack([SQUARE, SQUARE])
    assert free_origin(twice, (0.0, 0.0, 0.0), NOTHING, NOTHING, water=(0.0, 0.0)) is None
    assert free_origin(SQUARE[None], (0.0, 0.0, 0.0), shapely.box(-999, -999, 999, 999), NOTHING, water=(0, 0)) is None


def test_boats_are_turned_where_only_that_helps_and_stay_on_their_side_of_the_land():
    """A channel 12 m wide along the x axis, with open water beyond a wall."""
    walls = shapely.union_all([shapely.box(-5000, 6, 5000, 20), shapely.box(-5000, -2000, 5000, -6)])
    abreast = np.stack([at(y) for y in (-10, 0, 10)])
    x, y, yaw = free_origin(abreast, (0.0, 0.0, 0.0), walls, NOTHING, water=(0.0, 0.0))
    assert abs(yaw) == pytest.approx(math.pi / 2, abs=0.01)
    assert (x, y) == (0.0, 0.0)
    pier = shapely.box(-30, -1, 3, 1)
    x, _, _ = free_origin(abreast, (0.0, 0.0, 0.0), walls, pier, water=(0.0, 0.0))
    assert x in {-42.0, 16.0}  # to the next even number behind the pier
    assert abs(x) <= FARTHEST_ORIGIN


@cache
def wamv(order):
    return build_boat(order)


def afloat_or_well_advised(config, said, origin):
    """Whether a fleet floats, or does so at the origin that it gets for an error or a warning."""
    fleet = {**said, "origin": origin, "sensors": "none"}
    boats, told = placed(fleet, config, lambda boat: wamv(boat.order))
    if not isinstance(boats, str) and not told:
        return True
    found = SUGGESTED.search("\n".join([boats if isinstance(boats, str) else "", *told]))
    moved, told = placed({**fleet, "origin": json.loads(found[1])}, config, lambda boat: wamv(boat.order))
    near = [math.dist(boat.pose[:2], config.spawn.pose[:2]) < 120.0 for boat in moved]
    return told == [] and any(near)


@pytest.mark.parametrize("origin", ["world", "spawn"])
def test_the_guides_fleet_on_the_course_gets_an_origin_that_works(origin):
    guide = yaml.safe_load(file_of("fleets", "usv_config").read_text(encoding="utf-8"))
    assert afloat_or_well_advised(load_world("example_course"), guide, origin)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["example_course", "sand_island"])
def test_in_shipped_worlds_every_layout_is_afloat_or_gets_an_origin_at_which_it_is(name):
    config = load_world(name)
    for layout in get_args(LayoutName):
        for number in (3, 6):
            for origin in ("world", "spawn"):
                said = {"usv_count": number, "layout": layout}
                assert afloat_or_well_advised(config, said, origin), (said, origin)
