"""Packages above a robot's file, and those of ROS's environment variables."""

from pathlib import Path

import pytest

from vrx_mj.config.search import PACKAGE_PATH, enclosing_packages, package_above, package_paths, workspace_packages
from vrx_mj.errors import ConfigError
from vrx_mj.formats.urdf.expand import Files, expand
from vrx_mj.formats.urdf.reader import MeshFiles, MissingMeshError

XACRO = '<robot name="cora" xmlns:xacro="http://www.ros.org/wiki/xacro">{0}</robot>'
INCLUDE = XACRO.format('<xacro:include filename="$(find {0})/xacro/hull.xacro"/>')


@pytest.fixture
def place(tmp_path, monkeypatch):
    for name in (PACKAGE_PATH, "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home" / "anna"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(file: Path, text: str = "") -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def package(folder: Path, name: str) -> Path:
    write(folder / "package.xml", f"<package><name>{name}</name></package>")
    write(folder / "xacro" / "hull.xacro", XACRO.format(f'<link name="{name}"/>'))
    return folder


@pytest.mark.parametrize("inside", ["", "urdf", "urdf/models"])
@pytest.mark.parametrize("listed", [True, False])
def test_a_file_finds_the_package_that_it_lies_in(place, inside, listed):
    folder = package(place / "boats" / "cora_description", "cora_description")
    if not listed:
        (folder / "package.xml").unlink()
    file = write(folder / inside / "cora.xacro", INCLUDE.replace("{0}", "cora_description"))
    assert '<link name="cora_description"/>' in expand(file)


def test_a_package_goes_by_its_name_and_by_its_folders(place):
    folder = package(place / "checkout", "cora_description")
    assert enclosing_packages(folder / "urdf") == {"checkout": folder, "cora_description": folder}


@pytest.mark.parametrize(("levels", "near"), [(4, True), (5, False)])
def test_a_package_is_at_most_four_folders_above(place, levels, near):
    folder = package(place / "boats", "boats")
    assert (enclosing_packages(folder.joinpath(*levels * ["urdf"])) == {"boats": folder}) == near
    assert (package_above(folder.joinpath(*levels * ["urdf"]), "boats") == folder) == near
    ours, theirs = (package(place.joinpath("src", *(levels - 1) * ["d"], name), name) for name in ("ours", "theirs"))
    assert workspace_packages(ours) == {"ours": ours, "theirs": theirs}
    sources = package(place / "src" / "far", "far")
    assert workspace_packages(ours) == {"ours": ours, "theirs": theirs} | ({"far": sources} if near else {})


@pytest.mark.parametrize(
    ("inside", "name"),
    [
        ("home/anna/urdf", "anna"),  # the user's home
        ("home/anna/urdf", "home"),
        ("boats/private/urdf", "boats"),  # `private` is no folder of a package
        ("boats/urdf/xacro/urdf/xacro/urdf", "boats"),  # too far up
        ("boats/urdf", ".."),
    ],
)
def test_no_other_folder_above_is_a_package(place, inside, name):
    assert package_above(place / inside, name) is None
    file = write(place / inside / "boat.xacro", INCLUDE.replace("{0}", name))
    with pytest.raises(ConfigError, match="no package named"):
        expand(file)


def test_a_user_without_a_home_has_packages_too(place, monkeypatch):
    monkeypatch.setattr("os.path.expanduser", lambda path: path)  # as in a container, for a number without a name
    assert package_above(place / "boats" / "urdf", "boats") == place / "boats"


def test_meshes_of_the_package_that_a_urdf_lies_in_are_found(place):
    mesh = write(place / "boats" / "cora_description" / "meshes" / "hull.stl")
    files = MeshFiles(place / "boats" / "cora_description" / "urdf")
    assert files.find("package://cora_description/meshes/hull.stl") == (mesh.parents[1], "meshes/hull.stl")
    with pytest.raises(MissingMeshError):  # which nobody called a package
        files.find("../meshes/hull.stl")
    package(mesh.parents[1], "cora_description")
    files.folder.mkdir()
    assert MeshFiles(files.folder).find("../meshes/hull.stl") == (mesh.parents[1], "meshes/hull.stl")


def test_ros_1s_packages_are_found_below_the_entries_of_its_path(place, monkeypatch):
    folder = package(place / "ws" / "src" / "vendor" / "hulls", "hull_models")
    package(folder / "examples" / "inner", "inner")  # ROS looks for no package in a package
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{place / 'nothing'}:{place / 'ws'}:relative")
    assert package_paths() == (folder,)
    file = write(place / "elsewhere" / "boat.xacro", INCLUDE.replace("{0}", "hull_models"))
    assert '<link name="hull_models"/>' in expand(file, package_paths=package_paths())


@pytest.mark.parametrize(("most", "found"), [(0, ""), (1, ""), (2, "c"), (3, "cb"), (4, "cba")])
def test_only_so_many_folders_are_searched(place, monkeypatch, most, found):
    for name in "abc":
        package(place / "ws" / name, f"hull_{name}")
    monkeypatch.setattr("vrx_mj.config.search._MOST_FOLDERS", most)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(place / "ws"))
    assert package_paths() == tuple(place / "ws" / name for name in found)


def test_ros_2s_packages_are_in_the_share_of_each_prefix(place, monkeypatch):
    package(place / "install" / "share" / "hull_models", "hull_models")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{place / 'install'}:{place / 'nothing'}")
    assert package_paths() == (place / "install" / "share",)
    file = write(place / "elsewhere" / "boat.xacro", INCLUDE.replace("{0}", "hull_models"))
    assert '<link name="hull_models"/>' in expand(file, package_paths=package_paths())


def test_our_own_variable_goes_first(place, monkeypatch):
    package(place / "ws" / "cora_description", "cora_description")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(place / "ws"))
    monkeypatch.setenv(PACKAGE_PATH, str(place / "mine"))
    assert package_paths() == (place / "mine", place / "ws")


def test_an_argument_that_is_missing_can_be_given_beside_the_file(place):
    file = write(place / "boat.xacro", XACRO.format('<link name="$(arg hull)"/>'))
    with pytest.raises(ConfigError) as caught:
        expand(file)
    assert str(caught.value) == (
        "boat.xacro:1:76: <link>: $(arg hull): no argument named 'hull'; known: none; "
        "or give it in the YAML beside the file: `arguments: {hull: ...}`"
    )


def test_a_xacro_and_its_meshes_are_of_the_same_package(tmp_path):
    """The folder that a file lies in comes before those along the paths."""
    own, other = tmp_path / "boats" / "bay", tmp_path / "paths" / "bay"
    for folder in (own / "urdf", other):
        folder.mkdir(parents=True)
    for folder in (own, other):
        (folder / "hull.stl").write_bytes(b"")
    paths = [tmp_path / "paths"]
    assert Files(own / "urdf" / "bay.xacro", {}, paths).package("bay") == own
    assert MeshFiles(own / "urdf", {}, paths).find("package://bay/hull.stl") == (own, "hull.stl")
