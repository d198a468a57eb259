"""Poses of objects that are relative to frames, links, joints or other models, as poses in the usual frames."""

import math
import re
from dataclasses import dataclass, replace

from vrx_mj.config.wording import shown
from vrx_mj.formats.gazebo.document import Element
from vrx_mj.formats.gazebo.sdf_frames import MODEL, NESTED, Frames, Given, Scope
from vrx_mj.formats.series.pieces import At
from vrx_mj.formats.urdf.model import ZERO, relative
from vrx_mj.frames import Pose, compose

MODELS = {"include", "model"}
"""Tags of models in a model or a world."""
WORLD = "world"
"""Name of the frame of the world."""


def safe_name(name: str) -> str:
    """A name as ours may be: any other character becomes `_`."""
    return re.sub(r"[^A-Za-z0-9_.-]|^[.-]", "_", name)[:64] or "model"


def pose_of(element: Element) -> At:
    """The pose of a model, a link or a shape; angles are in degrees where SDF says so."""
    found = element.child("pose")
    if found is None or not found.own_text:
        return At(list(ZERO), element.place)
    frame = found.attributes.get("relative_to") or found.attributes.get("frame") or ""
    if frame not in {"", "world", "__model__"}:
        raise found.fault(f"a pose relative to {shown(frame)} cannot be taken over: give it in the frame of the model")
    pose = found.read_numbers("x y z roll pitch yaw")
    if found.attribute_switch("degrees"):
        pose[3:] = map(math.radians, pose[3:])
    return At(pose, found.place)


@dataclass(frozen=True)
class _Raising:
    """An element whose faults are raised."""

    element: Element

    def fault(self, message: str, key: str = "") -> None:
        """Raise a ConfigError at the element."""
        raise self.element.fault(message, key)


def in_usual_frames(model: Element) -> Element:
    """A model with the pose of each link in the frame of its model, and of each thing on a link in that of the link.

    Raises:
        ConfigError: a pose is relative to what is not there, or to itself.
    """
    if not any(one.tag == "pose" and _frame(one) for one in model.walk()):
        return model
    frames = Frames()
    _gather(frames, model, Scope())
    return _rewritten(frames, model, Scope())


def in_world_frame(world: Element) -> Element:
    """A world with the pose of each of its models in the frame of the world.

    Raises:
        ConfigError: a pose is relative to what is not there, or to itself.
    """
    if not any(_frame(child.child("pose")) for child in world.children if child.tag in MODELS):
        return world
    frames, scope = Frames(), Scope()
    _gather(frames, world, scope)
    children = (
        _posed(child, _inside(frames, child, inner_scope(scope, child).model, scope)) if child.tag in MODELS else child
        for child in world.children
    )
    return replace(world, children=tuple(children))


class ModelFrames:
    """Where the frames of a model are, in the model."""

    def __init__(self, model: Element) -> None:
        self._frames = Frames()
        _gather(self._frames, model, Scope())

    def joint(self, joint: Element, scope: Scope) -> Pose:
        """The pose of a joint, which is in the frame of its child unless it gives another. Raises ConfigError."""
        given, child = _given(joint), joint.text("child")
        around = given.relative_to or ("" if child == WORLD else child)
        frame = self._frames.known(scope.name(around), given) if around else MODEL
        return compose(self._frames.pose(frame), given.pose)

    def named(self, element: Element, name: str, scope: Scope) -> Pose:
        """The pose of the frame of a name, which an element gives. Raises ConfigError."""
        return self._frames.pose(self._frames.known(scope.name(name), Given(ZERO, name, _Raising(element))))

    def model(self, scope: Scope) -> Pose:
        """The pose of a model in the outermost one."""
        return self._frames.pose(scope.model)


def _frame(pose: Element | None) -> str:
    """The frame that a pose names; empty for the usual one."""
    found = pose.attributes if pose else {}
    name = found.get("relative_to") or found.get("frame") or ""
    return "" if name == WORLD else name


def _given(element: Element) -> Given:
    pose = element.child("pose")
    own: Pose = ZERO
    if pose is not None and pose.own_text:
        x, y, z, *turn = pose.read_numbers("x y z roll pitch yaw")
        degrees = pose.attribute_switch("degrees")
        roll, pitch, yaw = (math.radians(angle) for angle in turn) if degrees else turn
        own = x, y, z, roll, pitch, yaw
    return Given(own, _frame(pose), _Raising(pose or element))


def _gather(frames: Frames, model: Element, scope: Scope) -> None:
    """Take in the frames of a model, and of the models in it."""
    for child in model.children:
        name = scope.name(child.attributes.get("name", ""))
        if child.tag == "link":
            frames.add(name, _given(child), scope, scope.model)
        elif child.tag == "frame":
            to = child.attributes.get("attached_to") or MODEL
            frames.add(name, _given(child), scope, scope.name(MODEL if to == WORLD else to))
        elif child.tag == "joint":
            frames.add(name, _given(child), scope, scope.name(child.text("child")))
        elif child.tag in MODELS:
            inner = inner_scope(scope, child)
            frames.add(inner.model, _given(child), scope, scope.model)
            _gather(frames, child, inner)


def inner_scope(scope: Scope, model: Element) -> Scope:
    """The scope of a model in another."""
    name = model.attributes.get("name") or model.text("name") or model.text("uri").rpartition("/")[2]
    prefix = f"{scope.prefix}{name}{NESTED}"
    return Scope(prefix, f"{prefix}{MODEL}")


def _rewritten(frames: Frames, model: Element, scope: Scope) -> Element:
    children = []
    for child in model.children:
        made = child
        if child.tag == "link":
            name = scope.name(child.attributes.get("name", ""))
            parts = tuple(_posed(part, _on_link(frames, part, name, scope)) for part in child.children)
            made = _posed(replace(child, children=parts), _inside(frames, child, name, scope))
        elif child.tag in MODELS:
            inner = inner_scope(scope, child)
            made = _posed(_rewritten(frames, child, inner), _inside(frames, child, inner.model, scope))
        children.append(made)
    return replace(model, children=tuple(children))


def _inside(frames: Frames, element: Element, name: str, scope: Scope) -> Pose | None:
    """The pose of a link or a model in its model; None: the file gives it so."""
    if not _frame(element.child("pose")):
        return None
    return relative(frames.pose(scope.model), frames.pose(name))


def _on_link(frames: Frames, part: Element, link: str, scope: Scope) -> Pose | None:
    """The pose of a thing on a link in the link's frame; None: the file gives it so."""
    if not _frame(part.child("pose")):
        return None
    given = _given(part)
    frame = frames.known(scope.name(given.relative_to), given)
    return compose(relative(frames.pose(link), frames.pose(frame)), given.pose)


def _posed(element: Element, pose: Pose | None) -> Element:
    """The element with another pose."""
    if pose is None:
        return element
    text = " ".join(map(repr, pose))
    children = (replace(one, attributes={}, own_text=text) if one.tag == "pose" else one for one in element.children)
    return replace(element, children=tuple(children))
