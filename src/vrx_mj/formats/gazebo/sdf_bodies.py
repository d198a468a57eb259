"""Links of a model of Gazebo as a tree of bodies on joints; links that fixed joints hold together are one body."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.formats.gazebo.sdf_frames import WORLD
from vrx_mj.formats.gazebo.sdf_joints import SdfJoint
from vrx_mj.formats.urdf.model import ZERO, LinkRow, relative
from vrx_mj.frames import Pose, compose
from vrx_mj.rigid_bodies import MassProperties, joined, posed, rigid

LEAST = 1e-9
"""Smallest share of the largest moment of inertia, or moment [kg m2], that a principal moment has in MuJoCo."""


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


@dataclass
class Tree:
    """The bodies of a model, and the joints between them."""

    bodies: list[Body]
    """All of them, the one that hangs on no other first."""
    hinges: list[Hinge]
    is_anchored: bool
    """Whether the first body does not move."""
    loose: list[str] = field(default_factory=list)
    """Links that nothing holds; they are part of the first body."""
    loops: list[SdfJoint] = field(default_factory=list)
    """Joints that would close a loop, which are open."""


def tree_of(links: Sequence[LinkRow], places: Sequence[Pose], joints: Iterable[SdfJoint]) -> Tree:
    """The links as a tree on the body that hangs on no other.

    Args:
        links: the links.
        places: pose of each in the model [m, rad].
        joints: the joints between them and to the world.
    """
    return _Growth(links, places, joints).tree()


class _Growth:
    """A tree in the making. A group is what cannot move against each other, called by one of its links."""

    def __init__(self, links: Sequence[LinkRow], places: Sequence[Pose], joints: Iterable[SdfJoint]) -> None:
        self.links = {row.link.name: row for row in links}
        self.places = {WORLD: ZERO, **dict(zip(self.links, places, strict=True))}
        self.group = {name: name for name in (WORLD, *self.links)}
        self.moving: list[SdfJoint] = []
        for joint in joints:
            if joint.holds:
                self.group[self.of(joint.child)] = self.of(joint.parent)
            else:
                self.moving.append(joint)
        self.edges: dict[str, list[SdfJoint]] = {}
        for joint in self.moving:
            for end in {self.of(joint.parent), self.of(joint.child)}:
                self.edges.setdefault(end, []).append(joint)
        self.bodies: dict[str, Body] = {}
        self.result = Tree([], [], is_anchored=False)

    def of(self, name: str) -> str:
        """The group of a link."""
        while self.group[name] != name:
            self.group[name] = self.group[self.group[name]]
            name = self.group[name]
        return name

    def tree(self) -> Tree:
        """All of it; what hangs on nothing is held to the first body."""
        world, found = self.of(WORLD), self.result
        members = [name for name in self.links if self.of(name) == world]
        found.is_anchored = bool(members) or world in self.edges
        root = world if found.is_anchored else self.top(next(iter(self.links)))
        own = next((name for name in self.links if self.of(name) == root), WORLD)
        self.bodies[root] = Body(own, ZERO)
        self.grow(root)
        for name in self.links:
            if self.of(name) not in self.bodies:
                top = self.top(name)
                found.loose.append(name)
                self.bodies[top] = self.bodies[root]
                self.grow(top)
        for name, row in self.links.items():
            body = self.bodies[self.of(name)]
            body.parts.append((row, relative(body.pose, self.places[name])))
        found.bodies = list({id(body): body for body in self.bodies.values()}.values())
        return found

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
                if self.of(end) in self.bodies:
                    self.result.loops.append(joint)
                    continue
                far = self.bodies[self.of(end)] = Body(end, self.places[end])
                self.result.hinges.append(Hinge(joint, self.bodies[group], far, is_backward))
                queue.append(self.of(end))


def mass_of(body: Body) -> MassProperties | None:
    """Mass and inertia of all links of a body together, along its axes; None without a mass."""
    parts = [
        posed(rigid(own.mass, ZERO[:3], own.tensor), compose(pose, own.pose))
        for row, pose in body.parts
        if (own := row.link.inertial)
    ]
    if not parts:
        return None
    whole = joined(parts)
    return replace(whole, inertia=_possible(whole.inertia))


def _possible(inertia: FloatArray) -> FloatArray:
    """An inertia as MuJoCo takes it: moments that are off by rounding are the least that can exist."""
    moments, axes = np.linalg.eigh(inertia)
    if moments[2] <= 0.0:
        return inertia
    least = max(LEAST * float(moments[2]), LEAST)
    low, middle, high = np.maximum(moments, least)
    short = max(high - low - middle, 0.0)
    if low == moments[0] and short <= LEAST * high:
        return inertia
    return np.asarray(axes @ np.diag([low + short, middle, high]) @ axes.T)
