"""How much of a box, a cylinder or a sphere is below a horizontal water plane, and where.

VRX clips polyhedra of triangles by the plane (Catto, Game Programming Gems 6); the same solids are
clipped here face by face, after Gauss: with z measured from the plane, the integrals of z n_z, x z n_z,
y z n_z and z^2/2 n_z over the wet faces are the volume and its moments, and the plane itself adds nothing.
"""

import math
from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Vector, rotate
from vrx_mj.physics.tables import BOX, SPHERE, Record

_CYLINDER_SIDES = 20
"""VRX's cylinder is a regular prism of 20 sides, the first corner on +y: 1.64 % smaller than a cylinder."""

_TINY = 1.0e-6
"""Volumes [m3] and depths [m] up to this are dry, centroid coordinates [m] below it are 0.

VRX polyhedron_volume.cc. The coordinates are those in the world.
"""


def _ring(corners: list[tuple[float, float]]) -> FloatArray:
    """Return the corners of a section, counter-clockwise about its middle, and a row with area and moment.

    Sections are symmetric, so that one second moment, that of the first coordinate, is enough.
    """
    area = moment = 0.0
    for (a, b), (c, d) in zip(corners, corners[1:] + corners[:1], strict=True):
        area += 0.5 * (a * d - b * c)
        moment += (a * d - b * c) * (a * a + a * c + c * c) / 12.0
    return np.array([*corners, (area, moment)])


_TURN = 2.0 * math.pi / _CYLINDER_SIDES
_BOX_RING = _ring([(0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)])
_CYLINDER_RING = _ring([(-math.sin(i * _TURN), math.cos(i * _TURN)) for i in range(_CYLINDER_SIDES)])


class Submerged(NamedTuple):
    """A volume [m3] under water and its centroid [m] in the world; all zero when dry."""

    volume: float
    x: float
    y: float
    z: float


class Edges(NamedTuple):
    """The vectors [m] of a prism's two axes across and of its half axis along it, world axes.

    A corner (i, j) of the ring at the upper end is i (ax, ay, az) + j (bx, by, bz) + (cx, cy, cz).
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


class Fan(NamedTuple):
    """Triangles that share a corner: their moments, that corner, the newest one, how many corners."""

    moments: Moments
    first: Vector
    newest: Vector
    corners: int


@kernel
def _sphere(radius: float, x: float, y: float, z: float, level: float) -> Submerged:
    """Return what a sphere with centre (x, y, z) has below the plane z = `level`: exact."""
    h = level - (z - radius)
    if h <= 0.0:
        return Submerged(0.0, 0.0, 0.0, 0.0)
    r, top = radius, min(radius, h - radius)
    volume = math.pi * (r * r * (top + r) - (top**3 + r**3) / 3.0)
    moment = math.pi * (r * r * (top * top - r * r) / 2.0 - (top**4 - r**4) / 4.0)
    return Submerged(volume, x, y, z + moment / volume)


@kernel
def _prism(ring: FloatArray, edges: Edges, x: float, y: float, z: float, level: float) -> Submerged:
    """Return what a prism with centre (x, y, z) has below the plane z = `level`.

    `ring` (n, 2) holds the corners of its section in units of the first two vectors in `edges`, and in
    its last row, after the corners, the section's area and second moment.
    """
    depth = level - z
    across = _reach(ring, edges)
    reach = across + abs(edges.cz)
    if depth <= _TINY - reach:
        return Submerged(0.0, 0.0, 0.0, 0.0)
    if depth >= reach:
        whole = 2.0 * ring[-1, 0] * _triple(edges)
        return Submerged(whole, _snapped(x), _snapped(y), _snapped(z))
    through_sides = abs(depth) + across < abs(edges.cz)
    wet = _column(ring, edges, depth) if through_sides else _clipped(ring, edges, depth)
    v = wet.volume
    if v <= _TINY:
        return Submerged(0.0, 0.0, 0.0, 0.0)
    return Submerged(v, _snapped(x + wet.x / v), _snapped(y + wet.y / v), _snapped(z + wet.z / v))


@kernel
def _column(ring: FloatArray, e: Edges, depth: float) -> Moments:
    """Return volume and moments about the centre of a prism with one end under water and one above.

    At (i, j) of the section it is wet from the lower end, -1, up to (depth - i az - j bz) / cz. Sections have
    no first moments and equal second ones.
    """
    area, second = ring[-1, 0], ring[-1, 1]
    sign = 1.0 if e.cz > 0.0 else -1.0
    slope_a, slope_b, middle = e.az / e.cz * sign, e.bz / e.cz * sign, depth / e.cz * sign
    i, j = -slope_a * second, -slope_b * second
    k = 0.5 * (area * (middle * middle - 1.0) + (slope_a * slope_a + slope_b * slope_b) * second) * sign
    scale = _triple(e)
    return Moments(
        scale * area * (1.0 + middle),
        scale * (i * e.ax + j * e.bx + k * e.cx),
        scale * (i * e.ay + j * e.by + k * e.cy),
        scale * (i * e.az + j * e.bz + k * e.cz),
    )


@kernel
def _clipped(ring: FloatArray, edges: Edges, depth: float) -> Moments:
    """Return volume and moments about the centre of any prism, face by face."""
    volume = x = y = z = 0.0
    for face in range(1 + ring.shape[0]):
        part = _face(ring, edges, face, -depth)
        volume, x, y, z = volume + part.volume, x + part.x, y + part.y, z + part.z
    return Moments(volume, x, y, z + depth * volume)


@kernel
def _snapped(coordinate: float) -> float:
    return 0.0 if abs(coordinate) < _TINY else coordinate


@kernel
def _reach(ring: FloatArray, edges: Edges) -> float:
    """Return how far [m] a section's highest corner is above its middle; the lowest is as far below it."""
    highest = 0.0
    for i in range(ring.shape[0] - 1):
        highest = max(highest, ring[i, 0] * edges.az + ring[i, 1] * edges.bz)
    return highest


