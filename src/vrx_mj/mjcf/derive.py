"""A hull's hydrodynamics from its shapes and mass, where no file gives them."""

import itertools
import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.search import contained_file
from vrx_mj.config.shapes import Shape
from vrx_mj.config.solids import enclosed_volume, solid
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.meshes import read_mesh
from vrx_mj.frames import apply, compose, rotation
from vrx_mj.mjcf.boats import Boat, Part, boat_mass
from vrx_mj.mjcf.flotation import Flotation, flotation, flotation_at

DENSITY = 997.8
"""Density of VRX's water [kg/m3]."""
_RESERVE = 2.5
"""Largest lift over weight of floats in lines: 2.7 for the bare WAM-V."""
_RESERVES = (1.1, 10.0)
"""Least and largest lift over weight of floats that have a volume."""
_SPREAD = 1.0 / math.sqrt(3.0)
"""Two lines of stations this share of the beam apart roll as stiffly as a solid rectangular waterplane."""
_MODEL_LENGTH = 4.9
"""Length of the WAM-V [m]. Froude's law scales its drag: forces per speed with the length to 2.5, moments to 4.5."""
_MODEL_LINEAR = (51.3, 40.0, 500.0, 50.0, 50.0, 400.0)
_MODEL_SURGE_QUADRATIC = 72.4
LINES = frozenset({"hull_radius", "boat_width", "boat_length", "hulls"})
"""Fields that place floats: a file that gives one of them means lines of floats at z = 0, as VRX has them."""
_HIGHEST_LIFT = 0.1
"""Share of the length up to which the water may push above where it is felt: drag then still damps all motion."""
_LEAST_SHARE = 0.1
"""Share of a boat's displacement below which its shapes are no hull, and give no more than its length and beam."""
_AWASH = 0.95
"""Share of its height at which a boat floats that is heavier than what its shapes displace."""

_Corner = tuple[float, float, float]


@dataclass(frozen=True)
class Derived:
    """Fields of `HydrodynamicsConfig`, and remarks about them."""

    values: dict[str, object]
    rest: str = ""
    """Description of the boat afloat at rest."""
    notes: tuple[str, ...] = ()
    """Remarks about unusual shapes or masses."""
    pushed: tuple[float, float, float] | None = None
    """Point where the water pushes [m], for `Boat.pushed`."""


def derived_lines(boat: Boat) -> Derived:
    """VRX's two lines of floats for a boat of which only shapes and mass are known.

    Length and beam are those of the box around what collides, or else is seen; the floats' radius gives a lift of
    `_RESERVE` times the weight; drag is the WAM-V's by Froude's law of similarity; added mass is nil.

    Raises:
        VrxError: the boat has no shape, or no mass.
    """
    low, high = boat_box(boat)
    length, beam = high[0] - low[0], high[1] - low[1]
    floats = {
        "hull_radius": math.sqrt(_RESERVE * boat_mass(boat).mass / (math.pi * DENSITY * length)),
        "boat_width": _SPREAD * beam,
        "boat_length": length,
    }
    return Derived(floats | _resistance(length))


def derived_floats(boat: Boat, density: float, stations: int) -> Derived:
    """Floats that lift as the volume of the boat's shapes does in water of a density [kg/m3]; drag is scaled.

    Upright at rest the draft, the displacement, the centre of buoyancy, the waterplane's area and both metacentric
    heights are those of the shapes, and all under water the floats lift as much as the shapes. Each of two lines
    has as many stations.

    Raises:
        VrxError: the boat has no shape, no mass, or a mesh that cannot be read.
    """
    body, (corners, notes) = boat_mass(boat), hull_corners(boat, boat_mass(boat).mass / density)
    if not len(corners):
        return derived_lines(boat)
    low, high = float(corners[:, :, 2].min()), float(corners[:, :, 2].max())
    whole, wanted = flotation_at(corners, high).volume, body.mass / density
    if whole > wanted * (1.0 + 1e-6):
        wet = flotation(corners, wanted)
    else:
        wet = flotation_at(corners, low + _AWASH * (high - low))
        carries = f"{whole:.3g} m3, carries {whole * density:.4g} kg, and it weighs {body.mass:.4g} kg"
        notes = (*notes, f"the volume of its shapes, {carries}: it floats awash")
    if whole < _LEAST_SHARE * wanted:
        return replace(derived_lines(boat), notes=notes)
    if wet.area <= 0.0:  # surfaces that pass through themselves
        return derived_lines(boat)
    rest = f"waterline at z = {round(wet.level, 4) + 0.0:.3g} m, draft {wet.level - low:.3g} m"
    length = float(np.ptp(corners[:, :, 0]))
    floats, lift = _floats(wet, wanted, max(whole, wanted), stations, _HIGHEST_LIFT * length)
    values = floats | {"boat_length": length} | _resistance(length)
    return Derived(values, rest, (*notes, *wet.remarks(body.center)), (0.0, 0.0, lift))


