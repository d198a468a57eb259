"""What the wind pushes: what the world lists, boats whose robot has coefficients, or nothing."""

import warnings

import numpy as np
import pytest

import vrx_mj
from urdf_boats import BOX, link, robot
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import catalogue
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.world import PhysicsConfig
from vrx_mj.errors import VrxWarning
from vrx_mj.mjcf.parameters import boat_wind, newcomer_wind
from vrx_mj.model.world import tree_of

WAMV = (0.5, 0.5, 0.33)
"""Coefficients that VRX's worlds list for the WAM-V."""
ABEAM = {"direction": 90, "mean_velocity": 8}
ALONE = {"boats": [{"name": "a", "pose": [0, 0, -0.1, 0, 0, 0]}], "sensors": "none", "thrusters": "H"}
BUOY = {"model": "mb_marker_buoy_red", "coefficients": [1, 1, 1]}


def force(wind, fleet=ALONE, **world):
    """Force of the wind [N] on the fleet's first boat at the start."""
    calm = {"extends": "ocean", "sea": {"model": "none"}, **world}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(calm if wind is None else {**calm, "wind": wind}, fleet=fleet))
    return sim.forces(sim.boats[0])["wind"][:3]


def test_a_wind_without_a_list_pushes_boats_by_their_robots_coefficients():
    """8 m/s from abeam, 0.5 N s2/m2: 32 N; the skiff has 0.4 N s2/m2."""
    assert force(ABEAM) == pytest.approx([0.0, 32.0, 0.0])
    assert force(ABEAM, {"boats": ALONE["boats"], "robot": "skiff"}) == pytest.approx([0.0, 25.6, 0.0])


def test_a_list_has_the_first_word_and_an_empty_one_the_last():
    listed = [{"model": "wamv", "coefficients": [1, 0.25, 0]}]
    assert force({**ABEAM, "objects": listed}) == pytest.approx([0.0, 16.0, 0.0])
    objects = [{"name": "buoy", "model": BUOY["model"], "pose": [30, 0, 0, 0, 0, 0]}]
    assert force({**ABEAM, "objects": [BUOY]}, objects=objects) == pytest.approx([0.0, 32.0, 0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not force({**ABEAM, "objects": []}).any()


@pytest.mark.parametrize(("profile", "wind", "expected"), [
    ("vrx", None, WAMV), ("vrx3", None, (0, 0, 0)), ("vrx", {}, WAMV), ("vrx3", {}, WAMV),
    ("vrx3", {"objects": [BUOY]}, WAMV), ("vrx3", {"objects": ()}, (0, 0, 0)),
])  # fmt: skip
def test_still_air_is_no_drag_in_a_world_without_wind(profile, wind, expected):
    """The wind of vrx3 is the apparent one, that of vrx the true one; who joins later is pushed as the others."""
    physics, config = PhysicsConfig(profile=profile), None if wind is None else WindConfig.model_validate(wind)
    assert boat_wind(config, physics, "a", "wamv", WAMV) == expected
    later = WindConfig.model_validate({"objects": tree_of(newcomer_wind(config, physics))})
    assert boat_wind(later, physics, "a", "wamv", WAMV) == expected


def test_all_robots_that_come_with_it_have_coefficients():
    assert [name for name in catalogue("robots") if not load_robot(name).wind] == []


@pytest.fixture
def plank(tmp_path, monkeypatch):
    """A fleet of four boats of a robot without coefficients."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plank.urdf").write_text(robot(hull=link("base_link", mass=100, shapes=BOX)), encoding="utf-8")
    return {"usv_count": 4, "layout": "line", "spacing": 20, "robot": "plank.urdf"}


def messages(make):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made = make()
    return made, [str(item.message) for item in caught if "wind" in str(item.message)]


LACK = (
    "no wind coefficients for robot plank.urdf; write `wind: [x, y, yaw]` in the robot's YAML, or list it in "
    "`wind.objects`, Gazebo's <wind_obj>"
)


def test_a_wind_that_passes_boats_by_is_warned_of(plank):
    world, told = messages(lambda: vrx_mj.compile_world({"extends": "ocean", "wind": ABEAM}, fleet=plank))
    assert told == [f"world world: the wind does not push wamv1, wamv2, wamv3, 1 more: {LACK}"]
    sim = vrx_mj.Simulation(world)
    late = {"pose": [0, 90, 0, 0, 0, 0], "robot": "plank.urdf"}
    assert messages(lambda: sim.spawn("late", **late))[1] == [f"world world: the wind does not push late: {LACK}"]


@pytest.mark.parametrize("wind", [
    None, {"mean_velocity": 0}, {**ABEAM, "objects": []},
    {**ABEAM, "objects": [{"model": "plank.urdf", "coefficients": [0, 0, 0]}]},
])  # fmt: skip
def test_no_warning_of_what_is_meant(plank, wind):
    world = {"extends": "ocean"} if wind is None else {"extends": "ocean", "wind": wind}
    assert messages(lambda: vrx_mj.compile_world(world, fleet=plank))[1] == []


def test_wind_on_what_cannot_move_is_warned_of():
    """A static object, a fixed dock, and a course of things that float under names of their own."""
    names = {"post": "post", "course": "short_navigation_course0", "buoy": "mb_marker_buoy_red"}
    objects = [
        {"name": name, "model": model, "pose": [30 * i, 60, 0, 0, 0, 0]}
        for i, (name, model) in enumerate(names.items())
    ]
    dock = {"name": "dock", "pose": [0, -60, 0, 0, 0, 0], "layout": "X X\nXXX"}
    listed = [*names, "dock", "cora", "wamv", "mb_marker_buoy_red"]
    wind = {**ABEAM, "objects": [{"model": name, "coefficients": [1, 1, 1]} for name in listed]}
    world = {"extends": "ocean", "objects": objects, "docks": [dock], "wind": wind}
    advice = "list boats, objects that float, and docks with `dynamic: true`"
    assert messages(lambda: vrx_mj.compile_world(world, fleet=ALONE))[1] == [
        f"world world: wind.objects has no effect on post, course, dock; {advice}"
    ]


def test_a_batch_says_which_parameters_change_nothing():
    still = {"extends": "ocean", "sea": {"model": "none"}, "wind": {"objects": []}, "spawn": {"sensors": "none"}}
    batch = vrx_mj.Batch(vrx_mj.compile_world(still), 2)
    advice = "give it `wind` with `objects`, or its robot `wind`"
    with pytest.warns(VrxWarning) as caught:
        batch.vary(wind_speed=[3.0, 0.0], gusts=1.0, waves=np.ones(2))
    assert [str(item.message) for item in caught] == [
        f"no effect of wind_speed and gusts: the wind pushes nothing in world world; {advice}",
        "no effect of waves: the sea of world world has none",
    ]
    batch.vary(wind_speed=0.0, waves=0.0, mass=1.1)
