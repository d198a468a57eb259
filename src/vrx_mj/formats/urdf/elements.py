"""Elements of an XML file, read so that all faults are found at once, and the table of what is read of SDF and URDF.

A value that cannot be read is noted as a problem, and reading goes on with its default.

The table, `tags.json`, covers SDF 1.4 to 1.12 and URDF. It has a section for each element of SDF that is described by
itself, and `robot` for URDF. The path of an element, or of an attribute after '@', has a fate and words: `read` and as
what, `lost` and why, or `harmless`. A third text is the value with which nothing is lost. Fates may differ between
`boat`, `object` and `world`. Lost without words is lost together with its parent; read without words only holds
others.
"""

import itertools
import json
import math
import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar, get_args

from pydantic import ValidationError

from vrx_mj.config.base import Config
from vrx_mj.config.loading import problems_of
from vrx_mj.config.tree import File, choice, literal, of_python
from vrx_mj.errors import ConfigError, Problem, nearest, quote
from vrx_mj.formats.urdf.model import Loss, Place
from vrx_mj.formats.urdf.xml_document import Markup

_ConfigT = TypeVar("_ConfigT", bound=Config)

_SWITCHES = {"true": True, "1": True, "false": False, "0": False}
LARGEST = 1e12
"""Largest number that a file may give, in any unit."""

_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
_ODD_CHARACTER = re.compile(r"[^A-Za-z0-9_.-]|^[.-]")
_ENDLESS = re.compile(r"[-+]?inf(inity)?", re.IGNORECASE)
_NOT_FINITE = re.compile(r"[-+]?(nan|inf|infinity)", re.IGNORECASE)
_LABELS = {3: "x y z", 6: "x y z roll pitch yaw"}
_TEXT = (Path(__file__).parent / "tags.json").read_bytes()  # the sandboxed process may read no file later


def numbers_of(
    text: str, labels: str, above: float = -math.inf, low: float = -math.inf, high: float = math.inf,
    largest: float = LARGEST,
) -> tuple[float, ...]:  # fmt: skip
    """The numbers of a text with blanks between them, one for each label.

    Raises:
        ValueError: they are others than finite numbers within the limits, or not as many as labels.
    """
    words, names = text.split(), labels.split()
    if len(words) != len(names):
        form = "a number" if len(names) == 1 else f"{len(names)} numbers {labels}"
        raise ValueError(f"expected {form}, got {literal(text)}")
    for word in words:
        if message := _fault(word, above, low, high, largest):
            raise ValueError(message)
    return tuple(float(word) + 0.0 for word in words)


def own_name(text: str, most: int = 64) -> str:
    """A name as ours may be, of at most so many characters."""
    return _ODD_CHARACTER.sub("_", text)[:most]


def unused_name(name: str, taken: Container[str], first: int = 2) -> str:
    """A name that is not taken: itself, or numbered from `first` on."""
    numbered = (f"{name}_{number}" for number in itertools.count(first))
    return next(one for one in itertools.chain([name], numbered) if one not in taken)


def truth(text: str) -> bool | None:
    """Whether a text is true, as SDF and roslaunch read it: true, false, 1 or 0 in any case; None: it is neither."""
    return _SWITCHES.get(text.strip().lower())


@dataclass(frozen=True)
class Tag:
    """A value that files write as the text of an element: a row of the tables of plugins and sensors."""

    path: str
    """Names of elements with '/' between, each in the one before; of such with '|' between, the first that is there."""
    default: Any = 0.0
    """Value of a missing or empty element, whose type is the form: a number, an int for a count, a switch, a text,
    or several numbers."""
    unit: str = ""
    above: float = -math.inf
    low: float = -math.inf
    high: float = math.inf
    largest: float = LARGEST
    """Largest amount; where any is allowed, the number may be infinite as well."""
    labels: str = ""
    """Names of the numbers in messages, where they are not `x y z` or the element's own name."""


Values = dict[str, Any]
"""Fields of a model of `config` by name, as a file gives them."""
Rows = Mapping[str, Tag]
"""Tags by the fields that they fill, or by what these are made of."""


