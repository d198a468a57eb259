"""The numbers of a compiled world by name: the path of a field, as `wamv.hull.drag_linear.surge`."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cache
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import TypeAdapter, ValidationError

from vrx_mj.arguments import as_number, check_name
from vrx_mj.config.base import own_docstrings
from vrx_mj.config.loading import fault_text
from vrx_mj.errors import CommandError, quote
from vrx_mj.model.boats import MJCF_FIELDS
from vrx_mj.model.kinds import HEADING, STRICT, TIED, Angle, Parts, Unless
from vrx_mj.model.water import Sea
from vrx_mj.model.world import Parameters

_UNIT = re.compile(r" \[([^]]+)\]")
_TURNS = ("roll", "pitch", "yaw")
_ROOTS = ("sea", "current", "wind", "air", "moorings", "ropes")
"""Fields of a world whose names numbers begin with; those of boats begin with the boat's."""
_Path = tuple[str | int, ...]


@dataclass(frozen=True)
class Number:
    """A number of a compiled world, which `compile_world(..., parameters={name: value})` sets."""

    name: str
    """Path of its field: `wamv.hull.drag_linear.surge`."""
    value: float
    """Value in this world."""
    unit: str
    """Unit, SI; `1` for a number without one."""
    meaning: str
    """Description, one sentence."""
    path: _Path = field(repr=False, compare=False)
    """Fields and rows that lead to it in `World.parameters`."""
    kind: Any = field(repr=False, compare=False)
    """Type with its range."""

    @property
    def in_mjcf(self) -> bool:
        """Whether the MJCF has it too, so that no run can have another value."""
        return self.path[0] == "hulls" and self.path[2] in MJCF_FIELDS

    def field_value(self, given: object) -> float | tuple[float, float]:
        """Value of its field for a `given` number: the number, or the unit vector of a direction.

        Raises:
            CommandError: the value is not a number, or outside the range.
        """
        value = as_number(given)
        if not math.isfinite(value) or isinstance(given, bool):
            raise CommandError(f"invalid {self.name} {quote(given)}: a finite number [{self.unit}] is needed")
        heading = self.kind is HEADING
        try:
            _adapter(Angle if heading else self.kind).validate_python(value)
        except ValidationError as error:
            raise CommandError(f"invalid {self.name} [{self.unit}]: {fault_text(error)}") from None
        return (math.cos(value), math.sin(value)) if heading else value


def numbers_of(world: Parameters) -> dict[str, Number]:
    """Numbers of sea, current, wind, moorings and boats, by name."""
    found = [number for name in _ROOTS for number in _field(world, name, (), name)]
    for index, (boat, hull) in enumerate(zip(world.boats, world.hulls, strict=True)):
        found += _rows(hull, ("hulls", index), f"{boat.name}.hull")
        for row in range(0 if hull.vessel else hull.station_count):  # they do not carry a vessel
            own = hull.station_start + row
            found += _rows(world.stations[own], ("stations", own), f"{boat.name}.stations.{row}")
        for own in range(hull.thruster_start, hull.thruster_start + hull.thruster_count):
            thruster = world.thrusters[own]
            found += _rows(thruster, ("thrusters", own), f"{boat.name}.thrusters.{thruster.name}")
        if boat.battery:
            found += _rows(boat.battery, ("boats", index, "battery"), f"{boat.name}.battery")
    return {number.name: number for number in found}


def run_numbers(known: Mapping[str, Number]) -> dict[str, Number]:
    """Numbers that runs of one compiled world may have of their own, by name: those in no MJCF, and not a battery's."""
    return {name: number for name, number in known.items() if number.path[0] != "boats" and not number.in_mjcf}


def with_numbers(
    world: Parameters, values: Mapping[str, object], known: Mapping[str, Number] | None = None
) -> Parameters:
    """A world with other values of its numbers, `known` if they were listed before.

    Raises:
        UnknownNameError: no number of the world has a name.
        CommandError: a value is not a number, or outside its range, or a number of the world is not `known`.
    """
    known = (known or numbers_of(world)) if values else {}
    for name, value in values.items():
        if name not in known and name in numbers_of(world):
            raise CommandError(f"{name} cannot differ between runs of a world: compile a world with it")
        check_name("parameter", name, known)
        world = _with_value(world, known[name].path, known[name].field_value(value))
    return world


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind, config=STRICT)


def _with_value(whole: Any, path: _Path, value: Any) -> Any:
    if not path:
        return value
    step, *rest = path
    if isinstance(whole, Sea) and step == "significant_height":
        return whole.with_height(value)
    if isinstance(whole, Sea) and step == "waves" and rest[-1] == "amplitude":
        return whole.with_amplitude(int(rest[0]), value)
    if isinstance(step, int):
        return (*whole[:step], _with_value(whole[step], tuple(rest), value), *whole[step + 1 :])
    return replace(whole, **{step: _with_value(getattr(whole, step), tuple(rest), value)})


@cache
def _declarations(kind: Any) -> dict[str, tuple[Any, str]]:
    """Types and docstrings of the fields of a dataclass."""
    texts = own_docstrings(kind)
    return {own.name: (own.type, texts[own.name]) for own in fields(kind)}


def _rows(row: Any, path: _Path, name: str) -> Iterator[Number]:
    for own, (kind, _) in _declarations(row.__class__).items():
        marks = [mark for mark in getattr(kind, "__metadata__", ()) if isinstance(mark, Unless)]
        if not any(getattr(row, other) for mark in marks for other in mark.names):
            yield from _field(row, own, path, f"{name}.{own}")


def _field(row: Any, own: str, path: _Path, name: str) -> Iterator[Number]:
    kind, text = _declarations(row.__class__)[own]
    unit = _UNIT.search(text)
    meaning = " ".join(_UNIT.sub("", text, count=1).partition("\n\n")[0].split())
    yield from _numbers(getattr(row, own), kind, (*path, own), name, unit[1].split(", ") if unit else [], meaning)


def _numbers(value: Any, kind: object, path: _Path, name: str, units: Sequence[str], meaning: str) -> Iterator[Number]:
    """The numbers of a value; `units` are those of its parts, or of motions along and about axes."""
    if get_origin(kind) in {Union, UnionType}:
        kind = get_args(kind)[0]
    marks = getattr(kind, "__metadata__", ())
    inner = get_args(kind)[0] if marks else kind
    if value is None or TIED in marks:
        return
    if HEADING in marks:
        yield Number(name, math.atan2(value[1], value[0]), units[0] if units else "", meaning, path, HEADING)
    elif is_dataclass(value):
        yield from _rows(value, path, name)
    elif isinstance(value, tuple):
        parts = next((mark.names for mark in marks if isinstance(mark, Parts)), tuple(map(str, range(len(value)))))
        kinds = get_args(inner)
        for index, (part, own) in enumerate(zip(parts, value, strict=True)):
            each = units
            if len(units) > 1 and len(parts) == len(units):
                each = units[index : index + 1]
            elif len(units) > 1 and part in _TURNS:
                each = units[1:]
            yield from _numbers(
                own, kinds[0 if kinds[-1] is ... else index], (*path, index), f"{name}.{part}", each, meaning
            )
    elif inner is float:
        yield Number(name, value, units[0] if units else "", meaning, path, kind)
