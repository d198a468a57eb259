"""An XML file of Gazebo or ROS as elements that know their places; xacro in it is expanded."""

import contextlib
import json
import os.path
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from vrx_mj.config.search import display, package_paths
from vrx_mj.config.tree import File, Place, literal
from vrx_mj.errors import ConfigError, Problem, VrxError
from vrx_mj.foreign import ReaderError, ask, ask_ahead, spend
from vrx_mj.formats.series.pieces import At, Content
from vrx_mj.formats.urdf.elements import Findings, Node, numbers_of, truth
from vrx_mj.formats.urdf.expand import Arguments, expand, expanded_lines
from vrx_mj.formats.urdf.gazebo_sensors import library
from vrx_mj.formats.urdf.model import Loss
from vrx_mj.formats.urdf.model import Place as Spot
from vrx_mj.formats.urdf.xml_document import Markup, Table, file_error, read_bytes, read_text

LIBRARIES = frozenset({"robotx_gazebo", "vmrc_gazebo", "vorc_gazebo", "vrx_2019", "vrx_gazebo", "wave_gazebo"})
"""Packages of VRX, whose files may be missing: macros of ours stand for theirs."""

_TABLE = "formats.urdf.xml_document:table"
"""Job that parses a text."""
_ODD_TAG = re.compile(r"[^\w.-]")
Fate = Literal["imported", "approximated", "ignored", "not read"]
"""Fates of a part of a file."""
_FIELDS: Mapping[str, Mapping[str, Sequence[Any]]] = json.loads((Path(__file__).parent / "fields.json").read_bytes())
"""Rows that fill keys of ours from plugins and other elements of worlds: arguments of `Element.value_of`."""
NEEDED = "needed"
"""The default of an element that must be there."""
POSE = "x y z roll pitch yaw"
"""The numbers of a pose."""
STRICT = ContextVar("STRICT", default=False)
"""Whether a part of a world that cannot be read is an error; otherwise the rest is read, and it is a note."""


@dataclass(frozen=True)
class Note:
    """Fate of one part of a file. Those of a command are counted: after too many it raises ReaderError."""

    place: Place
    what: str
    """The part, as the file calls it."""
    fate: Fate
    ours: str
    """The part's name here, or the reason why it is not imported."""

    def __post_init__(self) -> None:
        spend(self.place.file.name)


@dataclass
class Report:
    """Report of one import: the fate of each part of its files, and all problems."""

    notes: list[Note] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)

    def note(self, part: "Element | Node", fate: Fate, ours: str, what: str | None = None) -> None:
        """Note what became of an element."""
        place = part.place if isinstance(part, Element) else spot(part.place)
        self.notes.append(Note(place, what or label(part), fate, ours))

    def lose(self, losses: Iterable[Loss], fate: Fate = "ignored") -> None:
        """Note what is lost, or differs here."""
        self.notes += [Note(spot(place), what, fate, why) for place, what, why in losses]

    def settle(self) -> None:
        """Raise all problems as one ConfigError."""
        if self.problems:
            order = sorted(dict.fromkeys(self.problems), key=lambda problem: (problem.file, problem.line or 0))
            raise ConfigError(order)


@dataclass(frozen=True)
class Element:
    """An element of a file: its tag, where it begins, its attributes, its own text and the elements in it."""

    tag: str
    place: Place
    attributes: Mapping[str, str]
    own_text: str
    """Text between its tags, that in other elements left out, without blanks around it."""
    children: tuple["Element", ...]

    def attribute(self, name: str) -> str:
        """An attribute's text, without blanks around it; empty without one."""
        return self.attributes.get(name, "").strip()

    def all(self, path: str) -> list["Element"]:
        """All elements of a tag in this one; of tags with '/' between, all elements down that path."""
        found = [self]
        for tag in path.split("/"):
            found = [child for one in found for child in one.children if child.tag == tag]
        return found

    def child(self, path: str) -> "Element | None":
        """The first of these elements."""
        return next(iter(self.all(path)), None)

    def walk(self) -> Iterator["Element"]:
        """This element and all in it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def text(self, path: str) -> str:
        """The text of the first element down a path that has one; empty without one."""
        return str(self.value_of(path, "text", ""))

    def fault(self, message: str, key: str = "") -> ConfigError:
        """An error at this element."""
        path = " / ".join(filter(None, (label(self), key)))
        return ConfigError([self.place.problem(path, message)])

    def value_of(self, path: str, form: str = "number", default: Any = None) -> Any:
        """Value of the text of an element in this one.

        Args:
            path: names of elements with '/' between, each in the one before; of such with '|' between, the first that
                is there and not empty.
            form: `number`, `whole`, `switch`, `flag` (a switch that only counts where it is true), `text`, `model` (a
                name without that of a link in it), `color`, what each of several numbers is called, or `list of TABLE`:
                of all such elements the rows of a table.
            default: what a missing or empty element means; `NEEDED`: an error.

        Raises:
            ConfigError: the text is of another form, or missing.
        """
        found = [one for way in path.split("|") for one in self.all(way)]
        if form.startswith("list of "):
            return [At(one.fields(form.removeprefix("list of ")), one.place) for one in found] or default
        first = next((one for one in found if one.own_text), None)
        if first is None and default == NEEDED:
            raise self.fault(f"<{path.partition('|')[0]}> is required, but missing")
        return default if first is None else first.value(form)

    def fields(self, of: str) -> Content:
        """Values of the rows of a table in `_FIELDS`, without those whose elements are missing. Raises ConfigError."""
        found = {key: self.value_of(*row) for key, row in _FIELDS[of].items()}
        return {key: value for key, value in found.items() if value is not None}

    def value(self, form: str) -> Any:
        """Value of this element's text: a list where the form is of several numbers. Raises ConfigError."""
        if form in {"text", "model"}:
            return self.own_text.partition("::")[0] if form == "model" else self.own_text
        if form in {"switch", "flag"}:
            return self.truth(self.own_text, "") or (None if form == "flag" else False)
        labels = {"whole": "number", "color": "r g b" if len(self.own_text.split()) == 3 else "r g b a"}.get(form, form)
        with faults_at(self):
            numbers = numbers_of(self.own_text, labels)
        if form == "whole" and not numbers[0].is_integer():
            raise self.fault(f"expected a whole number, got {literal(self.own_text)}")
        return int(numbers[0]) if form == "whole" else numbers[0] if form == "number" else list(numbers)

    def truth(self, text: str, key: str) -> bool:
        """Whether a text of this element is true. Raises ConfigError: it is neither true nor false."""
        found = truth(text)
        if found is None:
            raise self.fault(f"expected true or false, got {literal(text)}", key)
        return found


