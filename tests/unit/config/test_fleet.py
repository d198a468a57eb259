"""Fleets: who sails, from where, and what is refused or warned of."""

import math
import warnings

import pytest

from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.packages import root

GUIDE = """usv_count: 3
layout: circle
positions:
  - {x: 0, y: 20, z: 0.1, Y: 0}
  - {x: 17.32, y: -10, z: 0.1, Y: 120}
  - {x: -17.32, y: -10, z: 0.1, Y: 240}
"""


@pytest.fixture
def world(here):
    return load_world({"extends": "rough", "spawn": {"pose": [100, 50, 0.2, 0, 0, math.pi / 2]}})


def boats(source, world):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return [boat for boat, _ in load_fleet(source, world).boats_in(world)]


def test_no_fleet_is_one_boat_at_the_spawn_pose(world):
    (boat,) = boats(None, world)
    assert (boat.name, boat.robot, boat.thrusters, boat.engines) == ("wamv", "wamv", "T", "fixed")
    assert boat.pose == world.spawn.pose


@pytest.fixture
def guide(here):
    (here / "usv_config.yaml").write_text(GUIDE, encoding="utf-8")
    return here / "usv_config.yaml"


def test_the_published_file_places_three_boats_and_says_once_what_its_headings_look_like(world, guide):
    with pytest.warns(VrxWarning) as caught:
        fleet = [boat for boat, _ in load_fleet(guide, world).boats_in(world)]
    (text,) = (str(item.message) for item in caught)
    assert text == (
        "fleet usv_config: its headings point outward as compass bearings only, but are read as degrees "
        "counter-clockwise from x; write `headings: compass` for bearings, or `headings: math` to keep this"
    )
    assert [boat.name for boat in fleet] == ["wamv1", "wamv2", "wamv3"]
    assert [boat.pose for boat in fleet] == [
        (0.0, 20.0, 0.1, 0.0, 0.0, 0.0),
        (17.32, -10.0, 0.1, 0.0, 0.0, math.radians(120)),
        (-17.32, -10.0, 0.1, 0.0, 0.0, math.radians(240)),
    ]


@pytest.mark.parametrize(("word", "outward"), [("math", False), ("compass", True)])
def test_headings_say_how_the_published_file_is_read_and_nothing_is_warned_of(word, outward, world, guide):
    guide.write_text(GUIDE + f"headings: {word}\n", encoding="utf-8")
    for x, y, _, _, _, yaw in (boat.pose for boat in boats(guide, world)):
        assert (abs(math.remainder(yaw - math.atan2(y, x), math.tau)) < 1e-3) == outward


def test_a_bearing_is_clockwise_from_north_in_the_origin_s_frame(world):
    source = {"headings": "compass", "positions": [{"x": 9 * i, "y": 0, "Y": Y} for i, Y in enumerate((0, 90, 225))]}
    yaws = [boat.pose[5] for boat in boats(source, world)]
    assert yaws == pytest.approx([math.pi / 2, 0.0, -0.75 * math.pi])
    turned = [boat.pose[5] for boat in boats({**source, "origin": "spawn"}, world)]  # which faces north
    assert turned == pytest.approx([yaw + math.pi / 2 for yaw in yaws])
    (row, *_) = boats({"headings": "compass", "usv_count": 3, "layout": "line", "heading": 30}, world)
    assert row.pose[5] == pytest.approx(math.radians(60))


def test_the_guide_s_ring_is_a_layout_too(world, guide):
    """Its boats are at 90, 330 and 210 degrees: the first of a ring that starts in the north, and the others."""
    ring = {"usv_count": 3, "layout": "circle", "radius": 20, "start_angle": 90, "headings": "compass"}
    guide.write_text(GUIDE + "headings: compass\n", encoding="utf-8")
    first, second, third = (boat.pose for boat in boats(guide, world))
    for pose, given in zip((boat.pose for boat in boats(ring, world)), (first, third, second), strict=True):
        assert pose[:5] == pytest.approx(given[:5], abs=1e-3)
        assert math.remainder(pose[5] - given[5], math.tau) == pytest.approx(0.0, abs=1e-9)


