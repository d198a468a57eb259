"""Links and joints of an SDF, in the form that those of a URDF have."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.wording import choice, shown
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.gazebo.sdf_frames import Frames, Scope, given_pose
from vrx_mj.formats.urdf.elements import LARGEST, Node
from vrx_mj.formats.urdf.link_meshes import seen_mesh, solid_mesh
from vrx_mj.formats.urdf.links import (
    BOUNDED,
    ENDLESS,
    Surroundings,
    check_inertia,
    freed,
    gazebo_color,
    length_one,
    shape_name,
    shape_of,
)
from vrx_mj.formats.urdf.meshes import MeshFiles
from vrx_mj.formats.urdf.model import ZERO, Inertial, Joint, Limits, Link, MeshRow, relative
from vrx_mj.frames import Pose, apply, compose, inverse, rotation

UNIT = 1.0
"""Mass [kg] and moments of inertia [kg m2] of a link that gives none, by SDF."""
WATER = 1000.0
"""Density [kg/m3] of what a shape is full of whose file gives none, by SDF."""
WORLD = "world"
"""Name of what does not move."""
AXIS_OF_JOINT = (1, 5)
"""Version of SDF from which the axis of a joint is in the joint's frame, not in the model's."""
TYPES = (
    "fixed", "revolute", "continuous", "prismatic", "ball", "universal", "screw", "revolute2", "gearbox",
)  # fmt: skip

Color = tuple[float, float, float, float]
Vector = tuple[float, float, float]


@dataclass
class Body:
    """A model being read: its frames, and where the frames of its links are moved to."""

    around: Surroundings
    files: MeshFiles
    version: tuple[int, ...]
    frames: Frames = field(default_factory=Frames)
    links: dict[str, tuple[Node, Scope]] = field(default_factory=dict)
    """Elements by their whole names."""
    attached: dict[str, tuple[str, Node]] = field(default_factory=dict)
    """What `<frame>`s are attached to, by their whole names."""
    moved: dict[str, Pose] = field(default_factory=dict)
    """Pose of the frame of a joint in that of its child link, which is there in a URDF."""

    def place(self, link: str) -> Pose:
        """Where the frame of a link is in the model, once it is that of its joint."""
        pose = self.frames.pose(link)
        return compose(pose, self.moved[link]) if link in self.moved else pose


def inside_link(body: Body, node: Node, link: str, scope: Scope) -> Pose:
    """Where a thing on a link is, in the frame that the link has in a URDF."""
    return _from_joint(body, body.frames.inside(node, link, scope), link)


def _from_joint(body: Body, pose: Pose, link: str) -> Pose:
    """A pose in a link's own frame, in the frame that the link has in a URDF."""
    return compose(inverse(body.moved[link]), pose) if link in body.moved else pose


def read_sdf_link(body: Body, name: str) -> Link:
    """A `<link>`. Problems and suspicious values are noted, not raised."""
    node, scope = body.links[name]
    findings = body.around.findings
    felt = [
        (part, shape)
        for part in node.children("collision")
        if (row := _collision(part, name, scope, body))
        for shape in solid_mesh(row, body.files, findings)
    ]
    visuals = [_visual(part, name, scope, body) for part in node.children("visual")]
    return Link(
        name=name,
        inertial=_inertial(node, name, scope, body, felt),
        collisions=tuple(shape for _, shape in felt),
        visuals=tuple(seen for row in visuals if row for seen in seen_mesh(row, body.files, findings)),
        place=node.place,
    )


