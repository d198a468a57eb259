"""Links of a URDF: mass properties, and what collides and is seen."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.config.base import COLORS
from vrx_mj.config.shapes import MESH_SUFFIXES, Shape, Visual
from vrx_mj.config.urdf.elements import Findings, Node
from vrx_mj.config.urdf.mesh_paths import MeshFiles, MissingMeshError
from vrx_mj.config.urdf.meshes import check_mesh
from vrx_mj.config.urdf.model import Inertial, Link, Pose
from vrx_mj.config.urdf.stand_ins import stand_in
from vrx_mj.config.wording import choice, one_of, shown
from vrx_mj.errors import VrxError
from vrx_mj.resources import root

__all__ = ["Surroundings", "material_colors", "read_link", "read_pose"]

Color = tuple[float, float, float, float]

GEOMETRIES = ("box", "sphere", "cylinder", "capsule", "mesh")
POST = "_post_link"
"""How VRX's generator ends the name of a sensor's post; it may have a negative length, and so a negative mass."""
VRX_IMU = (0.1, 0.000083, 0.000083, 0.0125)
"""Mass and moments that VRX gives its IMU. No body has them, but so light a part does not matter."""
SLIGHT = 1.1
"""How far a moment may exceed the sum of the others before the inertia of a heavy link is an error."""
ONE = (1.0, 1.0, 1.0)
"""Scale of a mesh that is drawn as it is."""

_GAZEBO_NAME = re.compile(r"(?<=[a-z])(?=[A-Z])")
_ODD_CHARACTER = re.compile(r"[^A-Za-z0-9_.-]")


@dataclass
class Surroundings:
    """What a link's elements refer to, and what is noticed about the links."""

    files: MeshFiles
    findings: Findings
    materials: Mapping[str, Color] = field(default_factory=dict)
    """Colours of the URDF's materials."""
    gazebo: Mapping[str, Color] = field(default_factory=dict)
    """Colours that Gazebo's tags give to links."""
    impossible: list[tuple[Node, str, float, str]] = field(default_factory=list)
    """Inertias that break the triangle inequality: element, link, how far, and in words."""


def read_link(node: Node, around: Surroundings) -> Link:
    """A `<link>`. Problems and oddities are noted, not raised."""
    name = node.name()
    short = _is_short_post(node, name)
    if short:
        around.findings.note("post", name)
    return Link(
        name=name,
        inertial=None if short else _inertial(node, name, around),
        collisions=() if short else tuple(filter(None, (_collision(c, around) for c in node.children("collision")))),
        visuals=() if short else tuple(v for c in node.children("visual") for v in _visuals(c, name, around)),
        line=node.line,
    )


def read_pose(node: Node | None) -> Pose:
    """The pose in an element's `<origin>`; what is missing is zero."""
    origin = node.child("origin") if node else None
    if origin is None:
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    x, y, z = origin.numbers("xyz", "x y z", (0.0, 0.0, 0.0), low=-1e6, high=1e6)
    roll, pitch, yaw = origin.numbers("rpy", "roll pitch yaw", (0.0, 0.0, 0.0))
    return (x, y, z, roll, pitch, yaw)


def material_colors(root: Node) -> tuple[dict[str, Color], dict[str, Color]]:
    """Colours of materials by their name, and colours that `<gazebo>` tags give to links."""
    materials, links = dict[str, Color](), dict[str, Color]()
    for element in root.element.iter("material"):
        top = element.getparent() is root.element  # problems of others are found where they are used
        node = Node(element, f"material '{element.get('name')}'", root.findings if top else Findings(""))
        name, color = node.attribute("name"), node.child("color")
        if name and color is not None:
            materials.setdefault(name, _rgba(color))
    for node in root.children("gazebo"):
        gazebo, link = _gazebo_color(node.text("material")), node.attribute("reference")
        if gazebo and link:
            links[link] = gazebo
    return materials, links


def _gazebo_color(text: str) -> Color | None:
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
        return name.endswith(POST) and mass is not None and -math.inf < float(mass.attribute("value") or 1.0) <= 0.0
    except ValueError:
        return False


def _inertial(node: Node, name: str, around: Surroundings) -> Inertial | None:
    inertial = node.child("inertial")
    if inertial is None:
        return None
    mass_node, inertia = inertial.needed("mass"), inertial.needed("inertia")
    mass = mass_node.number("value", low=0) if mass_node else math.nan
    diagonal = [inertia.number(key) if inertia else math.nan for key in ("ixx", "iyy", "izz")]
    products = [inertia.number(key, 0.0) if inertia else math.nan for key in ("ixy", "ixz", "iyz")]
    pose = read_pose(inertial)
    if not all(map(math.isfinite, (mass, *diagonal, *products))):
        return None
    if mass == 0:
        around.findings.note("massless", name)
        return None
    if inertia:
        _check_inertia(inertia, name, (mass, *diagonal, *products), around)
    xx, yy, zz, xy, xz, yz = *diagonal, *products
    return Inertial(mass, pose, (xx, yy, zz, xy, xz, yz))