def test_the_file_ships_as_published():
    shipped = (root() / "fleets" / "usv_config.yaml").read_text(encoding="utf-8")
    assert shipped == GUIDE


def test_positions_can_be_relative_to_the_spawn_pose(world):
    first, second = boats({"origin": "spawn", "positions": [{"x": 10, "y": 0}, {"x": 0, "y": 5, "Y": 90}]}, world)
    assert first.pose == pytest.approx((100, 60, 0.1, 0, 0, math.pi / 2))
    assert second.pose == pytest.approx((95, 50, 0.1, 0, 0, math.pi))


def test_positions_can_be_relative_to_a_frame(world):
    (boat,) = boats({"origin": [1, 2, math.pi], "positions": [{"x": 10, "y": 0, "Y": 0}]}, world)
    assert boat.pose == pytest.approx((-9, 2, 0.1, 0, 0, math.pi))


@pytest.mark.parametrize(
    ("fleet", "message"),
    [
        (
            {"positions": [{"x": 0, "y": 1e6, "z": 0, "Y": 0}], "origin": [0, 1, 0]},
            "<fleet>: positions[0]: puts wamv1 at x 0, y 1e+06, z 0 m in the world: at most 1e+06 m are allowed",
        ),
        (
            {"boats": [{"name": "a", "pose": [1e6, 0, 0, 0, 0, 0]}], "origin": [2, 0, 0]},
            "<fleet>: boats[0]: puts a at x 1e+06, y 0, z 0 m in the world: at most 1e+06 m are allowed",
        ),
        (
            {"usv_count": 2, "layout": "circle", "radius": 1e8},
            (
                "<fleet>: puts wamv1 at x 1e+08, y 0, z 0.1 m in the world: at most 1e+06 m are allowed\n"
                "<fleet>: puts wamv2 at x -1e+08, y 1.225e-08, z 0.1 m in the world: at most 1e+06 m are allowed"
            ),
        ),
    ],
)
def test_a_boat_that_its_frame_or_layout_puts_too_far_away_is_refused(fleet, message, world):
    with pytest.raises(ConfigError) as caught:
        load_fleet(fleet, world).boats_in(world)
    assert str(caught.value) == message


def test_a_layout_lies_in_the_frame_of_the_origin(world):
    source = {"usv_count": 3, "layout": "column", "spacing": 8, "origin": [1, 2, math.pi / 2]}
    poses = [boat.pose for boat in boats(source, world)]
    assert poses == [pytest.approx((1, 2 + 8 - 8 * i, 0.1, 0, 0, math.pi / 2)) for i in range(3)]


def test_positions_override_the_layout_s_places_of_the_first_boats(world):
    ring = {"usv_count": 4, "layout": "circle", "radius": 30, "heading": "inward"}
    plain = [boat.pose for boat in boats(ring, world)]
    mixed = [boat.pose for boat in boats({**ring, "positions": [{"x": 1, "y": 2, "z": 3, "Y": 90}]}, world)]
    assert mixed == [(1.0, 2.0, 3.0, 0.0, 0.0, math.pi / 2), *plain[1:]]


def test_random_boats_follow_the_seed_of_the_layout_and_else_the_world_s(world):
    source = {"usv_count": 6, "layout": "random"}
    other = world.model_copy(update={"seed": world.seed + 1})
    here, there = ([boat.pose for boat in boats(source, place)] for place in (world, other))
    assert here == [boat.pose for boat in boats(source, world)] != there
    named = {**source, "seed": other.seed}
    assert [boat.pose for boat in boats(named, world)] == [boat.pose for boat in boats(named, other)] == there


def test_five_hundred_boats_in_one_file_are_a_normal_fleet(world, here):
    rows = "".join(f"  - {{x: {i % 25 * 9}, y: {i // 25 * 9}, Y: {i % 360}}}\n" for i in range(500))
    (here / "many.yaml").write_text(f"usv_count: 500\npositions:\n{rows}", encoding="utf-8")
    many = boats("many.yaml", world)
    assert [boat.name for boat in many] == [f"wamv{i + 1}" for i in range(500)]
    assert many[499].pose == (216.0, 171.0, 0.1, 0.0, 0.0, math.radians(139))


