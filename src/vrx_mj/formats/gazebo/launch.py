"""Launch files of ROS 1 that open a world of Gazebo: the world, and the boats and objects that they spawn.

`$(...)` is substituted as roslaunch does it, except that the environment stays closed.
"""

import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any, TypeGuard

from vrx_mj.config.search import MISSING, SCHEME, catalogue, display, package_paths
from vrx_mj.config.tree import File, Place, literal
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError, nearest, shorten
from vrx_mj.foreign import budget, spend
from vrx_mj.formats.gazebo.document import Element, Fate, Note, faults_at, home_path, is_file, read_document
from vrx_mj.formats.gazebo.launched import (
    ENDING,
    NAMED_PACKAGES,
    NOWHERE,
    POSE,
    STOCK_LAUNCHES,
    Launch,
    SpawnedModel,
    StockLaunch,
    advice,
    checked_fleet,
    instead_of,
    is_tool,
    named_world,
    object_named,
    package_left_out,
    pose_of_words,
    robot_named,
    spawn_options,
    stock_launch,
    unlocks,
)
from vrx_mj.formats.gazebo.models import NO_MODEL, has_model, is_gazebo_model, is_template, model_element, model_file
from vrx_mj.formats.gazebo.sdf_boats import boat_pose, is_boat
from vrx_mj.formats.gazebo.sdf_models import pose_of, safe_name
from vrx_mj.formats.urdf.elements import truth
from vrx_mj.formats.urdf.expand import LEFT_OUT, Arguments, Files, declared_names, evaluate_argument
from vrx_mj.formats.urdf.xml_document import file_error
from vrx_mj.frames import compose

_MAX_TEXT = 20_000
"""Longest text [characters]."""
_MAX_TEXTS = 4_000_000
"""Largest size of all launch files that one includes [characters]."""
_SUBSTITUTION = re.compile(r"\$\(([^)]*)\)")
_ONE_WORD = ("find", "arg", "anon", "env")
_MAX_DEPTH = 20
"""Largest depth of launch files that include each other."""
_FILE = 100
"""Weight of reading a file, counted as notes and elements."""
_OWN_ARGUMENTS = {"namespace", "locked"}
"""Arguments of a boat's xacro that are the name of the boat and the lock of the task here."""
SERVING = "vrx_mj_serve"
"""Type of the node that starts one of VRX's own launch files here."""
_LAUNCHES_WORLDS = {"empty_world.launch", "willowgarage_world.launch"}


class Substitutions:
    """Substitutions in the launch files of one simulation; packages of VRX and ROS need not be there."""

    def __init__(self, files: Files) -> None:
        self.files = files
        self.left = _MAX_TEXTS

    def substitute(self, text: str, arguments: Arguments, folder: Path) -> str:
        """A text with each `$(...)` in it replaced, in a file in a folder. Raises VrxError."""
        whole = text.strip()
        if whole.startswith("$(eval ") and whole.endswith(")"):
            found = evaluate_argument(whole[len("$(eval ") : -1], arguments, self.find, folder)
        elif "$(eval" in text:
            raise VrxError("$(eval ...) must be the whole value, as in roslaunch; give it an <arg> of its own")
        else:
            if "$(" in text.rpartition(")")[2]:
                raise VrxError("'$(' is never closed")
            found = _SUBSTITUTION.sub(lambda match: self._resolve(match[1], arguments, folder), text)
        if len(found) > _MAX_TEXT:
            raise VrxError(f"text too long: at most {_MAX_TEXT} characters")
        self.left -= len(found)
        if self.left < 0:
            raise VrxError(f"more than {_MAX_TEXTS / 1e6:g} MB of text")
        return found

    def _resolve(self, text: str, arguments: Arguments, folder: Path) -> str:
        """The value of `$(text)`."""
        command, *words = text.split() or [""]
        if command not in _COMMANDS:
            close = nearest(command, _COMMANDS)
            hint = f"did you mean '{close}'?" if close else f"known: {', '.join(_COMMANDS)}, eval"
            raise VrxError(f"no substitution named '{command}'; {hint}")
        if command in _ONE_WORD and len(words) != 1:
            raise VrxError(f"takes one name, $({command} NAME), got {len(words)}")
        return _COMMANDS[command](self, words, arguments, folder)

    def argument(self, name: str, arguments: Arguments) -> str:
        """The value of an argument."""
        if name not in arguments:
            raise VrxError(f"{UnknownNameError('argument', name, arguments)}; declare it first in an <arg>")
        return arguments[name]

    def find(self, name: str) -> str:
        """The folder of a package."""
        found = self.files.package(name)
        if found is None and (name in NAMED_PACKAGES or os.environ.get(MISSING) == "ignore"):
            return f"{NOWHERE if name in NAMED_PACKAGES else LEFT_OUT}{name}"
        if found is None:
            words = str(UnknownNameError("package", name, self.files.known_packages()))
            raise VrxError(f"{words} (or add its folder to the package paths, or --missing ignore)")
        return str(found)


