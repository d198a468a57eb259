"""VRX's launch files: each argument is taken, and what has no effect is said once; those without a world name ours."""

import csv
from pathlib import Path, PurePosixPath

import pytest

from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.gazebo.launch import launch_of
from vrx_mj.formats.gazebo.launched import STOCK_LAUNCHES, fleet_of, is_tool, stock_launch
from vrx_mj.formats.gazebo.opening import file_in, open_source

LISTED = Path(__file__).parents[3] / "golden/vrx_names/launch_arguments.csv"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def listed():
    """Arguments of VRX's launch files that open a world, each with its launch file's package and name."""
    lines = (line for line in LISTED.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    rows = ((row["name"], PurePosixPath(row["file"])) for row in csv.DictReader(lines))
    return [(name, file.parts[0], file.name) for name, file in rows if not is_tool(file.name)]


def notes(launch, **given):
    """What is said about the arguments of a launch file."""
    return [(note.what, note.fate, note.ours) for note in launch_of(launch, given).report.notes]


@pytest.mark.parametrize(("name", "package", "file"), listed())
def test_every_argument_of_every_launch_file_is_taken(name, package, file):
    assert name in stock_launch(file, package).arguments


def test_a_launch_file_without_boats_opens_its_world_without():
    assert open_source("ocean_world.launch", None, {}) == ("ocean", "none")
    assert open_source("ocean_world.launch", "trio", {}) == ("ocean", "trio")


@pytest.mark.parametrize("launch", sorted(STOCK_LAUNCHES))
def test_arguments_as_they_are_by_default_lose_nothing(launch):
    usual = {"gui": "true", "verbose": "True", "paused": "false", "joy": "0", "non_competition_mode": "1"}
    usual |= {"recording": "false", "debug": "false", "use_sim_time": "true", "enable_ros_network": "true"}
    usual |= {"extra_gazebo_args": "", "extra_gz_args": ""}
    own = {name: value for name, value in stock_launch(launch).own.items() if name.endswith("_locked")}
    assert notes(launch, **usual, **own) == []


@pytest.mark.parametrize(
    ("launch", "given", "ours"),
    [
        ("vrx.launch", {"paused": "true"}, "`vrx-mj serve --paused` starts paused"),
        ("vrx.launch", {"joy": "true"}, "use `vrx-mj teleop --web` with `vrx-mj serve` for a joystick"),
        ("vrx.launch", {"non_competition_mode": "false"}, "VRX_DEBUG=false hides the topics of wind and contacts"),
        ("vrx.launch", {"extra_gazebo_args": "-s x.so"}, "Gazebo does not run; use the options of `vrx-mj` instead"),
        ("vrx.launch", {"extra_gz_args": "-v 4"}, "Gazebo does not run; use the options of `vrx-mj` instead"),
        ("ocean_world.launch", {"recording": "true"}, "use `--record run.rrd`"),
        ("ocean_world.launch", {"debug": "True"}, "Gazebo does not run"),
        ("ocean_world.launch", {"use_sim_time": "false"}, "time is always simulated time"),
        (
            "sandisland.launch", {"enable_ros_network": "false"},
            "choose the transports with the options of `vrx-mj serve`",
        ),
        (
            "gymkhana.launch", {"pinger_params": "a.yaml"},
            "VRX's launch files do not read it; set `task: {pinger: [x, y, z]}` in the world",
        ),
        ("marina.launch", {"robot_locked": "true"}, "the task holds the boat until it is ready"),
        ("vrx.launch", {"wamv_locked": "1"}, "the task holds the boat until it is ready"),
        ("vrx.launch", {"wamv_locked": "yes"}, "expected true or false"),
    ],
)  # fmt: skip
def test_an_argument_without_effect_is_said(launch, given, ours):
    ((name, value),) = given.items()
    assert notes(launch, **given) == [(f"{name}:={value}", "ignored", ours)]


def test_it_is_said_once_by_the_name_of_the_launch_file():
    with pytest.warns(VrxWarning) as caught:
        open_source("marina.launch", None, {"robot_locked": "true", "recording": "true", "gui": "false"})
    (said,) = (str(one.message) for one in caught)
    assert said.splitlines() == [
        "marina.launch: 2 of 2 parts differ from Gazebo (`vrx-mj import` lists all)",
        "  marina.launch: robot_locked:=true ignored: the task holds the boat until it is ready",
        "  marina.launch: recording:=true ignored: use `--record run.rrd`",
    ]


@pytest.mark.parametrize("launch", ["station_keeping.launch", "vrx_2019/dock.launch"])
def test_a_boat_that_is_not_locked_is_free_from_the_start(launch):
    locked, free = (load_world(open_source(launch, None, given)[0]) for given in ({}, {"wamv_locked": "false"}))
    assert (locked.task.locked, free.task.locked) == (True, False)
    assert free.model_dump(exclude={"task"}) == locked.model_dump(exclude={"task"})


@pytest.mark.parametrize(("word", "suites"), [("true", ("gps",)), ("1", ("gps",)), ("False", "none"), ("0", "none")])
def test_switches_of_sensors(word, suites):
    (boat,) = fleet_of(launch_of("sandisland.launch", {"gps_enabled": word}))["boats"]
    assert boat["sensors"] == suites


def test_a_switch_that_is_no_boolean_is_refused():
    text = """<launch><include file="$(find gazebo_ros)/launch/empty_world.launch"/>
<param name="d" command="$(find xacro)/xacro $(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro gps_enabled:=yes"/>
<node name="s" pkg="gazebo_ros" type="spawn_model" args="-urdf -param d -model cat"/>
</launch>
"""
    Path("bay.launch").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        fleet_of(launch_of("bay.launch", {}))
    assert str(error.value) == "bay.launch:3:1: 'cat' / gps_enabled:=: expected true or false, got 'yes'"


@pytest.mark.parametrize(
    ("package", "name", "given", "said"),
    [
        ("vrx_gazebo", "generate_wamv.launch", {}, "type: vrx-mj robot build -o my_wamv.urdf"),
        (
            "vrx_gazebo", "generate_wamv.launch",
            {"thruster_yaml": "t.yaml", "component_yaml": "my c.yaml", "wamv_target": "a.urdf", "wamv_locked": "true"},
            "type: vrx-mj robot build --thrusters t.yaml --components 'my c.yaml' --locked -o a.urdf",
        ),
        (
            "vrx_gazebo", "generate_wamv.launch", {"sensor_yaml": "s.yaml", "wamv_locked": "false"},
            "type: vrx-mj robot build --sensor-yaml s.yaml -o my_wamv.urdf",
        ),
        (
            "vrx_gazebo", "generate_worlds.launch", {"requested": "a.yaml"},
            "type: vrx-mj worlds generate a.yaml -o my_worlds",
        ),
        (
            "vrx_gazebo", "usv_keydrive.launch", {"namespace": "cat"},
            "drive from a second terminal, while `vrx-mj serve` runs; type: vrx-mj teleop --boat cat",
        ),
        (
            "vrx_gazebo", "usv_joydrive.launch", {},
            "drive with a joystick from a web page, while `vrx-mj serve` runs; type: vrx-mj teleop --web",
        ),
        (
            "vrx_gazebo", "playback.launch", {"log_file": "state.log"},
            "Gazebo logs are not read; record with `--record run.rrd`; type: vrx-mj replay run.rrd",
        ),
        (
            "vrx_gazebo", "pinger.launch", {},
            "publish the beacon's position yourself, to /wamv/sensors/pingers/pinger/set_pinger_position",
        ),
        ("wamv_gazebo", "rviz_vrx.launch", {}, "start it with `roslaunch`, while `vrx-mj serve` runs"),
        (
            "vrx_gz", "competition.launch.py", {"world": "gymkhana_task", "headless": "true"},
            "ROS 2 launch files are programs, which are not run; type: vrx-mj serve --ros2 vrx2023/gymkhana_task",
        ),
    ],
)  # fmt: skip
def test_a_launch_file_without_a_world_names_what_to_type(package, name, given, said):
    assert file_in(package, name) == name
    with pytest.raises(ConfigError) as error:
        open_source(name, None, given)
    assert str(error.value) == f"{name}: opens no world here; {said}"


def test_ones_own_copy_of_such_a_launch_file_names_it_too():
    Path("generate_wamv.launch").write_text("<launch><arg name='wamv_target'/></launch>", encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        open_source("./generate_wamv.launch", None, {"wamv_target": "a.urdf"})
    said = "opens no world here; type: vrx-mj robot build -o a.urdf"
    assert str(error.value) == f"./generate_wamv.launch: {said}"
