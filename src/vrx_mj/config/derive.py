"""A hull's hydrodynamics from its shapes and mass, where nobody has said better."""

import itertools
import math
from typing import Any

from vrx_mj.config.boats import Boat, Part
from vrx_mj.config.poses import apply, compose, rotation
from vrx_mj.config.search import contained
from vrx_mj.config.shapes import Shape
from vrx_mj.config.urdf.meshes import read_mesh
from vrx_mj.errors import VrxError

__all__ = ["boat_box", "derived_hydrodynamics"]

DENSITY = 997.8
"""Of VRX's water [kg/m3]."""
RESERVE = 2.5
"""Largest lift over weight: 2.7 for the bare WAM-V."""
SPREAD = 1.0 / math.sqrt(3.0)
"""Two lines of stations this share of the beam apart roll as stiffly as a solid rectangular waterplane."""
MODEL_LENGTH = 4.9
"""Of the WAM-V [m], whose drag is scaled by Froude's law: forces per speed with the length to 2.5, moments to 4.5."""
MODEL_LINEAR = (51.3, 40.0, 500.0, 50.0, 50.0, 400.0)
MODEL_SURGE_QUADRATIC = 72.4

Corner = tuple[float, float, float]


def derived_hydrodynamics(boat: Boat) -> dict[str, Any]:
    """Fields of `HydrodynamicsConfig` for a boat of which only shapes and mass are known.

    Length and beam are those of the box around what collides, or else is seen; the floats' radius gives a lift of
    `RESERVE` times the weight; drag is the WAM-V's by Froude's law of similarity; added mass is nil.

    Raises:
        VrxError: the boat has no shape, or no mass.
    """
    low, high = boat_box(boat)
    length, beam = high[0] - low[0], high[1] - low[1]
    parts = (*boat.parts, *itertools.chain.from_iterable(thruster.parts for thruster in boat.thrusters))
    mass = math.fsum(part.inertial.mass for part in parts if part.inertial)
    if mass <= 0.0:
        raise VrxError(f"robot {boat.name}: no link has a mass")
    scale = length / MODEL_LENGTH
    forces, moments = scale**2.5, scale**4.5
    return {
        "hull_radius": math.sqrt(RESERVE * mass / (math.pi * DENSITY * length)),
        "boat_width": SPREAD * beam,
        "boat_length": length,
        "added_mass": (0.0,) * 6,
        "drag_linear": tuple(value * (forces if i < 3 else moments) for i, value in enumerate(MODEL_LINEAR)),
        "drag_quadratic": (MODEL_SURGE_QUADRATIC * scale**2, 0.0, 0.0, 0.0, 0.0, 0.0),
    }


def boat_box(boat: Boat) -> tuple[Corner, Corner]:
    """Least and greatest corner [m] in the base link's axes of the box around what the base link carries.

    Raises:
        VrxError: that has no shape.
    """
    for kind in ("collisions", "visuals"):
        corners = [corner for part in boat.parts for shape in getattr(part, kind) for corner in _corners(part, shape)]
        if corners:
            low, high = zip(*((min(axis), max(axis)) for axis in zip(*corners, strict=True)), strict=True)
            return low, high
    raise VrxError(f"robot {boat.name}: no shape gives its length and width")


def _corners(part: Part, shape: Shape) -> list[Corner]:
    pose = compose(part.pose, shape.pose)
    turn = rotation(*pose[3:])
    low, high = _extent(shape)
    found = []
    for corner in itertools.product(*zip(low, high, strict=True)):
        x, y, z = apply(turn, corner)
        found.append((pose[0] + x, pose[1] + y, pose[2] + z))
    return found


def _extent(shape: Shape) -> tuple[Corner, Corner]:
    """Least and greatest corner of a shape in its own frame [m]."""
    if shape.type == "mesh":
        points = read_mesh(contained(str(shape.file), shape.folder), shape.scale).points
        (a, b, c), (d, e, f) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return (a, b, c), (d, e, f)
    if shape.size is not None:
        x, y, z = (edge / 2 for edge in shape.size)
    else:
        x = y = z = float(shape.radius or 0.0)
        if shape.length is not None:
            z = shape.length / 2 + (x if shape.type == "capsule" else 0.0)
    return (-x, -y, -z), (x, y, z)
