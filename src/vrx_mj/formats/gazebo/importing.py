"""Files of Gazebo and ROS written as files of ours, with a table of what became of each part."""

import contextlib
import html
import os
from collections import ChainMap
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from vrx_mj.config.kinds import wrong_kind
from vrx_mj.config.loading import Loading, read_source, validate
from vrx_mj.config.objects import ObjectConfig
from vrx_mj.config.robots import load_robot, robot_section
from vrx_mj.config.search import SCHEME, XML_SUFFIXES, display, kind_name, package_paths
from vrx_mj.config.tree import File, Items, Place, Section
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import UnknownNameError, VrxError, ignore_warnings, shorten
from vrx_mj.foreign import budget
from vrx_mj.formats.gazebo.document import Fate, Note, Report, is_file, label
from vrx_mj.formats.gazebo.launch import launch_of
from vrx_mj.formats.gazebo.launched import Launch, fleet_of, objects_of
from vrx_mj.formats.gazebo.models import is_gazebo_model, model_element, model_file
from vrx_mj.formats.gazebo.opening import files_below, has_world, is_folder, joined_world
from vrx_mj.formats.gazebo.sdf_boats import is_boat, read_boat
from vrx_mj.formats.gazebo.sdf_models import safe_name
from vrx_mj.formats.gazebo.sdf_objects import model_section
from vrx_mj.formats.gazebo.worlds import gazebo_world, is_gazebo_world
from vrx_mj.formats.series.worlds import section_text
from vrx_mj.formats.urdf.elements import unused_name
from vrx_mj.formats.urdf.expand import Arguments, ExpandedText, check_library, declared_names, expand, own_packages
from vrx_mj.formats.urdf.expand import arguments as declared_arguments
from vrx_mj.formats.urdf.reader import MeshFiles, with_mesh_names
from vrx_mj.formats.urdf.xml_document import file_error, has_xacro, read_bytes
from vrx_mj.packages import root

TABLE = "import.md"
"""Name of the file with the table."""
TITLE = "# What became of each part\n"
"""How that file begins: what is in a folder with one may be written over."""
HEAD = "# Made by vrx-mj import from "
"""How each file that is written begins, so that a later import may write over it."""
_ROBOTS = (".urdf", ".urdf.xacro")
"""Ends of names of files of boats."""
_KINDS = (".world", ".world.xacro", ".launch", ".sdf", ".sdf.erb", *_ROBOTS)
"""Ends of names of files that a folder is searched for."""
_EXPANDED = {"urdf", "arguments", "layouts", "suites"}
"""Keys of a robot's YAML that are about its xacro."""
FATES: tuple[Fate, ...] = ("imported", "approximated", "ignored", "not read")