def _tag(name: str, row: Mapping[str, Any]) -> Tag:
    default = row["default"]
    return Tag(**{"path": name, **row, "default": tuple(default) if isinstance(default, list) else default})


FIELDS: Mapping[str, Rows] = {
    of: {name: _tag(name, row) for name, row in table["rows"].items()}
    for of, table in json.loads((Path(__file__).parent / "fields.json").read_bytes()).items()
}
"""Tags that fill fields of ours from plugins, sensors and shapes, by what these belong to."""


@dataclass
class Findings:
    """Problems of a file, and what is suspicious in it."""

    file: str
    """Name of the file in messages."""
    problems: list[Problem] = field(default_factory=list)
    odd: dict[str, dict[str, None]] = field(default_factory=dict)
    """Things that are legal but suspicious, by their kind."""

    def note(self, kind: str, thing: str) -> None:
        """Note a suspicious thing, once."""
        self.odd.setdefault(kind, {})[thing] = None

    def check_names(self, kind: str, things: Iterable[tuple[str, Place, str]]) -> None:
        """Note a problem for each thing of a kind, given by name, place and path, whose name an earlier one has."""
        first: dict[str, Place] = {}
        for name, place, path in things:
            if name and first.setdefault(name, place) is not place:
                message = f"duplicate name: line {first[name].line} has a {kind} of this name"
                self.problems.append(place.problem(path, message))

    def settle(self) -> None:
        """Raise all problems, in the order of the file."""
        if self.problems:
            raise ConfigError(sorted(dict.fromkeys(self.problems), key=lambda problem: problem.line or 0))


