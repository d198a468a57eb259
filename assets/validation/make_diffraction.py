"""Makes the box with a bow, its radiation and diffraction, and diffraction.csv (extra `hydro`).

    python assets/validation/make_diffraction.py

The robot's file has the forces of waves from all sides on the hull as it lies; the table those of one wave on its mesh
turned by each heading, which Capytaine computes anew.
"""

import csv
import json
import math
from pathlib import Path

import capytaine
import numpy as np
import trimesh

from vrx_mj.adapters.hydro import hydro_of_hull, panel_hull

FOLDER = Path(__file__).parent
ROBOT = FOLDER / "worlds" / "bowed_box"
OUTLINE = ((-2.0, -1.0), (1.0, -1.0), (2.5, 0.0), (1.0, 1.0), (-2.0, 1.0))
"""Plan of the hull [m]; its keel is 0.5 m below the water, its deck as much above."""
CENTER = -0.1
"""Of its middle from the origin, along its length [m]."""
GRAVITY, DENSITY, PERIOD = 9.81, 1025.0, 3.0
PANELS, ANGLES, FREQUENCIES = 250, 36, 12
COURSES = ((0, 0), (25, 0), (60, 90), (-130, 50), (115, 0))
"""Headings of the hull, and where the wave goes [degrees]."""
MOTIONS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
HEAD = """\
# Forces [N] and moments [N m] of a wave on a fixed hull, per metre of its amplitude, by Capytaine 3.0.0 (direct \
method, lid, 250 panels and more): world axes, about the centre of mass,
# complex amplitudes of e^(-i omega t), of a wave whose crest is over the centre of mass at time 0. Hull: \
assets/validation/worlds/bowed_box, its mesh turned by the heading; wave of 3 s, 1025 kg/m3, g 9.81 m/s2.
# made by assets/validation/make_diffraction.py
"""


def hull() -> trimesh.Trimesh:
    """The closed hull, its water at z = 0."""
    points = [(x, y, z) for x, y in OUTLINE for z in (-0.5, 0.5)]
    return trimesh.convex.convex_hull(np.array(points))


def turned(heading: float, toward: float) -> dict[str, dict[str, complex]]:
    """Forces by kind and motion on the hull turned by a heading, of a wave toward an angle [rad]."""
    turn = trimesh.transformations.rotation_matrix(heading, (0, 0, 1))
    vertices, faces, _ = panel_hull(np.array(hull().apply_transform(turn).triangles), PANELS)
    mesh = capytaine.Mesh(vertices=vertices, faces=faces).immersed_part()
    center = turn[:3, 0] * CENTER
    body = capytaine.FloatingBody(
        mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=capytaine.rigid_body_dofs(rotation_center=center), name="hull"
    )
    problem = capytaine.DiffractionProblem(
        body=body, omega=2.0 * math.pi / PERIOD, wave_direction=toward, rho=DENSITY, g=GRAVITY
    )
    way = center[0] * math.cos(toward) + center[1] * math.sin(toward)
    crest = np.exp(-1j * (2.0 * math.pi / PERIOD) ** 2 / GRAVITY * way)  # from the origin's phase to the centre's
    kinds = {
        "diffraction": capytaine.BEMSolver(method="direct").solve(problem).forces,
        "froude_krylov": capytaine.bem.airy_waves.froude_krylov_force(problem),
    }
    return {kind: {motion: complex(forces[motion] * crest) for motion in MOTIONS} for kind, forces in kinds.items()}


def rows() -> list[list[object]]:
    """The rows of the table."""
    found: list[list[object]] = []
    for heading, toward in COURSES:
        for kind, forces in turned(math.radians(heading), math.radians(toward)).items():
            for motion, force in forces.items():
                found.append([heading, toward, kind, motion.lower(), f"{force.real:.6g}", f"{force.imag:.6g}"])
    return found


def main() -> None:
    """Write the mesh, the robot's file and the table."""
    capytaine.set_logging("ERROR")
    mesh = hull()
    lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in mesh.vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
    (ROBOT / "hull.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = hydro_of_hull(
        np.array(mesh.triangles), 0.0, (CENTER, 0.0, 0.0), density=DENSITY, gravity=GRAVITY, frequencies=FREQUENCIES,
        highest=4.0 * math.pi / PERIOD, panels=PANELS, tolerance=None, angles=ANGLES,
    )  # fmt: skip
    (ROBOT / "hydro.json").write_text(json.dumps(table) + "\n", encoding="utf-8")
    with (FOLDER / "diffraction.csv").open("w", encoding="utf-8", newline="") as file:
        file.write(HEAD)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["heading", "toward", "kind", "motion", "real", "imaginary"])
        writer.writerows(rows())


if __name__ == "__main__":
    main()
