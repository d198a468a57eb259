"""Links of a model of Gazebo as a tree of bodies on joints; links that fixed joints hold together are one body."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.wording import choice, shown
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.gazebo.document import Element, Report
from vrx_mj.formats.gazebo.model_frames import ModelFrames, inner_scope, pose_of, safe_name
from vrx_mj.formats.gazebo.sdf_frames import MODEL, Scope
from vrx_mj.formats.series.pieces import At
from vrx_mj.formats.urdf.model import ZERO, relative
from vrx_mj.frames import Pose, apply, compose, rotation

Content = dict[str, Any]

WORLD = "world"
"""Name of what does not move."""
ENDLESS = 1e10
"""Limit of a joint [rad or m] from which it has none."""
FARTHEST = 1e9
"""Limit of a joint that has only the other one [rad or m]."""
AXIS_OF_JOINT = (1, 5)
"""Version of SDF from which the axis of a joint is in the joint's frame, not in the model's."""
TYPES = {"fixed": "fixed", "revolute": "revolute", "continuous": "continuous", "prismatic": "prismatic",
         "universal": "universal", "ball": "ball", "screw": "revolute", "revolute2": "universal",
         "gearbox": ""}  # fmt: skip
"""What the types of joints of SDF are here."""
UNIT = 1.0
"""Mass [kg] and moments of inertia [kg m2] of a link without any, by SDF."""


@dataclass(frozen=True)
class Body:
    """Links that move as one."""

    name: str
    """Name as ours may be."""
    pose: Pose
    """Pose in the model [m, rad]."""
    parts: list[tuple[Element, Pose]] = field(default_factory=list)
    """The links, each with its pose in the body."""


@dataclass(frozen=True)
class Assembly:
    """The bodies of a model, and the joints between them."""

    bodies: list[Body]
    """All of them, the one that hangs on no other first."""
    joints: list[At]
    """The joints, in the keys of an object's file."""
    is_anchored: bool
    """Whether the first body does not move."""

    @property
    def links(self) -> Iterator[tuple[Element, Body, Pose]]:
        """All links, each with its body and its pose in that."""
        return ((link, body, pose) for body in self.bodies for link, pose in body.parts)


@dataclass(frozen=True)
class _Joint:
    """A joint between two links, by their numbers; the world comes after the last link."""

    element: Element
    type: str
    ends: tuple[int, int]
    """Parent and child."""
    scope: Scope


def assembled(model: Element, given: Element, version: str, report: Report) -> Assembly:
    """The links of a model, and of the models in it, as a tree on one that hangs on no other.

    Args:
        model: in the usual frames.
        given: the same as its file has it.
        version: of its SDF.
        report: takes what became of each joint and of each link without any.

    Raises:
        ConfigError: a joint is wrong.
    """
    found = _Links(model, report)
    if not found.all:
        return Assembly([], [], is_anchored=False)
    if model.switch("static"):
        for joint, _ in found.joints:
            report.note(joint, "taken over", "the model is static")
        return Assembly([found.as_one()], [], is_anchored=True)
    return _Tree(found, ModelFrames(given), version, report).assembly()


