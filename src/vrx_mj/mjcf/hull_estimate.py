"""Estimates of a hull's unknown parameters from its shape and mass, by published rules.

Axes are those of its base link: the origin on the waterline over the centre of buoyancy, x forward, y left, z up.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.shapes import normals_of
from vrx_mj.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from vrx_mj.frames import ZERO, Vector
from vrx_mj.mjcf.flotation import HullSheet, below, flotation_at, hull_sheet
from vrx_mj.physics.thrust import normal_slope

DENSITY, _GRAVITY = SEA_WATER_DENSITY, STANDARD_GRAVITY
"""Density of sea water [kg/m3] and gravity [m/s2]."""
_VISCOSITY = 1.19e-6
"""Kinematic viscosity of sea water at 15 degrees Celsius [m2/s] (ITTC 7.5-02-01-03)."""
_STATIONS = 20
"""Number of strips along a hull."""
_FULL_FROUDE = 0.4
"""Froude number at full thrust: that of the hull speed."""
_GYRATION = 0.375, 0.25
"""Radii of gyration over beam in roll, and over length in pitch and yaw (ITTC 7.5-02-07-02.1: 0.35 to 0.40; 0.25)."""
_RELATIVE_DAMPING = 0.3, 0.2, 0.4
"""Shares of critical damping in heave, roll and pitch, those of Fossen's Otter (otter.py, Fossen 2021)."""
WIND_COEFFICIENTS = 0.7, 0.825, 0.125
"""Coefficients of wind from ahead, across and about z: the middle of the ranges of Fossen (2021), 10.1."""
_ENGINE_SPACING = 0.38
"""Distance of the outer engines from the middle as a share of the beam: under the hulls of a catamaran."""
_BLUNT_COSINE = 0.9
"""Cosine of the angle to ahead or astern above which a face is a blunt end."""
_BLUNT_DRAG = 0.8, 0.2
"""Drag coefficients of blunt bows (Hoerner 1965) and of transoms (Holtrop and Mennen 1982) over their areas."""
_HOERNER = (
    (0.01, 0.35, 0.45, 0.47, 0.49, 0.56, 0.65, 0.83, 0.99, 1.31, 1.64, 2.31, 3.01, 4.0),
    (1.97, 1.90, 1.79, 1.58, 1.28, 1.08, 1.00, 0.88, 0.83, 0.76, 0.69, 0.63, 0.59, 0.56),
)
"""Half the beam over the draft, and the drag coefficient across: Hoerner's curve as Fossen (2021), 6.7, has it."""
_SKEG_ASPECT, _SKEG_RESERVE = 1.0, 1.25
"""Aspect ratio of a recommended skeg, and its area over the least that is needed."""


@dataclass(frozen=True)
class HullEstimate:
    """A boat made of a hull, a mass and a number of engines."""

    corners: FloatArray
    """Closed triangles (n, 3, 3) of the hull [m]."""
    sheet: HullSheet
    origin: FloatArray
    """Place of the base link in the axes of the mesh, (3,) [m]."""
    hulls: int
    """Hulls side by side."""
    length: float
    """Wet length [m]."""
    beam: float
    """Wet beam [m]."""
    inertia: Vector
    """Moments of inertia about the centre of mass [kg m2]."""
    added_mass: FloatArray
    """Added mass (6, 6) about the centre of buoyancy."""
    damping: FloatArray
    """Linear damping (6,)."""
    surge_drag: float
    """Quadratic damping of surge [N s2/m2]."""
    drafts: FloatArray
    """Drafts at `_STATIONS` places from stern to bow [m]."""
    across: float
    """Drag coefficient across, of all hulls together."""
    stern: tuple[float, float, float, float]
    """x and z [m], area [m2] and aspect ratio of the wing whose lift is that of the hull's stern."""
    speed: float
    """Speed at full thrust [m/s]."""
    thrust: float
    """Thrust of each engine ahead [N]."""
    engines: tuple[Vector, ...]
    """Points of thrust, from port to starboard [m]."""
    windage: Vector
    """Areas seen from ahead and from the side [m2], and height of the latter's middle [m]."""
    course: tuple[float, float, float, float]
    """Course stability at full thrust, from the linear equations of sway and yaw (Fossen 2021, 15.1).

    C = Yv (Nr - m xg U) - Nv (Yr - m U) over (rho L3 U / 2)2, above 0 if it does; rate at which a small turn grows
    [1/s]; moment for each rad/s of turn by which an engine or rudder would keep it [N m s], and area of a skeg at the
    stern that would [m2], both 0 if none is needed.
    """


