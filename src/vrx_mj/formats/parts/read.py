"""Thruster and component files of VRX, and the URDF of a WAM-V that they describe.

As in VRX's `generate_wamv.launch`, each file becomes a piece of xacro with one macro call for each of its parts, and
`wamv_gazebo.urdf.xacro` is expanded with these pieces, by the macros in `assets/robots/wamv`. Unlike there, the boat
may have any namespace. Suspicious values are reported.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal
from xml.sax.saxutils import quoteattr

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from vrx_mj.arguments import check_name
from vrx_mj.config.kinds import MARKS, other_kind, wrong_kind
from vrx_mj.config.search import display
from vrx_mj.config.tree import File, Items, Loc, Place, Section, choice, key_path, literal, unknown_key
from vrx_mj.config.values import MAX_COORDINATE, as_switch
from vrx_mj.config.yaml_text import parse, read_lines
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxError, shorten, warn
from vrx_mj.formats.urdf.elements import numbers_of, truth
from vrx_mj.formats.urdf.expand import Arguments, Result, evaluate, expand
from vrx_mj.formats.urdf.xml_document import file_error
from vrx_mj.frames import Vector
from vrx_mj.packages import root

Kind = Literal["components", "thrusters"]
_JAZZY_NAMES = frozenset({"sensor_name", "pinger_name"})
"""Parameters that only a pinger of VRX jazzy has."""
_HULL_LINKS = ("base", "dummy", "left_battery", "right_battery", "cpu_cases")
"""Links of the bare hull, without their suffix `_link`."""
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]{0,63}")
_WORD = re.compile(r"[A-Za-z0-9_./-]{1,64}")
_EXPRESSION = re.compile(r"\$\{([^}]*)\}")
_MAX_EXPRESSION = 2000
"""Longest text with an expression in it [characters]."""
_MOST_HZ = 10_000.0
"""Largest rate [Hz]; any other number is a coordinate or an angle."""
_LIDAR_TYPES = ("16_beam", "32_beam")
"""Lidars there are; any other type makes none, as in VRX."""
_FULL_TURN = 2.0 * math.pi
"""An angle beyond this is rather meant in degrees [rad]."""
_FILES = {"components": "component file", "thrusters": "thruster file"}
_EMPTY_LINE = re.compile(r"\s*(---|\.\.\.)?\s*(#.*)?")
"""A line without content: empty, a comment, or a mark of a document."""
_FOLDER = root() / "assets" / "robots" / "wamv"
_MAIN = _FOLDER / "wamv_gazebo" / "urdf" / "wamv_gazebo.urdf.xacro"
LAYOUTS = ("H", "T", "X")
"""Thruster layouts that need no file."""
_CHOICES = {
    "sensor_errors": ("none", "standalone", "rtk"),
    "camera_info": ("vrx", "centered"),
    "release": ("classic", "jazzy"),
}
"""Arguments that are not VRX's, and their values."""
_ARGUMENT = re.compile(r'<xacro:arg name="(\w+)" default="([^"]*)"/>')
_OTHERS = re.compile(r"namespace|locked|yaml_\w+_generation|\w+_xacro_file")
"""Arguments that are parameters of `wamv_urdf`."""
_SWITCHED = ("true", "false")
_NAMESPACE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}", re.ASCII)


@dataclass(frozen=True)
class Instance:
    """One part that a file asks for."""

    type: str
    """Name of its macro: `wamv_camera`, `engine`, ..."""
    index: int
    """Among those of its type, from 0."""
    parameters: Mapping[str, Any]
    """The parameters in the file's order: numbers, booleans and texts; `position` and `orientation` are texts.

    Expressions are worked out, and numbers in quotes are numbers.
    """
    place: Place


@dataclass(frozen=True)
class PartsFile:
    """A file's parts in its order; a file may be empty."""

    path: Path
    kind: Kind
    instances: tuple[Instance, ...]
    stops: tuple[str, ...] = ()
    """Problems at which VRX's own generator stops, though the file is read here."""


