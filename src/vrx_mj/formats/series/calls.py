"""Calls of macros in a world of a VRX series: their values, their blocks, and the models that they place."""

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from vrx_mj.config.loading import problem_at
from vrx_mj.config.tree import Entry, Items, Place, Section, key_path
from vrx_mj.config.wording import shown
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxWarning
from vrx_mj.formats.series.axes import Axis, Series
from vrx_mj.formats.urdf.elements import numbers_of
from vrx_mj.formats.urdf.expressions import Result, evaluated
from vrx_mj.formats.urdf.xml_text import parse_pieces
from vrx_mj.frames import Pose

BLOCK = "/**"
"""What the name of a parameter that holds XML begins with."""
BLOCK_OF_STEPS = 100
"""Steps of each axis whose expressions are worked out at once."""
Results = Mapping[tuple[str, int], Result]
"""What expressions come to, by their text and the step."""


@dataclass(frozen=True)
class Call:
    """A macro called with parameters."""

    macro: str
    parameters: Section
    place: Place
    loc: tuple[str | int, ...]
    """Its path in the file."""

    def needs(self, key: str) -> ConfigError:
        """The error that a parameter is missing."""
        return self.fault(None, f"{self.macro} needs the parameter {key!r}")

    def problem(self, key: str | None, message: str) -> Problem:
        """A problem with a parameter, or with the call itself."""
        entry = self.parameters.entries.get(key or "")
        place = entry.value if entry else self.place
        path = (*self.loc, key) if entry and key else self.loc
        return Problem(place.file.name, place.line, place.column, key_path(path), message)

    def fault(self, key: str | None, message: str) -> ConfigError:
        """The same as an error."""
        return ConfigError([self.problem(key, message)])


def calls_of(series: Series, number: int) -> list[Call]:
    """The calls that make one world, in the order of VRX: by macro, as each is first named; later axes add to a macro.

    Where two axes have a sequence for one macro, VRX means to do so but adds the names of macros as parameters.
    """
    steps = series.coordinate(number)
    results = _results(series, steps)
    found: dict[str, list[Call]] = {}
    for axis in series.axes:
        for label, call in _of_axis(series, axis, steps[axis.name], results):
            found.setdefault(label, []).append(call)
    return [call for calls in found.values() for call in calls]


def _of_axis(series: Series, axis: Axis, step: int, results: Results) -> Iterator[tuple[str, Call]]:
    literal = step in axis.sequence
    macros: Mapping[str, Any] = (axis.sequence[step] or {}) if literal else axis.macros
    above = (axis.name, "sequence", str(step)) if literal else (axis.name, "macros")
    for label, calls in macros.items():
        assert isinstance(calls, Items), "read_series has looked at the shapes"
        for index, parameters in enumerate(calls):
            loc, place = (*above, label, index), calls.places[index]
            given = parameters if isinstance(parameters, Section) else Section({}, place, {})
            values = given if literal else _worked_out(series, loc, given, step, results)
            yield label, Call(label.strip("*"), values, place, loc)


def _worked_out(series: Series, loc: tuple[str | int, ...], given: Section, step: int, results: Results) -> Section:
    values = {}
    for key, value in given.items():
        values[key] = _literal(key, value)
        if values[key] is not EXPRESSION:
            continue
        result = results[value, step]
        if result.problem:
            message = f"{shown(value)}: {result.problem}; a text needs single quotes inside the double ones"
            raise ConfigError([problem_at(series.root, (*loc, key), message)])
        values[key] = result.value
    return Section(values, given.place, given.entries)


EXPRESSION = object()
"""Marks a text that is an expression of `n`."""


def _literal(key: str, value: object) -> object:
    """The value of a parameter; a text in single quotes is meant literally, as XML is, any other is an expression."""
    if not isinstance(value, str):
        return value
    bare = value.strip()
    if len(bare) > 1 and bare[0] == bare[-1] == "'":
        return bare[1:-1]
    return value if key.startswith(BLOCK) and (not bare or bare.startswith("<")) else EXPRESSION


