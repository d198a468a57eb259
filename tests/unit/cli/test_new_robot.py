"""`vrx-mj new robot`: folders that sail, and boats of meshes that a script makes: a catamaran, a barge, a deep V."""

import re

import numpy as np
import pytest
import trimesh

import vrx_mj
from vrx_mj.cli.checks import CALM
from vrx_mj.cli.new_robot import simplify
from vrx_mj.config.shapes import enclosed_volume
from vrx_mj.draw import boat_pictures
from vrx_mj.mjcf.flotation import hull_sheet


def lofted(length, beam, depth, chine, y=0.0):
    """A hull with a V bottom up to a share `chine` of its depth, and a transom; the same to both sides."""
    shares = np.linspace(0.0, 1.0, 13)
    half = 0.5 * beam * (1.0 - 0.97 * np.maximum(0.0, (shares - 0.6) / 0.4) ** 2)
    keel = 0.5 * depth * np.maximum(0.0, (shares - 0.75) / 0.25) ** 2
    side = np.stack([np.zeros(13), 0.9 * half, half, np.zeros(13)], axis=1)
    z = np.stack([keel, keel + (depth - keel) * chine, np.full(13, depth), np.full(13, depth)], axis=1)
    x = np.repeat(length * (shares - 0.5)[:, None], 4, axis=1)
    rows = np.stack([x, side, z], axis=-1)
    faces = [(4 * k + i, 4 * k + i + 1, 4 * k + i + 4) for k in range(12) for i in range(3)]
    faces += [(4 * k + i + 1, 4 * k + i + 5, 4 * k + i + 4) for k in range(12) for i in range(3)]
    faces += [(0, 2, 1), (0, 3, 2), (48, 49, 50), (48, 50, 51)]
    port = rows.reshape(-1, 3)[np.array(faces)]
    whole = np.concatenate([port, (port * (1, -1, 1))[:, ::-1]]) + np.array([0.0, y, 0.0])
    mesh = trimesh.Trimesh(whole.reshape(-1, 3), np.arange(whole.size // 3).reshape(-1, 3))
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


HULLS = {
    "catamaran": (trimesh.util.concatenate([lofted(2.0, 0.26, 0.4, 0.12, y) for y in (0.4, -0.4)]), 80),
    "barge": (trimesh.creation.box((4.0, 2.0, 1.2)), 4100),
    "deep_v": (lofted(3.0, 1.0, 0.6, 0.45), 300),
}
"""Meshes, and the masses of their boats [kg]."""


@pytest.fixture
def made(cli, folder, monkeypatch):
    monkeypatch.setattr(boat_pictures, "draw_hull", lambda _corners, _center, _engines, file: file.touch())

    def make(name, *words):
        mesh, mass = HULLS[name]
        mesh.export(folder / f"{name}.stl")
        return cli("new", "robot", "boat", "--hull", f"{name}.stl", "--mass", mass, *words)

    return make


def under_way(folder):
    """Rates [rad/s] of a boat at equal full thrust in calm water, after one of 0.1 deg/s; last speed and heading."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(CALM, fleet=str(folder / "boat")))
    thrusts = {"wamv": dict.fromkeys(sim.observe()["wamv"].thrusters, 1.0)}
    seen = sim.step(thrusts, duration=20.0)["wamv"]
    pose = (0.0, 0.0, seen.position[2], seen.roll, seen.pitch, 0.0)
    sim.set_boat("wamv", pose=pose, velocity=(seen.velocity[0], 0.0, seen.velocity[2], 0.0, 0.0, np.radians(0.1)))
    found = []
    for _ in range(600):
        seen = sim.step(thrusts, duration=0.1)["wamv"]
        found.append(float(seen.angular_velocity[2]))
    return np.array(found), float(seen.velocity[0]), float(seen.heading)


@pytest.mark.parametrize("name", ["catamaran", "deep_v"])
def test_a_boat_of_a_mesh_keeps_its_course_at_its_speed(made, folder, name):
    said = made(name)
    assert (said.code, said.err) == (0, "")
    assert "it keeps a straight course at equal thrust: C = " in said.out
    rates, speed, heading = under_way(folder)
    promised = float(re.search(r" N for ([\d.]+) m/s", said.out)[1])
    assert speed == pytest.approx(promised, rel=0.02)
    assert (abs(rates[-1]) < np.radians(0.02), abs(heading) < np.radians(2.0)) == (True, True)


def test_the_barge_turns_as_fast_as_it_is_said_and_a_skeg_holds_it(made, folder):
    said = made("barge")
    doubling = float(re.search(r"a small turn doubles in ([\d.]+) s", said.out)[1])
    area = float(re.search(r"with a skeg of ([\d.]+) m2", said.out)[1])
    assert "it does not keep a straight course" in said.out
    rates, _, _ = under_way(folder)
    assert np.degrees(rates[-1]) > 2.0
    assert rates[130] / rates[100] == pytest.approx(2.0 ** (3.0 / doubling), rel=0.05)
    file = folder / "boat" / "robot.yaml"
    text = file.read_text(encoding="utf-8")
    skeg = re.search(r"^    # - {x: -2.0, z: -0.5, area: ([\d.]+), aspect_ratio: 1}$", text, re.MULTILINE)
    assert float(skeg[1]) == pytest.approx(area, rel=0.01)
    file.write_text(text.replace(skeg[0], skeg[0].replace("# ", "")), encoding="utf-8")
    rates, _, heading = under_way(folder)
    assert abs(rates[-1]) < 0.1 * np.radians(0.1)
    assert abs(heading) < np.radians(1.0)


def test_its_files_open_and_sail_without_a_word(made, cli, folder):
    assert made("catamaran", "--thrusters", "1", "--center", "-0.15,0,0.2").code == 0
    names = sorted(file.name for file in (folder / "boat").iterdir())
    assert names == ["boat.png", "boat.urdf", "hull1.stl", "hull2.stl", "robot.yaml"]
    for world in ("ocean", "sydney_regatta"):
        said = cli("run", world, "--fleet", "./boat", "--duration", "1", "--thrust", "engine=1,engine_angle=0.2")
        assert (said.code, said.err) == (0, "")


def test_a_fine_mesh_becomes_a_coarse_one_of_the_same_draft_and_volume():
    mesh, mass = HULLS["deep_v"]
    fine = mesh.copy()
    while len(fine.faces) < 2000:
        fine = fine.subdivide()
    simple = simplify(np.array(fine.triangles))
    drafts = [hull_sheet(np.array(each), mass, (0.0, 0.0, 0.2)).draft for each in (mesh.triangles, simple)]
    assert drafts[1] == pytest.approx(drafts[0], rel=0.02)
    assert len(simple) <= 1000
    assert enclosed_volume(simple) == pytest.approx(mesh.volume, rel=1e-6)


def test_without_a_hull_it_is_a_wamv_of_its_own_files(cli, folder):
    assert cli("new", "robot", "mine").out.endswith("vrx-mj run ocean --fleet './mine'\n")
    engines = folder / "mine" / "thruster_config.yaml"
    engines.write_text("engine: [{prefix: only, position: -2.4 0 0.3}]\n", encoding="utf-8")
    said = cli("run", "ocean", "--fleet", "./mine", "--duration", "1", "--thrust", "only=1")
    assert (said.code, said.err) == (0, "")
    (folder / "fleet.yaml").write_text("robot: ./mine\nusv_count: 2\nlayout: line\n", encoding="utf-8")
    assert cli("run", "ocean", "--fleet", "fleet.yaml", "--duration", "1").code == 0


@pytest.mark.filterwarnings("always")
def test_a_weight_that_is_too_high_is_said(made):
    said = made("catamaran", "--center", "0,0,3")
    assert said.err.startswith("warning: its centre of mass is 2.9")
    assert said.err.endswith(" m, and it capsizes\n")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["robot", "b", "--hull", "b.stl"], "--hull needs --mass, that of the whole boat [kg]"),
        (["world", "b", "--hull", "b.stl"], "--hull is for a robot, not for a world"),
        (["robot", "b", "--hull", "b.stl", "--mass", "0"], "invalid --mass '0': a number above 0 is needed"),
        (
            ["robot", "b", "--hull", "b.stl", "--mass", "9", "--thrusters", "5"],
            "invalid --thrusters '5': 1 to 4 is needed",
        ),
    ],
)
def test_boats_that_cannot_be(cli, words, message):
    said = cli("new", *words)
    assert (said.code, said.out, said.err) == (2, "", f"{message}\n")
