"""A world of Gazebo, of either generation of VRX, as a world's file of ours."""

import itertools
import json
import math
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeGuard

from vrx_mj.config.kinds import CLASSIC, NEWER
from vrx_mj.config.loading import Loading, path_of, read_source, validate
from vrx_mj.config.objects import ObjectConfig
from vrx_mj.config.search import SCHEME, WORLD_SUFFIXES, catalogue
from vrx_mj.config.tree import File, Place, Section, literal
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError, Problem, VrxError, first_lines, ignore_warnings, nearest, shorten, warn
from vrx_mj.formats.gazebo.document import STRICT, Element, Note, Report, as_node, label, plugin_name, read_document
from vrx_mj.formats.gazebo.models import (
    NO_MODEL,
    has_model,
    hold_models,
    included_name,
    is_template,
    model_element,
    model_file,
    model_name,
    version_of,
)
from vrx_mj.formats.gazebo.sdf_boats import boat_pose, is_boat, read_boat
from vrx_mj.formats.gazebo.sdf_models import INSIDE, in_world_frame, pose_of, pose_of_included, safe_name
from vrx_mj.formats.gazebo.sdf_objects import buoyancy_of, follow_path, model_section, same_buoyancy
from vrx_mj.formats.gazebo.world_parts import (
    kind_of,
    markers_of,
    mean_wind,
    published_sea,
    scene,
    task_of,
    unread,
    view,
    wave_field,
    wave_plugin,
)
from vrx_mj.formats.series.pieces import (
    SYMBOLS,
    At,
    Content,
    Piece,
    assemble,
    base_objects,
    named_as,
    thing,
    with_places,
)
from vrx_mj.formats.urdf.elements import losses
from vrx_mj.formats.urdf.expand import Arguments

_TABLE: Mapping[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_bytes())
"""Terrains of VRX, and the worlds of ours that have them, for VRX 3 where it is another one; the fates of models by
their names and of plugins by what is found in theirs; elements of a wind plugin that name topics, and our names; and
what a file without a world is `instead`, by its element."""
_BASES = _TABLE["terrains"]
_WATER = {"ocean_waves", "coast_waves", "ocean", "waves"}
"""Models that are the water, which is everywhere here, that of asv_wave_sim the last."""
_WINDS = {"usvgazebowindplugin", "usvwind"}
"""VRX's wind plugins."""
_ONCE = {"scene", "gui", "spherical_coordinates", "gravity", "physics", "wind"}
"""Elements of which a world has one: in Gazebo the first, here in a xacro the last <scene>, as macros make one."""
NO_BOATS = "none"
"""Name of the fleet without boats."""
_BALL = "blue_projectile"
_TOLERANCE = 2e-3
"""Largest difference of numbers for which an object is that of the base [m, rad]."""
_STEEP = 1e-3
"""Slope up to which gravity points down."""
_GZ_SIM = (1, 7)
"""Version of SDF from which a world is one of gz-sim."""
_STALE_LINK = "base_link"
"""Name of the boat's link in VRX's files of 2019, which has another name since: their wind acts on nothing."""
_MOST_HINTS = 100
"""Unknown names of models for which a known one is guessed."""
_CANDIDATES = 20
"""Parts of one kind that are tried, one after the other, where a world has one of them."""
_SHOWN_NOTES = 6
"""Number of notes that a warning lists."""
_SURROUNDINGS: Mapping[str, tuple[str, Callable[[Element], object]]] = {
    "scene": ("scene", scene), "gui": ("camera", view),
    "spherical_coordinates": ("georeference", lambda element: element.fields("spherical_coordinates")),
}  # fmt: skip


@dataclass(frozen=True)
class GazeboWorld:
    """A world's file in our keys, with the fate of each part."""

    name: str
    section: Section
    whole: Section
    """`section` with a name; unless `STRICT` is set, on top of the world that it extends, and validated."""
    notes: tuple[Note, ...]
    fleet: Section | str | None = None
    """The boats that are in the world, as a fleet's file says them; without any "none", or None for that of a world of
    ours which it extends."""


def is_gazebo_world(source: object) -> TypeGuard[str | Path]:
    """Whether a source of a world is the path of a file of Gazebo."""
    return isinstance(source, str | Path) and str(source).lower().endswith(WORLD_SUFFIXES)


