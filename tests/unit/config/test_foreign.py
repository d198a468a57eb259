"""What is said of files of Gazebo and ROS, and of VRX's names, where one of ours is needed."""

import pickle

import pytest

from vrx_mj.config.base import keys_of
from vrx_mj.config.fleet import FleetConfig, load_fleet
from vrx_mj.config.kinds import FORMATS, KINDS, MARKS, NEEDS, USES, Reader, needs
from vrx_mj.config.loading import document
from vrx_mj.config.objects import ObjectConfig
from vrx_mj.config.robots import RobotConfig
from vrx_mj.config.search import catalogue, find
from vrx_mj.config.tree import File, Place, Section
from vrx_mj.config.world import WorldConfig, load_world
from vrx_mj.errors import UnknownNameError, VrxError
from vrx_mj.formats import READERS
from vrx_mj.formats.gazebo.launched import LAUNCHED, PLACES
from vrx_mj.formats.parts.read import load_parts
from vrx_mj.mjcf.compile import compile_world

SDF = '<?xml version="1.0"?>\n<sdf version="1.6"><world name="mine"/></sdf>\n'
WORLD = (
    "not a world: a world is a YAML file; vrx-mj import converts Gazebo's, and VRX's come with vrx_mj (vrx-mj "
    "list worlds)"
)
ROBOT = "vrx-mj run example_course --fleet {file} sails it"
ROS2 = "it is a program, which is not run: name its world and boat, vrx-mj run WORLD --fleet BOAT.urdf"
BAG = "play it with rosbag play or ros2 bag play, while vrx-mj serve runs"
IN_SDF = "vrx-mj run {file} sails a world, --fleet {file} a boat; name a model in a world's `objects`"
SAILED = "vrx-mj run {file} sails it, vrx-mj import {file} -o FOLDER converts it to YAML"
FOREIGN = [
    ("my.xml", SDF, "Gazebo SDF", IN_SDF),
    ("scene.xml", "<mujoco/>", "MuJoCo's MJCF", "python -m mujoco.viewer --mjcf={file} shows it"),
    (
        "start.launch",
        "<launch/>",
        "a ROS launch file",
        "vrx-mj run {file} sails it; --fleet {file} takes only its boats",
    ),
    ("start.launch.py", "", "a ROS 2 launch file", ROS2),
    ("start.launch.xml", "<launch/>", "a ROS 2 launch file", ROS2.partition(": ")[2]),
    ("boat.urdf", "<robot/>", "a robot description (URDF)", ROBOT),
    ("boat.urdf.xacro", "<robot/>", "a robot description (xacro)", ROBOT),
    ("model.sdf.erb", "", "a Gazebo template", "vrx-mj import {file} -o FOLDER reads the layout of a dock from it"),
    ("package.xml", "<package/>", "the package.xml of a ROS package", "pass its folder to vrx-mj run"),
    (
        "model.config",
        "<model/>",
        "the model.config of a Gazebo model",
        "name its folder in a world's `objects`, as model://NAME",
    ),
    ("hull.dae", "", "a mesh", "name it in a robot or an object"),
    ("run.bag", "", "a ROS 1 bag", BAG),
    ("run.mcap", "", "a bag", BAG),
    ("run.rrd", "", "a rerun recording", "vrx-mj replay {file} opens it"),
    ("follow.py", "", "a Python program", "pass a controller with --control module:function"),
    ("scene.json", "", "a part of a saved world", "load its folder with vrx_mj.Simulation.load"),
    ("other.xml", "<x/>", "XML", ""),
    ("map.png", "", "a picture", ""),
    ("state.json", "{}", "JSON", ""),
    ("noise.bin", "\0\1", "a file that does not end in .yaml", ""),
]


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def message(load):
    with pytest.raises(VrxError) as raised:
        load()
    return str(raised.value)


@pytest.mark.parametrize(("file", "text", "what", "use"), FOREIGN)
def test_a_file_that_is_no_world_is_called_by_its_format(here, file, text, what, use):
    (here / file).write_text(text, encoding="utf-8")
    said = f"not a world: {use.format(file=file)}" if use else WORLD
    (here / "mine.yaml").write_text(f"extends: {file}\n", encoding="utf-8")
    assert message(lambda: load_world("mine.yaml")) == f"mine.yaml:1:10: extends: '{file}' is {what}, {said}"
    if not file.endswith(".launch"):
        assert message(lambda: compile_world(file)) == f"'{file}' is {what}, {said}"