class _Links:
    """The links of a model and of the models in it, with what is attached to them."""

    def __init__(self, model: Element, report: Report) -> None:
        self.all: list[tuple[str, Element, Pose]] = []
        """Whole name, element and pose in the model."""
        self.joints: list[tuple[Element, Scope]] = []
        self._numbers: dict[str, int] = {}
        self._attached: dict[str, str] = {}
        self._report = report
        self._gather(model, ZERO, Scope())

    def _gather(self, model: Element, place: Pose, scope: Scope) -> None:
        for link in model.all("link"):
            name, pose = scope.name(link.attributes.get("name", "")), _pose(link)
            self._numbers.setdefault(name, len(self.all))
            self._attached.setdefault(scope.model, name)
            self.all.append((name, link, pose if scope.model == MODEL else compose(place, pose)))
        for frame in model.all("frame"):
            to = frame.attributes.get("attached_to") or MODEL
            self._attached.setdefault(scope.name(frame.attributes.get("name", "")), scope.name(to))
        for joint in model.all("joint"):
            self.joints.append((joint, scope))
            self._attached.setdefault(scope.name(joint.attributes.get("name", "")), scope.name(joint.text("child")))
        for inner in model.all("model"):
            for include in inner.all("include"):
                self._report.note(include, "ignored", "a model in a model has no others in it here")
            own = inner_scope(scope, inner)
            self._gather(inner, compose(place, _pose(inner)), own)
            self._attached.setdefault(own.model.removesuffix(f"::{MODEL}"), own.model)

    def end(self, joint: Element, tag: str, scope: Scope) -> int:
        """Number of the link that a joint names, itself or by a frame; that after the last for the world."""
        given = joint.child(tag)
        text = (given.own_text or given.text("link_name")) if given else ""
        if given is None or not text:
            raise joint.fault("required, but missing", tag)
        if text == WORLD:
            return len(self.all)
        name, seen = scope.name(text), set[str]()
        while name not in self._numbers and name in self._attached and name not in seen:
            seen.add(name)
            name = self._attached[name]
        if name not in self._numbers:
            raise joint.fault(str(UnknownNameError("link", text, [known for known in self._numbers if known])), tag)
        return self._numbers[name]

    def as_one(self) -> Body:
        """All links as one body in the frame of the model."""
        return Body(safe_name(self.all[0][0]), ZERO, [(link, pose) for _, link, pose in self.all])