_Form = Literal["name", "word", "number", "switch", "triple"]
Release = Literal["classic", "jazzy"]


@dataclass(frozen=True)
class Parameter:
    """A parameter of a part's macro."""

    name: str
    form: _Form
    """`name`: of a link and a topic. `triple`: three numbers in one text."""
    meaning: str
    default: str | float | bool | None = None
    """None for one that must be given."""
    unit: str = ""
    release: Release | None = None
    """The only VRX that has it; None for both."""


@dataclass(frozen=True)
class PartType:
    """A type of part: a macro that a file may call."""

    name: str
    kind: Kind
    meaning: str
    parameters: tuple[Parameter, ...]
    drop: float | None = None
    """Height of the origin of a part on a post over the top of the post [m]; None: it has no post."""

    def parameter(self, name: str) -> Parameter | None:
        """The parameter of this name, if the type has it."""
        return next((each for each in self.parameters if each.name == name), None)

    def default(self, name: str) -> str | float | bool | None:
        """Default of a parameter; None for one that must be given, or that does not exist."""
        found = self.parameter(name)
        return found.default if found else None


@dataclass(frozen=True)
class Catalogue:
    """Types of parts that files may ask for, and messages about others."""

    types: Mapping[str, PartType]
    """Types by name, in the order in which they are listed."""
    elsewhere: Mapping[str, str]
    """Advice on parts that VRX has and its files may not ask for."""
    misnamed: Mapping[str, str]
    """Names of types that come to mind, and the right ones."""
    fixed: Mapping[str, Sequence[str]]
    """Parameters that VRX does not let a file set, by type."""


@cache
def catalogue() -> Catalogue:
    """Catalogue of the parts in VRX's files, from `assets/robots/wamv/parts.json`."""
    table = json.loads((root() / "assets" / "robots" / "wamv" / "parts.json").read_bytes())
    for part in table["types"]:
        part["parameters"] = tuple(Parameter(**row) for row in part["parameters"])
    return Catalogue(**table | {"types": {part["name"]: PartType(**part) for part in table["types"]}})


def part_types() -> Mapping[str, PartType]:
    """Every type by name."""
    return catalogue().types


def _own_form(parameter: Parameter, value: object) -> str | float | bool:
    """Value of a parameter in its own form.

    Raises:
        ValueError: it is nothing that the parameter can be, and why.
    """
    if parameter.form == "number":
        return _number(value, parameter.unit)
    if parameter.form == "switch":
        return _switch(value)
    if parameter.form == "triple":
        return triple(value)
    return _text(value, named=parameter.form == "name")


