"""A robot as the text of a URDF, for programs that read one."""

from collections.abc import Iterable
from copy import deepcopy
from typing import Any
from xml.etree import ElementTree as ET

from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.formats.urdf.elements import Node
from vrx_mj.formats.urdf.links import TYPES
from vrx_mj.formats.urdf.model import Joint, Link, Urdf
from vrx_mj.frames import Pose


def urdf_text(robot: Urdf, tags: Iterable[Node]) -> str:
    """A robot as a URDF, with Gazebo's tags and the places of its meshes.

    A joint of a kind that URDF has not, and one that does not rest at 0, is fixed in it; an ellipsoid is the box
    around it.
    """
    root = ET.Element("robot", name=robot.name)
    for link in robot.links.values():
        _add_link(root, link)
    for joint in robot.joints.values():
        _add_joint(root, joint)
    for tag in tags:
        root.append(deepcopy(tag.element))
    for element in root.iter():
        element.tail = None
    ET.indent(root)
    return f"{ET.tostring(root, encoding='unicode')}\n"


def _add_link(root: Any, link: Link) -> None:
    made = _child(root, "link", name=link.name)
    if link.inertial is not None:
        inertial = _child(made, "inertial")
        _add_origin(inertial, link.inertial.pose)
        _child(inertial, "mass", value=repr(link.inertial.mass))
        keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        _child(inertial, "inertia", **dict(zip(keys, map(repr, link.inertial.tensor), strict=True)))
    for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)):
        for shape in shapes:
            _add_shape(_child(made, tag, **({"name": shape.name} if shape.name else {})), shape)


def _add_shape(made: Any, shape: Shape) -> None:
    _add_origin(made, shape.pose)
    geometry = _child(made, "geometry")
    if shape.type == "mesh":
        assert shape.folder is not None, "a mesh comes from a file"
        uri = (shape.folder / str(shape.file)).resolve().as_uri()
        _child(geometry, "mesh", filename=uri, scale=_words(shape.scale))
    elif shape.size is not None:
        _child(geometry, "box", size=_words(shape.size))
    else:
        sizes = {"radius": shape.radius, "length": shape.length}
        _child(geometry, shape.type, **{key: repr(value) for key, value in sizes.items() if value is not None})
    if isinstance(shape, Visual) and shape.color is not None:
        material = _child(made, "material", name="")
        _child(material, "color", rgba=_words(shape.color))


def _add_joint(root: Any, joint: Joint) -> None:
    made = _child(
        root, "joint", name=joint.name, type=joint.type if joint.type in TYPES and not joint.rest else "fixed"
    )
    _add_origin(made, joint.pose)
    _child(made, "parent", link=joint.parent)
    _child(made, "child", link=joint.child)
    _child(made, "axis", xyz=_words(joint.axis))
    if joint.limits is not None:
        limits = joint.limits
        keys = {"lower": limits.lower, "upper": limits.upper, "effort": limits.effort, "velocity": limits.velocity}
        _child(made, "limit", **{key: repr(value) for key, value in keys.items()})


def _add_origin(made: Any, pose: Pose) -> None:
    _child(made, "origin", xyz=_words(pose[:3]), rpy=_words(pose[3:]))


def _child(parent: Any, tag: str, **attributes: str) -> Any:
    return ET.SubElement(parent, tag, attributes)


def _words(values: Iterable[float]) -> str:
    return " ".join(map(repr, values))