def gazebo_world(file: Path, arguments: Arguments | None = None) -> GazeboWorld:
    """The world in a file of Gazebo: `.world`, `.sdf` or `.world.xacro`.

    Raises:
        ConfigError: it cannot be read; or a part of it, where `STRICT` says so, with every problem and its place.
    """
    root = read_document(file, arguments)
    world = root if root.tag == "world" else root.child("world")
    if world is None:
        raise _no_world(root)
    if "#" in str(file):
        raise world.fault("the path contains '#', which separates a file from a model name: rename the file")
    hold_models(file, root)
    known, unread = catalogue("objects"), list[Note]()
    for turn in itertools.count():
        reader = _Reader(file, root, world, known, unread)
        try:
            return reader.world() if STRICT.get() else _validate(reader.world())
        except ConfigError as error:
            parts = {problem: part for problem in error.problems if (part := reader.part_of(problem))}
            if STRICT.get() or len(parts) < len(error.problems):
                raise
        for problem, part in parts.items():
            place = Place(File(problem.file, None), problem.line, problem.column)
            unread.append(Note(place, problem.key or label(part), "not read", problem.message))
        more = _alike(world, parts.values()) if turn >= _CANDIDATES else []
        warning = f"{_CANDIDATES} others of this kind cannot be read"
        unread += [Note(one.place, label(one), "not read", warning) for one in more]
        left = {id(part) for part in (*parts.values(), *more)}
        world = replace(world, children=tuple(child for child in world.children if id(child) not in left))
    raise AssertionError("a world without parts can be read")


def _validate(found: GazeboWorld) -> GazeboWorld:
    """A world, validated; what it warns of is said if nothing is wrong with it. Raises ConfigError."""
    whole = read_source("worlds", found.whole)
    with warnings.catch_warnings(record=True, action="always") as said:
        whole.model = validate(WorldConfig, whole, Loading())
    for message in {str(one.message): one.message for one in said}.values():
        warnings.warn(message, stacklevel=3)
    return replace(found, whole=whole)


def _alike(world: Element, parts: Iterable[Element]) -> list[Element]:
    """The other parts of a world of the kinds of some, but for models: of each kind one counts, if it can be read."""
    kinds = {(one.tag, plugin_name(one)) for one in parts if one.tag not in INSIDE}
    alike = (one for one in world.children if (one.tag, plugin_name(one)) in kinds)
    return [one for one in alike if not any(one is part for part in parts)]


def world_of(file: Path, root: Element, world: Element, known: Mapping[str, Path]) -> GazeboWorld:
    """A world, by the root of its file and its element, and the objects of the catalogue. Raises ConfigError."""
    return _Reader(file, root, world, known).world()


def world_document(source: str | Path) -> tuple[Section, str]:
    """Content of a world's file of Gazebo in our keys, and the world's name."""
    found = gazebo_world(path_of("worlds", source))
    warn_of_losses(found.notes, str(source), stacklevel=5)
    return read_source("worlds", found.whole), found.name


def warn_of_losses(notes: Sequence[Note], source: str, *, stacklevel: int) -> None:
    """One warning of the parts of a file that are another way here, or not at all."""
    once = dict.fromkeys(notes)
    lost = [note for note in once if note.fate != "imported"]
    if lost:
        places = (":".join(map(str, filter(None, (note.place.file.name, note.place.line)))) for note in lost)
        lines = (f"{place}: {note.what} {note.fate}: {note.ours}" for place, note in zip(places, lost, strict=True))
        head = f"{source}: {len(lost)} of {len(once)} parts differ from Gazebo (`vrx-mj import` lists all)"
        warn("\n  ".join([head, *first_lines(lines, _SHOWN_NOTES)]), stacklevel)


def _no_world(root: Element) -> ConfigError:
    instead, empty = _TABLE["instead"], "this <sdf> has none" if root.tag == "sdf" else f"got <{root.tag}>"
    inside = next((child.tag for child in root.children if child.tag in instead), root.tag)
    return root.fault(f"expected <sdf> with a <world>; {instead.get(inside, empty)}")


