"""The content of a file as sections and lists whose entries know their line and column, and values in messages."""

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic_core import PydanticCustomError

from vrx_mj.errors import LONGEST_VALUE, ConfigError, Problem, first_names, nearest, shorten
from vrx_mj.errors import quote as in_python

_TABLES = json.loads((Path(__file__).parent / "wording.json").read_bytes())
PYDANTIC: Mapping[str, str] = _TABLES["pydantic"]
"""Messages of pydantic's errors by type; `got` is the value, other names in braces are of the error's context."""
PYYAML: Mapping[str, str] = _TABLES["pyyaml"]
"""Messages of PyYAML's errors, by how they begin in its words."""
ALLOWED = "a letter, then letters, digits and '_'"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_SHOWN = 8
"""Number of keys that a message names."""
_APPENDED = ("objects", "docks")
"""Lists that a world adds to those of its base; any other list replaces the base's."""
_REPLACED = ("task",)
"""Mappings that take the place of the base's where they are of another type."""
_OF_ROBOT = ("arguments", "thrusters", "components", "sensors")
"""Keys that depend on `robot`: a file with another one takes none of them from its base."""
_USUAL_ROBOT = "wamv"
"""Robot of a file that names none."""
MAX_DEPTH = 40
"""Largest depth of nesting in a file or a dict."""


def fault(message: str, **where: object) -> PydanticCustomError:
    """An error about the value at hand; `where` is what the loader makes its place of."""
    return PydanticCustomError("vrx", "{message}", {"message": message, **where})


def literal(value: object) -> str:
    """A value as its file would write it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "keys and values" if value else "no keys"
    if isinstance(value, str):
        return f"'{_short(value)}'"
    if isinstance(value, list | tuple):
        return _short(f"[{', '.join(map(literal, value[:LONGEST_VALUE]))}]")
    huge = isinstance(value, int) and abs(value) >= 10**LONGEST_VALUE
    return f"a number of more than {LONGEST_VALUE} digits" if huge else in_python(value).removesuffix(".0")


def choice(value: object, allowed: Sequence[str]) -> str:
    """The message about a value that is not among the allowed ones."""
    close = nearest(value, allowed) if isinstance(value, str) else None
    hint = f"; did you mean '{close}'?" if close else ""
    return f"expected {one_of(allowed)}, got {literal(value)}{hint}"


def one_of(allowed: Sequence[str]) -> str:
    """The allowed values in words: "a, b or c"."""
    return " or ".join(filter(None, [", ".join(allowed[:-1]), allowed[-1]]))


def unknown_key(key: str, known: Iterable[str]) -> str:
    """The message about a key that the place does not have."""
    names = tuple(known)
    close = nearest(key, names)
    if ":" in key:
        return f"unknown key '{_short(key)}'; type a space after ':'"
    hint = f"did you mean '{close}'?" if close else f"allowed: {', '.join(names)}"
    return f"unknown key '{_short(key)}'; {hint}"


def _short(text: str) -> str:
    return shorten(text, LONGEST_VALUE)


def is_ros_name(name: str) -> bool:
    """Whether ROS allows a name in a topic: a letter, then letters, digits and underscores."""
    return _NAME.fullmatch(name) is not None


def ros_names_note(kind: str, names: Iterable[str]) -> list[str]:
    """A line about those of the names that ROS refuses; none if it allows all."""
    odd = [name for name in dict.fromkeys(names) if not is_ros_name(name)]
    if not odd:
        return []
    return [
        f"ROS refuses topics with the name of {kind} {first_names(map(literal, odd), _SHOWN)}: {ALLOWED} are allowed"
    ]


Loc = tuple[str | int, ...]


@dataclass(frozen=True)
class File:
    """A text that was read: how messages call it, its folder, and its lines."""

    name: str
    folder: Path | None
    lines: tuple[str, ...] = ()


class Place(NamedTuple):
    """A spot in a file. Line and column count from 1; None in a dict that came from Python."""

    file: File
    line: int | None = None
    column: int | None = None

    def problem(self, key: str, message: str) -> Problem:
        """Problem of a key at this place."""
        return Problem(self.file.name, self.line, self.column, key, message)


class Entry(NamedTuple):
    """Places of a key and of its value."""

    key: Place
    value: Place
    depth: int = 0
    """How far up the chain of `extends` it is, compared with others of its section."""


class Section(dict[str, Any]):
    """A mapping that knows its place, the places of its entries, and its file's folder."""

    model: Any = None
    """The model that it was validated as; None before that."""

    def __init__(self, values: Mapping[str, object], place: Place, entries: Mapping[str, Entry] | None = None) -> None:
        """`entries` are by default all at the place of the mapping."""
        super().__init__(values)
        self.place = place
        self.entries = dict.fromkeys(values, Entry(place, place)) if entries is None else entries

    def holding(self, values: Mapping[str, object]) -> "Section":
        """Section with other values at these places."""
        return Section(values, self.place, self.entries)

    @property
    def folder(self) -> Path | None:
        """The folder in which relative paths of this section start."""
        return self.place.file.folder

    def folder_of(self, key: str) -> Path | None:
        """The folder in which a relative path of a key starts: that of the file with the key, which may be the base."""
        return self.entries[key].value.file.folder if key in self.entries else self.folder

    def depth(self, key: str) -> float:
        """How far up the chain of `extends` a key is, compared with its neighbours; infinite if no file has it."""
        return self.entries[key].depth if key in self.entries else math.inf


