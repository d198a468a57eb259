"""A robot of one's own in worlds and fleets that extend others: its thrusters and sensors, and where its files are."""

import re
import warnings
from pathlib import Path

import pytest
import yaml

from urdf_boats import BOX, link, robot
from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.simulation import Simulation

MESSAGE = "not allowed for robot ./mine.urdf, whose own files place its thrusters; remove it"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """A folder with a boat, and a folder in it with another."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "below").mkdir()
    for file, mass in (("mine.urdf", 100), ("below/mine.urdf", 200)):
        write(file, robot(hull=link("base_link", mass=mass, shapes=BOX)))
    return tmp_path


def write(file, text):
    Path(file).write_text(text, encoding="utf-8")
    return file


def error(load):
    with pytest.raises(ConfigError) as raised:
        load()
    return str(raised.value)


def quiet(make):
    """What it makes; the boat's other lacks are warned of elsewhere."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return make()


@pytest.mark.parametrize("base", [name for name in catalogue("worlds") if "/" not in name])
def test_every_world_takes_another_robot(base):
    world = load_world(write("w.yaml", f"extends: {base}\nspawn: {{robot: ./mine.urdf}}\n"))
    ((boat, _),) = load_fleet(None, world).boats_in(world)
    assert (boat.robot, boat.thrusters, boat.sensors) == ("./mine.urdf", None, None)


def test_what_the_file_itself_says_of_its_robot_counts():
    text = "extends: sydney_regatta\nspawn: {robot: cora, sensors: none}\n"
    spawn = load_world(write("w.yaml", text)).spawn
    assert (spawn.robot, spawn.sensors) == ("cora", ("none",))
    text = "extends: perception_task\nspawn: {robot: wamv}\n"
    assert load_world(write("w.yaml", text)).spawn.thrusters == "H"


def test_a_path_starts_in_the_folder_of_the_file_that_says_it(here):
    write("below/base.yaml", "extends: ocean\nspawn: {robot: ./mine.urdf}\n")
    world = load_world(write("w.yaml", "extends: ./below/base.yaml\nspawn: {pose: [1, 2, 0, 0, 0, 0]}\n"))
    assert (world.spawn.pose[0], world.spawn.folder) == (1.0, here / "below")
    assert next(boat for boat, _ in load_fleet(None, world).boats_in(world)).order.folder == here / "below"


def test_so_do_the_paths_of_a_fleet(here):
    write("below/thrusters.yaml", "engine: [{prefix: left, position: '-2 1 0'}]\n")
    write("below/base.yaml", "usv_count: 2\nlayout: line\nrobot: wamv\nthrusters: ./thrusters.yaml\n")
    fleet = load_fleet(write("f.yaml", "extends: ./below/base.yaml\nspacing: 30\n"), load_world("ocean"))
    assert {boat.order.thrusters for boat, _ in fleet.boats_in(load_world("ocean"))} == {
        here / "below/./thrusters.yaml"
    }
    fleet = load_fleet(write("f.yaml", "extends: ./below/base.yaml\nrobot: ./mine.urdf\n"), load_world("ocean"))
    boats = [boat for boat, _ in fleet.boats_in(load_world("ocean"))]
    assert {(boat.order.folder, boat.order.thrusters, boat.thrusters) for boat in boats} == {(here, None, None)}


@pytest.mark.parametrize("place", ["/", "../"])
def test_a_dict_of_python_names_files_anywhere_which_a_file_may_not(here, monkeypatch, place):
    base = write(here / "ocean.yaml", "extends: ocean\n")
    (here / "work").mkdir()
    monkeypatch.chdir(here / "work")
    place = f"{here}/" if place == "/" else place
    world = load_world({"extends": f"{place}ocean.yaml", "spawn": {"robot": f"{place}mine.urdf"}})
    given = {"usv_count": 1, "layout": "line", "robot": f"{place}below/mine.urdf"}
    assert [boat.robot for boat, _ in load_fleet(given, world).boats_in(world)] == [given["robot"]]
    sim = Simulation(quiet(lambda: compile_world({"extends": str(base)}, fleet=given)))
    quiet(lambda: sim.spawn("late", robot=f"{place}mine.urdf", pose=(30.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    assert [sim.model.body(f"{name}/base_link").mass[0] for name in sim.boats] == [200.0, 100.0]
    wrong = error(lambda: load_fleet({**given, "robot": f"{place}mine.yaml"}, world))
    assert re.fullmatch(
        rf"<fleet>: robot: no file '\S+mine.yaml'{' in the current folder' if place == '../' else ''}", wrong
    )
    assert "leaves the folder of the file that names it; add its folder with --allow" in error(
        lambda: load_fleet(write("f.yaml", yaml.safe_dump(given)), world)
    )


@pytest.mark.parametrize("beside", [False, True])
def test_a_description_that_is_a_link_out_of_its_folder_is_refused(here, beside):
    (here / "away").mkdir()
    (here / "away" / "boat.urdf").write_text(robot(link("base_link", BOX)), encoding="utf-8")
    (here / "fleet").mkdir()
    (here / "fleet" / "boat.urdf").symlink_to(here / "away" / "boat.urdf")
    if beside:
        (here / "fleet" / "boat.yaml").write_text("wind: [1, 1, 1]\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"^the YAML of boat\.urdf: urdf: path 'boat\.urdf' leaves the folder"):
        load_robot("./fleet/boat.urdf")


def test_a_terrain_too(here):
    (here / "below/terrain").mkdir()
    write("below/terrain/pond.json", '{"rings": []}')
    write("below/base.yaml", "terrain: pond\n")
    assert load_world(write("w.yaml", "extends: ./below/base.yaml\n")).folder == here / "below"


def test_layouts_are_not_for_a_robot_that_brings_its_thrusters():
    write("w.yaml", "extends: ocean\nspawn: {robot: ./mine.urdf, thrusters: T}\n")
    assert error(lambda: load_world("w.yaml")) == f"w.yaml:2:40: spawn.thrusters: {MESSAGE}"
    write("f.yaml", "usv_count: 2\nlayout: line\nthrusters: T\nboats: [{robot: ./mine.urdf}]\n")
    ours = error(lambda: load_fleet("f.yaml", load_world("ocean")))
    assert ours == f"f.yaml:4:9: boats[0].thrusters: {MESSAGE}"


def test_sensors_that_the_robot_does_not_have_are_an_error_where_they_are_asked_for():
    write("w.yaml", "extends: ocean\nspawn: {robot: skiff, sensors: [gps, lidar]}\n")
    text = "w.yaml:2:32: spawn.sensors: no sensor named 'lidar'; known: gps, imu, bow_camera"
    assert error(lambda: quiet(lambda: compile_world("w.yaml"))) == text


def test_vrx_s_sensors_beside_an_own_file_are_warned_of():
    write("w.yaml", "extends: ocean\nspawn: {robot: ./mine.urdf, sensors: vrx}\n")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        compile_world("w.yaml")
    notes = str(caught[0].message).splitlines()
    assert notes[0] == "robot ./mine.urdf:"
    assert notes[-1] == "`sensors: vrx` adds no sensors: its own files define them, none"
