"""Things in the water and on the shore: floating, static, jointed, courses composed of others, and fields of them."""

import contextlib
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import Config, Fault, Faults, InFolder, Only, duplicate_names, exclusive
from vrx_mj.config.docks import DockPlacement, LightConfig, PosedEntry, Symbol, dock_geometry
from vrx_mj.config.loading import Loading, document, loads, referenced_file, validate
from vrx_mj.config.search import display, kind_name
from vrx_mj.config.shapes import BuoyancyConfig, Shape, Visual
from vrx_mj.config.values import (
    Inertia,
    Name,
    NonNegative,
    NotEmpty,
    Number,
    NumberOf,
    Point,
    Pose,
    Positive,
    Switch,
    Vec3,
    demand,
    numbers,
    rising,
)
from vrx_mj.errors import UnknownNameError, VrxError, warn
from vrx_mj.frames import IDENTITY, ZERO, Vector, apply, rotation
from vrx_mj.model.kinds import Seed
from vrx_mj.model.things import Float, Follower, Rope
from vrx_mj.packages import root

MOST_LINKS = 64
"""Links of an object beside its own."""
_Ends = tuple[str, str, str]
"""Names of a joint, of the link that carries it and of the one that it moves."""
_AXES: Mapping[str, int] = {"revolute": 1, "continuous": 1, "prismatic": 1, "universal": 2, "ball": 0}
"""Number of axes of each type of joint."""


_Limits = Annotated[tuple[Number, Number], numbers("lower upper"), rising("lower", "upper")]
_POINTS = 8
"""Waypoints of a circle: VRX's follow_plugin.cc."""
_MOST_LEVELS = 8
"""Objects inside objects, nested."""
MOST_OBJECTS = 10_000
"""Single objects in a world or an object."""
_MAX_COUNT = 1000
"""Largest number of objects of a kind in a field."""


def _parallel(one: Vector, other: Vector) -> bool:
    """Whether two directions are within half a degree of each other, or of their opposites."""
    a, b = ([value / math.hypot(*axis) for value in axis] for axis in (one, other))
    return abs(sum(x * y for x, y in zip(a, b, strict=True))) > math.cos(math.radians(0.5))


class AxisConfig(Config):
    """An axis of a joint, about which the child link turns or along which it slides."""

    xyz: Annotated[Vec3, demand(lambda axis: math.hypot(*axis) >= 1e-9, "must not be zero, got {}")] = (0.0, 0.0, 1.0)
    """Direction of the axis in the joint's frame."""
    limits: _Limits | None = None
    """Lowest and highest angle [rad], or position [m] of a prismatic joint. Without limits it moves freely."""
    damping: NonNegative = 0.0
    """Damping [N m s/rad], or [N s/m] for a prismatic joint."""
    friction: NonNegative = 0.0
    """Dry friction [N m], or [N] for a prismatic joint."""
    stiffness: NonNegative = 0.0
    """Stiffness of a spring in the joint [N m/rad], or [N/m] for a prismatic joint."""
    spring_reference: Number = 0.0
    """Angle [rad] or position [m] at which the spring is at rest."""


class JointConfig(Config):
    """A joint between two links of an object, with the terms of SDF and URDF."""

    name: Name
    """Name of the joint."""
    type: Literal["revolute", "continuous", "prismatic", "universal", "ball"]
    """Kind of joint: one axis of rotation, the same without limits, one axis to slide along, two axes, or a ball."""
    parent: Name
    """Link that carries the joint."""
    child: Name
    """Link that moves."""
    pose: Pose = IDENTITY
    """Pose of the joint in the frame of the child link [m, rad]."""
    axis: AxisConfig = Field(default_factory=AxisConfig)
    """The axis. For a universal joint it is the first axis, which is fixed to the parent. For a ball joint only the
    damping is used."""
    axis2: Annotated[AxisConfig | None, Only("type", ("universal",), required=True)] = None
    """Second axis of a universal joint, which is fixed to the child."""

    @property
    def axes(self) -> tuple[AxisConfig, ...]:
        """The axes, from the parent outward; none of a ball."""
        return tuple(axis for axis in (self.axis, self.axis2) if axis)[: _AXES[self.type]]

    def _faults(self) -> Faults:
        if self.axis2 is not None and _parallel(self.axis.xyz, self.axis2.xyz):
            yield ("axis2", "xyz"), "must not be parallel to the first axis: a universal joint turns about two"
        if self.type == "continuous" and self.axis.limits is not None:
            yield ("axis", "limits"), "not allowed for a continuous joint; write `type: revolute`"
        if self.type == "ball":
            yield from ((("axis", key), "not allowed for a ball joint")
                        for key in sorted(self.axis.model_fields_set - {"damping"}))  # fmt: skip


