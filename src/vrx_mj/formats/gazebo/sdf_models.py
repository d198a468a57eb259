"""A model of Gazebo and the models nested in it: links, joints, frames and plugins by full names, and all poses."""

import math
import re
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vrx_mj.config.search import SCHEME, display, package_paths
from vrx_mj.config.tree import literal
from vrx_mj.config.values import MAX_COORDINATE
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError
from vrx_mj.formats.gazebo.document import Element, Report, as_node, markup
from vrx_mj.formats.gazebo.models import (
    Source,
    folder_in_reach,
    has_model,
    model_element,
    model_file,
    model_name,
    model_paths,
    uri_name,
)
from vrx_mj.formats.series.pieces import At
from vrx_mj.formats.urdf.elements import Findings, Node, own_name
from vrx_mj.formats.urdf.links import Surroundings
from vrx_mj.formats.urdf.model import relative
from vrx_mj.formats.urdf.reader import ODD, MeshFiles
from vrx_mj.formats.urdf.xml_document import Markup
from vrx_mj.frames import IDENTITY, Pose, angles, compose, inverse, rotation_matrix

MODEL = "__model__"
"""Name of a model's own frame."""
WORLD = "world"
"""Name of what does not move, and of its frame."""
NESTED = "::"
"""Separator of the name of a nested model and a name in it."""
_MAX_DEPTH = 8
"""Largest depth of models in models."""
_MOST_INCLUDES = 100
"""Models that a model may include altogether."""
_MOST_ELEMENTS = 50_000
"""Elements of all of them together."""
INSIDE = ("model", "include")
"""Tags of models in a model or a world."""
_URI = re.compile(r"(models?|file)://([^/].*)", re.DOTALL)


def safe_name(name: str) -> str:
    """A name as ours may be: any other character becomes `_`."""
    return own_name(name) or "model"


@dataclass(frozen=True)
class Scope:
    """A model whose elements name each other."""

    prefix: str = ""
    """Beginning of the whole names of its elements."""
    model: str = MODEL
    """Whole name of its own frame."""

    def name(self, name: str) -> str:
        """The whole name of one of its elements."""
        return self.model if name == MODEL else f"{self.prefix}{name}"


class GivenPose(NamedTuple):
    """A pose as a file gives it."""

    pose: Pose
    """Pose of the model [m, rad]."""
    relative_to: str
    """Name of the frame that it is in; empty: the usual one."""
    node: Node
    """Element at which its faults are."""


def given_pose(node: Node, farthest: float = MAX_COORDINATE) -> GivenPose:
    """The `<pose>` of an element, whose angles may be in degrees, or a quaternion of any length above 0.

    Without one nothing is moved.
    """
    found = node.child("pose")
    if found is None:
        return GivenPose(IDENTITY, "", node)
    read = partial(node.values, "pose", low=-farthest, high=farthest)
    frame = found.attribute("relative_to") or found.attribute("frame") or ""
    if found.attribute("rotation_format") != "quat_xyzw":
        x, y, z, *turn = read("x y z roll pitch yaw", IDENTITY)
        roll, pitch, yaw = map(math.radians, turn) if found.attribute_flag("degrees") else turn
        return GivenPose((x, y, z, roll, pitch, yaw), frame, found)
    x, y, z, *turn = read("x y z qx qy qz qw", (*IDENTITY, 1.0))
    length = math.hypot(*turn)
    if length == 0.0:
        found.fault("the quaternion must not be zero, got '0 0 0 0'")
        return GivenPose(IDENTITY, frame, found)
    matrix = rotation_matrix(np.array([turn[3], *turn[:3]]) / length)
    return GivenPose((x, y, z, *angles(tuple(map(tuple, matrix.tolist())))), frame, found)  # type: ignore[arg-type]