def is_file(path: Path) -> bool:
    """Whether there is a file of this path, which may be too long for any."""
    return os.path.isfile(path)  # noqa: PTH113 - Path.is_file raises an OSError for a name that is too long


def home_path(text: str) -> Path:
    """A path whose `~` is a home folder; for a user that does not exist it stays as it is."""
    return Path(os.path.expanduser(text))  # noqa: PTH111 - Path.expanduser raises a RuntimeError for such a user


def read_document(file: Path, arguments: Arguments | None = None) -> Element:
    """The root element of a file; a `.xacro` is expanded, where VRX's macros of worlds are ours.

    Files that it includes are read from its own folder and from packages alone.

    Raises:
        ConfigError: it cannot be read or expanded.
    """
    if not file.name.lower().endswith(".xacro"):
        return parse(read_text(file), File(display(file), file.parent))
    if not is_file(file):
        read_bytes(file)  # raises the reason
    made = expand(file, arguments=arguments, package_paths=package_paths(), libraries=LIBRARIES).made
    sources = map(Path, made.files)
    files = [File(display(one), one.parent, tuple(read_text(one).split("\n"))) for one in sources]
    return _element(made.table, lambda number, line, column: Place(files[number], line, column))


def expanded_calls(lines: Sequence[tuple[str, Place]]) -> Element:
    """The root element of lines of xacro that call macros of worlds, each with the place that its elements have.

    Raises:
        ConfigError: it cannot be expanded.
    """
    return _element(expanded_lines(lines), lambda _, line, __: lines[line - 1][1])


def parse_ahead(files: Iterable[Path]) -> None:
    """Parse files in one question; what is wrong with one is reported where it is read."""
    calls = []
    for file in files:
        with contextlib.suppress(ConfigError):
            calls.append((read_text(file), display(file)))
    ask_ahead(_TABLE, calls, "the models of a world")


def parse(text: str, file: File) -> Element:
    """The root element of a text in a file. Raises ConfigError."""
    try:
        table = ask(_TABLE, text, file.name, returns=Table, about=file.name)
    except ReaderError as error:
        raise file_error(file.name, error.reason) from None
    whole = File(file.name, file.folder or Path(), tuple(text.split("\n")))
    return _element(table, lambda _, line, column: Place(whole, line, column))


def _element(table: Table, place: Callable[[int, int, int], Place]) -> Element:
    """The root element of a table, with places by the number of a file, line and column."""
    inside: list[list[Element]] = [[] for _ in (*table, "what is around all")]
    for number, (around, file, line, column, tag, attributes, text) in reversed([*enumerate(table)]):
        children = tuple(reversed(inside[number]))
        inside[around].append(Element(tag, place(file, line, column), attributes, text, children))
    return inside[-1][0]


def as_node(element: Element) -> Node:
    """An element as the readers of links and shapes take it, which note problems."""
    return Node(markup(element, str), label(element), Findings(element.place.file.name))


def label(part: Element | Node) -> str:
    """An element as messages call it: `<include> 'buoy'`."""
    name = part.attribute("name") or part.text("name") or part.text("uri")
    return f"<{part.tag}>{f' {literal(name)}' if name else ''}"


@contextlib.contextmanager
def faults_at(element: Element, key: str = "", before: str = "") -> Iterator[None]:
    """Turn a VrxError or ValueError raised inside into an error at an element."""
    try:
        yield
    except (VrxError, ValueError) as error:
        raise element.fault(f"{before}{error}", key) from None


def spot(place: Spot, folder: Path | None = None) -> Place:
    """The place of a node or a loss as worlds have it, whose relative paths begin in a folder."""
    return Place(File(place.file, folder), place.line, place.column)


def plugin_name(plugin: Element | Node) -> str:
    """A plugin's library in lower case, without what separates words; the same for both names of the newer Gazebo."""
    return re.sub("[_-]", "", library(plugin.attribute("filename") or "").lower())


def markup(element: Element, uri: Callable[[str], str]) -> Markup:
    """An element as those of a URDF are, with other texts in its URIs."""
    file, line, column = element.place
    attributes = {key: value for key, value in element.attributes.items() if ":" not in key}
    made = Markup(_ODD_TAG.sub("_", element.tag), Spot(file.name, line, column), attributes)
    made.text = uri(element.own_text) if element.tag == "uri" else element.own_text
    made.extend([markup(child, uri) for child in element.children])
    return made
