"""Makes the barge of the report's mean forces, its radiation and diffraction, drift.csv and towed.csv (extra `hydro`).

    python assets/validation/make_drift.py

The barge is a box of 3.2 x 1.4 x 0.7 m, half under water of 1025 kg/m3. drift.csv has Capytaine's own far-field mean
force on it, from sources on the hull (its indirect method) and motions by its own matrices at each period.
"""

import csv
import json
import math
from functools import cache
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
TOWARD = {"head": math.pi, "beam": 0.5 * math.pi, "following": 0.0}
AT_REST = ("head", 1.4), ("beam", 1.4), ("head", 2.0), ("beam", 2.0), ("head", 2.6), ("beam", 2.6), ("head", 3.2)
TOWED = (*((sea, period, 0.1) for sea in TOWARD for period in (1.4, 2.0, 2.6)), ("head", 2.0, 0.2), ("head", 2.6, 0.2))
MOTIONS = "Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw"
BOX = np.array(trimesh.creation.box((LENGTH, BEAM, DEPTH)).triangles)


@cache
def _barge(panels: int = 600) -> capytaine.FloatingBody:
    vertices, faces, _ = panel_hull(BOX, panels)
    mesh = capytaine.Mesh(vertices=vertices, faces=faces).immersed_part()
    dofs = capytaine.rigid_body_dofs(rotation_center=(0.0, 0.0, 0.0))
    return capytaine.FloatingBody(mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=dofs, name="barge")


def mean_force(omega: float, toward: float) -> tuple[float, float]:
    """Mean force ahead and to the left, over the amplitude squared [N/m2], of waves toward an angle off the bow."""
    inertia = MASS * np.diag((1.0, 1.0, 1.0, *(radius**2 for radius in RADII)))
    waterplane, draft = LENGTH * BEAM, 0.5 * DEPTH
    metacentres = [side**2 / (12.0 * draft) - 0.5 * draft for side in (BEAM, LENGTH)]
    weight = MASS * GRAVITY
    stiffness = np.diag((0.0, 0.0, DENSITY * GRAVITY * waterplane, *(weight * gm for gm in metacentres), 0.0))
    solver, theta = capytaine.BEMSolver(method="indirect"), np.linspace(0.0, 2.0 * math.pi, 361)
    common = {"body": _barge(), "omega": omega, "rho": DENSITY, "g": GRAVITY}
    made = [solver.solve(capytaine.RadiationProblem(radiating_dof=motion, **common)) for motion in MOTIONS]
    added, damping = (
        np.array([[getattr(one, name)[motion] for one in made] for motion in MOTIONS])
        for name in ("added_masses", "radiation_dampings")
    )
    damping[3, 3] += ROLL_DAMPING
    problem = capytaine.DiffractionProblem(wave_direction=toward, **common)
    met, undisturbed = solver.solve(problem), froude_krylov_force(problem)
    excited = np.array([met.forces[motion] + undisturbed[motion] for motion in MOTIONS])
    motions = np.linalg.solve(stiffness - omega**2 * (inertia + added) - 1j * omega * damping, excited)
    thrown = compute_kochin(met, theta) + sum(
        compute_kochin(one, theta) * own for one, own in zip(made, motions, strict=True)
    )
    k, ahead, scale = omega**2 / GRAVITY, float(np.interp(toward, theta, thrown.real)), -2.0 * math.pi * DENSITY
    x, y = (
        scale * (omega * ahead * way(toward) + k**2 * np.trapezoid(np.abs(thrown) ** 2 * way(theta), theta))
        for way in (np.cos, np.sin)
    )
    return float(x), float(y)


def towed_force(omega: float, toward: float, speed: float) -> tuple[float, float]:
    """`mean_force` on the barge as it goes ahead at a speed [m/s]: formula of Aranha (1994)."""
    tau = omega * speed / GRAVITY
    met = mean_force(omega * (1.0 - tau * math.cos(toward)), toward + 2.0 * tau * math.sin(toward))
    return (1.0 - 4.0 * tau * math.cos(toward)) * met[0], (1.0 - 4.0 * tau * math.cos(toward)) * met[1]


def main() -> None:
    """Write the robot, its table and the mean forces."""
    ROBOT.mkdir(exist_ok=True)
    table = hydro_of_hull(
        BOX, 0.0, (0.0, 0.0, 0.0), density=DENSITY, gravity=GRAVITY, frequencies=24, highest=5.6, panels=500, angles=18
    )
    table |= {"displacement": MASS, "waterline": 0.0}
    (ROBOT / "hydro.json").write_text(json.dumps(table) + "\n", encoding="utf-8")
    xx, yy, zz = (MASS * radius**2 for radius in RADII)
    inertia = f'<inertia ixx="{xx:.7g}" iyy="{yy:.7g}" izz="{zz:.7g}" ixy="0" ixz="0" iyz="0"/>'
    (ROBOT / "drift_barge.urdf").write_text(
        f"""<robot name="drift_barge"><link name="base_link"><inertial><mass value="{MASS:.7g}"/>{inertia}</inertial>
<collision><geometry><box size="{LENGTH} {BEAM} {DEPTH}"/></geometry></collision></link></robot>
""",
        encoding="utf-8",
    )
    origin = f"on a free box, by Capytaine {capytaine.__version__} (indirect method, far field)"
    waves = f"Mean force [N/m2] along waves of a period [s] over amplitude squared, {origin}"
    towed = f"Mean force [N/m2] of waves ahead and to the left over amplitude squared, {origin} and Aranha (1994)"
    at_rest = [(sea, period, *mean_force(2.0 * math.pi / period, TOWARD[sea])) for sea, period in AT_REST]
    _write(
        "drift", waves, ("sea", "period", "force"), [(sea, period, math.hypot(x, y)) for sea, period, x, y in at_rest]
    )
    rows = [
        (sea, period, speed, *towed_force(2.0 * math.pi / period, TOWARD[sea], speed)) for sea, period, speed in TOWED
    ]
    _write("towed", towed, ("sea", "period", "speed", "ahead", "aside"), rows)


def _write(name: str, says: str, columns: tuple[str, ...], rows: list[tuple[str | float, ...]]) -> None:
    """Write a table, its last columns with five digits."""
    with (FOLDER / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {says}\n# made by assets/validation/make_drift.py\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([value if isinstance(value, str) else f"{value:.5g}" for value in row] for row in rows)


if __name__ == "__main__":
    main()
