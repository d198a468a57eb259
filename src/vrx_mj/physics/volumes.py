"""How much of a box, a cylinder or a sphere is below a horizontal water plane, and where.

VRX clips polyhedra of triangles by the plane (Catto, Game Programming Gems 6); the same solids are
clipped here face by face, after Gauss: with z measured from the plane, the integrals of z n_z, x z n_z,
y z n_z and z^2/2 n_z over the wet faces are the volume and its moments, and the water plane itself adds nothing.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Vector, rotate
from vrx_mj.physics.tables import BOX, SPHERE, Record

__all__ = ["CYLINDER_SIDES", "Submerged", "prism", "sphere", "submerged"]

CYLINDER_SIDES = 20
"""VRX's cylinder is a regular prism of 20 sides, the first corner on +y: 1.64 % smaller than a cylinder."""

_TINY = 1.0e-6
"""Volumes [m3] and depths [m] up to this count as dry, centroid coordinates [m] below it as 0: VRX polyhedron_volume.cc."""

_STEP = 2.0 * math.pi / CYLINDER_SIDES
_BOX_RING = np.array([(0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)])
_CYLINDER_RING = np.array([(-math.sin(i * _STEP), math.cos(i * _STEP)) for i in range(CYLINDER_SIDES)])
"""Corners of the cross section, counter-clockwise, to be multiplied by its two sizes."""


class Submerged(NamedTuple):
    """A volume [m3] under water and its centroid [m] in the world; all zero when dry."""

    volume: float
    x: float
    y: float
    z: float


class Edges(NamedTuple):
    """The vectors [m] of a prism's two half axes across and of its half axis, world axes, from its centre.

    A corner (i, j) of the ring at the upper end is centre + i (ax, ay, az) + j (bx, by, bz) + (cx, cy, cz).
    """

    ax: float
    ay: float
    az: float
    bx: float
    by: float
    bz: float
    cx: float
    cy: float
    cz: float


class Moments(NamedTuple):
    """Volume [m3] and its first moments [m4] about a point of the water plane; also a face's part of them."""

    volume: float
    x: float
    y: float
    z: float


@kernel
def sphere(radius: float, x: float, y: float, z: float, level: float) -> Submerged:
    """Return what a sphere with centre (x, y, z) has below the plane z = `level`: exact."""
    h = level - (z - radius)
    if h <= 0.0:
        return Submerged(0.0, 0.0, 0.0, 0.0)
    r, top = radius, min(radius, h - radius)
    volume = math.pi * (r * r * (top + r) - (top**3 + r**3) / 3.0)
    moment = math.pi * (r * r * (top * top - r * r) / 2.0 - (top**4 - r**4) / 4.0)
    return Submerged(volume, x, y, z + moment / volume)


@kernel
def prism(
    ring: npt.NDArray[np.float64], edges: Edges, x: float, y: float, z: float, level: float
) -> Submerged:
    """Return what a prism with centre (x, y, z) has below the plane z = `level`.

    `ring` (n, 2) holds the corners of its section in units of the first two half axes in `edges`.
    """
    depth = level - z
    reach = _reach(ring, edges)
    if depth <= _TINY - reach:
        return Submerged(0.0, 0.0, 0.0, 0.0)
    if depth >= reach:
        return Submerged(_prism_volume(ring, edges), _snapped(x), _snapped(y), _snapped(z))
    total = Moments(0.0, 0.0, 0.0, 0.0)
    total = _sum(total, _cap(ring, edges, -1.0, -depth))
    total = _sum(total, _cap(ring, edges, 1.0, -depth))
    for i in range(ring.shape[0]):
        total = _sum(total, _side(ring, edges, i, -depth))
    v = total.volume
    if v <= _TINY:
        return Submerged(0.0, 0.0, 0.0, 0.0)
    return Submerged(v, _snapped(x + total.x / v), _snapped(y + total.y / v), _snapped(level + total.z / v))


@kernel
def _snapped(coordinate: float) -> float:
    return 0.0 if abs(coordinate) < _TINY else coordinate


@kernel
def _sum(a: Moments, b: Moments) -> Moments:
    return Moments(a.volume + b.volume, a.x + b.x, a.y + b.y, a.z + b.z)


@kernel
def _reach(ring: npt.NDArray[np.float64], edges: Edges) -> float:
    """Return how far [m] the highest corner is above the centre; the lowest is as far below it."""
    highest = 0.0
    for i in range(ring.shape[0]):
        highest = max(highest, ring[i, 0] * edges.az + ring[i, 1] * edges.bz)
    return highest + abs(edges.cz)


@kernel
def _prism_volume(ring: npt.NDArray[np.float64], edges: Edges) -> float:
    """Return the whole volume: twice the half axes' triple product times the ring's area."""
    area = 0.0
    for i in range(ring.shape[0]):
        area += 0.5 * (ring[i - 1, 0] * ring[i, 1] - ring[i, 0] * ring[i - 1, 1])
    e = edges
    triple = (
        e.cx * (e.ay * e.bz - e.az * e.by)
        + e.cy * (e.az * e.bx - e.ax * e.bz)
        + e.cz * (e.ax * e.by - e.ay * e.bx)
    )
    return abs(2.0 * area * triple)


