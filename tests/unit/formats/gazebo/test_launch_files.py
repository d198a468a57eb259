"""Launch files of ROS 1: the world that they open and their boats, by every element that they have."""

import csv
from pathlib import Path

import pytest

from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxError, VrxWarning
from vrx_mj.formats.gazebo.launch import launch_of
from vrx_mj.formats.gazebo.launched import STOCK_LAUNCHES, fleet_of
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.ros.table.boats import description

GOLDEN = Path(__file__).parents[3] / "golden" / "launches.csv"
XACRO = "$(find xacro)/xacro $(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"


def rows():
    """VRX's launch files, each with its boats."""
    lines = GOLDEN.read_text(encoding="utf-8").splitlines()[2:]
    found = {}
    for row in csv.DictReader(lines):
        found.setdefault(row["launch"], []).append(row)
    return found


STOCK = rows()


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def launched(body, arguments=None, **others):
    """What a launch file starts, beside others."""
    for name, text in {"bay": body, **others}.items():
        Path(f"{name}.launch").write_text(f"<launch>\n{text}\n</launch>\n", encoding="utf-8")
    return launch_of("bay.launch", arguments or {})


def boat(name, *, x=0.0, ns="", command=XACRO):
    """What describes and spawns a boat."""
    return (
        f'<param name="{ns or name}/robot_description" command="{command} namespace:={name}"/>\n'
        f'<node pkg="gazebo_ros" type="spawn_model" name="spawn_{name}" '
        f'args="-x {x} -y 2 -z 0.1 -Y -1.5 -urdf -param {ns or name}/robot_description -model {name}"/>\n'
    )


def spawned(launch):
    """Names and places [m] of the boats."""
    return {one.name: one.pose[0] for one in launch.boats}


@pytest.mark.parametrize("name", STOCK)
def test_a_launch_file_of_vrx_starts_what_it_does_there(name):
    launch = launch_of(f"{name}.launch", {})
    expected = [row for row in STOCK[name] if row["boat"]]
    assert launch.world == STOCK[name][0]["world"]
    boats = (fleet_of(launch) or {"boats": ()})["boats"]
    assert [one["name"] for one in boats] == [row["boat"] for row in expected]
    for found, row in zip(boats, expected, strict=True):
        x, y, z, yaw = (float(row[key]) for key in ("x", "y", "z", "yaw"))
        assert found["pose"] == (x, y, z, 0.0, 0.0, yaw)
        assert (found["robot"], found.get("thrusters", "")) == (row["robot"], row["thrusters"])
        if row["sensors"]:
            assert found["sensors"] == (tuple(row["sensors"].split()) if row["sensors"] != "none" else "none")


def test_every_launch_file_of_vrx_is_in_the_table():
    assert {f"{name}.launch" for name in STOCK} == set(STOCK_LAUNCHES)


def test_a_launch_file_of_vrx_takes_its_arguments():
    given = {"x": "1", "y": "2", "z": "3", "R": "0.1", "P": "0.2", "Y": "0.3", "thrust_config": "X", "namespace": "cat"}
    (found,) = launch_of("vrx.launch", given).boats
    assert (found.name, found.pose, found.arguments["thrust_config"]) == ("cat", (1, 2, 3, 0.1, 0.2, 0.3), "X")


def test_the_home_of_a_user_that_does_not_exist_is_no_folder(monkeypatch):
    monkeypatch.setenv("HOME", "/home/somebody")
    launch = launch_of("vrx.launch", {"world": "~nobody-here/bay.world", "urdf": "~/boat.urdf"})
    assert launch.world == Path("~nobody-here/bay.world")
    assert launch.boats[0].model == Path("/home/somebody/boat.urdf")


def test_boats_of_one_launch_file_keep_their_own_names_places_and_thrusters():
    given = {"x": "1", "namespace": "cat", "thrust_config": "T"}
    boats = launch_of("demo_thrusterconfigs.launch", given).boats
    assert [one.name for one in boats] == ["wamvH", "wamvT", "wamvX"]
    assert [one.arguments["thrust_config"] for one in boats] == ["H", "T", "X"]
    assert [one.pose[0] for one in boats] == [-552, -542, -532]


def test_one_boat_is_described_by_vrx():
    (found,) = launched(boat("defender_a", x=-520)).boats
    assert (found.name, found.model, found.pose) == ("defender_a", "wamv", (-520.0, 2.0, 0.1, 0.0, 0.0, -1.5))


