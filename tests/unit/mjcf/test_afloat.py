"""Boats on land, on docks and on one another: told with the distance, or moved to the nearest free place."""

import json
import math
import warnings
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from urdf_boats import assemble
from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.layouts import LayoutName
from vrx_mj.config.search import catalogue
from vrx_mj.config.shapes import Shape
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.mjcf.afloat import _moves, boats_afloat, depth_in_land
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.flotation import _extent
from vrx_mj.mjcf.objects import place_docks, place_objects

BOX = assemble()  # 4 m long, 1 m wide
ADVICE = "move it, or let `--nudge` (in Python `nudge=True`) move it to the nearest free place"
PIER = {"name": "pier", "layout": "XX", "pose": [20, 0, 0, 0, 0, 0]}  # x from 19 to 21, y from -1 to 3
RING = [[10, -300], [610, -300], [610, 300], [10, 300]]
LAKE = [[110, -40], [190, -40], [190, 40], [110, 40]]


def afloat(fleet, *, nudge=False, **world):
    """The boats of a fleet of boxes, or of a list of places (x, y, heading [degrees]), and no warning."""
    if isinstance(fleet, list):
        fleet = {"headings": "math", "positions": [{"x": x, "y": y, "Y": Y} for x, y, Y in fleet]}
    config = world.pop("config", None) or load_world({"sea": {"model": "none"}, **world})
    objects = tuple(place_objects(config.objects))
    docks = tuple(place_docks(config.docks, config.objects))
    return boats_afloat(config, load_fleet(fleet, config), docks, objects, lambda _: BOX, nudge=nudge)


def refusal(fleet, **world):
    with pytest.raises(ConfigError) as caught:
        afloat(fleet, **world)
    return str(caught.value)


@pytest.fixture
def island(tmp_path):
    """A world whose land begins 10 m in the east, with a lake in it."""
    (tmp_path / "terrain").mkdir()
    land = {"land": [{"exterior": RING, "holes": [LAKE]}]}
    (tmp_path / "terrain" / "rock.json").write_text(json.dumps(land), encoding="utf-8")
    file = tmp_path / "isle.yaml"
    file.write_text("terrain: rock\nsea: {model: none}\nspawn: {pose: [200, 0, 0, 0, 0, 0]}\n", encoding="utf-8")
    return load_world(file)


@pytest.mark.parametrize(
    ("x", "heading", "depth"), [(3.7, 0, "0.30"), (3.7, 180, "0.30"), (2.3, 90, "0.20"), (0.2, 0, "0.50")]
)
def test_a_boat_on_another_is_refused_with_the_depth_and_the_distance(x, heading, depth):
    assert refusal([(0, 0, 0), (x, 0, heading)]) == (
        f"<fleet>: positions[1]: 'wamv2' is on 'wamv1', {depth} m inside it, with {x:.2f} m between their origins; "
        + ADVICE
    )


@pytest.mark.parametrize("place", [(4.1, 0, 0), (0, 1.1, 0), (2.6, 0, 90), (2.2, 2.0, 30)])
def test_boats_side_by_side_are_let_be(place):
    assert [boat.pose[0] for boat in afloat([(0, 0, 0), place])] == [0.0, place[0]]


@given(x=st.floats(-5, 5), y=st.floats(-5, 5), heading=st.floats(-180, 180))
def test_boats_meet_when_no_axis_of_either_separates_them(x, y, heading):
    turn = math.radians(heading)
    axes = np.array([(1, 0), (0, 1), (math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))])
    reach = sum(half * np.abs(axes @ axis) for half, axis in zip((2.0, 0.5) * 2, axes, strict=True))
    gap = np.max(np.abs(axes @ (x, y)) - reach)
    if abs(gap) < 1e-6:
        return  # to a rounding, they touch
    if gap > 0:
        assert len(afloat([(0, 0, 0), (x, y, heading)])) == 2
    else:
        assert refusal([(0, 0, 0), (x, y, heading)]).startswith("<fleet>: positions[1]: 'wamv2' is on 'wamv1', ")


