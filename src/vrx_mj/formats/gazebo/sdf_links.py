"""Links of an SDF with their masses and shapes, in the form that those of a URDF have."""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from vrx_mj.config.shapes import Shape, solid
from vrx_mj.formats.gazebo.sdf_models import Model, Scope
from vrx_mj.formats.urdf.elements import FIELDS, Node, Values
from vrx_mj.formats.urdf.links import gazebo_color, inertial_of, read_shapes, shape_name
from vrx_mj.formats.urdf.meshes import solid_mesh
from vrx_mj.formats.urdf.model import ZERO, Color, Inertial, Link, LinkRow, MeshRow
from vrx_mj.rigid_bodies import MassProperties, combine, with_pose

_UNIT = 1.0
"""Mass [kg] and moments of inertia [kg m2] of a link that gives none, by SDF."""
_WATER = 1000.0
"""Density [kg/m3] of what a shape is full of whose file gives none, by SDF."""


def read_sdf_link(model: Model, name: str) -> LinkRow:
    """A `<link>`, whose meshes are still to be found. Problems and suspicious values are noted, not raised."""
    node, scope = model.links[name]
    felt, seen = read_shapes(node, name, model.findings, partial(_shape, name, scope, model), _color)
    inertial = _inertial(node, name, scope, model, felt)
    return LinkRow(Link(name, inertial, place=node.place), tuple(row for _, row in felt), seen)


def _inertial(
    link: Node, name: str, scope: Scope, model: Model, felt: Sequence[tuple[Node, Shape | MeshRow]]
) -> Inertial | None:  # fmt: skip
    node, findings = link.child("inertial"), model.findings
    if node is None:
        findings.note("unit", name)
        return Inertial(_UNIT, model.to_urdf_frame(ZERO, name), (_UNIT, _UNIT, _UNIT, 0.0, 0.0, 0.0))
    if node.attribute_flag("auto"):
        rows = ((part, shape) for part, row in felt for shape in solid_mesh(row, model.files, findings))
        return _solid_inertial(node, list(rows))
    mass = node.value("mass", _UNIT, low=0)
    tensor = node.child("inertia")
    usual = {"ixx": _UNIT, "iyy": _UNIT, "izz": _UNIT, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    values = tuple(tensor.value(key, default) if tensor else default for key, default in usual.items())
    return inertial_of(tensor, name, (mass, *values), model.inside(node, name, scope), model.around)


def _solid_inertial(node: Node, felt: Sequence[tuple[Node, Shape]]) -> Inertial | None:
    """Mass properties of shapes that are full of something, whose density is that of each, or of the link."""
    usual = node.value("density", _WATER, above=0)
    full = (with_pose(_full(shape, part.value("density", usual, above=0)), shape.pose) for part, shape in felt)
    parts = [one for one in full if one.mass > 0.0]
    if not parts:
        node.fault("the mass is to be that of the collisions (auto), which have no volume")
        return None
    whole = combine(parts)
    (x, y, z), (xx, yy, zz, xy, xz, yz) = whole.center.tolist(), whole.tensor()
    return Inertial(whole.mass, (x, y, z, 0.0, 0.0, 0.0), (xx, yy, zz, xy, xz, yz))


def _full(shape: Shape, density: float) -> MassProperties:
    """A shape that is full of something of a density [kg/m3], in its own frame.

    The integral of r r' over a tetrahedron with one corner at 0 is det / 120 (a a' + b b' + c c' + s s'), where s is
    the sum of the others, a, b and c.
    """
    if shape.type == "mesh":
        corners = solid(shape).corners
        size, total = np.linalg.det(corners), corners.sum(axis=1)
        volume = float(size.sum()) / 6.0
        center = (size @ total) / 24.0 / (volume or 1.0)
        spread = (np.einsum("n,nki,nkj->ij", size, corners, corners) + (size * total.T) @ total) / 120.0
        spread -= volume * np.outer(center, center)
    else:
        x, y, z = shape.size or (2.0 * (shape.radius or 0.0),) * 3
        length, center = shape.length or 0.0, np.zeros(3)
        box = x * y * z if shape.type == "box" else 0.0
        tube = math.pi / 4.0 * x * y * length
        ball = math.pi / 6.0 * x * y * z if shape.type in {"sphere", "capsule", "ellipsoid"} else 0.0
        volume, across = box + tube + ball, box / 12.0 + tube / 16.0 + ball / 20.0
        apart = 3.0 / 16.0 * length * z + length**2 / 4.0  # of the halves of a capsule's ball
        along = box * z * z / 12.0 + tube * length**2 / 12.0 + ball * (z * z / 20.0 + apart)
        spread = np.diag([across * x * x, across * y * y, along])
    return MassProperties(density * volume, center, density * (np.trace(spread) * np.eye(3) - spread))


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


def _shape(link: str, scope: Scope, model: Model, node: Node, geometry: Node) -> Values | None:
    """Type, sizes, pose and name of a shape; a mesh's file as it is written. None: ours has none like it."""
    tag, known = shape_tag(geometry), len(geometry.findings.problems)
    if node.tag == "visual" and tag == "mesh" and not geometry.text("mesh"):
        model.findings.note("mesh", f"one without <uri> of '{link}'")
        model.lost.append((node, "its mesh has no <uri>"))
        return None
    if not tag:
        model.lost.append((node, "it has no geometry"))
    if tag not in SHAPES:
        return None
    values = {"type": tag, "pose": model.inside(node, link, scope), **sizes_of(geometry, tag)}
    return None if len(geometry.findings.problems) > known else values | shape_name(node)


def shape_tag(geometry: Node) -> str:
    """What a `<geometry>` is; empty if it is nothing."""
    return next((str(child.tag) for child in geometry.element), "")


def sizes_of(geometry: Node, tag: str) -> Values:
    """The sizes of a shape of a known kind."""
    kind = geometry.required_child(tag)
    assert kind is not None, "it is the element's own kind"
    if tag == "mesh":
        return _mesh(kind)
    found = kind.fields(FIELDS[tag])
    return {"size": tuple(2.0 * radius for radius in found["radii"])} if tag == "ellipsoid" else found


def _mesh(kind: Node) -> Values:
    uri = kind.required_child("uri")
    text = kind.text("uri")
    if uri and not text:
        uri.fault("must not be empty")
    scale = kind.values("scale", "x y z", (1.0, 1.0, 1.0))
    if 0.0 in scale:
        kind.fault("must not be 0", "scale")
    return {"file": text} | ({"scale": scale} if kind.child("scale") else {})


SHAPES = ("box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh")
"""Shapes of SDF that there are here."""