def _refuse_environment(name: str) -> str:
    raise VrxError(f"files cannot read the environment variable '{name}'; declare an argument and use $(arg {name})")


def _default(words: list[str]) -> str:
    if not words:
        raise VrxError("takes a name and a default: $(optenv NAME DEFAULT)")
    return " ".join(words[1:])


_COMMANDS: Mapping[str, Callable[[Substitutions, list[str], Mapping[str, str], Path], str]] = {
    "find": lambda here, words, *_: here.find(words[0]),
    "arg": lambda here, words, arguments, _: here.argument(words[0], arguments),
    "dirname": lambda _, __, ___, folder: str(folder),
    "cwd": lambda *_: str(Path.cwd()),
    "env": lambda _, words, *__: _refuse_environment(words[0]),
    "optenv": lambda _, words, *__: _default(words),
    "anon": lambda _, words, *__: f"{words[0]}_anonymous",
}


_Description = tuple[Path | str, dict[str, str]]
"""The file of a robot's description or the name of one of ours, and the arguments of its xacro."""


@budget()
def launch_of(source: str, arguments: Arguments) -> Launch:
    """The simulation of a launch file, or of one of VRX's own by its name where no such file is at hand.

    Raises:
        ConfigError: the file, or one that it includes, cannot be read or is wrong.
        UnknownNameError: there is no such file, and VRX has none of this name.
    """
    file = Path(source)
    if is_file(file):
        return read_launch(file, arguments)
    if os.path.lexists(file):
        raise file_error(file, "not a file")
    stock = stock_launch(file.name, file.parent.name)
    if stock is None:
        if is_tool(file.name):
            raise file_error(file.name, instead_of(file.name, arguments))
        raise UnknownNameError("launch file", source, sorted(STOCK_LAUNCHES))
    run = _Run(file)
    run.open_stock(stock, dict(arguments), None)
    return run.result()


def is_launch(source: object) -> TypeGuard[str | Path]:
    """Whether a source is the path of a launch file, or the name of one of VRX's with its ending."""
    return isinstance(source, str | Path) and (str(source).lower().endswith(ENDING) or is_tool(Path(source).name))


@budget()
def read_launch(file: Path, arguments: Arguments, *, strict: bool = True) -> Launch:
    """The simulation that a launch file starts. Raises ConfigError, if `strict` also for arguments that it has not."""
    run = _Run(file)
    declared = run.read_file(file.absolute(), _Scope("", {}, arguments))
    unknown = sorted(set(arguments) - declared)
    if unknown and strict:
        message = str(UnknownNameError("argument", unknown[0], sorted(declared)))
        raise file_error(file, message, f"{unknown[0]}:=")
    return run.result()


@dataclass(frozen=True)
class _Scope:
    """Where an element of a launch file is."""

    namespace: str
    arguments: dict[str, str]
    """Arguments that it sees."""
    given: Arguments
    """Arguments from outside of the file."""