class _Tree:
    """A tree in the making."""

    def __init__(self, links: _Links, frames: ModelFrames, version: str, report: Report) -> None:
        self.links, self.frames, self.report = links, frames, report
        self.in_joint_frame = _version(version) >= AXIS_OF_JOINT
        self.world = len(links.all)
        self.group = list(range(self.world + 1))
        self.moving = (
            [joint for joint in map(self._joint, *zip(*links.joints, strict=True)) if joint] if links.joints else []
        )
        self.names: dict[str, set[str]] = {"link": set(), "joint": set()}
        self.bodies: dict[int, Body] = {}
        self.joints: list[At] = []

    def _joint(self, element: Element, scope: Scope) -> _Joint | None:
        """A joint that lets its links move; those of a fixed one become one group."""
        kind = element.attributes.get("type", "")
        if kind not in TYPES:
            raise element.fault(choice(kind, list(TYPES)) if kind else "required, but missing", "type")
        if not TYPES[kind]:
            self.report.note(element, "ignored", "a gearbox couples two other joints; here each moves on its own")
            return None
        parent, child = (self.links.end(element, tag, scope) for tag in ("parent", "child"))
        if parent == child:
            raise element.fault(f"joins '{element.text('child')}' to itself", "child")
        limits = _limits(element.child("axis"))
        locked = kind in {"revolute", "prismatic"} and limits is not None and limits[0] == limits[1]
        if kind == "fixed" or locked:
            where = "its links are one rigid body" if self.world not in (parent, child) else "`static`"
            self.report.note(element, "taken over", where if kind == "fixed" else f"its limits are equal: {where}")
            self.group[self._of(child)] = self._of(parent)
            return None
        return _Joint(element, kind, (parent, child), scope)

    def _of(self, number: int) -> int:
        """The group of a link, by the number of one of its links."""
        while self.group[number] != number:
            self.group[number] = self.group[self.group[number]]
            number = self.group[number]
        return number

    def assembly(self) -> Assembly:
        """The tree, with what cannot be a part of it held to its root."""
        if not self.moving and self._of(self.world) == self.world:
            self._note_loose(self.links.all[1:] if len({self._of(i) for i in range(self.world)}) > 1 else [])
        edges: dict[int, list[_Joint]] = {}
        for joint in self.moving:
            for end in {self._of(number) for number in joint.ends}:
                edges.setdefault(end, []).append(joint)
        is_anchored = self._of(self.world) != self.world or self.world in edges
        root = self._of(self.world) if is_anchored else self._top(0)
        self.bodies[root] = Body(self._root_name(root), ZERO)
        self._grow(root, edges)
        for number in range(self.world):
            if self._of(number) not in self.bodies:
                top = self._top(number)
                self._note_loose([self.links.all[number]])
                self.bodies[top] = self.bodies[root]
                self._grow(top, edges)
        for number, (_, link, pose) in enumerate(self.links.all):
            body = self.bodies[self._of(number)]
            body.parts.append((link, relative(body.pose, pose)))
        distinct = list({id(body): body for body in self.bodies.values()}.values())
        return Assembly(distinct, self.joints, is_anchored)

    def _top(self, number: int) -> int:
        """The group from which the joints lead to that of a link; that of the link in a circle."""
        above = {self._of(joint.ends[1]): self._of(joint.ends[0]) for joint in reversed(self.moving)}
        group, seen = self._of(number), set[int]()
        while group in above and group not in seen:
            seen.add(group)
            group = above[group]
        return group

    def _root_name(self, root: int) -> str:
        first = next((name for number, (name, *_) in enumerate(self.links.all) if self._of(number) == root), WORLD)
        return self._own("link", first)

    def _own(self, kind: str, name: str) -> str:
        """A name as ours may be, which no other link, or joint, of the model has."""
        own, count = safe_name(name), 1
        while own in self.names[kind]:
            count += 1
            own = f"{safe_name(name)[:56]}_{count}"
        self.names[kind].add(own)
        return own

    def _grow(self, root: int, edges: dict[int, list[_Joint]]) -> None:
        """Add what hangs on a group by joints, whichever end of a joint is nearer."""
        queue, used = [root], set[int]()
        for group in queue:
            for joint in edges.get(group, []):
                near, far = (self._of(number) for number in joint.ends)
                if id(joint) in used:
                    continue
                used.add(id(joint))
                backward = far == group
                far = near if backward else far
                if far in self.bodies:
                    text = "it would close a loop of joints, which is open here; its links move without it"
                    self.report.note(joint.element, "approximated", text)
                    continue
                self._hang(joint, group, far, backward=backward)
                queue.append(far)

    def _hang(self, joint: _Joint, near: int, far: int, *, backward: bool) -> None:
        """Add a group at the far end of a joint."""
        number = joint.ends[0 if backward else 1]
        name, _, pose = self.links.all[number] if number < self.world else (WORLD, None, ZERO)
        body = self.bodies[far] = Body(self._own("link", name), pose)
        element, kind = joint.element, TYPES[joint.type]
        place = self.frames.joint(element, joint.scope)
        axes = [
            _axis(element, tag, place, self._axis_frame(element, tag, place, joint.scope))
            for tag in ("axis", "axis2")[: {"universal": 2, "ball": 0}.get(kind, 1)]
        ]
        if backward:
            axes = [{**axis, "xyz": [-value for value in axis["xyz"]]} for axis in reversed(axes)]
        if joint.type == "continuous":
            axes = [{key: value for key, value in axis.items() if key != "limits"} for axis in axes]
        content: Content = {
            "name": self._own("joint", element.attributes.get("name", "joint")),
            "type": kind,
            "parent": self.bodies[near].name,
            "child": body.name,
            "pose": list(relative(pose, place)),
            **dict(zip(("axis", "axis2"), axes, strict=False)),
        }
        self.joints.append(At(content, element.place))
        if joint.type == kind:
            self.report.note(element, "taken over", "`joints`")
        else:
            left = ", without its thread" if joint.type == "screw" else ""
            self.report.note(element, "approximated", f"`joints`: a {kind} joint{left}")

    def _axis_frame(self, joint: Element, tag: str, place: Pose, scope: Scope) -> Pose:
        """Pose in the model of the frame in which an axis is given."""
        axis, direction = joint.child(tag), joint.child(tag, "xyz")
        named = direction.attributes.get("expressed_in", "") if direction else ""
        if named and axis:
            return self.frames.named(axis, named, scope)
        outer = axis.switch("use_parent_model_frame", not self.in_joint_frame) if axis else False
        return self.frames.model(scope) if outer else place

    def _note_loose(self, links: Sequence[tuple[str, Element, Pose]]) -> None:
        for _, link, _ in links:
            self.report.note(link, "approximated", "no joint holds it: it is part of the first link's rigid body")