class LinkConfig(InFolder):
    """An additional link of an object, connected by a joint."""

    name: Name
    """Name of the link."""
    pose: Pose = IDENTITY
    """Pose in the object's frame [m, rad] when its joint is at 0."""
    mass: Annotated[float, NumberOf(Float, "mass")]
    center_of_mass: Vec3 = ZERO
    """Centre of mass in the link's frame [m]."""
    inertia: Inertia
    """Ixx, Iyy, Izz, optionally followed by Ixy, Ixz, Iyz, about the centre of mass, along the link's axes [kg m2]."""
    collisions: tuple[Shape, ...] = ()
    """Shapes that boats and other objects collide with; those of one object do not collide with each other."""
    visuals: tuple[Visual, ...] = ()
    """Visible shapes."""
    buoyancy: BuoyancyConfig | None = None
    """Displacement and drag of the link; without this key water has no effect on it."""


def tree_faults(root: str, links: Sequence[str], joints: Sequence[_Ends]) -> list[Fault]:
    """Reasons why `links` are no tree on the one named `root`, at their indices and those of the joints."""
    return list(_end_faults(root, links, joints)) or list(_loose(root, links, joints))


def _end_faults(root: str, links: Sequence[str], joints: Sequence[_Ends]) -> Faults:
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
            yield ("joints", index, "child"), f"'{root}' is the root link, which has no parent; swap parent and child"
        elif child in holders:
            yield ("joints", index, "child"), f"link '{child}' is already the child of joint '{holders[child]}'"
        holders.setdefault(child, joint)


def _loose(root: str, links: Sequence[str], joints: Sequence[_Ends]) -> Faults:
    """Links without a joint, and links that hang on each other in a circle."""
    above = {child: [parent] for _, parent, child in joints}
    for index, name in enumerate(links):
        if name not in above:
            text = f"link '{name}' is not the child of a joint; only the root link '{root}' may have none"
            yield ("links", index, "name"), text
    try:
        TopologicalSorter(above).prepare()
    except CycleError as error:
        circle = error.args[1]
        index = next(index for index, (*_, child) in enumerate(joints) if child == circle[0])
        yield ("joints", index), f"the links form a loop: {' > '.join(reversed(circle))}"


def link_order(root: str, joints: Sequence[JointConfig]) -> list[str]:
    """Names of the links that hang on the one named `root`, each after the one that it hangs on."""
    order = [root]
    for name in order:
        order += [joint.child for joint in joints if joint.parent == name]
    return order[1:]


class CirclePath(Config):
    """A counter-clockwise circle around the start, as eight waypoints. The first lies to the east."""

    radius: Positive
    """Radius of the circle [m]."""


class LinePath(Config):
    """A line back and forth between the start and another position."""

    length: Positive
    """Distance between the two [m]."""
    direction: Number = 0.0
    """Direction of the other end [rad], counter-clockwise from the object's x axis at the start."""


