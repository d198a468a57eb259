"""Frames of an SDF: where its links, joints, frames and models are, whatever each pose is relative to."""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from vrx_mj.config.wording import literal
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.gazebo.document import Element, as_node
from vrx_mj.formats.series.pieces import At
from vrx_mj.formats.urdf.elements import Node, own_name
from vrx_mj.formats.urdf.model import ZERO, relative
from vrx_mj.frames import Pose, angles, compose, rotation_matrix

MODEL = "__model__"
"""Name of a model's own frame."""
WORLD = "world"
"""Name of what does not move, and of its frame."""
_FARTHEST = 1e6
"""Largest coordinate of a pose [m]."""
NESTED = "::"
"""Separator of the name of a nested model and a name in it."""


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


class Given(NamedTuple):
    """A pose as a file gives it."""

    pose: Pose
    """[m, rad]"""
    relative_to: str
    """Name of the frame that it is in; empty: the usual one."""
    node: Node
    """Element at which its faults are."""


def given_pose(node: Node, farthest: float = _FARTHEST) -> Given:
    """The `<pose>` of an element, whose angles may be in degrees, or a quaternion of any length above 0.

    Without one nothing is moved.
    """
    found = node.child("pose")
    if found is None:
        return Given(ZERO, "", node)
    read = partial(node.values, "pose", low=-farthest, high=farthest)
    frame = found.attribute("relative_to") or found.attribute("frame") or ""
    if found.attribute("rotation_format") != "quat_xyzw":
        x, y, z, *turn = read("x y z roll pitch yaw", ZERO)
        roll, pitch, yaw = map(math.radians, turn) if found.attribute_flag("degrees") else turn
        return Given((x, y, z, roll, pitch, yaw), frame, found)
    x, y, z, *turn = read("x y z qx qy qz qw", (*ZERO, 1.0))
    length = math.hypot(*turn)
    if length == 0.0:
        found.fault("the quaternion must have a length, got '0 0 0 0'")
        return Given(ZERO, frame, found)
    matrix = rotation_matrix(np.array([turn[3], *turn[:3]]) / length)
    return Given((x, y, z, *angles(tuple(map(tuple, matrix.tolist())))), frame, found)  # type: ignore[arg-type]


def pose_of(element: Element) -> At:
    """The pose of a model in its world.

    Raises:
        ConfigError: it is wrong, or in another frame.
    """
    found = element.child("pose")
    if found is None or not found.own_text:
        return At(list(ZERO), element.place)
    given = given_pose(as_node(replace(element, children=(found,))), math.inf)
    if (base := given.relative_to) not in {"", WORLD, MODEL}:
        raise found.fault(f"a pose relative to {literal(base)} cannot be taken over: give it in the frame of the model")
    for problem in given.node.findings.problems:
        raise found.fault(problem.message, problem.key.rpartition("pose")[2].strip(" /"))
    return At(list(given.pose), found.place)


class Frames:
    """Frames by their names, with those of the models around them."""

    def __init__(self) -> None:
        self.given: dict[str, tuple[str, Given]] = {}
        """Frame that a frame's pose is in, and the pose, by its name."""
        self.found: dict[str, Pose] = {MODEL: ZERO}

    def add(self, name: str, given: Given, scope: Scope, usual: str) -> None:
        """Add a frame of a model, whose pose is in the frame `usual` unless it gives another."""
        self.given.setdefault(name, (_around(given, scope, usual), given))

    def find(self, name: str, given: Given) -> str:
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
                self.given[name][1].node.fault(f"the poses are relative to each other: {names}")
                return ZERO
            chain.append(name)
            above, given = self.given[name]
            name = self.find(above, given)
            if not name:
                return ZERO
        for one in reversed(chain):
            outer, own = self.found[name], self.given[one][1].pose
            self.found[one] = own if outer == ZERO else compose(outer, own)
            name = one
        return self.found[name]

    def place_by(self, model: str, name: str) -> None:
        """Let the pose of a model be that of a frame in it, its placement frame."""
        above, given = self.given[model]
        own, inner = self.find(name, given), ZERO
        seen = set[str]()
        while own and own != model and own not in seen:
            seen.add(own)
            around, inside = self.given[own]
            inner = compose(inside.pose, inner)
            own = self.find(around, inside)
        turned = compose(given.pose, relative(inner, ZERO)) if own == model else given.pose
        self.given[model] = above, given._replace(pose=turned)

    def placement(self, given: Given, scope: Scope, usual: str) -> Pose:
        """Where something is in the outermost model, whose pose is in the frame `usual` unless it gives another."""
        frame = self.find(_around(given, scope, usual), given)
        return compose(self.pose(frame), given.pose) if frame else ZERO

    def inside(self, node: Node, link: str, scope: Scope) -> Pose:
        """The pose of a thing on a link, in the link's frame."""
        given = given_pose(node)
        return relative(self.pose(link), self.placement(given, scope, link)) if given.relative_to else given.pose


def _display_name(name: str) -> str:
    """A frame as files name it: that of a model by the model's name."""
    return name.removesuffix(f"{NESTED}{MODEL}")


def _around(given: Given, scope: Scope, usual: str) -> str:
    """The whole name of the frame that a pose is in."""
    return usual if given.relative_to in {"", WORLD} else scope.name(given.relative_to)
