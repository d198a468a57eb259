"""Poses of links: frames chained through the joints of a URDF, all at zero."""

from functools import reduce

from vrx_mj.config.poses import compose
from vrx_mj.config.urdf.model import Pose, Urdf

__all__ = ["chained", "link_pose"]

ZERO: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


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
    return reduce(compose, poses, ZERO)