class Node:
    """An element: its tag and place, its attributes, its children, and their texts."""

    def __init__(self, element: Any, path: str, findings: Findings) -> None:
        self.element = element
        """A `Markup`."""
        self.path = path
        """Path from the root, for messages: "link 'hull' / inertial"."""
        self.findings = findings
        self.tag: str = element.tag
        self.place: Place = element.place

    def fault(self, message: str, key: str = "") -> None:
        """Note a problem with the element, or with its attribute or child `key`."""
        path = " / ".join(filter(None, (self.path, key)))
        self.findings.problems.append(self.place.problem(path, message))

    def children(self, tag: str) -> list["Node"]:
        """All children of this name; those with a name of their own are called by it."""
        found = []
        for element in self.element.findall(tag):
            name = f" '{element.get('name')}'" if element.get("name") else ""
            found.append(Node(element, " / ".join(filter(None, (self.path, f"{tag}{name}"))), self.findings))
        return found

    def child(self, *path: str) -> "Node | None":
        """The first child of this name; of several names, the first child down that path; or as in `Tag.path`."""
        for way in "/".join(path).split("|"):
            node: Node | None = self
            for tag in way.split("/"):
                node = next(iter(node.children(tag)), None) if node else None
            if node is not None:
                return node
        return None

    def required_child(self, tag: str) -> "Node | None":
        """A child that must be there."""
        node = self.child(tag)
        if node is None:
            self.fault("required, but missing", tag)
        return node

    def attribute(self, name: str) -> str | None:
        """An attribute's text, without blanks around it; None without one."""
        value = self.element.get(name)
        return None if value is None else str(value).strip()

    def required_attribute(self, attribute: str) -> str:
        """An attribute that must be there and not be empty; empty if it is not."""
        value = self.attribute(attribute)
        if not value:
            self.fault("required, but missing" if value is None else "must not be empty", attribute)
        return value or ""

    def number(self, attribute: str, default: float | None = None, **limits: float) -> float:
        """An attribute that is a number; it must be there if it has no default."""
        found = self.numbers(attribute, attribute, None if default is None else (default,), **limits)
        return found[0]

    def needed_value(self, attribute: str, tag: Tag) -> Any:
        """An attribute that must be there, and is as the tag is where files write it as an element."""
        several = isinstance(tag.default, tuple)
        found = self.numbers(attribute, _LABELS[len(tag.default)] if several else attribute, above=tag.above)
        return found if several else found[0]

    def numbers(
        self, attribute: str, labels: str, default: Sequence[float] | None = None, **limits: float
    ) -> tuple[float, ...]:
        """An attribute that is one number for each of the labels, within `above`, `low` and `high`."""
        value = self.attribute(attribute)
        instead = tuple(default or (math.nan,) * len(labels.split()))
        if value is None:
            if default is None:
                self.fault("required, but missing", attribute)
            return instead
        return self._parse(value, attribute, labels, **limits) or instead

    def text(self, path: str, default: str = "") -> str:
        """The text of a child, without blanks around it."""
        return str(self.value_of(Tag(path, default)))

    def value(self, path: str, default: float, **limits: Any) -> float:
        """A child whose text is a number; VRX leaves some empty, which means the default."""
        return float(self.value_of(Tag(path, float(default), **limits)))

    def values(self, path: str, labels: str, default: Sequence[float], **limits: Any) -> tuple[float, ...]:
        """A child whose text is one number for each of the labels."""
        return tuple(self.value_of(Tag(path, tuple(default), labels=labels, **limits)))

    def flag(self, path: str, default: bool) -> bool:
        """A child that is true or false."""
        return bool(self.value_of(Tag(path, default)))

    def value_of(self, tag: Tag) -> Any:
        """Value of a tag below this element."""
        node, default = self.child(tag.path), tag.default
        text = "" if node is None else " ".join("".join(node.element.itertext()).split())
        if node is None or not text or isinstance(default, str):
            return text or default
        if isinstance(default, bool):
            return node._switch(text, "", default)
        several = isinstance(default, tuple)
        labels = tag.labels or (_LABELS[len(default)] if several else node.tag)
        missing = 6 - len(text.split()) if labels == _LABELS[6] else 0
        short = 0 < missing <= 3  # Gazebo classic turns nothing unless all three angles are there
        if short:
            self.findings.note("pose", f"{literal(text)} on line {node.place.line}")
            text += " 0" * missing
        found = node._parse(text, "", labels, above=tag.above, low=tag.low, high=tag.high, largest=tag.largest)
        found = (*found[:3], 0.0, 0.0, 0.0) if found and short else found
        if found is None or several:
            return found or default
        return round(found[0]) if isinstance(default, int) else found[0]

    def attribute_flag(self, name: str) -> bool:
        """An attribute that is true or false; not where it is missing or empty."""
        text = self.attribute(name) or ""
        return self._switch(text, name, False) if text else False

    def _switch(self, text: str, key: str, default: bool) -> bool:
        found = truth(text)
        if found is None:
            self.fault(choice(text, ["true", "false"]), key)
        return default if found is None else found

    def fields(self, rows: Rows) -> Values:
        """Values of rows by name."""
        return {name: self.value_of(tag) for name, tag in rows.items()}

    def config_of(self, model: type[_ConfigT], values: Mapping[str, object]) -> _ConfigT | None:
        """A model of these values; what is wrong with them is a problem of this element."""
        try:
            return model.model_validate(values)
        except ValidationError as error:
            plain = {key: value for key, value in values.items() if key != "folder"}
            for problem in problems_of(error, of_python(plain, File(self.findings.file, None))):
                self.fault(problem.message, problem.key)
        return None

    def _parse(self, text: str, key: str, labels: str, **limits: float) -> tuple[float, ...] | None:
        try:
            return numbers_of(text, labels, **limits)
        except ValueError as error:
            self.fault(str(error), key)
        return None


def _fault(word: str, above: float, low: float, high: float, largest: float) -> str:
    """Message about the text of a number; empty if nothing is wrong."""
    if not (_NUMBER.fullmatch(word) or (largest == math.inf and _ENDLESS.fullmatch(word))):
        return f"{'must be finite' if _NOT_FINITE.fullmatch(word) else 'expected a number'}, got {literal(word)}"
    value = float(word)
    if value <= above > -math.inf:
        return f"must be above {above:g}, got {word}"
    if value < low:
        return f"must be at least {low:g}, got {word}"
    if value > high:
        return f"must be at most {high:g}, got {word}"
    return f"must lie between -{largest:g} and {largest:g}, got {word}" if abs(value) > largest else ""


