"""Where a link is, how it moves, and the wrenches on it."""

import math
from typing import NamedTuple

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel

Level = tuple[float, float]
"""A vector along x and y: level, or the cosine and sine of a direction."""
Vector = tuple[float, float, float]
Arrow = Vector | FloatArray
"""A vector, or the first three numbers of an array."""


Rows = tuple[float, float, float, float, float, float, float, float, float]
"""A rotation matrix, row by row."""


class Motion(NamedTuple):
    """Pose and velocity of a link.

    Position of the link's origin [m], world axes; rotation matrix, body to world, row by row;
    velocity of the link's origin [m/s] and angular velocity [rad/s], both in body axes.
    """

    x: float
    y: float
    z: float
    r00: float
    r01: float
    r02: float
    r10: float
    r11: float
    r12: float
    r20: float
    r21: float
    r22: float
    u: float
    v: float
    w: float
    p: float
    q: float
    r: float


class Wrench(NamedTuple):
    """A force [N] and a torque [N m] about a point that goes with it. World axes by default."""

    fx: float
    fy: float
    fz: float
    tx: float
    ty: float
    tz: float


@kernel
def motion(qpos: FloatArray, qvel: FloatArray, qpos_adr: int, dof_adr: int) -> Motion:
    """Return the motion of the link on the free joint at `qpos_adr` and `dof_adr`.

    MuJoCo's free joint has the origin's position and a quaternion (w, x, y, z) in `qpos`, and in
    `qvel` the origin's velocity in world axes and the angular velocity in body axes. The
    quaternion need not have unit length.
    """
    qw, qx, qy, qz = qpos[qpos_adr + 3], qpos[qpos_adr + 4], qpos[qpos_adr + 5], qpos[qpos_adr + 6]
    s = 2.0 / (qw * qw + qx * qx + qy * qy + qz * qz)
    rows = (
        1.0 - s * (qy * qy + qz * qz), s * (qx * qy - qw * qz), s * (qx * qz + qw * qy),
        s * (qx * qy + qw * qz), 1.0 - s * (qx * qx + qz * qz), s * (qy * qz - qw * qx),
        s * (qx * qz - qw * qy), s * (qy * qz + qw * qx), 1.0 - s * (qx * qx + qy * qy),
    )  # fmt: skip
    at_rest = motion_at_rest((qpos[qpos_adr], qpos[qpos_adr + 1], qpos[qpos_adr + 2]), rows)
    return with_velocity(at_rest, unrotate(at_rest, qvel[dof_adr : dof_adr + 3]), qvel[dof_adr + 3 : dof_adr + 6])


@kernel
def rotate(motion: Motion, v: Arrow) -> Vector:
    """Return a vector of body axes in world axes."""
    return (
        motion.r00 * v[0] + motion.r01 * v[1] + motion.r02 * v[2],
        motion.r10 * v[0] + motion.r11 * v[1] + motion.r12 * v[2],
        motion.r20 * v[0] + motion.r21 * v[1] + motion.r22 * v[2],
    )


@kernel
def unrotate(motion: Motion, v: Arrow) -> Vector:
    """Return a vector of world axes in body axes."""
    return (
        motion.r00 * v[0] + motion.r10 * v[1] + motion.r20 * v[2],
        motion.r01 * v[0] + motion.r11 * v[1] + motion.r21 * v[2],
        motion.r02 * v[0] + motion.r12 * v[1] + motion.r22 * v[2],
    )


@kernel
def unrotate_level(motion: Motion, x: float, y: float) -> Vector:
    """Return the horizontal vector (x, y) of world axes in body axes."""
    m = motion
    return m.r00 * x + m.r10 * y, m.r01 * x + m.r11 * y, m.r02 * x + m.r12 * y


@kernel
def relative_motion(motion: Motion, water: Vector) -> Motion:
    """Return a motion through water that moves with a velocity [m/s, world axes] and does not turn."""
    return with_velocity(motion, minus(velocity_of(motion), unrotate(motion, water)), spin_of(motion))


@kernel
def cross(a: Arrow, b: Arrow) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def dot(a: Arrow, b: Arrow) -> float:
    """Return the scalar product."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@kernel
def plus(a: Arrow, b: Arrow) -> Vector:
    """Return the sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def minus(a: Arrow, b: Arrow) -> Vector:
    """Return the difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def times(factor: float, v: Arrow) -> Vector:
    """Return a multiple of a vector."""
    return factor * v[0], factor * v[1], factor * v[2]


@kernel
def each_times(a: Arrow, b: Arrow) -> Vector:
    """Return the products of the components of two vectors."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@kernel