def _number(value: object, unit: str = "") -> float:
    """A finite number, as YAML has it, in quotes, or as an expression."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a number, got {literal(value)}")  # noqa: TRY004
    text = _substitute(value) if isinstance(value, str) else repr(value)
    limits = {"above": 0.0, "high": _MOST_HZ} if unit == "Hz" else {"largest": MAX_COORDINATE}
    try:
        return numbers_of(text, unit or "value", **limits)[0]
    except ValueError as error:
        raise ValueError(f"{error}{_result(value)}") from None


def _switch(value: object) -> bool:
    """True or false, as YAML has it, as a word, or as an expression."""
    text = _substitute(value) if isinstance(value, str) else repr(value)
    found = truth(str(as_switch(text.strip())))
    if found is None:
        raise ValueError(f"expected true or false, got {literal(text)}{_result(value)}")
    return found


def triple(value: object) -> str:
    """Three numbers with blanks between, from such a text or from a list."""
    words = _substitute(value).split() if isinstance(value, str) else value
    try:
        if not isinstance(words, list | tuple) or len(words) != 3:
            raise ValueError
        return " ".join(repr(_number(word)).removesuffix(".0") for word in words)
    except ValueError as error:
        why = f": {error}" if error.args else ""
        raise ValueError(f"expected three numbers as in '1.0 0 -1.0', got {literal(value)}{why}") from None


def triple_of(text: str) -> Vector:
    """The three numbers of a text that `triple` made."""
    x, y, z = map(float, text.split())
    return x, y, z


def has_expression(value: object) -> bool:
    """Whether a value, or one in a list of values, needs evaluating."""
    if isinstance(value, list | tuple):
        return any(map(has_expression, value))
    return isinstance(value, str) and len(value) <= _MAX_EXPRESSION and _EXPRESSION.search(value) is not None


def _text(value: object, *, named: bool) -> str:
    if not isinstance(value, str):
        hint = "; put it in quotes" if isinstance(value, int | float) and not isinstance(value, bool) else ""
        raise ValueError(f"expected text, got {literal(value)}{hint}")  # noqa: TRY004
    if named and not _NAME.fullmatch(value):
        raise ValueError(f"expected a name of up to 64 letters A-Z, digits, '_' or '-', got {literal(value)}")
    if not named and not _WORD.fullmatch(value):
        raise ValueError(f"expected up to 64 letters A-Z, digits, '_', '-', '.' or '/', got {literal(value)}")
    return value


class Expression(str):
    """A text of a file that has expressions in it, with what it comes to."""

    __slots__ = ("result",)

    result: Result


def _substitute(text: str) -> str:
    """The text with its expressions worked out."""
    if len(text) > _MAX_EXPRESSION:
        raise ValueError(f"expected at most {_MAX_EXPRESSION} characters, got {literal(text)}")
    if not isinstance(text, Expression):
        return text
    if text.result.problem:
        raise ValueError(f"'{shorten(text)}': {text.result.problem}")
    return str(text.result.value)


def _result(value: object) -> str:
    """The expression that a value in a message is of, if there is one."""
    return f", of {literal(value)}" if has_expression(value) else ""


def _name_key(instance: Instance) -> str:
    """The parameter that names a part."""
    if part_types()[instance.type].kind == "thrusters":
        return "prefix"
    return "sensor_name" if _JAZZY_NAMES & instance.parameters.keys() else "name"


def name_of(instance: Instance) -> str:
    """Name of a part; empty where its file lacks one."""
    key = _name_key(instance)
    return str(instance.parameters.get(key) or part_types()[instance.type].default(key) or "")


def place_of(instance: Instance) -> Vector | None:
    """Place of a part in base_link [m]; None for a type without coordinates, which no box limits."""
    part, given = part_types()[instance.type], instance.parameters
    if part.kind == "thrusters":
        return triple_of(str(given["position"]))
    if part.parameter("z") is None:
        return None
    x, y, z = (float(given.get(axis, part.default(axis) or 0.0)) for axis in "xyz")
    return x, y, z


def _suspicious_values(instance: Instance) -> Iterator[tuple[str, str]]:
    """Warnings of parameters of a valid part that VRX accepts and that are hardly meant."""
    for key, value in instance.parameters.items():
        parameter = part_types()[instance.type].parameter(key)
        if parameter is None or parameter.unit != "rad":
            continue
        angle = max(map(float, str(value).split()), key=abs)
        if abs(angle) > _FULL_TURN:
            hint = f"angles are in radians: ${{radians({angle:g})}}"
            yield key, f"{angle:g} exceeds a full turn, {_FULL_TURN:.4f}; {hint}"
    yield from _post(instance)
    kind = instance.parameters.get("type", _LIDAR_TYPES[0])
    if instance.type == "lidar" and kind not in _LIDAR_TYPES:
        yield "type", f"VRX has no lidar type {literal(kind)}; known: {', '.join(_LIDAR_TYPES)}"
    if _JAZZY_NAMES & instance.parameters.keys() and "position" in instance.parameters:
        message = "VRX jazzy reads it as the beacon's position in the world; the receiver is at base_link's origin"
        yield "position", message


def _post(instance: Instance) -> Iterator[tuple[str, str]]:
    """A post's length is what is left of the height of what it carries."""
    part = part_types()[instance.type]
    if part.drop is None:
        return
    height, foot = (float(instance.parameters.get(key, part.default(key) or 0.0)) for key in ("z", "post_z_from"))
    length = height - foot - part.drop
    if length < -1e-9:  # rounding may leave a little of zero
        needed = f"at least {foot + part.drop:g} m is needed"
        yield "z", f"at {height:g} m its post is {length:.4g} m long, and its mass negative; {needed}"