@pytest.mark.parametrize("count", [2, 3])
def test_several_boats_are_a_fleet(count):
    launch = launched("".join(boat(f"defender_{i}", x=10 * i) for i in range(count)))
    assert spawned(launch) == {f"defender_{i}": 10.0 * i for i in range(count)}
    assert [one["name"] for one in fleet_of(launch)["boats"]] == [f"defender_{i}" for i in range(count)]


def test_conditions_choose():
    choice = "".join(
        f'<group {key}="{value}">{boat(name)}</group>'
        for key, value, name in (
            ("if", "true", "a"),
            ("if", "0", "b"),
            ("unless", "False", "c"),
            ("unless", "1", "d"),
            ("if", "$(eval 2 > 1)", "e"),
        )
    )
    assert set(spawned(launched(choice))) == {"a", "c", "e"}


@pytest.mark.parametrize(("config", "names"), [("H", {"one"}), ("T", {"two"})])
def test_a_condition_of_an_argument(config, names):
    body = (
        '<arg name="config" default="H"/><arg name="h" value="$(eval int(config == \'H\'))"/>'
        f'<group if="$(arg h)">{boat("one")}</group><group unless="$(arg h)">{boat("two")}</group>'
    )
    assert set(spawned(launched(body, {"config": config}))) == names


def test_a_namespace_is_that_of_its_parameters():
    inside = boat("cat", ns="x").replace('name="x/robot', 'name="robot').replace("-param x/", "-param ")
    other = boat("dog", ns="y").replace("-param y/", "-param /y/")
    launch = launched(
        f'<group ns="sea">{inside}<group ns="deep">{inside.replace("cat", "fish")}</group></group>{other}'
    )
    assert set(spawned(launch)) == {"cat", "fish", "dog"}


@pytest.mark.parametrize(
    ("ns", "param"), [("", "x/robot"), ("x", "robot"), ("/x/", "robot"), ("x", "/x/robot"), ("y", "/x/robot")]
)
def test_a_node_takes_its_parameter_from_its_own_namespace(ns, param):
    texts = "".join(f'<param name="{name}" command="cat {name[0]}.urdf"/>' for name in ("x/robot", "y/robot", "robot"))
    for name in "xyr":
        Path(f"{name}.urdf").write_text("<robot name='boat'/>", encoding="utf-8")
    node = f'<node type="spawn_model" name="s" ns="{ns}" args="-param {param} -model cat"/>'
    (found,) = launched(texts + node).boats
    assert found.model.name == "x.urdf"


@pytest.mark.parametrize(
    ("kind", "more"),
    [
        ("spawn_model", "-urdf -file boat.urdf -model cat -J post -0.5 -wait dock -unpause __log:=/tmp/x"),
        ("spawn_wamv.bash", "--urdf boat.urdf --model cat"),
    ],
)
def test_options_are_those_of_the_programs(kind, more):
    Path("boat.urdf").write_text("<robot name='boat'/>", encoding="utf-8")
    (found,) = launched(f'<node type="{kind}" name="s" args="-x -3 {more}"/>').boats
    assert (found.name, found.pose[0], found.model.name) == ("cat", -3.0, "boat.urdf")


def test_a_variable_of_the_environment_is_one_of_the_shell():
    (note,) = launched('<env name="VRX_DEBUG" value="false"/>').report.notes
    assert (note.what, note.fate) == ("<env> 'VRX_DEBUG'", "ignored")
    assert note.ours == "set this environment variable in the shell"


def test_an_unknown_option_is_an_error():
    with pytest.raises(ConfigError, match=r"no option of spawn_model named '-modle'; did you mean '-model'\?"):
        launched('<node type="spawn_model" name="s" args="-modle cat"/>')


def test_arguments_of_a_group_are_its_own():
    body = '<arg name="x" value="1"/><group><arg name="x" value="2"/>{}</group>{}'
    assert spawned(launched(body.format(boat("in", x="$(arg x)"), boat("out", x="$(arg x)")))) == {"in": 2, "out": 1}


def test_a_file_that_is_included_has_the_namespace_of_its_include():
    inside = boat("cat", ns="x").replace('name="x/robot', 'name="robot').replace("-param x/", "-param ")
    include = '<include file="one.launch" ns="sea"/>'
    outside = '<node type="spawn_model" name="s" args="-param sea/robot_description -model dog"/>'
    assert set(spawned(launched(include + outside, one=inside))) == {"cat", "dog"}


def test_arguments_have_defaults_values_and_what_is_given():
    body = (
        '<arg name="x" default="5"/><arg name="twice" value="$(eval 2 * x)"/><arg name="text" value="$(arg x)0"/>'
        + boat("a", x="$(arg x)")
        + boat("b", x="$(arg twice)")
        + boat("c", x="$(arg text)")
    )
    assert spawned(launched(body)) == {"a": 5, "b": 10, "c": 50}
    assert spawned(launched(body, {"x": "7"})) == {"a": 7, "b": 14, "c": 70}


