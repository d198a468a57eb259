"""Worlds: defaults, `extends`, references, and what a warning says."""

import math
import pickle
import re
import warnings

import pytest
import yaml

from vrx_mj.config import world as world_module
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import Georeference, SeaConfig, SkyConfig, load_world
from vrx_mj.errors import ConfigError, UnknownNameError, VrxWarning
from vrx_mj.packages import root


def write(folder, name, text):
    file = folder / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def test_the_sea_has_the_defaults_of_ocean_waves():
    sea = SeaConfig()
    assert (sea.model, sea.number, sea.scale, sea.angle, sea.steepness) == ("pms", 3, 1.5, 0.4, 0.0)
    assert (sea.gain, sea.amplitude, sea.period, sea.direction, sea.tau) == (0.1, 0.0, 5.0, (1.0, 0.0), 2.0)


def test_the_world_of_the_design_loads(here, ours):
    world = load_world(
        {
            "extends": "rough",
            "physics": {"profile": "vrx", "timestep": 0.01},
            "sea": {
                "model": "pms",
                "gain": 0.2,
                "period": 7.0,
                "direction": [1.0, 0.0],
                "angle": 0.4,
                "scale": 2.5,
            },
            "wind": {
                "direction": 120,
                "mean_velocity": 5.0,
                "objects": [{"model": "wamv", "coefficients": [1, 1, 1]}],
            },
            "scene": {
                "ambient": [0.3, 0.3, 0.3],
                "fog": {"type": "linear", "color": [1, 1, 1], "start": 1, "end": 100},
            },
            "objects": [{"name": "light_buoy", "model": "ball", "pose": [-511, 218, 0.25, 0, 0, 3.14]}],
            "docks": [{"name": "dock_my", "pose": [-540, 190, 0, 0, 0, 0.3], "layout": "X  X\nXXXX\n"}],
            "task": {"type": "stationkeeping", "goal": [-33.722718, 150.674031, 0.0]},
        }
    )
    assert [thing.name for thing in world.objects] == ["buoy", "light_buoy"]
    assert world.sea.scale == 2.5
    assert world.scene.ambient == (0.3, 0.3, 0.3, 1.0)
    assert world.task.goal == (-33.722718, 150.674031, 0.0)


@pytest.mark.usefixtures("ours")
def test_extends_merges_mappings_key_by_key_and_appends_objects(here):
    file = write(
        here,
        "mine.yaml",
        "extends: rough\nsea: {gain: 0.1}\nscene: {fog: {end: 60}}\nwind: null\n"
        "objects:\n  - {name: more, model: ball}\n",
    )
    world = load_world(file)
    assert (world.name, world.description) == ("mine", "")
    assert (world.sea.gain, world.sea.period) == (0.1, 6.0)
    assert (world.scene.fog.type, world.scene.fog.end) == ("linear", 60.0)
    assert world.wind is None
    assert [thing.name for thing in world.objects] == ["buoy", "more"]


@pytest.mark.usefixtures("ours")
def test_a_list_other_than_objects_and_docks_replaces_that_of_the_base(here):
    world = load_world({"extends": "rough", "wind": {"objects": [{"model": "buoy", "coefficients": [1, 2, 3]}]}})
    assert [(thing.model, thing.coefficients) for thing in world.wind.objects] == [("buoy", (1.0, 2.0, 3.0))]


def test_things_of_a_base_keep_the_folder_of_its_file(here, ours):
    write(here, "mine.yaml", "extends: ./base/base.yaml\nobjects: [{name: two, model: ./two.yaml}]\n")
    write(here, "base/base.yaml", "objects: [{name: one, model: ./one.yaml}]\n")
    ball = (ours / "assets/objects/ball.yaml").read_text(encoding="utf-8")
    write(here, "base/one.yaml", ball)
    write(here, "two.yaml", ball)
    one, two = load_world("mine").objects
    assert (one.folder, two.folder) == (here / "base", here)


