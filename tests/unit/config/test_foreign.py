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
    "which is not read: a world is a YAML file, which vrx-mj import makes of Gazebo's; VRX's own come with vrx_mj "
    "(vrx-mj list worlds)"
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


@pytest.mark.parametrize(("file", "what"), [
    ("./my.world", "a world of Gazebo (SDF)"),
    ("my.world.xacro", "a world of Gazebo (SDF in xacro)"),
    ("my.sdf", "SDF of Gazebo"),
])  # fmt: skip
def test_a_world_of_gazebo_is_read_but_not_extended(here, file, what):
    (here / file).write_text(SDF, encoding="utf-8")
    assert load_world(file).name == "mine"
    (here / "mine.yaml").write_text(f"extends: {file}\n", encoding="utf-8")
    assert message(lambda: load_world("mine.yaml")) == f"mine.yaml:1:10: extends: '{file}' is {what}, {WORLD}"


def test_a_file_that_is_no_object_or_dock(here):
    (here / "my.sdf").write_text(SDF, encoding="utf-8")
    (here / "my.urdf").write_text("<robot/>", encoding="utf-8")
    lines = (
        "objects: [{name: a, model: ./my.urdf}]",
        "docks: [{name: b, layout: ./my.sdf}]",
    )
    (here / "mine.yaml").write_text("\n".join(lines), encoding="utf-8")
    what, robot = "'./my.sdf' is SDF of Gazebo", "'./my.urdf' is the description of a robot (URDF)"
    assert message(lambda: load_world("mine.yaml")).splitlines() == [
        f"mine.yaml:1:28: objects[0].model: {robot}, which is not read: {NEEDS['objects']}",
        f"mine.yaml:2:27: docks[0].layout: {what}, which is not read: {NEEDS['docks']}",
    ]
    assert NEEDS.keys() == KINDS.keys()


def test_an_object_in_sdf_is_a_model(here):
    (here / "my.sdf").write_text(SDF, encoding="utf-8")
    (here / "mine.yaml").write_text("objects: [{name: a, model: ./my.sdf}]", encoding="utf-8")
    assert message(lambda: load_world("mine.yaml")) == "my.sdf:2:1: <sdf>: expected <sdf> with a <model>"


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
    ("vrx.launch", "VRX's vrx.launch opens 'example_course'"),
    ("station_keeping", "VRX's station_keeping.launch opens 'stationkeeping_task'"),
    ("competition.launch.py", "VRX's competition.launch.py opens 'vrx2023/sydney_regatta'"),
    ("nbpark", "VRX's nbpark.world is 'vrx2023/nbpark'"),
    ("oceon", "did you mean 'ocean'?"),
])  # fmt: skip
def test_names_of_vrx_lead_to_ours(name, advice):
    with pytest.raises(UnknownNameError) as raised:
        load_world(name)
    assert str(raised.value) == f"no world named '{name}'; {advice}"
    assert str(pickle.loads(pickle.dumps(raised.value))) == str(raised.value)


def test_files_of_vrx_lead_to_ours_where_they_are_not_there(here):
    ours = "VRX's sandisland.world.xacro is 'sand_island'"
    missing = message(lambda: load_world("sandisland.world.xacro"))
    assert missing == f"sandisland.world.xacro: no such file; {ours}"
    for name in ("sandisland.world", "wildlife_task.world"):
        assert message(lambda name=name: load_world(name)).startswith(f"{name}: no such file; VRX's {name} is '")
    (here / "sandisland.world.xacro").write_text(SDF, encoding="utf-8")
    assert load_world("sandisland.world.xacro").name == "mine"


def test_what_vrx_s_names_lead_to_is_there():
    assert {*LAUNCHED.values(), *PLACES.values()} <= catalogue("worlds").keys()
    assert not {*LAUNCHED, *PLACES} & catalogue("worlds").keys()


def test_a_longer_ending_is_not_taken_for_a_shorter_one():
    ends = list(FORMATS)
    assert not [(a, b) for i, a in enumerate(ends) for b in ends[i + 1 :] if b.endswith(a)]