def load_parts(path: Path | str, kind: Kind) -> PartsFile:
    """Read a component or a thruster file.

    Expressions are worked out, and numbers in quotes are numbers. An empty file has no parts. A lidar of
    unknown type stays in the list, with a warning: it makes no lidar.

    Raises:
        ConfigError: the file cannot be read or is wrong; every problem with its line, column and key.
    """
    file, reading = Path(path), _Reading(kind)
    said = wrong_kind(file, f"a {_FILES[kind]}")
    section = None if said else _content(file)
    parts = MARKS["thrusters"] | MARKS["components"]  # of the other file of parts each key has its own message
    said = said or (None if parts & set(section or {}) else other_kind(kind, section or {}))
    if said:
        raise file_error(file, said)
    if section is not None:
        for key in section:
            _read_type(reading, section, key)
    _check_names(reading)
    if reading.problems:
        raise ConfigError(sorted(reading.problems, key=lambda each: (each.line or 0, each.column or 0)))
    for loc, instance in reading.parts:
        for key, message in _suspicious_values(instance):
            place = reading.places.get((*loc, key), instance.place)
            warn(str(place.problem(key_path((*loc, key)), message)), 2)
    return PartsFile(file, kind, tuple(part for _, part in reading.parts), tuple(map(str, reading.stops)))


@dataclass
class _Reading:
    """A file while it is read: its parts so far, what is wrong, and what VRX's generator would stop at."""

    kind: Kind
    parts: list[tuple[Loc, Instance]] = field(default_factory=list)
    places: dict[Loc, Place] = field(default_factory=dict)
    """Places of the values of parameters."""
    problems: list[Problem] = field(default_factory=list)
    stops: list[Problem] = field(default_factory=list)

    def wrong(self, place: Place, loc: Loc, message: str) -> None:
        self.problems.append(place.problem(key_path(loc), message))

    def stop(self, place: Place, loc: Loc, message: str) -> None:
        self.stops.append(place.problem(key_path(loc), message))


def _content(path: Path) -> Section | None:
    """Content of a file; None where it is empty."""
    lines = read_lines(path)
    return None if all(map(_EMPTY_LINE.fullmatch, lines)) else _evaluate(parse(File(display(path), path.parent, lines)))


def _evaluate(section: Section) -> Section:
    """The content with all its expressions worked out, at once."""
    found: dict[str, Expression] = {}

    def prepare(value: object) -> object:
        if isinstance(value, Section):
            return value.holding({key: prepare(item) for key, item in value.items()})
        if isinstance(value, Items):
            return Items.of(map(prepare, value), value.places)
        return found.setdefault(value, Expression(value)) if isinstance(value, str) and has_expression(value) else value

    whole = prepare(section)
    assert isinstance(whole, Section), "it was one"
    results = evaluate(section.place.file.name, [(text, {}) for text in found])
    for text, result in zip(found.values(), results, strict=True):
        text.result = result
    return whole


def _read_type(reading: _Reading, section: Section, key: str) -> None:
    """The instances of one key, whose stars at either end only tell it from others of the same type."""
    name, place = key.strip("*"), section.entries[key].key
    known = {one: part for one, part in part_types().items() if part.kind == reading.kind}
    part = known.get(catalogue().misnamed.get(name, name))
    if name not in known:
        reading.wrong(place, (key,), _unknown_type(name, reading.kind))
    if part is None:
        return
    if name != key:
        reading.stop(place, (key,), "a key with '*'")
    for loc, value, where in _instances(reading, section, key):
        if isinstance(value, Section):
            _read_instance(reading, part, value, loc)
        else:
            hint = "; {} keeps every default" if value is None else ""
            reading.wrong(where, loc, f"expected parameters, got {literal(value)}{hint}")