class _Run:
    """Launch files being read: the world and the boats so far."""

    def __init__(self, file: Path) -> None:
        self.files = Files(file, {}, package_paths())
        self.launch = Launch()
        self.report = self.launch.report
        self.note = self.report.note
        self.substitutions = Substitutions(self.files)
        self.places: dict[str, Place] = {}
        self.descriptions: dict[str, _Description] = {}
        self.scope = _Scope("", {}, {})
        """Where the element is that is being read."""
        self.open = list[Path]()
        self.documents: dict[Path, Element | None] = {}
        self.nodes: dict[str, Place] = {}

    @cached_property
    def known_objects(self) -> Mapping[str, Path]:
        """Objects of the catalogue, which is searched once."""
        return catalogue("objects")

    def result(self) -> Launch:
        """World, boats and objects that the files start, with the report on the rest."""
        self.report.settle()
        joins = self.launch.world is not None
        fate: Fate = "imported" if joins else "ignored"
        ours = "`objects` of the world" if joins else "this launch file opens no world to add it to"
        for thing in self.launch.objects:
            self.report.notes.append(Note(thing.place, f"<node> '{thing.name}'", fate, ours))
        return self.launch

    def read_file(self, file: Path, scope: _Scope) -> set[str]:
        """Go through a file, and return the names of the arguments that it declares."""
        spend(display(file), _FILE)
        if file.resolve() in {other.resolve() for other in self.open}:
            names = " > ".join(path.name for path in (*self.open, file))
            raise file_error(file, f"launch files include each other: {names}")
        if len(self.open) >= _MAX_DEPTH:
            raise file_error(file, f"launch files are included more than {_MAX_DEPTH} levels deep")
        if file not in self.documents:
            self.documents[file] = None
            self.documents[file] = read_document(file)
        if (root := self.documents[file]) is None:  # what is wrong with it was said before
            return set(scope.given)
        if root.tag != "launch":
            raise root.fault(f"expected <launch>, got <{root.tag}>")
        self.open.append(file)
        self.take_children(root, scope)
        self.open.pop()
        return {arg.attributes.get("name", "") for arg in _declarations(root)}

    def take_children(self, parent: Element, scope: _Scope) -> None:
        """Carry out the elements in one that makes a scope. Elements count as notes."""
        outer, self.scope = self.scope, scope
        for element in parent.children:
            spend(element.place.file.name)
            try:
                if self.holds(element):
                    _TAKE.get(element.tag, _Run.ignore)(self, element)
            except ConfigError as error:
                self.report.problems += error.problems
        self.scope = outer

    def ignore(self, element: Element) -> None:
        """Note an element that is not of the simulation."""
        beside = "not part of the simulation; start it while `vrx-mj serve` runs"
        variable = element.tag == "env"
        self.note(element, "ignored", "set this environment variable in the shell" if variable else beside)

    def holds(self, element: Element) -> bool:
        """Whether an element's conditions, `if` and `unless`, hold."""
        for key, wanted in (("if", True), ("unless", False)):
            if key in element.attributes and element.truth(self.value(element, key), key) != wanted:
                return False
        return True

    def argument(self, element: Element) -> None:
        """Declare an argument, whose value is its own, the one from outside, or its default."""
        name = self.value(element, "name")
        key = "value" if "value" in element.attributes else "default"
        try:
            if key == "default" and name in self.scope.given:
                self.scope.arguments[name] = self.scope.given[name]
            elif key in element.attributes:
                self.scope.arguments[name] = self.value(element, key)
            else:
                raise element.fault(f"has no value: add {name}:=VALUE")
        except ConfigError:
            self.scope.arguments.setdefault(name, "")  # what needs it says no second time that it is wrong
            raise

    def group(self, element: Element) -> None:
        """Go through a group; its arguments are its own."""
        own = dict(self.scope.arguments)
        self.take_children(element, _Scope(self.namespace(element), own, self.scope.given))

    def include(self, element: Element) -> None:
        """Go through another file with the arguments that this one gives it."""
        name = self.value(element, "file")
        passes_all = element.truth(element.attribute("pass_all_args") or "false", "pass_all_args")
        passed = dict(self.scope.arguments) if passes_all else {}
        inner = _Scope(self.namespace(element), {}, passed)
        for arg in element.all("arg"):
            if self.holds(arg):
                key = "value" if "value" in arg.attributes else "default"
                passed[self.value(arg, "name")] = self.value(arg, key, "")
        if name.startswith(LEFT_OUT):
            self.leave_out(element, name, f"<include> {PurePosixPath(name).name}")
            return
        if not name.startswith(NOWHERE):
            self.launch.included.append(self.readable_file(element, name))
            declared = self.read_file(self.launch.included[-1], inner)
            unknown = sorted(set(passed) - set(self.scope.arguments if passes_all else ()) - declared)
            if unknown:
                raise element.fault(str(UnknownNameError("argument", unknown[0], sorted(declared))))
            return
        path = PurePosixPath(name)
        stock = stock_launch(path.name, path.parts[1])
        if path.name in _LAUNCHES_WORLDS and not passed.get("world_name"):
            self.note(element, "ignored", "world_name is not given")
        elif path.name in _LAUNCHES_WORLDS:
            self.launch.world = self.world_of(element, passed["world_name"])
            self.note(element, "imported", f"the world: {literal(PurePosixPath(passed['world_name']).name)}")
        elif stock is not None:
            self.open_stock(stock, passed, element)
        else:
            self.note(element, "ignored", "not part of the simulation", f"<include> {path.name}")

    def leave_out(self, element: Element, path: str, what: str) -> None:
        """Note what is not there, as its package is missing."""
        self.note(element, "not read", f"no package named '{package_left_out(path)}'", what)

    def world_of(self, element: Element, path: str) -> Path | str:
        """A world's file; one of VRX's that is not at hand by its name here."""
        try:
            found = named_world(path)
        except UnknownNameError as error:
            raise element.fault(f"{error} (or add its package's folder to VRX_MJ_PACKAGE_PATH)") from None
        return found if isinstance(found, str) else self.readable_file(element, self.made_from(str(found), ".xacro"))

    def made_from(self, path: str, *endings: str) -> str:
        """A path; where there is no such file, that of the one with another ending that catkin makes it from."""
        whole = str(self.open[0].parent / path)
        found = (f"{path}{ending}" for ending in ("", *endings) if is_file(Path(f"{whole}{ending}")))
        return next(found, path)

    def open_stock(self, stock: StockLaunch, given: dict[str, str], element: Element | None) -> None:
        """Start what one of VRX's own launch files starts."""
        unknown = set(given) - set(stock.arguments)
        if unknown:
            message = str(UnknownNameError(f"argument of {stock.name}", sorted(unknown)[0], stock.arguments))
            raise element.fault(message) if element else file_error(stock.name, message)
        world, urdf = given.get("world"), given.get("urdf")
        self.launch.world = (
            stock.world if world is None else self.world_of(element, world) if element else named_world(world)
        )
        own: dict[str, Any] = {}
        if urdf is not None:
            robot = self.robot_file(element, urdf) if element else robot_named(urdf) or home_path(urdf)
            own = {"model": robot, **({"arguments": {}} if isinstance(robot, Path) else {})}
        place = element.place if element else Place(File(stock.name, None))
        self.launch.unlocked = self.launch.unlocked or unlocks(stock, given)
        for name, value in given.items():
            if instead := advice(stock, name, value):
                self.report.notes.append(Note(place, f"{name}:={shorten(value)}", "ignored", instead))
        for boat in stock.boats_with(given, place):
            self.spawn(element, replace(boat, **own), self.launch.boats)
        if element is not None:
            self.note(element, "imported", f"VRX's {stock.name}")

    def parameter(self, element: Element) -> None:
        """Keep the description of a robot, which `<param>` gives as a command of xacro or as a file."""
        name = _in_namespace(self.scope.namespace, self.value(element, "name"))
        if "command" in element.attributes:
            self.descriptions[name] = self.description(element, self.value(element, "command"))
        elif "textfile" in element.attributes:
            self.descriptions[name] = self.robot_file(element, self.value(element, "textfile")), {}
        elif name == "/use_sim_time" and truth(element.attributes.get("value", "")):
            self.note(element, "imported", "time is always simulated time")
        else:
            self.note(element, "ignored", "a parameter; set it with `rosparam set` while `vrx-mj serve` runs")

    def parameters(self, element: Element) -> None:
        """Take over a fleet's file that `<rosparam>` loads; other parameters are those of nodes."""
        path = self.value(element, "file", "")
        try:
            self.launch.fleet = checked_fleet(self.readable_file(element, path))
            self.note(element, "imported", f"the fleet: `{self.launch.fleet.name}`")
        except VrxError:
            self.ignore(element)

    def description(self, element: Element, command: str) -> _Description:
        """File and arguments of a command of xacro; nothing is run."""
        words = [word for word in self.words(element, command, "command") if not word.startswith("-")]
        if len(words) < 2 or PurePosixPath(words[0]).name not in {"xacro", "xacro.py", "cat"}:
            raise element.fault(f"expected a xacro command, got {literal(command)}; no other command is run", "command")
        arguments = dict(word.split(":=", 1) for word in words[2:] if ":=" in word)
        return self.robot_file(element, words[1]), arguments

    def robot_file(self, element: Element, path: str) -> Path | str:
        """The file of a description or a model of SDF; the name of ours for VRX's own."""
        named = robot_named(path) or object_named(path)
        if named is None and path.startswith(NOWHERE):
            raise element.fault(f"no package for {path.removeprefix(NOWHERE)}: add its folder to VRX_MJ_PACKAGE_PATH")
        ends = (".xacro", ".erb") if path.lower().endswith(".sdf") else ()
        if path.startswith(LEFT_OUT):
            return path
        return named or self.readable_file(element, self.made_from(path, *ends))

    def node(self, element: Element) -> None:
        """Spawn a boat; other nodes are not of the simulation."""
        kind = element.attributes.get("type")
        if kind == SERVING:
            self.serve(element)
        elif self.launch.fleet and kind == "spawn_usvs.py":
            self.note(element, "imported", f"the boats of `{self.launch.fleet.name}`")
        elif kind in {"spawn_model", "spawn_wamv.bash", "spawn_entity.py"}:
            self.spawn_model(element, self.claim_node(element))
        else:
            self.ignore(element)

    def spawn_model(self, element: Element, namespace: str) -> None:
        """Spawn what a node of gazebo_ros does: a boat or an object."""
        words = self.words(element, self.value(element, "args", ""))
        with faults_at(element, "args"):
            options = spawn_options(words)
        with faults_at(element, "args", "-x -y -z -R -P -Y: "):
            pose = pose_of_words(options.get(key, "0") for key in POSE)
        name = options.get("model") or options.get("entity")
        if not name:
            raise element.fault("a spawned model needs -model NAME", "args")
        found = self.model_description(element, name, options, namespace)
        if found is None:
            return
        robot, arguments = found
        if isinstance(robot, str) and robot.startswith(LEFT_OUT):
            self.leave_out(element, robot, f"<node> '{name}'")
            return
        if isinstance(robot, Path) and is_gazebo_model(robot.name) and not is_template(robot):
            own = pose_of(model_element(robot).model, self.report).value  # in the frame of what is spawned
            pose = compose(pose, own) if any(own) else pose
            pose = pose if _is_object(robot) else boat_pose(pose, robot)
        if robot in self.known_objects or (isinstance(robot, Path) and _is_object(robot)):
            self.spawn(element, SpawnedModel(name, pose, element.place, robot), self.launch.objects)
            return
        boat = SpawnedModel(name, pose, element.place, robot, self.known_arguments(element, name, robot, arguments))
        self.spawn(element, boat, self.launch.boats)
        self.note(element, "imported", "a boat of the fleet", f"<node> '{name}'")

    def claim_node(self, element: Element) -> str:
        """Keep the name of a node that spawns, for roslaunch starts no two of one name; returns its namespace."""
        own, namespace = self.value(element, "name", ""), self.namespace(element)
        name = f"/{_in_namespace(namespace, own).lstrip('/')}"
        first = self.nodes.setdefault(name, element.place)
        if own and first != element.place:
            here = _seen_from(element.place, first)
            text = f"duplicate node name '{name}', first on {here}: roslaunch refuses to start; rename one of them"
            self.report.problems += element.fault(text, "name").problems
        return namespace

    def model_description(
        self, element: Element, name: str, options: Mapping[str, str], namespace: str
    ) -> _Description | None:
        """File and arguments of what a node spawns; None, with a note: there is no such model of SDF."""
        what = f"<node> '{name}'"
        if "database" in options:
            model, folder = options["database"], self.open[0].parent
            if model in self.known_objects:
                return model, {}
            if has_model(model, folder):
                return model_file(f"{SCHEME}{model}", folder), {}
            self.note(element, "ignored", f"no model named '{shorten(model)}'; {NO_MODEL}", what)
            return None
        try:
            robot, arguments = self.robot_description(element, options, namespace)
        except ConfigError as error:
            if not {"file", "sdf"} <= options.keys():
                raise
            self.note(element, "ignored", error.problems[0].message, what)
            return None
        if arguments and "sdf" in options:
            self.note(element, "ignored", f"an SDF takes no xacro arguments: {' '.join(arguments)}", what)
        return robot, {} if "sdf" in options else arguments

    def known_arguments(self, element: Element, name: str, robot: Path | str, given: dict[str, str]) -> dict[str, str]:
        """The arguments that the xacro of a boat declares; xacro ignores others."""
        if not given or not isinstance(robot, Path):
            return given
        declares = declared_names(robot, given, package_paths()) if robot.name.lower().endswith(".xacro") else ()
        unknown = [key for key in given if key not in declares and key not in _OWN_ARGUMENTS]
        if unknown:
            listed = ", ".join(f"{key}:=" for key in unknown)
            self.note(element, "ignored", f"{robot.name} has no argument {listed}", f"<node> '{name}'")
        return {key: value for key, value in given.items() if key in declares}

    def serve(self, element: Element) -> None:
        """Start what one of VRX's own launch files starts, as `vrx-mj ros packages` writes them."""
        name, *words = self.words(element, self.value(element, "args", "")) or [""]
        stock = stock_launch(PurePosixPath(name).name, PurePosixPath(name).parent.name)
        if stock is None:
            raise element.fault(str(UnknownNameError("launch file", name, sorted(STOCK_LAUNCHES))), "args")
        given = dict(word.split(":=", 1) for word in words if ":=" in word)
        self.open_stock(stock, {key: value for key, value in given.items() if value}, element)

    def spawn(self, element: Element | None, thing: SpawnedModel, things: list[SpawnedModel]) -> None:
        """Add a boat or an object, whose name no other model has."""
        if element is not None:
            if first := self.places.get(safe_name(thing.name)):
                here = _seen_from(element.place, first)
                text = f"duplicate model name '{thing.name}', first spawned on {here}: give each its own -model NAME"
                raise element.fault(text, "args")
            self.places[safe_name(thing.name)] = element.place
        things.append(thing)

    def robot_description(self, element: Element, options: Mapping[str, str], namespace: str) -> _Description:
        """File and arguments of the description that a node spawns."""
        if "file" in options:
            return self.robot_file(element, options["file"]), {}
        given = options.get("param", "robot_description")
        name = _in_namespace(namespace, given)
        if name not in self.descriptions:
            raise element.fault(f"-param: {UnknownNameError('parameter', name, sorted(self.descriptions))}", "args")
        return self.descriptions[name]

    def words(self, element: Element, text: str, key: str = "args") -> list[str]:
        """The words of a command line, which an attribute gives."""
        with faults_at(element, key, f"{literal(text)}: "):
            return shlex.split(text)

    def namespace(self, element: Element) -> str:
        """The namespace that an element makes for what is in it."""
        return _in_namespace(self.scope.namespace, self.value(element, "ns", ""))

    def value(self, element: Element, key: str, default: str | None = None) -> str:
        """An attribute, which must be there unless it has a default, with its substitutions worked out."""
        text = element.attributes.get(key, default)
        if text is None:
            raise element.fault("required, but missing", key)
        folder = self.open[-1].parent if self.open else Path.cwd()
        with faults_at(element, before=f"{literal(text)}: "):
            return self.substitutions.substitute(text, self.scope.arguments, folder)

    def readable_file(self, element: Element, path: str) -> Path:
        """A file that may be read: beside the first file, or in a package."""
        with faults_at(element):
            if path.startswith(LEFT_OUT):
                raise VrxError(f"no package named '{package_left_out(path)}', which would contain it")
            return self.files.readable_file(str(self.open[0].parent / path) if self.open else path)


def _is_object(file: Path) -> bool:
    """Whether a file is a model of SDF without thrusters, or the template of a dock."""
    return is_gazebo_model(file.name) and (is_template(file) or not is_boat(model_element(file).model))


def _declarations(element: Element) -> Iterator[Element]:
    """The arguments that a file declares, in groups or not."""
    yield from element.all("arg")
    for group in element.all("group"):
        yield from _declarations(group)


def _seen_from(here: Place, other: Place) -> str:
    """The line of another place, with its file where that is another one."""
    return f"line {other.line}" if other.file.name == here.file.name else f"{other.file.name}:{other.line}"


def _in_namespace(namespace: str, name: str) -> str:
    """A name in a namespace, as ROS has them."""
    return name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}" if name else namespace


_TAKE: Mapping[str, Callable[[_Run, Element], Any]] = {
    "arg": _Run.argument, "group": _Run.group, "include": _Run.include, "param": _Run.parameter,
    "rosparam": _Run.parameters, "node": _Run.node,
}  # fmt: skip
