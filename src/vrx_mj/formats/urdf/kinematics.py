"""URDF in the process without rights, where yourdfpy follows its joints."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import yourdfpy

from vrx_mj.arrays import FloatArray
from vrx_mj.formats.urdf import rows
from vrx_mj.formats.urdf.model import Place, Reading, Urdf
from vrx_mj.formats.urdf.xml_document import parse_robot
from vrx_mj.frames import rotation

FIXED = "fixed"


def reading(
    text: str, file: str, label: str, files: Sequence[str] = (), places: Sequence[tuple[int, int, int]] = ()
) -> Reading:
    """What a URDF's text says, without looking at any file. Raises ConfigError if it is no XML of a robot.

    Its elements come from places in other files, by the number of a file, line and column, if these are given.
    """
    root = parse_robot(text, label)
    element: Any
    for element, (number, line, column) in zip(root.iter() if places else (), places, strict=True):
        element.place = Place(files[number], line, column)
    return rows.reading(root, file, label, turns)


def tree(text: str, label: str) -> Urdf:
    """What a URDF's text says about its joints. Raises ConfigError."""
    return rows.tree(parse_robot(text, label), label, turns)


def turns(links: Sequence[str], joints: Sequence[rows.Row]) -> dict[str, FloatArray]:
    """Where each link is in the one above it while the joints rest, as (4, 4) matrices."""
    made, resting = [], dict[str, float]()
    for name, kind, parent, child, pose, axis, rest in joints:
        origin = np.eye(4)
        origin[:3, :3], origin[:3, 3] = rotation(*pose[3:]), pose[:3]
        made.append(yourdfpy.Joint(name, kind if rest else FIXED, parent, child, origin, np.array(axis)))
        if rest:
            resting[name] = rest
    model = yourdfpy.URDF(yourdfpy.Robot("", [yourdfpy.Link(name) for name in links], made), load_meshes=False)
    model.update_cfg(resting)
    return {child: model.get_transform(child, parent) for _, _, parent, child, *_ in joints}
