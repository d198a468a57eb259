"""Joints and links of a robot's description: where each link's frame is in that of the one that carries it."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.poses import quaternion
from vrx_mj.config.urdf.elements import Findings, Node
from vrx_mj.config.urdf.joints import read_joint, root_of
from vrx_mj.config.urdf.model import Joint
from vrx_mj.config.urdf.xml_text import parse_robot
from vrx_mj.errors import ConfigError

__all__ = ["BASE", "Bone", "bones"]

BASE = "base_link"
"""What the frame of a boat's root link is called, whatever the link's own name."""
FIXED = "fixed"


class Bone(NamedTuple):
    """A joint, and the link that it carries; frames have the boat's name before theirs, as `wamv/base_link`."""

    joint: str
    """As the description calls it."""
    parent: str
    child: str
    """Frames."""
    position: FloatArray
    quaternion: FloatArray
    """(3,) [m] and (w, x, y, z): the child in the parent, the joint at zero."""
    axis: FloatArray
    """(3,) unit vector about which it turns, or along which it slides, in the child's frame."""
    moves: bool
    place: FloatArray
    """(3,) of the child in the root's frame, all joints at zero [m]."""


@lru_cache(maxsize=256)
def bones(text: str, boat: str) -> tuple[Bone, ...]:
    """The joints of a URDF, parents first; none for a text that is no robot."""
    findings = Findings("robot_description")
    try:
        root = Node(parse_robot(text, findings.file), "", findings)
        links = {node.name(): node for node in root.children("link")}
        joints = {joint.name: joint for joint in (read_joint(node, links) for node in root.children("joint"))}
        findings.settle()
        top = root_of(links, joints, findings)
        findings.settle()
    except ConfigError:
        return ()
    return tuple(_grown(top, list(joints.values()), boat)) if top else ()


def _grown(top: str, joints: Sequence[Joint], boat: str) -> Iterator[Bone]:
    namespace, slash, name = top.rpartition("/")
    places = {top: (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))}
    base = f"{boat}/{BASE}"
    frames = {top: base}
    if name != BASE:
        frames[top] = f"{boat}/{name}"
        yield Bone("", base, frames[top], *places[top], np.zeros(3), False, places[top][0])
    children: dict[str, list[Joint]] = {}
    for joint in joints:
        children.setdefault(joint.parent, []).append(joint)
    waiting = [top]
    while waiting:
        parent = waiting.pop()
        for joint in children.get(parent, ()):
            position, turn = np.array(joint.pose[:3]), np.array(quaternion(*joint.pose[3:]))
            frames[joint.child] = f"{boat}/{joint.child.removeprefix(namespace + slash)}"
            places[joint.child] = _carried(places[parent], position, turn)
            yield Bone(
                joint.name,
                frames[parent],
                frames[joint.child],
                position,
                turn,
                np.array(joint.axis),
                joint.type != FIXED and not joint.locked,
                places[joint.child][0],
            )
            waiting.append(joint.child)


def _carried(
    outer: tuple[FloatArray, FloatArray], position: FloatArray, turn: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Where something is that is at `position`, turned by `turn`, in a frame that is at `outer`."""
    place, around = np.empty(3), np.empty(4)
    mujoco.mju_rotVecQuat(place, position, outer[1])
    mujoco.mju_mulQuat(around, outer[1], turn)
    return outer[0] + place, around
