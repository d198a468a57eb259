"""The worlds of a VRX series as YAML files, by the macros of VRX's worlds (vrx_gazebo/worlds/xacros, gazebo_classic).

The macros are a xacro file of ours.
"""

import contextlib
import functools
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import yaml

from vrx_mj.config.loading import file_of, read_source
from vrx_mj.config.search import SCHEME, is_path
from vrx_mj.config.tree import File, Items, Place, Section, literal
from vrx_mj.config.values import as_switch
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxError, ignore_warnings, warn
from vrx_mj.formats.gazebo.document import Element, expanded_calls, parse
from vrx_mj.formats.gazebo.worlds import GazeboWorld, world_of
from vrx_mj.formats.series.axes import BLOCK, Call, Series, calls_around, calls_of, read_series
from vrx_mj.formats.series.pieces import TABLE, Piece, pieces_in_force
from vrx_mj.formats.urdf.elements import numbers_of, truth
from vrx_mj.formats.urdf.expand import MACROS
from vrx_mj.formats.urdf.xml_document import read_text

REQUIRED = object()
"""Marks a parameter without a default, which must be given."""
PLACES = {f"{name}{end}" for name in ("sydneyregatta", "sandisland", "marina") for end in ("", "_minus_scene")}
"""Macros that make a place."""
_PARTS = {"ocean_waves": "sea", "usv_wind_gazebo": "wind", "scene_macro": "scene", "insert_model": "objects"}
"""Part of the world that each macro makes; others make the task."""
_BLOCKS = TABLE["blocks"]
"""Blocks of macros: the `element` in each, what is `inside` of it, and whether a call `needs` the block."""
Line = tuple[str, Place]
"""A line of a xacro file, and where the axes file says it."""
_PARAMETER = re.compile(r"(\*\*)?(\w+)(?::=('[^']*'|\S+))?")
_DOLLARS = re.compile(r"\$+(?=[{(])")
_MARK = "#"
"""Mark between the name of an axes file and the number of a world."""
_HEAD_OF_XACRO = '<sdf xmlns:xacro="http://ros.org/wiki/xacro">'
HEAD = "# World "
"""Beginning of the text of a world of a series."""
_WIDTH = 120
_STALE = """# VRX's wind acts on the link base_link, which boats no longer have; here it acts on the boat
# (`physics: {quirks: [wind_stale_link]}` for VRX's).
"""
_SHORT = 100
"""Characters of what is still written on one line."""
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_/-]*")
_WORDS = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"}


@dataclass(frozen=True)
class Macro:
    """Parameters of a macro, and the part of a world that it makes."""

    part: str
    """Part of the world that the macro makes; there is one of each, but any number of objects."""
    defaults: Mapping[str, Any]
    blocks: tuple[str, ...]


@functools.cache
def macros() -> Mapping[str, Macro]:
    """All macros by name, as our xacro file has them."""
    found = {}
    for element in parse(read_text(MACROS), File(MACROS.name, MACROS.parent)).walk():
        name = element.attributes.get("name", "")
        if element.tag == "xacro:macro" and not name.startswith(("vrx_mj_", "include_all")):
            said = _PARAMETER.findall(element.attributes.get("params", ""))
            defaults = {key: _default(text) for stars, key, text in said if not stars}
            part = "base" if name in PLACES else _PARTS.get(name, "task")
            found[name] = Macro(part, defaults, tuple(key for stars, key, _ in said if stars))
    return found


def _default(text: str) -> object:
    number, switch = _number(text), truth(text)
    return REQUIRED if not text else number if number is not None else text.strip("'") if switch is None else switch