def test_a_boat_has_its_own_controller_or_the_fleet_s(world):
    source = {
        "usv_count": 2,
        "layout": "line",
        "controller": "crew:steady",
        "boats": [{"name": "wamv2", "controller": "crew.fast:Racer"}],
    }
    assert [boat.controller for boat in boats(source, world)] == ["crew:steady", "crew.fast:Racer"]


def test_a_line_is_abreast(world):
    poses = [boat.pose for boat in boats({"usv_count": 3, "layout": "line", "spacing": 4}, world)]
    assert [pose[:2] for pose in poses] == [(0, 4), (0, 0), (0, -4)]


def test_boats_change_by_name_by_place_and_are_added(world):
    source = {
        "thrusters": "H",
        "positions": [{"x": 0, "y": 0}, {"x": 5, "y": 0}, {"x": 9, "y": 0}],
        "boats": [
            {"name": "lead"},
            {"name": "wamv3", "color": "red", "engines": "hinged"},
            {"name": "guard", "pose": [20, 0, 0.1, 0, 0, 1], "thrusters": "T"},
        ],
    }
    lead, plain, red, guard = boats(source, world)
    assert [boat.name for boat in (lead, plain, red, guard)] == ["lead", "wamv2", "wamv3", "guard"]
    assert (red.color, red.engines, red.thrusters) == ((1.0, 0.0, 0.0, 1.0), "hinged", "H")
    assert (guard.thrusters, guard.pose[0], guard.engines) == ("T", 20.0, "fixed")


def test_boats_alone_are_the_fleet(world):
    source = {
        "usv_count": 2,
        "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}, {"name": "b", "pose": [5, 0, 0, 0, 0, 0]}],
    }
    assert [boat.name for boat in boats(source, world)] == ["a", "b"]


def test_a_fleet_that_only_names_thrusters_is_one_boat(world):
    (boat,) = boats({"thrusters": "H"}, world)
    assert (boat.name, boat.thrusters, boat.pose) == ("wamv", "H", world.spawn.pose)


def test_wind_on_nothing_is_an_error(here):
    world = load_world(
        {
            "extends": "rough",
            "wind": {"objects": [{"model": name, "coefficients": [1, 1, 1]} for name in WINDY]},
        }
    )
    with pytest.raises(ConfigError) as caught:
        load_fleet({"positions": [{"x": 0, "y": 0}]}, world)
    assert str(caught.value) == (
        "<world>: wind.objects[4].model: no boat, object, dock or robot named 'wamv2'; did you mean 'wamv'?"
    )


WINDY = ["wamv", "wamv1", "buoy", "ball", "wamv2"]


def test_wind_on_a_part_of_an_object_and_on_its_kind(here):
    """A part by the object's name and its own, and a kind that the object has parts of."""
    (here / "pair.yaml").write_text(
        "objects: [{name: left, model: post, pose: [0, 5, 0, 0, 0, 0]}]\n", encoding="utf-8"
    )
    listed = [{"model": name, "coefficients": [1, 1, 1]} for name in ("gate/left", "post", "gate/right")]
    gate = {"name": "gate", "model": "pair.yaml", "pose": [20, 0, 0, 0, 0, 0]}
    with pytest.raises(ConfigError) as caught:
        load_fleet(None, load_world({"objects": [gate], "wind": {"objects": listed}}))
    assert str(caught.value) == (
        "<world>: wind.objects[2].model: no boat, object, dock or robot named 'gate/right'; "
        "known: gate, gate/left, pair.yaml, post, wamv"
    )


@pytest.fixture(scope="module")
def shipped_worlds():
    """All but those of series, which are many, and in the same places as the others."""
    return [load_world(name) for name in catalogue("worlds") if "/phase2/" not in name and "/practice/" not in name]


@pytest.mark.parametrize("name", sorted(catalogue("fleets")))
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_every_shipped_fleet_fits_every_shipped_world(name, shipped_worlds):
    for world in shipped_worlds:
        assert bool([boat for boat, _ in load_fleet(name, world).boats_in(world)]) == (name != "none"), world.name


