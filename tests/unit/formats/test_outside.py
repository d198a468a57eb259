"""Files that name others outside of their folder: whatever their kind, what is in those is not read."""

import os
import sys
import warnings
from pathlib import Path

import pytest

from vrx_mj.errors import VrxError
from vrx_mj.formats.gazebo.launch import read_launch
from vrx_mj.formats.gazebo.sdf_boats import read_boat
from vrx_mj.formats.gazebo.worlds import gazebo_world
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.formats.urdf.reader import read_mesh, read_urdf

MARK = "mark7263"
"""It is in each file outside."""
XACRO = '<robot name="a" xmlns:xacro="http://ros.org/wiki/xacro">{}</robot>'
VISUAL = (
    '<link name="hull"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    '<visual><geometry><mesh filename="{}"/></geometry></visual></link>'
)
SDF = '<sdf version="1.9"><{0} name="a">{1}</{0}></sdf>'
SHAPE = '<link name="hull"><collision name="c"><geometry><mesh><uri>{}</uri></mesh></geometry></collision></link>'
CUBE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
PICTURE = '<library_images><image id="p"><init_from>{}</init_from></image></library_images>'
USED = {
    ".xacro": expand,
    ".urdf": lambda file: read_urdf(file.read_text(encoding="utf-8"), file),
    ".sdf": read_boat,
    ".world": gazebo_world,
    ".launch": lambda file: read_launch(file, {}),
    ".obj": read_mesh, ".dae": read_mesh, ".gltf": read_mesh,
}  # fmt: skip
CASES = {
    "xacro includes": ("a.xacro", XACRO.format('<xacro:include filename="{}"/>'), "b.xacro"),
    "xacro loads": ("a.xacro", XACRO.format("<b c=\"${{xacro.load_yaml('{}')}}\"/>"), "b.yaml"),
    "xacro opens": ("a.xacro", XACRO.format("<b c=\"${{open('{}').read()}}\"/>"), "b.txt"),
    "urdf mesh": ("a.urdf", XACRO.format(VISUAL.format("{}")), "b.obj"),
    "urdf mesh by URI": ("a.urdf", XACRO.format(VISUAL.format("file://{}")), "b.obj"),
    "sdf mesh": ("a.sdf", SDF.format("model", SHAPE), "b.obj"),
    "sdf mesh by URI": ("a.sdf", SDF.format("model", SHAPE.format("file://{}")), "b.obj"),
    "sdf includes": ("a.sdf", SDF.format("model", "<include><uri>file://{}</uri></include>"), "b.sdf"),
    "world includes": ("a.world", SDF.format("world", "<include><uri>{}</uri></include>"), "b.sdf"),
    "world includes by URI": ("a.world", SDF.format("world", "<include><uri>file://{}</uri></include>"), "b.sdf"),
    "entity": ("a.world", '<!DOCTYPE a [<!ENTITY e SYSTEM "{}">]><sdf>&e;</sdf>', "b.txt"),
    "launch includes": ("a.launch", '<launch><include file="{}"/></launch>', "b.launch"),
    "launch parameters": ("a.launch", '<launch><rosparam command="load" file="{}"/></launch>', "b.yaml"),
    "launch text": ("a.launch", '<launch><param name="robot_description" textfile="{}"/></launch>', "b.urdf"),
    "launch expression": ("a.launch", "<launch><arg name='a' value=\"$(eval open('{}').read())\"/></launch>", "b.txt"),
    "obj": ("a.obj", f"mtllib {{}}\n{CUBE}", "b.mtl"),
    "dae": ("a.dae", f"<COLLADA>{PICTURE}</COLLADA>", "b.png"),
    "gltf": ("a.gltf", '{{"asset": {{"version": "2.0"}}, "buffers": [{{"uri": "{}", "byteLength": 4}}]}}', "b.bin"),
}  # fmt: skip
"""A file, what is in it with {} for the path of another, and the name of that one."""
OUTSIDE = {
    ".sdf": SDF.format("model", f'<link name="{MARK}"/>'), ".launch": f'<launch><arg name="{MARK}"/></launch>',
    ".xacro": XACRO.format(f'<link name="{MARK}"/>'), ".urdf": XACRO.format(f'<link name="{MARK}"/>'),
    ".obj": f"o {MARK}\n{CUBE}", ".yaml": f"{MARK}: {MARK}",
}  # fmt: skip
_opened: list[str] = []


@pytest.fixture(scope="module", autouse=True)
def _hook():
    sys.addaudithook(lambda event, given: _opened.append(str(given[0])) if event == "open" else None)


@pytest.mark.parametrize("way", ["absolute", "above", "link"])
@pytest.mark.parametrize("case", CASES)
def test_a_file_outside_is_not_read(case, way, tmp_path, monkeypatch):
    """By its path, and through a link that lies in the folder."""
    name, text, other = CASES[case]
    secret, folder = tmp_path / "outside" / other, tmp_path / "folder"
    secret.parent.mkdir()
    folder.mkdir()
    monkeypatch.chdir(folder)
    secret.write_text(OUTSIDE.get(secret.suffix, MARK), encoding="utf-8")
    (folder / other).symlink_to(secret)
    Path(name).write_text(
        text.format({"absolute": secret, "above": f"../outside/{other}", "link": other}[way]), encoding="utf-8"
    )
    _opened.clear()
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            said = repr(USED[Path(name).suffix](Path(name)))
        except VrxError as error:
            said = str(error)
    assert MARK not in said
    assert not any(MARK in str(one.message) for one in warned)
    assert os.fspath(secret.resolve()) not in {os.path.realpath(path) for path in _opened}
