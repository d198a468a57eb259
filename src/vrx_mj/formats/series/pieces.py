"""The pieces of a world that macros and plugins make, put together to one world."""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from vrx_mj.config.loading import read_source
from vrx_mj.config.tree import Entry, Items, Place, Section, key_path, merged
from vrx_mj.errors import ConfigError, Problem, VrxWarning
from vrx_mj.formats.series.calls import located, named_as

SINGLE = ("base", "task")
"""Parts that a world has once; of others, such as the sea, the later one counts."""


ORDER = ("extends", "description", "georeference", "terrain", "physics", "scene", "sea", "wind", "spawn", "camera",
         "markers", "objects", "task")  # fmt: skip
"""Keys of a world's file as our own have them."""


@dataclass(frozen=True)
class Piece:
    """What one call of a macro, or one plugin, makes of a world."""

    part: str
    """Of a world, of which there is one; objects: of which there may be any number."""
    name: str
    """What makes it, for messages."""
    place: Place
    loc: tuple[str | int, ...]
    """Its path in the file."""
    content: dict[str, Any]
    stale: bool = False
    """Whether it names a link for the wind that boats have no more."""

    def fault(self, message: str) -> ConfigError:
        """An error about it."""
        return ConfigError(
            [Problem(self.place.file.name, self.place.line, self.place.column, key_path(self.loc), message)]
        )


def assembled(head: dict[str, Any], place: Place, pieces: Sequence[Piece]) -> Section:
    """A world of pieces on top of what is in `head`; without a sea among them the water is flat.

    Raises:
        ConfigError: there are two bases or two tasks.
    """
    section: Section = located(head, place)
    counted = _counted(pieces)
    for piece in counted:
        section = merged(section, located(piece.content, piece.place))
    if not any(piece.part == "sea" for piece in counted):
        section = merged(section, located({"sea": {"model": "none"}}, place))
    return _ordered(_all_named(section))


def _counted(pieces: Sequence[Piece]) -> list[Piece]:
    """The pieces that count: a second base or task is an error, a second sea, wind or scene replaces the first."""
    kept: list[Piece] = []
    for piece in pieces:
        first = next((other for other in kept if other.part == piece.part), None)
        if first is None or piece.part == "objects":
            kept.append(piece)
            continue
        line = first.place.line
        if piece.part in SINGLE:
            raise piece.fault(f"a world has one {piece.part}, which '{first.name}' on line {line} already gives")
        text = f"{piece.place.file.name}: {piece.name} is called on lines {line} and {piece.place.line}"
        warnings.warn(f"{text}; the later one counts", VrxWarning, stacklevel=2)
        kept[kept.index(first)] = piece
    return kept


def _all_named(section: Section) -> Section:
    """The world with a name for every object: its model's own, numbered where something else has it already."""
    objects = section.get("objects")
    if not isinstance(objects, Items):
        return section
    taken = {thing["name"] for thing in (*objects, *base_objects(section)) if "name" in thing}
    things = []
    for thing in objects:
        own = thing.get("name") or named_as(str(thing["model"]))
        name = own if "name" in thing else next(name for name in _numbered_names(own) if name not in taken)
        taken.add(name)
        entry = Entry(thing.place, thing.place)
        things.append(Section({"name": name, **thing}, thing.place, {"name": entry, **thing.entries}))
    return Section({**section, "objects": Items.of(things, objects.places)}, section.place, section.entries)


def base_objects(section: Section) -> Sequence[Section]:
    """The objects of the world that a section extends."""
    if "extends" not in section:
        return ()
    base = read_source("worlds", Section({"extends": section["extends"]}, section.place, section.entries))
    return [thing for thing in base.get("objects") or () if isinstance(thing, Section)]


def _numbered_names(name: str) -> Iterator[str]:
    yield name
    yield from (f"{name}_{number}" for number in range(1, 100_000))


def _ordered(section: Section) -> Section:
    """The keys in the order in which our own files have them."""
    return Section({key: section[key] for key in ORDER if key in section}, section.place, section.entries)
