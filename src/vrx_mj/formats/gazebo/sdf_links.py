"""Links and joints of an SDF in the form of a URDF's, and as a tree of bodies; fixed joints join their links."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from operator import attrgetter

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.shapes import Shape, solid
from vrx_mj.config.tree import choice
from vrx_mj.config.values import MAX_NUMBER
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.gazebo.sdf_models import MODEL, WORLD, Model, Scope, given_pose
from vrx_mj.formats.urdf.elements import FIELDS, LARGEST, Node, Values
from vrx_mj.formats.urdf.links import gazebo_color, inertial_of, length_one, read_shapes, shape_name
from vrx_mj.formats.urdf.model import Color, Inertial, Limits, Link, LinkRow, MeshRow, relative
from vrx_mj.formats.urdf.reader import solid_mesh
from vrx_mj.frames import IDENTITY, ZERO, Pose, Vector, apply, compose, rotation
from vrx_mj.rigid_bodies import MassProperties, combine, rigid, with_pose

_UNIT = 1.0
"""Mass [kg] and moments of inertia [kg m2] of a link that gives none, by SDF."""
_WATER = 1000.0
"""Density [kg/m3] of what a shape is full of whose file gives none, by SDF."""
SHAPES = ("box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh")
"""Shapes of SDF that there are here."""
_AXIS_OF_JOINT = (1, 5)
"""Version of SDF from which the axis of a joint is in the joint's frame, not in the model's."""
_FRAMES = (1, 7)
"""Version of SDF from which `expressed_in` says so, and `use_parent_model_frame` is nothing."""
_AXES = {
    "fixed": 1, "revolute": 1, "continuous": 1, "prismatic": 1, "ball": 0, "universal": 2, "screw": 1, "revolute2": 2,
    "gearbox": 1,
}  # fmt: skip
"""The types of joints of SDF, and how many axes each has."""
_UNLIMITED = ("fixed", "continuous")
"""Types of joints whose limits say nothing."""
_MIN_MOMENT = 1e-9
"""Least principal moment of inertia in MuJoCo, as a share of the largest, or [kg m2]."""


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
        return Inertial(_UNIT, model.to_urdf_frame(IDENTITY, name), (_UNIT, _UNIT, _UNIT, 0.0, 0.0, 0.0))
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
        node.fault("the mass is that of the collisions (auto), but they have no volume")
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
        model.lost.append((node, "the mesh has no <uri>"))
        return None
    if not tag:
        model.lost.append((node, "<geometry> is empty"))
    if tag not in SHAPES:
        return None
    values = {"type": tag, "pose": model.inside(node, link, scope), **sizes_of(geometry, tag)}
    return None if len(geometry.findings.problems) > known else values | shape_name(node)


def shape_tag(geometry: Node) -> str:
    """Tag of the shape in a `<geometry>`; empty without one."""
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


@dataclass(frozen=True)
class Axis:
    """An axis of a joint, about which its child turns or along which it slides."""

    xyz: Vector
    """Direction in the joint's frame, of length 1."""
    limits: Limits
    dynamics: dict[str, float]
    """Damping, friction, stiffness and spring_reference as an object has them, without those that are 0."""


@dataclass(frozen=True)
class SdfJoint:
    """A joint between two links, or a link and the world."""

    name: str
    type: str
    parent: str
    """Whole name of a link, or that of the world."""
    child: str
    place: Pose
    """Pose of its frame in the model [m, rad]."""
    shift: Pose
    """Pose of the joint's frame in that of its child [m, rad]."""
    axes: tuple[Axis, ...]
    node: Node

    @property
    def holds(self) -> bool:
        """Whether its links cannot move against each other: it is fixed, or its limits leave no room."""
        bounded = self.type in {"revolute", "prismatic"} and bool(self.axes)
        return self.type == "fixed" or (bounded and self.axes[0].limits.lower == self.axes[0].limits.upper)


def read_sdf_joint(model: Model, node: Node, scope: Scope) -> SdfJoint | None:
    """A `<joint>`; None where it does not name its ends. Problems are noted, not raised."""
    kind = node.attribute("type") or ""
    if kind not in _AXES:
        node.fault(choice(kind, tuple(_AXES)) if kind else f"required, but missing; one of {', '.join(_AXES)}", "type")
    parent, child = (_end(model, node, tag, scope) for tag in ("parent", "child"))
    if not parent or not child:
        return None
    if parent == child:
        node.fault(f"joins the link '{parent}' to itself")
    given, usual = given_pose(node), scope.name(MODEL if child == WORLD else node.text("child"))
    place = model.frames.placement(given, scope, usual)
    around = model.frames.pose(child) if child != WORLD else IDENTITY
    shift = given.pose if usual == child and not given.relative_to else relative(around, place)
    tags = ("axis", "axis2")[: _AXES.get(kind, 1)]
    axes = tuple(_axis(model, node, tag, kind, place, scope) for tag in tags)
    return SdfJoint(scope.name(node.required_attribute("name")), kind, parent, child, place, shift, axes, node)


