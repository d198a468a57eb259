"""Makes hydro.json of our catamarans: waves that both hulls together make and scatter, by Capytaine (extra `hydro`).

    python assets/robots/make_hydro.py [ROBOT ...]

It takes two to six minutes each. Waves down to 0.43 of the waterline are scattered. Radiation goes on to 0.3 of the
WAM-V's, past the first resonances of the water between the hulls, whose peaks are narrow: so frequencies are dense. Of
the others it ends with the waves: up to 13.3 rad/s the memory of the Heron is 10 % off, up to 11.1 rad/s 0.3 %. Twice
as many panels change the forces on the WAM-V by 1 %. In waves as long as its hulls the Heron is beside such a peak:
with diffraction at every other frequency the force in sway is 15 % off, with 18 angles the moment in pitch up to 10 %,
with 468 panels for 956 pitch in beam waves 18 %.
"""

import json
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vrx_mj.adapters.hydro import hydro_of_hull
from vrx_mj.cli.robot import read_hull
from vrx_mj.mjcf.flotation import flotation

FOLDER = Path(__file__).parent
DENSITY, GRAVITY = 1025.0, 9.81
HIGHEST = 60  # frequency of diffraction and drift, by its number


class Catamaran(NamedTuple):
    """A robot's hulls."""

    mesh: str
    """From the folder of this file."""
    mass: float
    """Without sensors [kg]."""
    point: tuple[float, float, float]
    """Centre of mass [m], base link."""
    step: float
    """Between frequencies [rad/s]."""
    frequencies: int
    hull: tuple[float, float] = (0.0, 0.0)
    """Place of the mesh, and of its mirror image on the other side [m]; at y = 0, the mesh has both hulls."""
    every: int = 1
    """Of so many frequencies one has diffraction and drift."""
    angles: int = 24
    """Directions of their waves."""
    panels: int = 150


ROBOTS = {
    "wamv": Catamaran("wamv/meshes/water_hulls.obj", 273.5, (-0.27, 0.0, 0.154), 0.1, 72, every=2, angles=18),
    "otter": Catamaran("otter_hydro/meshes/water.obj", 80.0, (0.153125, 0.0, 0.246875), 0.145, 60, (0.153125, 0.395)),
    "heron": Catamaran("heron/meshes/water.obj", 35.0, (0.0, 0.0, 0.06), 0.185, 60, (0.1254, 0.39), panels=400),
    "blueboat": Catamaran("blueboat/meshes/water.obj", 17.5, (0.0, 0.0, 0.05), 0.197, 60, (0.1155, 0.365)),
}


def main(names: list[str]) -> None:
    """Write the files of robots."""
    for name in names or list(ROBOTS):
        own, (x, y) = ROBOTS[name], ROBOTS[name].hull
        corners = np.add(read_hull(FOLDER / own.mesh, 1.0), (x, y, 0.0))
        if y:
            corners = np.concatenate((corners, corners[:, ::-1] * (1.0, -1.0, 1.0)))
        level = flotation(corners, own.mass / DENSITY).level
        table = hydro_of_hull(
            corners, level, own.point, density=DENSITY, gravity=GRAVITY, frequencies=own.frequencies,
            highest=own.step * own.frequencies, angles=own.angles,
            panels=own.panels, tolerance=None,
            waves=[own.step * n for n in range(own.every, HIGHEST + 1, own.every)],
        )  # fmt: skip
        text = json.dumps(symmetric(table) | {"displacement": own.mass, "waterline": level}, separators=(",", ":"))
        (FOLDER / f"{name}_hydro" / "hydro.json").write_text(text + "\n", encoding="utf-8")


def symmetric(table: dict[str, Any]) -> dict[str, Any]:
    """A file's content, whose panels are not quite mirror images, made symmetric about the centre plane."""
    motions = np.array([1, -1, 1, -1, 1, -1])
    pairs, forces = np.outer(motions, motions), motions[[0, 1, 5]]
    other_side, signs = -np.arange(len(table["diffraction"][0])), {
        **dict.fromkeys(("added_mass", "damping", "added_mass_zero", "added_mass_infinite"), pairs),
        "residues": pairs[:, :, None],
        "diffraction": motions[:, None],
        "drift_scattered": np.outer(forces, [1, *motions])[:, :, None],
        "drift_radiated": np.multiply.outer(forces, pairs)[..., None],
    }  # fmt: skip
    rounded = np.vectorize(lambda value: float(f"{value:.7g}"))
    for key, sign in signs.items():
        values = np.array(table[key])
        mirrored = sign * (values[:, other_side] if key in ("diffraction", "drift_scattered") else values)
        table[key] = rounded(0.5 * (values + mirrored) + 0.0).tolist()
    return table


if __name__ == "__main__":
    main(sys.argv[1:])
