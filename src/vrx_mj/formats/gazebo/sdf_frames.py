"""Frames of an SDF: where its links, joints, frames and models are, whatever each pose is relative to."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.urdf.elements import Node
from vrx_mj.formats.urdf.model import ZERO, relative
from vrx_mj.frames import Pose, angles, compose, rotation_matrix

MODEL = "__model__"
"""Name of a model's own frame."""
FARTHEST = 1e6
"""Largest coordinate of a pose [m]."""
NESTED = "::"
"""What separates the name of a model in a model from a name in it."""


@dataclass(frozen=True)
class Scope:
    """A model whose elements name each other."""

    prefix: str = ""
    """What the whole names of its elements begin with."""
    model: str = MODEL
    """Whole name of its own frame."""

    def name(self, name: str) -> str:
        """The whole name of one of its elements."""
        return self.model if name == MODEL else f"{self.prefix}{name}"


@dataclass(frozen=True)
class Given:
    """A pose as a file gives it."""

    pose: Pose
    """[m, rad]"""
    relative_to: str
    """Name of the frame that it is in; empty: the usual one."""
    node: "Faulty"
    """What a fault of it is at."""


class Faulty(Protocol):
    """What a message can be about."""

    def fault(self, message: str, key: str = "") -> None:
        """Note or raise what is wrong with it."""


def given_pose(node: Node) -> Given:
    """The `<pose>` of an element; without one nothing is moved. Angles may be in degrees, or a quaternion."""
    found = node.child("pose")
    if found is None:
        return Given(ZERO, "", node)
    frame = found.attribute("relative_to") or found.attribute("frame") or ""
    if found.attribute("rotation_format") == "quat_xyzw":
        x, y, z, *turn = node.values("pose", "x y z qx qy qz qw", (0.0,) * 6 + (1.0,), low=-FARTHEST, high=FARTHEST)
        if math.hypot(*turn) == 0.0:
            found.fault("the quaternion must have a length, got '0 0 0 0'")
            return Given(ZERO, frame, found)
        matrix = rotation_matrix(np.array([turn[3], *turn[:3]]) / math.hypot(*turn))
        return Given((x, y, z, *angles(tuple(map(tuple, matrix.tolist())))), frame, found)  # type: ignore[arg-type]
    x, y, z, *turn = node.values("pose", "x y z roll pitch yaw", ZERO, low=-FARTHEST, high=FARTHEST)
    if found.attribute_flag("degrees"):
        turn = [math.radians(angle) for angle in turn]
    return Given((x, y, z, *turn), frame, found)  # type: ignore[arg-type]


class Frames:
    """Frames by their names, with those of the models around them."""

    def __init__(self) -> None:
        self.given: dict[str, tuple[str, Given]] = {}
        """Frame that a frame's pose is in, and the pose, by its name."""
        self.found: dict[str, Pose] = {MODEL: ZERO}

    def add(self, name: str, given: Given, scope: Scope, usual: str) -> None:
        """Add a frame of a model, whose pose is in the frame `usual` unless it gives another."""
        self.given.setdefault(name, (_around(given, scope, usual), given))

    def known(self, name: str, given: Given) -> str:
        """A name, or that of the model of this name; empty, with a problem, where there is no such frame."""
        for candidate in (name, f"{name}{NESTED}{MODEL}"):
            if candidate in self.given or candidate == MODEL:
                return candidate
        given.node.fault(str(UnknownNameError("frame", name, dict.fromkeys(map(_shown, self.given)))))
        return ""

    def pose(self, name: str) -> Pose:
        """Where a frame is in the outermost model [m, rad]; there, with a problem, if it cannot be found."""
        chain: list[str] = []
        while name not in self.found:
            if name in chain:
                names = " > ".join(f"'{_shown(one)}'" for one in (*chain[chain.index(name) :], name))
                self.given[name][1].node.fault(f"the poses are relative to each other: {names}")
                return ZERO
            chain.append(name)
            above, given = self.given[name]
            name = self.known(above, given)
            if not name:
                return ZERO
        for one in reversed(chain):
            outer, own = self.found[name], self.given[one][1].pose
            self.found[one] = own if outer == ZERO else compose(outer, own)
            name = one
        return self.found[name]

    def inside(self, node: Node, link: str, scope: Scope) -> Pose:
        """The pose of a thing on a link, in the link's frame."""
        given = given_pose(node)
        if not given.relative_to:
            return given.pose
        frame = self.known(_around(given, scope, link), given)
        return compose(relative(self.pose(link), self.pose(frame)), given.pose) if frame else ZERO


def _shown(name: str) -> str:
    """A frame as files name it: that of a model by the model's name."""
    return name.removesuffix(f"{NESTED}{MODEL}")


def _around(given: Given, scope: Scope, usual: str) -> str:
    """The whole name of the frame that a pose is in."""
    return usual if given.relative_to in {"", "world"} else scope.name(given.relative_to)