def pose_of(element: Element, report: Report | None = None) -> At:
    """The pose of a model in its world; a report takes that it is not read as it was meant.

    Raises:
        ConfigError: it is wrong, or in another frame.
    """
    found = element.child("pose")
    if found is None or not found.own_text:
        return At(list(IDENTITY), element.place)
    given = given_pose(as_node(replace(element, children=(found,))), math.inf)
    if (base := given.relative_to) not in {"", WORLD, MODEL}:
        raise found.fault(f"a pose relative to {literal(base)} is not supported: give it in the model's frame")
    for problem in given.node.findings.problems:
        raise found.fault(problem.message, problem.key.rpartition("pose")[2].strip(" /"))
    if report and given.node.findings.odd:
        report.note(found, "approximated", ODD["pose"], f"<pose> {literal(found.own_text)}")
    return At(list(given.pose), found.place)


class Frames:
    """Frames by their names, with those of the models around them."""

    def __init__(self) -> None:
        self.given: dict[str, tuple[str, GivenPose]] = {}
        """Frame that a frame's pose is in, and the pose, by its name."""
        self.found: dict[str, Pose] = {MODEL: IDENTITY}

    def add(self, name: str, given: GivenPose, scope: Scope, usual: str) -> None:
        """Add a frame of a model, whose pose is in the frame `usual` unless it gives another."""
        self.given.setdefault(name, (_around(given, scope, usual), given))

    def find(self, name: str, given: GivenPose) -> str:
        """A name, or that of the model of this name; empty, with a problem, where there is no such frame."""
        for candidate in (name, f"{name}{NESTED}{MODEL}"):
            if candidate in self.given or candidate == MODEL:
                return candidate
        given.node.fault(str(UnknownNameError("frame", name, dict.fromkeys(map(_display_name, self.given)))))
        return ""

    def pose(self, name: str) -> Pose:
        """Where a frame is in the outermost model [m, rad]; there, with a problem, if it cannot be found."""
        chain: list[str] = []
        while name not in self.found:
            if name in chain:
                names = " > ".join(f"'{_display_name(one)}'" for one in (*chain[chain.index(name) :], name))
                self.given[name][1].node.fault(f"poses are relative to each other in a loop: {names}")
                return IDENTITY
            chain.append(name)
            above, given = self.given[name]
            name = self.find(above, given)
            if not name:
                return IDENTITY
        for one in reversed(chain):
            outer, own = self.found[name], self.given[one][1].pose
            self.found[one] = own if outer == IDENTITY else compose(outer, own)
            name = one
        return self.found[name]

    def place_by(self, model: str, name: str) -> None:
        """Take the pose of a model for that of a frame in it, its placement frame, and move the model accordingly."""
        above, given = self.given[model]
        own, inner = self.find(name, given), IDENTITY
        seen = set[str]()
        while own and own != model and own not in seen:
            seen.add(own)
            around, inside = self.given[own]
            inner = compose(inside.pose, inner)
            own = self.find(around, inside)
        turned = compose(given.pose, relative(inner, IDENTITY)) if own == model else given.pose
        self.given[model] = above, given._replace(pose=turned)

    def placement(self, given: GivenPose, scope: Scope, usual: str) -> Pose:
        """Where something is in the outermost model, whose pose is in the frame `usual` unless it gives another."""
        frame = self.find(_around(given, scope, usual), given)
        return compose(self.pose(frame), given.pose) if frame else IDENTITY

    def inside(self, node: Node, link: str, scope: Scope) -> Pose:
        """The pose of a thing on a link, in the link's frame."""
        given = given_pose(node)
        return relative(self.pose(link), self.placement(given, scope, link)) if given.relative_to else given.pose


def _display_name(name: str) -> str:
    """A frame as files name it: that of a model by the model's name."""
    return name.removesuffix(f"{NESTED}{MODEL}")


def _around(given: GivenPose, scope: Scope, usual: str) -> str:
    """The whole name of the frame that a pose is in."""
    return usual if given.relative_to in {"", WORLD} else scope.name(given.relative_to)