class PathConfig(Config):
    """The path of a floating object: VRX's follow_plugin, or the TrajectoryFollower of the worlds of 2023."""

    waypoints: Annotated[tuple[Point, ...], NotEmpty] | None = None
    """Positions in the world [m]."""
    circle: CirclePath | None = None
    """A circle around the start."""
    line: LinePath | None = None
    """Back and forth along a line from the start."""
    force: Annotated[float, NumberOf(Follower, "force")] = 10.0
    torque: Annotated[float, NumberOf(Follower, "torque")] = 1.0
    bearing_tolerance: Annotated[float, NumberOf(Follower, "tolerance"), Field(le=180)] = 2.0
    """Angle off the bow beyond which it turns toward its waypoint [degrees]."""
    range_tolerance: Annotated[Positive, NumberOf(Follower, "reach")] = 0.5
    loop: Switch = True
    """Whether it continues to the first waypoint after the last one; otherwise it stays there."""
    start: Annotated[int, Field(ge=0)] = 0
    """First waypoint to go to, counted from 0."""
    turns_first: Switch | None = None
    """Whether it moves only while its waypoint is within `bearing_tolerance` of its bow; by default only in profile
    vrx3."""

    def _faults(self) -> Faults:
        yield from exclusive(self, "waypoints", "circle", "line", required=True)
        count = len(self.waypoints) if self.waypoints else _POINTS if self.circle else 2
        if self.start >= count:
            yield ("start",), f"must be below {count}, the number of waypoints, got {self.start}"


def path_points(path: PathConfig, pose: Pose) -> list[tuple[float, float]]:
    """The waypoints [m] of a thing that starts at a pose in the world, in the order in which it goes to them."""
    points = _points(path, pose)
    return [*points[path.start :], *(points[: path.start] if path.loop else ())]


def _points(path: PathConfig, pose: Pose) -> Sequence[tuple[float, float]]:
    x, y = pose[:2]
    if path.waypoints is not None:
        return path.waypoints
    if path.circle is not None:
        r, step = path.circle.radius, math.tau / _POINTS
        return [(x + r * math.cos(step * i), y + r * math.sin(step * i)) for i in range(_POINTS)]
    assert path.line is not None
    length, angle = path.line.length, path.line.direction
    ahead, left, _ = apply(rotation(*pose[3:]), (math.cos(angle), math.sin(angle), 0.0))
    return [(x, y), (x + length * ahead, y + length * left)]


_Afloat = Only("static", (False,))


class RopeConfig(Config):
    """A rope from a floating object to an anchor below its initial position."""

    length: Annotated[float, NumberOf(Rope, "length")] = 2.0
    stiffness: Annotated[Positive | None, NumberOf(Rope, "stiffness")] = None
    """Stiffness [N/m]; by default 10 N/m per kg of the object."""
    damping: Annotated[float | None, NumberOf(Rope, "damping")] = None
    """Damping [N s/m]; by default critical."""


class Placement(PosedEntry):
    """An object at a pose."""

    model: str
    """A name from `objects`, the path of a YAML or SDF file relative to this one, or Gazebo's model://NAME."""
    path: PathConfig | None = None
    """Path along which it moves; by default that of its model. With `null` it drifts."""
    symbols: tuple[Symbol, ...] = ()
    """Symbols that the placards of its docks show at the start, in the order of the placards."""
    mooring: RopeConfig | None = None
    """Mooring rope in profile `marine`, where every floating object without a path has one. With `null` it drifts."""

    @cached_property
    def config(self) -> "ObjectConfig":
        """The object model."""
        return load_object(self.model, self.folder)

    @field_validator("model")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        whole = info.context
        if isinstance(whole, Loading):
            folder = info.data.get("folder")
            whole.check(lambda: _count(referenced_file("objects", value, folder), whole))
        return value

    def _faults(self) -> Faults:
        if self.path or self.symbols or self.mooring:
            with contextlib.suppress(VrxError):  # what is wrong with the model is reported with it
                yield from _misfits(self, self.config)


