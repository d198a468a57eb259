"""Hydrostatics of a hull's mesh, and a hull's hydrodynamics from its shapes and mass where no file gives them.

Axes are the mesh's own, x forward, y left, z up. The figures follow from Archimedes' principle over its faces, exactly.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.config.search import contained_file
from vrx_mj.config.shapes import Shape, enclosed_volume, solid
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.reader import read_mesh
from vrx_mj.frames import Vector, apply, compose, rotation
from vrx_mj.mjcf.boats import Boat, Part, boat_mass
from vrx_mj.model.boats import Vessel

MOST_LIFT = 1000.0
"""Lift of the whole hull over the boat's weight: a light inflatable one has 20."""
_ODD_ANGLE = math.radians(5.0)
"""Heel or trim at rest above which a boat's masses are probably wrong [rad]."""
_HEELS = tuple(range(0, 181, 10))
"""Angles of heel of the righting arms [degrees]."""
DENSITY = 997.8
"""Density of VRX's water [kg/m3]."""
_MAX_LINE_LIFT = 2.5
"""Largest lift over weight of floats in lines: 2.7 for the bare WAM-V."""
_VOLUME_LIFTS = (1.1, 10.0)
"""Least and largest lift over weight of floats that have a volume."""
_LINE_SPREAD = 1.0 / math.sqrt(3.0)
"""Two lines of stations this share of the beam apart roll as stiffly as a solid rectangular waterplane."""
_MODEL_LENGTH = 4.9
"""Length of the WAM-V [m]. Froude's law scales its drag: forces per speed with the length to 2.5, moments to 4.5."""
_MODEL_LINEAR = (51.3, 40.0, 500.0, 50.0, 50.0, 400.0)
"""Linear drag of the WAM-V: three forces [N s/m] and three moments [N m s]."""
_MODEL_SURGE_QUADRATIC = 72.4
"""Quadratic drag of the WAM-V in surge [N s2/m2]."""
LINES = frozenset({"hull_radius", "boat_width", "boat_length", "hulls"})
"""Fields that place floats: a file that gives one of them means lines of floats at z = 0, as VRX has them."""
_MAX_LIFT_HEIGHT = 0.1
"""Largest height of the buoyancy over the point of the drag, as a share of the length: drag then still damps all
motion."""
_MIN_HULL_SHARE = 0.1
"""Share of a boat's displacement below which its shapes are no hull, and give no more than its length and beam."""
_AWASH_SHARE = 0.95
"""Share of its height at which a boat floats that is heavier than what its shapes displace."""


@dataclass(frozen=True)
class Flotation:
    """A closed surface that floats upright: what it displaces under the water's level, and its waterplane."""

    level: float
    """Height of the water [m]."""
    volume: float
    """Displaced volume [m3]."""
    center: FloatArray
    """Centre of buoyancy, (3,) [m]."""
    area: float
    """Area of the waterplane [m2]."""
    spread: FloatArray
    """Second moments of the waterplane along x and along y, about its centroid, (2,) [m4]."""
    middle: float
    """x of the waterplane's centroid [m]."""

    def metacentric_heights(self, center: FloatArray) -> tuple[float, float]:
        """GM in trim and in heel [m] with the centre of mass (3,) at `center` [m]."""
        up = float(center[2] - self.center[2])
        trim, heel = (float(spread) / self.volume - up for spread in self.spread)
        return trim, heel

    def remarks(self, center: FloatArray, given: str = "the <inertial> of its links") -> list[str]:
        """Remarks about how it floats at rest: from the metacentric heights follows how far it heels and trims.

        `center` (3,) is the centre of mass [m], and `given` names what gives it.
        """
        ahead, left, up = (float(value) for value in center - self.center)
        trim, heel = self.metacentric_heights(center)
        if min(trim, heel) <= 0.0:
            height = f"{up:.3g} m above its centre of buoyancy"
            return [
                f"its centre of mass is {height}: the metacentric height is {min(trim, heel):.3g} m, and it capsizes"
            ]
        notes = []
        for angle, ends, offset in (
            (math.atan2(ahead, trim), ("bow", "stern"), abs(ahead)),
            (math.atan2(left, heel), ("port side", "starboard side"), abs(left)),
        ):
            if abs(angle) > _ODD_ANGLE:
                end = ends[0] if angle > 0.0 else ends[1]
                notes.append(
                    f"it floats about {math.degrees(abs(angle)):.0f} degrees down at the {end}: its centre of mass is "
                    f"{offset:.3g} m from its centre of buoyancy; check {given}"
                )
        return notes