def lines_of(call: Call) -> list[Line]:
    """A call as xacro.

    Raises:
        ConfigError: the macro is unknown, or does not take what the call gives.
    """
    macro = macros().get(call.macro)
    if macro is None:
        raise call.fault(None, str(UnknownNameError("macro", call.macro, macros())))
    known = [*macro.defaults, *(BLOCK + name for name in macro.blocks)]
    for key in call.parameters:
        if key not in known:
            raise call.fault(key, str(UnknownNameError(f"parameter of {call.macro}", key, known)))
    required = [key for key, value in macro.defaults.items() if value is REQUIRED]
    for key in (*required, *(BLOCK + name for name in macro.blocks if _BLOCKS[name]["needs"])):
        if key not in call.parameters:
            raise call.fault(None, f"{call.macro} needs the parameter {key!r}")
    given = ((key, _text(call, key, value)) for key, value in macro.defaults.items() if key in call.parameters)
    words = "".join(f" {key}={quoteattr(_literal(text))}" for key, text in given)
    blocks = [(_block(call, name), call.place_of(BLOCK + name)) for name in macro.blocks]
    return [(f"<xacro:{call.macro}{words}>", call.place), *blocks, (f"</xacro:{call.macro}>", call.place)]


def _text(call: Call, key: str, default: object) -> str:
    """The argument of a parameter: of the kind of its default."""
    value = call.parameters[key]
    if isinstance(default, bool):
        switch = truth(str(as_switch(str(value).strip())))
        if switch is None:
            raise call.fault(key, f"expected true or false, got {literal(value)}")
        return str(switch).lower()
    if isinstance(default, float) or default == "":
        number = 0.0 if default == "" and value in ("", None) else _number(value)
        if number is None or (default == "" and number % 1):
            raise call.fault(key, f"expected a {'whole ' * (default == '')}number, got {literal(value)}")
        return str(number)
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise call.fault(key, f"expected text, got {literal(value)}")
    text = str(value).strip()
    return f"'{text.removeprefix(SCHEME) if key.endswith('uri') else text}'"


def _literal(text: str) -> str:
    """A text that xacro takes as it is: what begins as an expression is none."""
    return _DOLLARS.sub(r"$\g<0>", text)


def _number(value: object) -> float | None:
    with contextlib.suppress(ValueError):
        return numbers_of(str(value), "value")[0]
    return None


def _block(call: Call, name: str) -> str:
    """The XML of a block on one line; an empty one where the call has none."""
    key = BLOCK + name
    value = call.parameters.get(key)
    if value is not None and not isinstance(value, str | int | float):
        raise call.fault(key, f"expected XML in quotes, got {literal(value)}")
    text = _literal("" if value is None else str(value))
    try:
        element = _block_element(f"<{name}>{text}</{name}>", call.place.file.name)
    except ConfigError as error:
        raise call.fault(key, re.sub(r" of line \d+", "", error.problems[0].message)) from None
    for fault in _odd_elements(name, element):
        raise call.fault(key, fault)
    if element.children and element.own_text:
        stray = literal(" ".join(element.own_text.split()))
        problem = f"{call.place.file.name}:{call.place_of(key).line}: {stray} between the elements of {key}"
        warn(f"{problem} is ignored", 2)
    return f"<{name}>{' '.join(text.split())}</{name}>"


@functools.lru_cache(maxsize=1000)
def _block_element(text: str, name: str) -> Element:
    """The block of a text: worlds of a series have the same ones."""
    return parse(text, File(name, None))


def _odd_elements(block: str, element: Element) -> Iterator[str]:
    """Messages about elements of a block."""
    name, known = _BLOCKS[block]["element"], _BLOCKS[block]["inside"]
    if name and element.own_text and not element.children:
        yield f"expected elements <{name}>, got {literal(element.own_text)}"
    whole = block == name and element.child(name) is None  # of a fog the block may have what is in it
    for child in [element] if whole else element.children:
        if name and child.tag != name:
            yield str(UnknownNameError("element of this block", child.tag, [name]))
        for inner in child.children if name else ():
            if inner.tag not in known:
                yield str(UnknownNameError(f"element of <{name}>", inner.tag, known))


_Made = tuple[tuple[str | int, ...], int]
"""A call: its path in the file, and the step of its axis."""


@dataclass(frozen=True)
class SeriesWorld:
    """One world of a series."""

    name: str
    number: int
    coordinate: dict[str, int]
    """The step of each axis."""
    section: Section
    """The content of its file."""
    side: Any
    """Content of a file beside it; None without one."""
    stale: bool
    """Whether VRX's own world names a link for the wind that boats have no more."""


