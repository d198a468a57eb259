"""Fleets: who sails, from where, and what is refused or warned of."""

import math
import warnings

import pytest

from vrx_mj.config.fleet_checks import load_fleet
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.resources import root

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
        return load_fleet(source, world).resolve(world)


def test_no_fleet_is_one_boat_at_the_spawn_pose(world):
    (boat,) = boats(None, world)
    assert (boat.name, boat.robot, boat.thrusters, boat.engines) == ("wamv", "wamv", "T", "fixed")
    assert boat.pose == world.spawn.pose


def test_the_published_file_places_three_boats(world, here):
    (here / "usv_config.yaml").write_text(GUIDE, encoding="utf-8")
    fleet = boats("usv_config.yaml", world)
    assert [boat.name for boat in fleet] == ["wamv1", "wamv2", "wamv3"]
    assert fleet[1].pose == (17.32, -10.0, 0.1, 0.0, 0.0, math.radians(120))


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


def test_a_circle_is_sailed_clockwise(world):
    for boat in boats({"usv_count": 5, "layout": "circle", "radius": 7}, world):
        x, y, *_, yaw = boat.pose
        assert math.hypot(x, y) == pytest.approx(7)
        assert (math.cos(yaw), math.sin(yaw)) == pytest.approx((y / 7, -x / 7))


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


def test_a_hundred_boats_on_top_of_each_other_are_one_problem_each(world):
    with pytest.raises(ConfigError) as caught:
        load_fleet({"positions": [{"x": 0.001 * i, "y": 0} for i in range(100)]}, world)
    assert len(caught.value.problems) == 99
    assert str(caught.value).splitlines()[-1] == "and 59 more problems"


def test_a_fleet_far_from_everything_gives_one_warning(world):
    with pytest.warns(VrxWarning) as caught:
        load_fleet({"positions": [{"x": 500, "y": 0}, {"x": 600, "y": 0}]}, world)
    assert [str(item.message) for item in caught] == [
        (
            "fleet fleet: 403 m from the spawn pose, the nearest thing in world world; over 300 m; "
            "`origin: spawn` puts it around the spawn pose"
        )
    ]


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
        "world world: wind.objects[4].model: no boat, object, dock or robot named 'wamv2'; did you mean 'wamv'?"
    )


WINDY = ["wamv", "wamv1", "buoy", "ball", "wamv2"]


@pytest.mark.parametrize("name", sorted(catalogue("fleets")))
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_every_shipped_fleet_fits_every_shipped_world(name):
    for place in catalogue("worlds"):
        if "/phase2/" in place or "/practice/" in place:  # many, and in the same places as the others
            continue
        world = load_world(place)
        assert load_fleet(name, world).resolve(world)


def test_trio_is_the_ring_of_the_guide_ahead_of_the_spawn_pose():
    world = load_world("example_course")
    ring = [boat.pose for boat in boats("trio", world)]
    x0, y0, yaw = world.spawn.pose[0], world.spawn.pose[1], world.spawn.pose[5]
    x, y = x0 + 45 * math.cos(yaw), y0 + 45 * math.sin(yaw)
    assert [math.hypot(pose[0] - x, pose[1] - y) for pose in ring] == pytest.approx([20, 20, 20], abs=1e-3)


def test_the_start_file_of_a_fleet_loads():
    world = load_world("sydney_regatta")
    assert len(boats(root() / "assets" / "start" / "fleet.yaml", world)) == 3