class Model:
    """A model with the models in it: its elements by whole names, and its frames. Problems are noted, not raised.

    A boat is a URDF later on, in which the frame of a link is that of the joint above it: `urdf_frames` has those.
    """

    def __init__(self, source: Source) -> None:
        self.file = source.file
        self.findings = Findings(display(source.file))
        self.around = Surroundings(self.findings)
        self.version = source.version or (1, 6)
        self.frames = Frames()
        self.links: dict[str, tuple[Node, Scope]] = {}
        self.joints: list[tuple[Node, Scope]] = []
        self.plugins: list[tuple[Node, Scope]] = []
        self.attached: dict[str, str] = {}
        """Names to which frames, joints and models are attached, by their whole names."""
        self.urdf_frames: dict[str, Pose] = {}
        """Pose of a link's frame in the URDF in the link's own frame, where the two differ."""
        self.lost: list[tuple[Node, str]] = []
        """Elements that are not imported, each with the reason."""
        self.nested: list[tuple[Node, GivenPose]] = []
        """Models and includes that are direct children, with their poses."""
        self._includes = self._elements = 0
        folder = source.file.absolute().parent
        self._packages: dict[str, Path] = {}
        self.files = MeshFiles(folder, self._packages, (*package_paths(), *model_paths()))
        self.root = Node(self._tree(source.model, folder), "", self.findings)
        self._gather(self.root, Scope(), folder, 0)

    def urdf_pose(self, link: str) -> Pose:
        """Pose in the model of a link's frame in the URDF."""
        pose = self.frames.pose(link)
        return compose(pose, self.urdf_frames[link]) if link in self.urdf_frames else pose

    def inside(self, node: Node, link: str, scope: Scope) -> Pose:
        """Pose of an element on a link, in the link's frame in the URDF."""
        return self.to_urdf_frame(self.frames.inside(node, link, scope), link)

    def to_urdf_frame(self, pose: Pose, link: str) -> Pose:
        """Convert a pose in a link's own frame to its frame in the URDF."""
        return compose(inverse(self.urdf_frames[link]), pose) if link in self.urdf_frames else pose

    def link(self, name: str) -> str:
        """The link that a link, frame, joint or model of this whole name is attached to; empty without one."""
        seen = set[str]()
        while name not in self.links and name in self.attached and name not in seen:
            seen.add(name)
            name = self.attached[name]
        return name if name in self.links else ""

    def _tree(self, model: Element, folder: Path) -> Markup:
        """The elements of a model, with the URIs in them as a URDF has them."""
        own = model.attributes.get("name") or folder.name
        self._packages.setdefault(own, folder)
        self._packages.setdefault(folder.name, folder)

        def uri(text: str) -> str:
            """`model://NAME/PATH` for what is in the folder of a model, else the text itself."""
            found = _URI.fullmatch(text)
            name = found[2].partition("/")[0] if found else ""
            if found and name not in self._packages:
                place = folder_in_reach(name, folder)
                self._packages |= {name: place} if place else {}
            if found and (name in self._packages or found[1] != "file"):
                return f"{SCHEME}{found[2]}"
            inside = "://" not in text and folder != self.files.folder
            return f"{SCHEME}{own}/{text}" if inside else text

        return markup(model, uri)

    def _gather(self, model: Node, scope: Scope, folder: Path, depth: int) -> None:
        """Take in the links, joints, frames and plugins of a model, and of the models in it."""
        canonical = model.attribute("canonical_link")
        if canonical:
            self.attached[scope.model] = scope.name(canonical)
        for node in model.children("link"):
            name = scope.name(node.required_attribute("name"))
            if name in self.links:
                node.fault(f"duplicate name: line {self.links[name][0].place.line} has a link of this name")
                continue
            self.links[name] = node, scope
            self.frames.add(name, given_pose(node), scope, scope.model)
            self.attached.setdefault(scope.model, name)
        self.joints += [(node, scope) for node in model.children("joint")]
        for node in (*model.children("frame"), *model.children("joint")):
            to = node.text("child") if node.tag == "joint" else node.attribute("attached_to") or MODEL
            name, around = scope.name(node.required_attribute("name")), scope.name(MODEL if to == WORLD else to)
            self.frames.add(name, given_pose(node), scope, around)
            self.attached.setdefault(name, around)
        self.plugins += [(node, scope) for node in model.children("plugin")]
        for tag in INSIDE:
            for node in model.children(tag):
                self._gather_model(node, model, scope, folder, depth)

    def _gather_model(self, node: Node, outer: Node, scope: Scope, folder: Path, depth: int) -> None:
        """Take in a model in another, whichever of the two says how it is called and placed."""
        if depth >= _MAX_DEPTH:
            node.fault(f"models are nested more than {_MAX_DEPTH} levels deep")
            return
        included = self._included_model(node, folder) if node.tag == "include" else (node, folder)
        model, place = included or (node, folder)
        own = scope.name(node.text("name") or model.attribute("name") or node.text("uri").rpartition("/")[2])
        inner = Scope(scope.prefix if node.attribute_flag("merge") else f"{own}{NESTED}", f"{own}{NESTED}{MODEL}")
        given = given_pose(node if node.child("pose") else model)
        self.frames.add(inner.model, given, scope, scope.model)
        self.attached.setdefault(own, inner.model)
        if included:
            self.plugins += [(plugin, inner) for plugin in node.children("plugin") if node.tag == "include"]
            self._gather(model, inner, place, depth + 1)
            self.attached.setdefault(scope.model, inner.model)
        by = node.text("placement_frame") or model.attribute("placement_frame")
        if by:
            self.frames.place_by(inner.model, inner.name(by))
        if outer is self.root:
            self.nested.append((node, self.frames.given[inner.model][1] if by else given))

    def _included_model(self, include: Node, folder: Path) -> tuple[Node, Path] | None:
        """The model that an `<include>` names, and its folder."""
        self._includes += 1
        if self._includes > _MOST_INCLUDES:
            include.fault(f"more than {_MOST_INCLUDES} models in one")
            return None
        try:
            name = uri_name(include.text("uri"))
            if not has_model(name, folder):
                self.lost.append((include, f"no model named '{name}' beside the file, nor on the model path"))
                return None
            found = model_element(model_file(f"{SCHEME}{name}", folder))
        except ConfigError as error:
            self.findings.problems += error.problems
            return None
        except VrxError as error:
            include.fault(str(error), "uri")
            return None
        self._elements += sum(1 for _ in found.model.walk())
        if self._elements > _MOST_ELEMENTS:
            include.fault(f"more than {_MOST_ELEMENTS} elements in all included models")
            return None
        place = found.file.absolute().parent
        tree = self._tree(found.model, place)
        tree.set("name", include.text("name") or found.model.attributes.get("name") or name)
        include.element.append(tree)
        return Node(tree, f"model '{tree.get('name')}'", self.findings), place