def world_document(source: str | Path) -> tuple[Section, str] | None:
    """The content and the name of a world of a series, from `FILE#k`; None: it is no such text.

    Raises:
        ConfigError: the file is wrong, or is not there.
        VrxError: the series has no world of this number.
    """
    text, _, number = str(source).rpartition(_MARK)
    if is_path(source) or not (is_path(text) or number.isdigit()):
        return None
    series = read_series(file_of("worlds", text))
    if not re.fullmatch("[0-9]{1,9}", number) or int(number) >= series.count:
        last = series.count - 1
        raise VrxError(f"{series.file.name}{_MARK}{number}: no such world; the series has worlds 0 to {last}")
    world = series_world(series, int(number))
    return read_source("worlds", world.section), world.name


def refuse_axes(file: Path, source: str | Path) -> None:
    """Refuse a series in the place of one of its worlds.

    Raises:
        VrxError: the file is a series.
    """
    with contextlib.suppress(ConfigError):
        last = read_series(file).count - 1
        raise VrxError(f"{source} is a series of worlds: name one, '{source}#0' to '{source}#{last}'")


def series_world(series: Series, number: int) -> SeriesWorld:
    """One world of a series.

    Raises:
        ConfigError: one of its macros is called wrongly; the error lists every problem with its place.
    """
    coordinate = series.coordinate(number)
    calls = calls_of(series, number)
    lines = _lines(calls)
    pieces = [Piece(macros()[call.macro].part, call.macro, call.place, call.loc, {"call": call}) for call in calls]
    calls = [piece.content["call"] for piece in pieces_in_force(pieces)]
    try:
        found = _gazebo_world(series, number, calls, lines)
    except ConfigError as error:
        raise ConfigError(_in_axes(calls, problem) for problem in error.problems) from None
    steps = ", ".join(f"{name} {step}" for name, step in coordinate.items())
    description = f"world {number} of {Path(series.file.name).name}: {steps}"
    section = _said_by(calls, found.section.holding({**found.section, "description": description}))
    stale = any(note.what == "<wind_obj>" for note in found.notes)
    return SeriesWorld(f"{series.stem}{number}", number, coordinate, section, _side(series, coordinate), stale)


def _gazebo_world(series: Series, number: int, calls: Sequence[Call], lines: Mapping[_Made, list[Line]]) -> GazeboWorld:
    """World of Gazebo that calls make. Raises ConfigError."""
    if not lines.keys() <= series.made.keys():
        series.made.update(_expanded_around(series, number, lines))
    made = [(call.macro in PLACES, part) for call in calls for part in series.made[call.loc, call.step]]
    parts = tuple(part for of_place, part in made if not of_place or part.tag == "include")
    file, place = (series.file.folder or Path()) / Path(series.file.name).name, Place(series.file, 1)
    world = Element("world", place, {}, "", parts)
    found = world_of(file, Element("sdf", place, {"version": "1.6"}, "", (world,)), world, series.objects)
    included = [note for note in found.notes if note.what.startswith("<include>")]
    lost = [(note.place, note.ours) for note in included if note.fate == "ignored"]
    lost += [(note.place, "a boat: name it in a fleet") for note in included if note.ours.startswith("a boat")]
    if lost:
        raise ConfigError(place.problem("", message) for place, message in lost)
    return found


def _said_by(calls: Sequence[Call], section: Section) -> Section:
    """A world with the places and numbers of parameters that are called as its keys, and without what no call says."""
    section.pop("physics", None)
    for key in ("number", "tau"):
        section["sea"].pop(key, None)
    if "wind" in section and not any(f"{BLOCK}wind_objs" in call.parameters for call in calls):
        del section["wind"]["objects"]
    for call in calls:
        name, said = macros()[call.macro].part, call.parameters
        if isinstance(part := section.get(name), Section):
            values = {key: value for key, value in said.items() if key in part and part[key] == value}
            entries = {key: said.entries.get(key, entry) for key, entry in part.entries.items()}
            section[name] = Section({**part, **values}, part.place, entries)
    return section


def _lines(calls: Sequence[Call]) -> dict[_Made, list[Line]]:
    """Calls as xacro; an error lists what is wrong with any of them."""
    problems: list[Problem] = []
    lines: dict[_Made, list[Line]] = {}
    for call in calls:
        try:
            lines[call.loc, call.step] = lines_of(call)
        except ConfigError as error:
            problems += error.problems
    if problems:
        raise ConfigError(problems)
    return lines


