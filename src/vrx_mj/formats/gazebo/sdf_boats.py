"""Boats written in SDF as robots: a model's links, joints, plugins and sensors; and a robot as the text of a URDF."""

from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup as Escaped

from vrx_mj.formats.gazebo.document import Element
from vrx_mj.formats.gazebo.models import model_element
from vrx_mj.formats.gazebo.sdf_links import SdfJoint, read_sdf_joint, read_sdf_link
from vrx_mj.formats.gazebo.sdf_models import WORLD, Model
from vrx_mj.formats.urdf.elements import LARGEST, Node, losses
from vrx_mj.formats.urdf.gazebo import THRUSTERS
from vrx_mj.formats.urdf.gazebo_sensors import library
from vrx_mj.formats.urdf.links import BOUNDED, ENDLESS, TYPES, free_type
from vrx_mj.formats.urdf.model import Joint, Limits, Loss, Urdf, relative
from vrx_mj.formats.urdf.reader import warn_of_oddities, with_shapes
from vrx_mj.formats.urdf.xml_document import Markup
from vrx_mj.frames import IDENTITY, Pose, compose, inverse
from vrx_mj.packages import root


def urdf_text(robot: Urdf, tags: Iterable[Node]) -> str:
    """A robot as a URDF, with Gazebo's tags and the places of its meshes.

    A joint of a kind that URDF has not, and one that does not rest at 0, is fixed in it; an ellipsoid is the box
    around it.
    """
    environment = Environment(
        loader=FileSystemLoader(root() / "templates"), trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined,
        autoescape=True, finalize=lambda value: " ".join(map(str, value)) if isinstance(value, tuple) else value,
    )  # fmt: skip
    template = environment.get_template("sdf_boat.urdf.j2")
    return template.render(robot=robot, types=TYPES, tags=[_text(tag) for tag in tags]) + "\n"


def _text(tag: Node) -> Escaped:
    element = deepcopy(tag.element)
    ET.indent(element, level=1)
    element.tail = None
    return Escaped(ET.tostring(element, encoding="unicode"))


def is_boat(model: Element) -> bool:
    """Whether a model pushes itself through the water: by a plugin for a thruster, and nothing that holds it."""
    plugins = [one for one in model.walk() if one.tag == "plugin"]
    pushes = any(library(one.attribute("filename")) in THRUSTERS or one.text("thruster/linkName") for one in plugins)
    held = (WORLD in {one.text("parent"), one.text("child")} for one in model.all("joint"))
    return pushes and not model.value_of("static", "switch") and not any(held)


def read_boat(file: Path) -> Urdf:
    """The robot that a model of Gazebo describes.

    Its frame has the axes of the model, and its origin where the root link has its own.

    Args:
        file: an SDF, the first model in which is meant, or `FILE#NAME`: the model of this name in a world.

    Raises:
        ConfigError: With everything that is wrong, each with its line and element.

    Warns:
        VrxWarning: Once for each kind of thing that is legal but suspicious.
    """
    from vrx_mj.formats.urdf.links import robot_of

    model = Model(model_element(file))
    findings = model.findings
    remarks = [Loss(node.place, node.path, text) for node, text in model.lost if node.tag == "include"]
    rows = [row for node, scope in model.joints if (row := read_sdf_joint(model, node, scope))]
    _move_frames(model, rows)
    links = {name: with_shapes(read_sdf_link(model, name), model.files, findings) for name in model.links}
    joints: dict[str, Joint] = {}
    for row in rows:
        if WORLD in {row.parent, row.child}:
            why = "the boat floats freely: a joint to the world is ignored"
            remarks.append(Loss(row.node.place, row.node.path, why))
        elif row.name in joints:
            row.node.fault(f"duplicate name: line {joints[row.name].place.line} has a joint of this name")
        else:
            joints[row.name] = _joint(model, row)
    tags = [Node(tag, "", findings) for tag in _tags(model)]
    robot = robot_of(model.root, model.file, links, joints, model.around, tags)
    findings.settle()
    warn_of_oddities(findings)
    notes = *losses(model.root.element, "model", "boat"), *remarks, *_offset(model, robot)
    return replace(robot, remarks=notes, text=urdf_text(robot, tags))