def position_of(motion: Motion) -> Vector:
    """Return the position of the link's origin [m], world axes."""
    return motion[:3]


@kernel
def velocity_of(motion: Motion) -> Vector:
    """Return the velocity of the link's origin [m/s], body axes."""
    return motion[12:15]


@kernel
def spin_of(motion: Motion) -> Vector:
    """Return the angular velocity of the link [rad/s], body axes."""
    return motion[15:]


@kernel
def place_of(motion: Motion, point: Arrow) -> Vector:
    """Return where a point [m] of a link, body axes, is in the world [m]."""
    return plus(position_of(motion), rotate(motion, point))


@kernel
def velocity_at(motion: Motion, point: Arrow) -> Vector:
    """Return the velocity [m/s] of a point [m] of a link, body axes."""
    m, (x, y, z) = motion, (point[0], point[1], point[2])
    return m.u + m.q * z - m.r * y, m.v + m.r * x - m.p * z, m.w + m.p * y - m.q * x


@kernel
def with_velocity(motion: Motion, velocity: Arrow, spin: Arrow) -> Motion:
    """Return the pose of a motion with another velocity [m/s] and angular velocity [rad/s], body axes."""
    v, w = velocity, spin
    return Motion(*motion[:12], v[0], v[1], v[2], w[0], w[1], w[2])


@kernel
def zero_vector() -> Vector:
    """Return the vector of length 0."""
    return 0.0, 0.0, 0.0


@kernel
def zero_wrench() -> Wrench:
    """Return no force and no torque."""
    return Wrench(*zero_vector(), *zero_vector())


@kernel
def turned_rows(turn: Vector) -> Rows:
    """Rows of the rotation by roll, pitch and yaw [rad]."""
    (cr, sr), (cp, sp), (cy, sy) = (
        (math.cos(turn[0]), math.sin(turn[0])),
        (math.cos(turn[1]), math.sin(turn[1])),
        (math.cos(turn[2]), math.sin(turn[2])),
    )
    return (
        cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
        sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,
        -sp, cp * sr, cp * cr,
    )  # fmt: skip


@kernel
def motion_at_rest(place: Vector, rows: Rows) -> Motion:
    """Return the motion of a link at rest at a place [m, world], with a rotation matrix, body to world, row by row."""
    return Motion(*place, *rows, *zero_vector(), *zero_vector())


@kernel
def add(a: Wrench, b: Wrench) -> Wrench:
    """Return the sum of two wrenches about the same point."""
    return Wrench(*plus(a[:3], b[:3]), *plus(a[3:], b[3:]))


@kernel
def scale_wrench(wrench: Wrench, factor: float) -> Wrench:
    """Return a multiple of a wrench."""
    return Wrench(*times(factor, wrench[:3]), *times(factor, wrench[3:]))


@kernel
def shift(wrench: Wrench, lever: Vector) -> Wrench:
    """Return `wrench` about another point; `lever` [m] leads from that point to the wrench's own."""
    w, (x, y, z) = wrench, lever
    tx, ty, tz = w.tx + y * w.fz - z * w.fy, w.ty + z * w.fx - x * w.fz, w.tz + x * w.fy - y * w.fx
    return Wrench(*w[:3], tx, ty, tz)


@kernel
def carry(wrench: Wrench, motion: Motion, start: FloatArray, end: FloatArray) -> Wrench:
    """Return `wrench`, which is about the link's point `start`, about its point `end`.

    Both points [m] in body axes from the link's origin, (3,).
    """
    return shift(wrench, rotate(motion, minus(start, end)))


@kernel
def from_origin(wrench: Wrench, motion: Motion, end: FloatArray) -> Wrench:
    """Return `wrench`, which is about the link's origin, about its point `end` [m], body axes, (3,)."""
    return shift(wrench, rotate(motion, (-end[0], -end[1], -end[2])))


@kernel
def rotated_wrench(motion: Motion, wrench: Wrench) -> Wrench:
    """Return a wrench of body axes in world axes, about the same point."""
    return Wrench(*rotate(motion, wrench[:3]), *rotate(motion, wrench[3:]))