@kernel
def _triple(e: Edges) -> float:
    """Return the volume [m3] that the three vectors span."""
    return abs(
        e.cx * (e.ay * e.bz - e.az * e.by) + e.cy * (e.az * e.bx - e.ax * e.bz) + e.cz * (e.ax * e.by - e.ay * e.bx)
    )


@kernel
def _corner(ring: FloatArray, e: Edges, face: int, k: int, z: float) -> Vector:
    """Return corner `k` of a face, from the centre, with `z` added to its height.

    Faces: lower end (0), upper end (1), sides (2 and up). Seen from outside corners go round
    counter-clockwise.
    """
    if face < 2:
        i, end = (k, 1.0) if face == 1 else (ring.shape[0] - 2 - k, -1.0)
    else:
        i, end = face - 2 if 0 < k < 3 else face - 3, 1.0 if k > 1 else -1.0
        i = ring.shape[0] - 2 if i < 0 else i
    a, b = ring[i, 0], ring[i, 1]
    return (
        a * e.ax + b * e.bx + end * e.cx,
        a * e.ay + b * e.by + end * e.cy,
        a * e.az + b * e.bz + end * e.cz + z,
    )


@kernel
def _face(ring: FloatArray, edges: Edges, face: int, z: float) -> Moments:
    """Return a face's part: its wet outline, cut into triangles that share the outline's first corner."""
    corners = ring.shape[0] - 1 if face < 2 else 4
    none = (0.0, 0.0, 0.0)
    fan = Fan(Moments(0.0, 0.0, 0.0, 0.0), none, none, 0)
    start = _corner(ring, edges, face, 0, z)
    for k in range(1, corners + 1):
        stop = _corner(ring, edges, face, k if k < corners else 0, z)
        if start[2] < 0.0:
            fan = _extended(fan, start)
        if (start[2] < 0.0) != (stop[2] < 0.0):
            fan = _extended(fan, _surface_point(start, stop))
        start = stop
    return fan.moments


@kernel
def _extended(fan: Fan, corner: Vector) -> Fan:
    """Return the fan with one more corner."""
    if fan.corners == 0:
        return Fan(fan.moments, corner, corner, 1)
    if fan.corners == 1:
        return Fan(fan.moments, fan.first, corner, 2)
    m, part = fan.moments, _triangle(fan.first, fan.newest, corner)
    moments = Moments(m.volume + part.volume, m.x + part.x, m.y + part.y, m.z + part.z)
    return Fan(moments, fan.first, corner, fan.corners + 1)


@kernel
def _surface_point(a: Vector, b: Vector) -> Vector:
    """Return the point at z = 0 on the line through `a` and `b`."""
    share = a[2] / (a[2] - b[2])
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), 0.0


@kernel
def _triangle(a: Vector, b: Vector, c: Vector) -> Moments:
    """Return a triangle's part of volume and moments; from outside it goes round counter-clockwise."""
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
        return _sphere(size[0], x, y, z, level)
    if element.shape == BOX:
        ring, across, half_length = _BOX_RING, size[1], 0.5 * size[2]
    else:
        ring, across, half_length = _CYLINDER_RING, size[0], 0.5 * size[1]
    return _prism(ring, _edges(element, motion, size[0], across, half_length), x, y, z, level)