def _version(text: str) -> tuple[int, ...]:
    """A version of SDF; the newest where there is none."""
    parts = [int(part) for part in text.split(".") if part.isascii() and part.isdigit() and len(part) < 9]
    return tuple(parts) or (99,)


def _axis(joint: Element, tag: str, place: Pose, given_in: Pose) -> Content:
    """An axis of a joint whose pose in the model is `place`."""
    axis = joint.child(tag)
    if axis is None:
        return {"xyz": [0.0, 0.0, 1.0]}
    xyz = axis.numbers("xyz", "x y z", (0.0, 0.0, 1.0)) or [0.0, 0.0, 1.0]
    if math.hypot(*xyz) < 1e-9:
        raise axis.fault(f"must have a length, got {shown(axis.text('xyz'))}", "xyz")
    if given_in != place:
        xyz = list(apply(rotation(*relative(place, given_in)[3:]), xyz))
    limits, dynamics = _limits(axis), axis.child("dynamics")
    found: Content = {"xyz": xyz, **({"limits": list(limits)} if limits else {})}
    names = {"damping": "damping", "friction": "friction", "spring_stiffness": "stiffness",
             "spring_reference": "spring_reference"}  # fmt: skip
    for theirs, ours in names.items():
        value = dynamics.number(theirs, 0.0) if dynamics else 0.0
        if value and value < 0.0 and ours != "spring_reference" and dynamics:
            raise dynamics.fault(f"must be at least 0, got {shown(value)}", theirs)
        found |= {ours: value} if value else {}
    return found


def _limits(axis: Element | None) -> tuple[float, float] | None:
    """Limits of an axis; None without any."""
    limit = axis.child("limit") if axis else None
    if limit is None:
        return None
    lower, upper = _bound(limit, "lower", -math.inf), _bound(limit, "upper", math.inf)
    if lower > upper:
        raise limit.fault(f"lower {lower:g} is above upper {upper:g}")
    if lower <= -ENDLESS and upper >= ENDLESS:
        return None
    return max(lower, -FARTHEST), min(upper, FARTHEST)


def _bound(limit: Element, tag: str, default: float) -> float:
    """A limit; SDF writes 1e16 or inf for none."""
    text = limit.text(tag)
    try:
        value = float(text) if text else default
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise limit.fault(f"expected a number, got {shown(text)}", tag)
    return value


@dataclass(frozen=True)
class Inertial:
    """Mass, centre of mass and inertia about it, along the axes of the body."""

    mass: float
    center: FloatArray
    inertia: FloatArray


def mass_of(body: Body) -> Inertial:
    """Mass and inertia of all links of a body together."""
    parts = [_inertial(link, pose) for link, pose in body.parts]
    mass = sum(part.mass for part in parts)
    center = sum((part.mass * part.center for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        arm = part.center - center
        inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Inertial(mass, center, inertia)


def _inertial(link: Element, pose: Pose) -> Inertial:
    inertial = link.child("inertial")
    mass = inertial.number("mass") if inertial else None
    if inertial and mass is not None and mass <= 0:
        raise inertial.fault(f"must be above 0, got {shown(mass)}", "mass")
    place = compose(pose, _pose(inertial) if inertial else ZERO)
    tensor = inertial.child("inertia") if inertial else None
    entry = {key: (tensor.number(key, float(key[1] == key[2])) if tensor else float(key[1] == key[2])) or 0.0
             for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}  # fmt: skip
    local = np.array([[entry["".join(sorted((*"i", a, b), key="ixyz".index))] for b in "xyz"] for a in "xyz"])
    turn = np.array(rotation(*place[3:]))
    return Inertial(UNIT if mass is None else mass, np.array(place[:3]), turn @ local @ turn.T)


def _pose(element: Element) -> Pose:
    x, y, z, roll, pitch, yaw = pose_of(element).value
    return x, y, z, roll, pitch, yaw
