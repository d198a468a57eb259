"""The pieces of a world that macros and plugins make, put together to one world."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from vrx_mj.config.loading import read_source
from vrx_mj.config.search import SCHEME
from vrx_mj.config.tree import Entry, Items, Place, Section, key_path, merge
from vrx_mj.errors import ConfigError, warn
from vrx_mj.formats.urdf.elements import unused_name

_SINGLE = ("base", "task")
"""Parts that a world has once; of others, such as the sea, the last one is used."""
_ORDER = ("extends", "description", "georeference", "terrain", "physics", "scene", "sea", "wind", "spawn", "camera",
         "markers", "objects", "task")  # fmt: skip
"""Keys of a world's file as our own have them."""
SYMBOLS = re.compile(r"vrx_dock_([a-z]+_[a-z]+)__([a-z]+_[a-z]+)")
"""The floating docks of 2018 with fixed symbols, one folder for each pair."""
TABLE: Mapping[str, Mapping[str, Any]] = json.loads(Path(__file__).with_name("names.json").read_bytes())
"""Blocks of the macros of VRX's worlds, and folders whose models go by another name."""


@dataclass(frozen=True)
class Piece:
    """Part of a world that one call of a macro, or one plugin, makes."""

    part: str
    """Part of a world: there is one of each, but any number of objects."""
    name: str
    """Name of what makes it, for messages."""
    place: Place
    loc: tuple[str | int, ...]
    """Path of what makes it in the file."""
    content: "Content"


Content = dict[str, Any]
"""Keys and values of a file of ours, before they have places."""


class At(NamedTuple):
    """A value and where it is said."""

    value: Any
    place: Place


def with_places(value: object, place: Place) -> Any:
    """Dicts and lists as sections and items at `place`, but for what an `At` puts elsewhere."""
    if isinstance(value, At):
        return with_places(value.value, value.place)
    if isinstance(value, dict):
        entries = {key: Entry(_place(item, place), _place(item, place)) for key, item in value.items()}
        return Section({key: with_places(item, place) for key, item in value.items()}, place, entries)
    if isinstance(value, list):
        return Items.of((with_places(item, place) for item in value), (_place(item, place) for item in value))
    return value


def _place(value: object, place: Place) -> Place:
    return value.place if isinstance(value, At) else place


def thing(uri: At, pose: object, name: At | None = None) -> Content:
    """An object of a world; without a name until the world has all of them."""
    folder = str(uri.value).removeprefix(SCHEME).strip("/")
    symbols = SYMBOLS.fullmatch(folder)
    known: Content = {"model": At("dock_2018_dynamic" if symbols else folder, uri.place), "pose": pose}
    if symbols:
        known["symbols"] = At([symbols[1], symbols[2]], uri.place)
    return known if name is None else {"name": name, **known}


def named_as(model: str) -> str:
    """The name that a model has by itself."""
    for pattern, name in TABLE["names"].items():
        found = re.fullmatch(pattern, model)
        if found:
            return found.expand(name)
    return model


def assemble(head: Content, place: Place, pieces: Sequence[Piece]) -> Section:
    """A world of pieces on top of what is in `head`; without a sea among them the water is flat.

    Raises:
        ConfigError: there are two bases or two tasks.
    """
    section: Section = with_places(head, place)
    kept = pieces_in_force(pieces)
    for piece in kept:
        section = merge(section, with_places(piece.content, piece.place))
    if not any(piece.part == "sea" for piece in kept):
        section = merge(section, with_places({"sea": {"model": "none"}}, place))
    named = _all_named(section)
    return named.holding({key: named[key] for key in _ORDER if key in named})


def pieces_in_force(pieces: Sequence[Piece]) -> list[Piece]:
    """The pieces that count: a second base or task is an error, a second sea, wind or scene replaces the first.

    Raises:
        ConfigError: there are two bases or two tasks.
    """
    kept: list[Piece] = []
    for piece in pieces:
        first = next((other for other in kept if other.part == piece.part), None)
        if first is None or piece.part == "objects":
            kept.append(piece)
            continue
        line = first.place.line
        if piece.part in _SINGLE:
            message = f"a world has one {piece.part}, which '{first.name}' on line {line} already gives"
            raise ConfigError([piece.place.problem(key_path(piece.loc), message)])
        text = f"{piece.place.file.name}: {piece.name} is called on lines {line} and {piece.place.line}"
        warn(f"{text}; the last one is used", 2)
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
        own = thing.get("name") or named_as(str(thing["model"]).removeprefix(SCHEME))
        name = own if "name" in thing else unused_name(own, taken, first=1)
        taken.add(name)
        entry = Entry(thing.place, thing.place)
        things.append(Section({"name": name, **thing}, thing.place, {"name": entry, **thing.entries}))
    return section.holding({**section, "objects": Items.of(things, objects.places)})


def base_objects(section: Section) -> Sequence[Section]:
    """The objects of the world that a section extends."""
    if "extends" not in section:
        return ()
    base = read_source("worlds", section.holding({"extends": section["extends"]}))
    return [thing for thing in base.get("objects") or () if isinstance(thing, Section)]
