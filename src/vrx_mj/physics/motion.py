"""Where a link is, how it moves, and the wrenches on it."""

from typing import NamedTuple

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel

Vector = tuple[float, float, float]


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
    r00, r01, r02 = 1.0 - s * (qy * qy + qz * qz), s * (qx * qy - qw * qz), s * (qx * qz + qw * qy)
    r10, r11, r12 = s * (qx * qy + qw * qz), 1.0 - s * (qx * qx + qz * qz), s * (qy * qz - qw * qx)
    r20, r21, r22 = s * (qx * qz - qw * qy), s * (qy * qz + qw * qx), 1.0 - s * (qx * qx + qy * qy)
    vx, vy, vz = qvel[dof_adr], qvel[dof_adr + 1], qvel[dof_adr + 2]
    u = r00 * vx + r10 * vy + r20 * vz
    v = r01 * vx + r11 * vy + r21 * vz
    w = r02 * vx + r12 * vy + r22 * vz
    p, q, r = qvel[dof_adr + 3], qvel[dof_adr + 4], qvel[dof_adr + 5]
    x, y, z = qpos[qpos_adr], qpos[qpos_adr + 1], qpos[qpos_adr + 2]
    return Motion(x, y, z, r00, r01, r02, r10, r11, r12, r20, r21, r22, u, v, w, p, q, r)


@kernel
def rotate(motion: Motion, x: float, y: float, z: float) -> Vector:
    """Return the vector (x, y, z) of body axes in world axes."""
    return (
        motion.r00 * x + motion.r01 * y + motion.r02 * z,
        motion.r10 * x + motion.r11 * y + motion.r12 * z,
        motion.r20 * x + motion.r21 * y + motion.r22 * z,
    )


@kernel
def unrotate(motion: Motion, x: float, y: float, z: float) -> Vector:
    """Return the vector (x, y, z) of world axes in body axes."""
    return (
        motion.r00 * x + motion.r10 * y + motion.r20 * z,
        motion.r01 * x + motion.r11 * y + motion.r21 * z,
        motion.r02 * x + motion.r12 * y + motion.r22 * z,
    )


@kernel
def relative_motion(motion: Motion, water: Vector) -> Motion:
    """Return a motion through water that moves with a velocity [m/s, world axes] and does not turn."""
    m = motion
    u, v, w = unrotate(m, water[0], water[1], water[2])
    return with_velocity(m, (m.u - u, m.v - v, m.w - w), (m.p, m.q, m.r))


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def velocity_at(motion: Motion, x: float, y: float, z: float) -> Vector:
    """Return the velocity [m/s] of a point (x, y, z) [m] of a link, body axes."""
    m = motion
    return m.u + m.q * z - m.r * y, m.v + m.r * x - m.p * z, m.w + m.p * y - m.q * x


@kernel
def with_velocity(motion: Motion, velocity: Vector, spin: Vector) -> Motion:
    """Return the pose of a motion with another velocity [m/s] and angular velocity [rad/s], body axes."""
    m = motion
    return Motion(
        m.x, m.y, m.z, m.r00, m.r01, m.r02, m.r10, m.r11, m.r12, m.r20, m.r21, m.r22,
        velocity[0], velocity[1], velocity[2], spin[0], spin[1], spin[2],
    )  # fmt: skip


@kernel
def zero_vector() -> Vector:
    """Return the vector of length 0."""
    return 0.0, 0.0, 0.0


@kernel
def zero_wrench() -> Wrench:
    """Return no force and no torque."""
    return Wrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def add(a: Wrench, b: Wrench) -> Wrench:
    """Return the sum of two wrenches about the same point."""
    return Wrench(a.fx + b.fx, a.fy + b.fy, a.fz + b.fz, a.tx + b.tx, a.ty + b.ty, a.tz + b.tz)


@kernel
def scaled(wrench: Wrench, factor: float) -> Wrench:
    """Return a multiple of a wrench."""
    w, f = wrench, factor
    return Wrench(f * w.fx, f * w.fy, f * w.fz, f * w.tx, f * w.ty, f * w.tz)


@kernel
def shift(wrench: Wrench, lever: Vector) -> Wrench:
    """Return `wrench` about another point; `lever` [m] leads from that point to the wrench's own."""
    w, (x, y, z) = wrench, lever
    tx, ty, tz = w.tx + y * w.fz - z * w.fy, w.ty + z * w.fx - x * w.fz, w.tz + x * w.fy - y * w.fx
    return Wrench(w.fx, w.fy, w.fz, tx, ty, tz)


@kernel
def carry(wrench: Wrench, motion: Motion, start: FloatArray, end: FloatArray) -> Wrench:
    """Return `wrench`, which is about the link's point `start`, about its point `end`.

    Both points [m] in body axes from the link's origin, (3,).
    """
    lever = rotate(motion, start[0] - end[0], start[1] - end[1], start[2] - end[2])
    return shift(wrench, lever)


@kernel
def from_origin(wrench: Wrench, motion: Motion, end: FloatArray) -> Wrench:
    """Return `wrench`, which is about the link's origin, about its point `end` [m], body axes, (3,)."""
    return shift(wrench, rotate(motion, -end[0], -end[1], -end[2]))


@kernel
def rotated_wrench(motion: Motion, wrench: Wrench) -> Wrench:
    """Return a wrench of body axes in world axes, about the same point."""
    fx, fy, fz = rotate(motion, wrench.fx, wrench.fy, wrench.fz)
    tx, ty, tz = rotate(motion, wrench.tx, wrench.ty, wrench.tz)
    return Wrench(fx, fy, fz, tx, ty, tz)