def _inertial(
    link: Node, name: str, scope: Scope, body: Body, felt: Sequence[tuple[Node, Shape]]
) -> Inertial | None:  # fmt: skip
    node = link.child("inertial")
    if node is None:
        body.around.findings.note("unit", name)
        return Inertial(UNIT, _from_joint(body, ZERO, name), (UNIT, UNIT, UNIT, 0.0, 0.0, 0.0))
    if node.attribute_flag("auto"):
        return _filled(node, felt)
    if node.child("fluid_added_mass"):
        body.around.findings.note("added", name)
    mass = node.value("mass", UNIT, low=0)
    tensor = node.child("inertia")
    usual = {"ixx": UNIT, "iyy": UNIT, "izz": UNIT, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    values = tuple(tensor.value(key, default) if tensor else default for key, default in usual.items())
    if mass == 0.0:
        body.around.findings.note("massless", name)
        return None
    if tensor:
        check_inertia(tensor, name, (mass, *values), body.around)
    xx, yy, zz, xy, xz, yz = values
    return Inertial(mass, inside_link(body, node, name, scope), (xx, yy, zz, xy, xz, yz))


def _filled(node: Node, felt: Sequence[tuple[Node, Shape]]) -> Inertial | None:
    """Mass properties of shapes that are full of something, whose density is that of each, or of the link.

    The integral of r r' over a tetrahedron with one corner at 0 is det / 120 (a a' + b b' + c c' + s s'), where s is
    the sum of the others, a, b and c.
    """
    import numpy as np

    from vrx_mj.config.solids import solid

    usual = node.value("density", WATER, above=0)
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for part, shape in felt:
        density = part.value("density", usual, above=0)
        turn, place = np.array(rotation(*shape.pose[3:])), np.array(shape.pose[:3])
        corners = solid(shape).corners @ turn.T + place
        size = np.linalg.det(corners)
        total = corners.sum(axis=1)
        mass += density * float(size.sum()) / 6.0
        first += density * (size @ total) / 24.0
        second += density * (np.einsum("n,nki,nkj->ij", size, corners, corners) + (size * total.T) @ total) / 120.0
    if mass <= 0.0:
        node.fault("the mass is to be that of the collisions (auto), which have no volume")
        return None
    center = first / mass
    spread = second - mass * np.outer(center, center)
    x, y, z = map(float, center)
    xx, yy, zz = (float(value) for value in np.trace(spread) - np.diag(spread))
    xy, xz, yz = (-float(spread[index]) for index in ((0, 1), (0, 2), (1, 2)))
    return Inertial(mass, (x, y, z, 0.0, 0.0, 0.0), (xx, yy, zz, xy, xz, yz))


def _collision(node: Node, link: str, scope: Scope, body: Body) -> Shape | MeshRow | None:
    geometry = node.needed("geometry")
    values = _shape(node, geometry, link, scope, body) if geometry else None
    return shape_of(node, geometry, values, Shape) if geometry and values else None


def _visual(node: Node, link: str, scope: Scope, body: Body) -> Visual | MeshRow | None:
    geometry = node.child("geometry")
    if geometry is None:
        body.around.findings.note("shapeless", link)
        return None
    values, color = _shape(node, geometry, link, scope, body), _color(node)
    return shape_of(node, geometry, values | ({"color": color} if color else {}), Visual) if values else None


def _color(visual: Node) -> Color | None:
    """The colour of a material: its diffuse or ambient one, or that of a stock material, as Gazebo/Red."""
    material = visual.child("material")
    if material is None:
        return None
    for tag in ("diffuse", "ambient"):
        words = material.text(tag).split()
        if words:
            labels = "red green blue" if len(words) == 3 else "red green blue alpha"
            red, green, blue, *alpha = material.values(tag, labels, (0.5,) * len(labels.split()), low=0, high=1)
            return (red, green, blue, alpha[0] if alpha else 1.0)
    script = material.child("script")
    return gazebo_color(script.text("name")) if script else None


def _shape(node: Node, geometry: Node, link: str, scope: Scope, body: Body) -> dict[str, Any] | None:
    """Type, sizes, pose and name of a shape; a mesh's file as it is written. None: ours has none like it."""
    tag = next((str(child.tag) for child in geometry.element), "")
    kind, known = geometry.child(tag) if tag else None, len(geometry.findings.problems)
    if kind is None or tag not in _SIZES:
        body.around.findings.note("geometry", f"<{tag}> of '{link}'" if tag else f"one without a shape of '{link}'")
        return None
    values = {"type": tag, "pose": inside_link(body, node, link, scope), **_SIZES[tag](kind)}
    return None if len(geometry.findings.problems) > known else values | shape_name(node)


def _mesh(kind: Node) -> dict[str, Any]:
    if kind.child("submesh"):
        kind.findings.note("submesh", kind.text("uri"))
    uri = kind.needed("uri")
    text = kind.text("uri")
    if uri and not text:
        uri.fault("must not be empty")
    scale = kind.values("scale", "x y z", (1.0, 1.0, 1.0))
    if 0.0 in scale:
        kind.fault("must not be 0", "scale")
    return {"file": text} | ({"scale": scale} if kind.child("scale") else {})


_SIZES: Mapping[str, Any] = {
    "box": lambda kind: {"size": kind.values("size", "x y z", (1.0, 1.0, 1.0), above=0)},
    "sphere": lambda kind: {"radius": kind.value("radius", 1.0, above=0)},
    "cylinder": lambda kind: {
        "radius": kind.value("radius", 1.0, above=0), "length": kind.value("length", 1.0, above=0),
    },
    "capsule": lambda kind: {
        "radius": kind.value("radius", 0.5, above=0), "length": kind.value("length", 1.0, above=0),
    },
    "ellipsoid": lambda kind: {
        "size": tuple(2.0 * radius for radius in kind.values("radii", "x y z", (1.0, 1.0, 1.0), above=0)),
    },
    "mesh": _mesh,
}  # fmt: skip
"""What the shapes of SDF are here, with SDF's sizes for what a file leaves out."""


def read_sdf_joint(body: Body, node: Node, scope: Scope) -> Joint | None:
    """A `<joint>` between two links; None if it holds a link to the world. Problems are noted, not raised."""
    name, kind = scope.name(node.name()), node.attribute("type") or ""
    if kind not in TYPES:
        node.fault(choice(kind, TYPES) if kind else f"required, but missing; one of {', '.join(TYPES)}", "type")
    parent, child = (_end(body, node, tag, scope) for tag in ("parent", "child"))
    if WORLD in {parent, child} or not parent or not child:
        return None
    if parent == child:
        node.fault(f"joins the link '{parent}' to itself")
    kind, limits = freed(kind, _limits(node, kind))
    axis = _axis(body, node, name, child, scope)
    rest = min(max(0.0, limits.lower), limits.upper) if limits and kind in BOUNDED else 0.0
    return Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        pose=_between(body, parent, child),
        axis=axis,
        limits=limits,
        place=node.place,
        rest=rest,
    )