def test_a_boat_on_a_dock_is_refused_with_the_depth():
    assert refusal([(17.5, 0, 0)], docks=[PIER]) == (
        f"<fleet>: positions[0]: 'wamv1' is on the dock 'pier', 0.50 m inside it; {ADVICE}"
    )
    assert afloat([(16.9, 0, 0), (20, -1.6, 0), (20, 3.6, 0)], docks=[PIER])


def test_a_boat_on_land_is_refused_with_the_depth_and_one_in_a_lake_is_not(island):
    assert refusal([(9, 0, 0), (7.9, 9, 0), (150, 0, 0), (109, 0, 0)], config=island) == (
        f"<fleet>: positions[0]: 'wamv1' is on land, 1.00 m inside the shore of rock; {ADVICE}\n"
        f"<fleet>: positions[3]: 'wamv4' is on land, 3.00 m inside the shore of rock; {ADVICE}"
    )


def test_every_fault_is_told_with_the_line_that_puts_the_boat_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "mine.yaml"
    rows = ["positions:", "- {x: 0, y: 0}", "- {x: 30, y: 0}", "boats:", "- {name: late, pose: [0, 1, 0, 0, 0, 0]}"]
    file.write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        compile_world("ocean", fleet="mine.yaml")
    assert str(caught.value) == (
        "mine.yaml:5:3: boats[0]: 'late' is on 'wamv1', 1.00 m inside it, with 1.00 m between their origins; " + ADVICE
    )


def test_a_hundred_boats_on_top_of_each_other_are_one_problem_each():
    with pytest.raises(ConfigError) as caught:
        afloat([(0.001 * i, 0, 0) for i in range(100)])
    assert len(caught.value.problems) == 99
    assert str(caught.value).splitlines()[-1] == "and 59 more problems"


def test_a_spawn_pose_on_land_is_told_and_kept(island):
    with pytest.warns(VrxWarning) as caught:
        (boat,) = afloat(None, config=island)
    assert [str(item.message) for item in caught] == [
        "world isle: 'wamv' is on land, 12.00 m inside the shore of rock, at the spawn pose"
    ]
    assert boat.pose == island.spawn.pose


def test_a_nudged_boat_goes_to_the_nearest_free_place_and_says_so():
    """Half a metre of water around it: it goes 2 m, for 1.5 m would do only exactly abeam."""
    with pytest.warns(VrxWarning) as caught:
        first, second = afloat([(5, 7, 0), (5, 7, 0)], nudge=True)
    (text,) = (str(item.message) for item in caught)
    x, y = second.pose[:2]
    assert text == (
        f"'wamv2' moved 2.00 m to x {x:.2f}, y {y:.2f}: it was on 'wamv1', 0.50 m inside it, with 0.00 m between "
        "their origins"
    )
    assert first.pose[:2] == (5.0, 7.0)
    assert math.hypot(x - 5, y - 7) == pytest.approx(2.0)
    assert abs(y - 7) >= 1.5


@given(
    places=st.lists(st.tuples(st.floats(-8, 24), st.floats(-8, 8), st.floats(-180, 180)), min_size=2, max_size=6),
    red=st.tuples(st.floats(-8, 16), st.floats(-8, 8)),
)
def test_after_a_nudge_nothing_is_on_anything_and_free_boats_are_where_they_were(places, red):
    buoy = {"name": "red", "model": "mb_marker_buoy_red", "pose": [*red, 0, 0, 0, 0]}
    world = load_world({"sea": {"model": "none"}, "docks": [PIER], "objects": [buoy]})
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        boats = afloat(places, nudge=True, config=world)
    ends = [(*boat.pose[:2], math.degrees(boat.pose[5])) for boat in boats]
    assert [boat.pose for boat in afloat(ends, config=world)] == [pytest.approx(boat.pose) for boat in boats]
    moved = [math.dist(end, place) > 1e-6 for end, place in zip(ends, places, strict=True)]
    assert sum(moved) == sum(" moved " in str(item.message) for item in caught)
    assert all(math.dist(end[:2], red) > 1.5 for end, went in zip(ends, moved, strict=True) if went)


