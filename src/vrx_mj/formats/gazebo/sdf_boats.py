"""Boats written in SDF: a model with its links, joints, plugins and sensors, as the robot that a URDF describes."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from vrx_mj.config.search import SCHEME, display, package_paths
from vrx_mj.config.tree import File, Place
from vrx_mj.errors import ConfigError, VrxError
from vrx_mj.formats.gazebo.document import Element
from vrx_mj.formats.gazebo.models import model_element, model_file, model_folder, model_name
from vrx_mj.formats.gazebo.sdf_frames import MODEL, NESTED, Given, Scope, given_pose
from vrx_mj.formats.gazebo.sdf_links import WORLD, Body, inside_link, read_sdf_joint, read_sdf_link
from vrx_mj.formats.urdf.elements import Findings, Node
from vrx_mj.formats.urdf.gazebo import is_thruster
from vrx_mj.formats.urdf.links import Surroundings
from vrx_mj.formats.urdf.meshes import MeshFiles
from vrx_mj.formats.urdf.model import Joint, Urdf
from vrx_mj.formats.urdf.model import Place as PlainPlace
from vrx_mj.formats.urdf.reader import warn
from vrx_mj.formats.urdf.writing import urdf_text
from vrx_mj.formats.urdf.xml_document import Markup

DEEPEST = 8
"""Models that may be in each other."""
MOST_INCLUDES = 100
"""Models that a boat may include altogether."""
MOST_ELEMENTS = 50_000
"""Elements of all of them together."""
_URI = re.compile(r"(models?|file)://([^/].*)", re.DOTALL)
_ODD_TAG = re.compile(r"[^\w.-]")


def is_boat(model: Element) -> bool:
    """Whether a model pushes itself through the water, by a plugin for a thruster."""
    return any(one.tag == "plugin" and is_thruster(one.attributes.get("filename", "")) for one in model.walk())


def read_boat(file: Path) -> Urdf:
    """The robot that a model of Gazebo describes.

    Args:
        file: an SDF, the first model in which is meant, or `FILE#NAME`: the model of this name in a world.

    Raises:
        ConfigError: With everything that is wrong, each with its line and element.

    Warns:
        VrxWarning: Once for each kind of thing that is legal but suspicious.
    """
    model, version = model_element(file)
    path = Path(str(file).partition("#")[0])
    return _Reader(model, path, version).robot()


class _Reader:
    """One model being read."""

    def __init__(self, model: Element, file: Path, version: str) -> None:
        self.file = file
        self.findings = Findings(display(file))
        self.packages: dict[str, Path] = {}
        self.elements = 0
        self.folder = file.absolute().parent
        self.root = Node(self.tree(model, self.folder), "", self.findings)
        folders = MeshFiles(self.folder, self.packages, package_paths())
        numbers = tuple(int(part) for part in re.findall(r"\d{1,9}", version, re.ASCII))
        self.body = Body(Surroundings(self.findings), folders, numbers or (1, 6))
        self.joints: list[tuple[Node, Scope]] = []
        self.plugins: list[Node] = []
        self.remarks: list[tuple[Node, str]] = []
        self.includes = 0

    def robot(self) -> Urdf:
        """All of it."""
        from vrx_mj.formats.urdf.rows import robot_of

        self.gather(self.root, Scope(), self.folder, 0)
        if self.root.flag("static", False):
            self.remarks.append(
                (
                    Node(self.root.element, self.root.tag, self.findings),
                    "static is ignored; everything floats and falls",
                )
            )
        self.move_frames()
        body = self.body
        links = {name: read_sdf_link(body, name) for name in body.links}
        joints: dict[str, Joint] = {}
        for node, scope in self.joints:
            joint = read_sdf_joint(body, node, scope)
            if joint is None and WORLD in {node.text("parent"), node.text("child")}:
                self.remarks.append((node, "nothing fixes the boat in place: a joint to the world is ignored"))
            elif joint is not None and joint.name in joints:
                node.fault(f"duplicate name: line {joints[joint.name].place.line} has a joint of this name")
            elif joint is not None:
                joints[joint.name] = joint
        tags = [Node(tag, "", self.findings) for tag in self.tags()]
        robot = robot_of(self.root, self.file, links, joints, body.around, tags)
        self.findings.settle()
        warn(self.findings)
        remarks = (*(f"{node.place}: {node.path}: {text}" for node, text in self.remarks), *self.offset(robot.root))
        return replace(robot, remarks=remarks, text=urdf_text(robot, tags))

    def tree(self, model: Element, folder: Path) -> Markup:
        """The elements of a model, with the URIs in them as a URDF has them."""
        own = model.attributes.get("name") or folder.name
        self.packages.setdefault(own, folder)

        def uri(text: str) -> str:
            """`model://NAME/PATH` for what is in the folder of a model, else the text itself."""
            found = _URI.fullmatch(text)
            name = found[2].partition("/")[0] if found else ""
            if found and name not in self.packages:
                place = model_folder(name, folder)
                self.packages |= {name: place} if place else {}
            if found and (name in self.packages or found[1] != "file"):
                return f"{SCHEME}{found[2]}"
            inside = "://" not in text and folder != self.folder
            return f"{SCHEME}{own}/{text}" if inside else text

        return _markup(model, uri)

    def offset(self, top: str) -> Iterator[str]:
        """A remark where the frame of the model is not that of its root link."""
        x, y, z, *turn = self.body.place(top)
        if any((x, y, z, *turn)):
            place = " ".join(f"{value:.4g}" for value in (x, y, z, *turn))
            yield f"the boat's frame is that of its root link '{top}', which the model has at {place}"

    def gather(self, model: Node, scope: Scope, folder: Path, depth: int) -> None:
        """Take in the links, joints, frames and plugins of a model, and of the models in it."""
        body = self.body
        for node in model.children("link"):
            name = scope.name(node.name())
            if name in body.links:
                node.fault(f"duplicate name: line {body.links[name][0].line} has a link of this name")
                continue
            body.links[name] = node, scope
            body.frames.add(name, given_pose(node), scope, scope.model)
        for node in model.children("frame"):
            name, given = scope.name(node.name()), given_pose(node)
            to = scope.name(node.attribute("attached_to") or MODEL)
            body.frames.add(name, given, scope, to)
            body.attached[name] = to, node
        for node in model.children("joint"):
            self.joints.append((node, scope))
            child = scope.name(node.text("child"))
            body.frames.add(scope.name(node.attribute("name") or ""), given_pose(node), scope, child)
        self.plugins += model.children("plugin")
        self.gather_models(model, scope, folder, depth)

    def gather_models(self, model: Node, scope: Scope, folder: Path, depth: int) -> None:
        """Take in the models in a model."""
        inside = [(node, folder, given_pose(node)) for node in model.children("model")]
        for include in model.children("include"):
            found = self.included(include, folder, depth)
            inside += [found] if found else []
        for node, place, given in inside:
            if depth >= DEEPEST:
                node.fault(f"models are in each other deeper than {DEEPEST} levels")
                return
            own = scope.name(node.name())
            merged = node.attribute(_MERGED) is not None
            inner = Scope(scope.prefix if merged else f"{own}{NESTED}", f"{own}{NESTED}{MODEL}")
            self.body.frames.add(inner.model, given, scope, scope.model)
            self.gather(node, inner, place, depth + 1)

    def included(self, include: Node, folder: Path, depth: int) -> tuple[Node, Path, Given] | None:
        """The model that an `<include>` names, with the name and the pose that it gives it."""
        self.includes += 1
        if self.includes > MOST_INCLUDES:
            include.fault(f"more than {MOST_INCLUDES} models in one")
            return None
        uri = include.text("uri")
        try:
            name = model_name(_element(include))
            if model_folder(name, folder) is None:
                self.remarks.append((include, f"no model named '{name}' beside the file, nor on the path of models"))
                return None
            file = model_file(f"{SCHEME}{name}", folder)
            model, _ = model_element(file)
        except ConfigError as error:
            self.findings.problems += error.problems
            return None
        except VrxError as error:
            include.fault(str(error), "uri")
            return None
        self.elements += sum(1 for _ in model.walk())
        if self.elements > MOST_ELEMENTS:
            include.fault(f"more than {MOST_ELEMENTS} elements in all models that are included")
            return None
        tree = self.tree(model, file.parent)
        tree.set("name", include.text("name") or model.attributes.get("name") or name)
        if include.attribute_flag("merge"):
            tree.set(_MERGED, "true")
        include.element.append(tree)
        node = Node(tree, f"model '{tree.get('name')}'", self.findings)
        own = given_pose(include)
        if include.child("placement_frame"):
            self.remarks.append((include, f"placement_frame of {uri} is ignored: its own frame is placed"))
        return node, file.parent, own if include.child("pose") else given_pose(node)

    def move_frames(self) -> None:
        """Put the frame of each link to that of the joint above it, as URDF has them."""
        body = self.body
        for node, scope in self.joints:
            child = scope.name(node.text("child"))
            if node.attribute("type") == "fixed" or child not in body.links or node.child("pose") is None:
                continue
            pose = body.frames.inside(node, child, scope)
            if any(pose):
                body.moved.setdefault(child, pose)

    def tags(self) -> Iterator[Markup]:
        """Plugins and sensors as the `<gazebo>` elements that a URDF has."""
        for name, (node, scope) in self.body.links.items():
            found = [*node.children("sensor"), *node.children("plugin")]
            if found:
                for part in found:
                    self.placed(part, name, scope)
                yield _gazebo(node, {"reference": name}, found)
        yield _gazebo(self.root, {}, self.plugins)

    def placed(self, sensor: Node, link: str, scope: Scope) -> None:
        """Write the pose of a sensor in the frame that its link has in a URDF."""
        found = sensor.child("pose")
        pose = inside_link(self.body, sensor, link, scope)
        if found is None and not any(pose):
            return
        element = Markup("pose", sensor.place, {}) if found is None else found.element
        if found is None:
            sensor.element.append(element)
        element.attrib.clear()
        element.text = " ".join(map(repr, pose))


_MERGED = "{vrx_mj}merged"
"""Attribute of a model whose links are as if they were in the one that includes it."""


def _gazebo(source: Node, attributes: dict[str, str], parts: Sequence[Node]) -> Markup:
    made = Markup("gazebo", source.place, attributes)
    made.extend([part.element for part in parts])
    return made


def _element(include: Node) -> Element:
    """An `<include>` as the reader of models takes it."""
    place = Place(File(include.place.file, None), include.line)
    uri = Element("uri", place, {}, include.text("uri"), ())
    return Element("include", place, {}, "", (uri,))


def _markup(element: Element, uri: Callable[[str], str]) -> Markup:
    """An element as those of a URDF are."""
    file, line, column = element.place
    attributes = {key: value for key, value in element.attributes.items() if ":" not in key}
    made = Markup(_ODD_TAG.sub("_", element.tag), PlainPlace(file.name, line, column), attributes)
    made.text = uri(element.own_text) if element.tag == "uri" else element.own_text
    made.extend([_markup(child, uri) for child in element.children])
    return made
