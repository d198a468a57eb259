"""The sea as it is drawn: a fan of points around an eye, which look equally far apart, from the eye to the horizon.

Rings lie at equal steps of the angle under the horizon and, far away, of the logarithm of the distance; spokes share
the width of the view among them. What is drawn is `waves.surface_height`, less those waves that a ring's cells cannot
carry: these fade, by length and direction, before they would turn into false patterns. What fades from the shape stays
in the light: its slopes make the mean reflectance of the sky smaller and the glitter wide, its crests the foam.
"""

import math

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import near_cosine_and_sine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import ramp

RINGS, SPOKES = 84, 73
"""Points of a spoke and of a ring."""
_ANGLE, _GROWTH = 0.0064, 0.06
"""Steps from ring to ring whose shares of the rings are equal: angle [rad], or ratio of distances."""
_LEAST_HEIGHT = 0.5
"""Height of the eye over a calm sea from which the angles are measured, at least [m]."""
FINE, COARSE = 0.4 * math.pi, 0.8 * math.pi
"""Phases between neighbours up to which a wave is drawn whole, a fifth of its length, and from which not at all."""
_STRAIGHT = 1.2
"""Half the fan's angle [rad] up to which its last ring is a straight line: an arc would be seen as steps of a pixel."""
_LIT = 1.6
"""How much smaller the squares of these phases are for light and foam, which change faster than the heights."""
EDGE = 0.01
"""The palette's numbers 0 and 1 lie this far from its borders, beyond which a texture begins again."""
PLAIN = 0.5
"""Row of the palette of water with neither glitter, which is above it, nor foam, which is below."""
WAVELETS = 0.008
"""Variance of the slopes of wavelets that no table of waves has: Cox and Munk's (1954) at a wind of 1 m/s."""
_SPOKE = 0.6
"""Standard deviation of the weights of the mean over spokes, in their steps: the least that a mesh can carry."""
_BREAKING, _SOFT = 0.29, 0.05
"""Downward acceleration, in parts of g, at which half of a crest is foam, and its standard deviation.

Half of g is measured (Snyder and Kennedy, 1983), with the short waves that tables lack: this makes half a percent of a
wind sea of 1.2 m and 5 s white."""
_FRINGE = 0.25
"""Width of the foam around what stands in the water [m]."""
_RIPPLES = ((0.61, 0.9, 0.20), (0.97, -0.7, 0.24), (1.43, 0.35, 0.28), (2.3, -0.25, 0.32), (3.7, 0.55, 0.32))
"""Lengths [m], directions against the longest wave's [rad], and slopes relative to each other."""


def horizon(height: float) -> float:
    """Distance [m] of the last ring for an eye at a height [m]: that of the true horizon, 5 km at least."""
    return max(5000.0, 3570.0 * math.sqrt(max(height, 0.0)))


def sky_distance(height: float) -> float:
    """Distance [m] at which the sky hides what is drawn, for an eye at a height [m]: behind all of the last ring."""
    return 1.2 * horizon(height) / math.cos(_STRAIGHT)


def ring_distances(height: float, deviation: float, lowest: float, highest: float, count: int = RINGS) -> FloatArray:
    """Return the rings' distances (count,) [m] for an eye at a height [m] over the mean level.

    Args:
        height: of the eye [m].
        deviation: standard deviation of the surface [m]: crests may stand before what a calm sea would show.
        lowest: direction down to which the eye sees, from the horizon [rad].
        highest: direction up to which it does; the horizon is 0.
        count: of the rings.
    """
    slack, far = 3.0 * deviation + 0.2, horizon(height)
    near = 0.0 if lowest < -1.5 else max(height - slack, 0.0) / math.tan(max(-lowest, 1e-3))
    if highest < -1e-3:
        far = min((height + slack) / math.tan(-highest), far)
    scale = max(height, _LEAST_HEIGHT + 2.0 * deviation)
    near = min(near, 0.5 * far)
    tries = np.geomspace(near + scale, max(far, near + 1.0) + scale, 400) - scale
    number = np.arctan(tries / scale) / _ANGLE + np.log1p((tries / scale) ** 2) / (2.0 * _GROWTH)
    return np.asarray(np.interp(np.linspace(number[0], number[-1], count), number, tries))


def spokes(count: int = SPOKES) -> FloatArray:
    """Return the spokes' places across the view (count,), -1 to 1."""
    return np.linspace(-1.0, 1.0, count)


def fan_triangles(rings: int = RINGS, count: int = SPOKES) -> npt.NDArray[np.int32]:
    """Return the triangles of a fan of `count` spokes, counter-clockwise from above.

    Point (ring, spoke) is ring * count + spoke; the first triangle is (0, count, count + 1).
    """
    corner = (np.arange(rings - 1)[:, None] * count + np.arange(count - 1)).reshape(-1, 1)
    pairs = corner + np.array([0, count, count + 1, 0, count + 1, 1])  # side by side, they share what is lit
    return np.asarray(pairs.reshape(-1, 3), np.int32)