def _floats(wet: Flotation, volume: float, whole: float, stations: int, most: float) -> tuple[dict[str, object], float]:
    """Half cylinders whose lift, and its rates with depth, heel and trim, are those of a hull afloat.

    A section of radius R, wet to the depth s R, has the area a(s) R^2 and the chord k(s) R. Its s follows from
    the reserve of buoyancy, R from the mean depth of what is wet, and the length from the area of the waterplane. Also
    returns how far [m] above the stations, whose depth counts, their force acts: at the centre of buoyancy. Where
    that is more than `most`, a larger distance between the stations makes up for the rest.
    """
    from scipy.optimize import brentq

    reserve = min(max(whole / volume, _RESERVES[0]), _RESERVES[1])
    share = float(brentq(lambda s: _section(s) - 0.5 * math.pi / reserve, 1e-6, 1.0))
    chord = 2.0 * math.sqrt(share * (2.0 - share))
    radius = volume / wet.area * chord / _section(share)
    keel = wet.level - share * radius
    above = max(float(wet.center[2]) - keel, 0.0)
    lift = min(above, most)
    dx, dy = np.sqrt((wet.spread + (above - lift) * wet.volume) / wet.area)
    step = dx * math.sqrt(12.0 / (stations**2 - 1)) if stations > 1 else 0.0
    x, y = wet.center[:2]
    along = [float(x + (number - (stations - 1) / 2) * step) for number in range(stations)]
    length = wet.area / (chord * radius) / 2
    hulls = [
        {"length": length, "radius": radius, "points": [(place, float(y + side), keel) for place in along]}
        for side in (-dy, dy)
    ]
    return {"hull_radius": radius, "boat_width": 2.0 * float(dy), "hulls": hulls}, lift


def _section(share: float) -> float:
    """Area of a circle's segment whose height is a share of the radius, over the square of the radius."""
    return math.acos(1.0 - share) - (1.0 - share) * math.sqrt(share * (2.0 - share))


def _resistance(length: float) -> dict[str, object]:
    """The WAM-V's drag for a boat of a length [m]."""
    scale = length / _MODEL_LENGTH
    forces, moments = scale**2.5, scale**4.5
    return {
        "added_mass": (0.0,) * 6,
        "drag_linear": tuple(value * (forces if i < 3 else moments) for i, value in enumerate(_MODEL_LINEAR)),
        "drag_quadratic": (_MODEL_SURGE_QUADRATIC * scale**2, 0.0, 0.0, 0.0, 0.0, 0.0),
    }


def hull_corners(boat: Boat, volume: float) -> tuple[FloatArray, tuple[str, ...]]:
    """Triangles (n, 3, 3) in the base link [m] around what collides; around what is seen, if that displaces too little.

    Where neither displaces the volume [m3], those of the larger. With notes about meshes.
    """
    found = []
    for kind in ("collisions", "visuals"):
        placed = [(part, shape, solid(shape)) for part in boat.parts for shape in getattr(part, kind)]
        pieces = [item.at(compose(part.pose, shape.pose)) for part, shape, item in placed]
        corners = np.concatenate([np.empty((0, 3, 3)), *pieces])
        total = enclosed_volume(corners) if len(corners) else 0.0
        notes = dict.fromkeys(note for _, _, item in placed for note in item.notes)
        found.append((total, corners, tuple(notes)))
        if total > volume:
            break
    _, corners, kept = max(found, key=lambda item: item[0])
    return corners, kept


@lru_cache(maxsize=32)
def boat_box(boat: Boat) -> tuple[_Corner, _Corner]:
    """Least and greatest corner [m] in the base link's axes of the box around what the base link carries.

    Raises:
        VrxError: that has no shape.
    """
    for kind in ("collisions", "visuals"):
        corners = [corner for part in boat.parts for shape in getattr(part, kind) for corner in _corners(part, shape)]
        if corners:
            low, high = zip(*((min(axis), max(axis)) for axis in zip(*corners, strict=True)), strict=True)
            return low, high
    raise VrxError(f"robot {boat.name}: no shape gives its length and width; give a link <collision> or <visual>")


def _corners(part: Part, shape: Shape) -> list[_Corner]:
    pose = compose(part.pose, shape.pose)
    turn = rotation(*pose[3:])
    low, high = _extent(shape)
    found = []
    for corner in itertools.product(*zip(low, high, strict=True)):
        x, y, z = apply(turn, corner)
        found.append((pose[0] + x, pose[1] + y, pose[2] + z))
    return found


def _extent(shape: Shape) -> tuple[_Corner, _Corner]:
    """Least and greatest corner of a shape in its own frame [m]."""
    if shape.type == "mesh":
        points = read_mesh(contained_file(str(shape.file), shape.folder), shape.scale).points
        (a, b, c), (d, e, f) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return (a, b, c), (d, e, f)
    if shape.size is not None:
        x, y, z = (edge / 2 for edge in shape.size)
    else:
        x = y = z = float(shape.radius or 0.0)
        if shape.length is not None:
            z = shape.length / 2 + (x if shape.type == "capsule" else 0.0)
    return (-x, -y, -z), (x, y, z)
