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
from vrx_mj.physics.motion import Motion, Vector, cross, dot, minus, place_of, plus, rotate, times, zero_vector
from vrx_mj.physics.tables import BOX, SPHERE, Record

_CYLINDER_SIDES = 20
"""VRX's cylinder is a regular prism of 20 sides, the first corner on +y: 1.64 % smaller than a cylinder."""

_TINY = 1.0e-6
"""Volumes [m3] and depths [m] up to this are dry, centroid coordinates [m] below it are 0.

VRX polyhedron_volume.cc. The coordinates are those in the world.
"""
_TURN = 2.0 * math.pi / _CYLINDER_SIDES


def _ring(corners: list[tuple[float, float]]) -> FloatArray:
    """Return the corners of a section, counter-clockwise about its middle, and a row with area and moment.

    Sections are symmetric, so that one second moment, that of the first coordinate, is enough.
    """
    area = moment = 0.0
    for (a, b), (c, d) in zip(corners, corners[1:] + corners[:1], strict=True):
        area += 0.5 * (a * d - b * c)
        moment += (a * d - b * c) * (a * a + a * c + c * c) / 12.0
    return np.array([*corners, (area, moment)])


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

    A corner (i, j) of the ring at the upper end is i a + j b + c.
    """

    a: Vector
    b: Vector
    c: Vector


class Moments(NamedTuple):
    """Volume [m3] and its first moments [m4] about a point of the water plane; also a face's part of them."""

    volume: float
    first: Vector


class Fan(NamedTuple):
    """Triangles that share a corner: their moments, that corner, the newest one, how many corners."""

    moments: Moments
    first: Vector
    newest: Vector
    corners: int


@kernel
def _sphere(radius: float, center: Vector, level: float) -> Submerged:
    """Return what a sphere has below the plane z = `level`: exact."""
    x, y, z = center
    h = level - (z - radius)
    if h <= 0.0:
        return Submerged(0.0, *zero_vector())
    r, top = radius, min(radius, h - radius)
    volume = math.pi * (r * r * (top + r) - (top**3 + r**3) / 3.0)
    moment = math.pi * (r * r * (top * top - r * r) / 2.0 - (top**4 - r**4) / 4.0)
    return Submerged(volume, x, y, z + moment / volume)


@kernel
def _prism(ring: FloatArray, edges: Edges, center: Vector, level: float) -> Submerged:
    """Return what a prism has below the plane z = `level`.

    `ring` (n, 2) holds the corners of its section in units of the first two vectors in `edges`, and in
    its last row, after the corners, the section's area and second moment.
    """
    depth = level - center[2]
    across, up = _reach(ring, edges), abs(edges.c[2])
    if depth <= _TINY - (across + up):
        return Submerged(0.0, *zero_vector())
    if depth >= across + up:
        return Submerged(2.0 * ring[-1, 0] * _span_volume(edges), *_snap(center))
    wet = _column(ring, edges, depth) if abs(depth) + across < up else _clip(ring, edges, depth)
    v, (x, y, z) = wet.volume, wet.first
    if v <= _TINY:
        return Submerged(0.0, *zero_vector())
    return Submerged(v, *_snap(plus(center, (x / v, y / v, z / v))))


@kernel
def _column(ring: FloatArray, e: Edges, depth: float) -> Moments:
    """Return volume and moments about the centre of a prism with one end under water and one above.

    At (i, j) of the section it is wet from the lower end, -1, up to (depth - i az - j bz) / cz. Sections have
    no first moments and equal second ones.
    """
    area, second, up = ring[-1, 0], ring[-1, 1], e.c[2]
    sign = 1.0 if up > 0.0 else -1.0
    slope_a, slope_b, middle = e.a[2] / up * sign, e.b[2] / up * sign, depth / up * sign
    k = 0.5 * (area * (middle * middle - 1.0) + (slope_a * slope_a + slope_b * slope_b) * second) * sign
    first, scale = _from_edges(e, -slope_a * second, -slope_b * second, k), _span_volume(e)
    return Moments(scale * area * (1.0 + middle), times(scale, first))


@kernel
def _from_edges(e: Edges, i: float, j: float, k: float) -> Vector:
    """Return i a + j b + k c."""
    return plus(plus(times(i, e.a), times(j, e.b)), times(k, e.c))