@dataclass
class ImportResult:
    """Files that an import writes, as texts and copies by their paths in the folder, and the notes for the table."""

    texts: dict[str, str] = field(default_factory=dict)
    copies: dict[str, Path] = field(default_factory=dict)
    notes: list[Note] = field(default_factory=list)
    sails: list[tuple[str, str | None]] = field(default_factory=list)
    """Simulations: each a world, by its path in the folder or its name, and the path of a fleet or None."""
    failed: list[str] = field(default_factory=list)
    """Messages of files that could not be read."""
    paths: dict[tuple[str, str], str] = field(default_factory=dict)
    """Paths of what is written, by its folder and what it is made from."""
    robots: set[Path] = field(default_factory=set)
    """Files of boats that are written."""

    def count(self, fate: Fate) -> int:
        """How many parts became of a kind."""
        return sum(note.fate == fate for note in dict.fromkeys(self.notes))

    def table(self) -> str:
        """The table, as Markdown."""
        notes = sorted(dict.fromkeys(self.notes), key=lambda note: (note.place.file.name, note.place.line or 0))
        places = (f"{shorten(note.place.file.name)}:{note.place.line or 1}" for note in notes)
        table = ((place, note.what, note.fate, note.ours) for place, note in zip(places, notes, strict=True))
        cells = (
            (html.escape(" ".join(text.split()), quote=False).replace("|", "\\|") for text in row) for row in table
        )
        rows = [f"| {' | '.join(row)} |" for row in cells]
        head = [TITLE, "| file | part | | here |", "|---|---|---|---|"]
        failed = ["", "# Files that were not read", "", *(f"- {message}" for message in self.failed)]
        return "\n".join([*head, *rows, *(failed if self.failed else ()), ""])

    def path_of(self, folder: str, name: str, source: str, ending: str = ".yaml") -> str:
        """The path in the folder of what is made from a source: two of one name are numbered."""
        if (folder, source) not in self.paths:
            taken = {path.removesuffix(ending) for path in self.paths.values() if path.endswith(ending)}
            self.paths[folder, source] = f"{unused_name(f'{folder}{name}', taken)}{ending}"
        return self.paths[folder, source]

    def add(self, file: Path, arguments: dict[str, str]) -> None:
        """Import a file by its kind."""
        name = file.name.lower()
        if name.endswith(".launch"):
            self.add_launch(file, launch_of(str(file), arguments))
        elif is_gazebo_world(file) and has_world(file):
            self.add_world(file, arguments)
        elif name.endswith(".sdf") and is_boat(model_element(file)[0]):
            self.add_fleet_of(file, self.add_boat(str(file.absolute()), file))
        elif name.endswith(XML_SUFFIXES) and is_file(file):
            self.add_fleet_of(file, self.add_robot(_stem(file), file, arguments))
        elif is_gazebo_model(file.name) or name.endswith(".erb"):
            self.add_object(_model_name(str(file)), file, str(file))
        else:
            if not os.path.lexists(file):
                raise VrxError(f"no file or folder '{shorten(file)}'")
            wanted = f"a file to import, which ends in {', '.join(_KINDS)}; or a folder"
            raise VrxError(f"'{file}' is {wrong_kind(file, wanted) or f'not {wanted}'}")

    def add_world(self, file: Path, arguments: Arguments) -> str:
        """Write a world with the objects, the boats and the fleet that it brings, and return its path."""
        world = gazebo_world(file, arguments)
        with ignore_warnings():  # `vrx-mj run` says them again
            validate(WorldConfig, read_source("worlds", world.section), Loading(), name=world.name)
        path = self.path_of("", _stem(file), str(file.resolve()))
        if path in self.texts:
            return path
        self.notes += world.notes
        self.texts[path] = self.text(file, self.with_objects(world.section, file.parent))
        fleet = world.fleet
        if isinstance(fleet, Section):
            models = [str(boat["robot"]) for boat in fleet["boats"]]
            robots = [self.add_boat(model, model_file(model, file.parent)) for model in models]
            fleet = self.write("fleet", file, _with_robots(fleet, robots))
        self.sails.append((path, fleet))
        return path

    def add_fleet_of(self, file: Path, robot: str) -> None:
        """Write a fleet of one boat, by the path of its URDF."""
        place = Place(File(display(file), file.absolute().parent))
        stem = Path(robot).stem
        self.write("fleet", file, Section({"robot": f"./{robot}"}, place), stem)

    def add_boat(self, source: str, file: Path) -> str:
        """Write a boat as a URDF, with its meshes beside it, and return its path."""
        path = self.path_of("robots/", _model_name(source), str(file.resolve()), ".urdf")
        if path in self.texts:
            return path
        stem = Path(path).stem
        with ignore_warnings():
            boat = read_boat(file)
        model = model_element(file)[0]
        self.notes.append(Note(model.place, label(model), "imported", f"`{path}`, a boat"))
        report = Report()
        report.lose((*boat.remarks, *boat.gazebo.warnings), "approximated")
        self.notes += report.notes
        text = boat.text
        for shape in (shape for link in boat.links.values() for shape in (*link.collisions, *link.visuals)):
            if shape.folder is not None:
                source_file = shape.folder / str(shape.file)
                own = self.add_copy("robots", stem, source_file, str(shape.file))
                text = text.replace(quoteattr(source_file.resolve().as_uri()), quoteattr(own))
        self.texts[path] = text
        return path

    def add_robot(self, name: str, file: Path, arguments: Arguments) -> str:
        """Write the URDF of a boat, with its meshes and what the YAML beside it says, and return its path."""
        read_bytes(file)  # what cannot be read is refused
        where = f"./{file.name}", file.absolute().parent
        with ignore_warnings():
            config, section = load_robot(*where), robot_section(*where)
            chosen = (*islice(config.layouts.values(), 1), config.suites.get("vrx", {}))
            given = ChainMap(dict(arguments), *map(dict, reversed(chosen)), config.arguments)
            text = _urdf(config.description_file, given)
        if "<link" not in text:
            check_library(config.description_file)
        kept = {key: value for key, value in section.items() if key not in _EXPANDED}
        path = self.path_of("robots/", name, f"{text}{kept}", ".urdf")
        self.robots.add(file.resolve())
        if path in self.texts:
            return path
        stem = Path(path).stem
        files = MeshFiles(config.description_file.absolute().parent, own_packages(), package_paths())
        self.texts[path] = with_mesh_names(text, files, partial(self.add_mesh, stem))
        place = Place(File(display(file), file.absolute().parent))
        self.notes.append(Note(place, "<robot>", "imported", f"`{path}`, a boat"))
        left_out = text.made.left_out if isinstance(text, ExpandedText) else ()
        self.notes += [Note(place, "<robot>", "not read", one) for one in left_out]
        if kept:
            self.texts[f"robots/{stem}.yaml"] = self.text(file, section.holding(kept))
        return path

    def add_mesh(self, robot: str, folder: Path, name: str) -> str | None:
        """Copy a mesh of a boat, and return its path beside the URDF; None: it is one of ours, which are everywhere."""
        source = (folder / name).resolve()
        ours = source.is_relative_to((root() / "assets").resolve())
        return None if ours else self.add_copy("robots", robot, source, name)

    def add_copy(self, area: str, owner: str, source: Path, name: str) -> str:
        """Copy a mesh, and return its path beside the file of what it belongs to: others of its name are numbered."""
        names = (f"meshes/{owner}/{number}{name}" for number in ("", *(f"{count}/" for count in range(2, 1000))))
        own = next(own for own in names if self.copies.get(f"{area}/{own}", source) == source)
        self.copies[f"{area}/{own}"] = source
        return own

    def with_objects(self, section: Section, folder: Path | None, here: str = "") -> Section:
        """A section, to be written to `here`, whose models of Gazebo are objects of ours, which are written too.

        Paths of models begin in the folder, by default in that of what names them.
        """
        objects = section.get("objects")
        if not isinstance(objects, Items):
            return section
        renamed = []
        for thing in objects:
            model = str(thing["model"])
            if is_gazebo_model(model):
                path = self.add_object(_model_name(model), model_file(model, folder or thing.folder), model)
                renamed.append(thing.holding({**thing, "model": f"./{path.removeprefix(here)}"}))
            else:
                renamed.append(thing)
        return section.holding({**section, "objects": Items.of(renamed, objects.places)})

    def add_object(self, name: str, file: Path, source: str) -> str:
        """Write an object, with its meshes beside it, and return its path."""
        path = self.path_of("objects/", name, str(file.absolute()))
        if path in self.texts:
            return path
        report = Report()
        section = model_section(file, report)
        with ignore_warnings():
            validate(ObjectConfig, section, Loading((file.resolve(),)))
        self.notes += report.notes
        self.texts[path] = ""
        folder = Path(str(file).partition("#")[0]).parent
        stem = Path(path).stem
        content = self.with_meshes(self.with_objects(section, folder, "objects/"), folder, stem)
        self.texts[path] = self.text(Path(source), content)
        return path

    def with_meshes(self, value: object, folder: Path, name: str) -> Any:
        """A section whose meshes are copied beside the object."""
        if isinstance(value, Section):
            inside = {key: self.with_meshes(item, folder, name) for key, item in value.items()}
            if value.get("type") == "mesh" and "file" in value:
                source = ((value.folder or folder) / value["file"]).resolve()
                inside["file"] = self.add_copy("objects", name, source, value["file"])
            return value.holding(inside)
        if isinstance(value, Items):
            return Items.of((self.with_meshes(item, folder, name) for item in value), value.places)
        return value

    def add_launch(self, file: Path, launch: Launch) -> None:
        """Write the world and the fleet of a launch file."""
        self.notes += launch.report.notes
        world = self.add_world(launch.world, {}) if isinstance(launch.world, Path) else launch.world
        if launch.objects and world is not None:
            assert launch.world is not None, "a launch file that opens a world"
            with ignore_warnings():
                section, _ = joined_world(launch.world, launch, None)
                validate(WorldConfig, read_source("worlds", section), Loading())
            items = objects_of(launch)
            base = f"./{world}" if world in self.texts else world
            own = Section({"extends": base, "objects": items}, items.places[0])
            world = self.write("world", file, self.with_objects(own, None))
        fleet = fleet_of(launch)
        if fleet is None:
            known = {name for name, _ in self.sails}
            self.sails += [(world, launch.fleet_of_world)] if world is not None and world not in known else []
            return
        robots: list[str | None] = [None] * (len(fleet.get("boats", ())) - len(launch.boats))
        for boat in launch.boats:
            if not isinstance(boat.model, Path):
                robots.append(None)
            elif is_gazebo_model(boat.model.name):
                robots.append(self.add_boat(str(boat.model.absolute()), boat.model))
            else:
                robots.append(self.add_robot(safe_name(boat.name), boat.model, boat.arguments))
        path = self.write("fleet", file, _with_robots(fleet, robots))
        if world is not None:
            self.sails.append((world, path))

    def write(self, kind: str, file: Path, section: Section, stem: str = "") -> str:
        """Write the fleet or the world of a file, and return its path."""
        path = self.path_of("", f"{stem or _stem(file)}_{kind}", f"{kind} of {file.resolve()}")
        self.texts[path] = self.text(file, section)
        return path

    def text(self, source: Path, section: Section) -> str:
        """A file of ours."""
        return f"{HEAD}{shorten(source.name)}\n{section_text(section)}"