def added_mass_of_sections(breadth: FloatArray, draft: FloatArray, area: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Added mass of Lewis sections in sway at low and in heave at high frequency, for each length [kg/m].

    With the half breadth M (1 + a1 + a3) and the draft M (1 - a1 + a3) (Lewis 1929; Newman 1977, 4.16; Korotkin 2009).
    """
    slender = (0.5 * breadth - draft) / (0.5 * breadth + draft)
    full = 4.0 / math.pi * np.minimum(area / (breadth * draft), 1.0)
    c = 3.0 + full + (1.0 - full) * slender**2
    a3 = (3.0 - c + np.sqrt(9.0 - 2.0 * c)) / c
    a1 = (1.0 + a3) * slender
    sway = 0.5 * math.pi * DENSITY * (draft / (1.0 - a1 + a3)) ** 2 * ((1.0 - a1) ** 2 + 3.0 * a3**2)
    heave = 0.125 * math.pi * DENSITY * (breadth / (1.0 + a1 + a3)) ** 2 * ((1.0 + a1) ** 2 + 3.0 * a3**2)
    return sway, heave


def shares_of_strips(length: float, breadth: float, draft: float) -> FloatArray:
    """Added mass in sway, heave, pitch and yaw of half an ellipsoid of these dimensions, over that of its strips.

    Lamb (1932), 114 and 115; Korotkin (2009). The integrals are Carlson's R_D.
    """
    from scipy.special import elliprd

    axes = 0.5 * length, 0.5 * min(breadth, 0.999 * length), min(draft, 0.499 * length)
    a2, b2, c2 = (axis**2 for axis in axes)
    along, across, down = (
        2.0 / 3.0 * math.prod(axes) * float(elliprd(*others)) for others in ((b2, c2, a2), (c2, a2, b2), (a2, b2, c2))
    )

    def turning(other: float, side: float) -> float:
        apart = a2 - other
        return apart**2 * (side - along) / (2.0 * apart - (a2 + other) * (side - along)) / a2

    tall = axes[2] / axes[1]
    heave, sway = down / (2.0 - down) * tall, across / (2.0 - across) / tall
    return np.array([sway, heave, turning(c2, down) * tall, turning(b2, across) / tall])


@dataclass(frozen=True)
class _Hull:
    """One of the hulls side by side, as strips of a length `dx` [m]."""

    length: float
    x: FloatArray
    dx: float
    y: float
    breadth: FloatArray
    draft: FloatArray
    area: FloatArray
    wetted: float
    """Wetted surface [m2]."""
    blunt: tuple[float, float]
    """Areas of blunt ends ahead and astern [m2]."""

    @property
    def volume(self) -> float:
        """Displaced volume [m3]."""
        return float(self.area.sum()) * self.dx

    def surge_drag(self, speed: float) -> float:
        """Quadratic damping of surge at a speed [N s2/m2].

        Friction of ITTC's line of 1957 with Watanabe's form factor (Molland et al. 2017, 4.3), and pressure on blunt
        ends; what the waves cost that it makes is left out.
        """
        friction = 0.075 / (math.log10(speed * self.length / _VISCOSITY) - 2.0) ** 2
        beam, draft = float(self.breadth.max()), float(self.draft.max())
        block = self.volume / (self.length * beam * draft)
        form = max(25.6 * block / ((self.length / beam) ** 2 * math.sqrt(beam / draft)) - 0.095, 0.0)
        ends = sum(c * area for c, area in zip(_BLUNT_DRAG, self.blunt, strict=True))
        return 0.5 * DENSITY * (self.wetted * friction * (1.0 + form) + ends)


def _hulls(wet: FloatArray) -> Iterator[_Hull]:
    """The hulls side by side of wet triangles (n, 3, 3): those between which no wet part is."""
    low, high = wet[:, :, 1].min(axis=1), wet[:, :, 1].max(axis=1)
    order = np.argsort(low, kind="stable")
    gaps = low[order][1:] > np.maximum.accumulate(high[order])[:-1] + 1e-6
    for part in np.split(order, np.flatnonzero(gaps) + 1):
        yield _hull(wet[part])


def _hull(wet: FloatArray) -> _Hull:
    edges = np.linspace(wet[:, :, 0].min(), wet[:, :, 0].max(), _STATIONS + 1)
    turned = wet[:, :, [1, 2, 0]]  # `below` cuts along the last axis
    pieces = [-below(-below(turned, high), -low)[:, :, [2, 0, 1]] for low, high in itertools.pairwise(edges)]
    found = [flotation_at(piece, 0.0) for piece in pieces]
    dx = float(edges[1] - edges[0])
    area = np.array([each.volume for each in found]) / dx
    breadth = np.array([each.area for each in found]) / dx
    draft = np.array([-float(piece[:, :, 2].min(initial=0.0)) for piece in pieces])
    across = 0.5 * normals_of(wet)
    sizes = np.linalg.norm(across, axis=1)
    ahead, astern = (float(sizes[side * across[:, 0] > _BLUNT_COSINE * sizes].sum()) for side in (1.0, -1.0))
    middle = 0.5 * float(wet[:, :, 1].min() + wet[:, :, 1].max())
    floor = 1e-6 * float(draft.max())
    return _Hull(
        _STATIONS * dx, edges[:-1] + 0.5 * dx, dx, middle, np.maximum(breadth, floor), np.maximum(draft, floor),
        np.maximum(area, floor**2), float(sizes.sum()), (ahead, astern),
    )  # fmt: skip


def estimated_hull(
    corners: FloatArray, mass: float, engines: int, center: Sequence[float] | None = None
) -> HullEstimate:
    """A boat of closed triangles (n, 3, 3) [m], counter-clockwise from outside, in any axes with x forward and z up.

    Args:
        corners: of the hull.
        mass: of the boat [kg].
        engines: number of engines at its stern.
        center: its centre of mass [m]; None: over the centre of buoyancy, as high as that of an even shell.

    Raises:
        VrxError: it does not float, or hardly touches the water.
    """
    sizes = np.linalg.norm(normals_of(corners), axis=1)
    height = float(sizes @ corners[:, :, 2].mean(axis=1) / sizes.sum())
    afloat = hull_sheet(corners, mass, ZERO, DENSITY, _GRAVITY)
    (x, y, _), waterline = afloat.center_of_buoyancy, afloat.waterline
    corners, (cx, cy, cz) = corners - (x, y, waterline), center or (x, y, height)
    sheet = hull_sheet(corners, mass, (cx - x, cy - y, cz - waterline), DENSITY, _GRAVITY)
    wet = below(corners, 0.0)
    hulls = list(_hulls(wet))
    low, high = wet.reshape(-1, 3).min(axis=0), wet.reshape(-1, 3).max(axis=0)
    length, beam, _ = (high - low).tolist()
    speed = _FULL_FROUDE * math.sqrt(_GRAVITY * length)
    added, drag = _added_mass(hulls, sheet.volume), [hull.surge_drag(speed) for hull in hulls]
    kx, ky = _GYRATION
    inertia = mass * (kx * beam) ** 2, mass * (ky * length) ** 2, mass * (ky * length) ** 2
    damping = np.zeros(6)
    rigid = mass, *inertia[:2]
    for axis, ratio, own, stiff in zip((2, 3, 4), _RELATIVE_DAMPING, rigid, sheet.stiffness, strict=True):
        damping[axis] = 2.0 * ratio * math.sqrt(max(stiff, 0.0) * (own + added[axis, axis]))
    # the outer hull of a turn is faster, the inner one slower
    damping[5] = sum(2.0 * k * speed * hull.y**2 for k, hull in zip(drag, hulls, strict=True))
    along, stern = np.linspace(low[0], high[0], _STATIONS), _stern(hulls, float(low[0]))
    drafts = np.max([np.interp(along, hull.x, hull.draft) for hull in hulls], axis=0)
    off = _ENGINE_SPACING * beam * np.linspace(1.0, -1.0, engines) * (engines > 1)
    places = tuple(
        (float(low[0]) + 0.04 * length, 0.5 * float(low[1] + high[1]) + y, 0.6 * float(low[2])) for y in off.tolist()
    )
    across = sum(float(np.interp(0.5 * hull.breadth.max() / hull.draft.max(), *_HOERNER)) for hull in hulls)
    return HullEstimate(
        corners, sheet, np.array([x, y, waterline]), len(hulls), length, beam, inertia, added, damping, sum(drag),
        drafts, across, stern, speed, sum(drag) * speed**2 / engines, places, _windage(corners),
        _course((mass, inertia[2]), cx - x, added, float(damping[5]), stern, length),
    )  # fmt: skip


def _added_mass(hulls: Sequence[_Hull], volume: float) -> FloatArray:
    """Added mass (6, 6) about their centre of buoyancy, the origin: strips of Lewis sections less an ellipsoid's ends.

    Surge is Soding's (1982) 2.7 rho V^(5/3) / L2, at most 0.2 rho V. Roll is that of hulls which heave, and of elliptic
    sections, rho pi / 16 (b2 / 4 - T2)2 (Korotkin 2009).
    """
    added = np.zeros((6, 6))
    for hull in hulls:
        sway, heave = (hull.dx * each for each in added_mass_of_sections(hull.breadth, hull.draft, hull.area))
        j2, j3, j5, j6 = shares_of_strips(hull.length, float(hull.breadth.max()), float(hull.draft.max())).tolist()
        roll = hull.dx * DENSITY * math.pi / 16.0 * (0.25 * hull.breadth**2 - hull.draft**2) ** 2
        surge = 2.7 * hull.volume ** (5.0 / 3.0) / hull.length**2
        rolled, pitched = (roll + j3 * heave * hull.y**2).sum(), j5 * heave @ hull.x**2
        own = surge, j2 * sway.sum(), j3 * heave.sum(), rolled, pitched, j6 * sway @ hull.x**2
        added += np.diag(own)
        added[1, 5] += j2 * sway @ hull.x
        added[2, 4] -= j3 * heave @ hull.x
    added[0, 0] = DENSITY * min(added[0, 0], 0.2 * volume)
    added[5, 1], added[4, 2] = added[1, 5], added[2, 4]
    return added


def _stern(hulls: Sequence[_Hull], stern: float) -> tuple[float, float, float, float]:
    """The wing at the stern whose lift is that of the hulls, each a wing of its length and draft.

    The flow leaves a slender hull at its stern, as a low wing's its trailing edge (Jones 1946; Newman 1977, 7.8; the
    leading terms of Clarke, Gedling and Hine 1983): Y'v = -pi (T / L)2, which acts there.
    """
    draft, length = max(float(hull.draft.max()) for hull in hulls), max(hull.length for hull in hulls)
    area = len(hulls) * math.pi * draft**2 / normal_slope(draft / length)
    return stern, -0.5 * draft, area, draft / length


def _windage(corners: FloatArray) -> Vector:
    """Areas above the water seen from ahead and from the side [m2], and the height of the latter's middle [m]."""
    dry = -below(-corners, 0.0)
    normals = np.abs(0.5 * normals_of(dry))
    ahead, side = (0.5 * float(normals[:, axis].sum()) for axis in (0, 1))
    return ahead, side, float(0.5 * normals[:, 1] @ dry[:, :, 2].mean(axis=1) / side)


