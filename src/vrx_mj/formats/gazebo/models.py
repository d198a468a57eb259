"""Models of Gazebo (SDF) as objects of ours: bodies on joints with their shapes, or a composite of models."""

import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from vrx_mj.config.base import COLORS
from vrx_mj.config.search import (
    MODEL_SUFFIXES,
    SCHEME,
    TEMPLATE,
    catalogue,
    contained,
    display,
    kind_name,
    package_paths,
    workspace_packages,
)
from vrx_mj.config.shapes import MESH_SUFFIXES
from vrx_mj.config.tree import File, Section
from vrx_mj.config.wording import shown
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxError, shortened
from vrx_mj.formats.gazebo.document import Element, Report, is_file, read_document
from vrx_mj.formats.gazebo.erb_docks import is_template, template_content
from vrx_mj.formats.gazebo.model_frames import in_usual_frames, pose_of, safe_name
from vrx_mj.formats.gazebo.model_links import Body, Inertial, assembled, mass_of
from vrx_mj.formats.series.pieces import At, located
from vrx_mj.formats.urdf.meshes import MeshFiles
from vrx_mj.frames import Pose, compose

ROBOT = "robot.yaml"
"""What a folder that is a robot has."""
PATHS = ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH")
"""Environment variables with folders in which models are."""
NO_MODEL = "is its folder on GAZEBO_MODEL_PATH?"
"""What to do where a model is not found."""
HERE: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
DRAG = 25.0, 2.0
"""Linear and angular drag [1/s] of what floats without VRX's buoyancy plugin: those of VRX's buoys."""
DISPLACING = {"box", "sphere", "cylinder"}
"""Types of shapes that displace water."""
_STOCK = re.compile(r"(?<=[a-z])(?=[A-Z])")

Content = dict[str, Any]


def is_gazebo_model(text: str) -> bool:
    """Whether what a file names as a model is one of Gazebo: `model://NAME`, a `.sdf`, or `FILE#NAME` in a world."""
    return text.startswith(SCHEME) or text.partition("#")[0].lower().endswith(MODEL_SUFFIXES)


def model_name(include: Element) -> str:
    """The name in the `<uri>` of an `<include>`: that of a folder of models, or of one on Gazebo's server."""
    uri = include.text("uri")
    if not uri:
        raise include.fault("<uri> is required, but missing")
    scheme, mark, rest = uri.partition("://")
    name = PurePosixPath(rest if mark else uri).name
    if scheme.lower() == "file" or ".." in PurePosixPath(uri).parts or uri.startswith("/") or not name:
        raise include.fault(f"expected the name of a model, as model://NAME, got {shown(uri)}", "uri")
    return name


def model_folder(name: str, near: Path) -> Path | None:
    """The folder of a model: beside the file, in `models` there or one above, or along the path; None without one.

    Raises:
        VrxError: it is a link that leads elsewhere.
    """
    return _folder(name, near)


def has_model(name: str, near: Path) -> bool:
    """Whether a folder of this name is on the path of models."""
    return _folder(name, near) is not None


def model_file(text: str, near: Path | None) -> Path:
    """The file of a model that another file names, with `#NAME` if that is one in a world.

    Raises:
        VrxError: there is none.
    """
    if text.startswith(SCHEME):
        name = text.removeprefix(SCHEME)
        folder = _folder(name, near or Path.cwd())
        if folder is None:
            raise VrxError(f"no model '{name}' beside the file, nor on {PATHS[0]} or {PATHS[1]}")
        return folder / _main_file(folder)
    path, mark, name = text.partition("#")
    return Path(f"{contained(path, near)}{mark}{name}")


def file_in_folder(text: object, near: Path | None = None) -> Path | None:
    """The file of the robot or model in a folder that a path leads to; None: it leads to no folder of one.

    In a file the folder must be inside that of the file, `near`; on the command line it may be anywhere.
    """
    if not isinstance(text, str | Path) or "/" not in str(text):
        return None
    folder = (near or Path.cwd()) / text
    if os.path.isfile(folder / ROBOT):  # noqa: PTH113 - too long a name raises
        main = _within(folder, ROBOT)
    elif os.path.isdir(folder) and _is_model(folder):  # noqa: PTH112
        main = _main_file(folder)
    else:
        return None
    return folder / main if near is None or _is_inside(folder, near) else None