def _check_inertia(node: Node, name: str, values: tuple[float, ...], around: Surroundings) -> None:
    """No principal moment is negative, and none exceeds the sum of the others, in any body that exists."""
    mass, *tensor = values
    low, middle, high = moments = _principal(tensor)
    words = ", ".join(f"{moment:.6g}" for moment in moments)
    if low < -1e-9 * abs(high):
        node.fault(f"impossible moments of inertia: about the principal axes they are {words} kg m2")
    elif high > (low + middle) * (1 + 1e-6) and (mass, *tensor[:3]) != VRX_IMU:
        excess = high / (low + middle) if low + middle > 0 else math.inf
        around.impossible.append((node, name, excess, words))


def _principal(tensor: list[float]) -> list[float]:
    xx, yy, zz, xy, xz, yz = tensor
    if xy == xz == yz == 0:
        return sorted((xx, yy, zz))
    import numpy as np

    return sorted(float(value) for value in np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _collision(node: Node, around: Surroundings) -> Shape | None:
    geometry = node.needed("geometry")
    values = _shape(node, geometry) if geometry else None
    if geometry is None or values is None:
        return None
    if values["type"] == "mesh":
        found = _mesh(geometry, values, around, collides=True)
        if found is None:
            return None
        values |= found
    return node.configured(Shape, values)


def _visuals(node: Node, link: str, around: Surroundings) -> tuple[Visual, ...]:
    """What a `<visual>` shows; one without a shape, which VRX has too, shows nothing."""
    geometry = node.child("geometry")
    values = _shape(node, geometry) if geometry else None
    if geometry is None:
        around.findings.note("shapeless", link)
    if geometry is None or values is None:
        return ()
    color = around.gazebo.get(link) or _visual_color(node, around)
    if values["type"] == "mesh":
        try:
            found = _mesh(geometry, values, around, collides=False)
        except MissingMeshError:
            file = str(values.pop("file"))
            scale = values.get("scale", ())
            instead = stand_in(file, values["pose"], color, scale if len(scale) == 3 and all(scale) else ONE)
            if not instead:
                around.findings.note("mesh", file)
            return instead
        if found is None:
            return ()
        values |= found
        color = color or values.pop("own", None)
    values.pop("own", None)
    visual = node.configured(Visual, {**values, **({"color": color} if color else {})})
    return (visual,) if visual else ()


def _visual_color(node: Node, around: Surroundings) -> Color | None:
    material = node.child("material")
    if material is None:
        return None
    color = material.child("color")
    return _rgba(color) if color else around.materials.get(material.attribute("name") or "")


def _shape(node: Node, geometry: Node) -> dict[str, Any] | None:
    """Type, sizes, pose and name of a shape; a mesh's file as it is written."""
    shapes = [Node(child, f"{geometry.path} / {child.tag}", geometry.findings) for child in geometry.element]
    if len(shapes) != 1:
        found = ", ".join(shape.tag for shape in shapes) or "nothing"
        geometry.fault(f"expected one of {', '.join(GEOMETRIES)}, got {found}")
        return None
    shape, known = shapes[0], len(geometry.findings.problems)
    if shape.tag not in GEOMETRIES:
        geometry.fault(choice(shape.tag, GEOMETRIES))
        return None
    values: dict[str, Any] = {"type": shape.tag, "pose": read_pose(node)}
    if shape.tag == "box":
        values["size"] = shape.numbers("size", "x y z", above=0)
    elif shape.tag == "mesh":
        values["file"] = shape.required("filename")
        if shape.attribute("scale") is not None:
            values["scale"] = _scale(shape)
    else:
        values["radius"] = shape.number("radius", above=0)
        if shape.tag != "sphere":
            values["length"] = shape.number("length", above=0)
    name = _ODD_CHARACTER.sub("_", node.attribute("name") or "")[:64]
    return None if len(geometry.findings.problems) > known else values | ({"name": name} if name else {})


def _scale(mesh: Node) -> tuple[float, ...]:
    """Of a mesh, along x, y and z; negative ones mirror it."""
    words = (mesh.attribute("scale") or "").split()
    scale = mesh.numbers("scale", "factor") * 3 if len(words) == 1 else mesh.numbers("scale", "x y z")
    if 0.0 in scale:
        mesh.fault("must not be 0", "scale")
    return scale


def _mesh(geometry: Node, values: Mapping[str, Any], around: Surroundings, *, collides: bool) -> dict[str, Any] | None:
    """Folder and path of a mesh, once it was found and read; None if it cannot be. Our own are known to be sound."""
    name, scale = str(values["file"]), values.get("scale", ONE)
    node = geometry.child("mesh") or geometry
    try:
        folder, path = around.files.find(name)
        if not path.lower().endswith(MESH_SUFFIXES):
            raise VrxError(f"expected a mesh that ends in {one_of(MESH_SUFFIXES)}, got {shown(name)}")
        if (folder / path).resolve().is_relative_to(root() / "assets"):
            return {"folder": folder, "file": path}
        mesh = check_mesh(folder / path, scale, collides=collides)
    except MissingMeshError as error:
        if not collides:
            raise
        node.fault(str(error), "filename")
    except VrxError as error:
        node.fault(str(error), "filename")
    else:
        return {"folder": folder, "file": path} | ({} if collides else {"own": mesh.color})
    return None