def ripples(waves: Table) -> Table:
    """Return short waves that only shade the surface, so that a sea of three waves does not look like plastic.

    They run within 60 degrees of the longest wave, and their slopes are a share of the sea's own: none on a calm.
    """
    slopes = waves["amplitude"] * waves["wavenumber"]
    share = 0.35 * math.tanh(8.0 * float(np.sqrt(np.sum(slopes**2))))
    heading = math.atan2(*waves["direction"][0, ::-1]) if len(waves) else 0.0
    out = np.zeros(len(_RIPPLES) if share > 0.0 else 0, waves.dtype)
    for row, (length, turn, weight) in zip(out, _RIPPLES, strict=False):
        k = 2.0 * math.pi / length
        row["amplitude"], row["wavenumber"], row["frequency"] = share * weight / k, k, math.sqrt(9.81 * k)
        row["direction"] = math.cos(heading + turn), math.sin(heading + turn)
    return out


@kernel
def reflectance(cosine_of_incidence: float, deviation: float) -> float:
    """Return the mean share of light that water mirrors whose slopes have a standard deviation.

    Schlick's (1994) form of Fresnel's law, with 0.02 upright; the mean over slopes is Bruneton's (2010).
    """
    grazing = (1.0 - min(max(cosine_of_incidence, 0.0), 1.0)) ** (5.0 * math.exp(-2.69 * deviation))
    return float(0.02 + 0.98 * grazing / (1.0 + 22.7 * deviation**1.5))


@kernel
def _shade(
    slope: tuple[float, float], view: tuple[float, float, float], sun: FloatArray, variance: float, turn: float
) -> tuple[float, float]:
    """Return how much of the sky a point mirrors, and how it glitters, 0 to 1.

    `view` points to the eye, `sun` to the sun, `variance` is that of the slopes around `slope`, `turn` [rad] the angle
    from spoke to spoke, over which glitter is a mean: a narrower path of a low sun would have steps. The first is
    `reflectance`, with a little more where the surface leans to the sun, which represents the light that comes out of
    the water. Glitter is that of Cox and Munk (1954): the density of the slope that mirrors the sun, as a share of what
    a white surface throws back, with Reinhard's (2002) curve for what is brighter than a picture can be: an edge of
    white would follow the cells.
    """
    upright = 1.0 / math.sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1])
    facing = (view[2] - slope[0] * view[0] - slope[1] * view[1]) * upright
    lean = -(slope[0] * sun[0] + slope[1] * sun[1]) * min(upright, 1.0)
    spread = variance + WAVELETS
    mirrored = min(max(reflectance(facing, math.sqrt(spread)) + 0.4 * lean, 0.0), 1.0)
    half = (view[0] + sun[0], view[1] + sun[1], view[2] + sun[2])
    length = math.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    if half[2] < 0.05 * length or view[2] <= 0.0:
        return mirrored, 0.0
    level = max(math.sqrt(view[0] * view[0] + view[1] * view[1]), 1e-6)
    east, north = half[0] / half[2] + slope[0], half[1] / half[2] + slope[1]
    along, across = (east * view[0] + north * view[1]) / level, (north * view[0] - east * view[1]) / level
    wide = spread + (_SPOKE * turn * level / half[2]) ** 2
    cosine = 0.5 * length  # of the incidence of the sun on what mirrors it: both are unit vectors
    off = along * along / spread + across * across / wide
    density = math.exp(-min(0.5 * off, 50.0)) / (2.0 * math.pi * math.sqrt(spread * wide))
    upward = half[2] / length
    glitter = math.pi * reflectance(cosine, 0.0) * density / (4.0 * max(view[2], 0.1) * upward**4)
    return mirrored, glitter / (1.0 + glitter)