class Items(tuple[Any, ...]):  # noqa: SLOT001 - a tuple of any length has no slots
    """A list that knows the places of its entries."""

    places: tuple[Place, ...]

    @classmethod
    def of(cls, values: Iterable[object], places: Iterable[Place]) -> "Items":
        """A list of `values`, each at its place."""
        items = cls(values)
        items.places = tuple(places)
        return items

    def number(self, index: int) -> int:
        """Number of an entry in its own file; with `extends` it differs from that in the list."""
        return sum(place.file == self.places[index].file for place in self.places[:index])


def of_python(value: object, file: File, levels: int = MAX_DEPTH) -> Any:
    """A plain value (dicts, lists, NumPy scalars and arrays among them) as sections and items.

    Raises:
        ConfigError: it has more levels of nesting.
    """
    if levels < 0:
        raise ConfigError.of(file.name, "nested too deeply, or inside itself")
    if isinstance(value, Mapping):
        return Section({str(key): of_python(item, file, levels - 1) for key, item in value.items()}, Place(file))
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return Items.of((of_python(item, file, levels - 1) for item in value), [Place(file)] * len(value))
    return str(value) if isinstance(value, Path) else value


def merge(base: Section, over: Section, appended: Sequence[str] = _APPENDED) -> Section:
    """`over` on top of `base`: mappings key by key, `appended` lists added, anything else replaced.

    A task of another type replaces that of the base; keys of a base about its robot do not hold for another one.
    """
    gone = _OF_ROBOT if "robot" in over and over["robot"] != base.get("robot", _USUAL_ROBOT) else ()
    base = base.holding({key: value for key, value in base.items() if key not in gone})
    inherited = {key: entry._replace(depth=entry.depth + 1) for key, entry in base.entries.items()}
    values: dict[str, Any] = {**base, **over}
    for key in base.keys() & over.keys():
        old, new = base[key], over[key]
        if isinstance(old, Section) and isinstance(new, Section):
            other = key in _REPLACED and new.get("type", old.get("type")) != old.get("type")
            values[key] = new if other else merge(old, new, ())
        elif key in appended and new is None:
            values[key] = old
        elif key in appended and isinstance(old, Items) and isinstance(new, Items):
            values[key] = Items.of((*old, *new), (*old.places, *new.places))
    return Section(values, over.place, {**inherited, **over.entries})


class Spot(NamedTuple):
    """Place of a value, its path in its own file, and, if that ends in a key, the section with this key."""

    place: Place
    path: Loc
    owner: Section | None


def locate(root: Section, loc: Loc, *, tagged: bool = False) -> Spot:
    """The place of the value at `loc`.

    A step that the file does not have is skipped, unless it is the last and a key: that is one missing there. With
    `tagged` so is, once in a section, the value of its `type`, by which pydantic says which member of a union it took.
    """
    node: Any = root
    chosen: Section | None = None
    owner, place, path = None, root.place, list[str | int]()
    for index, step in enumerate(loc):
        if tagged and isinstance(node, Section) and node is not chosen and step == node.get("type"):
            chosen = node
            continue
        last = index == len(loc) - 1
        owner = node if last and isinstance(node, Section) else None
        if isinstance(node, Section) and step in node:
            path.append(step)
            place, node = node.entries[str(step)].value, node[str(step)]
        elif isinstance(node, Items) and isinstance(step, int) and step < len(node):
            path.append(node.number(step))
            place, node = node.places[step], node[step]
        elif owner is not None:
            path.append(step)
    return Spot(place, tuple(path), owner)


def key_path(loc: Loc) -> str:
    """`("objects", 0, "pose")` as `objects[0].pose`."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in loc)
    return text.removeprefix(".")
