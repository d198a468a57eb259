"""Links and joints of a URDF, and the robot that they make, checked as a whole."""

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.objects import tree_faults
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.tree import choice
from vrx_mj.config.values import COLORS
from vrx_mj.errors import UnknownNameError
from vrx_mj.foreign import ask
from vrx_mj.formats.urdf.elements import FIELDS, LARGEST, Findings, Node, Values, own_name
from vrx_mj.formats.urdf.gazebo import read_gazebo
from vrx_mj.formats.urdf.model import Color, Inertial, Joint, Limits, Link, LinkRow, MeshRow, Urdf
from vrx_mj.frames import IDENTITY, ZERO, Pose, Vector, angles

_GEOMETRIES = ("box", "sphere", "cylinder", "capsule", "mesh")
_POST = "_post_link"
"""End of the name of a sensor's post in VRX; it may have a negative length, and so a negative mass."""
_VRX_IMU = (0.1, 0.000083, 0.000083, 0.0125)
"""Mass and moments that VRX gives its IMU. No body has them, but so light a part does not matter."""
_SLIGHT = 1.1
"""Ratio of a moment to the sum of the others from which the inertia of a heavy link is an error."""
_THIN, _ROUNDED = 1e-6, 1e-12
"""Squares [m2] of radii of gyration, 1 mm and 1 um: moments off by less come of rounding, and are no error; or are
not worth a word."""
_LAST_DIGITS = 1e-7
"""Moments [kg m2] that are off by less come of rounding, however light the link: files write seven decimals."""
ONE = (1.0, 1.0, 1.0)
"""Scale of a mesh that is drawn as it is."""
_ANY_MESH = "mesh.obj"
"""Stands for the file of a mesh while what else is said of it is checked."""
ShapeT = TypeVar("ShapeT", bound=Shape)

_GAZEBO_NAME = re.compile(r"(?<=[a-z])(?=[A-Z])")
TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating", "planar")
BOUNDED = ("revolute", "prismatic")
ENDLESS = 1e10
"""Limit of a joint [rad or m] from which it has none; files write 1e16, as Gazebo does, or inf."""
_LIGHT = 0.01
"""Share of a robot's mass below which a link's impossible inertia does not matter."""
_SLENDER = 0.1
"""Share of the largest moments of all links up to which it does not matter either."""


@dataclass
class Surroundings:
    """Colours to which elements of links refer, and problems of the links."""

    findings: Findings
    materials: Mapping[str, Color] = field(default_factory=dict)
    """Colours of the URDF's materials."""
    gazebo: Mapping[str, Color] = field(default_factory=dict)
    """Colours that Gazebo's tags give to links."""
    impossible: list[tuple[Node, str, bool, str]] = field(default_factory=list)
    """Inertias that are negative or break the triangle inequality: element, link, whether by far, and in words."""


def read_link(node: Node, around: Surroundings) -> LinkRow:
    """A `<link>`. Problems and suspicious values are noted, not raised."""
    name = node.required_attribute("name")
    if _is_short_post(node, name):
        around.findings.note("post", name)
        return LinkRow(Link(name, None, place=node.place), (), ())

    def color(visual: Node) -> Color | None:
        material = visual.child("material")
        own = material.child("color") if material else None
        named = around.materials.get(material.attribute("name") or "") if material else None
        return around.gazebo.get(name) or (_rgba(own) if own else named)

    felt, seen = read_shapes(node, name, around.findings, _shape, color)
    return LinkRow(Link(name, _inertial(node, name, around), place=node.place), tuple(row for _, row in felt), seen)


def _read_pose(node: Node | None) -> Pose:
    """The pose in an element's `<origin>`; what is missing is zero."""
    origin = node.child("origin") if node else None
    if origin is None:
        return IDENTITY
    x, y, z = origin.numbers("xyz", "x y z", ZERO, low=-1e6, high=1e6)
    roll, pitch, yaw = origin.numbers("rpy", "roll pitch yaw", ZERO)
    return (x, y, z, roll, pitch, yaw)


def material_colors(root: Node) -> tuple[dict[str, Color], dict[str, Color]]:
    """Colours of materials by their name, and colours that `<gazebo>` tags give to links."""
    materials, links = dict[str, Color](), dict[str, Color]()
    tops = root.element.findall("material")
    for element in root.element.iter("material"):
        top = element in tops  # problems of others are found where they are used
        node = Node(element, f"material '{element.get('name')}'", root.findings if top else Findings(""))
        name, color = node.attribute("name"), node.child("color")
        if name and color is not None:
            materials.setdefault(name, _rgba(color))
    for node in root.children("gazebo"):
        gazebo, link = gazebo_color(node.text("material")), node.attribute("reference")
        if gazebo and link:
            links[link] = gazebo
    return materials, links


