import importlib.metadata
import json
import os
import stat
from pathlib import Path

import mujoco
import pytest

from vrx_mj.cli import doctor
from vrx_mj.cli.doctor import Row, physics_rows
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.draw.display import Attempt
from vrx_mj.packages import install_command

FAILS = Attempt(False, "libEGL.so.1: cannot open shared object file")
DRAWS = Attempt(True, "llvmpipe")


def raises(error):
    def function(*_):
        raise error

    return function


def test_it_looks_at_everything_and_finds_the_core_working(cli):
    said = cli("doctor", "--json", "d.json")
    assert said.code == 0
    rows = json.loads(Path("d.json").read_text(encoding="utf-8"))
    assert {row["what"] for row in rows} >= {
        "vrx_mj", "python", "machine", "mujoco", "numba", "numpy", "rerun-sdk", "pydantic", "lxml",
        "trimesh", "compiled physics", "display", "cameras, by GPU or CPU (egl)", "cameras, by CPU (osmesa)",
        "window (glfw)", "rerun viewer", "ROS", "VRX_MJ_PATH", "PYTHONPATH", "free disk", "free memory", "cores",
    }  # fmt: skip
    assert {row["works"] for row in rows} <= {"yes", "no", "not needed"}
    assert [row["what"] for row in rows if row["works"] == "no" and not row["advice"]] == []
    assert "Everything that vrx_mj needs works." in said.out


def test_a_missing_core_package_fails_and_everything_else_is_still_shown(cli, monkeypatch):
    broken = Row("numba", "not installed", "no", install_command("numba>=0.68"), core=True)
    monkeypatch.setattr(doctor, "examine", lambda: [broken, Row("ROS", "none", "not needed")])
    said = cli("doctor")
    assert said.code == 1
    assert f"numba: {install_command('numba>=0.68')}" in said.out
    assert "vrx_mj cannot run here: see the rows marked no." in said.out


def test_what_the_core_does_not_need_fails_nothing():
    assert doctor.healthy([Row("a", "", "yes", core=True), Row("b", "", "no")])


def test_packages_that_work():
    found = importlib.metadata.version("numpy")
    assert doctor.package_row("numpy", "numpy") == Row("numpy", found, "yes", core=True)


def test_packages_that_do_not():
    numba = doctor.requirement("numba")
    missing = doctor.package_row("numba", "numba", version=raises(importlib.metadata.PackageNotFoundError()))
    assert missing == Row("numba", "not installed", "no", install_command(numba), core=True)
    old = doctor.package_row("numba", "numba", version=lambda _: "0.50.1")
    assert old == Row("numba", f"0.50.1, but {numba} is needed", "no", install_command(numba), core=True)
    broken = doctor.package_row(
        "numba", "numba", load=raises(ImportError("llvmlite: bad ELF\nmore")), version=lambda _: "0.70"
    )
    advice = f"{install_command(numba)} --force-reinstall"
    assert broken == Row("numba", "0.70, import fails: llvmlite: bad ELF", "no", advice, core=True)


@pytest.mark.parametrize(
    ("version", "wanted", "fits"),
    [("4.0.0", "mujoco<5,>=4.0", True), ("5.0.0", "mujoco<5,>=4.0", False), ("3.9.9", "mujoco>=4.0", False),
     ("0.41.0", "rerun-sdk<0.42,>=0.41", True), ("0.42.0", "rerun-sdk<0.42,>=0.41", False), ("10.0", "x>=9.1", True),
     ("2.1.0rc1", "numpy>=2.0", True), ("1", "anything", True)],
)  # fmt: skip
def test_versions_against_bounds(version, wanted, fits):
    assert doctor.is_allowed(version, wanted) is fits


def test_what_we_ask_for_is_what_the_project_says():
    assert doctor.requirement("rerun-sdk").startswith("rerun-sdk")
    assert doctor.is_allowed(importlib.metadata.version("rerun-sdk"), doctor.requirement("rerun-sdk"))
    assert doctor.requirement("rerun") == "rerun"


def test_what_equal_runs_need():
    (row,) = physics_rows()
    assert row.found == f"physics version {PHYSICS_VERSION}, core of MuJoCo {mujoco.mj_versionString()}"


def test_an_old_python():
    assert doctor.python_row((3, 10, 12)) == Row(
        "python", "3.10.12", "no", "Python 3.11 or newer, 64 bit, is needed: see docs/install.md", core=True
    )


def test_where_compiled_physics_is_kept(tmp_path):
    assert doctor.kernel_row(tmp_path, compiled=True) == Row("compiled physics", str(tmp_path), "yes")
    assert doctor.kernel_row(tmp_path, compiled=False) == Row(
        "compiled physics", f"not yet in {tmp_path}", "yes", "the first run compiles it, in about 20 s"
    )
    assert doctor.kernel_row(None, compiled=False) == Row(
        "compiled physics", "no folder can be used", "no",
        "set VRX_MJ_CACHE to a folder of your own, or every run starts with 20 s of compiling",
    )  # fmt: skip