def yaml_kinds(here):
    """A YAML file of each kind."""
    texts = {"worlds": "sea: {gain: 0.2}", "fleets": "usv_count: 2", "objects": "mass: 5", "robots": "suites: {}",
             "thrusters": "engine: []", "components": "wamv_gps: []"}  # fmt: skip
    for kind, text in texts.items():
        (here / f"{kind}.yaml").write_text(text, encoding="utf-8")
    return texts


def slots():
    """What takes a file, by its kind, each in the words of its messages."""
    ocean = load_world("ocean")
    return {
        "worlds": load_world,
        "fleets": lambda file: load_fleet(file, ocean),
        "robots": lambda file: load_fleet({"usv_count": 1, "robot": file}, ocean),
        "objects": lambda file: load_world({"objects": [{"name": "a", "model": file}]}),
        "thrusters": lambda file: load_parts(file, "thrusters"),
        "components": lambda file: load_parts(file, "components"),
    }


def test_a_file_in_the_place_of_another_is_called_by_its_kind(here):
    kinds = yaml_kinds(here)
    for slot, load in slots().items():
        for kind, text in kinds.items():
            if kind == slot or {kind, slot} == {"thrusters", "components"}:
                continue
            key = text.partition(":")[0]
            said = f"{kind}.yaml: it has the key '{key}', of {USES[kind]}"
            assert message(lambda load=load, kind=kind: load(f"{kind}.yaml")) == said, slot


def test_no_file_that_is_there_is_called_a_name(here):
    (here / "folder").mkdir()
    for file, text, *_ in FOREIGN:
        (here / file).write_text(text, encoding="utf-8")
    for slot, load in slots().items():
        for file in (*(row[0] for row in FOREIGN), "folder"):
            try:
                load(file)
            except VrxError as error:
                said = str(error)
                assert "named" not in said, (slot, said)
                assert file in said or slot == "robots", (slot, said)


@pytest.mark.parametrize(("given", "said"), [
    ("./my_bay", "no such file: './my_bay'; did you mean 'my_bay.yaml'?"),
    ("./my_bya.yaml", "./my_bya.yaml: no such file; did you mean 'my_bay.yaml'?"),
    ("my_bya.world", "my_bya.world: no such file"),
    ("./sub/my_lake.world", "./sub/my_lake.world: no such file; did you mean 'sub/my_like.world'?"),
    ("./other/my_lake.world", "./other/my_lake.world: no such file; there is no folder 'other'"),
    ("./galleon.world", "./galleon.world: no such file"),
])  # fmt: skip
def test_of_a_path_that_leads_nowhere_near_names_are_said(here, given, said):
    (here / "sub").mkdir()
    (here / "my_bay.yaml").write_text("extends: ocean", encoding="utf-8")
    (here / "sub" / "my_like.world").write_text(SDF, encoding="utf-8")
    assert message(lambda: load_world(given)) == said


@pytest.mark.parametrize(("file", "what"), [
    ("./my.world", "a Gazebo world (SDF)"),
    ("my.world.xacro", "a Gazebo world (SDF in xacro)"),
    ("my.sdf", "Gazebo SDF"),
])  # fmt: skip
def test_a_world_of_gazebo_is_read_but_not_extended(here, file, what):
    (here / file).write_text(SDF, encoding="utf-8")
    assert load_world(file).name == "mine"
    (here / "mine.yaml").write_text(f"extends: {file}\n", encoding="utf-8")
    use = (IN_SDF if file == "my.sdf" else SAILED).format(file=file)
    assert (
        message(lambda: load_world("mine.yaml")) == f"mine.yaml:1:10: extends: '{file}' is {what}, not a world: {use}"
    )


def test_a_file_that_is_no_object_or_dock(here):
    (here / "my.sdf").write_text(SDF, encoding="utf-8")
    (here / "my.urdf").write_text("<robot/>", encoding="utf-8")
    lines = (
        "objects: [{name: a, model: ./my.urdf}]",
        "docks: [{name: b, layout: ./my.sdf}]",
    )
    (here / "mine.yaml").write_text("\n".join(lines), encoding="utf-8")
    what, robot = "'./my.sdf' is Gazebo SDF", "'./my.urdf' is a robot description (URDF)"
    assert message(lambda: load_world("mine.yaml")).splitlines() == [
        f"mine.yaml:1:28: objects[0].model: {robot}, not an object model: {ROBOT.format(file='./my.urdf')}",
        f"mine.yaml:2:27: docks[0].layout: {what}, not a dock layout: {IN_SDF.format(file='./my.sdf')}",
    ]
    assert NEEDS.keys() == KINDS.keys()


