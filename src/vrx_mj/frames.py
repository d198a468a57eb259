"""Rotations, poses and places on Earth, for every layer; kernels have their own rotations in `physics.motion`.

The world's x, y and z are east, north and up, unless its georeference has a `heading`: then x is that far from east.
A body is forward-left-up; quaternions are (w, x, y, z); a pose in a file is [x, y, z, roll, pitch, yaw] in m and rad.
The Earth is WGS84 (NIMA TR8350.2).
"""

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray

SEMI_MAJOR, FLATTENING = 6378137.0, 1.0 / 298.257223563
"""Semi-major axis [m] and flattening of the Earth's ellipsoid."""
_SEMI_MINOR = 6356752.31424518
"""Semi-minor axis [m], as published."""
_MINOR = SEMI_MAJOR * (1.0 - FLATTENING)
"""Semi-minor axis [m] by the flattening: differs from the published one in the last digit."""
_SQUARE = FLATTENING * (2.0 - FLATTENING)
"""The first eccentricity squared."""

Vector = tuple[float, float, float]
"""x, y, z."""
Pose = tuple[float, float, float, float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]
ZERO: Vector = (0.0, 0.0, 0.0)
IDENTITY: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The pose of a frame in itself."""
_Angle = TypeVar("_Angle", float, FloatArray)


def compass(angle: _Angle) -> _Angle:
    """Compass degrees, clockwise from true north and from 0 to 360, of angles [rad] counter-clockwise from east."""
    return (90.0 - angle * (180.0 / math.pi)) % 360.0


def rotation(roll: float, pitch: float, yaw: float) -> Matrix:
    """Rotation matrix, body to world: R = Rz(yaw) Ry(pitch) Rx(roll), angles in rad."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Unit quaternion (w, x, y, z) of `rotation`; w is not negative."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    w = cr * cp * cy + sr * sp * sy
    sign = -1.0 if w < 0.0 else 1.0
    return (
        sign * w,
        sign * (sr * cp * cy - cr * sp * sy),
        sign * (cr * sp * cy + sr * cp * sy),
        sign * (cr * cp * sy - sr * sp * cy),
    )


def angles(matrix: Matrix) -> Vector:
    """Roll, pitch and yaw [rad] of a rotation matrix; roll is 0 where pitch is +-90 degrees."""
    (r00, r01, _), (r10, r11, _), (r20, r21, r22) = matrix
    pitch = math.atan2(-r20, math.hypot(r00, r10))
    if math.hypot(r00, r10) < 1e-9:
        return 0.0, pitch, math.atan2(-r01, r11)
    return math.atan2(r21, r22), pitch, math.atan2(r10, r00)


def transposed_matrix(matrix: Matrix) -> Matrix:
    """The transpose: the inverse of a rotation."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return (a, d, g), (b, e, h), (c, f, i)


def apply(matrix: Matrix, vector: Sequence[float]) -> Vector:
    """The matrix times a 3-vector."""
    x, y, z = (sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix)
    return x, y, z


def compose(outer: Pose, inner: Pose) -> Pose:
    """Pose in the world of something at `inner` in a frame that is at `outer`."""
    turn = rotation(*outer[3:])
    x, y, z = (a + b for a, b in zip(outer[:3], apply(turn, inner[:3]), strict=True))
    a, b, c = (apply(turn, column) for column in transposed_matrix(rotation(*inner[3:])))
    return x, y, z, *angles(transposed_matrix((a, b, c)))


def inverse(pose: Pose) -> Pose:
    """Pose of the outer frame in the frame that is at `pose` in it."""
    back = transposed_matrix(rotation(*pose[3:]))
    x, y, z = apply(back, pose[:3])
    return -x, -y, -z, *angles(back)


def facing(axis: Sequence[float]) -> Pose:
    """A frame at the origin whose z axis points along `axis`, turned the shortest way: the identity for z itself."""
    length = math.hypot(*axis)
    x, y, z = (value / length for value in axis)
    if z > 1.0 - 1e-12:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if z < 1e-12 - 1.0:
        return 0.0, 0.0, 0.0, math.pi, 0.0, 0.0
    k = 1.0 / (1.0 + z)
    turn = ((1.0 - k * x * x, -k * x * y, x), (-k * x * y, 1.0 - k * y * y, y), (-x, -y, z))
    return 0.0, 0.0, 0.0, *angles(turn)


def _rows(w: _Angle, x: _Angle, y: _Angle, z: _Angle) -> tuple[tuple[_Angle, _Angle, _Angle], ...]:
    """Rows of the rotation matrix, body to world, of one or several unit quaternions."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def heading(w: float, x: float, y: float, z: float) -> float:
    """Heading [rad] of a unit quaternion, body to world, counter-clockwise from x, in [-pi, pi]."""
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def rotation_matrix(quaternion: npt.ArrayLike) -> FloatArray:
    """Return the (3, 3) rotation matrix, body to world, of a unit quaternion (w, x, y, z)."""
    w, x, y, z = np.asarray(quaternion, np.float64).tolist()
    return np.array(_rows(w, x, y, z))


