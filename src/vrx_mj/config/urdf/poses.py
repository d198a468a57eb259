"""Poses of links: frames chained through the joints of a URDF, all at zero."""

import math

from vrx_mj.config.urdf.model import Pose, Urdf

__all__ = ["chained", "inverse", "link_pose"]

Row = tuple[float, float, float]
Frame = tuple[tuple[Row, Row, Row], Row]
"""Rotation matrix, child to parent, and the child's origin in the parent [m]."""

GIMBAL = 1e-9
"""Cosine of the pitch below which roll and yaw turn about one axis: then all of it is called yaw."""


def link_pose(urdf: Urdf, link: str) -> Pose:
    """Pose of a link's frame in the root link's, every joint at zero [m, rad]. `link` is as the file calls it."""
    above = {joint.child: joint for joint in urdf.joints.values()}
    poses: list[Pose] = []
    while link in above:
        poses.append(above[link].pose)
        link = above[link].parent
    return chained(*reversed(poses))


def chained(*poses: Pose) -> Pose:
    """The pose of the last frame in the first one's parent; each pose is in the frame before it [m, rad]."""
    frame: Frame = (((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0))
    for pose in poses:
        frame = _product(frame, _frame(pose))
    return _pose(frame)


def inverse(pose: Pose) -> Pose:
    """The pose of the parent's frame in the child's [m, rad]."""
    rotation, origin = _frame(pose)
    columns = tuple(zip(*rotation, strict=True))
    back = tuple(-_dot(column, origin) for column in columns)
    return _pose((columns, back))  # type: ignore[arg-type]


def _frame(pose: Pose) -> Frame:
    """R = Rz(yaw) Ry(pitch) Rx(roll), as in URDF and SDF."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(angle), math.cos(angle)) for angle in pose[3:])
    rotation = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return rotation, pose[:3]


def _product(a: Frame, b: Frame) -> Frame:
    columns = tuple(zip(*b[0], strict=True))
    rotation = tuple(tuple(_dot(row, column) for column in columns) for row in a[0])
    origin = tuple(place + _dot(row, b[1]) for place, row in zip(a[1], a[0], strict=True))
    return rotation, origin  # type: ignore[return-value]


def _dot(a: Row, b: Row) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _pose(frame: Frame) -> Pose:
    (a, b, _), (c, d, _), (e, f, g) = frame[0]
    flat = math.hypot(a, c)
    roll, yaw = (0.0, math.atan2(-b, d)) if flat < GIMBAL else (math.atan2(f, g), math.atan2(c, a))
    x, y, z = frame[1]
    return x + 0.0, y + 0.0, z + 0.0, roll + 0.0, math.atan2(-e, flat) + 0.0, yaw + 0.0
