"""Models of Gazebo (SDF) as objects of ours: bodies on joints with their shapes, or a composite of models.

SDF may come as a text over a network. Then only files of the catalogue and of the environment's model path are read;
nothing is looked for beside the text or in the current folder.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

from pydantic import ValidationError

from vrx_mj.config.search import SCHEME, catalogue, kind_name
from vrx_mj.config.shapes import MESH_SUFFIXES, BuoyancyConfig, BuoyancyElement, Shape
from vrx_mj.config.tree import Section, literal
from vrx_mj.config.values import MAX_NUMBER
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError, first_lines, shorten
from vrx_mj.formats.gazebo.document import (
    Element,
    Fate,
    Note,
    Report,
    as_node,
    is_file,
    markup,
    plugin_name,
    read_document,
    spot,
)
from vrx_mj.formats.gazebo.models import (
    PATHS,
    Source,
    has_model,
    is_installed,
    is_template,
    model_element,
    model_file,
    model_name,
    template_content,
)
from vrx_mj.formats.gazebo.sdf_boats import boat_pose, is_boat
from vrx_mj.formats.gazebo.sdf_links import (
    SHAPES,
    Axis,
    Body,
    Hinge,
    SdfJoint,
    Tree,
    mass_of,
    read_sdf_joint,
    read_sdf_link,
    shape_tag,
    sizes_of,
)
from vrx_mj.formats.gazebo.sdf_models import (
    WORLD,
    Model,
    given_pose,
    in_world_frame,
    pose_of,
    pose_of_included,
    safe_name,
)
from vrx_mj.formats.series.pieces import At, Content, with_places
from vrx_mj.formats.urdf.elements import Node, losses, unused_name
from vrx_mj.formats.urdf.links import ENDLESS, ONE
from vrx_mj.formats.urdf.model import MeshRow, relative
from vrx_mj.formats.urdf.reader import ODD
from vrx_mj.frames import IDENTITY, Pose, compose

_DRAG = 25.0, 2.0
"""Linear and angular drag [1/s] of what floats without VRX's buoyancy plugin: those of VRX's buoys."""
_DISPLACING = {"box", "sphere", "cylinder"}
"""Types of shapes that displace water."""
_TYPES = {"screw": "revolute", "revolute2": "universal"}
"""Types of joints of SDF that have other names here."""
_STATIC: tuple[Fate, str] = "imported", "the model is static"
"""Fate of the joints of a model that does not move."""
_QUIET = {"mesh", "unit"}
"""Things that are odd in a file of which an object's notes say more, or nothing."""
_PRODUCT = 1e-9
"""Share of the largest moment of inertia up to which a product is rounding."""
_MOST_NOTES = 3
"""Parts of a model that is not imported as it is, which a message names."""


def object_document(file: Path) -> tuple[Section, str]:
    """A model's file in the keys of an object's file, and its name."""
    return model_section(file), kind_name(str(file))


def model_section(file: Path, report: Report | None = None) -> Section:
    """A model's file in the keys of an object's file.

    Args:
        file: an SDF with one model, or `FILE#NAME`: the model of this name in a world.
        report: takes what became of each part.

    Raises:
        ConfigError: it cannot be read, or is no model; the error lists every problem with its place.
    """
    kept = report or Report()
    if is_template(file):
        dock, place = template_content(file, kept)
        template: Section = with_places(dock, place)
        return template
    source = model_element(file)
    content = {"description": f"{source.model.attributes.get('name', 'model')}, a model of Gazebo"}
    content |= _composite(source, kept) if _is_composite(source.model) else _Object(source, file, kept).content()
    section: Section = with_places(content, source.model.place)
    return section


def _is_composite(model: Element) -> bool:
    """Whether a model is nothing but other models, each of which floats or stands by itself."""
    includes = model.all("include")
    parts = any(one.tag in {"link", "model", "joint"} for one in model.children)
    merged = any(one.truth(one.attribute("merge") or "false", "merge") for one in includes)
    if not includes or parts or merged:
        return False
    known = catalogue("objects")
    return not model.value_of("static", "switch") or any(model_name(one) in known for one in includes)