def _end(model: Model, node: Node, tag: str, scope: Scope) -> str:
    """The link that a joint names, itself or by what is attached to it; empty, with a problem, without one."""
    end = node.required_child(tag)
    text = node.text(tag) or (end.text("link_name") if end else "")
    if end is None or text == WORLD:
        return text
    found = model.link(scope.name(text)) if text else ""
    if not found:
        end.fault(str(UnknownNameError("link", text, model.links)) if text else "must not be empty")
    return found


def _axis(model: Model, node: Node, tag: str, kind: str, place: Pose, scope: Scope) -> Axis:
    found = node.child(tag)
    if found is None:
        return Axis((0.0, 0.0, 1.0), Limits(-LARGEST, LARGEST), {})
    x, y, z = found.values("xyz", "x y z", (0.0, 0.0, 1.0))
    if not (x or y or z):
        found.fault("must not be zero, got '0 0 0'", "xyz")
    axis, frame = length_one((x, y, z)), _frame_of_axis(model, node, found, scope)
    turn = relative(place, model.frames.pose(frame)) if frame else IDENTITY
    if turn[3:] != IDENTITY[3:]:
        axis = length_one(apply(rotation(*turn[3:]), axis))
    return Axis(axis, _limits(found, kind), _dynamics(found))


def _frame_of_axis(model: Model, node: Node, axis: Node, scope: Scope) -> str:
    """The frame in which the direction of an axis is given; empty for the joint's own."""
    direction = axis.child("xyz")
    frame = (direction.attribute("expressed_in") or "") if direction else ""
    if frame:
        return model.frames.find(scope.name(frame), given_pose(node)._replace(node=node))
    older = model.version < _FRAMES and axis.flag("use_parent_model_frame", model.version < _AXIS_OF_JOINT)
    return scope.model if older else ""


def _limits(axis: Node, kind: str) -> Limits:
    """Limits of an axis; one without any turns or slides freely."""
    limit = axis.child("limit")
    if limit is None:
        return Limits(-LARGEST, LARGEST)
    lower, upper = _endless(limit, "lower", -LARGEST), _endless(limit, "upper", LARGEST)
    if kind not in _UNLIMITED and lower > upper:
        limit.fault(f"lower {lower:g} is above upper {upper:g}")
    return Limits(lower, upper, *(max(_endless(limit, tag, 0.0), 0.0) for tag in ("effort", "velocity")))


def _endless(part: Node, tag: str, usual: float, **limits: float) -> float:
    """A number that may be endless: SDF writes 1e16 or inf."""
    return min(max(part.value(tag, usual, largest=math.inf, **limits), -LARGEST), LARGEST)


def _dynamics(axis: Node) -> dict[str, float]:
    """Damping, friction and spring of an axis; what is endless, as 5e80, is the largest that there is here."""
    dynamics = axis.child("dynamics")
    if dynamics is None:
        return {}
    rows = {"damping": "damping", "friction": "friction", "spring_stiffness": "stiffness"}
    found = {ours: min(_endless(dynamics, tag, 0.0, low=0.0), MAX_NUMBER) for tag, ours in rows.items()}
    found["spring_reference"] = dynamics.value("spring_reference", 0.0)
    return {key: value for key, value in found.items() if value}


@dataclass(frozen=True)
class Body:
    """Links that move as one."""

    name: str
    """Whole name of the link that gives it its frame; that of the world for what stands in that alone."""
    pose: Pose
    """Pose in the model [m, rad]."""
    parts: list[tuple[LinkRow, Pose]] = field(default_factory=list)
    """The links, each with its pose in the body."""


@dataclass(frozen=True)
class Hinge:
    """A joint between two bodies."""

    joint: SdfJoint
    near: Body
    far: Body
    is_backward: bool
    """Whether the body that hangs on the other is the joint's parent."""