def test_single_is_what_a_world_without_a_fleet_sails():
    world = load_world({"extends": "ocean", "spawn": {"robot": "skiff", "pose": [3, 4, 0.2, 0, 0, 1.0]}})
    alone, single = load_fleet(None, world), load_fleet("single", world)
    assert (alone.name, alone.boats_in(world)) == (single.name, single.boats_in(world))


def test_trio_is_the_ring_of_the_guide_ahead_of_the_spawn_pose():
    world = load_world("example_course")
    ring = [boat.pose for boat in boats("trio", world)]
    x0, y0, yaw = world.spawn.pose[0], world.spawn.pose[1], world.spawn.pose[5]
    x, y = x0 + 45 * math.cos(yaw), y0 + 45 * math.sin(yaw)
    assert [math.hypot(pose[0] - x, pose[1] - y) for pose in ring] == pytest.approx([20, 20, 20], abs=1e-3)


def test_the_start_file_of_a_fleet_loads():
    world = load_world("sydney_regatta")
    assert len(boats(root() / "assets" / "start" / "fleet.yaml", world)) == 3


def test_the_spawn_s_sensors_are_for_boats_of_its_own_robot(here):
    world = load_world({"extends": "rough", "spawn": {"sensors": "none"}})
    assert [boat.sensors for boat in boats({"usv_count": 2, "layout": "line"}, world)] == [("none",)] * 2
    (here / "raft.urdf").write_text('<robot name="raft"><link name="hull"/></robot>', encoding="utf-8")
    assert boats({"usv_count": 1, "layout": "line", "robot": "raft.urdf"}, world)[0].sensors is None


def test_bearings_all_around_that_are_read_as_angles_are_warned_of(world):
    """North, east, south and west of a point, each looking away from it by compass."""
    spots = [(0, 20, 0), (20, 0, 90), (0, -20, 180), (-20, 0, 270)]
    fleet = {"positions": [{"x": x, "y": y, "Y": bearing} for x, y, bearing in spots], "origin": "spawn"}
    with pytest.warns(VrxWarning, match="compass"):
        load_fleet(fleet, world)
    boats({**fleet, "headings": "compass"}, world)


RADIANS = {
    "usv_count": 3,
    "positions": [{"x": 0, "y": 20}, {"x": 17, "y": -10, "Y": 2.0944}, {"x": -17, "y": -10, "Y": 4.2}],
}
READ = "is read as degrees, unlike the radians of poses"
KEEP = "or `headings: math` to keep this"


@pytest.mark.parametrize(("fleet", "said"), [
    (RADIANS, f"positions[1].Y 2.0944 {READ}; write 120 for 2.0944 rad, {KEEP}"),
    ({"usv_count": 2, "layout": "line", "heading": -1.57},
     f"heading -1.57 {READ}; write -89.9544 for -1.57 rad, {KEEP}"),
    ({"usv_count": 2, "layout": "circle", "start_angle": 1},
     f"start_angle 1 {READ}; write 57.2958 for 1 rad, {KEEP}"),
])  # fmt: skip
def test_degrees_that_look_like_radians_are_warned_of_once(fleet, said):
    with pytest.warns(VrxWarning) as caught:
        load_fleet(fleet, load_world("ocean"))
    assert [str(item.message) for item in caught] == [f"fleet fleet: {said}"]


@pytest.mark.parametrize("fleet", [
    {**RADIANS, "headings": "math"},
    {"positions": [{"x": 0, "y": 20, "Y": 2}, {"x": 20, "y": 0, "Y": 170}]},
    {"usv_count": 2, "layout": "line", "heading": 6.3},
    {"usv_count": 2, "layout": "line", "heading": 0},
    {"usv_count": 2, "layout": "line", "heading": "inward"},
])  # fmt: skip
def test_other_degrees_are_not(fleet):
    load_fleet(fleet, load_world("ocean"))


def test_the_guide_s_headings_are_degrees():
    with pytest.warns(VrxWarning) as caught:
        load_fleet("usv_config", load_world("ocean"))
    assert len(caught) == 1
    assert "bearings" in str(caught[0].message)