class ObjectConfig(InFolder):
    """An object's file. A floating object has mass, inertia and buoyancy; a composite only has parts."""

    description: str = ""
    """Description in `vrx-mj list objects --verbose`."""
    static: Switch = False
    """Whether it is fixed to the world instead of floating."""
    link: Name = "link"
    """Name of its link, as ROS and VRX's files know it."""
    mass: Annotated[float | None, NumberOf(Float, "mass"), _Afloat] = None
    center_of_mass: Annotated[Vec3, _Afloat] = ZERO
    """Centre of mass in the link's frame [m]."""
    inertia: Annotated[Inertia | None, _Afloat] = None
    """Ixx, Iyy, Izz, optionally followed by Ixy, Ixz, Iyz, about the centre of mass, along the link's axes [kg m2]."""
    collisions: tuple[Shape, ...] = ()
    """Shapes that boats and other objects collide with."""
    visuals: tuple[Visual, ...] = ()
    """Visible shapes."""
    buoyancy: Annotated[BuoyancyConfig | None, _Afloat] = None
    """Displacement and drag; required for a floating object."""
    path: Annotated[PathConfig | None, _Afloat] = None
    """Path along which it moves, unless the world specifies another."""
    light: LightConfig | None = None
    """Panels of a light buoy."""
    links: Annotated[tuple[LinkConfig, ...], Field(max_length=MOST_LINKS)] = ()
    """Additional links, each connected by a joint."""
    joints: tuple[JointConfig, ...] = ()
    """Joints that connect the links to each other and to the object's own link."""
    objects: tuple[Placement, ...] = ()
    """Objects of which this one consists."""
    docks: tuple[DockPlacement, ...] = ()
    """Docks of which this object consists."""

    @property
    def kind(self) -> Literal["floating", "static", "composite"]:
        """Whether it floats, is static, or is made of other objects."""
        if self.objects or self.docks:
            return "composite"
        return "static" if self.static else "floating"

    @property
    def whole_mass(self) -> float:
        """Mass of all its links [kg]."""
        return (self.mass or 0.0) + sum(link.mass for link in self.links)

    def _faults(self) -> list[Fault]:
        found = {"composite": _composite, "static": lambda _: [], "floating": _floating}[self.kind](self) + _unlit(self)
        if self.kind != "composite":
            found += duplicate_names(links=self.links) + duplicate_names(joints=self.joints)
            ends = [(joint.name, joint.parent, joint.child) for joint in self.joints]
            found += tree_faults(self.link, [link.name for link in self.links], ends)
        return found or duplicate_names(objects=self.objects, docks=self.docks)


def _composite(thing: ObjectConfig) -> list[Fault]:
    body = sorted(thing.model_fields_set - {"folder", "description", "objects", "docks"})
    return [((key,), "not allowed: an object made of `objects` or `docks` has no body of its own") for key in body]


def _floating(thing: ObjectConfig) -> list[Fault]:
    needs = "required for a floating object; for a fixed one write `static: true`"
    wet = any(link.buoyancy for link in thing.links)
    keys = ("mass", "inertia") if wet else ("mass", "inertia", "buoyancy")
    return [((key,), needs) for key in keys if getattr(thing, key) is None]


def _unlit(thing: ObjectConfig) -> list[Fault]:
    panels = thing.light.panels if thing.light else ()
    known = [visual.name for visual in thing.visuals if visual.name]
    wrong = [(index, name) for index, name in enumerate(panels) if name not in known]
    return [(("light", "panels", index), str(UnknownNameError("visual", name, known))) for index, name in wrong]


def load_object(name: str, near: Path | None = None) -> ObjectConfig:
    """The object model of a name, or of a path relative to the folder `near`."""
    file = referenced_file("objects", name, near)
    return _PACKAGED.get(file) or _checked(file, Loading((file.resolve(),)))


_PACKAGED: dict[Path, ObjectConfig] = {}
"""Single objects of the package's own, whose files do not change while it runs; parts of composites may."""


def _checked(file: Path, loading: Loading) -> ObjectConfig:
    found = validate(ObjectConfig, document("objects", file)[0], loading)
    if found.kind != "composite" and file.is_relative_to(root() / "assets"):
        _PACKAGED[file] = found
    return found


