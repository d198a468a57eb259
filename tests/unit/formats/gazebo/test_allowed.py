"""Folders that a user allows: what lies in them may be named by any file, and nothing else outside may be read."""

import warnings
from pathlib import Path

import pytest

from urdf_boats import INERTIA
from vrx_mj.config.search import ALLOW, MISSING, OWN_PATH
from vrx_mj.config.world import load_world
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.foreign import ask
from vrx_mj.formats.gazebo.launch import read_launch
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.mjcf.compile import compile_world
from workspaces import MESH

BOAT = f"""<robot name="b"><link name="base_link"><inertial><mass value="9"/>{INERTIA}</inertial>
<collision><geometry><mesh filename="../meshes/hull.stl"/></geometry></collision></link></robot>"""
XACRO = """<robot name="b" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:include filename="%s"/></robot>"""
EMPTY_WORLD = """<launch><include file="$(find gazebo_ros)/launch/empty_world.launch">
<arg name="world_name" value="%s"/></include></launch>"""


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """A home with boats beside worlds, in the latter of which one is."""
    for name, text in {
        "worlds/bay.yaml": "extends: ocean\n",
        "worlds/bay.world": '<sdf version="1.6"><world name="bay"/></sdf>',
        "worlds/own.launch": EMPTY_WORLD % "../worlds/bay.world",
        "boats/urdf/boat.urdf": BOAT,
        "boats/urdf/robot.yaml": "urdf: ./boat.urdf\n",
        "boats/urdf/part.xacro": '<robot xmlns:xacro="http://ros.org/wiki/xacro"/>',
        "boats/meshes/hull.stl": MESH,
        "boats/bay.world": '<sdf version="1.6"><world name="bay"/></sdf>',
        "secret/part.xacro": '<robot xmlns:xacro="http://ros.org/wiki/xacro"/>',
        "secret/boat.urdf": BOAT,
        "secret/robot.yaml": "urdf: ./boat.urdf\n",
        "secret/bay.world": '<sdf version="1.6"><world name="bay"/></sdf>',
        "secret/meshes/hull.stl": MESH,
    }.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path / "worlds")
    monkeypatch.delenv(MISSING, raising=False)
    monkeypatch.setenv(OWN_PATH, str(tmp_path / "boats"))
    return tmp_path


def fleet(robot):
    """The file of a fleet with a boat."""
    Path("fleet.yaml").write_text(f"boats: [{{robot: {robot}, pose: [0, 0, 0, 0, 0, 0]}}]\n", encoding="utf-8")
    return "fleet.yaml"


def in_yaml(path):
    """A boat that a fleet names, whose mesh lies beside its folder."""
    with warnings.catch_warnings(action="ignore", category=VrxWarning):
        return compile_world("ocean", fleet=fleet(path.format("urdf/boat.urdf")))


def in_yaml_folder(path):
    """The same by its folder."""
    with warnings.catch_warnings(action="ignore", category=VrxWarning):
        return compile_world("ocean", fleet=fleet(path.format("urdf")))


def in_launch(path):
    """A launch file's world."""
    Path("my.launch").write_text(EMPTY_WORLD % path.format("bay.world"), encoding="utf-8")
    return read_launch(Path("my.launch"), {})


def in_xacro(path):
    """A part of a xacro, which the sandboxed process opens."""
    Path("my.xacro").write_text(XACRO % path.format("urdf/part.xacro"), encoding="utf-8")
    return expand(Path("my.xacro"))


WAYS = (in_yaml, in_yaml_folder, in_launch, in_xacro)


@pytest.mark.parametrize("read", WAYS)
@pytest.mark.parametrize("start", ["../boats", "absolute", "link"])
def test_what_is_allowed_may_be_named(home, read, start):
    if start == "link":
        Path("link").symlink_to(home / "boats")
    read(f"{home / 'boats' if start == 'absolute' else start.replace('link', './link')}/{{}}")


@pytest.mark.parametrize("read", WAYS)
@pytest.mark.parametrize("start", ["../secret", "absolute", "link", "../boats/link"])
def test_what_is_beside_it_may_not(home, read, start):
    (home / "secret/urdf").symlink_to(".")
    if start.endswith("link"):
        Path(start).symlink_to(home / "secret")
    path = f"{home / 'secret' if start == 'absolute' else start if start[0] == '.' else f'./{start}'}/{{}}"
    with pytest.raises(VrxError) as refused:
        read(path)
    assert ALLOW in str(refused.value)


def test_a_mesh_that_leads_out_of_an_allowed_folder_is_not_read(home):
    (home / "boats/meshes/hull.stl").unlink()
    (home / "boats/meshes/hull.stl").symlink_to(home / "secret/meshes/hull.stl")
    with pytest.raises(VrxError, match="is outside the folders that may be read") as refused:
        compile_world("ocean", fleet=fleet("../boats/urdf/boat.urdf"))
    assert ALLOW in str(refused.value)


def test_the_process_without_rights_opens_no_more_than_it_is_told(home):
    job, told = "formats.urdf.expansion:expand", ({}, {}, {}, [])
    (home / "worlds/my.xacro").write_text(XACRO % f"{home}/secret/part.xacro", encoding="utf-8")
    with pytest.raises(VrxError, match="may not read"):
        ask(
            job,
            None,
            home / "worlds/my.xacro",
            *told,
            returns=object,
            about="it",
            reads=[home / "worlds", home / "boats"],
        )


def test_without_the_variable_nothing_is_allowed(monkeypatch):
    monkeypatch.delenv(OWN_PATH)
    for read in WAYS:
        with pytest.raises(VrxError, match=ALLOW):
            read("../boats/{}")
    assert read_launch(Path("own.launch"), {}).world  # its own folder, whatever way leads there
    assert load_world("bay.yaml").folder == Path.cwd()


TEAM = """<launch>
  <include file="$(find vrx_gazebo)/launch/vrx.launch"/>
  <include file="$(find velodyne_driver)/launch/vrx.launch"/>
  <param name="second" textfile="$(find second_boat)/urdf/wamv_gazebo.urdf"/>
  <node pkg="gazebo_ros" type="spawn_model" name="s" args="-urdf -param second -model b2"/>
</launch>"""


def test_a_launch_file_opens_without_packages_that_are_missing(monkeypatch):
    Path("team.launch").write_text(TEAM, encoding="utf-8")
    with pytest.raises(VrxError, match=r"no package named 'velodyne_driver'; .*, or --missing ignore\)"):
        read_launch(Path("team.launch"), {})
    monkeypatch.setenv(MISSING, "ignore")
    launch = read_launch(Path("team.launch"), {})
    assert (launch.world, [boat.name for boat in launch.boats]) == ("example_course", ["wamv"])
    assert [(note.place.line, note.what, note.ours) for note in launch.report.notes if note.fate == "not read"] == [
        (3, "<include> vrx.launch", "no package named 'velodyne_driver'"),
        (5, "<node> 'b2'", "no package named 'second_boat'"),
    ]


def test_a_world_of_a_package_that_is_missing_is_an_error(monkeypatch):
    monkeypatch.setenv(MISSING, "ignore")
    Path("my.launch").write_text(EMPTY_WORLD % "$(find bays)/worlds/bay.world", encoding="utf-8")
    with pytest.raises(VrxError, match="no package named 'bays', which would contain it"):
        read_launch(Path("my.launch"), {})
