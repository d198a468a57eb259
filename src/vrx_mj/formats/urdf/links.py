"""Links and joints of a URDF; VRX's meshes, which are not ours to ship, have stand-ins."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from vrx_mj.config.base import COLORS
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.wording import choice
from vrx_mj.errors import Problem, UnknownNameError, VrxError
from vrx_mj.formats.urdf.elements import Findings, Node
from vrx_mj.formats.urdf.meshes import MeshFiles, MissingMeshError, check_mesh
from vrx_mj.formats.urdf.model import Inertial, Joint, Limits, Link, chained
from vrx_mj.frames import Pose, compose, facing, inverse
from vrx_mj.resources import root

Color = tuple[float, float, float, float]
Scale = tuple[float, float, float]

IDENTITY: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

STAND_INS: dict[str, tuple[Pose, dict[str, Color]]] = {
    "WAM-V-Base.dae": (
        IDENTITY,
        {
            "hulls": (0.74, 0.75, 0.76, 1.0),
            "trim": (0.23, 0.25, 0.28, 1.0),
            "arches": (0.11, 0.12, 0.13, 1.0),
            "deck": (0.60, 0.62, 0.64, 1.0),
        },
    ),
    "engine.dae": (IDENTITY, {"engine": (0.16, 0.17, 0.19, 1.0)}),
    "propeller.dae": (IDENTITY, {"propeller": (0.78, 0.33, 0.12, 1.0)}),
    "battery.dae": ((0, -1.03, -0.45, 0, 0, 0), {"battery": (0.36, 0.38, 0.41, 1.0)}),
    "cpu_cases.dae": (
        (0.073, 0, -1.53, 0, 0, 0),
        {"cpu_cases": (0.17, 0.18, 0.19, 1.0), "cpu_fittings": (0.62, 0.64, 0.66, 1.0)},
    ),
    "gps.dae": (IDENTITY, {"gps": (0.86, 0.87, 0.85, 1.0)}),
    "3d_lidar.dae": ((0, 0, -0.035, 0, 0, 0), {"lidar": (0.27, 0.28, 0.30, 1.0)}),
    "mono_camera.dae": ((-0.033, 0, 0, 0, 0, math.pi / 2), {"camera": (0.13, 0.14, 0.15, 1.0)}),
    "sensor_post_arm.dae": (
        (-0.038, 0, -0.003, math.radians(-60), 0, -math.pi / 2),
        {"post_arm": (0.06, 0.06, 0.07, 1.0)},
    ),
    "ball_shooter_base.dae": (IDENTITY, {"shooter_base": (0.35, 0.37, 0.40, 1.0)}),
    "ball_shooter_launcher.dae": ((0, 0, 0, 0, 0.261799, 0), {"shooter_launcher": (0.85, 0.48, 0.10, 1.0)}),
}
"""Place of each of VRX's meshes in its link, and our meshes for it with their colours, by the name of VRX's file."""


def stand_in(name: str, pose: Pose, color: Color | None, scale: Scale = (1.0, 1.0, 1.0)) -> tuple[Visual, ...]:
    """What is drawn where a URDF wants a mesh of VRX, which it names by this path; nothing for other meshes.

    `pose` is where the URDF draws the mesh in its link, `scale` how large; `color` is what it asks for, if it does.
    A scale that is not the same along all axes is only right for a mesh that VRX draws unturned.
    """
    file = PurePosixPath(name).name
    if file not in STAND_INS:
        return ()
    drawn, meshes = STAND_INS[file]
    x, y, z, *turn = inverse(drawn)
    place = chained(pose, (x * scale[0], y * scale[1], z * scale[2], *turn))  # type: ignore[arg-type]
    folder = root() / "assets" / "robots" / "wamv"
    return tuple(
        Visual(folder=folder, type="mesh", file=f"meshes/{mesh}.obj", pose=place, scale=scale, color=color or own)
        for mesh, own in meshes.items()
    )


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
    """A `<link>`. Problems and suspicious values are noted, not raised."""
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
        check_inertia(inertia, name, (mass, *diagonal, *products), around)
    xx, yy, zz, xy, xz, yz = *diagonal, *products
    return Inertial(mass, pose, (xx, yy, zz, xy, xz, yz))


def check_inertia(node: Node, name: str, values: tuple[float, ...], around: Surroundings) -> None:
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
    return collision_of(node, geometry, values, around) if geometry and values else None


def collision_of(node: Node, geometry: Node, values: dict[str, Any], around: Surroundings) -> Shape | None:
    """A shape that collides, of these values; a mesh is looked for and read."""
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
    return visuals_of(node, geometry, values, around.gazebo.get(link) or _visual_color(node, around), around)


def visuals_of(
    node: Node, geometry: Node, values: dict[str, Any], color: Color | None, around: Surroundings
) -> tuple[Visual, ...]:
    """What is seen of a shape of these values; a mesh that is missing is drawn by ours for it, if there are any."""
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
    return None if len(geometry.findings.problems) > known else values | shape_name(node)


def shape_name(node: Node) -> dict[str, str]:
    """The name of a shape as ours may be; nothing without one."""
    name = _ODD_CHARACTER.sub("_", node.attribute("name") or "")[:64]
    return {"name": name} if name else {}


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
    key = "uri" if node.child("uri") else "filename"
    try:
        folder, path = around.files.find(name)
        if (folder / path).resolve().is_relative_to(root() / "assets"):
            return {"folder": folder, "file": path}
        if collides:
            check_mesh(folder / path, scale, collides=True)
            return {"folder": folder, "file": path}
        return _seen_mesh(folder, path, scale, around)
    except MissingMeshError as error:
        if not collides:
            raise
        node.fault(str(error), key)
    except VrxError as error:
        node.fault(str(error), key)
    return None


def _seen_mesh(folder: Path, path: str, scale: Scale, around: Surroundings) -> dict[str, Any] | None:
    """Folder, path and colour of a mesh that is only looked at; None, with a note, if it cannot be read."""
    try:
        return {"folder": folder, "file": path, "own": check_mesh(folder / path, scale).color}
    except VrxError as error:
        around.findings.note("unread", str(error).removeprefix("mesh "))
        return None


TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating", "planar")
BOUNDED = ("revolute", "prismatic")


def read_joint(node: Node, links: Collection[str]) -> Joint:
    """A `<joint>` between two of these links. Problems and suspicious values are noted, not raised."""
    name, kind = node.name(), node.attribute("type") or ""
    if kind not in TYPES:
        node.fault(choice(kind, TYPES) if kind else f"required, but missing; one of {', '.join(TYPES)}", "type")
    parent, child = (_end(node, tag, links) for tag in ("parent", "child"))
    if parent and parent == child:
        node.fault(f"joins the link '{parent}' to itself")
    if node.child("mimic"):
        node.findings.note("mimic", name)
    axis, limits = _axis(node, kind), _limits(node, kind)
    rest = min(max(0.0, limits.lower), limits.upper) if limits and kind in BOUNDED else 0.0
    return Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        pose=at_rest(read_pose(node), kind, axis, rest),
        axis=axis,
        limits=limits,
        line=node.line,
        rest=rest,
    )


def at_rest(pose: Pose, kind: str, axis: Sequence[float], rest: float) -> Pose:
    """The pose of the child in the parent with the joint at `rest` [rad or m]."""
    if rest == 0.0:
        return pose
    if kind == "prismatic":
        x, y, z = (rest * value for value in axis)
        return compose(pose, (x, y, z, 0.0, 0.0, 0.0))
    turn = facing(axis)
    return compose(pose, compose(compose(turn, (0.0, 0.0, 0.0, 0.0, 0.0, rest)), inverse(turn)))


def root_of(links: Mapping[str, Link] | Mapping[str, Node], joints: Mapping[str, Joint], findings: Findings) -> str:
    """The one link that is no joint's child, if the links hang together as a tree under it."""
    above: dict[str, Joint] = {}
    for joint in joints.values():
        if joint.child in above:
            other = above[joint.child].name
            message = f"the link '{joint.child}' is already the child of the joint '{other}'; it has one parent"
            findings.problems.append(Problem(findings.file, joint.line, None, f"joint '{joint.name}'", message))
        above.setdefault(joint.child, joint)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        names = ", ".join(f"'{name}'" for name in roots[:8]) + (f" and {len(roots) - 8} more" if len(roots) > 8 else "")
        message = f"{len(roots)} links are not a joint's child: {names}; there must be one, the root"
        findings.problems.append(Problem(findings.file, links[roots[1]].line, None, f"link '{roots[1]}'", message))
    loop = _loop(links, above)
    if loop:
        line = above[loop[0]].line
        message = "the joints form a loop: " + " > ".join(f"'{name}'" for name in (*loop, loop[0]))
        findings.problems.append(Problem(findings.file, line, None, f"joint '{above[loop[0]].name}'", message))
    return roots[0] if roots else ""


