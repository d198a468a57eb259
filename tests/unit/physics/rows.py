"""Rows of parameter tables, motions and oracle tables, as the tests of the kernels need them."""

import csv
import math

import numpy as np

from vrx_mj.model import tables
from vrx_mj.packages import root
from vrx_mj.physics.motion import Motion
from vrx_mj.physics.tables import BOX, CYLINDER, GLF, SPHERE, VRX
from vrx_mj.physics.waves import cwr_components, pms_components

ORACLE = root() / "assets" / "validation" / "oracle"

FORCE_ERROR = 1e-3  # [N] or [N m], with 1e-6 of the value: VRX's 32-bit floats (README of the oracle)

PROPELLER = (-0.278156, 0.0, -0.509371)


def table(dtype, rows):
    """Rows of a table, from mappings; what a row leaves out is 0, but for a thruster's gain."""
    filled = np.zeros(len(rows), dtype)
    for own, row in zip(filled, rows, strict=True):
        if dtype is tables.THRUSTER:
            own["gain"] = 1.0
        for name, value in row.items():
            own[name] = value
    return filled


def oracle(name):
    with (ORACLE / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return [{key: _number(text) for key, text in row.items()} for row in csv.DictReader(file)]


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


def rotation(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll), body to world."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return rz @ ry @ rx


def moving(position=(0.0, 0.0, 0.0), angles=(0.0, 0.0, 0.0), velocity=(0.0,) * 6):
    matrix = rotation(*angles)
    return Motion(*(float(v) for v in (*position, *matrix.ravel(), *velocity)))


def moving_row(row):
    position = [row["x_m"], row["y_m"], row["z_m"]]
    angles = [row["roll_rad"], row["pitch_rad"], row["yaw_rad"]]
    return moving(position, angles, [row.get(name, 0.0) for name in "uvwpqr"])


def matrix(body):
    return np.array(body[3:12]).reshape(3, 3)


def in_body_axes(body, wrench):
    turn = matrix(body).T
    return np.concatenate((turn @ wrench[:3], turn @ wrench[3:]))


def sea(waves=(), *, tau=0.0, level=0.0, depth=math.inf):
    """Waves, from their rows, and the sea that has them; by default their motion is that of linear deep water."""
    rows = [{"orbital": wave["amplitude"] * wave["frequency"]} | wave for wave in waves]
    water = {"tau": tau, "level": level, "depth": depth, "gravity": 9.81, "density": 1025.0, "moving": 0}
    return table(tables.WAVE, rows), table(tables.SEA, [water])[0]


def sea_of(name):
    """Waves and sea of a wave set of the oracle; `none` has no waves."""
    if name == "none":
        return sea()
    row = next(row for row in oracle("wave_sets") if row["wave_set"] == name)
    common = {"number": int(row["number"]), "scale": row["scale"], "angle": row["angle_rad"]}
    common |= {
        "steepness": row["steepness"],
        "period": row["period_s"],
        "direction": (row["dir_x"], row["dir_y"]),
    }
    if row["model"] == "PMS":
        waves = pms_components(gain=row["gain"], **common)
    else:
        waves = cwr_components(amplitude=row["amplitude_m"], **common)
    return sea(waves, tau=row["tau_s"])


def hull(**changes):
    """A WAM-V without thrusters."""
    row = {
        "body": 1, "qpos": 0, "dof": 0, "profile": VRX, "station_start": 0, "station_count": 4,
        "density": 997.8, "gravity": 9.815, "level": 0.0,
        "added_mass": (0.0, 0.0, 0.1, 0.1, 0.1, 0.0),
        "drag_linear": (51.3, 40.0, 500.0, 50.0, 50.0, 400.0),
        "drag_quadratic": (72.4, 0.0, 0.0, 0.0, 0.0, 0.0),
        "link_com": (0.0, 0.0, 0.12422907), "body_com": (-0.28629927, 0.0, 0.14556580), "mass": 258.0,
        "wind": (0.5, 0.5, 0.33), "memory_start": 0, "thruster_start": 0, "thruster_count": 0,
        "windage_start": 0, "windage_count": 0, "windage_height": 0.0, "windage_offset": 0.0, "vessel": -1,
        "spread": (0.0, 0.0),
    }  # fmt: skip
    return table(tables.HULL, [row | changes])[0]


def lines(length=4.9, beam=2.4, radius=0.213, count=2):
    """The stations of two floats, starboard first: VRX classic's places."""
    piece = length / count
    places = [((j + 0.5) * piece - 0.5 * length, side * beam, 0.0) for side in (-0.5, 0.5) for j in range(count)]
    return table(tables.STATION, [{"position": place, "radius": radius, "length": piece} for place in places])


def lines_of(name):
    """The stations of a hull of the oracle."""
    row = next(row for row in oracle("dynamics_sets") if row["dyn_set"] == name)
    return lines(row["boatLength"], row["boatWidth"], row["hullRadius"], int(row["length_n"]))


def hull_of(name):
    """A hull of the oracle."""
    row = next(row for row in oracle("dynamics_sets") if row["dyn_set"] == name)
    return hull(
        station_count=2 * int(row["length_n"]),
        density=row["waterDensity"],
        level=row["waterLevel"],
        added_mass=[row[key] for key in ("xDotU", "yDotV", "zDotW", "kDotP", "mDotQ", "nDotR")],
        drag_linear=[row[key] for key in ("xU", "yV", "zW", "kP", "mQ", "nR")],
        drag_quadratic=[row[key] for key in ("xUU", "yVV", "zWW", "kPP", "mQQ", "nRR")],
    )


def thruster(**changes):
    """The left engine of a WAM-V."""
    row = {
        "hull": 0, "body": 1, "qpos": -1, "dof": -1, "position": (-2.373776, 1.027135, 0.318237),
        "rotation": np.eye(3), "propeller": PROPELLER, "direction": (1.0, 0.0, 0.0),
        "body_com": (-0.01, 0.0, -0.02), "mapping": GLF, "max_command": 1.0,
        "max_forward": 250.0, "max_reverse": -100.0, "gain": 1.0, "timeout": 1.0, "max_angle": math.pi / 2,
        "kp": 300.0, "kd": 20.0, "effort": 10.0, "velocity": 10.0, "inertia": 0.131210,
        "area": 0.0, "slope": 0.0, "density": 0.0, "race": -1, "race_area": 0.0, "race_share": 0.0, "measured": -1,
        "curve_start": 0, "curve_count": 0, "sheeted": 0,
    }  # fmt: skip
    return table(tables.THRUSTER, [row | changes])[0]


SIZES = {
    "box": lambda a, b, c: (BOX, a * b * c, (a + b + c) / 3),
    "sphere": lambda a, b, c: (SPHERE, 4 / 3 * math.pi * a**3, 2 * a),
    "cylinder": lambda a, b, c: (CYLINDER, math.pi * a**2 * b, (2 * a + b) / 2),
}


def element(shape, size, position=(0.0, 0.0, 0.0), turn=None):
    number, volume, mean = SIZES[shape](*size)
    return {
        "shape": number,
        "size": size,
        "position": position,
        "rotation": np.eye(3) if turn is None else turn,
        "volume": volume,
        "mean_dimension": mean,
    }


def floating(elements, **changes):
    """A marker buoy, or what `changes` make of it, on the given elements."""
    row = {
        "body": 1, "qpos": 0, "dof": 0, "mass": 20.0, "com": (0.0, 0.0, -2.0),
        "inertia": (1.0, 1.0, 0.1, 0.0, 0.0, 0.0), "density": 1000.0, "gravity": 9.8, "level": 0.0,
        "linear_drag": 25.0, "angular_drag": 2.0, "profile": VRX, "follower": -1,
        "element_start": 0, "element_count": len(elements),
        "wind": (0.0, 0.0, 0.0),
    }  # fmt: skip
    return table(tables.FLOAT, [row | changes])[0], table(tables.ELEMENT, elements)


MARKER = element("sphere", (0.325, 0.0, 0.0), (0.0, 0.0, -0.12))


def floating_of(name):
    """A floating object of the oracle."""
    rows = [row for row in oracle("buoyancy_models") if row["model"] == name]
    first = rows[0]
    elements = [
        element(row["shape"], (row["a_m"], row["b_m"], row["c_m"]), [row[f"offset_{axis}"] for axis in "xyz"])
        for row in rows
    ]
    return floating(
        elements,
        mass=first["mass_kg"],
        com=[first[f"com_{axis}"] for axis in "xyz"],
        inertia=(first["ixx"], first["iyy"], first["izz"], 0.0, 0.0, 0.0),
        density=first["fluid_density"],
        level=first["fluid_level"],
        linear_drag=first["linear_drag"],
        angular_drag=first["angular_drag"],
    )