def test_an_included_file_gets_the_arguments_that_are_passed():
    inside = '<arg name="x" default="1"/><arg name="name"/>' + boat("$(arg name)", x="$(arg x)")
    body = "".join(
        f'<include file="$(dirname)/one.launch"><arg name="name" value="{name}"/>{x}</include>'
        for name, x in (("a", ""), ("b", '<arg name="x" value="2"/>'), ("c", '<arg name="x" value="3" if="false"/>'))
    )
    assert spawned(launched(body, one=inside)) == {"a": 1, "b": 2, "c": 1}


def test_an_included_file_gets_all_arguments():
    inside = '<arg name="x" default="1"/>' + boat("a", x="$(arg x)")
    body = '<arg name="x" value="4"/><arg name="other" value="5"/>'
    include = '<include file="one.launch" pass_all_args="true"/>'
    assert spawned(launched(body + include, one=inside)) == {"a": 4}


def test_a_launch_file_is_found_from_another_folder(tmp_path, monkeypatch):
    launched('<include file="$(dirname)/one.launch"/>', one=boat("a"))
    monkeypatch.chdir(tmp_path.parent)
    assert spawned(launch_of(f"{tmp_path.name}/bay.launch", {})) == {"a": 0.0}


def test_a_package_is_found_above_its_launch_files(tmp_path):
    package = tmp_path / "my_worlds"
    for name in ("launch", "worlds"):
        (package / name).mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_worlds</name></package>", encoding="utf-8")
    (package / "worlds" / "bay.world").write_text('<sdf version="1.6"><world name="bay"/></sdf>', encoding="utf-8")
    include = (
        '<include file="$(find gazebo_ros)/launch/empty_world.launch">'
        '<arg name="world_name" value="$(find my_worlds)/worlds/bay.world"/></include>'
    )
    (package / "launch" / "bay.launch").write_text(f"<launch>{include}</launch>", encoding="utf-8")
    launch = launch_of("my_worlds/launch/bay.launch", {})
    assert launch.world == (package / "worlds" / "bay.world").resolve()


@pytest.mark.parametrize(
    ("path", "world"),
    [
        ("vrx_gazebo)/worlds/gymkhana", "gymkhana"),
        ("vrx_gazebo)/worlds/sydneyregatta", "sydney_regatta"),
        ("vrx_2019)/worlds/dock", "vrx2019/dock"),
        ("vrx_gazebo)/worlds/2019_phase2/dock0", "vrx2019/phase2/dock0"),
        ("vrx_2019)/worlds/sandisland", "sand_island"),
        ("wave_gazebo)/worlds/ocean_buoys", "ocean_buoys"),
    ],
)
def test_worlds_of_vrx_are_ours(path, world):
    argument = f'<arg name="world" value="$(find {path}.world"/>'
    body = f'<include file="$(find vrx_gazebo)/launch/vrx.launch">{argument}</include>'
    assert launched(body).world == world


def test_a_world_is_the_xacro_that_it_is_made_from(tmp_path):
    (tmp_path / "bay.world.xacro").write_text('<sdf version="1.6"><world name="bay"/></sdf>', encoding="utf-8")
    argument = '<arg name="world" value="$(dirname)/bay.world"/>'
    launch = launched(f'<include file="$(find vrx_gazebo)/launch/vrx.launch">{argument}</include>')
    assert launch.world == (tmp_path / "bay.world.xacro").resolve()


def test_a_description_takes_thrusters_and_sensors():
    command = f"{XACRO} thruster_config:=X gps_enabled:=true imu_enabled:=false vrx_sensors_enabled:=True"
    (found,) = fleet_of(launched(boat("a", command=command)))["boats"]
    assert (found["thrusters"], found["sensors"]) == ("X", ("gps", "vrx"))


@pytest.mark.parametrize("how", ["command", "textfile", "-file"])
def test_a_description_of_ones_own(how, tmp_path):
    (tmp_path / "boat.urdf").write_text('<robot name="boat"><link name="base_link"/></robot>', encoding="utf-8")
    param = {
        "command": '<param name="robot_description" command="cat \'$(dirname)/boat.urdf\'"/>',
        "textfile": '<param name="robot_description" textfile="$(dirname)/boat.urdf"/>',
    }.get(how, "")
    source = "-file $(dirname)/boat.urdf" if how == "-file" else "-param robot_description"
    node = f'<node pkg="gazebo_ros" type="spawn_model" name="s" args="-urdf {source} -model boat"/>'
    (found,) = launched(param + node).boats
    assert found.model == (tmp_path / "boat.urdf").resolve()