def test_an_object_does_not_extend_sdf(here):
    (here / "my.sdf").write_text(SDF, encoding="utf-8")
    (here / "buoy.yaml").write_text("extends: ./my.sdf\nmass: 5\n", encoding="utf-8")
    said = f"not an object model: {IN_SDF.format(file='./my.sdf')}"
    (here / "mine.yaml").write_text("objects: [{name: a, model: ./buoy.yaml}]", encoding="utf-8")
    assert message(lambda: load_world("mine.yaml")) == f"buoy.yaml:1:10: extends: './my.sdf' is Gazebo SDF, {said}"


def test_an_object_in_sdf_is_a_model(here):
    (here / "my.sdf").write_text(SDF, encoding="utf-8")
    (here / "mine.yaml").write_text("objects: [{name: a, model: ./my.sdf}]", encoding="utf-8")
    assert (
        message(lambda: load_world("mine.yaml"))
        == "my.sdf:2:1: <sdf>: this is a world without a <model>: pass it as WORLD"
    )


def test_a_file_of_another_kind_is_called_by_its_kind(here):
    (here / "fleet.yaml").write_text("usv_count: 2\nlayout: line\nsensors: none\n", encoding="utf-8")
    (here / "world.yaml").write_text("extends: ocean\nsea: {gain: 0.2}\n", encoding="utf-8")
    text = "fleet.yaml: it has the key 'layout', of a fleet; pass it with --fleet"
    assert message(lambda: load_world("fleet.yaml")) == text
    (here / "mine.yaml").write_text("extends: fleet.yaml\n", encoding="utf-8")
    assert message(lambda: load_world("mine.yaml")) == text
    text = "world.yaml: it has the key 'sea', of a world; pass it as WORLD"
    assert message(lambda: load_fleet("world.yaml", load_world("ocean"))) == text


def test_the_keys_that_tell_a_kind_are_of_one_kind_alone():
    models = {"worlds": WorldConfig, "fleets": FleetConfig, "objects": ObjectConfig, "robots": RobotConfig}
    for kind, own in models.items():
        marks = MARKS[kind]
        assert marks <= set(keys_of(own))
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
    ("practice_2023_wildlife0_task", "VRX's practice_2023_wildlife0_task is 'vrx2023/practice/wildlife0'"),
    ("phase2_2023_perception5", "VRX's phase2_2023_perception5 is 'vrx2023/phase2/perception5'"),
    ("2022_practice/gymkhana1", "VRX's gymkhana1 is 'vrx2022/practice/gymkhana1'"),
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


@pytest.mark.parametrize("robot", ["{outside}/boat", "../boat", "./link"])
def test_a_file_that_another_names_outside_of_its_folder_is_not_looked_into(robot, tmp_path, monkeypatch):
    (tmp_path / "boat").write_text("<mujoco/>", encoding="utf-8")
    (tmp_path / "fleet").mkdir()
    (tmp_path / "fleet" / "link").symlink_to(tmp_path / "boat")
    monkeypatch.chdir(tmp_path / "fleet")
    path = robot.format(outside=tmp_path)
    with pytest.raises(VrxError, match="leaves the folder of the file that names it"):
        find("robots", path, near=tmp_path / "fleet")


def test_a_profile_that_is_no_text_is_told():
    with pytest.raises(VrxError, match=r"physics\.profile: expected vrx, vrx3 or marine, got no keys"):
        load_world({"physics": {"profile": {}}})


def test_a_document_of_a_format_may_extend_one_of_ours(monkeypatch):
    own = Section({"extends": "ocean_buoys", "wind": None}, Place(File("marks.csv", None)))
    expected = document("worlds", "ocean_buoys")[0]["objects"]
    monkeypatch.setattr("vrx_mj.config.loading.function_of", lambda kind, source: lambda path: (own, "marks"))
    read, name = document("worlds", "marks.csv")
    assert (name, read["wind"], read["objects"]) == ("marks", None, expected)


def test_formats_of_fleets_are_those_of_their_readers(monkeypatch):
    monkeypatch.setattr("vrx_mj.formats.READERS", (Reader("fleets", (".csv", ".csv.gz"), ""), *READERS))
    assert needs("fleets").startswith(
        "a fleet is a YAML file or one that ends in .csv, .launch, .urdf, .xacro, .world or"
    )
