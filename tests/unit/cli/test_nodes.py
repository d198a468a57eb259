"""Nodes of the packages for roslaunch: which command lines they run, by roslaunch's words."""

import subprocess
import sys
from pathlib import Path

import pytest

from vrx_mj.cli.nodes import NODES
from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.ros.packages import write_launch_packages

HOME = Path("/home/team")


def test_relative_paths_begin_in_the_folder_of_roslaunch():
    words = ["vrx_2019/sandisland.launch", "world:=bay.world", "urdf:=/tmp/boat.urdf", "x:=1", "namespace:="]
    assert NODES["vrx_mj_serve"](words, HOME) == [
        ["serve", "vrx_2019/sandisland.launch", "world:=/home/team/bay.world", "urdf:=/tmp/boat.urdf", "x:=1"]
    ]


@pytest.mark.parametrize(("given", "options"), [("true", ["--paused"]), ("1", ["--paused"]), ("false", []), ("", [])])
def test_paused_is_an_option(given, options):
    words = ["vrx_gazebo/vrx.launch", f"paused:={given}"]
    assert NODES["vrx_mj_serve"](words, HOME) == [["serve", "vrx_gazebo/vrx.launch", *options]]


def test_options_of_serve_pass_and_those_of_gzserver_are_left_out_in_one_line(capsys):
    extra = "extra_gazebo_args:=-r --record_path /tmp/log --ros1 --rosbridge 9091 --verbose --record=run.rrd"
    (line,) = NODES["vrx_mj_serve"](["vrx_gazebo/vrx.launch", extra], HOME)
    assert line == ["serve", "vrx_gazebo/vrx.launch", "--ros1", "--rosbridge", "9091", "--record=run.rrd"]
    assert capsys.readouterr().err == (
        "extra_gazebo_args: -r --record_path /tmp/log --verbose ignored; only options of vrx-mj serve are used\n"
    )


def test_options_whose_value_is_left_out_take_no_other_option_for_it():
    extra = "extra_gazebo_args:=--localization --rosbridge 9091 --ros1"
    (line,) = NODES["vrx_mj_serve"](["vrx_gazebo/vrx.launch", extra], HOME)
    assert line[2:] == ["--localization", "--rosbridge", "9091", "--ros1"]


def test_options_with_an_open_quote_are_an_error():
    with pytest.raises(CommandError) as caught:
        NODES["vrx_mj_serve"](["vrx_gazebo/vrx.launch", "extra_gazebo_args:=--record 'run"], HOME)
    assert str(caught.value) == "invalid extra_gazebo_args '--record 'run': No closing quotation"


def test_a_world_of_the_packages_is_ours_and_has_no_boats(tmp_path):
    write_launch_packages(tmp_path)
    for package, stem, name in (
        ("vrx_gazebo", "sandisland", "sand_island"),
        ("vrx_2019", "example_course", "vrx2019/example_course"),
        ("vrx_gazebo", "example_course", "example_course"),
    ):
        words = [f"world_name:={tmp_path}/{package}/worlds/{stem}.world", "paused:=false"]
        assert NODES["gzserver"](words, HOME) == [["serve", name, "--fleet", "none"]]
    assert NODES["gzserver"](["world_name:=bay.world"], HOME) == [["serve", "/home/team/bay.world", "--fleet", "none"]]


def test_a_world_that_the_packages_lack_is_an_error(tmp_path):
    write_launch_packages(tmp_path)
    with pytest.raises(UnknownNameError, match="no world of VRX named 'sandyisland'"):
        NODES["gzserver"]([f"world_name:={tmp_path}/vrx_gazebo/worlds/sandyisland.world"], HOME)


def test_the_empty_world_of_gazebo_is_an_error():
    with pytest.raises(CommandError) as caught:
        NODES["gzserver"](["world_name:=worlds/empty.world"], HOME)
    assert str(caught.value) == (
        "no world: give empty_world.launch the path of one, as world_name:=$(find vrx_gazebo)/worlds/sandisland.world"
    )