@budget()
def import_files(source: Path, arguments: Arguments | None = None) -> ImportResult:
    """Import a file of Gazebo or ROS, or all such files of a folder.

    Args:
        source: a world (`.world`, `.world.xacro`, `.sdf`), a launch file, a boat (`.urdf`, `.xacro`), a model or its
            folder, a dock's template (`.sdf.erb`), or a folder of them.
        arguments: arguments of the launch file or of the xacro.

    Raises:
        ConfigError: the file is wrong; of a folder wrong files are listed in `failed` instead.
        VrxError: there is nothing to import.
    """
    made = ImportResult()
    if not is_folder(source):
        _check_arguments(source, arguments or {})
        made.add(source, dict(arguments or {}))
        return made
    if arguments:
        raise VrxError(f"NAME:=VALUE needs one launch file or xacro, not the folder {display(source)}")
    files = list(files_below(source, _KINDS))
    if not files:
        raise VrxError(f"no file to import in {display(source)}: none ends in {', '.join(_KINDS)}")
    for file in sorted(files, key=lambda file: file.name.lower().endswith(_ROBOTS)):  # launch files bring boats
        try:
            if not file.name.lower().endswith(_ROBOTS) or (file.resolve() not in made.robots and _has_links(file)):
                made.add(file, {})
        except VrxError as error:
            made.failed += str(error).splitlines()
    if not made.texts and made.failed:
        raise VrxError("\n".join(made.failed))
    if not (made.texts or made.notes or made.sails):
        raise VrxError(f"no file to import in {display(source)}: its xacro files only define macros")
    return made