def test_places_are_tried_in_rings_half_a_metre_apart_in_up_to_120_directions():
    moves = np.concatenate(_moves())
    distances = np.round(np.hypot(*moves.T), 9)
    rings, counts = np.unique(distances, return_counts=True)
    assert np.array_equal(distances, np.sort(distances))
    assert np.array_equal(rings, 0.5 * np.arange(1, 401))
    assert counts.tolist() == [min(math.ceil(2 * math.pi * ring / 0.5), 120) for ring in rings]
    for ring, one in zip(rings, np.split(moves, np.cumsum(counts)[:-1]), strict=True):
        assert one[0] == pytest.approx([ring, 0.0])
        gaps = np.hypot(*(np.roll(one, -1, axis=0) - one).T)
        assert gaps == pytest.approx(2 * ring * math.sin(math.pi / len(one)))
    assert {len(group) // 10 for group in _moves()} == {25}


def test_where_there_is_no_room_a_nudge_says_so(island):
    assert refusal([(400, 0, 0)], nudge=True, config=island).endswith("the shore of rock; no free place within 200 m")


@pytest.mark.parametrize("name", get_args(LayoutName))
def test_boats_of_a_layout_do_not_overlap_by_default(name):
    config = load_world("ocean")
    fleet = load_fleet({"usv_count": 12, "layout": name}, config)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        boats = boats_afloat(config, fleet, (), (), lambda boat: build_boat(boat.order), nudge=False)
    assert [boat.pose for boat in boats] == [boat.pose for boat, _ in fleet.boats_in(config)]


@pytest.mark.parametrize("name", sorted(catalogue("fleets")))
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_boats_of_a_shipped_fleet_start_afloat(name):
    config = load_world("example_course")
    docks = tuple(place_docks(config.docks, config.objects))
    built = {boat.order: build_boat(boat.order) for boat, _ in load_fleet(name, config).boats_in(config)}
    boats = boats_afloat(config, load_fleet(name, config), docks, (), lambda boat: built[boat.order], nudge=False)
    assert bool(boats) == (name != "none")


@pytest.mark.parametrize(("yaw", "aground"), [(0.5, True), (-0.5, False), (0.5 + math.pi, True)])
def test_a_boat_s_outline_is_turned_by_its_heading(yaw, aground):
    """A rock ahead of the bow of a boat 10 m long that heads 0.5 rad to port of east."""
    corners = np.array([(5.0, 1.0), (-5.0, 1.0), (-5.0, -1.0), (5.0, -1.0)])
    x, y = 4.0 * math.cos(0.5), 4.0 * math.sin(0.5)
    rock = [(x - 0.3, y - 0.3), (x + 0.3, y - 0.3), (x + 0.3, y + 0.3), (x - 0.3, y + 0.3)]
    assert (depth_in_land(corners, (0.0, 0.0, 0.0, 0.0, 0.0, yaw), [rock]) > 0.0) == aground


@pytest.mark.parametrize(
    ("sizes", "half"),
    [
        ({"type": "box", "size": (2.0, 1.0, 0.5)}, (1.0, 0.5, 0.25)),
        ({"type": "sphere", "radius": 0.2}, (0.2, 0.2, 0.2)),
        ({"type": "cylinder", "radius": 0.2, "length": 1.0}, (0.2, 0.2, 0.5)),
        ({"type": "capsule", "radius": 0.2, "length": 1.0}, (0.2, 0.2, 0.7)),
    ],
)
def test_a_shape_reaches_as_far_as_its_sizes_say(sizes, half):
    assert _extent(Shape(**sizes)) == (tuple(-edge for edge in half), half)