def boat_pose(pose: Pose, file: Path) -> Pose:
    """The pose of a boat whose model is at a pose; what is wrong with the model is said where it is read.

    Raises:
        ConfigError: the file cannot be read.
    """
    model = Model(model_element(file))
    rows = (read_sdf_joint(model, node, scope) for node, scope in model.joints)
    x, y, z, *_ = model.frames.pose(_root(model, [row for row in rows if row])) if model.links else IDENTITY
    return compose(pose, (x, y, z, 0.0, 0.0, 0.0)) if any((x, y, z)) else pose


def _root(model: Model, joints: Sequence[SdfJoint]) -> str:
    """The first link that hangs on no other: the one, if the model can be read as a boat."""
    hanging = {joint.child for joint in joints if joint.parent != WORLD}
    return next((name for name in model.links if name not in hanging), next(iter(model.links)))


def _move_frames(model: Model, joints: Sequence[SdfJoint]) -> None:
    """Put the frame of each link to that of the joint above it, as URDF has them, and turn the root's to the model."""
    for joint in joints:
        if joint.type != "fixed" and joint.child != WORLD and any(joint.shift):
            model.urdf_frames.setdefault(joint.child, joint.shift)
    if model.links:
        top = _root(model, joints)
        turn = model.frames.pose(top)[3:]
        if any(turn):
            model.urdf_frames[top] = inverse((0.0, 0.0, 0.0, *turn))


def _joint(model: Model, joint: SdfJoint) -> Joint:
    """A joint as a URDF has it, between links whose frames are there."""
    axis = joint.axes[0] if joint.axes else None
    given = axis.limits if axis else Limits(-LARGEST, LARGEST)
    effort, velocity = (0.0 if value >= ENDLESS else value for value in (given.effort, given.velocity))
    kind, limits = free_type(joint.type, replace(given, effort=effort, velocity=velocity))
    rest = min(max(0.0, given.lower), given.upper) if kind in BOUNDED else 0.0
    pose = _between(model, joint.parent, joint.child)
    xyz = axis.xyz if axis else (0.0, 0.0, 1.0)
    return Joint(joint.name, kind, joint.parent, joint.child, pose, xyz, limits, joint.node.place, rest)


def _between(model: Model, parent: str, child: str) -> Pose:
    """Pose of a link in another's frame: as the file has it where it is given there."""
    around, given = model.frames.given[child]
    if around == parent and parent not in model.urdf_frames and child not in model.urdf_frames:
        return given.pose
    return relative(model.urdf_pose(parent), model.urdf_pose(child))


def _offset(model: Model, robot: Urdf) -> Iterator[Loss]:
    """Remarks where the frame of the boat is not that of its model, or of its root link."""
    top = model.links[robot.root][0]
    x, y, z, *turn = model.frames.pose(robot.root)
    if any(turn) and (robot.gazebo.water or robot.gazebo.hydrodynamics):
        why = "the root link is rotated in its model; drag and added mass are applied in the model's axes"
        yield Loss(top.place, top.path, why)
    if any((x, y, z)):
        place = " ".join(f"{value:.4g}" for value in (x, y, z))
        yield Loss(top.place, top.path, f"the boat's frame is that of its root link, which is at {place} in the model")


def _tags(model: Model) -> Iterator[Markup]:
    """Plugins and sensors as the `<gazebo>` elements that a URDF has, in whose frames of links they are."""
    for name, (node, scope) in model.links.items():
        found = [*node.children("sensor"), *node.children("plugin")]
        if found:
            for part in found:
                pose, given = model.inside(part, name, scope), part.child("pose")
                element = given.element if given else Markup("pose", part.place, {})
                element.attrib.clear()
                element.text = " ".join(map(repr, pose))
                if any(pose) and not given:
                    part.element.append(element)
            yield _gazebo(node, {"reference": name}, found)
    yield _gazebo(model.root, {}, [node for node, _ in model.plugins])


def _gazebo(source: Node, attributes: dict[str, str], parts: Sequence[Node]) -> Markup:
    made = Markup("gazebo", source.place, attributes)
    made.extend([part.element for part in parts])
    return made