def _check_arguments(file: Path, arguments: Arguments) -> None:
    """Raise a VrxError where a file that is no launch file does not declare what it is given."""
    if not arguments or file.name.lower().endswith(".launch"):
        return
    known: Collection[str] = ()
    if file.name.lower().endswith(".xacro") and is_file(file):
        known = declared_arguments(file) if is_gazebo_world(file) else declared_names(file, arguments, package_paths())
    name = next((name for name in arguments if name not in known), None)
    if name is not None:
        message = str(UnknownNameError("argument", name, known))
        raise file_error(file, message, f"{name}:=")


def _urdf(file: Path, arguments: Arguments) -> str:
    """The URDF of a description, expanded if there is something to expand."""
    text = read_bytes(file).decode("utf-8", errors="replace")
    if not has_xacro(text):
        return text
    with ignore_warnings():
        return expand(file, arguments=arguments, package_paths=package_paths())


def _has_links(file: Path) -> bool:
    """Whether a file describes a boat, and does not only define macros for others; one that cannot be read does."""
    with contextlib.suppress(VrxError):
        return "<link" in _urdf(file, {})
    return True


def _stem(file: Path) -> str:
    """The name of a file without its ending, as names are here."""
    return safe_name(file.name.partition(".")[0])


def _model_name(source: str) -> str:
    """The name of a model, `model://NAME` or a path: its own, that of its folder, or of its file."""
    return safe_name(source.removeprefix(SCHEME) if source.startswith(SCHEME) else kind_name(source))


def _with_robots(fleet: Section, robots: Sequence[str | None]) -> Section:
    """A fleet whose boats are of robots that are written at these paths; of None they stay."""
    if not robots:
        return fleet
    boats = []
    for boat, robot in zip(fleet["boats"], robots, strict=True):
        own = {key: value for key, value in boat.items() if key != "arguments"}  # which are in the robot then
        boats.append(boat.holding({**own, "robot": f"./{robot}"}) if robot else boat)
    return fleet.holding({**fleet, "boats": Items.of(boats, fleet["boats"].places)})