def test_a_folder_that_is_not_safe_for_compiled_physics(tmp_path):
    refused = "no compiled kernels are read from /x or kept there: others can write to /x"
    row = doctor.kernel_row(tmp_path, compiled=True, refused=(refused,))
    assert (row.found, row.works) == (str(tmp_path), "yes")
    assert row.advice == f"{refused}: keep it to yourself (chmod go-w), or set VRX_MJ_CACHE."


def test_displays():
    page = "vrx-mj view opens in a browser instead"
    assert doctor.display_row({}, "linux") == Row("display", "none", "not needed", page)
    assert doctor.display_row({"DISPLAY": ":1"}, "linux") == Row("display", "DISPLAY=:1", "yes")
    assert doctor.display_row({}, "win32") == Row("display", "of the system", "yes")


def test_without_any_way_to_draw_both_are_advised():
    rows = doctor.drawing_rows({"egl": FAILS, "osmesa": FAILS, "glfw": FAILS}, has_display=False)
    assert list(rows) == [
        Row("cameras, by GPU or CPU (egl)", FAILS.detail, "no",
            "sudo apt-get install libegl1 libgl1-mesa-dri libopengl0"),
        Row("cameras, by CPU (osmesa)", FAILS.detail, "no", "sudo apt-get install libosmesa6 libopengl0"),
        Row("window (glfw)", "no display", "not needed"),
    ]  # fmt: skip


def test_one_way_to_draw_is_enough_and_a_display_wants_its_own():
    rows = doctor.drawing_rows({"egl": FAILS, "osmesa": DRAWS, "glfw": FAILS}, has_display=True)
    assert list(rows) == [
        Row("cameras, by GPU or CPU (egl)", FAILS.detail, "not needed"),
        Row("cameras, by CPU (osmesa)", "llvmpipe", "yes"),
        Row("window (glfw)", FAILS.detail, "no", "sudo apt-get install libgl1 libgl1-mesa-dri"),
    ]


@pytest.mark.skipif(os.name != "posix", reason="makes a shell script")
def test_the_viewer_of_rerun(tmp_path):
    tool = tmp_path / "rerun"
    tool.write_text("#!/bin/sh\necho rerun-cli 0.41.0 built today\n", encoding="utf-8")
    tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
    same = doctor.viewer_row(lambda: tool, lambda _: "0.41.0")
    other = doctor.viewer_row(lambda: tool, lambda _: "0.41.2")
    none = doctor.viewer_row(raises(OSError("no rerun viewer at '/x'")))
    again = f"{install_command(doctor.requirement('rerun-sdk'))} --force-reinstall"
    assert same == Row("rerun viewer", f"0.41.0, {tool}", "yes")
    assert other == Row("rerun viewer", "0.41.0, but the package is 0.41.2", "no", again)
    assert none == Row("rerun viewer", "no rerun viewer at '/x'", "no", f"{again}; recordings are written without it")


def test_ros():
    assert doctor.ros_row({}, lambda _: None) == Row("ROS", "none", "not needed")
    assert doctor.ros_row({"ROS_DISTRO": "noetic"}, lambda name: name == "rospy" or None) == Row(
        "ROS", "noetic, rospy", "yes"
    )
    assert doctor.ros_row({"ROS_DISTRO": "jazzy"}, lambda _: None) == Row(
        "ROS", "jazzy, without rospy and rclpy for this Python", "not needed"
    )


def test_search_paths(tmp_path):
    both = os.pathsep.join([str(tmp_path), "/no/such"])
    assert list(doctor.search_rows({"VRX_MJ_PATH": both, "VRX_MJ_PACKAGE_PATH": str(tmp_path)})) == [
        Row("VRX_MJ_PATH", both, "no", "no folder /no/such: remove it"),
        Row("VRX_MJ_PACKAGE_PATH", str(tmp_path), "yes"),
    ]
    assert {row.found for row in doctor.search_rows({})} == {"not set"}


def test_packages_of_ours_on_pythonpath_are_named(tmp_path):
    (tmp_path / "numpy").mkdir()
    (tmp_path / "yaml.py").touch()
    assert doctor.pythonpath_row({"PYTHONPATH": str(tmp_path)}) == Row(
        "PYTHONPATH", f"numpy in {tmp_path}, yaml in {tmp_path}", "yes",
        "vrx-mj uses the installed packages first; for your own scripts, unset PYTHONPATH",
    )  # fmt: skip
    assert doctor.pythonpath_row({}) == Row("PYTHONPATH", "not set", "not needed")


def test_room():
    assert doctor.room_row("disk", 3e8, 5e8, "make room") == Row("disk", "0.3 GB", "no", "make room")
    assert doctor.room_row("disk", 6e8, 5e8, "make room") == Row("disk", "0.6 GB", "yes")
    assert doctor.cores_row((8, 1.5)) == Row("cores", "8, limited to 1.5 at a time", "yes")
    assert doctor.cores_row((8, 8.0)) == Row("cores", "8", "yes")