def _composite(source: Source, report: Report) -> Content:
    """A model that is made of others."""
    known, folder = catalogue("objects"), source.file.absolute().parent
    objects: list[Content] = []
    for include in in_world_frame(source.model, source.file):
        if isinstance(include, ConfigError):
            raise include
        if include.tag != "include":
            continue
        name = model_name(include)
        if name not in known and not has_model(name, folder):
            report.note(include, "ignored", f"no model named '{name}'")
            continue
        model = name if name in known else f"{SCHEME}{name}"
        pose = pose_of(include, report) if name in known else pose_of_included(include, folder, report)
        path = follow_path(include, report)
        swims = {"path": At(path, include.place)} if path else {}
        objects.append({"name": include.text("name") or name, "model": At(model, include.place), "pose": pose, **swims})
        report.note(include, "imported", "`objects`")
    if not objects:
        names = ", ".join(dict.fromkeys(map(model_name, source.model.all("include"))))
        raise source.model.fault(f"none of its models is known: {shorten(names)}")
    own = _distinct([one["name"] for one in objects], first=1)
    return {"objects": [one | {"name": name} for one, name in zip(objects, own, strict=True)]}


class _Object:
    """A model as one object."""

    def __init__(self, source: Source, file: Path, report: Report) -> None:
        self.element = source.model
        self.model = Model(source)
        self.folder = Path(str(file).partition("#")[0]).absolute().parent
        self.report = report
        self.note = self.report.note
        self.is_static = self.model.root.flag("static", False)
        self.tree = self.bodies()

    def bodies(self) -> Tree:
        """The bodies of the model."""
        from vrx_mj.formats.urdf.links import check_masses

        model, findings = self.model, self.model.findings
        if not model.links and not findings.problems:
            raise self.element.fault("a model needs links or includes")
        rows = [read_sdf_link(model, name) for name in model.links]
        joints = [row for node, scope in model.joints if (row := read_sdf_joint(model, node, scope))]
        places = [model.frames.pose(name) for name in model.links]
        if not self.is_static:
            check_masses({row.link.name: row.link for row in rows}, model.around, model.root)
        findings.settle()
        self.report.lose(losses(model.root.element, "model", "object"))
        for node, text in model.lost:
            self.note(node, "ignored", text)
        for kind, things in findings.odd.items():
            if kind not in _QUIET:
                self.note(self.element, "approximated", f"{ODD[kind]}: {shorten(', '.join(things))}")
        moving = [joint for joint in joints if joint.type != "gearbox"]
        tree = Tree(rows, places, moving, is_static=self.is_static)
        for joint in joints:
            self.note(joint.node, *(_STATIC if self.is_static else _fate(joint, tree)))
        if tree.loose:
            text = f"no joint holds {shorten(', '.join(tree.loose))}: part of the first link's rigid body"
            self.note(model.links[tree.loose[0]][0], "approximated", text)
        return tree

    def content(self) -> Content:
        """The keys of an object's file."""
        root, *others = self.tree.bodies
        shapes = [self.all_shapes(body) for body in self.tree.bodies]
        whole_names = [body.name for body in self.tree.bodies]
        names = dict(zip(whole_names, _distinct(whole_names), strict=True))
        link = {"link": names[root.name]}
        if self.is_static:
            return {**link, "static": True, **shapes[0]}
        wet = self.wet(shapes)
        is_static = wet is None or self.tree.is_anchored
        whole = link | ({"static": True} if is_static else self.inertia(root))
        whole |= {**shapes[0], **({} if is_static or wet is None else wet[0])}
        path = None if is_static else follow_path(self.element, self.report)
        whole |= {"path": path} if path else {}
        if not others:
            return whole
        hinges = self.tree.hinges
        rows = zip(others, shapes[1:], (wet or [{}] * len(shapes))[1:], strict=True)
        links = [
            {"name": names[body.name], "pose": list(body.pose), **self.inertia(body), **own, **water}
            for body, own, water in rows
        ]
        joints = zip(hinges, _distinct([one.joint.name for one in hinges]), strict=True)
        return {
            **whole, "links": links,
            "joints": [self.joint(hinge, name, names) for hinge, name in joints],
        }  # fmt: skip

    def joint(self, hinge: Hinge, name: str, links: Mapping[str, str]) -> At:
        """A joint between two bodies, whose links are called as in `links` here."""
        joint = hinge.joint
        kind = _TYPES.get(joint.type, joint.type)
        axes = [_axis(axis, free=kind == "continuous", sign=-1 if hinge.is_backward else 1) for axis in joint.axes]
        content: Content = {
            "name": name,
            "type": kind,
            "parent": links[hinge.near.name],
            "child": links[hinge.far.name],
            "pose": list(relative(hinge.far.pose, joint.place) if hinge.is_backward else joint.shift),
            **dict(zip(("axis", "axis2"), axes[::-1] if hinge.is_backward else axes, strict=False)),
        }
        return At(content, spot(joint.node.place))

    def wet(self, shapes: Sequence[Content]) -> list[Content] | None:
        """The buoyancy of each body; None, with a note, for a model that would sink."""
        plugins = [node for node, scope in self.model.plugins if not scope.prefix and "buoyancy" in plugin_name(node)]
        wet = [part for one in plugins for part in self.buoyancy(one)]
        self.model.findings.settle()
        bodies = self.tree.bodies
        drag = _drag(plugins[0]) if plugins else {"linear_drag": _DRAG[0], "angular_drag": _DRAG[1]}
        found = [[(drag, shape) for body, drag, shape in wet if body is own] for own in bodies]
        if not (wet or self.tree.is_anchored):
            solids = ((one for one in own["collisions"] if not isinstance(one, At)) for own in shapes)
            found = [[(drag, dict(one)) for one in own if one["type"] in _DISPLACING] for own in solids]
            volume = sum(BuoyancyElement.model_validate(one).volume for parts in found for _, one in parts)
            mass = sum(weight.mass for body in bodies if (weight := mass_of(body)))
            sinks = mass >= volume * WATER_DENSITY
            then = f"it would sink ({mass:g} kg, {volume:.3g} m3), so it is `static: true`"
            text = f"it has no buoyancy plugin{f' {then}' if sinks else ': its collision shapes displace water'}"
            self.note(self.element, "approximated", text)
            if sinks:
                return None
        return [
            {"buoyancy": {**(drag if len(found) == 1 else parts[0][0]), "elements": [shape for _, shape in parts]}}
            if parts else {}
            for parts in found
        ]  # fmt: skip

    def buoyancy(self, plugin: Node) -> Iterator[tuple[Body, Content, Content]]:
        """The shapes of a buoyancy plugin of VRX that displace water, each with its body and the plugin's drag."""
        known = {row.link.name: (body, pose) for body in self.tree.bodies for row, pose in body.parts}
        for part in plugin.children("buoyancy"):
            link = part.text("link_name") or part.attribute("link_name") or ""
            if link not in known:
                part.fault(str(UnknownNameError("link", link, known)), "link_name")
                continue
            body, pose = known[link]
            shape = _primitive(part, pose, self.report)
            if shape and shape["type"] in _DISPLACING:
                yield body, _drag(plugin), shape
        self.note(plugin, "imported", "`buoyancy`")

    def inertia(self, body: Body) -> Content:
        """Mass properties of a body; products of inertia only where it has any."""
        found = mass_of(body)
        if found is None:
            row = body.parts[0][0].link
            raise ConfigError([row.place.problem(f"link '{row.name}'", "needs a mass, because it moves")])
        *moments, xy, xz, yz = found.tensor()
        products = [xy, xz, yz] if max(map(abs, (xy, xz, yz))) > _PRODUCT * max(moments) else []
        return {"mass": found.mass, "center_of_mass": found.center.tolist(), "inertia": [*moments, *products]}

    def all_shapes(self, body: Body) -> Content:
        """The collisions and visuals of a body."""
        rows = [(row.collisions, row.visuals, pose) for row, pose in body.parts]
        return {
            "collisions": [shape for felt, _, pose in rows for one in felt if (shape := self.shape(one, pose))],
            "visuals": [shape for _, seen, pose in rows for one in seen if (shape := self.shape(one, pose))],
        }

    def shape(self, shape: Shape | MeshRow, link: Pose) -> Content | At | None:
        """A shape in the frame of its body; None, with a note, where its mesh is not there."""
        pose = compose(link, shape.pose)
        place = {} if pose == IDENTITY else {"pose": list(pose)}
        if isinstance(shape, Shape):
            return shape.model_dump(include={"type", "size", "radius", "length", "color"}, exclude_unset=True) | place
        color = {} if shape.color is None else {"color": shape.color}
        try:
            folder, file = self.mesh(shape.file)
        except VrxError as error:
            self.report.notes.append(Note(spot(shape.place), "<mesh>", "ignored", str(error)))
            return None
        scale = {} if shape.scale == ONE else {"scale": shape.scale}
        own = None if folder == self.folder else folder
        content = {"type": "mesh", "file": At(file, spot(shape.place)), **scale, **place, **color}
        return At(content, spot(shape.place, own)) if own else content

    def mesh(self, name: str) -> tuple[Path, str]:
        """The folder of a mesh, and its path in that. Raises VrxError."""
        inside = name.rpartition("://")[2].removeprefix(f"{self.folder.name}/")
        linked = self.folder / inside
        if not name.lower().endswith(MESH_SUFFIXES):
            raise VrxError(f"no such mesh: {literal(name)}")
        if ".." not in Path(inside).parts and is_file(linked) and linked.is_symlink() and is_installed(linked):
            return self.folder, inside
        return self.model.files.find(name)