def in_world_axes(quaternions: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors (..., 3) of body axes in world axes, by unit quaternions (..., 4), (w, x, y, z)."""
    rows, (u, v, up) = _rows(*np.moveaxis(quaternions, -1, 0)), np.moveaxis(vectors, -1, 0)
    return np.stack([a * u + b * v + c * up for a, b, c in rows], axis=-1)


def quaternion_product(one: FloatArray, other: FloatArray) -> FloatArray:
    """Products (..., 4) of quaternions (w, x, y, z): the rotation `other`, then `one`."""
    (a, b, c, d), (w, x, y, z) = (
        each.tolist() if each.ndim == 1 else np.moveaxis(each, -1, 0) for each in (one, other)
    )
    parts = (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
    return np.array(parts) if one.ndim == other.ndim == 1 else np.stack(parts, axis=-1)


def conjugate(quaternion: FloatArray) -> FloatArray:
    """Inverse of a unit quaternion, (4,)."""
    return quaternion * (1.0, -1.0, -1.0, -1.0)


def rotation_vector(quaternion: FloatArray) -> FloatArray:
    """Axis times angle [rad], (3,), of a unit quaternion (w, x, y, z), the short way round."""
    w, axis = (-quaternion[0], -quaternion[1:]) if quaternion[0] < 0.0 else (quaternion[0], quaternion[1:])
    sine = float(np.linalg.norm(axis))
    scale = 2.0 if sine < 1e-12 else 2.0 * np.arctan2(sine, w) / sine
    vector: FloatArray = scale * axis
    return vector


def matrix_quaternion(rotation: FloatArray) -> FloatArray:
    """Unit quaternion (w, x, y, z), (4,), of a rotation matrix; w is not negative.

    The four squares follow from the diagonal; the largest gives the others without cancellation (Shepperd 1978).
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    products = np.array(
        [
            [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
            [zy - yz, 1 + xx - yy - zz, yx + xy, zx + xz],
            [xz - zx, yx + xy, 1 + yy - xx - zz, zy + yz],
            [yx - xy, zx + xz, zy + yz, 1 + zz - xx - yy],
        ]
    )
    row = products[np.argmax(np.diag(products))]
    unit: FloatArray = row / np.linalg.norm(row)
    return -unit if unit[0] < 0.0 else unit


def geodetic_to_enu(latitude: float, longitude: float, altitude: float, origin: Vector) -> Vector:
    """East, north and up [m] of a place in the plane tangent at an origin, both as degrees, degrees and m."""
    x, y, z = (
        a - b for a, b in zip(_earth_centred(latitude, longitude, altitude), _earth_centred(*origin), strict=True)
    )
    phi, lam = np.radians(origin[0]), np.radians(origin[1])
    outward = np.cos(lam) * x + np.sin(lam) * y
    east = -np.sin(lam) * x + np.cos(lam) * y
    return float(east), float(-np.sin(phi) * outward + np.cos(phi) * z), float(np.cos(phi) * outward + np.sin(phi) * z)


def _earth_centred(latitude: float, longitude: float, altitude: float) -> Vector:
    """x, y, z [m] of a place; x points to where equator and prime meridian meet, z to the north pole."""
    phi, lam = np.radians(latitude), np.radians(longitude)
    radius = SEMI_MAJOR**2 / np.hypot(SEMI_MAJOR * np.cos(phi), _SEMI_MINOR * np.sin(phi))
    x, y = (radius + altitude) * np.cos(phi) * np.cos(lam), (radius + altitude) * np.cos(phi) * np.sin(lam)
    return x, y, (radius * (_SEMI_MINOR / SEMI_MAJOR) ** 2 + altitude) * np.sin(phi)


def enu_to_geodetic(east: float, north: float, up: float, latitude: float, longitude: float, altitude: float) -> Vector:
    """Latitude, longitude [degrees] and altitude [m] of a point by a tangent plane [m] at a geodetic place."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    sin, cos = math.sin(phi), math.cos(phi)
    radius = SEMI_MAJOR / math.sqrt(1.0 - _SQUARE * sin * sin)
    outward = cos * up - sin * north
    p = (radius + altitude) * cos + outward  # in the meridian plane of the origin, from the axis
    x, y = math.cos(lam) * p - math.sin(lam) * east, math.sin(lam) * p + math.cos(lam) * east
    z = (radius * (1.0 - _SQUARE) + altitude) * sin + cos * north + sin * up
    return _to_geodetic(x, y, z)


def _to_geodetic(x: float, y: float, z: float) -> Vector:
    """Latitude, longitude [degrees] and altitude [m] of earth-centred x, y, z [m].

    By Bowring's formula (Survey Review 23, 1976), iterated to the last digits.
    """
    p = math.hypot(x, y)
    reduced = math.atan2(z * SEMI_MAJOR, p * _MINOR)
    for _ in range(3):
        s, c = math.sin(reduced), math.cos(reduced)
        phi = math.atan2(z + _SQUARE / (1.0 - _SQUARE) * _MINOR * s**3, p - _SQUARE * SEMI_MAJOR * c**3)
        reduced = math.atan2(_MINOR * math.sin(phi), SEMI_MAJOR * math.cos(phi))
    sin, cos = math.sin(phi), math.cos(phi)
    altitude = p * cos + z * sin - SEMI_MAJOR * math.sqrt(1.0 - _SQUARE * sin * sin)
    return math.degrees(phi), math.degrees(math.atan2(y, x)), float(altitude)


class Geodetic:
    """A world frame whose origin has a place on Earth (WGS84)."""

    latitude: float
    longitude: float
    elevation: float
    heading: float

    def to_enu(self, latitude: float, longitude: float, altitude: float | None = None) -> Vector:
        """World x, y, z [m] of a geodetic position [degrees, degrees, m]; no altitude: that of the origin."""
        height = self.elevation if altitude is None else altitude
        origin = self.latitude, self.longitude, self.elevation
        return self.from_east_north_up(*geodetic_to_enu(latitude, longitude, height, origin))

    def to_geodetic(self, x: float, y: float, z: float) -> Vector:
        """Latitude, longitude [degrees] and altitude [m] of a point of the world [m]."""
        return self.geodetic(*self.to_east_north_up(x, y, z))

    def geodetic(self, east: float, north: float, up: float) -> Vector:
        """Latitude, longitude [degrees] and altitude [m] of a point east, north and up [m] of the origin."""
        return enu_to_geodetic(east, north, up, self.latitude, self.longitude, self.elevation)

    def to_east_north_up(self, x: float, y: float, z: float) -> Vector:
        """East, north and up of a vector of the world; they are not x, y and z where `heading` is not 0."""
        cos, sin = math.cos(self.x_from_east), math.sin(self.x_from_east)
        return cos * x - sin * y, sin * x + cos * y, z

    def from_east_north_up(self, east: float, north: float, up: float) -> Vector:
        """x, y and z of a vector in the world."""
        cos, sin = math.cos(self.x_from_east), math.sin(self.x_from_east)
        return cos * east + sin * north, cos * north - sin * east, up

    @property
    def x_from_east(self) -> float:
        """Direction of the world's x axis [rad], counter-clockwise from east: the `heading`."""
        return math.radians(self.heading)
