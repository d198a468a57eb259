"""What is said of files of Gazebo and ROS, and of VRX's names, where one of ours is needed."""

import pickle

import pytest

from vrx_mj.config.base import keys_of
from vrx_mj.config.fleet import FleetConfig
from vrx_mj.config.fleet_checks import load_fleet
from vrx_mj.config.objects import ObjectConfig
from vrx_mj.config.robots import RobotConfig
from vrx_mj.config.search import FORMATS, KINDS, LAUNCHED, MARKS, NEEDS, PLACES, catalogue
from vrx_mj.config.world import WorldConfig, load_world
from vrx_mj.errors import UnknownNameError, VrxError

SDF = '<?xml version="1.0"?>\n<sdf version="1.6"><world name="mine"/></sdf>\n'
WORLD = (
    "which is not read: a world is a YAML file. VRX's own come with vrx_mj (vrx-mj list worlds); docs/vrx.md shows how "
    "to write others"
)


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def message(load):
    with pytest.raises(VrxError) as raised:
        load()
    return str(raised.value)


@pytest.mark.parametrize(("file", "text", "what"), [
    ("./my.world", SDF, "a world of Gazebo (SDF)"),
    ("my.world.xacro", SDF, "a world of Gazebo (SDF in xacro)"),
    ("my.sdf", SDF, "SDF of Gazebo"),
    ("my.xml", SDF, "SDF of Gazebo"),
    ("scene.xml", "<mujoco/>", "MJCF of MuJoCo"),
    ("other.xml", "<x/>", "XML"),
    ("start.launch", "<launch/>", "a launch file of ROS"),
    ("start.launch.py", "", "a launch file of ROS"),
    ("boat.urdf", "<robot/>", "the description of a robot (URDF)"),
    ("boat.urdf.xacro", "<robot/>", "a description in xacro"),
    ("my_bay", "sea: {gain: 1}", "a file that does not end in .yaml"),
])  # fmt: skip
def test_a_file_that_is_no_world_is_called_by_its_format(here, file, text, what):
    (here / file).write_text(text, encoding="utf-8")
    assert message(lambda: load_world(file)) == f"'{file}' is {what}, {WORLD}"
    (here / "mine.yaml").write_text(f"extends: {file}\n", encoding="utf-8")
    assert message(lambda: load_world("mine.yaml")) == f"mine.yaml:1:10: extends: '{file}' is {what}, {WORLD}"


def test_a_file_that_is_no_fleet_object_robot_or_dock(here):
    (here / "my.sdf").write_text(SDF, encoding="utf-8")
    lines = (
        "spawn: {robot: ./my.sdf}",
        "objects: [{name: a, model: ./my.sdf}]",
        "docks: [{name: b, layout: ./my.sdf}]",
    )
    (here / "mine.yaml").write_text("\n".join(lines), encoding="utf-8")
    what = "'./my.sdf' is SDF of Gazebo, which is not read"
    assert message(lambda: load_world("mine.yaml")).splitlines() == [
        f"mine.yaml:1:16: spawn.robot: {what}: {NEEDS['robots']}",
        f"mine.yaml:2:28: objects[0].model: {what}: {NEEDS['objects']}",
        f"mine.yaml:3:27: docks[0].layout: {what}: {NEEDS['docks']}",
    ]
    assert message(lambda: load_fleet("./my.sdf", load_world("ocean"))) == f"{what}: {NEEDS['fleets']}"
    assert NEEDS.keys() == KINDS.keys()


def test_a_file_of_another_kind_is_called_by_its_kind(here):
    (here / "fleet.yaml").write_text("usv_count: 2\nlayout: line\nsensors: none\n", encoding="utf-8")
    (here / "world.yaml").write_text("extends: ocean\nsea: {gain: 0.2}\n", encoding="utf-8")
    text = "fleet.yaml: the file of a fleet, which commands take with --fleet: it has the key 'layout'"
    assert message(lambda: load_world("fleet.yaml")) == text
    text = "world.yaml: the file of a world, which commands take as WORLD: it has the key 'sea'"
    assert message(lambda: load_fleet("world.yaml", load_world("ocean"))) == text


def test_the_keys_that_tell_a_kind_are_of_one_kind_alone():
    models = {"worlds": WorldConfig, "fleets": FleetConfig, "objects": ObjectConfig, "robots": RobotConfig}
    for kind, marks in MARKS.items():
        assert marks <= set(keys_of(models[kind]))
        assert [name for name, model in models.items() if name != kind and marks & set(keys_of(model))] == []


def test_xml_in_a_yaml_file_is_called_xml(here):
    (here / "mine.yaml").write_text(SDF, encoding="utf-8")
    assert message(lambda: load_world("mine.yaml")) == "mine.yaml:1:1: XML; expected YAML, keys and values"


@pytest.mark.parametrize(("name", "advice"), [
    ("sandisland.launch", "VRX's sandisland.launch opens 'vrx2019/example_course'"),
    ("sandisland", "VRX's sandisland.launch opens 'vrx2019/example_course', its sandisland.world is 'sand_island'"),
    ("sandisland.world", "VRX's sandisland.world is 'sand_island'"),
    ("vrx.launch", "VRX's vrx.launch opens 'example_course'"),
    ("station_keeping", "VRX's station_keeping.launch opens 'stationkeeping_task'"),
    ("wildlife_task.world", "VRX's wildlife_task.world is 'wildlife_task'"),
    ("competition.launch.py", "VRX's competition.launch.py opens 'vrx2023/sydney_regatta'"),
    ("nbpark", "VRX's nbpark.world is 'vrx2023/nbpark'"),
    ("oceon", "did you mean 'ocean'?"),
])  # fmt: skip
def test_names_of_vrx_lead_to_ours(name, advice):
    with pytest.raises(UnknownNameError) as raised:
        load_world(name)
    assert str(raised.value) == f"no world named '{name}'; {advice}"
    assert str(pickle.loads(pickle.dumps(raised.value))) == str(raised.value)


def test_files_of_vrx_lead_to_ours_whether_they_are_there_or_not(here):
    ours = "VRX's sandisland.world.xacro is 'sand_island'"
    missing = message(lambda: load_world("sandisland.world.xacro"))
    assert missing == f"sandisland.world.xacro: no such file; {ours}"
    (here / "sandisland.world.xacro").write_text(SDF, encoding="utf-8")
    there = message(lambda: load_world("sandisland.world.xacro"))
    assert there == f"'sandisland.world.xacro' is a world of Gazebo (SDF in xacro), which is not read: {ours}"


def test_what_vrx_s_names_lead_to_is_there():
    assert {*LAUNCHED.values(), *PLACES.values()} <= catalogue("worlds").keys()
    assert not {*LAUNCHED, *PLACES} & catalogue("worlds").keys()


def test_a_longer_ending_is_not_taken_for_a_shorter_one():
    ends = list(FORMATS)
    assert not [(a, b) for i, a in enumerate(ends) for b in ends[i + 1 :] if b.endswith(a)]
