"""What commands print and write: the words and numbers that they did."""

import numpy as np
import pytest
import trimesh
import typer

from fingerprints import check
from vrx_mj.cli import new_robot, program, robot
from vrx_mj.draw import boat_pictures
from vrx_mj.mjcf.flotation import hull_sheet


def box(length, beam, height, y=0.0):
    """A box with its bottom half under z = 0."""
    shape = trimesh.creation.box((length, beam, height))
    shape.apply_translation((0.1, y, 0.0))
    return shape


def wedge(length, beam, height, y=0.0):
    """A box whose bow and keel are narrow."""
    shape = box(length, beam, height, y)
    points = np.array(shape.vertices)
    points[:, 1] = y + (points[:, 1] - y) * np.where(points[:, 0] > 0.2, 0.2, 1.0) * np.where(
        points[:, 2] < 0, 0.6, 1.0
    )
    return trimesh.Trimesh(points, shape.faces)


HULLS = {
    "barge": (box(4.0, 2.0, 1.0), 3000.0, 2, None, 1.0),
    "keel": (wedge(3.0, 1.0, 0.8), 400.0, 1, "0.05,0,-0.1", 1.0),
    "catamaran": (trimesh.util.concatenate([wedge(4.0, 0.5, 0.6, y) for y in (-1.0, 1.0)]), 300.0, 4, None, 1.0),
    "small": (wedge(3000.0, 1000.0, 800.0), 400.0, 3, None, 0.001),
}


@pytest.mark.filterwarnings("ignore::vrx_mj.VrxWarning")
@pytest.mark.parametrize("name", HULLS)
def test_a_robot_of_a_mesh_is_what_it_was(name, tmp_path, monkeypatch, capsys):
    shape, mass, engines, center, scale = HULLS[name]
    drawn = []
    monkeypatch.setattr(boat_pictures, "draw_hull", lambda *given: drawn.append(given[:3]))
    monkeypatch.chdir(tmp_path)
    shape.export("hull.stl")
    new_robot.make_robot("boat", tmp_path / "hull.stl", mass, engines, center, scale)
    files = {
        file.name: file.read_text(encoding="utf-8").split() for file in sorted((tmp_path / "boat").glob("*.[yu]*"))
    }
    meshes = [trimesh.load(file).vertices for file in sorted((tmp_path / "boat").glob("*.stl"))]
    printed = [line.split() for line in capsys.readouterr().out.splitlines()]
    check("commands", f"new robot {name}", files=files, meshes=meshes, printed=printed, drawn=drawn, rounding=1e-6)


def test_meshes_are_simplified_beyond_a_thousand_triangles():
    for subdivisions, factor in ((3, (3.0, 1.0, 0.5)), (4, (1.0, 1.0, 2.0))):
        ball = trimesh.creation.icosphere(subdivisions=subdivisions)
        corners = np.array(ball.triangles) * factor
        found = new_robot.simplify(corners)
        assert len(found) <= 1000 < len(corners)
        check(
            "commands",
            f"simplified {subdivisions}",
            count=len(found),
            corners=np.sort(found.round(6).ravel()),
            rounding=1e-6,
        )
    assert new_robot.simplify(corners[:1000]) is not None
    assert len(new_robot.simplify(corners[:1000])) == 1000


def test_sheets_of_hulls_are_what_they_were():
    for name, (shape, mass, *_) in HULLS.items():
        if name != "small":
            sheet = hull_sheet(np.array(shape.triangles), mass, (0.0, 0.1, -0.2), 1000.0)
            check(
                "commands", f"sheet {name}", lines=[line.split() for line in robot._sheet_lines(sheet)], rounding=1e-6
            )


def printed(capsys, *lines):
    """Codes of command lines, and the words that they print."""
    command = typer.main.get_command(program.app)
    codes = []
    for line in lines:
        try:
            codes.append(program._code(command, line.split()))
        except SystemExit as end:
            codes.append(end.code)
    said = capsys.readouterr()
    return codes, [line.split() for line in (said.out + said.err).splitlines()]


def test_parts_are_what_they_were(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "160")
    check("commands", "parts", said=printed(capsys, "robot parts", "robot parts wamv_camera --rules jazzy"))


PARTS = {
    "c.yaml": "wamv_camera: [{name: front, x: 0.75}, {name: back, x: -0.9, y: 0.6}]\nwamv_gps: [{name: gps}]\n",
    "t.yaml": "engine: [{prefix: left, position: -2.373776 1.027135 0.318237}, {prefix: far, position: -9 1 0.3}]\n",
}


def test_verdicts_are_what_they_were(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.chdir(tmp_path)
    for name, text in PARTS.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    files = ("--components c.yaml", "--thrusters t.yaml", "--components c.yaml --thrusters t.yaml --rules jazzy")
    check("commands", "verdicts", said=printed(capsys, *(f"robot check {words}" for words in files)))