_Side = Literal["boat", "object", "world"]
_SIDES = get_args(_Side)


class Entry(NamedTuple):
    """Fate of an element or attribute."""

    fate: Literal["read", "lost", "harmless"]
    words: str
    """Its name here, or the reason why it is lost."""
    usual: str | None = None
    """Value of which nothing is lost; None: something is of every value."""


@cache
def sections() -> Mapping[str, Mapping[str, Mapping[str, Any]]]:
    """Entries of the table by section, path and side."""
    return {
        name: {
            path: {
                side: Entry(*(row[side] if isinstance(row, dict) else row))
                for side in (row if isinstance(row, dict) else _SIDES)
            }
            for path, row in rows.items()
        }
        for name, rows in json.loads(_TEXT).items()
    }


def section_below(section: str, path: str) -> tuple[str, str]:
    """The section in which children of an element are, and what their paths begin with."""
    nested = path in _holders(section)
    tag = path.rpartition("/")[2]
    return (tag, "") if tag in sections() and not nested else (section, f"{path}/")


@cache
def _holders(section: str) -> frozenset[str]:
    return frozenset(path.rpartition("/")[0] for path in sections()[section])


def losses(root: Markup, section: str, side: _Side) -> list[Loss]:
    """Losses of an element and of all in it, each kind once."""
    found: dict[tuple[str, str], list[Loss]] = {}
    for key, loss in _losses_in(root, section, "", side):
        found.setdefault(key, []).append(loss)
    return [
        one._replace(what=f"{one.what} and {len(more)} more") if more else one for one, *more in found.values()
    ]  # fmt: skip


def _losses_in(element: Any, section: str, base: str, side: _Side) -> Iterator[tuple[tuple[str, str], Loss]]:
    """The losses of an element whose attributes and children are in a section, by their kind."""
    rows = sections()[section]
    for name, value in element.attrib.items():
        if name.partition(":")[0] == "xmlns":  # xacro of ROS Melodic leaves these where they were
            continue
        why = _why(rows, f"{base}@{name}", value, side)
        if why:
            yield (section, f"{base}@{name}"), Loss(element.place, f"{name} of <{element.tag}>", why)
    for child in element if section != "plugin" else ():
        path = f"{base}{child.tag}"
        if section == "include" and child.tag == "model":  # put there by who included it
            yield from _losses_in(child, "model", "", side)
            continue
        why = _why(rows, path, child.text or "", side)
        if why:
            name = child.get("name")
            yield (section, path), Loss(child.place, f"<{child.tag}>{f' {quote(name)}' if name else ''}", why)
        elif not (side == "world" and child.tag == "model"):
            yield from _losses_in(child, *section_below(section, path), side)


def _why(rows: Mapping[str, Mapping[str, Entry]], path: str, value: str, side: _Side) -> str:
    """Reason why something is lost; empty if nothing is."""
    row = rows.get(path)
    if row is None:
        base, _, name = path.rpartition("/")
        known = (one.rpartition("/")[2] for one in rows if one.rpartition("/")[0] == base)
        close = nearest(name, [one for one in known if one.startswith("@") == name.startswith("@")])
        return "not recognized" + (f"; did you mean '{close.removeprefix('@')}'?" if close else "")
    tag = row[side]
    return "" if tag.fate != "lost" or (tag.usual is not None and _equal(value, tag.usual)) else tag.words


def _equal(value: str, usual: str) -> bool:
    """Whether a value says what the usual one does; an empty one always does."""
    words = value.split()
    if not words or words == usual.split() or truth(value) == truth(usual) is not None:
        return True
    try:
        return [float(word) for word in words] == [float(word) for word in usual.split()]
    except ValueError:
        return False