def test_a_boat_is_built_and_checked():
    words = ["thruster_yaml:=/t.yaml", "component_yaml:=c.yaml", "sensor_yaml:=", "wamv_target:=out.urdf"]
    files = ["--thrusters", "/t.yaml", "--components", "/home/team/c.yaml"]
    assert NODES["generate_wamv.py"]([*words, "wamv_locked:=true"], HOME) == [
        ["robot", "build", *files, "--locked", "-o", "/home/team/out.urdf"],
        ["robot", "check", *files],
    ]
    (build, _) = NODES["generate_wamv.py"]([*words, "sensor_yaml:=s.yaml"], HOME)
    assert build[:6] == ["robot", "build", "--thrusters", "/t.yaml", "--components", "/home/team/s.yaml"]


@pytest.mark.parametrize(("x", "code"), [pytest.param("-5.0", 0, marks=pytest.mark.slow), ("far", 2)])
def test_a_boat_that_breaks_a_rule_ends_as_cleanly_as_with_vrx(tmp_path, x, code):
    engine = f'engine:\n  - prefix: left\n    position: "{x} 1.03 0.32"\n    orientation: "0 0 0"\n'
    (tmp_path / "t.yaml").write_text(engine, encoding="utf-8")
    (tmp_path / "c.yaml").write_text("", encoding="utf-8")
    words = ["thruster_yaml:=t.yaml", "component_yaml:=c.yaml", "wamv_target:=out.urdf"]
    ended = subprocess.run([sys.executable, "-m", "vrx_mj.cli.nodes", "generate_wamv.py", *words],
                           cwd=tmp_path, capture_output=True, encoding="utf-8", check=False)  # fmt: skip
    assert ended.returncode == code, ended.stderr
    assert (tmp_path / "out.urdf").exists() == (code == 0)
    assert ("1 of 1 parts break a rule" in ended.stdout) == (x == "-5.0")


@pytest.mark.parametrize(
    ("node", "words", "line"),
    [
        ("generate_worlds.py", ["requested:=a.yaml", "world_target:=out"],
         ["worlds", "generate", "/home/team/a.yaml", "-o", "/home/team/out"]),
        ("keydrive", ["namespace:=cat", "url:=ws://x:1"], ["teleop", "--boat", "cat", "--url", "ws://x:1"]),
        ("joydrive", ["namespace:=cat", "url:=ws://x:1", "port:=8"],
         ["teleop", "--boat", "cat", "--url", "ws://x:1", "--web", "8"]),
        ("playback", ["log_file:=run.rrd"], ["replay", "/home/team/run.rrd"]),
    ],
)  # fmt: skip
def test_others_are_one_command(node, words, line):
    assert NODES[node](words, HOME) == [line]


@pytest.mark.parametrize(("namespace", "words"), [("", []), ("/defender_a/", ["--boat", "defender_a"])])
def test_keys_of_a_namespace_drive_its_boat(monkeypatch, namespace, words):
    monkeypatch.setenv("ROS_NAMESPACE", namespace)
    assert NODES["teleop_twist_keyboard.py"]([], HOME) == [["teleop", *words]]


def test_what_is_not_supported_says_what_to_do(capsys):
    with pytest.raises(SystemExit) as ended:
        NODES["missing"](["rviz.launch", "type it yourself"], HOME)
    assert ended.value.code == 1
    assert capsys.readouterr().err == "rviz.launch is not supported: type it yourself\n"


XACRO = """<robot name="cat" xmlns:xacro="http://ros.org/wiki/xacro">
<xacro:arg name="namespace" default="wamv"/><link name="$(arg namespace)/base_link"/></robot>"""


def test_xacro_expands_by_arguments(tmp_path, capsys):
    (tmp_path / "cat.urdf.xacro").write_text(XACRO, encoding="utf-8")
    assert NODES["xacro"](["--inorder", "cat.urdf.xacro", "namespace:=defender_a"], tmp_path) == []
    assert '<link name="defender_a/base_link"/>' in capsys.readouterr().out
    assert NODES["xacro"](["cat.urdf.xacro", "-o", "cat.urdf"], tmp_path) == []
    assert '<link name="wamv/base_link"/>' in (tmp_path / "cat.urdf").read_text(encoding="utf-8")


def test_xacro_without_a_file_is_an_error(tmp_path):
    with pytest.raises(CommandError) as caught:
        NODES["xacro"](["namespace:=x"], tmp_path)
    assert str(caught.value) == "xacro needs one file, got 0: xacro FILE NAME:=VALUE"