class _Reader:
    """One world being read: its pieces so far, and what became of the parts of the file."""

    def __init__(
        self, file: Path, root: Element, world: Element, known: Mapping[str, Path], notes: Iterable[Note] = ()
    ) -> None:  # fmt: skip
        self.file = file
        self.root = world
        first = root.child("world") or root
        self.others = [one for one in root.children if one is not first] if first is not root else []
        self.report = Report([*notes])
        self.note = self.report.note
        self.parts: dict[Problem, Element] = {}
        """Part of the world in which each problem is."""
        self.pieces: list[Piece] = []
        self.placed: list[tuple[Element, Content]] = []
        self.scoring: list[Element] = []
        self.terrain: Element | None = None
        self.boats: list[Content] = []
        self.afloat: list[tuple[Element, str]] = []
        self.models: dict[str, Element | None] = {}
        self.known = known
        self.told: set[str] = set()
        self.hints: dict[str, str] = {}
        names = (one.attribute("name") for one in root.walk() if one.tag == "plugin")
        self.newer = version_of(root) >= _GZ_SIM or any(name.startswith(("gz::", "vrx::")) for name in names)
        """Whether the world is one of gz-sim: by its version of SDF, or by its plugins."""

    def world(self) -> GazeboWorld:
        """The whole world, with the report on its parts."""
        self.lose(replace(self.root, children=()))
        for part, child in zip(self.root.children, in_world_frame(self.root, self.file), strict=True):
            self.take_part(part, child)
        for other in self.others:
            self.note(other, "ignored", "only the first world of a file is read")
        try:
            self.finish()
        except ConfigError as error:
            self.report.problems += error.problems
        self.report.settle()
        place = self.root.place
        name = safe_name(self.root.attributes.get("name") or self.file.name.partition(".")[0])
        section = assemble({"description": f"{shorten(self.file.name)}, a world of Gazebo"}, place, self.pieces)
        whole = section.holding({"name": name, **section})
        fleet: Section | str | None = NO_BOATS if self.terrain is None else None
        if self.boats:
            fleet = with_places({"name": name, "boats": self.boats}, place)
        return GazeboWorld(name, section, whole, tuple(self.report.notes), fleet)

    def add_boat(self, element: Element, name: str, robot: str) -> None:
        """Add a boat of the fleet."""
        self.afloat.append((element, safe_name(name)))
        folder = self.file.absolute().parent
        with ignore_warnings():  # said again where it is loaded
            read_boat(model_file(robot, folder))
        included, report = element.tag == "include", self.report
        pose, place = pose_of_included(element, folder, report) if included else pose_of(element, report)
        whole = At(list(boat_pose(pose, model_file(robot, folder))), place)
        self.boats.append({"name": safe_name(name), "pose": whole, "robot": At(robot, element.place)})
        self.note(element, "imported", "a boat, unless a fleet is given")

    def take_part(self, part: Element, child: Element | ConfigError) -> None:
        """Take over a part of the world, in its frame; what is wrong is kept for the end."""
        try:
            if isinstance(child, ConfigError):
                raise child
            self.take(child)
        except VrxError as error:
            problems = (error if isinstance(error, ConfigError) else part.fault(str(error))).problems
            self.report.problems += problems
            self.parts |= dict.fromkeys(problems, part)

    def part_of(self, problem: Problem) -> Element | None:
        """The part of the world in which a problem is; None: in no one."""
        if problem in self.parts:
            return self.parts[problem]
        spot = problem.line or 0, problem.column or 0
        own = (part for part in self.root.children if part.place.file.name == problem.file)
        spots = (((part.place.line or 0, part.place.column or 0), part) for part in own)
        return max((one for one in spots if one[0] <= spot), key=itemgetter(0), default=(None, None))[1]

    def take(self, element: Element) -> None:
        """Take over one element of the world."""
        if self.is_second(element.tag, element):
            return
        self.lose(replace(self.root, attributes={}, children=(element,)))
        if element.tag in _TAKE:
            _TAKE[element.tag](self, element)

    def lose(self, world: Element) -> None:
        """Note what is lost of the world, or of a part of it in a world by itself."""
        self.report.lose(losses(as_node(world).element, "world", "world"))

    def is_second(self, tag: str, element: Element) -> bool:
        """Whether another element counts in the place of this one, which is noted."""
        last = tag == "scene" and self.file.suffix == ".xacro"
        counts = self.root.all(tag)[-1 if last else 0] if tag in _ONCE else element
        if counts is not element:
            text = f"only the {'last' if last else 'first'} <{tag}> is read, on line {counts.place.line}"
            self.note(element, "ignored", text)
        return counts is not element

    def add(self, part: str, element: Element, content: object, without: str = "") -> None:
        """Add a part of the world; without content note why it is ignored."""
        if content is None:
            self.note(element, "ignored", without)
        else:
            self.add_piece(part, element, {part: content}, f"`{part}`")

    def add_piece(self, part: str, element: Element, content: Content, ours: str) -> None:
        """Add a piece of the world, in which may be keys of other parts."""
        self.pieces.append(Piece(part, label(element), element.place, (label(element),), content))
        self.note(element, "imported", ours)

    def take_include(self, element: Element) -> None:
        """Take over a model by its name."""
        name = model_name(element)
        if name in _BASES and self.terrain is not None:
            raise element.fault(f"a world has one terrain, already set on line {self.terrain.place.line}")
        if name in _BASES:
            self.terrain = element
        elif name in _TABLE["models"] and not (name in _WATER and has_model(name, self.file.parent)):
            self.note(element, *_TABLE["models"][name])
        else:
            self.place(element, name)

    def place(self, element: Element, name: str) -> None:
        """Place an object."""
        ours = self.catalogue_model(name, element)
        if ours is None and not has_model(name, self.file.parent):
            self.note(element, "ignored", f"no model named '{name}'; {self.hint(name)}")
            return
        source = f"{SCHEME}{name}"
        if ours is None:
            if name not in self.models:
                file = model_file(source, self.file.parent)
                self.models[name] = None if is_template(file) else model_element(file).model
            model = self.models[name]
            if model is not None and not self.is_object(element, model, name, source):
                return
        numbered = element.child("name") is not None and not element.text("name")  # as `insert_model` has it
        own = None if numbered else At(safe_name(element.text("name") or named_as(name)), element.place)
        report, folder = self.report, self.file.parent
        pose = pose_of(element, report) if ours else pose_of_included(element, folder, report)
        content = thing(At(ours or name, element.place), pose, own)
        if ours is None:
            source = f"{self.file.name}#{included_name(element)}" if element.child("static") else source
            content["model"] = At(source, element.place)
            self.tell(source, folder)
        path = follow_path(element, report)
        if path is not None:
            content["path"] = At(path, element.place)
        self.placed.append((element, content))

    def is_object(self, element: Element, model: Element, name: str, source: str) -> bool:
        """Whether a model is an object; the water, a boat, and what has no body are taken over here."""
        if self.take_water(element, model, name):
            return False
        if not any(one.tag in {"link", *INSIDE} for one in model.children):
            self.note(element, "ignored", "the model has no links")
            return False
        if element.value_of("static", "switch") or not is_boat(model):
            return True
        self.add_boat(element, element.text("name") or name, source)
        return False

    def take_water(self, element: Element, model: Element, name: str) -> bool:
        """Take over a model that is the water, with its waves; False: it is another."""
        waves = wave_plugin(model)
        if waves is not None:
            sea = wave_field(waves)
            ours = f"`sea`{', fully raised by that wind' * (sea['model'] == 'pm')}"
            self.add_piece("sea", waves if model is element else element, {"sea": sea}, ours)
        elif name in _WATER:
            self.note(element, "imported", "the water, which is everywhere")
        return waves is not None or name in _WATER

    def tell(self, model: str, folder: Path) -> None:
        """Note what becomes of the parts of a model, and of those in it."""
        file = model_file(model, folder)
        if str(file) in self.told:
            return
        self.told.add(str(file))
        section = model_section(file, self.report)
        validate(ObjectConfig, section, Loading((file.resolve(),)))
        for one in section.get("objects", ()):
            if str(one["model"]).startswith(SCHEME):
                self.tell(str(one["model"]), Path(str(file).partition("#")[0]).parent)

    def hint(self, name: str) -> str:
        """Hint at the model that an unknown name may mean; guesses are slow, and are made for the first names alone."""
        if name not in self.hints and len(self.hints) < _MOST_HINTS:
            close = nearest(name, self.known)
            self.hints[name] = f"did you mean '{close}'?" if close else NO_MODEL
        return self.hints.get(name, NO_MODEL)

    def catalogue_model(self, name: str, include: Element) -> str | None:
        """The model of our catalogue that an include of VRX means; None: it has none.

        VRX 3 says in the include what a model displaces: of ours, the one that displaces the same.
        """
        names = [f"{name}_2023", name.replace("2022", "2023"), name] if self.newer else [name]
        known = [one for one in names if one in self.known or SYMBOLS.fullmatch(one)]
        given = buoyancy_of(include, self.report)
        if given is None or not known:
            return next(iter(known), None)
        kinds = [one for one in (known[0], *self.known) if one == known[0] or one.startswith(f"{name}_2023_")]
        found = next((one for one in kinds if same_buoyancy(given, self.buoyancy(one))), None)
        if found is None:
            self.note(include, "approximated", f"`{known[0]}`, whose buoyancy shape or drag differs")
        return found or known[0]

    def buoyancy(self, model: str) -> Content:
        """Buoyancy of a model of the catalogue, as its file has it."""
        file = self.known.get(model)
        return (read_source("objects", file).get("buoyancy") if file else None) or {"elements": ()}

    def take_model(self, element: Element) -> None:
        """Take over a model that is written into the world."""
        name = element.attributes.get("name", "")
        source = f"{self.file.name}#{name}"
        if not name and wave_plugin(element) is None:
            raise element.fault("required, but missing", "name")
        if not self.is_object(element, element, name, source):
            return
        self.tell(source, self.file.parent)
        content = {"name": safe_name(name), "model": At(source, element.place), "pose": pose_of(element, self.report)}
        self.placed.append((element, content))

    def take_plugin(self, element: Element) -> None:
        """Take over a plugin of the world."""
        name = plugin_name(element)
        if kind_of(element):
            self.scoring.append(element)
        elif name in _WINDS:
            self.add("wind", element, element.fields("wind"))
            if any(thing.text("link_name") == _STALE_LINK for thing in element.all("wind_obj")):
                self.note(element, "approximated", "its link `base_link` is taken as the boat", "<wind_obj>")
            for tag, topic in _TABLE["topics"].items():
                if element.text(tag) not in {"", topic}:
                    self.note(element, "ignored", f"the topic is always `{topic}`", f"<{tag}>")
        elif "publisherplugin" in name:
            self.add("sea", element, published_sea(element), "nothing here subscribes to what it publishes")
        else:
            known = "contain" if element.child("performer") else name
            self.note(element, *next(said for pattern, *said in _TABLE["plugins"] if re.search(pattern, known)))

    def take_wind(self, element: Element) -> None:
        """Take over the wind of gz-sim, which acts on boats with sails, areas or coefficients."""
        plugin = next((one for one in self.root.all("plugin") if plugin_name(one) in _WINDS), None)
        if plugin is not None:
            self.note(element, "ignored", f"the wind plugin on line {plugin.place.line} is used instead")
            return
        if element.value_of("linear_velocity", "x y z", (0.0,))[-1]:
            self.note(element, "approximated", "wind is horizontal: the third number is ignored")
        self.add("wind", element, mean_wind(element), "there is no wind")

    def take_surroundings(self, element: Element) -> None:
        """Take over light, sky and fog; the pose of the view; or where the world is on Earth."""
        part, read = _SURROUNDINGS[element.tag]
        self.add(part, element, read(element), "only for Gazebo's GUI")

    def take_physics(self, element: Element) -> None:
        """Take over the physics, as far as it is not ours; older files have gravity in it."""
        for gravity in element.all("gravity")[:1]:
            self.take_gravity(gravity)
        step = element.value_of("max_step_size")
        usual = 0.004 if self.newer else 0.01
        if step is None or step == usual:
            self.note(element, "imported", f"`physics`: a step of {usual:g} s")
        else:
            self.note(element, "approximated", f"a step of {usual:g} s, not {step:g} s: `physics: timestep`")

    def take_gravity(self, element: Element) -> None:
        """Take over gravity."""
        x, y, z = element.value("x y z")
        if z > 0 or math.hypot(x, y) > _STEEP * -z:
            raise element.fault(f"gravity must point down, got {literal(element.own_text)}")
        if x or y:
            self.note(element, "approximated", "gravity is taken straight down")
        self.add_piece("gravity", element, {"physics": {"gravity": -z}}, "`physics: gravity`")

    def finish(self) -> None:
        """Add what needs the whole file: the base, the objects that it lacks, and the task."""
        base = self.base()
        extended = any(piece.part == "base" for piece in self.pieces)
        if not extended:
            profile = NEWER if self.newer else CLASSIC
            physics = Piece("physics", profile, self.root.place, (), {"physics": {"profile": profile}})
            self.pieces = [physics, *self.pieces]
        others: list[tuple[Element, Content]] = []
        for element, content in self.placed:
            if any(_same(content, one) for one in base):
                self.note(element, "imported", "part of the extended world")
            else:
                self.note(element, "imported", "`objects`")
                others.append((element, content))
        self.check_names(others, base)
        objects = [content for _, content in others]
        if objects:
            self.pieces.append(Piece("objects", "objects", self.root.place, ("objects",), {"objects": objects}))
        if self.scoring:
            self.add_task(objects)

    def check_names(self, placed: Iterable[tuple[Element, Content]], base: Sequence[Section]) -> None:
        """Keep the problem of each model whose name another one has already, in the world or in its base."""
        first: dict[str, str] = {}
        if self.terrain is not None:
            where = f"is part of the terrain on line {self.terrain.place.line}"
            first = {str(one["name"]): where for one in base if "name" in one}
        things = [(element, content["name"]) for element, content in placed if "name" in content]
        for element, said in sorted([*things, *self.afloat], key=lambda one: one[0].place.line or 0):
            name, is_included = str(_plain(said)), element.tag == "include"
            if name in first:
                key = "<name>" if is_included else "name"
                text = f"a model named '{name}' {first[name]} already: change one {key}"
                self.report.problems += element.fault(text).problems
            first.setdefault(name, f"is {'included' if is_included else 'defined'} on line {element.place.line}")

    def base(self) -> list[Section]:
        """Extend the world that has this one's terrain, and return the objects that it brings."""
        if self.terrain is None:
            return []
        element, name = self.terrain, model_name(self.terrain)
        world = (_TABLE["newer_terrains"] if self.newer else {}).get(name, _BASES[name])
        found = base_objects(Section({"extends": world}, element.place))
        here = [content for _, content in self.placed]
        missing = [one for one in found if one["model"] != _BALL and not any(_same(other, one) for other in here)]
        if missing:
            self.note(element, "approximated", f"`extends: {world}`, which also has {missing[0]['name']}")
        else:
            self.note(element, "imported", f"`extends: {world}`")
        extended = Piece("base", label(element), element.place, (label(element),), {"extends": world})
        self.pieces = [extended, *self.pieces]
        return list(found)

    def add_task(self, objects: list[Content]) -> None:
        """Add the task of the scoring plugins."""
        named = [{"name": _plain(one.get("name", one["model"])), "model": str(_plain(one["model"]))} for one in objects]
        plugin, task = task_of(self.scoring, named)
        earth = next((one.content["georeference"] for one in self.pieces if one.part == "georeference"), None)
        for place in [*task.get("waypoints", ()), *([task["goal"]] if "goal" in task else ())]:
            place[2] += math.radians(earth["heading"] if earth else 0.0)  # of a plugin it is from x, of ours from east
        markers = markers_of(plugin)
        self.add_piece("task", plugin, {"task": task, **({"markers": markers} if markers else {})}, "`task`")
        for element, reason in unread(plugin):
            self.note(element, "ignored", reason)
        for other in self.scoring:
            if other is not plugin and task["type"] == "gymkhana":
                self.note(other, "imported", "part of the gymkhana")
            elif other is not plugin:
                self.note(other, "ignored", "only the task of the first scoring plugin is read")


def _same(content: Content, other: Content) -> bool:
    """Whether an object is that of the base: of its model, at its pose."""
    if _plain(content["model"]) != other["model"]:
        return False
    ours, theirs = _plain(content["pose"]), other.get("pose", (0.0,) * 6)
    return all(abs(a - b) <= _TOLERANCE for a, b in zip(ours, theirs, strict=True))


def _plain(value: Any) -> Any:
    return value.value if isinstance(value, At) else value


_TAKE: Mapping[str, Callable[[_Reader, Element], None]] = {
    "include": _Reader.take_include, "model": _Reader.take_model, "plugin": _Reader.take_plugin,
    "physics": _Reader.take_physics, "gravity": _Reader.take_gravity, "wind": _Reader.take_wind,
    **dict.fromkeys(_SURROUNDINGS, _Reader.take_surroundings),
}  # fmt: skip