@kernel
def _clip(ring: FloatArray, edges: Edges, depth: float) -> Moments:
    """Return volume and moments about the centre of any prism, face by face."""
    volume, (x, y, z) = 0.0, zero_vector()
    for face in range(1 + ring.shape[0]):
        part = _face(ring, edges, face, -depth)
        volume, (x, y, z) = volume + part.volume, plus((x, y, z), part.first)
    return Moments(volume, (x, y, z + depth * volume))


@kernel
def _snap(v: Vector) -> Vector:
    """Return a vector whose small components are 0."""
    x, y, z = v
    return 0.0 if abs(x) < _TINY else x, 0.0 if abs(y) < _TINY else y, 0.0 if abs(z) < _TINY else z


@kernel
def _reach(ring: FloatArray, edges: Edges) -> float:
    """Return how far [m] a section's highest corner is above its middle; the lowest is as far below it."""
    highest = 0.0
    for i in range(ring.shape[0] - 1):
        highest = max(highest, ring[i, 0] * edges.a[2] + ring[i, 1] * edges.b[2])
    return highest


@kernel
def _span_volume(e: Edges) -> float:
    """Return the volume [m3] that the three vectors span."""
    return abs(dot(e.c, cross(e.a, e.b)))


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
    x, y, up = _from_edges(e, ring[i, 0], ring[i, 1], end)
    return x, y, up + z


@kernel
def _face(ring: FloatArray, edges: Edges, face: int, z: float) -> Moments:
    """Return a face's part: its wet outline, cut into triangles that share the outline's first corner."""
    corners = ring.shape[0] - 1 if face < 2 else 4
    none = zero_vector()
    fan = Fan(Moments(0.0, none), none, none, 0)
    start = _corner(ring, edges, face, 0, z)
    for k in range(1, corners + 1):
        stop = _corner(ring, edges, face, k if k < corners else 0, z)
        if start[2] < 0.0:
            fan = _extend(fan, start)
        if (start[2] < 0.0) != (stop[2] < 0.0):
            fan = _extend(fan, _surface_point(start, stop))
        start = stop
    return fan.moments


@kernel
def _extend(fan: Fan, corner: Vector) -> Fan:
    """Return the fan with one more corner."""
    if fan.corners == 0:
        return Fan(fan.moments, corner, corner, 1)
    if fan.corners == 1:
        return Fan(fan.moments, fan.first, corner, 2)
    m, part = fan.moments, _triangle(fan.first, fan.newest, corner)
    moments = Moments(m.volume + part.volume, plus(m.first, part.first))
    return Fan(moments, fan.first, corner, fan.corners + 1)


@kernel
def _surface_point(a: Vector, b: Vector) -> Vector:
    """Return the point at z = 0 on the line through `a` and `b`."""
    share = a[2] / (a[2] - b[2])
    x, y, _ = plus(a, times(share, minus(b, a)))
    return x, y, 0.0


@kernel
def _triangle(a: Vector, b: Vector, c: Vector) -> Moments:
    """Return a triangle's part of volume and moments; from outside it goes round counter-clockwise."""
    area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))
    x, y, z = plus(plus(a, b), c)
    xz = x * z + a[0] * a[2] + b[0] * b[2] + c[0] * c[2]
    yz = y * z + a[1] * a[2] + b[1] * b[2] + c[1] * c[2]
    zz = z * z + a[2] * a[2] + b[2] * b[2] + c[2] * c[2]
    return Moments(area * z / 3.0, (area * xz / 12.0, area * yz / 12.0, area * zz / 24.0))


@kernel
def _edges(element: Record, motion: Motion, a: float, b: float, c: float) -> Edges:
    """Return the vectors of lengths `a`, `b` and `c` along the element's axes, world axes."""
    t = element.rotation
    return Edges(
        rotate(motion, times(a, t[:, 0])), rotate(motion, times(b, t[:, 1])), rotate(motion, times(c, t[:, 2]))
    )


@kernel
def submerged_part(element: Record, motion: Motion, level: float) -> Submerged:
    """Return what an element of the link has below the plane z = `level` [m]."""
    center, size = place_of(motion, element.position), element.size
    if element.shape == SPHERE:
        return _sphere(size[0], center, level)
    if element.shape == BOX:
        ring, across, half_length = _BOX_RING, size[1], 0.5 * size[2]
    else:
        ring, across, half_length = _CYLINDER_RING, size[0], 0.5 * size[1]
    return _prism(ring, _edges(element, motion, size[0], across, half_length), center, level)