def _between(body: Body, parent: str, child: str) -> Pose:
    """Pose of a link in another's frame: as the file has it where it is given there."""
    around, given = body.frames.given[child]
    if around == parent and parent not in body.moved and child not in body.moved:
        return given.pose
    return relative(body.place(parent), body.place(child))


def _end(body: Body, node: Node, tag: str, scope: Scope) -> str:
    """The link that a joint names, itself or by a frame attached to it; empty, with a problem, without one."""
    end = node.needed(tag)
    text = node.text(tag) or (end.text("link_name") if end else "")
    if end is None or text == WORLD:
        return text
    name, seen = scope.name(text), set[str]()
    while name not in body.links and name in body.attached and name not in seen:
        seen.add(name)
        name = body.attached[name][0]
    if name in body.links:
        return name
    end.fault(str(UnknownNameError("link", text, body.links)) if text else "must not be empty")
    return ""


def _axis(body: Body, node: Node, name: str, child: str, scope: Scope) -> Vector:
    """Direction of a joint's axis in the joint's frame, of length 1."""
    found = node.child("axis")
    if found is None:
        return (0.0, 0.0, 1.0)
    x, y, z = found.values("xyz", "x y z", (0.0, 0.0, 1.0))
    if not (x or y or z):
        found.fault("must have a length, got '0 0 0'", "xyz")
    axis = length_one((x, y, z))
    direction = found.child("xyz")
    frame = (direction.attribute("expressed_in") or "") if direction else ""
    if not frame and not found.flag("use_parent_model_frame", body.version < AXIS_OF_JOINT):
        return axis
    outer = body.frames.known(scope.name(frame), given_pose(node)) if frame else scope.model
    turn = relative(body.place(child), body.frames.pose(outer)) if outer else ZERO
    return axis if turn[3:] == ZERO[3:] else length_one(apply(rotation(*turn[3:]), axis))


def _limits(node: Node, kind: str) -> Limits | None:
    """Limits of a joint; a joint without any turns or slides freely."""
    limit = node.child("axis", "limit")
    lower, upper = (_bound(limit, tag, sign) for tag, sign in (("lower", -1.0), ("upper", 1.0)))
    effort, velocity = (max(_bound(limit, tag, -1.0), 0.0) for tag in ("effort", "velocity"))
    if kind in BOUNDED and lower > upper and limit:
        limit.fault(f"lower {lower:g} is above upper {upper:g}")
    return Limits(lower, upper, *(0.0 if value >= ENDLESS else value for value in (effort, velocity)))


def _bound(limit: Node | None, tag: str, sign: float) -> float:
    """A limit; SDF writes 1e16 or inf for none."""
    node, text = (limit.child(tag), limit.text(tag)) if limit else (None, "")
    if node is None or not text:
        return sign * LARGEST
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        node.fault(f"expected a number, got {shown(text)}")
        return 0.0
    return min(max(value, -LARGEST), LARGEST)
