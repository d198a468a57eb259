"""Makes the barge of the report's mean forces, its radiation and diffraction, and drift.csv (extra `hydro`).

    python assets/validation/make_drift.py

The barge is a box of 3.2 x 1.4 x 0.7 m, half under water of 1025 kg/m3. drift.csv has Capytaine's own far-field mean
force on it, from sources on the hull (its indirect method) and motions by its own matrices at each period.
"""

import csv
import json
import math
from pathlib import Path

import capytaine
import numpy as np
import trimesh
from capytaine.bem.airy_waves import froude_krylov_force
from capytaine.post_pro.kochin import compute_kochin

from vrx_mj.adapters.hydro import hydro_of_hull, panel_hull

FOLDER = Path(__file__).parent
ROBOT = FOLDER / "worlds" / "drift_barge"
LENGTH, BEAM, DEPTH, DENSITY, GRAVITY = 3.2, 1.4, 0.7, 1025.0, 9.81
MASS = 0.5 * DENSITY * LENGTH * BEAM * DEPTH
RADII = 0.29 * BEAM, 0.25 * LENGTH, 0.25 * LENGTH
ROLL_DAMPING = 400.0  # [N m s], without which its start lasts minutes
PERIODS = {"head": (1.4, 2.0, 2.6, 3.2), "beam": (1.4, 2.0, 2.6)}
HEADINGS = {"head": math.pi, "beam": 0.5 * math.pi}
MOTIONS = "Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw"
BOX = np.array(trimesh.creation.box((LENGTH, BEAM, DEPTH)).triangles)


def rows(panels: int = 600) -> list[tuple[str, float, float]]:
    """Sea, period [s] and mean force along the waves over the amplitude squared [N/m2]."""
    vertices, faces, _ = panel_hull(BOX, panels)
    mesh = capytaine.Mesh(vertices=vertices, faces=faces).immersed_part()
    dofs = capytaine.rigid_body_dofs(rotation_center=(0.0, 0.0, 0.0))
    body = capytaine.FloatingBody(mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=dofs, name="barge")
    inertia = MASS * np.diag((1.0, 1.0, 1.0, *(radius**2 for radius in RADII)))
    waterplane, draft = LENGTH * BEAM, 0.5 * DEPTH
    metacentres = [side**2 / (12.0 * draft) - 0.5 * draft for side in (BEAM, LENGTH)]
    weight = MASS * GRAVITY
    stiffness = np.diag((0.0, 0.0, DENSITY * GRAVITY * waterplane, *(weight * gm for gm in metacentres), 0.0))
    solver, theta = capytaine.BEMSolver(method="indirect"), np.linspace(0.0, 2.0 * math.pi, 361)
    found = []
    for period in PERIODS["head"]:
        omega = 2.0 * math.pi / period
        common = {"body": body, "omega": omega, "rho": DENSITY, "g": GRAVITY}
        made = [solver.solve(capytaine.RadiationProblem(radiating_dof=motion, **common)) for motion in MOTIONS]
        added, damping = (
            np.array([[getattr(one, name)[motion] for one in made] for motion in MOTIONS])
            for name in ("added_masses", "radiation_dampings")
        )
        damping[3, 3] += ROLL_DAMPING
        system = stiffness - omega**2 * (inertia + added) - 1j * omega * damping
        for sea in (sea for sea, periods in PERIODS.items() if period in periods):
            toward = HEADINGS[sea]
            problem = capytaine.DiffractionProblem(wave_direction=toward, **common)
            met, undisturbed = solver.solve(problem), froude_krylov_force(problem)
            excited = np.array([met.forces[motion] + undisturbed[motion] for motion in MOTIONS])
            motions = np.linalg.solve(system, excited)
            thrown = compute_kochin(met, theta) + sum(
                compute_kochin(one, theta) * own for one, own in zip(made, motions, strict=True)
            )
            k, ahead = omega**2 / GRAVITY, round(math.degrees(toward))
            spread = np.trapezoid(np.abs(thrown) ** 2 * np.cos(theta - toward), theta)
            force = -2.0 * math.pi * DENSITY * (omega * thrown[ahead].real + k**2 * spread)
            found.append((sea, period, float(force)))
    return found


def main() -> None:
    """Write the robot, its table and the mean forces."""
    ROBOT.mkdir(exist_ok=True)
    table = hydro_of_hull(
        BOX, 0.0, (0.0, 0.0, 0.0), density=DENSITY, gravity=GRAVITY, frequencies=24, highest=5.6, panels=500, angles=8
    )
    (ROBOT / "hydro.json").write_text(json.dumps(table) + "\n", encoding="utf-8")
    xx, yy, zz = (MASS * radius**2 for radius in RADII)
    inertia = f'<inertia ixx="{xx:.7g}" iyy="{yy:.7g}" izz="{zz:.7g}" ixy="0" ixz="0" iyz="0"/>'
    (ROBOT / "drift_barge.urdf").write_text(
        f"""<robot name="drift_barge"><link name="base_link"><inertial><mass value="{MASS:.7g}"/>{inertia}</inertial>
<collision><geometry><box size="{LENGTH} {BEAM} {DEPTH}"/></geometry></collision></link></robot>
""",
        encoding="utf-8",
    )
    with (FOLDER / "drift.csv").open("w", encoding="utf-8", newline="") as file:
        file.write(
            f"# Mean force [N/m2] along waves of a period [s] over amplitude squared, on a free box, by Capytaine "
            f"{capytaine.__version__} (indirect method, far field)\n# made by assets/validation/make_drift.py\n"
        )
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("sea", "period", "force"))
        writer.writerows((sea, period, f"{force:.5g}") for sea, period, force in rows())


if __name__ == "__main__":
    main()
