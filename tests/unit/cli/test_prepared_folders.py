"""Commands that fill folders, in folders that a stranger prepared: nothing outside is written, changed or removed."""

import json
import os
import re
import shutil
import subprocess
from hashlib import sha256
from pathlib import Path

import pytest

import vrx_mj
from vrx_mj.cli.program import COMMANDS, load_command
from vrx_mj.errors import VrxError
from vrx_mj.outputs import write_files
from vrx_mj.ros import packages
from vrx_mj.ros.packages import PACKAGE_LIST

MADE = "made"
FOLDERS = {
    "compile": "compile harbour.yaml -o made",
    "import": "import boat.urdf -o made",
    "new": "new robot made",
    "trial": "trial decay skiff -o made",
    "validate": "validate --only airy -o made",
    "campaign": "campaign crew:steady --worlds harbour.yaml --duration 0.1 --record --restart -o made",
    "convert": "convert run.rrd made",
    "replay": "replay run.rrd --coco made",
    "robot build": "robot build -o made/boat.urdf --mjcf made/boat.xml",
    "worlds generate": "worlds generate axes.yaml -o made",
    "ros packages": "ros packages -o made",
    "ros messages": "ros messages -o made",
}
"""Every command that writes more than the one file it is given the name of, with words by which it fills `made`."""
FILES = {
    "demo", "run", "view", "list", "map", "score", "compare", "robot check", "robot hydro", "robot parts",
    "robot show", "doctor", "bench", "serve", "teleop",
}  # fmt: skip
"""The others; `run` makes the folder of a bag as `convert` does."""
SLOW = {"ros packages", "ros messages", "campaign", "convert", "replay", "trial", "validate", "robot build"}
SOURCES = Path(vrx_mj.__file__).parent
OWN = {
    "outputs.py",
    "cli/program.py",  # of a help page
    "cli/robot.py",
    "recording/exports.py",
    "runtime/state.py",
    "formats/gazebo/sdf_objects.py",  # temporary folders of our own, made anew
    "formats/parts/read.py",
    "recording/parts.py",
    "cli/bench.py",
    "draw/map.py",  # to where `atomic_write` says
    "ros/packages.py",
    "ros/ros_server.py",
}
"""Modules that may write files themselves."""
RAFT = """<robot name="boat"><link name="base_link"><inertial><mass value="20"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><mesh filename="meshes/hull.obj"/></geometry></visual>
  <collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>
"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def commands(found, above=""):
    """Names of a program's commands, those of groups after the group's."""
    for name, one in found.items():
        yield from commands(one.commands, f"{name} ") if hasattr(one, "commands") else [above + name]


def test_every_command_is_in_one_of_the_lists():
    assert sorted([*FOLDERS, *FILES]) == sorted(commands({name: load_command(name) for name in COMMANDS}))


def test_nothing_else_writes_files():
    found = {
        file.relative_to(SOURCES).as_posix()
        for file in SOURCES.rglob("*.py")
        if re.search(r"\.(write_text|write_bytes|copyfile|copytree|copy2)\(", file.read_text(encoding="utf-8"))
    }
    assert found == OWN, "write by vrx_mj.outputs; what has a reason not to is in OWN"


@pytest.fixture
def sources(folder):
    """What the commands read."""
    (folder / "harbour.yaml").write_text(
        "extends: ocean\nobjects: [{name: a, model: post, pose: [9, 0, 0, 0, 0, 0]}]\n", encoding="utf-8"
    )
    (folder / "boat.urdf").write_text(RAFT, encoding="utf-8")
    (folder / "meshes").mkdir()
    (folder / "meshes/hull.obj").write_text(TETRAHEDRON, encoding="utf-8")
    (folder / "crew.py").write_text("def steady(obs, t):\n    return {}\n", encoding="utf-8")
    (folder / "axes.yaml").write_text("a:\n  steps: 1\n  macros:\n    ocean_waves: [{period: 4}]\n", encoding="utf-8")


def seen(folder):
    """All that is in a folder: what links lead to, contents, times and places on the disk of files."""
    return {
        path.relative_to(folder).as_posix(): (
            str(path.readlink()) if path.is_symlink() else path.is_dir() or path.read_bytes(),
            path.lstat().st_mtime_ns if path.is_file() else 0,
        )
        for path in folder.rglob("*")
    }


def chosen(names):
    """At most four of some names, the first and the last among them."""
    names = sorted(names)
    return names if len(names) < 5 else [names[round(index * (len(names) - 1) / 3)] for index in range(4)]


def places(made):
    """Files and folders in what a command has made, each of which a stranger may have made a link."""
    found = [path for path in made.rglob("*") if not path.name.endswith(".log")]
    return [*chosen(path for path in found if path.is_dir()), *chosen(path for path in found if path.is_file())]


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in FOLDERS
    ],
)  # fmt: skip
def test_no_command_follows_a_link_in_its_folder(cli, folder, sources, monkeypatch, name):
    monkeypatch.setattr(packages, "_interpreter", lambda *_: ("genpy", {}))  # files of other generators are like ours
    monkeypatch.setattr(packages, "_run", lambda *words: subprocess.CompletedProcess(words, 0))
    words = FOLDERS[name].split()
    if name in {"convert", "replay"}:
        assert cli("run", "ocean", "--duration", 0.1, "--record", "run.rrd").code == 0
    first = cli(*words)
    assert first.code in {0, 1}, first.err
    made, outside, kept = folder / MADE, folder / "outside", folder / "kept"
    made.rename(kept)
    for place in (path.relative_to(kept) for path in places(kept)):
        shutil.copytree(kept, made, symlinks=True)
        outside.mkdir()
        victim = outside / "victim"
        (made / place).rename(victim)
        (made / place).symlink_to(victim)
        before = seen(outside)
        said = cli(*words)
        assert seen(outside) == before, f"{place} was a link"
        assert "Traceback" not in said.err
        assert said.code in {0, 1} or "is a link" in said.err or "exists" in said.err, said.err
        for each in (made, outside):
            shutil.rmtree(each)


@pytest.mark.parametrize("name", ["../a", "/a", "a/../../b", ".", ""])
def test_paths_out_of_the_folder_are_refused(tmp_path, name):
    with pytest.raises(VrxError) as caught:
        write_files(tmp_path / "in", {"first": "", name: ""}, "the things")
    folder = tmp_path / "in"
    assert str(caught.value) == f"cannot write the things '{folder / name}': it is not inside of the folder"
    assert list(tmp_path.iterdir()) == []


def test_the_folder_itself_may_be_a_link(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there")
    write_files(tmp_path / "link", {"a/b.txt": "text"}, "the things")
    assert (tmp_path / "there/a/b.txt").read_text(encoding="utf-8") == "text"


@pytest.mark.parametrize("made", ["made", "made.yaml"])
def test_a_start_file_is_not_written_through_a_link_that_leads_nowhere(cli, folder, made):
    (folder / made).symlink_to(folder / "nowhere")
    said = cli("new", "world" if made.endswith("yaml") else "robot", "made")
    assert (said.code, said.err) == (2, f"{made} exists: choose another name, or remove it\n")
    assert not (folder / "nowhere").exists()


DEEP = "[" * 200_000
MANY = json.dumps({f"vrx_gazebo/{number}": "0" * 64 for number in range(20_000)})


@pytest.mark.parametrize(
    "text",
    [DEEP, MANY, '"a"', '{"vrx_gazebo/a": 1}', '{"vrx_gazebo//a": ""}', '{"vrx_gazebo/a\\u0000": ""}', "\xff",
     json.dumps({"vrx_gazebo/./a": "0" * 64}), json.dumps({"vrx_gazebo\\..\\a": "0" * 64})],
)  # fmt: skip
def test_lists_that_we_do_not_write(cli, folder, text):
    (folder / MADE).mkdir()
    (folder / MADE / PACKAGE_LIST).write_text(text, encoding="latin-1")
    said = cli("ros", "packages", "-o", MADE)
    assert (said.code, said.out) == (2, "")
    assert said.err == f"{folder / MADE / PACKAGE_LIST} was not written by this command: choose another folder\n"


def test_a_forged_list_removes_nothing_outside(cli, folder):
    raw = b"a diary"
    (folder / "outside").mkdir()
    (folder / "outside/diary").write_bytes(raw)
    (folder / MADE).mkdir()
    (folder / MADE / "xacro").symlink_to(folder / "outside")
    (folder / MADE / PACKAGE_LIST).write_text(json.dumps({"xacro/diary": sha256(raw).hexdigest()}), encoding="utf-8")
    said = cli("ros", "packages", "-o", MADE)
    assert said.code == 2
    link = os.path.realpath(folder / MADE / "xacro")
    assert "is a link; remove it" in said.err
    assert Path(link, "diary").read_bytes() == raw