@kernel
def _corner(ring: npt.NDArray[np.float64], e: Edges, i: int, end: float, z: float) -> Vector:
    """Return corner `i` of the ring at an `end` (-1 lower, 1 upper), from the centre, `z` added to its height."""
    a, b = ring[i, 0], ring[i, 1]
    return (
        a * e.ax + b * e.bx + end * e.cx,
        a * e.ay + b * e.by + end * e.cy,
        a * e.az + b * e.bz + end * e.cz + z,
    )


@kernel
def _cap(ring: npt.NDArray[np.float64], edges: Edges, end: float, z: float) -> Moments:
    """Return the part of the face at an `end`; seen from outside its corners go round counter-clockwise."""
    n = ring.shape[0]
    apex = _corner(ring, edges, 0, end, z)
    total, leave, enter = Moments(0.0, 0.0, 0.0, 0.0), apex, apex
    start = apex
    for i in range(1, n + 1):
        stop = _corner(ring, edges, i % n if end > 0.0 else (n - i) % n, end, z)
        total, leave, enter = _edge(total, leave, enter, apex, start, stop)
        start = stop
    return _sum(total, _triangle(apex, leave, enter))


@kernel
def _side(ring: npt.NDArray[np.float64], edges: Edges, i: int, z: float) -> Moments:
    """Return the part of the rectangle between corners `i` - 1 and `i`."""
    a, b = _corner(ring, edges, i - 1, -1.0, z), _corner(ring, edges, i, -1.0, z)
    c, d = _corner(ring, edges, i, 1.0, z), _corner(ring, edges, i - 1, 1.0, z)
    total, leave, enter = Moments(0.0, 0.0, 0.0, 0.0), a, a
    total, leave, enter = _edge(total, leave, enter, a, a, b)
    total, leave, enter = _edge(total, leave, enter, a, b, c)
    total, leave, enter = _edge(total, leave, enter, a, c, d)
    total, leave, enter = _edge(total, leave, enter, a, d, a)
    return _sum(total, _triangle(a, leave, enter))


@kernel
def _edge(
    total: Moments, leave: Vector, enter: Vector, apex: Vector, start: Vector, stop: Vector
) -> tuple[Moments, Vector, Vector]:
    """Add the wet part of a face's edge, and note where the outline leaves the water and enters it.

    An edge adds the triangle between it and `apex`, any point in the face's plane; triangles
    outside of the face cancel.
    """
    if start[2] >= 0.0 and stop[2] >= 0.0:
        return total, leave, enter
    if start[2] < 0.0 and stop[2] < 0.0:
        return _sum(total, _triangle(apex, start, stop)), leave, enter
    cut = _surface_point(start, stop)
    if start[2] < 0.0:
        return _sum(total, _triangle(apex, start, cut)), cut, enter
    return _sum(total, _triangle(apex, cut, stop)), leave, cut


@kernel
def _surface_point(a: Vector, b: Vector) -> Vector:
    """Return the point at z = 0 on the line through `a` and `b`."""
    share = a[2] / (a[2] - b[2])
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), 0.0


@kernel
def _triangle(a: Vector, b: Vector, c: Vector) -> Moments:
    """Return the integrals of z n_z, x z n_z, y z n_z and z^2 / 2 n_z over a triangle, counter-clockwise from outside."""
    area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))
    x, y, z = a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]
    xz = x * z + a[0] * a[2] + b[0] * b[2] + c[0] * c[2]
    yz = y * z + a[1] * a[2] + b[1] * b[2] + c[1] * c[2]
    zz = z * z + a[2] * a[2] + b[2] * b[2] + c[2] * c[2]
    return Moments(area * z / 3.0, area * xz / 12.0, area * yz / 12.0, area * zz / 24.0)


@kernel
def _edges(element: Record, motion: Motion, a: float, b: float, c: float) -> Edges:
    """Return the vectors of lengths `a`, `b` and `c` along the element's axes, world axes."""
    t = element.rotation
    ax, ay, az = rotate(motion, a * t[0, 0], a * t[1, 0], a * t[2, 0])
    bx, by, bz = rotate(motion, b * t[0, 1], b * t[1, 1], b * t[2, 1])
    cx, cy, cz = rotate(motion, c * t[0, 2], c * t[1, 2], c * t[2, 2])
    return Edges(ax, ay, az, bx, by, bz, cx, cy, cz)


@kernel
def submerged(element: Record, motion: Motion, level: float) -> Submerged:
    """Return what an element of the link has below the plane z = `level` [m]."""
    x, y, z = rotate(motion, element.position[0], element.position[1], element.position[2])
    x, y, z = x + motion.x, y + motion.y, z + motion.z
    size = element.size
    if element.shape == SPHERE:
        return sphere(size[0], x, y, z, level)
    if element.shape == BOX:
        return prism(_BOX_RING, _edges(element, motion, size[0], size[1], 0.5 * size[2]), x, y, z, level)
    return prism(_CYLINDER_RING, _edges(element, motion, size[0], size[0], 0.5 * size[1]), x, y, z, level)