@kernel
def draw_surface(
    waves: Table,
    shading: Table,
    sea: Record,
    t: float,
    eye: FloatArray,
    sun: FloatArray,
    half: float,
    distances: FloatArray,
    cell: float,
    floats: FloatArray,
    sums: FloatArray,
    vertices: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    palette: npt.NDArray[np.float32],
) -> None:
    """Write points (n, 3) [m, world], unit normals (n, 3) and places on the palette (n, 2) at time `t` [s].

    The fan's apex lies under `eye` (3,) [m]; `half` [rad] is half its angle. `cell` is the length by which waves are
    drawn or fade, in gaps between rings. `sun` (3,) points to the sun. `shading` are waves that only tilt the normals.
    `floats` (m, 7) stand in the water: east, north, direction of an edge (2,), half its length and half the other's
    [m], and how much foam surrounds them, 0 to 1. `sums` (8, spokes) begins with the directions of the spokes, to the
    east and north; the rest is overwritten. Near the eye heights are
    `surface_height`.
    """
    grown, count = ramp(sea, t), sums.shape[1]
    for ring in range(distances.size):
        r, beside = distances[ring], distances[ring] * half * 2.0 / (count - 1)
        gap = 0.5 * cell * (distances[min(ring + 1, distances.size - 1)] - distances[max(ring - 1, 0)])
        sums[2:] = 0.0
        for i in range(waves.size + shading.size):
            own, lift = (waves[i], 1.0) if i < waves.size else (shading[i - waves.size], 0.0)
            _add_wave(own, lift, sea.gravity, eye, r, gap, beside, t, sums)
        for spoke in range(count):
            height, east, north, rough, fall, falls = sums[2:, spoke]
            z, slope = sea.level + grown * height, (grown * east, grown * north)
            if ring == distances.size - 1 and half < _STRAIGHT:
                r = distances[ring] / math.cos(half * (2.0 * spoke / (count - 1) - 1.0))
            x, y = eye[0] + r * sums[0, spoke], eye[1] + r * sums[1, spoke]
            row, length = ring * count + spoke, math.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
            away = max(math.sqrt(r * r + (eye[2] - z) ** 2), 1e-6)
            view = ((eye[0] - x) / away, (eye[1] - y) / away, (eye[2] - z) / away)
            mirrored, glitter = _shade(slope, view, sun, grown * grown * rough, 2.0 * half / (count - 1))
            foam = _share_above(_BREAKING - grown * fall, math.sqrt(grown * grown * falls + _SOFT * _SOFT))
            foam = max(foam, _fringe(floats, x, y, _FRINGE + 0.5 * max(gap, beside)))
            vertices[row, 0], vertices[row, 1], vertices[row, 2] = x, y, z
            normals[row, 0], normals[row, 1], normals[row, 2] = -slope[0] / length, -slope[1] / length, 1.0 / length
            palette[row, 0] = EDGE + (1.0 - 2.0 * EDGE) * mirrored
            palette[row, 1] = PLAIN + (PLAIN - EDGE) * (glitter * (1.0 - foam) - foam)


@kernel
def _share_above(by: float, deviation: float) -> float:
    """Return the share of a normal distribution above a number: its logistic approximation."""
    return 1.0 / (1.0 + math.exp(min(1.702 * by / deviation, 50.0)))


@kernel
def _fringe(floats: FloatArray, x: float, y: float, width: float) -> float:
    """Return the foam at a place [m] around floats, in fringes whose width [m] the cells can carry."""
    most = 0.0
    for i in range(floats.shape[0]):
        east, north = x - floats[i, 0], y - floats[i, 1]
        if abs(east) + abs(north) > floats[i, 4] + floats[i, 5] + 4.0 * width:
            continue
        along, across = east * floats[i, 2] + north * floats[i, 3], north * floats[i, 2] - east * floats[i, 3]
        off = max(abs(along) - floats[i, 4], 0.0) ** 2 + max(abs(across) - floats[i, 5], 0.0) ** 2
        most = max(most, floats[i, 6] * _FRINGE / width * math.exp(-min(off / (width * width), 50.0)))
    return most


@kernel
def _share(turn: float) -> float:
    """Return how much is drawn of a wave whose phase from point to point has a square `turn`, 0 to 1."""
    x = min(max((COARSE * COARSE - turn) / (COARSE * COARSE - FINE * FINE), 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


@kernel
def _add_wave(
    wave: Record, lift: float, gravity: float, eye: FloatArray, r: float, gap: float, beside: float, t: float,
    sums: FloatArray,
) -> None:  # fmt: skip
    """Add a wave to the sums of a ring at a distance `r` [m], whose cells are `gap` long and `beside` wide [m].

    `sums` are east and north of the spokes; height [m], slopes to the east and north, the variance of the slopes that
    are not lit, and the downward acceleration [g] with the variance of what is not counted of it. `lift` 0: slopes
    alone.
    """
    k, east, north = wave.wavenumber, wave.direction[0], wave.direction[1]
    phase = k * (east * eye[0] + north * eye[1]) - wave.frequency * t + wave.phase
    a, fall = lift * wave.amplitude, lift * wave.amplitude * wave.frequency**2 / gravity
    steep = wave.amplitude * k
    for spoke in range(sums.shape[1]):
        c, s = sums[0, spoke], sums[1, spoke]
        along, across = k * (east * c + north * s), k * (north * c - east * s)
        turn = (along * gap) ** 2 + (across * beside) ** 2
        share, lit = _share(turn), _share(_LIT * turn)
        cosine, sine = near_cosine_and_sine(phase + along * r)
        lost = 0.5 * (1.0 - lit * lit)
        sums[2, spoke] += share * a * cosine
        sums[3, spoke] -= lit * steep * sine * east
        sums[4, spoke] -= lit * steep * sine * north
        sums[5, spoke] += lost * steep * steep
        sums[6, spoke] += lit * fall * cosine
        sums[7, spoke] += lost * fall * fall
