"""The sea as it is drawn: a fan of points around an eye, dense near it and thin far away.

Rings lie at distances that grow by a few percent, so that neighbours look equally far apart; spokes share
the width of the view among them. What is drawn is `waves.surface_height`, less those waves that a ring's
spacing cannot carry: they fade out before they would turn into false patterns.
"""

import math

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import cosine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import WAVE, Record, Table
from vrx_mj.physics.waves import ramp

__all__ = ["EDGE", "HORIZON", "RINGS", "SPOKES", "draw_surface", "fan", "fan_triangles", "reflectance", "ripples"]


SPOKES = 61
"""Points on a ring."""
BANDS = ((3.0, 0.5, 1.0), (60.0, 0.0, 1.06), (300.0, 0.0, 1.12), (5000.0, 0.0, 1.6))
"""Up to which distance [m] a ring lies at the last one's times a factor, the third number, plus the second [m]."""
HORIZON = 5000.0
"""Distance of the last ring [m]: from a mast of 2 m it is 0.02 degrees under the true horizon."""
EDGE = 0.01
"""The palette's numbers 0 and 1 lie this far from its borders, beyond which a texture begins again."""
FINE, COARSE = 0.5 * math.pi, math.pi
"""Wavenumber times spacing up to which a wave is drawn whole, a quarter of its length, and from which not at all."""


def _distances() -> FloatArray:
    rings = [0.0]
    for end, step, factor in BANDS:
        while rings[-1] < end - 1e-9:
            rings.append(min(rings[-1] * factor + step, end))
    return np.array(rings)


RINGS = len(_distances())
"""Rings of the fan; the first is its apex."""


def fan() -> tuple[FloatArray, FloatArray]:
    """Return the rings' distances (RINGS,) [m] and the spokes' places across the view (SPOKES,), -1 to 1."""
    return _distances(), np.linspace(-1.0, 1.0, SPOKES)


def fan_triangles() -> npt.NDArray[np.int32]:
    """Return the triangles of the fan, counter-clockwise from above; point (ring, spoke) is ring * SPOKES + spoke."""
    corner = (np.arange(RINGS - 1)[:, None] * SPOKES + np.arange(SPOKES - 1)).reshape(-1, 1)
    outer = corner + np.array([0, SPOKES, SPOKES + 1])
    inner = corner + np.array([0, SPOKES + 1, 1])
    apex = SPOKES - 1  # there the inner triangles have no area
    return np.concatenate([outer, inner[apex:]]).astype(np.int32)


def ripples(waves: Table) -> Table:
    """Return short waves that only shade the surface, so that a sea of three waves does not look like plastic.

    They run within 60 degrees of the longest wave, and their slopes are a share of the sea's own: none on a calm.
    """
    slopes = waves["amplitude"] * waves["wavenumber"]
    share = 0.35 * math.tanh(8.0 * float(np.sqrt(np.sum(slopes**2))))
    heading = math.atan2(*waves["direction"][0, ::-1]) if len(waves) else 0.0
    out = np.zeros(len(_RIPPLES) if share > 0.0 else 0, WAVE)
    for row, (length, turn, weight) in zip(out, _RIPPLES, strict=False):
        k = 2.0 * math.pi / length
        row["amplitude"], row["wavenumber"], row["frequency"] = share * weight / k, k, math.sqrt(9.81 * k)
        row["direction"] = math.cos(heading + turn), math.sin(heading + turn)
    return out


_RIPPLES = ((0.61, 0.9, 0.20), (0.97, -0.7, 0.24), (1.43, 0.35, 0.28), (2.3, -0.25, 0.32), (3.7, 0.55, 0.32))
"""Lengths [m], directions against the longest wave's [rad], and slopes relative to each other."""