def _results(series: Series, steps: Mapping[str, int]) -> Results:
    """What the expressions of some steps of each axis come to, those of one world among them."""
    blocks = {name: step // BLOCK_OF_STEPS * BLOCK_OF_STEPS for name, step in steps.items()}
    key = tuple(blocks.values())
    if key not in series.results:
        texts = [
            (text, step)
            for axis in series.axes
            for text in dict.fromkeys(_expressions(axis))
            for step in range(blocks[axis.name], min(axis.steps, blocks[axis.name] + BLOCK_OF_STEPS))
        ]
        found = evaluated(series.file.name, [(f"${{{text}}}", {"n": step}) for text, step in texts])
        series.results[key] = dict(zip(texts, found, strict=True))
    found_before: Results = series.results[key]
    return found_before


def _expressions(axis: Axis) -> Iterator[str]:
    for calls in axis.macros.values():
        for call in calls:
            for key, value in call.items() if isinstance(call, Section) else ():
                if _literal(key, value) is EXPRESSION:
                    yield value


@dataclass(frozen=True)
class Tag:
    """An element of a block."""

    element: Any
    call: Call
    key: str
    """Name of the parameter that it is in."""

    @property
    def name(self) -> str:
        """What it is called."""
        return str(self.element.tag)

    def fault(self, message: str) -> ConfigError:
        """An error about it, at the parameter: YAML's quotes do not keep the lines in them."""
        return self.call.fault(self.key, message)

    def only(self, *names: str) -> None:
        """Refuse elements inside of other names."""
        for child in self.element.iterchildren("*"):
            if child.tag not in names:
                where = f"element of <{self.name}>" if self.element.getparent() is not None else "element of this block"
                raise self.fault(str(UnknownNameError(where, str(child.tag), names)))

    def all(self, name: str) -> list["Tag"]:
        """The elements of this name inside."""
        return [Tag(child, self.call, self.key) for child in self.element.iterchildren(name)]

    def text(self, name: str) -> str | None:
        """The text of the one element of this name inside; None without one."""
        found = self.all(name)
        if len(found) > 1:
            raise self.fault(f"<{self.name}> has {len(found)} elements <{name}>; one is expected")
        return "".join(found[0].element.itertext()).strip() if found else None

    def required(self, name: str) -> str:
        """The same of an element that is required, and may not be empty."""
        text = self.text(name)
        if not text:
            raise self.fault(f"<{self.name}> needs a <{name}>")
        return text

    def numbers(self, name: str, labels: str) -> list[float] | None:
        """The numbers in the one element of this name; `labels` names each of them."""
        text = self.text(name)
        return None if text is None else self.read_numbers(text, f"<{name}>", labels.split())

    def read_numbers(self, text: str, where: str, labels: Sequence[str]) -> list[float]:
        """One number for each label."""
        try:
            return numbers_of(text, labels)
        except ValueError as error:
            raise self.fault(f"{where}: {error}") from None


@dataclass(frozen=True)
class Block:
    """What a parameter holds: elements, or text alone."""

    root: Tag
    place: Place

    @property
    def stray(self) -> str:
        """Text between the elements, which SDF has no use for."""
        element = self.root.element
        pieces = [element.text or "", *(child.tail or "" for child in element)] if len(element) else []
        return " ".join(" ".join(pieces).split())

    @property
    def text(self) -> str:
        """All text, elements or not."""
        return "".join(self.root.element.itertext()).strip()

    def each(self, name: str) -> Iterator[Tag]:
        """The elements, all of which must be of this name."""
        self.root.only(name)
        found = self.root.all(name)
        if self.text and not found:
            raise self.root.fault(f"expected elements <{name}>, got {shown(self.text)}")
        yield from found


def read_block(call: Call, key: str) -> Block:
    """The XML in a parameter."""
    value = call.parameters[key]
    if value is not None and not isinstance(value, str | int | float):
        raise call.fault(key, f"expected XML in quotes, got {shown(value)}")
    text = "" if value is None else str(value)
    try:
        element = parse_pieces(text, call.place.file.name)
    except ConfigError as error:
        said = re.sub(
            r"the <(\S+)> of line \d+ ends with </pieces>", r"the <\1> does not end", error.problems[0].message
        )
        raise call.fault(key, re.sub(r" of line \d+", "", said)) from None
    block = Block(Tag(element, call, key), call.parameters.entries[key].value)
    if block.stray:
        name, line, _ = block.place.file.name, block.place.line, block.place.column
        message = f"{name}:{line}: {shown(block.stray)} between the elements of {key} is ignored"
        warnings.warn(message, VrxWarning, stacklevel=2)
    return block


REQUIRED = object()
"""Marks a parameter without a default, which must be given."""
SWITCHES = {"true": True, "1": True, "yes": True, "on": True, "false": False, "0": False, "no": False, "off": False}
LONGEST = 40
"""Characters of a number."""


class At(NamedTuple):
    """A value and where it is said."""

    value: Any
    place: Place


class Given:
    """The arguments of a call, and the defaults of its macro."""

    def __init__(self, call: Call, defaults: Mapping[str, object], blocks: Sequence[str]) -> None:
        self.call = call
        self.defaults = defaults
        known = [*defaults, *(BLOCK + name for name in blocks)]
        for key in call.parameters:
            if key not in known:
                raise call.fault(key, str(UnknownNameError(f"parameter of {call.macro}", key, known)))
        for key, value in defaults.items():
            if value is REQUIRED and key not in call.parameters:
                raise call.needs(key)

    def number(self, name: str) -> At:
        """A parameter that is a number."""
        value = self._said(name)
        found = _number(value)
        if found is None:
            raise self.call.fault(name, f"expected a number, got {shown(value)}")
        return self._at(name, found)

    def whole(self, name: str) -> At:
        """A parameter that is a whole number; an empty text is 0."""
        value = self._said(name)
        found = 0 if value in ("", None) else _number(value)
        if found is None or found != found // 1:
            raise self.call.fault(name, f"expected a whole number, got {shown(value)}")
        return self._at(name, int(found))

    def numbers(self, names: str) -> list[At]:
        """Several numbers; `names` has blanks between them."""
        return [self.number(name) for name in names.split()]

    def text(self, name: str) -> At:
        """A parameter that is text."""
        value = self._said(name)
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self.call.fault(name, f"expected text, got {shown(value)}")
        return self._at(name, str(value).strip())

    def switch(self, name: str) -> At:
        """A parameter that is true or false."""
        value = self._said(name)
        found = value if isinstance(value, bool) else SWITCHES.get(str(value).strip().lower())
        if found is None:
            raise self.call.fault(name, f"expected true or false, got {shown(value)}")
        return self._at(name, found)

    def block(self, name: str) -> Block | None:
        """A parameter that is XML; None where the call does not give it."""
        key = BLOCK + name
        if key not in self.call.parameters:
            return None
        return read_block(self.call, key)

    def _said(self, name: str) -> object:
        return self.call.parameters.get(name, self.defaults[name])

    def _at(self, name: str, value: object) -> At:
        entry = self.call.parameters.entries.get(name)
        return At(value, entry.value if entry else self.call.place)


def located(value: object, place: Place) -> Any:
    """Dicts and lists as sections and items at `place`, but for what an `At` puts elsewhere."""
    if isinstance(value, At):
        return located(value.value, value.place)
    if isinstance(value, dict):
        entries = {key: Entry(_place(item, place), _place(item, place)) for key, item in value.items()}
        return Section({key: located(item, place) for key, item in value.items()}, place, entries)
    if isinstance(value, list):
        return Items.of((located(item, place) for item in value), (_place(item, place) for item in value))
    return value


def _place(value: object, place: Place) -> Place:
    return value.place if isinstance(value, At) else place


def _number(value: object) -> float | int | None:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    if not isinstance(value, str) or len(value) > LONGEST:
        return None
    try:
        return float(value)
    except ValueError:
        return None


SCHEME = "model://"
HERE: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SYMBOLS = re.compile(r"vrx_dock_([a-z]+_[a-z]+)__([a-z]+_[a-z]+)")
"""The floating docks of 2018 with fixed symbols, one folder for each pair."""
OWN_NAMES = (
    (re.compile(r"short_navigation_course(\d)"), r"short_navigation_course_\1"),
    (re.compile(r"navigation_course(\d)"), r"vrx_navigation_course_\1"),
    (re.compile(r"navigation_course"), "vrx_navigation_course"),
    (re.compile(r"obstacle_course"), "robotx_obstacle_course"),
    (re.compile(r"(dock_20(?:16|18|22))(?:_dynamic)?"), r"robotx_\1"),
)
"""Folders whose models go by another name."""
PLUGIN = "libfollow_plugin.so"
Object = dict[str, Any]


def thing(uri: At, pose: object, name: At | None = None) -> Object:
    """An object of a world; without a name until the world has all of them."""
    folder = str(uri.value).removeprefix(SCHEME).strip("/")
    symbols = SYMBOLS.fullmatch(folder)
    known: Object = {"model": At("dock_2018_dynamic" if symbols else folder, uri.place), "pose": pose}
    if symbols:
        known["symbols"] = At([symbols[1], symbols[2]], uri.place)
    return known if name is None else {"name": name, **known}


def named_as(model: str) -> str:
    """The name that a model has by itself."""
    for pattern, name in OWN_NAMES:
        found = pattern.fullmatch(model)
        if found:
            return found.expand(name)
    return model


def included(tag: Tag, place: Place) -> Object:
    """The object of an <include>."""
    tag.only("name", "uri", "pose", "plugin")
    name, pose = tag.text("name"), tag.numbers("pose", "x y z roll pitch yaw")
    found = thing(At(tag.required("uri"), place), At(pose or list(HERE), place), At(name, place) if name else None)
    plugins = tag.all("plugin")
    if plugins:
        found["path"] = At(_path(plugins[0]), place)
    return found


def _path(tag: Tag) -> Object:
    """The path of a follow plugin."""
    if tag.element.get("filename") != PLUGIN:
        raise tag.fault(f"<plugin>: only {PLUGIN} is known in an <include>, got '{tag.element.get('filename')}'")
    path: Object = {"loop": bool(tag.all("loop_forever"))}  # VRX goes by its presence
    for waypoints in tag.all("waypoints"):
        points = ["".join(point.element.itertext()) for point in waypoints.all("waypoint")]
        path["waypoints"] = [waypoints.read_numbers(text, "<waypoint>", ["x", "y"]) for text in points]
    for circle in tag.all("circle"):
        path["circle"] = _values(circle, "radius")
    for line in tag.all("line"):
        path["line"] = _values(line, "length", "direction")
    return path


def _values(tag: Tag, *names: str) -> Object:
    found = {name: tag.numbers(name, name) for name in names}
    return {name: values[0] for name, values in found.items() if values}