def _instances(reading: _Reading, section: Section, key: str) -> Iterator[tuple[Loc, object, Place]]:
    """Path, value and place of each entry of a type's list; a mapping counts as a list of one."""
    value, place = section[key], section.entries[key].value
    if isinstance(value, Items):
        yield from (((key, i), item, where) for i, (item, where) in enumerate(zip(value, value.places, strict=True)))
    elif isinstance(value, Section):
        reading.stop(place, (key,), "one instance that is not in a list")
        yield (key,), value, place
    elif value is None:
        reading.stop(section.entries[key].key, (key,), "a type without instances")
    else:
        reading.wrong(place, (key,), f"expected a list of instances, each with its parameters, got {literal(value)}")


def _unknown_type(name: str, kind: Kind) -> str:
    known = [each for each, part in part_types().items() if part.kind == kind]
    found = catalogue().misnamed.get(name, name)
    if name in catalogue().elsewhere:
        return catalogue().elsewhere[name]
    if found in part_types() and part_types()[found].kind != kind:
        return f"'{found}' belongs in the {_FILES[part_types()[found].kind]}; this is the {_FILES[kind]}"
    if found in known:
        return f"no type named '{name}'; did you mean '{found}'?"
    return str(UnknownNameError("type", name, known))


def _read_instance(reading: _Reading, part: PartType, section: Section, loc: Loc) -> None:
    parameters = {}
    for key, value in section.items():
        parameter = part.parameter(key)
        if parameter is None:
            fixed = f"no parameter '{key}'; VRX fixes it for every {part.name}"
            message = unknown_key(key, [each.name for each in part.parameters])
            unknown = fixed if key in catalogue().fixed.get(part.name, ()) else message
            reading.wrong(section.entries[key].key, (*loc, key), unknown)
            continue
        place = reading.places[*loc, key] = section.entries[key].value
        try:
            parameters[key] = _own_form(parameter, value)
        except ValueError as error:
            reading.wrong(place, (*loc, key), str(error))
        _check_generator(reading, parameter, value, (*loc, key))
    for parameter in part.parameters:
        if parameter.default is None and parameter.name not in section:
            reading.wrong(section.place, (*loc, parameter.name), "required, but missing")
    if "name" in section and _JAZZY_NAMES & section.keys():
        message = "give 'name' (VRX classic) or 'sensor_name' or 'pinger_name' (VRX jazzy), not both"
        reading.wrong(section.place, loc, message)
    index = sum(instance.type == part.name for _, instance in reading.parts)
    reading.parts.append((loc, Instance(part.name, index, parameters, section.place)))


def _check_generator(reading: _Reading, parameter: Parameter, value: object, loc: Loc) -> None:
    """Note a value that VRX's generator stops at: it needs coordinates as plain numbers, in a text."""
    place = reading.places[loc]
    if isinstance(value, Items):
        reading.stop(place, loc, "a list instead of a text")
    coordinate = parameter.name in {"x", "y", "z"} or (reading.kind == "thrusters" and parameter.name == "position")
    if coordinate and has_expression(value):
        reading.stop(place, loc, "an expression for a coordinate")


def _check_names(reading: _Reading) -> None:
    """Every part of a file needs a name of its own, and its link one that the hull does not have."""
    seen: dict[str, Place] = {}
    for loc, instance in reading.parts:
        name, key = name_of(instance), _name_key(instance)
        place = reading.places.get((*loc, key), instance.place)
        if (*loc, key) in reading.places and key not in instance.parameters:
            continue  # an invalid name is a problem already
        if name in seen:
            default = "" if key in instance.parameters else ", as this one is by default"
            message = f"duplicate name '{name}'{default}: the part on line {seen[name].line} has the same"
            reading.wrong(place, (*loc, key), message)
        elif name in _HULL_LINKS and reading.kind == "components":
            reading.wrong(place, (*loc, key), f"the hull already has a link '{name}_link'; choose another name")
        if name:
            seen.setdefault(name, place)