def in_world_frame(world: Element, file: Path) -> list[Element | ConfigError]:
    """The elements of a world, or of a model of models, with the poses of the models among them in its own frame.

    In the place of one whose pose is relative to what is not there, or to itself, is the error.
    """
    models, found = [one for one in world.children if one.tag in INSIDE], list[Element | ConfigError](world.children)
    poses = filter(None, (one.child("pose") for one in models))
    frames = {one.attribute(key) for one in poses for key in ("relative_to", "frame")}
    placed_by = (one.attribute("placement_frame") or one.text("placement_frame") for one in models)
    if frames <= {"", WORLD} and not any(placed_by):
        return found
    model = Model(Source(world, (), file))
    given, problems = {node.element: one for node, one in model.nested}, model.findings.problems
    for number, node in enumerate(model.root.element):
        if node in given:
            problems.clear()  # of models: they are said where these are read
            pose = model.frames.placement(given[node], Scope(), MODEL)
            found[number] = ConfigError(problems[:]) if problems else _with_pose(world.children[number], pose)
    return found


def pose_of_included(include: Element, folder: Path, report: Report) -> At:
    """The pose of the model of an `<include>` in its world: its own where this gives none. Raises ConfigError."""
    if include.text("pose"):
        return pose_of(include, report)
    return pose_of(model_element(model_file(f"{SCHEME}{model_name(include)}", folder)).model, report)


def _with_pose(element: Element, pose: Pose) -> Element:
    """The element with another pose."""
    old = element.child("pose")
    made = Element("pose", (old or element).place, {}, " ".join(map(repr, pose)), ())
    rest = (child for child in element.children if child.tag not in {"pose", "placement_frame"})
    attributes = {key: value for key, value in element.attributes.items() if key != "placement_frame"}
    return replace(element, attributes=attributes, children=(made, *rest))
