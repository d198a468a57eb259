"""What a file says, with where it says it: sections and lists whose entries know their line and column."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

__all__ = ["Entry", "File", "Items", "Place", "Section", "key_path", "locate", "merged", "of_python"]

Loc = tuple[str | int, ...]

APPENDED = ("objects", "docks")
"""Lists that a world adds to those of its base; any other list replaces the base's."""
DEEPEST = 40
"""Levels of nesting that a file or a dict may have."""


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


class Entry(NamedTuple):
    """Where a key and its value stand."""

    key: Place
    value: Place


class Section(dict[str, Any]):
    """A mapping that knows its place, the places of its entries, and its file's folder."""

    def __init__(self, values: Mapping[str, Any], place: Place, entries: Mapping[str, Entry]) -> None:
        super().__init__(values)
        self.place = place
        self.entries = entries

    @property
    def folder(self) -> Path | None:
        """The folder in which relative paths of this section start."""
        return self.place.file.folder


class Items(tuple[Any, ...]):
    """A list that knows the places of its entries."""

    places: tuple[Place, ...]

    @classmethod
    def of(cls, values: Iterable[Any], places: Iterable[Place]) -> "Items":
        """A list of `values`, each at its place."""
        items = cls(values)
        items.places = tuple(places)
        return items


def of_python(value: Any, file: File, depth: int = 0) -> Any:
    """A plain value (dicts, lists, NumPy scalars and arrays among them) as sections and items."""
    place = Place(file)
    if depth > DEEPEST:
        raise RecursionError
    if isinstance(value, Mapping):
        content = {str(key): of_python(item, file, depth + 1) for key, item in value.items()}
        return Section(content, place, {key: Entry(place, place) for key in content})
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return Items.of((of_python(item, file, depth + 1) for item in value), [place] * len(value))
    return str(value) if isinstance(value, Path) else value


def merged(base: Section, over: Section) -> Section:
    """`over` on top of `base`: mappings key by key, objects and docks appended, anything else replaced."""
    values, entries = dict(base), dict(base.entries)
    for key, value in over.items():
        old = values.get(key)
        if isinstance(old, Section) and isinstance(value, Section):
            value = merged(old, value)
        elif key in APPENDED and isinstance(old, Items) and isinstance(value, Items):
            value = Items.of((*old, *value), (*old.places, *value.places))
        elif key in APPENDED and value is None:
            value = old
        values[key], entries[key] = value, over.entries[key]
    return Section(values, over.place, entries)


def locate(root: Section, loc: Loc) -> tuple[Place, Loc]:
    """Where the thing at `loc` stands and the part of `loc` that leads there.

    A step that the file does not have is skipped unless it is the last: then it is a missing key of the place.
    """
    node: Any = root
    place, path = root.place, []
    for index, step in enumerate(loc):
        if isinstance(node, Section) and step in node:
            place, node = node.entries[str(step)].value, node[str(step)]
        elif isinstance(node, Items) and isinstance(step, int) and step < len(node):
            place, node = node.places[step], node[step]
        elif index < len(loc) - 1:
            continue
        path.append(step)
    return place, tuple(path)


def key_path(loc: Loc) -> str:
    """`("objects", 0, "pose")` as `objects[0].pose`."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in loc)
    return text.removeprefix(".")
