"""Thruster and component files as read, and the parts that they may have, with their parameters."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

from vrx_mj.config.tree import Place
from vrx_mj.resources import root

Kind = Literal["components", "thrusters"]


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