def _expanded_around(series: Series, number: int, lines: Mapping[_Made, list[Line]]) -> dict[_Made, Sequence[Element]]:
    """Elements that the calls of a world make, with those of other worlds at once unless one of these is wrong."""
    around = dict(lines)
    with ignore_warnings():
        for call in calls_around(series, number):
            with contextlib.suppress(ConfigError):
                around[call.loc, call.step] = lines_of(call)
    with contextlib.suppress(ConfigError):
        return _expand(series, around)
    return _expand(series, lines)


def _expand(series: Series, lines: Mapping[_Made, list[Line]]) -> dict[_Made, Sequence[Element]]:
    place = Place(series.file, 1)
    within = ([("<call>", place), *own, ("</call>", place)] for own in lines.values())
    root = expanded_calls([(_HEAD_OF_XACRO, place), *itertools.chain(*within), ("</sdf>", place)])
    return {key: call.children for key, call in zip(lines, root.children, strict=True)}


def _in_axes(calls: Sequence[Call], problem: Problem) -> Problem:
    """A problem of the world that calls make as one of a parameter: that of a block, or one whose value it names."""
    keys = ((call, key) for call in calls for key in (None, *call.parameters))
    at = (problem.line, problem.column)
    call, key = next(((call, key) for call, key in keys if call.place_of(key)[1:] == at), (None, None))
    if call is None:
        return problem
    values = call.parameters.items()
    key = key or next((name for name, value in values if f"'{value}'" in problem.message), None)
    return call.problem(key, ": ".join(filter(None, (problem.key, problem.message))))


def _side(series: Series, coordinate: dict[str, int]) -> object:
    """The last of the trees that axes have for a file beside the world: VRX writes all of them to one file."""
    found = [axis.sides[coordinate[axis.name]] for axis in series.axes if coordinate[axis.name] in axis.sides]
    return found[-1] if found else None


def world_text(series: Series, world: SeriesWorld) -> str:
    """The file of a world: YAML under a comment with its origin, and with VRX's line of the coordinate."""
    return _head(series, world) + (_STALE if world.stale else "") + section_text(world.section)


def side_text(series: Series, world: SeriesWorld) -> str:
    """The file beside a world."""
    return _head(series, world) + _dump(_plain(world.side))


def _head(series: Series, world: SeriesWorld) -> str:
    source = series.file.name.rpartition("/")[2]
    coordinate = _dump(world.coordinate, flow=True, width=10_000_000)
    return f"{HEAD}{world.number} of {source}, made by vrx-mj worlds generate.\n# COORDINATE: {coordinate}"


class _Inline(dict[str, Any]):
    """A mapping on one line."""


class _Dumper(yaml.SafeDumper):
    """PyYAML's, which quotes whatever YAML 1.1 or 1.2 could take for something else than text."""

    def ignore_aliases(self, data: object) -> bool:
        """Whether to write a thing anew where it comes again: always."""
        return True


def _quote_scalar(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    plain = _PLAIN.fullmatch(value) and value.lower() not in _WORDS
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=None if plain else '"')


_Dumper.add_representer(str, _quote_scalar)
_Dumper.add_representer(
    _Inline, lambda dumper, value: dumper.represent_mapping("tag:yaml.org,2002:map", value.items(), flow_style=True)
)


def _dump(tree: object, *, flow: bool | None = None, width: int = _WIDTH) -> str:
    return yaml.dump(tree, Dumper=_Dumper, default_flow_style=flow, sort_keys=False, width=width, allow_unicode=True)


def section_text(section: Section) -> str:
    """A world as YAML, as our own files are written."""
    return _dump(_plain(section))


def _plain(value: object, *, inside: bool = False) -> object:
    """Dicts and lists of sections and items; short mappings inside of others on one line."""
    if isinstance(value, Section):
        content = {key: _plain(item, inside=True) for key, item in value.items()}
        return _Inline(content) if inside and len(str(content)) < _SHORT else content
    if isinstance(value, Items):
        return [_plain(item, inside=True) for item in value]
    return value