@cache
def arguments_of_wamv() -> Mapping[str, str]:
    """Arguments of our `wamv_gazebo.urdf.xacro` that are free to set, with their defaults."""
    found = _ARGUMENT.findall(_MAIN.read_text(encoding="utf-8"))
    return {name: default for name, default in found if not _OTHERS.fullmatch(name)}


def example_file(kind: Kind) -> Path:
    """VRX's example of a thruster or component file, which is what a boat has that names no file."""
    return _FOLDER / "config" / f"{kind.removesuffix('s')}_config.yaml"


def xacro_text(parts: PartsFile) -> str:
    """The xacro file of a thruster or component file: one macro call for each part, in the order of the file.

    It holds for any namespace. Values are written as texts, so that expressions in them reach xacro.
    """
    loader = FileSystemLoader(root() / "templates")
    environment = Environment(loader=loader, trim_blocks=True, undefined=StrictUndefined, keep_trailing_newline=True)
    template = environment.get_template("wamv_parts.xacro.j2")
    return template.render(kind=parts.kind, parts=parts.instances, quoted=lambda value: quoteattr(str(value)))


def wamv_urdf(
    *,
    thrusters: PartsFile | None = None,
    components: PartsFile | None = None,
    namespace: str = "wamv",
    locked: bool = False,
    arguments: Arguments | None = None,
    file: Path | None = None,
    package_paths: Sequence[Path] = (),
) -> str:
    """The URDF of a WAM-V.

    Args:
        thrusters: its engines; without a file, those of the argument `thruster_config` (H).
        components: its sensors, and with them the two cpu cases; without a file, those that flags add (none).
        namespace: prefix of links, joints, frames and topics.
        locked: whether it is held where it is, free to heave, roll and pitch only.
        arguments: any of `arguments_of_wamv`, as texts.
        file: a `wamv_gazebo.urdf.xacro` in place of ours; it may have arguments of its own.
        package_paths: where its packages are.

    Raises:
        UnknownNameError: an argument or the layout is unknown.
        VrxError: the namespace is not a name.
        ConfigError: what the files ask for cannot be expanded.
    """
    given = {**(arguments or {})}
    _check(given if file is None else {}, namespace)
    given |= {"namespace": namespace, "locked": str(locked).lower()}
    with TemporaryDirectory(prefix="vrx_mj_") as name:
        folder = Path(name).resolve()
        for parts in filter(None, (thrusters, components)):
            kind, written = parts.kind.removesuffix("s"), folder / f"{parts.kind}.xacro"
            written.write_text(xacro_text(parts), encoding="utf-8")
            given |= {f"yaml_{kind}_generation": "true", f"{kind}_xacro_file": written.as_posix()}
        made = expand(file or _MAIN, arguments=given, package_paths=(folder, *package_paths))
    return str(made)  # without places in files that have gone


def _check(arguments: Arguments, namespace: str) -> None:
    known = arguments_of_wamv()
    for name, value in arguments.items():
        check_name("argument of the WAM-V", name, known)
        switched = _SWITCHED if known[name] in _SWITCHED else (value,)
        if value not in (values := _CHOICES.get(name, switched)):
            raise VrxError(f"argument {name}: {choice(value, values)}")
    check_name("thruster layout", arguments.get("thruster_config", "H"), LAYOUTS)
    if not _NAMESPACE.fullmatch(namespace):
        allowed = "up to 64 letters A-Z, digits, '_', '-' or '.'"
        raise VrxError(f"namespace {literal(namespace)}: expected {allowed}")