@pytest.mark.usefixtures("ours")
def test_a_world_may_extend_ours_of_its_own_name(here):
    write(here, "rough.yaml", "extends: rough\nsea: {gain: 0.3}\n")
    world = load_world("rough")
    assert (world.sea.gain, world.sea.period) == (0.3, 6.0)


@pytest.mark.usefixtures("ours")
@pytest.mark.parametrize("text", ["objects:\ndocks:\nsea:\nscene:\n", "objects: []\nwind: null\n"])
def test_sections_may_be_empty(text, here):
    world = load_world(write(here, "w.yaml", text))
    assert (world.objects, world.sea) == ((), SeaConfig())


@pytest.mark.usefixtures("ours")
def test_numbers_and_switches_as_people_write_them(here):
    text = "sea: {gain: 1e-3, period: 5}\nscene: {grid: on, shadows: no, sky: yes}\nphysics: {timestep: 2E-3}\n"
    world = load_world(write(here, "w.yaml", text))
    assert (world.sea.gain, world.sea.period, world.physics.timestep) == (0.001, 5.0, 0.002)
    assert (world.scene.grid, world.scene.shadows, world.scene.sky) == (True, False, True)


@pytest.mark.usefixtures("ours")
def test_the_sky_takes_sdf_keys(here):
    world = load_world({"scene": {"sky": {"time": 10, "clouds": {"speed": 12}}, "background": "light_grey"}})
    assert isinstance(world.scene.sky, SkyConfig)
    assert world.scene.sky.clouds.speed == 12.0
    assert world.scene.background == (0.75, 0.75, 0.75, 1.0)


@pytest.mark.usefixtures("ours")
def test_a_dict_may_hold_numpy_values(here):
    import numpy as np

    world = load_world({"seed": np.int64(3), "sea": {"gain": np.float32(0.5), "direction": np.array([0.0, 1.0])}})
    assert (world.seed, world.sea.gain, world.sea.direction) == (3, 0.5, (0.0, 1.0))


@pytest.mark.usefixtures("ours")
def test_a_dict_inside_itself_is_an_error(here):
    source = {}
    source["sea"] = source
    with pytest.raises(ConfigError) as caught:
        load_world(source)
    assert str(caught.value) == "<world>: nested too deeply, or inside itself"


@pytest.mark.usefixtures("ours")
def test_an_unknown_world_names_the_nearest(here):
    with pytest.raises(UnknownNameError) as caught:
        load_world("rouhg")
    assert str(caught.value) == "no world named 'rouhg'; did you mean 'rough'?"


@pytest.mark.usefixtures("ours")
@pytest.mark.parametrize(
    ("source", "reason"),
    [("no/such.yaml", "no such file; there is no folder 'no'"), ("a.yaml", "a folder, not a file")],
)
def test_a_path_without_a_file_is_an_error(source, reason, here):
    (here / "a.yaml").mkdir()
    with pytest.raises(ConfigError) as caught:
        load_world(source)
    assert str(caught.value) == f"{source}: {reason}"


@pytest.mark.usefixtures("ours")
def test_an_angle_over_a_turn_gives_one_warning(here):
    objects = [{"name": name, "model": "ball", "pose": [0, 0, 0, 0, 0, 90]} for name in ("a", "b")]
    with pytest.warns(VrxWarning) as caught:
        load_world({"objects": objects})
    assert [str(item.message) for item in caught] == [
        "world world: angle 90 of 'a' exceeds a full turn, 6.2832; poses are in radians"
    ]


@pytest.mark.usefixtures("ours")
def test_models_are_frozen_and_leave_folders_out_of_dumps(here):
    world = load_world("rough")
    with pytest.raises(ValueError, match="frozen"):
        world.seed = 3
    assert "folder" not in str(world.model_dump())
    assert pickle.loads(pickle.dumps(world)) == world


def test_a_georeference_maps_to_the_world_frame():
    sydney = Georeference(latitude=-33.724223, longitude=150.679736)
    # reference values of VRX's stationkeeping goal, from WGS84 to a tangent plane
    x, y, _ = sydney.to_enu(-33.722702498, 150.67402097002)
    assert (round(x, 2), round(y, 2)) == (-529.69, 168.64)


