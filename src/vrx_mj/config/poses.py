"""Poses as files write them, [x, y, z, roll, pitch, yaw], and as MuJoCo wants them."""

import math
from collections.abc import Sequence

Pose = tuple[float, float, float, float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


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


def angles(matrix: Matrix) -> tuple[float, float, float]:
    """Roll, pitch and yaw [rad] of a rotation matrix; roll is 0 where pitch is +-90 degrees."""
    (r00, r01, _), (r10, r11, _), (r20, r21, r22) = matrix
    pitch = math.atan2(-r20, math.hypot(r00, r10))
    if math.hypot(r00, r10) < 1e-9:
        return 0.0, pitch, math.atan2(-r01, r11)
    return math.atan2(r21, r22), pitch, math.atan2(r10, r00)


def apply(matrix: Matrix, vector: Sequence[float]) -> tuple[float, float, float]:
    """The matrix times a 3-vector."""
    x, y, z = (sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix)
    return x, y, z


def compose(outer: Pose, inner: Pose) -> Pose:
    """Pose in the world of something at `inner` in a frame that is at `outer`."""
    turn = rotation(*outer[3:])
    x, y, z = (a + b for a, b in zip(outer[:3], apply(turn, inner[:3]), strict=True))
    a, b, c = (apply(turn, column) for column in zip(*rotation(*inner[3:]), strict=True))
    roll, pitch, yaw = angles(((a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2])))
    return x, y, z, roll, pitch, yaw


def inverse(pose: Pose) -> Pose:
    """Pose of the outer frame in the frame that is at `pose` in it."""
    a, b, c = rotation(*pose[3:])
    back = ((a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2]))
    x, y, z = apply(back, pose[:3])
    roll, pitch, yaw = angles(back)
    return -x, -y, -z, roll, pitch, yaw


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
    roll, pitch, yaw = angles(turn)
    return 0.0, 0.0, 0.0, roll, pitch, yaw