def lift_fault(volume: float, density: float, mass: float, more: str, scale: str) -> str:
    """Why a hull that holds a volume [m3] does not carry a mass [kg], or out of all proportion more; empty if it does.

    `more` is what else to check where it carries too little, and `scale` how a mesh in mm is given.
    """
    carries = f"its mass is {mass:g} kg, but its hull's {volume:.4g} m3 carry {volume * density:.4g} kg"
    if volume <= 0.0:
        return "sinks: its hull has no volume; a closed mesh that is not flat is needed"
    if volume * density <= mass:
        return f"sinks: {carries}; check the mesh's unit (m){more}"
    if volume * density > MOST_LIFT * mass:
        return f"hardly touches the water: {carries}; check the mesh's unit (m; {scale} takes one in mm)"
    return ""


def flotation_at(corners: FloatArray, level: float) -> Flotation:
    """The flotation of closed triangles (n, 3, 3) [m] in water of a level [m].

    Gauss's theorem with fields that vanish at the level, so that only wet faces count: V is the integral of
    (z - level) n_z over them, and the waterplane's area that of -n_z. Midpoints of edges integrate quadratics exactly.
    """
    wet = below(corners, level)
    along, across = wet[:, 1] - wet[:, 0], wet[:, 2] - wet[:, 0]
    weight = ((along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]) / 6.0)[:, None]  # a third of the area on z = 0
    x, y, z = np.moveaxis((wet + np.roll(wet, -1, axis=1)) / 2.0, 2, 0)
    volume, area = float((weight * (z - level)).sum()), -3.0 * float(weight.sum())
    if volume <= 0.0:
        return Flotation(level, 0.0, np.zeros(3), 0.0, np.zeros(2), 0.0)
    moments = [float((weight * value).sum()) for value in (x * (z - level), y * (z - level), (z * z - level**2) / 2.0)]
    spread = [-float((weight * v * v).sum()) - float((weight * v).sum()) ** 2 / area if area > 0.0 else 0.0
              for v in (x, y)]  # fmt: skip
    middle = -float((weight * x).sum()) / area if area > 0.0 else 0.0
    return Flotation(level, volume, np.array(moments) / volume, area, np.maximum(spread, 0.0), middle)


def flotation(corners: FloatArray, volume: float, share: float = 1e-5) -> Flotation:
    """The flotation of closed triangles (n, 3, 3) [m] that displace a volume [m3], which is less than all of theirs.

    The level is met within a share of their height.
    """
    from scipy.optimize import brentq

    heights = corners[:, :, 2]
    low, high = float(heights.min()), float(heights.max())

    def excess(level: float) -> float:
        return flotation_at(corners, level).volume - volume

    return flotation_at(corners, float(brentq(excess, low, high, xtol=share * (high - low))))


def below(corners: FloatArray, level: float) -> FloatArray:
    """The parts of triangles below a level, as triangles that turn the same way."""
    wet = corners[:, :, 2] < level
    count = wet.sum(axis=1)
    a, b, c = _starting(corners[count == 1], wet[count == 1])
    tip = np.stack([a, _crossing(a, b, level), _crossing(a, c, level)], axis=1)
    a, b, c = _starting(corners[count == 2], ~wet[count == 2])
    left, right = _crossing(b, a, level), _crossing(c, a, level)
    first, second = np.stack([left, b, c], axis=1), np.stack([left, c, right], axis=1)
    return np.concatenate([corners[count == 3], tip, first, second])


def outline(corners: FloatArray, level: float) -> tuple[FloatArray, FloatArray]:
    """Middles (n, 2) of the lines in which triangles pass a level, and outward normals (n, 2) as long [m]."""
    wet = corners[:, :, 2] < level
    count = wet.sum(axis=1)
    found = []
    for number, sign in ((1, 1.0), (2, -1.0)):
        cut = count == number
        a, b, c = _starting(corners[cut], wet[cut] if number == 1 else ~wet[cut])
        right, left = _crossing(b, a, level)[:, :2], _crossing(c, a, level)[:, :2]
        along = sign * (right - left)
        found.append((0.5 * (right + left), np.stack((along[:, 1], -along[:, 0]), axis=1)))
    middles, normals = zip(*found, strict=True)
    return np.concatenate(middles), np.concatenate(normals)


