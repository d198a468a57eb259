import json
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from typer.testing import CliRunner

from needs import CATKIN, ROS1_MESSAGES, needs, require
from vrx_mj.cli.program import app
from vrx_mj.errors import NetworkError, VrxError
from vrx_mj.packages import needs_extra
from vrx_mj.ros import packages
from vrx_mj.ros.messages import DEFINITIONS, encode, md5sum, new, service_md5sum
from vrx_mj.ros.packages import PYTHON, write_packages

NAMES = (
    "gazebo_msgs", "geographic_msgs", "nmea_msgs", "robot_localization", "robotx_gazebo", "tf2_web_republisher",
    "trajectory_msgs", "usv_gazebo_plugins", "usv_msgs", "uuid_msgs",
    "vision_msgs", "vrx_gazebo", "vrx_mj_msgs",
)  # fmt: skip
pytestmark = [pytest.mark.slow, needs(ROS1_MESSAGES)]

THEIRS = """
import glob, importlib, io, json, os, sys
told = {}
for file in sorted(glob.glob(os.path.join(sys.argv[1], "*", "*", "_[A-Z]*.py"))):
    package, kind, name = file[:-3].split(os.sep)[-3:]
    one = getattr(importlib.import_module(package + "." + kind), name[1:])
    assert os.path.samefile(sys.modules[one.__module__].__file__, file)
    empty = io.BytesIO()
    for each in (one,) if kind == "msg" else (one._request_class, one._response_class):
        each().serialize(empty)
    told[package + "/" + name[1:]] = kind, one._md5sum, empty.getvalue().hex()
json.dump(told, sys.stdout)
"""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder with a space in its path, and what a shell's environment is after the lines were pasted."""
    folder = tmp_path_factory.mktemp("some messages") / "vrx"
    done = CliRunner().invoke(app, ["ros", "messages", "-o", str(folder)])
    assert done.exit_code == 0, done.output
    inherited = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS_", "VIRTUAL"))
    }
    pasted = subprocess.run(
        ["bash", "-uc", f"{done.stdout}\nenv -0"], env=inherited, capture_output=True, encoding="utf-8", check=True
    )
    return folder, dict(part.split("=", 1) for part in pasted.stdout.split("\0") if part)


