"""Makes tables of catamarans in waves about as long as they are, by Capytaine (extra `hydro`) alone.

    python assets/validation/make_short_waves.py

It takes some minutes: the hulls of each shipped boat without sensors, both in one run, are cut into 870 to 1700 panels.
short_waves.csv has the WAM-V upright without trim, response_amplitudes.csv boats as they lie at rest, the WAM-V 0.4
degrees down at the bow.
"""

import csv
import math
from pathlib import Path

import numpy as np

from vrx_mj.adapters.hydro import panel_hull
from vrx_mj.frames import rotation_matrix
from vrx_mj.mjcf.flotation import flotation
from vrx_mj.validation.case import GRAVITY, marine_simulation

FOLDER = Path(__file__).parent
DENSITY, PANELS = 1025.0, 400
LEVEL = (0, 90), {"wamv": (1.5, 2.0, 2.5, 3.0)}
AT_REST = (
    (0, 45, 90, 180),
    {
        "wamv": (1.5, 1.6, 1.7, 2.0, 2.5, 3.0),
        "otter": (0.95, 1.14, 1.3, 1.7),
        "heron": (0.8, 0.88, 1.0, 1.3),
        "blueboat": (0.75, 0.82, 0.95, 1.2),
    },
)
HEAD = """\
# Capytaine 3.0.0 by assets/validation/make_short_waves.py: direct method, with a lid, panels under water on both hulls
# of {}; mass and inertia are the model's. Heave of the centre of mass per metre of wave; roll and pitch per slope k a.
"""


def main() -> None:
    """Write the tables."""
    for file, (toward, robots) in (("short_waves", LEVEL), ("response_amplitudes", AT_REST)):
        panels, rows = [], []
        for robot, periods in robots.items():
            body, inertia = _body(robot, at_rest=robots is AT_REST[1])
            panels.append(f"{robot} {body.mesh.nb_faces}")
            for period in periods:
                for angle, swings in zip(toward, _responses(body, inertia, period, toward), strict=True):
                    rows.append([robot, period, angle, *(f"{each:.4f}" for each in swings)])
        with (FOLDER / f"{file}.csv").open("w", encoding="utf-8", newline="") as out:
            out.write(HEAD.format(", ".join(panels)))
            writer = csv.writer(out, lineterminator="\n")
            writer.writerows([["robot", "period", "toward", "heave", "roll", "pitch"], *rows])


def _body(robot, *, at_rest):  # type: ignore[no-untyped-def]
    """Capytaine's body of a boat, upright without trim or as it lies at rest, and its inertia (6, 6)."""
    import capytaine

    boats = [{"name": "a", "pose": [0] * 6}]
    name = "otter_hydro" if robot == "otter" else robot  # the Otter itself has no mesh
    sim = marine_simulation({"robot": name, "boats": boats, "sensors": "none"}, sea={"model": "none"})
    if at_rest:
        sim.step(duration=60.0)
    vessel, turn = sim.world.parameters.hulls[0].vessel, np.array(rotation_matrix(sim.data.qpos[3:7]))
    corners = np.array(vessel.vertices)[np.array(vessel.triangles)] @ turn.T
    inertia, center = _inertia(sim)
    level = flotation(corners, inertia[0, 0] / DENSITY).level
    vertices, faces, _ = panel_hull(corners - (0.0, 0.0, level), PANELS)
    mesh = capytaine.Mesh(vertices=vertices, faces=faces).immersed_part()
    center = center - (0.0, 0.0, level)
    dofs = capytaine.rigid_body_dofs(rotation_center=center)
    body = capytaine.FloatingBody(mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=dofs, center_of_mass=center)
    return body, inertia


def _inertia(sim):  # type: ignore[no-untyped-def]
    """Inertia (6, 6) of all bodies about their centre of mass, and that from the link's origin [m], world axes."""
    mass, data = sim.model.body_mass, sim.data
    arms = data.xipos - mass @ data.xipos / mass.sum()
    turns = data.ximat.reshape(-1, 3, 3)
    own = np.einsum("nij,nj,nkj->ik", turns, sim.model.body_inertia, turns)
    steiner = np.eye(3) * (mass @ np.square(arms).sum(axis=1)) - (arms * mass[:, None]).T @ arms
    whole = np.zeros((6, 6))
    whole[:3, :3], whole[3:, 3:] = mass.sum() * np.eye(3), own + steiner
    return whole, mass @ data.xipos / mass.sum() - data.qpos[:3]


def _responses(body, inertia, period, toward):  # type: ignore[no-untyped-def]
    """Amplitudes of heave per amplitude, of roll and pitch per slope, (3,) by direction [degrees]."""
    import capytaine
    from capytaine.bem.airy_waves import froude_krylov_force

    solver, omega = capytaine.BEMSolver(method="direct"), 2.0 * math.pi / period
    common = {"body": body, "omega": omega, "rho": DENSITY, "g": GRAVITY}
    motions = list(body.dofs)
    radiated = [solver.solve(capytaine.RadiationProblem(radiating_dof=motion, **common)) for motion in motions]
    added = np.array([[each.added_masses[motion] for each in radiated] for motion in motions])
    damping = np.array([[each.radiation_dampings[motion] for each in radiated] for motion in motions])
    stiffness = body.compute_hydrostatic_stiffness(rho=DENSITY, g=GRAVITY).values
    system, found = stiffness - omega**2 * (inertia + added) - 1j * omega * damping, []
    for angle in toward:
        problem = capytaine.DiffractionProblem(wave_direction=math.radians(angle), **common)
        scattered, krylov = solver.solve(problem).forces, froude_krylov_force(problem)
        force = np.array([scattered[motion] + krylov[motion] for motion in motions])
        found.append(np.abs(np.linalg.solve(system, force))[2:5] / (1.0, omega**2 / GRAVITY, omega**2 / GRAVITY))
    return found


if __name__ == "__main__":
    main()
