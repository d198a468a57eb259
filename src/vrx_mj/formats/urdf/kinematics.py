"""A URDF's text in the sandboxed process: every element checked; yourdfpy follows its joints."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yourdfpy

from vrx_mj.arrays import FloatArray
from vrx_mj.formats.urdf import links as rows
from vrx_mj.formats.urdf.elements import Findings, Node, losses
from vrx_mj.formats.urdf.links import Surroundings, material_colors, read_joint, read_link
from vrx_mj.formats.urdf.model import Link, LinkRow, Place, Urdf
from vrx_mj.formats.urdf.xml_document import parse_robot
from vrx_mj.frames import rotation

_FIXED = "fixed"


def reading(
    text: str, file: str, label: str, files: Sequence[str] = (), places: Sequence[tuple[int, int, int]] = ()
) -> tuple[Urdf, tuple[LinkRow, ...], Findings]:
    """The robot of a URDF's text, its links with meshes still to be found, and what is wrong and odd.

    No file is looked at. Raises ConfigError if it is no XML of a robot.

    Its elements come from places in other files, by the number of a file, line and column, if these are given.
    """
    markup = parse_robot(text, label)
    element: Any
    for element, (number, line, column) in zip(markup.iter() if places else (), places, strict=True):
        element.place = Place(files[number], line, column)
    findings = Findings(label)
    root = Node(markup, "", findings)
    around = Surroundings(findings, *material_colors(root))
    shapes = {row.link.name: row for row in (read_link(node, around) for node in rows.named_children(root, "link"))}
    links = {name: row.link for name, row in shapes.items()}
    joints = {joint.name: joint for joint in (read_joint(node, links) for node in rows.named_children(root, "joint"))}
    tags = [Node(tag, "gazebo", findings) for tag in markup.findall("gazebo")]
    robot = rows.robot_of(root, Path(file), links, joints, around, tags, turns)
    robot = replace(robot, remarks=tuple(losses(markup, "robot", "boat")))
    return robot, tuple(shapes.values()), findings


def tree(text: str, label: str) -> Urdf:
    """Links and joints of a URDF's text. Raises ConfigError."""
    root = Node(parse_robot(text, label), "", Findings(label))
    links = {
        (name := node.required_attribute("name")): Link(name, None, place=node.place) for node in root.children("link")
    }
    joints = {joint.name: joint for joint in (read_joint(node, links) for node in root.children("joint"))}
    top = rows.checked_root(links, joints, root)
    root.findings.settle()
    return rows.resting_robot(root, Path(label), links, joints, top, turns)


def turns(links: Sequence[str], joints: Sequence[rows.Row]) -> dict[str, FloatArray]:
    """Where each link is in the one above it while the joints rest, as (4, 4) matrices."""
    made, resting = [], dict[str, float]()
    for name, kind, parent, child, pose, axis, rest in joints:
        origin = np.eye(4)
        origin[:3, :3], origin[:3, 3] = rotation(*pose[3:]), pose[:3]
        made.append(yourdfpy.Joint(name, kind if rest else _FIXED, parent, child, origin, np.array(axis)))
        if rest:
            resting[name] = rest
    model = yourdfpy.URDF(yourdfpy.Robot("", [yourdfpy.Link(name) for name in links], made), load_meshes=False)
    model.update_cfg(resting)
    return {child: model.get_transform(child, parent) for _, _, parent, child, *_ in joints}