class Tree:
    """The links of a model as a tree of bodies on the one that hangs on no other.

    A group is what cannot move against each other, called by one of its links.

    Args:
        links: the links.
        places: pose of each in the model [m, rad].
        joints: the joints between them and to the world.
        is_static: whether none of them moves: all are one body in the frame of the model.
    """

    def __init__(
        self, links: Sequence[LinkRow], places: Sequence[Pose], joints: Sequence[SdfJoint], *, is_static: bool
    ) -> None:  # fmt: skip
        self.links = {row.link.name: row for row in links}
        self.places = {WORLD: IDENTITY, **dict(zip(self.links, places, strict=True))}
        self.group = {name: WORLD if is_static else name for name in (WORLD, *self.links)}
        for joint in filter(attrgetter("holds"), joints):
            self.group[self.of(joint.child)] = self.of(joint.parent)
        self.moving = [joint for joint in joints if not (joint.holds or is_static)]
        self.edges: dict[str, list[SdfJoint]] = {}
        for joint in self.moving:
            for end in {self.of(joint.parent), self.of(joint.child)}:
                self.edges.setdefault(end, []).append(joint)
        self.held: dict[str, Body] = {}
        """The body of each group."""
        self.hinges: list[Hinge] = []
        self.loose: list[str] = []
        """Links that nothing holds; they are part of the first body."""
        self.loops: list[SdfJoint] = []
        """Joints that would close a loop, which are open."""
        world = self.of(WORLD)
        self.is_anchored = world in self.edges or any(self.of(name) == world for name in self.links)
        """Whether the first body does not move."""
        self.fill(world if self.is_anchored else self.top(next(iter(self.links))))

    def of(self, name: str) -> str:
        """The group of a link."""
        while self.group[name] != name:
            self.group[name] = self.group[self.group[name]]
            name = self.group[name]
        return name

    def fill(self, root: str) -> None:
        """Make the bodies, from a group on; what hangs on nothing is held to the first body."""
        own = next((name for name in self.links if self.of(name) == root), WORLD)
        self.held[root] = Body(own, IDENTITY)
        self.grow(root)
        for name in self.links:
            if self.of(name) not in self.held:
                top = self.top(name)
                self.loose.append(name)
                self.held[top] = self.held[root]
                self.grow(top)
        for name, row in self.links.items():
            body = self.held[self.of(name)]
            body.parts.append((row, relative(body.pose, self.places[name])))
        self.bodies = list({id(body): body for body in self.held.values()}.values())
        """All of them, the one that hangs on no other first."""

    def top(self, name: str) -> str:
        """The group from which the joints lead to that of a link; that of the link in a circle."""
        above = {self.of(joint.child): self.of(joint.parent) for joint in reversed(self.moving)}
        group, seen = self.of(name), set[str]()
        while group in above and group not in seen:
            seen.add(group)
            group = above[group]
        return group

    def grow(self, root: str) -> None:
        """Add what hangs on a group by joints, whichever end of a joint is nearer."""
        queue, used = [root], set[int]()
        for group in queue:
            for joint in self.edges.get(group, []):
                if id(joint) in used:
                    continue
                used.add(id(joint))
                is_backward = self.of(joint.child) == group
                end = joint.parent if is_backward else joint.child
                if self.of(end) in self.held:
                    self.loops.append(joint)
                    continue
                far = self.held[self.of(end)] = Body(end, self.places[end])
                self.hinges.append(Hinge(joint, self.held[group], far, is_backward))
                queue.append(self.of(end))


def mass_of(body: Body) -> MassProperties | None:
    """Mass and inertia of all links of a body together, along its axes; None without a mass."""
    weights = ((row.link.inertial, pose) for row, pose in body.parts)
    parts = [with_pose(rigid(own.mass, ZERO, own.tensor), compose(pose, own.pose)) for own, pose in weights if own]
    if not parts:
        return None
    whole = combine(parts)
    return replace(whole, inertia=_possible(whole.inertia))


def _possible(inertia: FloatArray) -> FloatArray:
    """An inertia as MuJoCo takes it: moments that are off by rounding are the least that can exist."""
    moments, axes = np.linalg.eigh(inertia)
    if moments[2] <= 0.0:
        return inertia
    least = max(_MIN_MOMENT * float(moments[2]), _MIN_MOMENT)
    low, middle, high = np.maximum(moments, least)
    short = max(high - low - middle, 0.0)
    if low == moments[0] and short <= _MIN_MOMENT * high:
        return inertia
    return np.asarray(axes @ np.diag([low + short, middle, high]) @ axes.T)