def object_document(file: Path) -> tuple[Section, str]:
    """What the file of a model says, in the keys of an object's file, and its name."""
    return model_section(file), kind_name(str(file))


def model_section(file: Path, report: Report | None = None) -> Section:
    """What the file of a model says, in the keys of an object's file.

    Args:
        file: an SDF with one model, or `FILE#NAME`: the model of this name in a world.
        report: takes what became of each part.

    Raises:
        ConfigError: it cannot be read, or is no model.
    """
    kept = report or Report()
    if is_template(file):
        dock, place = template_content(file, kept)
        template: Section = located(dock, place)
        return template
    model, version = model_element(file)
    content = _Model(model, Path(str(file).partition("#")[0]).parent, version, kept).content()
    kept.settle()
    section: Section = located(content, model.place)
    return section


def model_element(file: Path) -> tuple[Element, str]:
    """The model of a file, or `FILE#NAME`: that of this name in a world; and the version of SDF that it is in.

    Raises:
        ConfigError: it cannot be read, or is no model.
    """
    path, mark, name = str(file).partition("#")
    if mark:
        return _named(Path(path), name)
    root = read_document(Path(path))
    return _only(root), root.attributes.get("version", "")


def _only(root: Element) -> Element:
    """The model of a file; of several the first."""
    found = next((one for one in root.walk() if one.tag == "model"), None)
    if found is None:
        world = any(one.tag == "world" for one in root.walk())
        raise root.fault("a world without a <model>; WORLD takes worlds" if world else "expected <sdf> with a <model>")
    return found


_held: dict[Path, tuple[int, int, dict[str, Element], str]] = {}
"""Models of the world that was read last, by its file, with the time, size and version of SDF that the file had."""


def hold_models(file: Path, root: Element) -> None:
    """Hold the models of a world for those who name them, who would read its file again for each."""
    _held.clear()
    found = {one.attributes.get("name", ""): one for one in reversed(list(root.walk())) if one.tag == "model"}
    status = file.stat()
    _held[file.absolute()] = (status.st_mtime_ns, status.st_size, found, root.attributes.get("version", ""))


def _named(file: Path, name: str) -> tuple[Element, str]:
    """The model of a name in the file of a world, and the version of SDF."""
    status = file.stat() if is_file(file) else None
    held = _held.get(file.absolute())
    if held is None or status is None or held[:2] != (status.st_mtime_ns, status.st_size):
        hold_models(file, read_document(file))
        held = _held[file.absolute()]
    if name not in held[2]:
        known = [name for name in held[2] if name]
        raise ConfigError([Problem(display(file), 1, None, "", str(UnknownNameError("model", name, known)))])
    return held[2][name], held[3]


def _pose(element: Element) -> Pose:
    x, y, z, roll, pitch, yaw = pose_of(element).value
    return x, y, z, roll, pitch, yaw


def buoyancy_of(include: Element, report: Report) -> Content | None:
    """What the buoyancy plugin in an `<include>` of VRX 3 says, in the keys of an object; None without one."""
    plugin = next((one for one in include.all("plugin") if _is(one, "buoyancydrag")), None)
    if plugin is None:
        return None
    parts = (_shape(part, HERE, report) for part in plugin.all("buoyancy"))
    return {**_drag(plugin), "elements": [part for part in parts if part is not None]}


