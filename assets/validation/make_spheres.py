"""Makes the spheres of the report: meshes, and their radiation and diffraction by Capytaine (extra `hydro`).

    python assets/validation/make_spheres.py

It takes ten minutes: radiation is of 2592 panels, mean drift of 656. The benchmark of IEA OES (Wendt et al., 2019) has
a sphere of 10 m, Kramer et al. (2021) one of 0.3 m.
"""

import json
from pathlib import Path

import numpy as np
import trimesh

from vrx_mj.adapters.hydro import hydro_of_hull

FOLDER = Path(__file__).parents[1]
SPHERES = {
    "robots/sphere": {"radius": 5.0, "center": -2.0, "density": 1000.0, "gravity": 9.81, "highest": 3.58583408},
    "validation/worlds/kramer_sphere": {
        "radius": 0.15, "center": -0.0348, "density": 998.2, "gravity": 9.82, "highest": 20.7133719
    },
}  # fmt: skip
"""Sizes [m], water, and the highest frequency [rad/s], whose waves are as long as five edges of 400 panels."""


def sphere(radius: float, subdivisions: int) -> trimesh.Trimesh:
    """20 times 4 to the power of `subdivisions` triangles, half of them under z = 0, with the volume of a sphere."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    mesh.apply_scale((4.0 / 3.0 * np.pi * radius**3 / mesh.volume) ** (1.0 / 3.0))
    return mesh


def main() -> None:
    """Write meshes and tables."""
    for name, own in SPHERES.items():
        mesh = sphere(own["radius"], 3)
        lines = ["mtllib sphere.mtl", "usemtl hull"] if (FOLDER / name / "sphere.mtl").is_file() else []
        lines += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in mesh.vertices]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
        (FOLDER / name).mkdir(exist_ok=True)
        (FOLDER / name / "sphere.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
        # with four times as many triangles, heave is within 0.15 % of Hulme's hemisphere instead of 0.4 %
        fine = np.array(sphere(own["radius"], 4).triangles)
        water = {"density": own["density"], "gravity": own["gravity"], "highest": own["highest"]}
        water |= {"frequencies": 36, "angles": 12, "panels": 400, "tolerance": None}
        table = hydro_of_hull(fine, 0.0, (0.0, 0.0, own["center"]), **water)
        coarse = hydro_of_hull(np.array(mesh.triangles), 0.0, (0.0, 0.0, own["center"]), **water)
        table |= {key: coarse[key] for key in ("drift_scattered", "drift_radiated")}
        (FOLDER / name / "hydro.json").write_text(json.dumps(table, indent=None) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