def test_what_is_no_simulation_is_ignored():
    body = '<node pkg="rviz" type="rviz" name="rviz"/><rosparam file="a.yaml"/><param name="a" value="5"/>'
    launch = launched(body + '<include file="$(find joy)/launch/joy.launch"/>' + boat("a"))
    fates = [(note.what, note.fate) for note in launch.report.notes]
    assert fates == [
        ("<node> 'rviz'", "ignored"),
        ("<rosparam>", "ignored"),
        ("<param> 'a'", "ignored"),
        ("<include> joy.launch", "ignored"),
        ("<node> 'a'", "imported"),
    ]


GUIDE = """usv_count: 3
layout: circle
positions:
  - {x: 0, y: 20, z: 0.1, Y: 90}
  - {x: 17.32, y: -10, z: 0.1, Y: -30}
  - {x: -17.32, y: -10, z: 0.1, Y: 210}
"""
SPAWNS = '<node name="spawn_usvs" pkg="usvs" type="spawn_usvs.py"/>'
OCEAN = """<include file="$(find gazebo_ros)/launch/empty_world.launch">
<arg name="world_name" value="$(find vrx_gazebo)/worlds/ocean.world"/></include>"""


def with_parameters(text, *more):
    """A launch file that opens the ocean and loads a file of parameters before a guide's node spawns its boats."""
    Path("usv_config.yaml").write_text(text, encoding="utf-8")
    return launched("".join([OCEAN, '<rosparam command="load" file="usv_config.yaml"/>', *more, SPAWNS]))


def test_a_fleet_among_the_parameters_is_the_fleet():
    launch = with_parameters(GUIDE)
    assert [(note.fate, note.ours) for note in launch.report.notes][1:] == [
        ("imported", "the fleet: `usv_config.yaml`"), ("imported", "the boats of `usv_config.yaml`"),
    ]  # fmt: skip
    with pytest.warns(VrxWarning) as caught:
        world = compile_world("bay.launch")
    assert [str(one.message) for one in caught] == [
        "bay.launch: its <rosparam> loads a fleet, as --fleet usv_config.yaml does"
    ]
    own = compile_world("ocean", fleet="./usv_config.yaml")
    assert (world.boats, world.parameters) == (("wamv1", "wamv2", "wamv3"), own.parameters)
    assert load_fleet("bay.launch", load_world("ocean")).positions == own_fleet("./usv_config.yaml").positions


def own_fleet(file):
    return load_fleet(file, load_world("ocean"))


def test_boats_that_are_spawned_too_join_it():
    fleet = fleet_of(with_parameters(GUIDE, boat("extra", x=50.0)))
    boats = [boat for boat, _ in load_fleet(fleet, load_world("ocean")).boats_in(load_world("ocean"))]
    assert [one.name for one in boats] == ["wamv1", "wamv2", "wamv3", "extra"]


@pytest.mark.parametrize("text", ["gain: 3\n", "usv_count: 3\nmaster: here\n", "positions: 7\n", "a: [\n"])
def test_other_parameters_are_those_of_nodes(text):
    launch = with_parameters(text)
    assert (launch.fleet, fleet_of(launch)) == (None, None)
    assert [note.fate for note in launch.report.notes] == ["imported", "ignored", "ignored"]


def test_a_spawned_model_of_sdf_whose_file_is_missing_is_no_boat():
    node = '<node pkg="gazebo_ros" type="spawn_model" name="s" args="-sdf -file a.sdf -model buoy -x -5"/>'
    launch = launched(node)
    assert not launch.boats
    (note,) = launch.report.notes
    assert (note.fate, note.ours) == ("ignored", "no file 'a.sdf'")


def test_arguments_of_the_xacro_of_a_world_are_given_to_the_world():
    text = """<sdf version="1.6" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="gain" default="0.1"/>
      <world name="bay"><xacro:ocean_waves gain="$(arg gain)"/></world></sdf>"""
    Path("bay.world.xacro").write_text(text, encoding="utf-8")
    low, high = (compile_world("bay.world.xacro", fleet="none", arguments=given) for given in ({}, {"gain": "0.3"}))
    assert low.parameters.sea.waves[0].amplitude == pytest.approx(high.parameters.sea.waves[0].amplitude / 3.0)
    with pytest.raises(ConfigError) as raised:
        compile_world("ocean", arguments={"gain": "0.3"})
    message = "takes no NAME:=VALUE: only launch files and the xacro of worlds and boats have arguments"
    assert str(raised.value) == f"ocean: {message}"