def told(command, environment):
    tool = shutil.which(command[0], path="/usr/bin")
    assert tool is not None
    done = subprocess.run(
        [tool, *command[1:]], env=environment, capture_output=True, encoding="utf-8", timeout=30, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_type_is_there_and_has_our_md5_and_our_bytes(written):
    folder, environment = written
    found = json.loads(told([PYTHON, "-B", "-c", THEIRS, str(folder / "python")], environment))
    expected = {}
    for package in NAMES:
        for file in (DEFINITIONS / package).iterdir():
            name = f"{package}/{file.stem}"
            if file.suffix == ".msg":
                expected[name] = ["msg", md5sum(name), encode(new(name), name).hex()]
            else:
                halves = (f"{name}Request", f"{name}Response")
                raw = b"".join(encode(new(half), half) for half in halves)
                expected[name] = ["srv", service_md5sum(name), raw.hex()]
    assert found == expected


@pytest.mark.parametrize(
    ("command", "answer"),
    [
        (["rosmsg", "md5", "vrx_gazebo/Task"], "8b3267cadc02a4d8846adeb79baa09a1\n"),
        (["rosmsg", "show", "vrx_gazebo/Task"], "string name\nstring state\ntime ready_time\n"),
        (
            ["rossrv", "show", "gazebo_msgs/DeleteModel"],
            "string model_name\n---\nbool success\nstring status_message\n",
        ),
    ],
)
def test_debians_tools_find_them(written, command, answer):
    _, environment = written
    assert told(command, environment).startswith(answer)


def test_packages_that_were_found_before_are_found_first(written):
    """VRX's own vrx_gazebo, or that of `ros packages`, has launch files; that of the messages has none."""
    exports = write_packages(written[0]).exports
    script = f"export ROS_PACKAGE_PATH=/theirs\n{exports[1]}\necho $ROS_PACKAGE_PATH"
    assert told(["bash", "-c", script], {}) == f"/theirs:{written[0]}/share\n"


def test_the_pasted_lines_leave_vrx_mj_itself_importable(written):
    _, environment = written
    done = told([sys.executable, "-c", "import vrx_mj.errors as e; print(e.__file__)"], environment)
    assert Path(done.strip()).parts[-2:] == ("vrx_mj", "errors.py")


def test_catkin_reads_their_manifests(written):
    folder, environment = written
    script = "import sys\nfrom catkin_pkg.packages import find_packages\nprint(*sorted(find_packages(sys.argv[1])))"
    require(CATKIN)
    assert told([PYTHON, "-c", script, str(folder / "share")], environment).split() == list(NAMES)


def test_catkin_is_told_to_build_every_definition_and_what_it_needs(written):
    for name in NAMES:
        check_build_files(written[0] / "share" / name, name)


def check_build_files(share, name):
    text = (share / "CMakeLists.txt").read_text("utf-8")
    listed = re.findall(r"^add_(message|service)_files\(FILES (.*)\)$", text, re.M)
    folders = {"message": "msg", "service": "srv"}
    files = {f"{folders[kind]}/{file}" for kind, words in listed for file in words.split()}
    assert files == {f"{file.suffix[1:]}/{file.name}" for file in share.glob("*/*.*")}
    manifest = ET.parse(share / "package.xml").getroot()
    uses = [one.text for one in manifest.findall("depend")]
    assert f"find_package(catkin REQUIRED COMPONENTS message_generation {' '.join(uses)})" in text
    assert f"project({name})" in text
    assert f"generate_messages(DEPENDENCIES {' '.join(uses)})" in text
    assert f"catkin_package(CFG_EXTRAS ${{extras}} CATKIN_DEPENDS message_runtime {' '.join(uses)})" in text


def test_writing_again_changes_nothing_and_what_we_no_longer_write_goes(written, tmp_path):
    before = tmp_path / "messages"
    shutil.copytree(written[0], before)
    contents = {file: file.read_bytes() for file in before.rglob("*") if file.is_file()}
    old = before / "share/usv_msgs/msg/Old.msg"
    old.write_bytes(b"int8 x\n")
    listed = json.loads((before / packages.MESSAGE_LIST).read_text(encoding="utf-8"))
    listed["share/usv_msgs/msg/Old.msg"] = packages._sha256(old)
    (before / packages.MESSAGE_LIST).write_text(json.dumps(listed), encoding="utf-8")
    assert write_packages(before).packages == NAMES
    assert {file: file.read_bytes() for file in before.rglob("*") if file.is_file()} == contents


def test_files_of_others_are_never_overwritten(tmp_path):
    theirs = tmp_path / "share/vrx_gazebo/msg/Task.msg"
    theirs.parent.mkdir(parents=True)
    theirs.write_text("string mine\n", encoding="utf-8")
    with pytest.raises(VrxError) as caught:
        write_packages(tmp_path)
    assert str(caught.value) == (f"{theirs} exists and is not as this command wrote it: choose another folder")
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == [theirs]
    assert theirs.read_text(encoding="utf-8") == "string mine\n"


def test_a_list_that_is_not_ours_is_told(tmp_path, subtests):
    own = tmp_path / packages.MESSAGE_LIST
    for text in ("[]", "{", '{"share/../../x": ""}', '{"/etc/passwd": ""}'):
        with subtests.test(text):
            own.write_text(text, encoding="utf-8")
            with pytest.raises(VrxError) as caught:
                write_packages(tmp_path)
            assert str(caught.value) == f"{own} was not written by this command: choose another folder"


def test_packages_that_the_interpreter_has_are_left_out(tmp_path, monkeypatch):
    (tmp_path / "ros/usv_msgs").mkdir(parents=True)
    (tmp_path / "ros/usv_msgs/__init__.py").touch()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "ros"))
    done = write_packages(tmp_path / "out")
    assert done.left_out == {"usv_msgs": str(tmp_path / "ros/usv_msgs/__init__.py")}
    assert not (tmp_path / "out/share/usv_msgs").exists()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "out/python"))  # as after pasting the lines
    assert write_packages(tmp_path / "out").packages == NAMES


def test_without_genpy_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(packages, "PYTHON", "/nowhere/python3")
    monkeypatch.setattr(packages.shutil, "which", lambda _name: sys.executable)
    with pytest.raises(NetworkError) as caught:
        write_packages(tmp_path)
    assert str(caught.value) == (
        f"message packages are generated by genpy, which /nowhere/python3 and {sys.executable} cannot import: "
        "apt-get install python3-genpy python3-rospy python3-geometry-msgs python3-std-msgs"
    )


def test_a_path_that_a_list_of_paths_cannot_hold_is_told(tmp_path):
    with pytest.raises(VrxError) as caught:
        write_packages(tmp_path / "a:b")
    assert str(caught.value) == (
        f"invalid folder of packages '{tmp_path / 'a:b'}': ':' in a path separates entries of a list"
    )


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(VrxError, match=r"cannot write the packages '.*file.*': Not a directory"):
        write_packages(tmp_path / "file")


def test_without_rosbags_the_error_names_the_extra(tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("vrx_mj.ros.")]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("rosbags", "rosbags.interfaces", "rosbags.typesys"):
        monkeypatch.setitem(sys.modules, name, None)
    done = CliRunner().invoke(app, ["ros", "messages", "-o", str(tmp_path)])
    assert str(done.exception) == needs_extra("a ROS message", "rosbags", "ros1")