def _course(
    rigid: Sequence[float], ahead: float, added: FloatArray, damping: float, stern: Sequence[float], length: float
) -> tuple[float, float, float, float]:
    """Course stability of a boat of a mass and inertia, with the centre of mass `ahead` of the origin [m]."""
    (mass, inertia), (x, _, area, aspect) = rigid, stern
    speed, lift = _FULL_FROUDE * math.sqrt(_GRAVITY * length), 0.5 * DENSITY * area * normal_slope(aspect)
    surge, sway, coupling = added[0, 0], added[1, 1], added[1, 5] - ahead * added[1, 1]
    yaw = added[5, 5] - 2.0 * ahead * added[1, 5] + ahead**2 * sway
    whole = np.array([[mass + sway, coupling], [coupling, inertia + yaw]])

    def forces(lift: float) -> FloatArray:
        """Forces of sway and yaw over the speed across and the rate of turn, Munk's moment in the corner; (2, 2)."""
        moment, turning = lift * (x - ahead), lift * (x - ahead) ** 2
        rows = [[lift, mass + surge + moment], [sway - surge + moment, coupling + turning + damping / speed]]
        return -speed * np.array(rows)

    found = float(np.linalg.det(forces(lift)))
    growth = float(np.linalg.eigvals(np.linalg.solve(whole, forces(lift))).real.max())
    slope = float(np.linalg.det(forces(lift + 1.0))) - found  # C is linear in the lift
    short = max(-found, 0.0)
    skeg = _SKEG_RESERVE * short / slope / (0.5 * DENSITY * normal_slope(_SKEG_ASPECT)) if slope > 0.0 else math.nan
    scale = (0.5 * DENSITY * length**3 * speed) ** 2
    return found / scale, growth, short / (lift * speed), skeg