def buoyancy_of(include: Element, report: Report) -> Content | None:
    """Buoyancy in the keys of an object, by the plugin in an `<include>` of VRX 3; None without one."""
    plugins = (one for one in as_node(include).children("plugin") if "buoyancydrag" in plugin_name(one))
    if (plugin := next(plugins, None)) is None:
        return None
    shapes = [_primitive(part, IDENTITY, report) for part in plugin.children("buoyancy")]
    found = {**_drag(plugin), "elements": [*filter(None, shapes)]}
    plugin.findings.settle()
    return found


def same_buoyancy(one: Content, other: Content) -> bool:
    """Whether two objects displace the same water and have the same drag; not where the keys of one are wrong."""
    try:
        first, second = (
            BuoyancyConfig.model_validate(each).model_dump(exclude={"elements": {"__all__": {"folder"}}})
            for each in (one, other)
        )
    except ValidationError:
        return False
    return first == second


def follow_path(element: Element, report: Report) -> Content | None:
    """The path along which a model swims, by VRX's follow_plugin or gz-sim's TrajectoryFollower; None without one."""
    plugins = (one for one in element.all("plugin") if re.search("followplugin|trajectoryfollower", plugin_name(one)))
    if (plugin := next(plugins, None)) is None:
        return None
    found: Content = {"loop": _loops(plugin, report)}
    points = []
    for point in (point for group in plugin.all("waypoints") for point in group.all("waypoint")):
        x, y, *height = point.value("x y z" if len(point.own_text.split()) == 3 else "x y")
        points.append([x, y])
        if any(height):
            report.note(point, "approximated", "paths lie on the water: the third number is ignored")
    if points:
        found["waypoints"] = points
    for tag in ("circle", "line"):
        shape = plugin.child(tag)
        if shape is not None:
            found[tag] = shape.fields(tag)
    return found | (plugin.fields("trajectory follower") if "trajectoryfollower" in plugin_name(plugin) else {})