def gazebo_color(text: str) -> Color | None:
    """The colour of a stock material, such as Gazebo/DarkGrey; None for those that are pictures."""
    name = _GAZEBO_NAME.sub("_", text.removeprefix("Gazebo/")).lower()
    return (*COLORS[name], 1.0) if text.startswith("Gazebo/") and name in COLORS else None


def _rgba(node: Node) -> Color:
    red, green, blue, alpha = node.numbers("rgba", "red green blue alpha", (0.5, 0.5, 0.5, 1.0), low=0, high=1)
    return (red, green, blue, alpha)


def _is_short_post(node: Node, name: str) -> bool:
    """Whether this is a sensor's post that ends below the deck: VRX writes length and mass as they come out."""
    mass = node.child("inertial", "mass")
    try:
        return name.endswith(_POST) and mass is not None and -math.inf < float(mass.attribute("value") or 1.0) <= 0.0
    except ValueError:
        return False


def _inertial(node: Node, name: str, around: Surroundings) -> Inertial | None:
    inertial = node.child("inertial")
    if inertial is None:
        return None
    mass_node, inertia = inertial.required_child("mass"), inertial.required_child("inertia")
    mass = mass_node.number("value", low=0) if mass_node else math.nan
    diagonal = [inertia.number(key) if inertia else math.nan for key in ("ixx", "iyy", "izz")]
    products = [inertia.number(key, 0.0) if inertia else math.nan for key in ("ixy", "ixz", "iyz")]
    pose = _read_pose(inertial)
    values = mass, *diagonal, *products
    return inertial_of(inertia, name, values, pose, around) if all(map(math.isfinite, values)) else None


def inertial_of(
    node: Node | None, name: str, values: tuple[float, ...], pose: Pose, around: Surroundings
) -> Inertial | None:
    """Mass properties of a link by mass and tensor, if it has a mass; what no body has is noted.

    No principal moment is negative, and none exceeds the sum of the others, in any body that exists.
    """
    mass, xx, yy, zz, xy, xz, yz = values
    if mass == 0.0:
        around.findings.note("massless", name)
        return None
    found = Inertial(mass, pose, (xx, yy, zz, xy, xz, yz))
    if node is None:
        return found
    low, middle, high = moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).tolist()
    words = ", ".join(f"{moment:.6g}" for moment in moments)
    if low < -_ROUNDED * mass:
        around.impossible.append((node, name, low < -max(1e-9 * high, _THIN * mass, _LAST_DIGITS), f"{words} kg m2"))
    elif high - low - middle > max(1e-6 * (low + middle), _ROUNDED * mass) and (mass, xx, yy, zz) != _VRX_IMU:
        far = high - low - middle > max((_SLIGHT - 1.0) * (low + middle), _THIN * mass, _LAST_DIGITS)
        more = "and the largest is more than the sum of the other two"
        around.impossible.append((node, name, far, f"{words} kg m2, {more}"))
    return found


def read_shapes(
    link: Node,
    name: str,
    findings: Findings,
    values_of: Callable[[Node, Node], Values | None],
    color_of: Callable[[Node], Color | None],
) -> tuple[list[tuple[Node, Shape | MeshRow]], tuple[Visual | MeshRow, ...]]:
    """Collisions of a link with their elements, and its visuals; one without a shape, as VRX has it, shows nothing.

    Args:
        link: the `<link>`.
        name: its name.
        findings: takes problems and suspicious values.
        values_of: reads the values of a shape from its element and the `<geometry>` in it.
        color_of: reads the colour of a `<visual>`.
    """
    felt, seen = list[tuple[Node, Shape | MeshRow]](), list[Visual | MeshRow]()
    for node in link.children("collision"):
        geometry = node.required_child("geometry")
        values = values_of(node, geometry) if geometry else None
        if geometry and values and (shape := shape_of(node, geometry, values, Shape)):
            felt.append((node, shape))
    for node in link.children("visual"):
        geometry = node.child("geometry")
        if geometry is None:
            findings.note("shapeless", name)
        elif values := values_of(node, geometry):
            color = color_of(node)
            visual = shape_of(node, geometry, values | ({"color": color} if color else {}), Visual)
            seen += [visual] if visual else []
    return felt, tuple(seen)


def shape_of(node: Node, geometry: Node, values: Values, kind: type[ShapeT]) -> ShapeT | MeshRow | None:
    """A shape of these values; of a mesh the row."""
    if values["type"] != "mesh" or node.config_of(kind, {**values, "file": _ANY_MESH}) is None:
        return node.config_of(kind, values)
    mesh = geometry.child("mesh") or geometry
    key = "uri" if mesh.child("uri") else "filename"
    given: Values = {"scale": ONE, "name": None, "color": None} | values
    del given["type"]
    return MeshRow(place=mesh.place, key=f"{mesh.path} / {key}", **given)


