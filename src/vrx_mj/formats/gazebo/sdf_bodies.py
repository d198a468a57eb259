"""Links of a model of Gazebo as a tree of bodies on joints; links that fixed joints hold together are one body."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.formats.gazebo.sdf_frames import WORLD
from vrx_mj.formats.gazebo.sdf_joints import SdfJoint
from vrx_mj.formats.urdf.model import ZERO, LinkRow, relative
from vrx_mj.frames import Pose, compose
from vrx_mj.rigid_bodies import MassProperties, joined, posed, rigid

_LEAST = 1e-9
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
        self.places = {WORLD: ZERO, **dict(zip(self.links, places, strict=True))}
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
        self.held[root] = Body(own, ZERO)
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
    parts = [posed(rigid(own.mass, ZERO[:3], own.tensor), compose(pose, own.pose)) for own, pose in weights if own]
    if not parts:
        return None
    whole = joined(parts)
    return replace(whole, inertia=_possible(whole.inertia))


def _possible(inertia: FloatArray) -> FloatArray:
    """An inertia as MuJoCo takes it: moments that are off by rounding are the least that can exist."""
    moments, axes = np.linalg.eigh(inertia)
    if moments[2] <= 0.0:
        return inertia
    least = max(_LEAST * float(moments[2]), _LEAST)
    low, middle, high = np.maximum(moments, least)
    short = max(high - low - middle, 0.0)
    if low == moments[0] and short <= _LEAST * high:
        return inertia
    return np.asarray(axes @ np.diag([low + short, middle, high]) @ axes.T)
