"""Makes worlds/wamv_hydro/hydro.json: waves that the WAM-V makes and scatters, by Capytaine (extra `hydro`).

    python assets/validation/make_wamv_hydro.py

It takes two minutes, both hulls in one run: 622 panels, and twice as many change its forces by 1 %. Waves down to 0.43
of the waterline are scattered. Radiation goes on to 0.3 of it, past the first resonances of the water between the
hulls, whose peaks are narrow: so frequencies are dense.
"""

import json
from pathlib import Path

from vrx_mj.adapters.hydro import hydro_of_hull
from vrx_mj.cli.robot import read_hull
from vrx_mj.mjcf.flotation import flotation

FOLDER = Path(__file__).parent
MESH = FOLDER.parent / "robots" / "wamv" / "meshes" / "water_hulls.obj"
MASS, POINT, DENSITY, GRAVITY = 273.5, (-0.27, 0.0, 0.154), 1025.0, 9.81  # without sensors
STEP, FREQUENCIES, WAVES, EVERY, ANGLES = 0.1, 72, 30, 2, 18  # [rad/s]; of diffraction and drift one in two


def main() -> None:
    """Write the file."""
    corners = read_hull(MESH, 1.0)
    level = flotation(corners, MASS / DENSITY).level
    table = hydro_of_hull(
        corners, level, POINT, density=DENSITY, gravity=GRAVITY, frequencies=FREQUENCIES, highest=STEP * FREQUENCIES,
        waves=[STEP * EVERY * n for n in range(1, WAVES + 1)], panels=150, tolerance=None, angles=ANGLES,
    )  # fmt: skip
    text = json.dumps(table | {"displacement": MASS, "waterline": level}, separators=(",", ":"))
    (FOLDER / "worlds" / "wamv_hydro" / "hydro.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
