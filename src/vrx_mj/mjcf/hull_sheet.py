"""The hydrostatics of a hull's mesh: displacement, centres, stiffness and righting arms.

Axes are the mesh's own, x forward, y left, z up. The figures follow from Archimedes' principle over its faces, exactly.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.solids import enclosed_volume
from vrx_mj.errors import VrxError
from vrx_mj.frames import rotation
from vrx_mj.mjcf.flotation import flotation, lift_fault

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