@kernel
def _share(wavenumber: float, spacing: float) -> float:
    """Return how much of a wave is drawn where points are `spacing` [m] apart, 0 to 1."""
    x = min(max((COARSE - wavenumber * spacing) / (COARSE - FINE), 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


@kernel
def reflectance(cosine_of_incidence: float) -> float:
    """Return the share of light that water mirrors: Schlick's (1994) form of Fresnel's law, with 0.02 upright.

    At grazing angles a rough sea shows faces that are turned to the eye: the cosine is taken as 0.1 at least.
    """
    return 0.02 + 0.98 * (1.0 - max(cosine_of_incidence, 0.1)) ** 5


@kernel
def _shade(
    normal: tuple[float, float, float], view: tuple[float, float, float], sun: FloatArray
) -> tuple[float, float]:
    """Return a point's place on the palette: how much of the sky it mirrors, and how it glitters.

    `view` points to the eye, `sun` to the sun. The first is `reflectance`, with a little more where the surface
    leans to the sun, which represents the light that comes out of the water.
    """
    facing = normal[0] * view[0] + normal[1] * view[1] + normal[2] * view[2]
    lean = (normal[0] * sun[0] + normal[1] * sun[1]) / max(normal[2], 0.1)
    bounced = 0.0
    for axis in range(3):
        bounced += (2.0 * facing * normal[axis] - view[axis]) * sun[axis]
    mirrored = min(max(reflectance(facing) + 0.4 * lean, 0.0), 1.0)
    glitter = min(max(bounced, 0.0), 1.0) ** 40
    return EDGE + (1.0 - 2.0 * EDGE) * mirrored, EDGE + (1.0 - 2.0 * EDGE) * glitter


@kernel
def draw_surface(
    waves: Table,
    shading: Table,
    sea: Record,
    t: float,
    eye: FloatArray,
    sun: FloatArray,
    course: float,
    half: float,
    distances: FloatArray,
    spokes: FloatArray,
    vertices: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    palette: npt.NDArray[np.float32],
) -> None:
    """Write points (n, 3) [m, world], unit normals (n, 3) and places on the palette (n, 2) at time `t` [s].

    The fan's apex lies under `eye` (3,) [m]; it opens by `half` [rad] to both sides of `course` [rad,
    counter-clockwise from east], and `half` = pi is the whole circle. `sun` (3,) points to the sun. `shading` are
    waves that only tilt the normals. Near the eye heights are `surface_height`.
    """
    grown = ramp(sea, t)
    for ring in range(distances.size):
        r = distances[ring]
        gap = max(r - distances[ring - 1] if ring else 0.0, r * half * 2.0 / (spokes.size - 1))
        for spoke in range(spokes.size):
            angle = course + half * spokes[spoke]
            x, y = eye[0] + r * math.cos(angle), eye[1] + r * math.sin(angle)
            height, east, north = _elevation_and_slope(waves, shading, x, y, t, gap)
            z, east, north = sea.level + grown * height, grown * east, grown * north
            row = ring * spokes.size + spoke
            length = math.sqrt(1.0 + east * east + north * north)
            normal = (-east / length, -north / length, 1.0 / length)
            away = max(math.sqrt(r * r + (eye[2] - z) ** 2), 1e-6)
            view = ((eye[0] - x) / away, (eye[1] - y) / away, (eye[2] - z) / away)
            vertices[row, 0], vertices[row, 1], vertices[row, 2] = x, y, z
            normals[row, 0], normals[row, 1], normals[row, 2] = normal
            palette[row, 0], palette[row, 1] = _shade(normal, view, sun)


@kernel
def _elevation_and_slope(
    waves: Table, shading: Table, x: float, y: float, t: float, gap: float
) -> tuple[float, float, float]:
    """Return the grown sea's height [m] and its slopes to the east and north, of waves that `gap` [m] can carry."""
    height, east, north = 0.0, 0.0, 0.0
    for i in range(waves.size + shading.size):
        wave = waves[i] if i < waves.size else shading[i - waves.size]
        share = _share(wave.wavenumber, gap)
        if share > 0.0:
            along = wave.direction[0] * x + wave.direction[1] * y
            phase = wave.wavenumber * along - wave.frequency * t + wave.phase
            slope = -share * wave.amplitude * wave.wavenumber * math.sin(phase)
            if i < waves.size:
                height += share * wave.amplitude * cosine(phase)
            east += slope * wave.direction[0]
            north += slope * wave.direction[1]
    return height, east, north
