"""A robot as the text of a URDF, for programs that read one."""

from collections.abc import Iterable
from copy import deepcopy
from xml.etree import ElementTree as ET

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup as Escaped

from vrx_mj.formats.urdf.elements import Node
from vrx_mj.formats.urdf.links import TYPES
from vrx_mj.formats.urdf.model import Urdf
from vrx_mj.resources import root


def urdf_text(robot: Urdf, tags: Iterable[Node]) -> str:
    """A robot as a URDF, with Gazebo's tags and the places of its meshes.

    A joint of a kind that URDF has not, and one that does not rest at 0, is fixed in it; an ellipsoid is the box
    around it.
    """
    environment = Environment(
        loader=FileSystemLoader(root() / "templates"), trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined,
        autoescape=True, finalize=lambda value: " ".join(map(str, value)) if isinstance(value, tuple) else value,
    )  # fmt: skip
    template = environment.get_template("sdf_boat.urdf.j2")
    return template.render(robot=robot, types=TYPES, tags=[_text(tag) for tag in tags]) + "\n"


def _text(tag: Node) -> Escaped:
    element = deepcopy(tag.element)
    ET.indent(element, level=1)
    element.tail = None
    return Escaped(ET.tostring(element, encoding="unicode"))
