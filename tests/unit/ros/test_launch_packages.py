"""Packages for roslaunch: whole, well-formed, by the table of VRX's launch files, and never over others' files."""

import os
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from vrx_mj.cli.nodes import COMMANDS, PROGRAMS
from vrx_mj.config.search import package_name
from vrx_mj.errors import VrxError
from vrx_mj.formats.gazebo.launch import launch_of
from vrx_mj.formats.gazebo.stock import PACKAGES, stock_launch, stock_launches
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.ros import launch_packages
from vrx_mj.ros.launch_packages import LIST, NODES, PACKAGE_NAMES, write_launch_packages

STOCK = [(package, launch) for package in PACKAGES for launch in stock_launches(package)]
IDS = [f"{package}/{launch.name}" for package, launch in STOCK]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("packages") / "ros"
    assert write_launch_packages(folder) == PACKAGE_NAMES
    return folder


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def launch_files(written):
    """Every launch file."""
    return sorted(written.rglob("*.launch"))


@pytest.mark.parametrize("name", PACKAGE_NAMES)
def test_a_package_has_its_name_and_its_programs_can_be_run(written, name):
    assert package_name(written / name) == name
    for node, place in NODES.get(name, {}).items():
        script = written / name / place
        assert script.read_text(encoding="utf-8").splitlines()[1].endswith(f'-m vrx_mj.cli.nodes {node} "$@"')
        assert os.access(script, os.X_OK)


def test_nodes_of_packages_are_those_that_there_are():
    assert {node for nodes in NODES.values() for node in nodes} == {*COMMANDS, *PROGRAMS}


def test_nodes_of_launch_files_are_in_their_packages(written):
    found = {(node.get("pkg"), node.get("type")) for file in launch_files(written)
             for node in ET.parse(file).getroot().iter("node")}  # fmt: skip
    own = {(file.parents[1].name, file.name) for file in written.glob("*/nodes/*") if os.access(file, os.X_OK)}
    commands = {(package, node) for package, nodes in NODES.items() for node in nodes}
    assert found - {("rviz", "rviz")} <= commands | own


@pytest.mark.parametrize(("package", "launch"), STOCK, ids=IDS)
def test_a_launch_file_takes_the_arguments_of_the_table(written, package, launch):
    root = ET.parse(written / package / "launch" / launch.name).getroot()
    defaults = {arg.get("name"): arg.get("default") for arg in root.findall("arg")}
    assert list(defaults) == list(dict.fromkeys(launch.arguments))
    assert {name: defaults[name] for name in launch.own} == dict(launch.own)
    (node,) = root.findall("node")
    given = {word.partition(":=")[0] for word in shlex.split(node.get("args"))[1:]}
    assert given <= set(defaults)
    assert {"world", "urdf", "paused", "extra_gazebo_args", *launch.own} <= given


@pytest.mark.parametrize(("package", "launch"), STOCK, ids=IDS)
def test_a_written_launch_file_starts_what_the_table_says(written, monkeypatch, package, launch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(written))
    one = launch_of(str(written / package / "launch" / launch.name), {})
    other = launch_of(f"{launch.package}/{launch.name}", {})
    assert one.world == other.world == launch.world
    spawned = [(boat.name, boat.pose, boat.robot, boat.arguments) for boat in one.boats]
    assert spawned == [(boat.name, boat.pose, boat.robot, boat.arguments) for boat in other.boats]
    assert len(spawned) == len(launch.boats)


def test_launch_files_of_two_packages_with_one_name_differ():
    assert stock_launch("vrx.launch").world == stock_launch("vrx", "vrx_gazebo").world == "example_course"
    assert stock_launch("vrx.launch", "vrx_2019").world == "vrx2019/example_course"
    assert stock_launch("sandisland.launch", "vrx_gazebo").package == "vrx_2019"


def test_files_of_others_that_include_them_start_the_same(written, monkeypatch, tmp_path):
    text = '<launch><include file="$(find {})/launch/{}.launch"><arg name="x" value="7"/></include></launch>'
    for package, name in (("vrx_gazebo", "sandisland"), ("vrx_2019", "vrx"), ("vrx_gazebo", "vrx")):
        (tmp_path / "mine.launch").write_text(text.format(package, name), encoding="utf-8")
        monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
        without = launch_of("mine.launch", {})
        monkeypatch.setenv("ROS_PACKAGE_PATH", str(written))
        with_packages = launch_of("mine.launch", {})
        assert with_packages.world == without.world
        assert [boat.pose for boat in with_packages.boats] == [boat.pose for boat in without.boats]
        assert without.boats[0].pose[0] == 7.0


def test_the_boat_of_the_package_expands_to_ours(written, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(written))
    from vrx_mj.resources import root

    arguments = {"namespace": "cat", "thruster_config": "X", "gps_enabled": "true"}
    ours = root() / "assets/robots/wamv/wamv_gazebo/urdf/wamv_gazebo.urdf.xacro"
    copied = written / "wamv_gazebo/urdf/wamv_gazebo.urdf.xacro"
    assert expand(copied, arguments=arguments) == expand(ours, arguments=arguments)


def test_writing_again_changes_nothing(written):
    before = {file: file.read_bytes() for file in written.rglob("*") if file.is_file()}
    write_launch_packages(written)
    assert {file: file.read_bytes() for file in written.rglob("*") if file.is_file()} == before


def test_files_of_others_are_never_overwritten(tmp_path):
    theirs = tmp_path / "vrx_gazebo/launch/vrx.launch"
    theirs.parent.mkdir(parents=True)
    theirs.write_text("<launch/>", encoding="utf-8")
    with pytest.raises(VrxError) as caught:
        write_launch_packages(tmp_path)
    assert str(caught.value) == (f"{theirs} exists and is not of this command, or was changed: choose another folder")
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == [theirs]


def test_a_file_in_the_place_of_the_folder_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(VrxError) as caught:
        write_launch_packages(tmp_path / "file")
    assert str(caught.value) == f"cannot write the packages '{tmp_path}/file/{next(iter(made()))}': Not a directory"


def made():
    """Files that are written, in their order."""
    return launch_packages.launch_packages()


@pytest.mark.parametrize("text", ["[]", "{", '{"vrx_gazebo/../../x": ""}', '{"/etc/passwd": ""}', '{"other/x": ""}'])
def test_a_list_that_is_not_ours_is_named(tmp_path, text):
    (tmp_path / LIST).write_text(text, encoding="utf-8")
    with pytest.raises(VrxError) as caught:
        write_launch_packages(tmp_path)
    assert str(caught.value) == f"{tmp_path / LIST} was not written by this command: choose another folder"


def test_a_path_that_a_list_of_paths_cannot_hold_is_named(tmp_path):
    with pytest.raises(VrxError) as caught:
        write_launch_packages(tmp_path / "a:b")
    assert str(caught.value) == (
        f"invalid folder of packages '{tmp_path / 'a:b'}': ':' in a path separates entries of a list"
    )


def test_a_folder_that_is_read_only_is_named(tmp_path):
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    tmp_path.chmod(0o555)
    with pytest.raises(VrxError, match=r"cannot write the packages '.*': Permission denied"):
        write_launch_packages(Path(tmp_path) / "new")
