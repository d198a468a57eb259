"""A hull's surface afloat: displacement, waterplane and metacentric heights.

What a body displaces that floats upright at some level follows from Archimedes' principle over flat faces, exactly.

The hydrostatics of a hull's mesh: displacement, centres, stiffness and righting arms.

Axes are the mesh's own, x forward, y left, z up. The figures follow from Archimedes' principle over its faces, exactly.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.config.shapes import enclosed_volume
from vrx_mj.errors import VrxError
from vrx_mj.frames import rotation

_MOST_LIFT = 1000.0
"""Lift of the whole hull over the boat's weight: a light inflatable one has 20."""
_ODD_ANGLE = math.radians(5.0)
"""Heel or trim at rest beyond which a boat's masses are hardly meant so."""


@dataclass(frozen=True)
class Flotation:
    """A closed surface that floats upright: what it displaces under the water's level, and its waterplane."""

    level: float
    """Height of the water [m]."""
    volume: float
    """Displaced volume [m3]."""
    center: FloatArray
    """(3,): centre of buoyancy [m]"""
    area: float
    """Area of the waterplane [m2]."""
    spread: FloatArray
    """(2,): second moments of the waterplane along x and along y, about its centroid [m4]"""
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
    carries = f"it has {mass:g} kg, its hull's {volume:.4g} m3 carry {volume * density:.4g} kg"
    if volume <= 0.0:
        return "sinks: its hull has no volume; a closed mesh that is not flat is needed"
    if volume * density <= mass:
        return f"sinks: {carries}; check the mesh's unit (m){more}"
    if volume * density > _MOST_LIFT * mass:
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


_HEELS = tuple(range(0, 181, 10))
"""Angles of heel of the righting arms [degrees]."""


@dataclass(frozen=True)
class HullSheet:
    """A hull afloat upright, without trim."""

    mass: float
    """Mass [kg]."""
    center_of_mass: tuple[float, float, float]
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
    center_of_buoyancy: tuple[float, float, float]
    """Centre of buoyancy [m]."""
    waterplane_area: float
    """Area of the waterplane [m2]."""
    center_of_flotation: float
    """x of the waterplane's middle [m]."""
    stiffness: tuple[float, float, float]
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
