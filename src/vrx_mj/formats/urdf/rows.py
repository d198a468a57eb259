"""A robot of links and joints, checked as a whole."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.joints import tree_faults
from vrx_mj.foreign import ask
from vrx_mj.formats.urdf.elements import Node
from vrx_mj.formats.urdf.gazebo import read_gazebo
from vrx_mj.formats.urdf.links import Surroundings
from vrx_mj.formats.urdf.model import Joint, Link, Urdf
from vrx_mj.frames import Pose, angles

Row = tuple[str, str, str, str, Pose, tuple[float, float, float], float]
"""Name of a joint, type, parent, child, pose in the parent at 0 [m, rad], axis, and value at rest."""
_Turns = Callable[[Sequence[str], Sequence[Row]], dict[str, FloatArray]]
_LIGHT = 0.01
"""Share of a robot's mass below which a link's impossible inertia does not matter."""
_SLENDER = 0.1
"""Share of the largest moments of all links up to which it does not matter either."""


def robot_of(
    root: Node,
    file: Path,
    links: Mapping[str, Link],
    joints: Mapping[str, Joint],
    around: Surroundings,
    tags: Sequence[Node],
    turns: _Turns | None = None,
) -> Urdf:
    """A robot whose links hang together and can exist, with what its tags mean, unless something is wrong with it.

    Without `turns` the process without rights is asked where its joints put its links.
    """
    top = checked_root(links, joints, root)
    check_masses(links, around, root)
    if root.findings.problems:
        return Urdf(file, root.findings.file, "", top, links, joints, {})
    robot = resting_robot(root, file, links, joints, top, turns)
    return replace(robot, gazebo=read_gazebo(robot, tags, root.findings))


def resting_robot(
    root: Node, file: Path, links: Mapping[str, Link], joints: Mapping[str, Joint], top: str, turns_of: _Turns | None
) -> Urdf:
    """A robot without plugins and sensors, its joints at rest."""
    rows = [(one.name, one.type, one.parent, one.child, one.pose, one.axis, one.rest) for one in joints.values()]
    job, about = "formats.urdf.kinematics:turns", "the joints of a robot"
    names, kind = list(links), dict[str, FloatArray]
    turns = turns_of(names, rows) if turns_of else ask(job, names, rows, returns=kind, about=about)
    resting = {
        name: replace(joint, pose=_pose(turns[joint.child])) if joint.rest else joint for name, joint in joints.items()
    }
    namespace = top.partition("/")[0] if "/" in top else ""
    robot = Urdf(file, root.findings.file, root.attribute("name") or file.stem, top, links, resting, {}, namespace)
    places = {top: np.eye(4)}
    for link in robot.below(top)[1:]:
        places[link] = places[robot.above[link].parent] @ turns[link]
    return replace(robot, places={link: _pose(place) for link, place in places.items()})


def _pose(turn: FloatArray) -> Pose:
    """A (4, 4) matrix as a pose; zeros have no sign."""
    (x, y, z), (roll, pitch, yaw) = turn[:3, 3].tolist(), angles(turn[:3, :3].tolist())
    return x + 0.0, y + 0.0, z + 0.0, roll + 0.0, pitch + 0.0, yaw + 0.0


def named_children(root: Node, tag: str) -> list[Node]:
    """Elements of this name, with names of their own that none shares."""
    nodes = root.children(tag)
    root.findings.check_names(tag, ((node.attribute("name") or "", node.place, node.path) for node in nodes))
    return nodes


def checked_root(links: Mapping[str, Link], joints: Mapping[str, Joint], root: Node) -> str:
    """Return the one link that is no joint's child, with a problem unless the links are a tree under it.

    A file whose joints name links that are not there has other problems first.
    """
    if not links:
        root.fault("has no links", root.tag)
    if root.findings.problems:
        return ""
    children = {joint.child for joint in joints.values()}
    top = next((name for name in links if name not in children), "")
    rows: Mapping[str | int, list[Link] | list[Joint]] = {
        "links": [link for link in links.values() if link.name != top],
        "joints": [*joints.values()],
    }
    ends = [(joint.name, joint.parent, joint.child) for joint in joints.values()]
    for (kind, index, *_), message in tree_faults(top, [link.name for link in rows["links"]], ends):
        row = rows[kind][int(index)]
        root.findings.problems.append(row.place.problem(f"{str(kind)[:-1]} '{row.name}'", str(message)))
    return top


def check_masses(links: Mapping[str, Link], around: Surroundings, root: Node) -> None:
    """A robot has a mass; the inertia of a link that is no small part of it can exist."""
    inertials = [link.inertial for link in links.values() if link.inertial]
    total, moment = sum(one.mass for one in inertials), sum(max(map(abs, one.tensor)) for one in inertials)
    if links and total == 0 and not around.findings.problems:
        root.fault("no link has a mass", root.tag)
    for node, name, far, words in around.impossible:
        inertial = links[name].inertial
        if far and inertial and (inertial.mass > _LIGHT * total or max(map(abs, inertial.tensor)) > _SLENDER * moment):
            node.fault(f"impossible moments of inertia: about the principal axes they are {words}")
        else:
            around.findings.note("inertia", name)
