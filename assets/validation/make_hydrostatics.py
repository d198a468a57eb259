"""Make the rows of hydrostatics.csv: `pip install 'capytaine>=3' trimesh`, `python make_hydrostatics.py`.

The hulls are turned by heel and trim about their origin, cut into small edges, and their part below z = 0 is measured.
"""

import math
import sys
from pathlib import Path

import capytaine
import numpy as np
import trimesh

EDGES = {"barge": 0.12, "sphere": 0.06, "wigley": 0.06}
"""Longest edge of the triangles of each hull [m]."""


def turned(vertices: np.ndarray, heel: float, trim: float) -> np.ndarray:
    """Vertices (n, 3) after a roll by `heel` and a pitch by `trim` [degrees], as in our poses: Ry(trim) Rx(heel)."""
    roll, pitch = math.radians(heel), math.radians(trim)
    x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    return vertices @ (y @ x).T


def row(name: str, heel: float, trim: float) -> list[float]:
    """Volume, centre of buoyancy and waterplane area of a hull in a pose."""
    whole = trimesh.load(Path(__file__).parent / "hulls" / f"{name}.off", process=True)
    vertices, faces = trimesh.remesh.subdivide_to_size(whole.vertices, whole.faces, EDGES[name])
    mesh = capytaine.Mesh(vertices=turned(vertices, heel, trim), faces=np.column_stack([faces, faces[:, 0]]))
    wet = capytaine.FloatingBody(mesh=mesh, center_of_mass=(0, 0, 0)).immersed_part()
    return [wet.volume, *wet.center_of_buoyancy, wet.waterplane_area]


if __name__ == "__main__":
    for name in EDGES:
        for heel, trim in ((0, 0), (20, 0), (0, 5), (20, 5)):
            sys.stdout.write(",".join(map(str, [name, heel, trim, *row(name, heel, trim)])) + "\n")
