"""Packages for roslaunch: whole, well-formed, by the table of VRX's launch files, and never over others' files."""

import os
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from vrx_mj.cli import nodes as programs
from vrx_mj.config.search import package_name, root
from vrx_mj.errors import VrxError
from vrx_mj.formats.gazebo.launch import launch_of
from vrx_mj.formats.gazebo.launched import PACKAGES, named_world, stock_launch, stock_launches
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.ros import packages
from vrx_mj.ros.packages import NODES, PACKAGE_LIST, PACKAGE_NAMES, put_files, write_launch_packages

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


def test_our_files_in_the_place_of_others_packages_are_there(written):
    """Launch files of teams include these of `vrx_gazebo`, `wamv_gazebo` and others."""
    own = root() / "assets/ros"
    files = {file.relative_to(own) for file in own.rglob("*") if file.is_file()}
    assert {file.parts[0] for file in files} >= {"vrx_gazebo", "wamv_gazebo"}
    assert files <= {file.relative_to(written) for file in written.rglob("*") if file.is_file()}


def test_nodes_of_packages_are_those_that_there_are():
    assert {node for names in NODES.values() for node in names} == set(programs.NODES)


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
    spawned = [(boat.name, boat.pose, boat.model, boat.arguments) for boat in one.boats]
    assert spawned == [(boat.name, boat.pose, boat.model, boat.arguments) for boat in other.boats]
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
    from vrx_mj.packages import root

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
    assert str(caught.value) == (f"{theirs} exists and is not as this command wrote it: choose another folder")
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == [theirs]


def test_a_file_in_the_place_of_the_folder_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(VrxError) as caught:
        write_launch_packages(tmp_path / "file")
    assert str(caught.value) == f"cannot write the packages '{tmp_path}/file/{next(iter(made()))}': Not a directory"


def made():
    """Files that are written, in their order."""
    return packages.launch_packages()


@pytest.mark.parametrize("text", ["[]", "{", '{"vrx_gazebo/../../x": ""}', '{"/etc/passwd": ""}', '{"other/x": ""}'])
def test_a_list_that_is_not_ours_is_named(tmp_path, text):
    (tmp_path / PACKAGE_LIST).write_text(text, encoding="utf-8")
    with pytest.raises(VrxError) as caught:
        write_launch_packages(tmp_path)
    assert str(caught.value) == f"{tmp_path / PACKAGE_LIST} was not written by this command: choose another folder"


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


MY_LAUNCH = """<launch>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(find vrx_gazebo)/worlds/%s.world"/>
  </include>
  <param name="d" command="$(find xacro)/xacro $(find wamv_gazebo)/urdf/wamv_gazebo_my.urdf.xacro"/>
  <node name="s" pkg="gazebo_ros" type="spawn_model" args="-urdf -param d -model cat"/>
</launch>
"""
THEIRS = {
    "vrx_gazebo/package.xml": "<package><name>vrx_gazebo</name></package>",
    "vrx_gazebo/launch/vrx.launch": "<launch/>",
    "vrx_gazebo/launch/my.launch": MY_LAUNCH % "my_bay",
    "vrx_gazebo/launch/course.launch": MY_LAUNCH % "example_course",
    "vrx_gazebo/worlds/my_bay.world.xacro": '<sdf version="1.6"><world name="my_bay"/></sdf>',
    "vrx_gazebo/worlds/example_course.world": '<sdf version="1.6"><world name="theirs"/></sdf>',
    "vrx_gazebo/nodes/my_node.py": "#!/usr/bin/env python3\n",
    "vrx_gazebo/nodes/generate_wamv.py": "#!/usr/bin/env python3\n",
    "vrx_gazebo/.git": "",
    "wamv_gazebo/package.xml": "<package><name>wamv_gazebo</name></package>",
    "wamv_gazebo/urdf/wamv_gazebo_my.urdf.xacro": '<robot name="my" xmlns:xacro="http://ros.org/wiki/xacro"/>',
    "wamv_gazebo/models/hull/hull.dae": "",
    "team/package.xml": "<package><name>team</name></package>",
}


