"""Barges of several kinds that make and scatter waves, each with numbers of its own in every table of a hull."""

import json
import random
from pathlib import Path

import numpy as np

G, RHO = 9.80665, 1025.0
KINDS = 3
SIZES = ((4.0, 2.0, 1.0), (6.0, 1.6, 0.8), (3.0, 2.4, 1.2))
POLES = (-0.8 + 1.7j, -1.1 + 0.9j, -0.5 + 2.3j)
WINDAGES = (
    "coefficients: [0.5, 0.8, 0.1]",
    "curve: [[0, -0.5, 0, 0], [90, 0, 0.9, 0.05], [120, 0.2, 0.8, 0], [180, 0.6, 0, 0]]",
    "vessel: tender",
)


def barge(folder: Path, kind: int) -> str:
    """Write the files of a kind, 0 to `KINDS` - 1, and give the robot's path."""
    name, chance, (length, beam, depth) = f"barge_{kind}", random.Random(kind), SIZES[kind]
    mass = 0.5 * RHO * length * beam * depth
    poles, steps, angles = POLES[: kind + 1], 24 - 4 * kind, 12 + 4 * kind
    residues = np.zeros((len(poles), 6, 6, 2))
    for own, pole in zip(residues, poles, strict=True):
        residue = (1.0 + 0.5 * kind) * mass * pole / (1j * pole.imag)
        own[2, 2] = residue.real, residue.imag
    scattered = np.array([chance.uniform(-0.3, 0.3) * mass for _ in range(steps * angles * 12)])
    infinite = np.diag((0.1, 0.4, 0.7, 0.3, 0.6, 0.5)) * mass
    none = np.zeros((steps, 6, 6)).tolist()
    hydro = {
        "format": 1, "program": "by hand", "density": RHO, "gravity": G, "point": [0.0, 0.0, 0.0],
        "frequencies": (0.2 * np.arange(1, steps + 1)).tolist(), "added_mass": none, "damping": none,
        "added_mass_infinite": infinite.tolist(), "poles": [[pole.real, pole.imag] for pole in poles],
        "residues": residues.tolist(), "fit_error": 0.0, "diffraction": scattered.reshape(steps, angles, 6, 2).tolist(),
    }  # fmt: skip
    inertia = f'<inertia ixx="{mass * beam**2 / 8}" iyy="{mass * length**2 / 12}" izz="{mass * length**2 / 12}"'
    urdf = f"""<robot name="{name}"><link name="base_link">
<inertial><origin xyz="0 0 -0.1"/><mass value="{mass}"/>{inertia} ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="{length} {beam} {depth}"/></geometry></collision></link></robot>"""
    damping = [round(share * mass) for share in (0.02, 0.1, 0.8, 0.3, 0.8, 0.3)]
    half = 0.5 * length
    robot = f"""urdf: {name}.urdf
hull:
  hydro: {name}.json
  damping_linear: {damping}
  damping_quadratic: {[round(0.1 * own) for own in damping]}
  crossflow: {{stern: {-half}, bow: {half}, strips: {4 + kind}, draft: {0.5 * depth}, coefficient: 1.5}}
  skegs: [{{x: {-half}, z: {-0.5 * depth}, area: {0.2 + 0.1 * kind}, aspect_ratio: 1}}]
windage: {{frontal_area: {beam}, lateral_area: {length}, length: {length}, height: 0.5, {WINDAGES[kind]}}}
thrusters: {{}}
"""
    for ending, text in (("json", json.dumps(hydro)), ("urdf", urdf), ("yaml", robot)):
        (folder / f"{name}.{ending}").write_text(text, encoding="utf-8")
    return str(folder / f"{name}.yaml")
