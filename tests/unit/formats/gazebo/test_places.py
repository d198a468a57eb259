"""Where files are looked for, and in which order: docs/vrx.md, row by row. Each place is emptied once it was found."""

import shutil
from pathlib import Path

import pytest

from vrx_mj.config.search import package_paths
from vrx_mj.errors import VrxError
from vrx_mj.formats.gazebo.launch import launch_of
from vrx_mj.formats.gazebo.models import PATHS, model_file
from vrx_mj.formats.gazebo.worlds import gazebo_world
from vrx_mj.formats.urdf.expand import Files, own_packages
from vrx_mj.formats.urdf.reader import MeshFiles

PAGE = Path(__file__).parents[4] / "docs/vrx.md"
MODEL = '<sdf version="1.6"><model name="m"><static>true</static><link name="l"/></model></sdf>'


@pytest.fixture
def near(tmp_path, monkeypatch):
    """The folder of a file in a package of a workspace, and all variables that lead elsewhere."""
    folder = tmp_path / "ws/src/mine/worlds"
    folder.mkdir(parents=True)
    for package in ("ws/src/mine", "ws/src/other", "ros/any", "prefix/share/any"):
        written(tmp_path / package / "package.xml", f"<package><name>{Path(package).name}</name></package>")
    for key in PATHS:
        monkeypatch.setenv(key, str(tmp_path / key))
    for key, place in (("VRX_MJ_PACKAGE_PATH", "own"), ("ROS_PACKAGE_PATH", "ros"), ("AMENT_PREFIX_PATH", "prefix")):
        monkeypatch.setenv(key, str(tmp_path / place))
    monkeypatch.chdir(tmp_path)
    return folder


def written(file, text):
    """Write a file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")


def found_in_turn(places, find):
    """The places in which something is found, one after the other."""
    found = []
    while (place := find()) is not None:
        found.append(place)
        shutil.rmtree(place)
        assert len(found) <= len(places)
    return found


def test_models_are_looked_for_in_the_order_of_the_page(near, tmp_path):
    beside = [near / "m", near / "models/m", near.parent / "models/m", near.parent / "m"]
    paths = [tmp_path / key / "m" for key in PATHS]
    packages = [tmp_path / place / below for place in ("own", "ros", "prefix/share", "ws/src/other")
                for below in ("m", "models/m")]  # fmt: skip
    for place in (places := [*beside, *paths, *packages]):
        written(place / "model.sdf", MODEL)

    def find():
        try:
            return model_file("model://m", near).parent
        except VrxError:
            return None

    assert found_in_turn(places, find) == places


@pytest.mark.parametrize("kind", ["xacro and launch files", "meshes"])
def test_packages_are_looked_for_in_the_order_of_the_page(near, tmp_path, kind):
    packages = [tmp_path / "own/p", tmp_path / "ros/p", tmp_path / "prefix/share/p", near / "p", tmp_path / "ws/src/p"]
    for place in packages:
        written(place / "hull.stl", "")
        written(place / "package.xml", "<package><name>p</name></package>")

    def find():
        if kind == "meshes":
            try:
                folder, name = MeshFiles(near, {}, package_paths()).find("package://p/hull.stl")
            except VrxError:
                return None
            return (folder / name).parent
        return Files(near / "bay.launch", {}, package_paths()).package("p")

    assert found_in_turn(packages, find) == packages


def test_the_package_that_a_file_lies_in_comes_first_and_ours_last(near, tmp_path):
    written(tmp_path / "own/mine/package.xml", "<package><name>mine</name></package>")
    files = Files(near / "bay.launch", {}, package_paths(), own_packages())
    assert files.package("mine") == near.parent
    assert files.package("wamv_gazebo") == own_packages()["wamv_gazebo"]
    written(near.parents[1] / "wamv_gazebo/package.xml", "<package><name>wamv_gazebo</name></package>")
    assert Files(near / "bay.launch", {}, package_paths(), own_packages()).package("wamv_gazebo") == (
        near.parents[1] / "wamv_gazebo"
    )


def test_objects_of_ours_come_first_in_worlds(near):
    written(near / "models/polyform_a3/model.sdf", MODEL)
    include = "<include><uri>model://polyform_a3</uri></include>"
    written(near / "bay.world", f'<sdf version="1.6"><world name="bay">{include}</world></sdf>')
    (thing,) = gazebo_world(near / "bay.world").section["objects"]
    assert thing["model"] == "polyform_a3"
    assert model_file("model://polyform_a3", near) == near / "models/polyform_a3/model.sdf"


def test_a_launch_file_of_vrx_is_ours_where_no_such_file_is_at_hand(near, monkeypatch):
    monkeypatch.chdir(near)
    assert launch_of("vrx.launch", {}).world == "example_course"
    written(near / "vrx.launch", "<launch/>")
    assert launch_of("vrx.launch", {}).world is None


def test_the_page_names_all_variables():
    text = PAGE.read_text(encoding="utf-8")
    start = text.index("### Where files are looked for")
    section = text[start : text.index("\n### ", start + 1)]
    keys = (*PATHS, "VRX_MJ_PACKAGE_PATH", "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "VRX_MJ_PATH", "VRX_MJ_MISSING")
    places = [section.find(key) for key in keys]
    assert min(places) >= 0
    assert places[: len(PATHS)] == sorted(places[: len(PATHS)])