@pytest.fixture
def workspace(tmp_path):
    """A workspace with VRX's packages, in which a user has put files."""
    for name, text in THEIRS.items():
        file = tmp_path / "ws/src/vrx" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return tmp_path / "ws"


def links(folder):
    """Links in a folder, and what they lead to."""
    return {link.relative_to(folder).as_posix(): link.readlink() for link in folder.rglob("*") if link.is_symlink()}


def test_files_of_a_workspace_are_there_by_links(workspace, tmp_path):
    top = tmp_path / "packages"
    for _ in range(2):  # the second call writes through no link of the first
        write_launch_packages(top, workspace)
        assert links(top) == {
            name: workspace / "src/vrx" / name
            for name in (
                "vrx_gazebo/launch/course.launch", "vrx_gazebo/launch/my.launch", "vrx_gazebo/nodes/my_node.py",
                "vrx_gazebo/worlds", "wamv_gazebo/models", "wamv_gazebo/urdf/wamv_gazebo_my.urdf.xacro",
            )
        }  # fmt: skip
    write_launch_packages(top)
    assert links(top) == {}
    kept = {name: (workspace / "src/vrx" / name).read_text(encoding="utf-8") for name in THEIRS}
    assert kept == THEIRS
    assert len([file for file in workspace.rglob("*") if file.is_file()]) == len(THEIRS)


def test_a_link_of_the_users_own_is_never_removed(workspace, tmp_path):
    top = tmp_path / "packages"
    write_launch_packages(top, workspace)
    (top / "vrx_gazebo/worlds").unlink()
    (top / "vrx_gazebo/worlds").symlink_to(tmp_path)
    with pytest.raises(VrxError, match="is a link; remove it"):
        write_launch_packages(top, workspace)
    assert (top / "vrx_gazebo/worlds").readlink() == tmp_path


def test_a_launch_file_behind_a_link_starts_the_users_own_world_and_boat(workspace, tmp_path, monkeypatch):
    write_launch_packages(tmp_path / "packages", workspace)
    monkeypatch.setenv("ROS_PACKAGE_PATH", os.pathsep.join(map(str, (tmp_path / "packages", workspace / "src"))))
    launch = launch_of(str(tmp_path / "packages/vrx_gazebo/launch/my.launch"), {})
    theirs = workspace / "src/vrx"
    assert launch.world == theirs / "vrx_gazebo/worlds/my_bay.world.xacro"
    assert launch.boats[0].model.resolve() == theirs / "wamv_gazebo/urdf/wamv_gazebo_my.urdf.xacro"
    course = tmp_path / "packages/vrx_gazebo/launch/course.launch"
    assert launch_of(str(course), {}).world == theirs / "vrx_gazebo/worlds/example_course.world"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "packages"))  # as roslaunch gives paths to vrx-mj serve
    worlds = tmp_path / "packages/vrx_gazebo/worlds"
    assert named_world(f"{worlds}/my_bay.world") == theirs / "vrx_gazebo/worlds/my_bay.world.xacro"
    assert named_world(f"{worlds}/example_course.world") == "example_course"


def test_a_workspace_without_such_packages_is_named(tmp_path):
    with pytest.raises(VrxError, match=r"^no package vrx_gazebo, .*, xacro in workspace '.*/nowhere'$"):
        write_launch_packages(tmp_path / "packages", tmp_path / "nowhere")


def test_links_may_be_in_folders_that_hold_nothing_else(tmp_path):
    put_files({"own/a.txt": b"text"}, tmp_path, {}, "list.json", {"other/deep/link": tmp_path / "own"})
    assert (tmp_path / "other/deep/link/a.txt").read_bytes() == b"text"
