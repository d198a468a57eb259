"""Links of an object that move against each other, and the joints between them: a tree from the object's own link."""

import math
from collections.abc import Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.base import Config, Fault, InFolder, Only
from vrx_mj.config.shapes import BuoyancyConfig, Shape, Visual
from vrx_mj.config.values import Inertia, Name, NonNegative, Number, Pose, Positive, Vec3, demand, numbers, rising
from vrx_mj.errors import UnknownNameError

MOST_LINKS = 64
"""Links of an object beside its own."""
_Ends = tuple[str, str, str]
"""Names of a joint, of the link that carries it and of the one that it moves."""
_AXES: Mapping[str, int] = {"revolute": 1, "continuous": 1, "prismatic": 1, "universal": 2, "ball": 0}
"""Number of axes of each type of joint."""


_Limits = Annotated[tuple[Number, Number], numbers("lower upper"), rising("lower", "upper")]


def _parallel(one: tuple[float, float, float], other: tuple[float, float, float]) -> bool:
    """Whether two directions are within half a degree of each other, or of their opposites."""
    a, b = ([value / math.hypot(*axis) for value in axis] for axis in (one, other))
    return abs(sum(x * y for x, y in zip(a, b, strict=True))) > math.cos(math.radians(0.5))


class AxisConfig(Config):
    """An axis of a joint, about which the child link turns, or along which it slides."""

    xyz: Annotated[Vec3, demand(lambda axis: math.hypot(*axis) >= 1e-9, "must have a length, got {}")] = (0.0, 0.0, 1.0)
    """Direction of the axis in the joint's frame."""
    limits: _Limits | None = None
    """Lowest and highest angle [rad] or, of a prismatic joint, position [m]; without them it moves freely."""
    damping: NonNegative = 0.0
    """Damping [N m s/rad], of a prismatic joint [N s/m]."""
    friction: NonNegative = 0.0
    """Dry friction [N m], of a prismatic joint [N]."""
    stiffness: NonNegative = 0.0
    """Stiffness of a spring in the joint [N m/rad], of a prismatic joint [N/m]."""
    spring_reference: Number = 0.0
    """Angle [rad] or position [m] at which the spring is at rest."""


class JointConfig(Config):
    """A joint between two links of an object, with the terms of SDF and URDF."""

    name: Name
    """Name of the joint."""
    type: Literal["revolute", "continuous", "prismatic", "universal", "ball"]
    """Kind of joint: one axis to turn about, the same without limits, one to slide along, two axes, or any."""
    parent: Name
    """Link that carries the joint."""
    child: Name
    """Link that moves."""
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Pose of the joint in the frame of the child link [m, rad]."""
    axis: AxisConfig = Field(default_factory=AxisConfig)
    """The axis; a universal joint's first one, which stays with the parent. Of a ball only the damping counts."""
    axis2: Annotated[AxisConfig | None, Only("type", ("universal",), required=True)] = None
    """Second axis of a universal joint, which turns with the first."""

    @property
    def axes(self) -> tuple[AxisConfig, ...]:
        """The axes, from the parent outward; none of a ball."""
        return tuple(axis for axis in (self.axis, self.axis2) if axis)[: _AXES[self.type]]

    def _faults(self) -> Iterator[Fault]:
        if self.axis2 is not None and _parallel(self.axis.xyz, self.axis2.xyz):
            yield ("axis2", "xyz"), "must not be parallel to the first axis: a universal joint turns about two"
        if self.type == "continuous" and self.axis.limits is not None:
            yield ("axis", "limits"), "not allowed for a continuous joint; write `type: revolute`"
        if self.type == "ball":
            yield from ((("axis", key), "not allowed for a ball joint")
                        for key in sorted(self.axis.model_fields_set - {"damping"}))  # fmt: skip


class LinkConfig(InFolder):
    """A link of an object beside its own, which hangs on a joint."""

    name: Name
    """Name of the link."""
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Pose in the object's frame [m, rad], where its joint is at 0."""
    mass: Positive
    """Mass [kg]."""
    center_of_mass: Vec3 = (0.0, 0.0, 0.0)
    """Centre of mass in the link's frame [m]."""
    inertia: Inertia
    """Ixx, Iyy, Izz, and Ixy, Ixz, Iyz where it has them, about the centre of mass, along the link's axes [kg m2]."""
    collisions: tuple[Shape, ...] = ()
    """Shapes that boats and other objects collide with; those of one object do not collide with each other."""
    visuals: tuple[Visual, ...] = ()
    """Shapes that are seen."""
    buoyancy: BuoyancyConfig | None = None
    """Displacement and drag of the link; without them water does nothing to it."""


def tree_faults(root: str, links: Sequence[str], joints: Sequence[_Ends]) -> list[Fault]:
    """Reasons why `links` are no tree on the one named `root`, at their indices and those of the joints."""
    return list(_end_faults(root, links, joints)) or list(_loose(root, links, joints))


def _end_faults(root: str, links: Sequence[str], joints: Sequence[_Ends]) -> Iterator[Fault]:
    known, holders = [root, *links], dict[str, str]()
    if root in links:
        yield ("links", links.index(root), "name"), f"duplicate name '{root}'"
    for index, (joint, parent, child) in enumerate(joints):
        for end, name in (("parent", parent), ("child", child)):
            if name not in known:
                yield ("joints", index, end), str(UnknownNameError("link", name, known))
        if child == parent:
            yield ("joints", index, "child"), f"joins the link '{child}' to itself"
        elif child == root:
            yield ("joints", index, "child"), f"'{root}', the root link, hangs on nothing; swap parent and child"
        elif child in holders:
            yield ("joints", index, "child"), f"link '{child}' already hangs on the joint '{holders[child]}'"
        holders.setdefault(child, joint)


def _loose(root: str, links: Sequence[str], joints: Sequence[_Ends]) -> Iterator[Fault]:
    """Links without a joint, and links that hang on each other in a circle."""
    above = {child: [parent] for _, parent, child in joints}
    for index, name in enumerate(links):
        if name not in above:
            text = f"no joint has the link '{name}' as its child; only '{root}', the root, needs none"
            yield ("links", index, "name"), text
    try:
        TopologicalSorter(above).prepare()
    except CycleError as error:
        circle = error.args[1]
        index = next(index for index, (*_, child) in enumerate(joints) if child == circle[0])
        yield ("joints", index), f"the links hang on each other in a circle: {' > '.join(reversed(circle))}"


def link_order(root: str, joints: Sequence[JointConfig]) -> list[str]:
    """Names of the links that hang on the one named `root`, each after the one that it hangs on."""
    order = [root]
    for name in order:
        order += [joint.child for joint in joints if joint.parent == name]
    return order[1:]