def _loop(links: Collection[str], above: Mapping[str, Joint]) -> list[str]:
    """Links, parents first, that are each other's ancestors; empty if there are none."""
    safe: set[str] = set()
    for start in links:
        link, path = start, dict[str, None]()
        while link in above and link not in safe and link not in path:
            path[link] = None
            link = above[link].parent
        if link in path:
            names = list(path)
            return names[names.index(link) :][::-1]
        safe.update(path)
    return []


def _end(node: Node, tag: str, links: Collection[str]) -> str:
    end = node.needed(tag)
    name = end.required("link") if end else ""
    if end and name and name not in links:
        end.fault(str(UnknownNameError("link", name, links)), "link")
    return name


def _axis(node: Node, kind: str) -> tuple[float, float, float]:
    """Direction of the joint's axis, of length 1."""
    axis = node.child("axis")
    x, y, z = axis.numbers("xyz", "x y z", (1.0, 0.0, 0.0)) if axis else (1.0, 0.0, 0.0)
    if axis and not (x or y or z) and kind not in {"fixed", "floating"}:
        axis.fault("must have a length, got '0 0 0'", "xyz")
    return length_one((x, y, z))


def length_one(axis: tuple[float, float, float]) -> tuple[float, float, float]:
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
    lower, upper = (limit.number(key, 0.0) for key in ("lower", "upper"))
    effort, velocity = (limit.number(key, 0.0, low=0) for key in ("effort", "velocity"))
    if kind in BOUNDED and lower > upper:
        limit.fault(f"lower {lower:g} is above upper {upper:g}")
    return Limits(lower, upper, effort, velocity)