def test_a_heading_turns_the_world_frame():
    plain = Georeference(latitude=10, longitude=20)
    turned = Georeference(latitude=10, longitude=20, heading=90)
    (east, north, _), (x, y, _) = (place.to_enu(10.001, 20.002) for place in (plain, turned))
    assert (x, y) == pytest.approx((north, -east), abs=1e-9)


@pytest.mark.parametrize("folder", sorted({name.rpartition("/")[0] for name in catalogue("worlds")}))
def test_every_shipped_world_loads_without_a_word_and_names_its_profile(folder):
    for name in (name for name in catalogue("worlds") if name.rpartition("/")[0] == folder):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            world = load_world(name)
        assert all(math.isfinite(value) for value in world.spawn.pose), name
        assert "profile" in world.physics.model_fields_set, name
        assert world.physics.profile == ("vrx3" if name.startswith(("vrx2023/", "base/")) else "vrx"), name


def test_a_world_without_a_profile_gets_marine_and_a_process_one_notice(monkeypatch):
    """Worlds that name one, and worlds of Gazebo, are none of those."""
    monkeypatch.setattr(world_module, "_NOTICED", [])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_world({"name": "pool", "physics": {"profile": "vrx"}})
        load_world("ocean")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        plain = load_world({"name": "bay", "physics": {"timestep": 0.005}})
        load_world({"name": "lake"})
    (notice,) = caught
    assert str(notice.message) == (
        "world bay: without `physics: profile`, marine is the default, which was vrx in version 0.1; write "
        "`physics: {profile: vrx}` to keep that"
    )
    assert notice.category is VrxWarning
    assert (plain.physics.profile, plain.physics.gravity, plain.physics.at_base_link) == ("marine", 9.80665, ())
    assert plain.physics == load_world({"physics": {"profile": "marine", "timestep": 0.005}}).physics
    assert load_world({}).physics == load_world({"physics": {"profile": "marine"}}).physics


def test_the_start_file_of_a_world_loads():
    file = root() / "assets" / "start" / "world.yaml"
    world = load_world(file)
    assert (world.objects[-1].name, world.physics.profile, world.sea.model) == ("green_buoy", "marine", "jonswap")
    beside = re.search(r"^# (sea: .*)$", file.read_text(encoding="utf-8"), re.M)
    classic = load_world({"extends": "sydney_regatta", **yaml.safe_load(beside[1])}).sea
    height = 0.0503 * classic.gain * classic.period**2  # of three waves at scale 2.5: docs/physics.md
    assert (classic.scale, height) == (2.5, pytest.approx(world.sea.significant_height, abs=0.005))


@pytest.mark.parametrize(("sea", "text"), [
    ({"model": "cwr"}, "its cwr sea is flat: sea.amplitude is 0"),
    ({"depth": 5}, "a pms sea has the waves of deep water; sea.depth only affects echo sounders"),
    ({"sea_state": 2}, "its sea is jonswap: `pms` has no significant height; write `model: jonswap`"),
])  # fmt: skip
def test_a_sea_that_may_be_meant_otherwise_is_warned_of(sea, text):
    with pytest.warns(VrxWarning) as caught:
        load_world({"sea": sea})
    assert [str(item.message) for item in caught] == [f"world world: {text}"]


def test_a_sea_with_an_amplitude_and_fog_without_keys_are_not():
    load_world({"sea": {"model": "cwr", "amplitude": 0.3}, "scene": {"fog": {}}})


def test_an_empty_section_has_the_values_of_the_world_s_profile():
    assert load_world({"physics": None}).physics.gravity == 9.80665
    assert load_world({"physics": {"profile": "vrx3"}, "sea": None}).sea.scale == 1.1
    with pytest.raises(ConfigError, match="seed: expected a whole number, got nothing"):
        load_world({"seed": None})
