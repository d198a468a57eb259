"""Makes the table of the WAM-V in waves about as long as it, by Capytaine (extra `hydro`) alone: short_waves.csv.

    python assets/validation/make_short_waves.py

It takes two minutes: the hulls of the shipped boat without sensors, both in one run, are cut into 1690 panels.
"""

import csv
import math
from pathlib import Path

import mujoco
import numpy as np

from vrx_mj.adapters.hydro import panel_hull
from vrx_mj.mjcf.flotation import flotation
from vrx_mj.validation.setups import GRAVITY, marine_simulation

FILE = Path(__file__).parent / "short_waves.csv"
PERIODS, TOWARD, DENSITY, PANELS = (1.5, 2.0, 2.5, 3.0), (0, 90), 1025.0, 400
HEAD = """\
# Capytaine 3.0.0 by assets/validation/make_short_waves.py: direct method, 1690 panels under water on both hulls, with a
# lid; mass and inertia are the model's. Heave of the centre of mass per metre of wave; roll and pitch per slope k a.
"""


def main() -> None:
    """Write the table."""
    import capytaine

    sim = marine_simulation({"robot": "wamv", "boats": [{"name": "a", "pose": [0] * 6}], "sensors": "none"})
    vessel = sim.world.parameters.hulls[0].vessel
    corners = np.array(vessel.vertices)[np.array(vessel.triangles)]
    inertia, center = _inertia(sim.model)
    level = flotation(corners, inertia[0, 0] / DENSITY).level
    vertices, faces, _ = panel_hull(corners - (0.0, 0.0, level), PANELS)
    mesh = capytaine.Mesh(vertices=vertices, faces=faces).immersed_part()
    center = center - (0.0, 0.0, level)
    dofs = capytaine.rigid_body_dofs(rotation_center=center)
    body = capytaine.FloatingBody(mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=dofs, center_of_mass=center)
    with FILE.open("w", encoding="utf-8", newline="") as file:
        file.write(HEAD)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["period", "toward", "heave", "roll", "pitch"])
        for period in PERIODS:
            for toward in TOWARD:
                swings = _response(body, inertia, period, toward)
                writer.writerow([period, toward, *(f"{each:.4f}" for each in swings)])


def _inertia(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Inertia (6, 6) of all bodies about their centre of mass, and that [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = model.body_mass
    arms = data.xipos - mass @ data.xipos / mass.sum()
    turns = data.ximat.reshape(-1, 3, 3)
    own = np.einsum("nij,nj,nkj->ik", turns, model.body_inertia, turns)
    steiner = np.eye(3) * (mass @ np.square(arms).sum(axis=1)) - (arms * mass[:, None]).T @ arms
    whole = np.zeros((6, 6))
    whole[:3, :3], whole[3:, 3:] = mass.sum() * np.eye(3), own + steiner
    return whole, mass @ data.xipos / mass.sum() - data.qpos[:3]


def _response(body, inertia, period, toward):  # type: ignore[no-untyped-def]
    """Amplitudes of heave per amplitude, of roll and pitch per slope."""
    import capytaine
    from capytaine.bem.airy_waves import froude_krylov_force

    solver, omega = capytaine.BEMSolver(method="direct"), 2.0 * math.pi / period
    common = {"body": body, "omega": omega, "rho": DENSITY, "g": GRAVITY}
    motions = list(body.dofs)
    radiated = [solver.solve(capytaine.RadiationProblem(radiating_dof=motion, **common)) for motion in motions]
    added = np.array([[each.added_masses[motion] for each in radiated] for motion in motions])
    damping = np.array([[each.radiation_dampings[motion] for each in radiated] for motion in motions])
    problem = capytaine.DiffractionProblem(wave_direction=math.radians(toward), **common)
    scattered, krylov = solver.solve(problem).forces, froude_krylov_force(problem)
    force = np.array([scattered[motion] + krylov[motion] for motion in motions])
    stiffness = body.compute_hydrostatic_stiffness(rho=DENSITY, g=GRAVITY).values
    swing = np.abs(np.linalg.solve(stiffness - omega**2 * (inertia + added) - 1j * omega * damping, force))
    return swing[2:5] / (1.0, omega**2 / GRAVITY, omega**2 / GRAVITY)


if __name__ == "__main__":
    main()