def _shape(node: Node, geometry: Node) -> Values | None:
    """Type, sizes, pose and name of a shape; a mesh's file as it is written."""
    shapes = [Node(child, f"{geometry.path} / {child.tag}", geometry.findings) for child in geometry.element]
    if len(shapes) != 1:
        found = ", ".join(shape.tag for shape in shapes) or "nothing"
        geometry.fault(f"expected one of {', '.join(_GEOMETRIES)}, got {found}")
        return None
    shape, known = shapes[0], len(geometry.findings.problems)
    if shape.tag not in _GEOMETRIES:
        geometry.fault(choice(shape.tag, _GEOMETRIES))
        return None
    values: Values = {"type": shape.tag, "pose": _read_pose(node)}
    if shape.tag == "mesh":
        values["file"] = shape.required_attribute("filename")
        if shape.attribute("scale") is not None:
            values["scale"] = _scale(shape)
    else:
        values |= {key: shape.needed_value(key, tag) for key, tag in FIELDS[shape.tag].items()}
    return None if len(geometry.findings.problems) > known else values | shape_name(node)


def shape_name(node: Node) -> dict[str, str]:
    """The name of a shape as ours may be; nothing without one."""
    name = own_name(node.attribute("name") or "")
    return {"name": name} if name else {}


def _scale(mesh: Node) -> tuple[float, ...]:
    """Scale of a mesh along x, y and z; negative ones mirror it."""
    words = (mesh.attribute("scale") or "").split()
    scale = mesh.numbers("scale", "factor") * 3 if len(words) == 1 else mesh.numbers("scale", "x y z")
    if 0.0 in scale:
        mesh.fault("must not be 0", "scale")
    return scale


def read_joint(node: Node, links: Collection[str]) -> Joint:
    """A `<joint>` between two of these links. Problems and suspicious values are noted, not raised."""
    name, kind = node.required_attribute("name"), node.attribute("type") or ""
    if kind not in TYPES:
        node.fault(choice(kind, TYPES) if kind else f"required, but missing; one of {', '.join(TYPES)}", "type")
    parent, child = (_end(node, tag, links) for tag in ("parent", "child"))
    if parent and parent == child:
        node.fault(f"joins the link '{parent}' to itself")
    axis = _axis(node, kind)
    kind, limits = free_type(kind, _limits(node, kind))
    rest = min(max(0.0, limits.lower), limits.upper) if limits and kind in BOUNDED else 0.0
    pose, place = _read_pose(node), node.place
    return Joint(name, kind, parent, child, pose, axis=axis, limits=limits, place=place, rest=rest)


def _end(node: Node, tag: str, links: Collection[str]) -> str:
    end = node.required_child(tag)
    name = end.required_attribute("link") if end else ""
    if end and name and name not in links:
        end.fault(str(UnknownNameError("link", name, links)), "link")
    return name


def _axis(node: Node, kind: str) -> Vector:
    """Direction of the joint's axis, of length 1."""
    axis = node.child("axis")
    x, y, z = axis.numbers("xyz", "x y z", (1.0, 0.0, 0.0)) if axis else (1.0, 0.0, 0.0)
    if axis and not (x or y or z) and kind not in {"fixed", "floating"}:
        axis.fault("must not be zero, got '0 0 0'", "xyz")
    return length_one((x, y, z))


def length_one(axis: Vector) -> Vector:
    """The direction of a vector; x for one without a length."""
    x, y, z = axis
    length = math.hypot(x, y, z)
    if length == 0:
        return (1.0, 0.0, 0.0)
    return (x / length, y / length, z / length) if abs(length - 1) > 1e-9 else (x, y, z)


def _limits(node: Node, kind: str) -> Limits | None:
    limit = node.child("limit")
    if limit is None:
        if kind in BOUNDED:
            node.fault(f"required, but missing: a {kind} joint has limits", "limit")
        return None
    lower, upper = (limit.number(key, 0.0, largest=1e308) for key in ("lower", "upper"))  # urdfdom knows no inf
    effort, velocity = (limit.number(key, 0.0, low=0, largest=1e308) for key in ("effort", "velocity"))
    if kind in BOUNDED and lower > upper:
        limit.fault(f"lower {lower:g} is above upper {upper:g}")
    return Limits(max(lower, -LARGEST), min(upper, LARGEST), min(effort, LARGEST), min(velocity, LARGEST))


def free_type(kind: str, limits: Limits | None) -> tuple[str, Limits | None]:
    """The type of a joint and its limits; a revolute one turns freely between limits that have no end."""
    endless = limits is not None and limits.lower <= -ENDLESS and limits.upper >= ENDLESS
    return "continuous" if kind == "revolute" and endless else kind, limits


Row = tuple[str, str, str, str, Pose, Vector, float]
"""Name of a joint, type, parent, child, pose in the parent at 0 [m, rad], axis, and value at rest."""
_Turns = Callable[[Sequence[str], Sequence[Row]], dict[str, FloatArray]]


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

    Without `turns` the sandboxed process is asked where its joints put its links.
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