def _loops(plugin: Element, report: Report) -> bool:
    """Whether the path begins again at its end; VRX's plugin goes by the presence of a tag alone."""
    forever = plugin.child("loop_forever")
    if forever is not None and not plugin.value_of("loop_forever", "switch", True):
        report.note(forever, "ignored", "VRX's plugin loops if this tag is present, whatever its value: remove it")
    return forever is not None or plugin.value_of("loop", "switch", False)


def _primitive(part: Node, link: Pose, report: Report) -> Content | None:
    """A primitive in the frame of its body; None, with a note: ours has none like it."""
    geometry = part.child("geometry")
    tag = shape_tag(geometry) if geometry else ""
    if geometry is None or tag not in SHAPES or tag == "mesh":
        report.note(part, "ignored", f"<{tag}> shapes are not supported" if tag else "it has no <geometry>")
        return None
    pose = compose(link, given_pose(part).pose)
    return {"type": tag, **sizes_of(geometry, tag), **({} if pose == IDENTITY else {"pose": list(pose)})}


def _distinct(names: Sequence[str], first: int = 2) -> list[str]:
    """Names as ours may be, none of which is another's: those that are taken are numbered."""
    found: list[str] = []
    for own in map(safe_name, names):
        found.append(unused_name(own if own not in found else own[:56], found, first))
    return found