def _misfits(item: Placement, model: ObjectConfig) -> Faults:
    """A path, symbols or a rope that an object model has no use for."""
    if item.path and model.kind != "floating":
        yield ("path",), f"'{item.model}' does not float, so it cannot follow a path"
    count = sum(len(dock_geometry(dock).placards) for dock in model.docks) if item.symbols else 0
    if len(item.symbols) > count:
        yield ("symbols",), f"{len(item.symbols)} symbols; '{item.model}' has {count} placard{'s' * (count != 1)}"
    if item.mooring and not _drifts(item):
        yield ("mooring",), f"has no effect: '{item.model}' does not float, or follows a path"


def _drifts(item: Placement) -> bool:
    """Whether an object, or a part of it, floats without a path."""
    thing = item.config
    path = item.path if "path" in item.model_fields_set else thing.path
    return any(map(_drifts, thing.objects)) or (thing.kind == "floating" and path is None)


def _count(file: Path, whole: Loading) -> None:
    """Checks an object's file, once in a load, and counts the single objects in it as part of the whole."""
    key = file.resolve()
    if key in whole.chain:
        chain = (*whole.chain[whole.chain.index(key) :], key)
        names = " > ".join(step.parent.name if step.name.startswith("model.") else step.stem for step in chain)
        raise VrxError(f"this object contains itself: {names}")
    if len(whole.chain) >= _MOST_LEVELS:
        raise VrxError(f"objects are nested more than {_MOST_LEVELS} levels deep")
    if key not in whole.counts:
        whole.counts[key] = 1
        part = Loading((*whole.chain, key), whole.counts)
        _warn_if_it_sinks(_PACKAGED.get(file) or _checked(file, part), file)
        whole.counts[key] = max(part.count, 1)
    before, whole.count = whole.count, whole.count + whole.counts[key]
    if before <= MOST_OBJECTS < whole.count:
        raise VrxError(f"more than {MOST_OBJECTS} objects, including those in objects")


def _warn_if_it_sinks(thing: ObjectConfig, file: Path) -> None:
    if thing.kind != "floating":
        return
    wet = [part for part in (thing.buoyancy, *(link.buoyancy for link in thing.links)) if part]
    displaced = sum(part.fluid_density * sum(element.volume for element in part.elements) for part in wet)
    if (mass := thing.whole_mass) > displaced:
        text = f"{display(file)}: sinks: mass {mass:g} kg; its buoyancy displaces at most {displaced:g} kg"
        warn(text, 2)


def _must_be_single(model: str, near: Path | None) -> None:
    if load_object(model, near).kind == "composite":
        raise VrxError(f"'{model}' is made of other objects; a field needs single objects")


class FieldKind(InFolder):
    """Objects of one kind in a field."""

    model: Annotated[str, loads(_must_be_single)]
    """A name from `objects`, or the path of a YAML file relative to this one."""
    count: Annotated[int, Field(ge=1, le=_MAX_COUNT)]
    """Number of these objects."""
    name: Name | None = None
    """Prefix of their names, followed by a number; by default the name of the model."""

    @property
    def stem(self) -> str:
        """Beginning of their names."""
        return self.name or kind_name(self.model)


class FieldConfig(Config):
    """Objects at random positions in a square, not too near each other, boats at their start, others and the shore."""

    name: Name
    """Name of the field."""
    objects: Annotated[tuple[FieldKind, ...], NotEmpty]
    """Kinds of objects in the field, and the number of each."""
    size: Positive = 40.0
    """Edge of the square [m], along the world's axes."""
    center: Point = (0.0, 0.0)
    """Centre of the square in the world [m]."""
    min_distance: NonNegative = 5.0
    """Minimum distance between the objects' origins, and from them to the origins of other things, to docks and to the
    shore [m]."""
    seed: Seed | None = None
    """Seed of the positions; by default the seed in the world's file, so that all runs of a world have the same
    field."""
