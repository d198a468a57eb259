"""VRX's thruster and component files, read: every problem with its place, every oddity with a warning.

Read here although VRX's own generator stops at it: a type without instances, a type repeated as `wamv_camera*`,
one instance instead of a list of one, lists of numbers for texts of numbers, expressions for coordinates.
"""

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from vrx_mj.config.parts.catalogue import (
    ELSEWHERE,
    FIXED,
    HULL_LINKS,
    JAZZY_NAMES,
    MISNAMED,
    TYPES,
    Parameter,
    PartType,
)
from vrx_mj.config.parts.files import Instance, Kind, PartsFile
from vrx_mj.config.parts.mounts import name_key, name_of
from vrx_mj.config.parts.oddities import oddities
from vrx_mj.config.parts.values import has_expression, meant
from vrx_mj.config.search import display
from vrx_mj.config.tree import File, Items, Loc, Place, Section, key_path
from vrx_mj.config.wording import shown, unknown_key
from vrx_mj.config.yaml_text import parse, read_lines
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxWarning

__all__ = ["load_parts"]

FILES = {"components": "component file", "thrusters": "thruster file"}

_NOTHING = re.compile(r"\s*(---|\.\.\.)?\s*(#.*)?")


def load_parts(path: Path | str, kind: Kind) -> PartsFile:
    """Read a component or a thruster file.

    Expressions are worked out, and numbers in quotes are numbers. An empty file has no parts. A lidar of
    unknown type stays in the list, with a warning: it makes no lidar.

    Raises:
        ConfigError: the file cannot be read or is wrong; every problem with its line, column and key.
    """
    file, reading = Path(path), _Reading(kind)
    section = _content(file)
    if section is not None:
        for key in section:
            _read_type(reading, section, key)
    _check_names(reading)
    if reading.problems:
        raise ConfigError(sorted(reading.problems, key=lambda each: (each.line or 0, each.column or 0)))
    for loc, instance in reading.parts:
        for key, message in oddities(instance):
            place = reading.places.get((*loc, key), instance.place)
            warnings.warn(str(_problem(place, (*loc, key), message)), VrxWarning, stacklevel=2)
    return PartsFile(file, kind, tuple(part for _, part in reading.parts), tuple(map(str, reading.stops)))


@dataclass
class _Reading:
    """A file while it is read: its parts so far, what is wrong, and what VRX's generator would stop at."""

    kind: Kind
    parts: list[tuple[Loc, Instance]] = field(default_factory=list)
    places: dict[Loc, Place] = field(default_factory=dict)
    """Where values of parameters stand."""
    problems: list[Problem] = field(default_factory=list)
    stops: list[Problem] = field(default_factory=list)

    def wrong(self, place: Place, loc: Loc, message: str) -> None:
        self.problems.append(_problem(place, loc, message))

    def stop(self, place: Place, loc: Loc, message: str) -> None:
        self.stops.append(_problem(place, loc, message))


def _problem(place: Place, loc: Loc, message: str) -> Problem:
    return Problem(place.file.name, place.line, place.column, key_path(loc), message)


def _content(path: Path) -> Section | None:
    """What a file holds; None where it is empty."""
    lines = read_lines(path)
    return None if all(map(_NOTHING.fullmatch, lines)) else parse(File(display(path), path.parent, lines))


def _read_type(reading: _Reading, section: Section, key: str) -> None:
    """The instances of one key, whose stars at either end only tell it from others of the same type."""
    name, place = key.strip("*"), section.entries[key].key
    meaning = MISNAMED.get(name, name)
    if name not in TYPES or TYPES[name].kind != reading.kind:
        reading.wrong(place, (key,), _unknown_type(name, reading.kind))
    if meaning not in TYPES or TYPES[meaning].kind != reading.kind:
        return
    if name != key:
        reading.stop(place, (key,), "a key with '*'")
    for loc, value, where in _instances(reading, section, key):
        if isinstance(value, Section):
            _read_instance(reading, TYPES[meaning], value, loc)
        else:
            message = f"expected parameters, got {shown(value)}"
            hint = "; {} takes every default" if value is None else ""
            reading.wrong(where, loc, message + hint)


def _instances(reading: _Reading, section: Section, key: str) -> Iterator[tuple[Loc, Any, Place]]:
    """Path, value and place of each entry of a type's list; a mapping stands for a list of one."""
    value, place = section[key], section.entries[key].value
    if isinstance(value, Items):
        yield from (((key, i), item, where) for i, (item, where) in enumerate(zip(value, value.places, strict=True)))
    elif isinstance(value, Section):
        reading.stop(place, (key,), "one instance that is not in a list")
        yield (key,), value, place
    elif value is None:
        reading.stop(section.entries[key].key, (key,), "a type without instances")
    else:
        reading.wrong(place, (key,), f"expected a list of instances, each with its parameters, got {shown(value)}")


def _unknown_type(name: str, kind: Kind) -> str:
    known = [each for each, part in TYPES.items() if part.kind == kind]
    found = MISNAMED.get(name, name)
    if name in ELSEWHERE:
        return ELSEWHERE[name]
    if found in TYPES and TYPES[found].kind != kind:
        return f"'{found}' belongs in the {FILES[TYPES[found].kind]}; this is the {FILES[kind]}"
    if found in known:
        return f"no type named '{name}'; did you mean '{found}'?"
    return str(UnknownNameError("type", name, known))


def _read_instance(reading: _Reading, part: PartType, section: Section, loc: Loc) -> None:
    parameters = {}
    for key, value in section.items():
        parameter = part.parameter(key)
        if parameter is None:
            reading.wrong(section.entries[key].key, (*loc, key), _unknown_parameter(part, key))
            continue
        place = reading.places[*loc, key] = section.entries[key].value
        try:
            parameters[key] = meant(parameter, value)
        except ValueError as error:
            reading.wrong(place, (*loc, key), str(error))
        _check_generator(reading, parameter, value, (*loc, key))
    for parameter in part.parameters:
        if parameter.default is None and parameter.name not in section:
            reading.wrong(section.place, (*loc, parameter.name), "required, but missing")
    if "name" in section and JAZZY_NAMES & section.keys():
        message = "give 'name' (VRX classic) or 'sensor_name' or 'pinger_name' (VRX jazzy), not both"
        reading.wrong(section.place, loc, message)
    index = sum(instance.type == part.name for _, instance in reading.parts)
    reading.parts.append((loc, Instance(part.name, index, parameters, section.place)))


def _unknown_parameter(part: PartType, key: str) -> str:
    if key in FIXED.get(part.name, ()):
        return f"no parameter '{key}'; VRX fixes it for every {part.name}"
    return unknown_key(key, [each.name for each in part.parameters])


def _check_generator(reading: _Reading, parameter: Parameter, value: Any, loc: Loc) -> None:
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
        name, key = name_of(instance), name_key(instance)
        place = reading.places.get((*loc, key), instance.place)
        if (*loc, key) in reading.places and key not in instance.parameters:
            continue  # a name that is no name was complained about
        if name in seen:
            default = "" if key in instance.parameters else ", as this one is by default"
            message = f"the part on line {seen[name].line} is named '{name}'{default}; each needs its own name"
            reading.wrong(place, (*loc, key), message)
        elif name in HULL_LINKS and reading.kind == "components":
            reading.wrong(place, (*loc, key), f"the hull already has a link '{name}_link'; choose another name")
        if name:
            seen.setdefault(name, place)