def same_buoyancy(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two objects displace the same water and have the same drag; not where the keys of one are wrong."""
    try:
        return _numbers(one) == _numbers(other)
    except (AttributeError, KeyError, TypeError, ValueError):
        return False


def _numbers(buoyancy: Mapping[str, Any]) -> list[Any]:
    usual = {"fluid_density": WATER_DENSITY, "fluid_level": 0.0, "linear_drag": 0.0, "angular_drag": 0.0}
    head = [float(buoyancy.get(key, default)) for key, default in usual.items()]
    return [*head, *map(_shape_numbers, buoyancy["elements"])]


def _shape_numbers(shape: Mapping[str, Any]) -> list[Any]:
    pose = shape.get("pose") or HERE
    values = [*(shape.get("size") or ()), shape.get("radius"), shape.get("length")]
    numbers = [float(value) for value in values if value is not None]
    return [shape["type"], *numbers, *map(float, pose.value if isinstance(pose, At) else pose)]


def follow_path(element: Element, report: Report) -> Content | None:
    """The path along which a model swims, by VRX's follow_plugin or gz-sim's TrajectoryFollower; None without one."""
    plugins = [one for one in element.all("plugin") if _is(one, "followplugin") or _is(one, "trajectoryfollower")]
    if not plugins:
        return None
    plugin = plugins[0]
    newer = _is(plugin, "trajectoryfollower")
    found: Content = {"loop": _loops(plugin, report)}
    points = [point.read_numbers("x y") for group in plugin.all("waypoints") for point in group.all("waypoint")]
    if points:
        found["waypoints"] = points
    for tag, keys in (("circle", ("radius",)), ("line", ("length", "direction"))):
        shape = plugin.child(tag)
        if shape is not None:
            found[tag] = shape.given(*keys)
    return found | ({key: plugin.number(key) for key in ("force", "torque") if plugin.child(key)} if newer else {})


def _loops(plugin: Element, report: Report) -> bool:
    """Whether the path begins again at its end; VRX's plugin goes by the presence of a tag alone."""
    forever = plugin.child("loop_forever")
    if forever is None:
        return plugin.switch("loop")
    if not plugin.switch("loop_forever", default=True):
        report.note(forever, "ignored", "VRX's plugin loops where this tag is there, whatever it says: remove it")
    return True


def _is(plugin: Element, word: str) -> bool:
    return word in plugin.attributes.get("filename", "").lower().replace("_", "").replace("-", "")


def _folder(name: str, near: Path) -> Path | None:
    """The folder of a model: beside the file, in `models` there or one above, or along the path."""
    if not re.fullmatch(r"\w[\w.-]{0,99}", name):
        return None
    near = near.absolute()
    around = workspace_packages(near).values()
    packages = [below for path in (*package_paths(), *around) for below in (path, path / "models")]
    beside = [near, near / "models", near.parent / "models", near.parent]
    found = next((place / name for place in (*beside, *_model_paths(), *packages) if _is_model(place / name)), None)
    if found is not None and found.parent in beside and not _is_inside(found, near.parent):
        raise VrxError(f"model '{name}' is a link that leads out of {display(near.parent)}")
    return found


def _model_paths() -> list[Path]:
    """Folders of the environment's variables in which models are."""
    return [Path(entry) for key in PATHS for entry in os.environ.get(key, "").split(os.pathsep) if entry]


def _is_model(folder: Path) -> bool:
    return any(is_file(folder / name) for name in ("model.sdf", "model.config", TEMPLATE))


def _is_inside(path: Path, folder: Path) -> bool:
    """Whether a path leads into a folder, links followed."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):
        return False


def _main_file(folder: Path) -> str:
    """The SDF of a folder, as its `model.config` says; of several the one of the newest version."""
    config = folder / "model.config"
    if is_file(folder / TEMPLATE) and not is_file(folder / "model.sdf"):
        return _within(folder, TEMPLATE)
    if not is_file(config):
        return _within(folder, "model.sdf")
    _within(folder, config.name)
    named = [one for one in read_document(config).all("sdf") if one.own_text]
    found = max(named, key=lambda one: _version(one.attributes.get("version", "")), default=None)
    text = found.own_text if found else "model.sdf"
    if found and (PurePosixPath(text).name != text or not is_file(folder / text)):
        raise found.fault(f"expected the name of a file in this folder, got {shown(text)}")
    return _within(folder, text)


def _within(folder: Path, name: str) -> str:
    """The name of a file in the folder of a model, which may not be a link to elsewhere."""
    if not _is_inside(folder / name, folder) and not _is_installed(folder / name):
        raise VrxError(f"'{name}' of model '{folder.name}' is a link that leads out of its folder")
    return name


def _is_installed(file: Path) -> bool:
    """Whether a link is one of `colcon build --symlink-install`: to a folder of the same name."""
    return file.resolve().parent.name == file.parent.name


def _version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d{1,9}", text, re.ASCII))


class _Model:
    """A model being read."""

    def __init__(self, model: Element, folder: Path, version: str, report: Report) -> None:
        self.model = in_usual_frames(model)
        self.folder = folder
        self.report = report
        self.assembly = assembled(self.model, model, version, report)

    def content(self) -> Content:
        """The keys of an object's file."""
        head: Content = {"description": f"{self.model.attributes.get('name', 'model')}, a model of Gazebo"}
        includes = self.model.all("include")
        if includes and not self.assembly.bodies:
            return head | self.composite(includes)
        for include in includes:
            self.report.note(include, "ignored", "a model with links of its own has no models in it here")
        if not self.assembly.bodies:
            raise self.model.fault("a model without links or includes is nothing")
        root, *others = self.assembly.bodies
        shapes = [self.all_shapes(body) for body in self.assembly.bodies]
        if self.model.switch("static"):
            return {**head, "static": True, **shapes[0]}
        wet = self.wet(shapes)
        is_static = wet is None or self.assembly.is_anchored
        whole = {"static": True} if is_static else self.inertia(root)
        whole |= {**shapes[0], **({} if is_static or wet is None else wet[0])}
        path = None if is_static else follow_path(self.model, self.report)
        whole |= {"path": path} if path else {}
        if not others:
            return head | whole
        links = [
            {"name": body.name, "pose": list(body.pose), **self.inertia(body), **own, **water}
            for body, own, water in zip(others, shapes[1:], (wet or [{}] * len(shapes))[1:], strict=True)
        ]
        return {**head, "link": root.name, **whole, "links": links, "joints": self.assembly.joints}

    def composite(self, includes: Sequence[Element]) -> Content:
        """A model that is made of others."""
        known = catalogue("objects")
        objects: list[Content] = []
        counts: dict[str, int] = {}
        for include in includes:
            name = model_name(include)
            if name not in known and not has_model(name, self.folder):
                self.report.note(include, "ignored", f"no model of this name: {name}")
                continue
            own = safe_name(include.text("name") or name)
            taken = counts.get(own, 0)
            counts[own] = taken + 1
            model = name if name in known else f"{SCHEME}{name}"
            objects.append({"name": own if not taken else f"{own}_{taken}", "model": At(model, include.place),
                            "pose": pose_of(include)})  # fmt: skip
            self.report.note(include, "taken over", "`objects`")
        if not objects:
            names = ", ".join(dict.fromkeys(map(model_name, includes)))
            raise self.model.fault(f"none of the models in it is known: {shortened(names)}")
        return {"objects": objects}

    def wet(self, shapes: Sequence[Content]) -> list[Content] | None:
        """The buoyancy of each body; None, with a note, for a model that would sink."""
        plugins = [one for one in self.model.all("plugin") if _is(one, "buoyancy")]
        wet = [part for one in plugins for part in self.buoyancy(one)]
        if wet or self.assembly.is_anchored:
            found = [[(drag, shape) for body, drag, shape in wet if body is own] for own in self.assembly.bodies]
            usual = _drag(plugins[0]) if plugins else {}
            alone = len(found) == 1
            return [_buoyancy(usual if alone else parts[0][0], parts) if parts else {} for parts in found]
        drag = _drag(plugins[0]) if plugins else {"linear_drag": DRAG[0], "angular_drag": DRAG[1]}
        solids = [[dict(one) for one in own["collisions"] if not isinstance(one, At) and one["type"] in DISPLACING]
                  for own in shapes]  # fmt: skip
        volume = sum(_volume(one) for own in solids for one in own)
        mass = sum(mass_of(body).mass for body in self.assembly.bodies)
        if mass >= volume * WATER_DENSITY:
            text = f"without buoyancy plugin it sinks ({mass:g} kg, {volume:.3g} m3): `static: true`"
            self.report.note(self.model, "approximated", text)
            return None
        self.report.note(self.model, "approximated", "without buoyancy plugin; its collision shapes displace water")
        return [_buoyancy(drag, [(drag, one) for one in own]) if own else {} for own in solids]

    def buoyancy(self, plugin: Element) -> Iterator[tuple[Body, Content, Content]]:
        """The shapes of a buoyancy plugin of VRX that displace water, each with its body and the plugin's drag."""
        known = {link.attributes.get("name"): (body, pose) for link, body, pose in self.assembly.links}
        for part in plugin.all("buoyancy"):
            link = part.text("link_name") or part.attributes.get("link_name")
            if link not in known:
                raise part.fault(
                    str(UnknownNameError("link", link or "", [name for name in known if name])), "link_name"
                )
            body, pose = known[link]
            shape = self.shape(part, pose)
            if shape is not None and shape["type"] in DISPLACING:
                yield body, _drag(plugin), shape
        self.report.note(plugin, "taken over", "`buoyancy`")

    def principal(self, inertial: Inertial) -> list[float]:
        """Moments of inertia along the axes of the body; products are left out."""
        moments = np.diag(inertial.inertia)
        products = np.abs(inertial.inertia - np.diag(moments)).max()
        if products > 1e-3 * moments.max():
            text = f"products of inertia up to {products:.3g} kg m2 are left out"
            self.report.note(self.model, "approximated", text)
        return [float(moment) for moment in moments]

    def inertia(self, body: Body) -> Content:
        """What a body weighs."""
        found = mass_of(body)
        return {
            "mass": found.mass,
            "center_of_mass": found.center.tolist(),
            "inertia": self.principal(found),
        }

    def all_shapes(self, body: Body) -> Content:
        """The collisions and visuals of a body."""
        return {key: list(self.shapes(tag, body)) for key, tag in (("collisions", "collision"), ("visuals", "visual"))}

    def shapes(self, tag: str, body: Body) -> Iterator[Content | At]:
        """The collisions or visuals of a body; that with a mesh of another folder is at a place in that."""
        for link, pose in body.parts:
            for part in link.all(tag):
                shape = self.shape(part, pose)
                if shape is None:
                    continue
                color, folder = _color(part) if tag == "visual" else None, shape.pop("folder", None)
                whole = shape | ({"color": color} if color else {})
                file = File(part.place.file.name, folder, part.place.file.lines)
                yield whole if folder is None else At(whole, part.place._replace(file=file))

    def shape(self, part: Element, link: Pose) -> Content | None:
        """A shape in the frame of the model; None: ours has none like it."""
        kind = part.child("geometry", "mesh")
        if kind is None:
            return _shape(part, link, self.report)
        found = self.mesh(kind)
        if found is None:
            return None
        scale = kind.numbers("scale", "x y z", (1.0, 1.0, 1.0))
        folder, file = found
        other = {} if folder is None else {"folder": folder}
        return {"type": "mesh", "file": At(file, kind.place), "scale": scale, **_placed(part, link), **other}

    def mesh(self, mesh: Element) -> tuple[Path | None, str] | None:
        """The folder of a mesh, None if it is the model's, and its path in it; None, with a note: it is not there."""
        uri = mesh.text("uri")
        scheme, _, rest = uri.partition("://")
        name, _, inside = rest.partition("/")
        there = scheme == "model" or (scheme == "file" and is_file(self.folder / inside))
        own = there and name in {self.folder.name, self.model.attributes.get("name")}
        path = inside if own else uri.removeprefix("file://")
        if "://" in path or PurePosixPath(path).is_absolute() or ".." in PurePosixPath(path).parts:
            return self.mesh_elsewhere(mesh, uri, uri)
        if scheme == "file" and inside and not is_file(self.folder / path):  # Gazebo looks along the path of models
            return self.mesh_elsewhere(mesh, uri, f"{SCHEME}{rest}")
        if not path.lower().endswith(MESH_SUFFIXES) or not is_file(self.folder / path):
            self.report.note(mesh, "ignored", f"no such mesh: {shown(uri)}", "<mesh>")
        elif not _is_inside(self.folder / path, self.folder) and not _is_installed(self.folder / path):
            self.report.note(mesh, "ignored", f"a link that leads out of the model's folder: {shown(uri)}", "<mesh>")
        else:
            return None, path
        return None

    def mesh_elsewhere(self, mesh: Element, uri: str, wanted: str) -> tuple[Path, str] | None:
        """Folder and path of a mesh of another model, in the package or along the paths; the URI may mean another."""
        try:
            if not uri.lower().endswith(MESH_SUFFIXES):
                raise VrxError(f"no such mesh: {shown(uri)}")
            name = wanted.removeprefix(SCHEME).partition("/")[0] if wanted.startswith(SCHEME) else ""
            place = _folder(name, self.folder)
            files = MeshFiles(self.folder, {name: place} if place else {}, (*package_paths(), *_model_paths()))
            return files.find(wanted)
        except VrxError as error:
            self.report.note(mesh, "ignored", str(error) if wanted == uri else f"no such mesh: {shown(uri)}", "<mesh>")
            return None


_SHAPES: Mapping[str, Callable[[Element], Content]] = {
    "box": lambda kind: {"size": kind.numbers("size", "x y z", (1.0, 1.0, 1.0))},
    "sphere": lambda kind: {"radius": kind.number("radius", 1.0)},
    "cylinder": lambda kind: {"radius": kind.number("radius", 1.0), "length": kind.number("length", 1.0)},
    "capsule": lambda kind: {"radius": kind.number("radius", 0.5), "length": kind.number("length", 1.0)},
    "ellipsoid": lambda kind: {"size": [2 * radius for radius in kind.numbers("radii", "x y z") or (1.0, 1.0, 1.0)]},
}
"""What a shape of SDF is here."""


def _placed(part: Element, link: Pose) -> Content:
    """The pose of a shape in the frame of its model."""
    place = At(list(compose(link, _pose(part))), part.place)
    return {} if place.value == list(HERE) else {"pose": place}


def _shape(part: Element, link: Pose, report: Report) -> Content | None:
    """A primitive in the frame of its model; None: ours has none like it."""
    geometry = part.child("geometry")
    kind = next(iter(geometry.children), None) if geometry else None
    if kind is None or kind.tag not in _SHAPES:
        report.note(part, "ignored", f"no shape like <{kind.tag}> here" if kind else "it has no geometry")
        return None
    return {"type": kind.tag, **_SHAPES[kind.tag](kind), **_placed(part, link)}


def _buoyancy(drag: Content, parts: Sequence[tuple[Content, Content]]) -> Content:
    """The buoyancy of a body."""
    return {"buoyancy": {**drag, "elements": [shape for _, shape in parts]}}


def _drag(plugin: Element) -> Content:
    """Density and drag of a buoyancy plugin."""
    density = {"fluid_density": plugin.number("fluid_density")} if plugin.child("fluid_density") else {}
    level = plugin.number("fluid_level", 0.0)
    drag = {key: plugin.number(key, 0.0) for key in ("linear_drag", "angular_drag")}
    return {**density, **({"fluid_level": level} if level else {}), **drag}


def _volume(shape: Content) -> float:
    if shape["type"] == "box":
        return math.prod(shape["size"])
    radius = float(shape["radius"])
    return 4 / 3 * math.pi * radius**3 if shape["type"] == "sphere" else math.pi * radius**2 * float(shape["length"])


def _color(visual: Element) -> list[float] | None:
    """The colour of a material: its diffuse or ambient one, or that of a stock material, as Gazebo/Red."""
    material = visual.child("material")
    if material is None:
        return None
    for tag in ("diffuse", "ambient"):
        found = material.child(tag)
        if found is not None and found.own_text:
            return found.read_numbers("r g b" if len(found.own_text.split()) == 3 else "r g b a")
    name = _STOCK.sub("_", material.text("script", "name").removeprefix("Gazebo/")).lower()
    return [*COLORS[name], 1.0] if name in COLORS else None