def _fate(joint: SdfJoint, tree: Tree) -> tuple[Fate, str]:
    """Fate of a joint."""
    kind = _TYPES.get(joint.type, joint.type)
    if joint.type == "gearbox":
        return "ignored", "gearboxes are not simulated: each joint moves on its own"
    if joint in tree.loops:
        return "approximated", "it closes a loop of joints; it is left out, and the loop stays open"
    if joint.holds:
        where = "`static`" if WORLD in (joint.parent, joint.child) else "its links are merged into one rigid body"
        return "imported", where if joint.type == "fixed" else f"its limits are equal, so it is fixed: {where}"
    left = " that does not advance" if joint.type == "screw" else ""
    return ("imported", "`joints`") if kind == joint.type else ("approximated", f"`joints`: a {kind} joint{left}")


def _axis(axis: Axis, *, free: bool, sign: int) -> Content:
    """An axis of a joint."""
    lower, upper = axis.limits.lower, axis.limits.upper
    found: Content = {"xyz": [sign * value for value in axis.xyz]}
    if not free and (lower > -ENDLESS or upper < ENDLESS):
        found["limits"] = [max(lower, -MAX_NUMBER), min(upper, MAX_NUMBER)]
    return found | axis.dynamics


def _drag(plugin: Node) -> Content:
    """Density and drag of a buoyancy plugin."""
    density = {"fluid_density": plugin.value("fluid_density", WATER_DENSITY)} if plugin.child("fluid_density") else {}
    level = plugin.value("fluid_level", 0.0)
    drag = {key: plugin.value(key, 0.0) for key in ("linear_drag", "angular_drag")}
    return {**density, **({"fluid_level": level} if level else {}), **drag}


class TextModel(NamedTuple):
    """A model whose SDF came as a text."""

    model: str | Path
    """Name in the catalogue, or path of the file of a model."""
    pose: Pose
    """Pose that the text itself gives [m, rad]."""
    title: str
    """Description of the model."""
    is_boat: bool = False
    """Whether it has thrusters."""
    notes: tuple[str, ...] = ()
    """Parts that differ here or are ignored."""


def model_of_text(text: str, folder: Path) -> TextModel:
    """The model that an SDF text brings: of several models or includes the first, as in Gazebo.

    A model of a name that the catalogue knows is the catalogue's. One that is on the path of models as it is in the
    text is that, with its meshes. Any other is the text alone, which is written to `folder`.

    Raises:
        ConfigError: it is no SDF with a model, or the model is not known.
    """
    file = folder / "text.sdf"  # no folder of a model, which its own name could mean
    folder.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8", errors="replace")
    root = read_document(file)
    found = next((one for one in root.walk() if one.tag in {"model", "include"}), None)
    if found is None or root.tag not in {"sdf", "gazebo", "model", "world"}:
        raise root.fault("expected <sdf> with a <model> or an <include>")
    included = found.tag == "include"
    name = model_name(found) if included else found.attributes.get("name", "")
    report = Report()
    x, y, z, roll, pitch, yaw = pose_of(found, report).value
    pose = x, y, z, roll, pitch, yaw
    if name in catalogue("objects"):
        return TextModel(name, pose, f"the catalogue's {name}")
    there = model_file(SCHEME + name, folder) if has_model(name, folder) else None
    if included and there is None:
        raise found.fault(f"no model '{name}' in `vrx-mj list objects`, nor on {PATHS[0]} or {PATHS[1]}", "uri")
    if there is not None and (included or _is_text_of(there, found)):
        own, title, notes = there.absolute(), f"{SCHEME}{name}", False
    else:
        own, title, notes = folder / "own" / safe_name(name) / "model.sdf", f"the SDF's own {safe_name(name)}", True
        own.parent.mkdir(parents=True, exist_ok=True)
        file.replace(own)
    if not is_template(own) and is_boat(model_element(own).model):
        return TextModel(own, boat_pose(pose, own), title, is_boat=True)
    return TextModel(own, pose, title, notes=_notes(own, report) if notes else ())


def _is_text_of(file: Path, model: Element) -> bool:
    """Whether the model in a file is another one, but for comments and blanks."""
    if is_template(file):
        return False
    ours, theirs = (ET.tostring(markup(one, str)) for one in (model_element(file).model, model))
    return ours == theirs


def _notes(file: Path, report: Report) -> tuple[str, ...]:
    """Parts of an object that differ here or are ignored, after those that a report has."""
    model_section(file, report)
    notes = dict.fromkeys(f"{note.what} {note.fate}: {note.ours}" for note in report.notes if note.fate != "imported")
    return tuple(first_lines(notes, _MOST_NOTES))