XACRO_BOAT = """<robot name="boat" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="namespace" default="wamv"/>
  <xacro:arg name="length" default="2.0"/>
  <link name="$(arg namespace)/base_link">
    <inertial><mass value="60"/><inertia ixx="10" iyy="20" izz="25" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="$(arg length) 1 0.4"/></geometry></collision>
  </link>
</robot>"""


def spawning(name, arguments):
    """The elements of a launch file that spawn a boat of the xacro."""
    args = f"-x {9 * ord(name)} -urdf -param {name} -model {name}"
    return f"""<param name="{name}" command="xacro $(dirname)/boat.xacro {arguments}"/>
      <node name="spawn_{name}" pkg="gazebo_ros" type="spawn_model" args="{args}"/>"""


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_arguments_of_a_boats_own_xacro_reach_it():
    Path("boat.xacro").write_text(XACRO_BOAT, encoding="utf-8")
    both = spawning("a", "namespace:=a length:=4 mast:=2") + spawning("b", "namespace:=b")
    launch = launched(both)
    lost = [(note.what, note.ours) for note in launch.report.notes if note.fate == "ignored"]
    assert lost == [("<node> 'a'", "boat.xacro has no argument mast:=")]
    world = compile_world("ocean", fleet=fleet_of(launch))
    assert [boat.arguments for boat in world.parameters.boats] == [
        {"namespace": "a", "length": "4"},
        {"namespace": "b"},
    ]
    longer, shorter = (max(station.length for station in world.parameters.stations[rows]) for rows in rows_of(world))
    assert longer > shorter
    world.save("saved")
    again = World.load("saved")
    assert (again.sha256, again.parameters.boats[0].arguments) == (world.sha256, {"namespace": "a", "length": "4"})
    assert ['size="4 1 0.4"' in description(again, boat) for boat in "ab"] == [True, False]


def rows_of(world):
    """Where the stations of each hull are."""
    return [slice(hull.station_start, hull.station_start + hull.station_count) for hull in world.parameters.hulls]


def test_a_boats_arguments_come_on_top_of_its_fleets_and_not_on_another_robot():
    Path("boat.xacro").write_text(XACRO_BOAT, encoding="utf-8")
    pose = [0, 0, 0, 0, 0, 0]
    entries = [
        {"name": "a", "pose": pose, "arguments": {"namespace": "a"}},
        {"name": "b", "pose": pose, "robot": "wamv"},
        {"name": "c", "pose": pose},
    ]
    fleet = {"robot": "./boat.xacro", "arguments": {"length": 3, "namespace": True}, "boats": entries}
    boats = [boat for boat, _ in load_fleet(fleet, load_world("ocean")).boats_in(load_world("ocean"))]
    assert [boat.arguments for boat in boats] == [
        {"length": "3", "namespace": "a"}, {}, {"length": "3", "namespace": "true"},
    ]  # fmt: skip


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_arguments_of_a_command_are_the_xacros_of_its_fleet():
    Path("boat.xacro").write_text(XACRO_BOAT, encoding="utf-8")
    (boat,) = compile_world("ocean", fleet="boat.xacro", arguments={"length": "3"}).parameters.boats
    assert (boat.name, boat.arguments) == ("wamv", {"length": "3"})
    world = {"extends": "ocean", "spawn": {"robot": "./boat.xacro", "arguments": {"length": 3}}}
    (boat,) = compile_world(world).parameters.boats
    assert boat.arguments == {"length": "3"}
    with pytest.raises(ConfigError) as raised:
        compile_world("ocean", fleet="boat.xacro", arguments={"lenght": "3"})
    assert str(raised.value) == "boat.xacro: boat wamv: no xacro argument named 'lenght'; did you mean 'length'?"


@pytest.mark.parametrize(
    ("file", "text", "reason"),
    [
        ("a.urdf", "<robot name='a'><link name='a'/></robot>", "its URDF has nothing to expand"),
        ("a.sdf", "<sdf version='1.6'><model name='a'><link name='a'/></model></sdf>", "it is a Gazebo model"),
    ],
)
def test_what_is_no_xacro_takes_no_arguments(file, text, reason):
    Path(file).write_text(text, encoding="utf-8")
    with pytest.raises(VrxError) as raised:
        compile_world("ocean", fleet={"robot": f"./{file}", "arguments": {"length": 3}})
    assert str(raised.value) == f"robot ./{file} takes no arguments: {reason}"
