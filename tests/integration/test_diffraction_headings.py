"""Wave forces on a hull in any heading, against Capytaine with its mesh turned."""

import json
import math

import numpy as np
import pytest
import trimesh

from needs import CAPYTAINE, needs
from vrx_mj import Simulation, compile_world
from vrx_mj.adapters.hydro import hydro_of_hull, panel_hull

GRAVITY, DENSITY, MASS, PERIOD, AMPLITUDE = 9.81, 1025.0, 4100.0, 3.0, 0.01
OMEGA = 2.0 * math.pi / PERIOD
AHEAD = 0.5
"""Of the hull's middle from the link's origin, so that every moment has a side [m]."""
PLACE = 1.7, -0.9
URDF = f"""<robot name="box"><link name="base_link"><inertial><origin xyz="{AHEAD} 0 0"/><mass value="{MASS}"/>
<inertia ixx="1500" iyy="6000" izz="7000" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="{AHEAD} 0 0"/><geometry><box size="4 2 1"/></geometry></collision></link></robot>"""
BOX = trimesh.creation.box((4.0, 2.0, 1.0)).apply_translation((AHEAD, 0.0, 0.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A robot with a file of 16 frequencies, of which that of the wave is one, and of 12 angles."""
    path = tmp_path_factory.mktemp("box")
    table = hydro_of_hull(
        np.array(BOX.triangles), 0.0, (0.3, 0.0, 0.1), density=DENSITY, gravity=GRAVITY, frequencies=16,
        highest=2.0 * OMEGA, panels=250, tolerance=None, angles=12,
    )  # fmt: skip
    (path / "box.json").write_text(json.dumps(table), encoding="utf-8")
    (path / "box.urdf").write_text(URDF, encoding="utf-8")
    none = "[0, 0, 0, 0, 0, 0]"
    hull = f"hull: {{hydro: box.json, damping_linear: {none}, damping_quadratic: {none}}}"
    (path / "box.yaml").write_text(f"urdf: box.urdf\n{hull}\n", encoding="utf-8")
    return path


def theirs(heading, toward):
    """Diffraction and Froude-Krylov force per metre of wave (2, 6), world axes, about the centre of mass."""
    capytaine = pytest.importorskip("capytaine")
    turn = trimesh.transformations.rotation_matrix(heading, (0, 0, 1))
    vertices, faces, _ = panel_hull(np.array(BOX.copy().apply_transform(turn).triangles), 250)
    mesh = capytaine.Mesh(vertices=vertices, faces=faces).immersed_part()
    dofs = capytaine.rigid_body_dofs(rotation_center=turn[:3, 0] * AHEAD)
    body = capytaine.FloatingBody(mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=dofs, name="box")
    problem = capytaine.DiffractionProblem(body=body, omega=OMEGA, wave_direction=toward, rho=DENSITY, g=GRAVITY)
    scattered = capytaine.BEMSolver(method="direct").solve(problem).forces
    undisturbed = capytaine.bem.airy_waves.froude_krylov_force(problem)
    motions = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
    return np.array([[forces[motion] for motion in motions] for forces in (scattered, undisturbed)])


def ours(heading, toward):
    """The same in a run: a force is that of the time at which its step ends."""
    towards = [math.cos(toward), math.sin(toward)]
    sea = {"model": "regular", "height": 2.0 * AMPLITUDE, "period": PERIOD, "direction": towards}
    world = {"name": "tank", "physics": {"profile": "marine", "gravity": GRAVITY}, "wind": {"objects": []}, "sea": sea}
    pose = [*PLACE, 0.0, 0.0, 0.0, heading]
    sim = Simulation(compile_world(world | {"spawn": {"robot": "./box.urdf", "pose": pose}}))
    (boat,) = sim.boats
    found, wave, times = [], [], []
    for _ in range(60):
        sim.set_boat(boat, pose=pose, velocity=[0.0] * 6)
        forces, time = sim.forces(boat), sim.time + sim.timestep
        found.append([forces["diffraction"], forces["hydrostatics"]])
        wave.append(float(sim.sea.height(*PLACE, time)))
        times.append(time)
        sim.step(duration=0.05)
    turn = np.exp(1j * OMEGA * np.array(times))
    return np.tensordot(turn, np.array(found), 1) / (turn @ np.array(wave))


@needs(CAPYTAINE)
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("heading", "toward"), [(0, 0), (60, 0), (60, 90), (-130, 50)])
def test_wave_forces_in_any_heading_are_those_on_a_turned_mesh(folder, monkeypatch, heading, toward):
    monkeypatch.chdir(folder)
    angles = math.radians(heading), math.radians(toward)
    expected, found = theirs(*angles), ours(*angles)
    for kind in range(2):
        for half in (slice(0, 3), slice(3, 6)):
            apart = np.linalg.norm(found[kind, half] - expected[kind, half])
            assert apart < 0.02 * np.linalg.norm(expected[kind, half])