def _starting(corners: FloatArray, marked: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The three corners of triangles in their order, from the one that is marked."""
    rows, start = np.arange(len(corners)), marked.argmax(axis=1) if len(corners) else np.empty(0, dtype=np.int64)
    return corners[rows, start], corners[rows, (start + 1) % 3], corners[rows, (start + 2) % 3]


def _crossing(wet: FloatArray, dry: FloatArray, level: float) -> FloatArray:
    """Where lines from wet points to dry ones pass the level."""
    share = (level - wet[:, 2]) / (dry[:, 2] - wet[:, 2])
    return wet + share[:, None] * (dry - wet)


@dataclass(frozen=True)
class HullSheet:
    """A hull afloat upright, without trim."""

    mass: float
    """Mass [kg]."""
    center_of_mass: Vector
    """Centre of mass [m]."""
    density: float
    """Density of the water [kg/m3]."""
    gravity: float
    """Gravity [m/s2]."""
    waterline: float
    """Height of the water [m]."""
    draft: float
    """Depth of the keel under it [m]."""
    volume: float
    """Displaced volume [m3]."""
    center_of_buoyancy: Vector
    """Centre of buoyancy [m]."""
    waterplane_area: float
    """Area of the waterplane [m2]."""
    center_of_flotation: float
    """x of the waterplane's middle [m]."""
    stiffness: Vector
    """C33 [N/m], C44 and C55 [N m/rad] about the waterplane's middle, at the same displacement."""
    righting_arms: tuple[tuple[float, float], ...]
    """Angle of heel to starboard [degrees] and righting arm GZ [m], at the same displacement and without trim."""

    @property
    def kb(self) -> float:
        """Centre of buoyancy over the keel [m]."""
        return self.center_of_buoyancy[2] - self.waterline + self.draft

    @property
    def kg(self) -> float:
        """Centre of mass over the keel [m]."""
        return self.center_of_mass[2] - self.waterline + self.draft

    @property
    def gm(self) -> tuple[float, float]:
        """Metacentric heights, transverse and longitudinal [m]."""
        weight = self.mass * self.gravity
        return self.stiffness[1] / weight, self.stiffness[2] / weight

    @property
    def bm(self) -> tuple[float, float]:
        """Metacentric radii, transverse and longitudinal [m]."""
        across, along = self.gm
        return across + self.kg - self.kb, along + self.kg - self.kb

    @property
    def tonnes_per_centimetre(self) -> float:
        """Mass that sinks it by a centimetre [t]."""
        return self.density * self.waterplane_area / 1e5


def _arm(corners: FloatArray, volume: float, heel: float) -> float:
    """Righting arm [m] at a heel to starboard [rad] of triangles about the centre of mass that displace a volume."""
    turned = corners @ np.array(rotation(heel, 0.0, 0.0)).T
    return -float(flotation(turned, volume, 1e-10).center[1])


def hull_sheet(
    corners: FloatArray, mass: float, center: Sequence[float], density: float = 1025.0, gravity: float = 9.80665
) -> HullSheet:
    """The hydrostatics of closed triangles (n, 3, 3) [m], counter-clockwise from outside.

    Args:
        corners: of the hull.
        mass: of the boat [kg].
        center: its centre of mass [m].
        density: of the water [kg/m3].
        gravity: [m/s2]

    Raises:
        VrxError: it does not float, or on a film of water.
    """
    if fault := lift_fault(enclosed_volume(corners), density, mass, ", or its --scale", "--scale 0.001"):
        raise VrxError(f"it {fault}")
    own = corners - np.asarray(center, np.float64)
    wet = flotation(corners, mass / density, 1e-10)
    x, y, z = wet.center.tolist()
    trim, heel = (mass * gravity * height for height in wet.metacentric_heights(np.asarray(center)))
    return HullSheet(
        mass=mass,
        center_of_mass=(float(center[0]), float(center[1]), float(center[2])),
        density=density,
        gravity=gravity,
        waterline=wet.level,
        draft=wet.level - float(corners[..., 2].min()),
        volume=mass / density,
        center_of_buoyancy=(x, y, z),
        waterplane_area=wet.area,
        center_of_flotation=wet.middle,
        stiffness=(density * gravity * wet.area, heel, trim),
        righting_arms=tuple((float(heel), _arm(own, mass / density, math.radians(heel))) for heel in _HEELS),
    )


@dataclass(frozen=True)
class DerivedValues:
    """Fields of `HydrodynamicsConfig`, and remarks about them."""

    values: dict[str, object]
    rest: str = ""
    """Description of the boat afloat at rest."""
    notes: tuple[str, ...] = ()
    """Remarks about unusual shapes or masses."""
    pushed: Vector | None = None
    """Point where the water pushes [m], for `Boat.pushed`."""


def derived_lines(boat: Boat) -> DerivedValues:
    """VRX's two lines of floats for a boat of which only shapes and mass are known.

    Length and beam are those of the box around what collides, or else is seen; the floats' radius gives a lift of
    `_MAX_LINE_LIFT` times the weight; drag is the WAM-V's by Froude's law of similarity; added mass is nil.

    Raises:
        VrxError: the boat has no shape, or no mass.
    """
    low, high = boat_box(boat)
    length, beam = high[0] - low[0], high[1] - low[1]
    floats = {
        "hull_radius": math.sqrt(_MAX_LINE_LIFT * boat_mass(boat).mass / (math.pi * DENSITY * length)),
        "boat_width": _LINE_SPREAD * beam,
        "boat_length": length,
    }
    return DerivedValues(floats | _resistance(length))


def derived_floats(boat: Boat, density: float, stations: int) -> DerivedValues:
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
        wet = flotation_at(corners, low + _AWASH_SHARE * (high - low))
        carries = f"{whole:.3g} m3, carries only {whole * density:.4g} kg of its {body.mass:.4g} kg"
        notes = (*notes, f"the volume of its shapes, {carries}: it floats awash")
    if whole < _MIN_HULL_SHARE * wanted:
        return replace(derived_lines(boat), notes=notes)
    if wet.area <= 0.0:  # surfaces that pass through themselves
        return derived_lines(boat)
    rest = f"waterline at z = {round(wet.level, 4) + 0.0:.3g} m, draft {wet.level - low:.3g} m"
    length = float(np.ptp(corners[:, :, 0]))
    floats, lift = _floats(wet, wanted, max(whole, wanted), stations, _MAX_LIFT_HEIGHT * length)
    values = floats | {"boat_length": length} | _resistance(length)
    return DerivedValues(values, rest, (*notes, *wet.remarks(body.center)), (0.0, 0.0, lift))


def _floats(wet: Flotation, volume: float, whole: float, stations: int, most: float) -> tuple[dict[str, object], float]:
    """Half cylinders whose lift, and its rates with depth, heel and trim, are those of a hull afloat.

    A section of radius R, wet to the depth s R, has the area a(s) R^2 and the chord k(s) R. Its s follows from
    the reserve of buoyancy, R from the mean depth of what is wet, and the length from the area of the waterplane. Also
    returns how far [m] above the stations, whose depth counts, their force acts: at the centre of buoyancy. Where
    that is more than `most`, a larger distance between the stations makes up for the rest.
    """
    from scipy.optimize import brentq

    reserve = min(max(whole / volume, _VOLUME_LIFTS[0]), _VOLUME_LIFTS[1])
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


def faces_of(vessel: Vessel) -> FloatArray:
    """Triangles (n, 3, 3) of a hull's mesh [m]."""
    found: FloatArray = np.array(vessel.vertices)[np.array(vessel.triangles)]
    return found


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
def boat_box(boat: Boat) -> tuple[Vector, Vector]:
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


def _corners(part: Part, shape: Shape) -> list[Vector]:
    pose = compose(part.pose, shape.pose)
    turn = rotation(*pose[3:])
    low, high = _extent(shape)
    found = []
    for corner in itertools.product(*zip(low, high, strict=True)):
        x, y, z = apply(turn, corner)
        found.append((pose[0] + x, pose[1] + y, pose[2] + z))
    return found


def _extent(shape: Shape) -> tuple[Vector, Vector]:
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
