"""Values that keys of files may have: numbers within bounds, lists of them, colours, names and switches."""

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin

from annotated_types import GroupedMetadata, Gt
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field

from vrx_mj.config.tree import fault, literal
from vrx_mj.errors import UnknownNameError
from vrx_mj.model.kinds import Latitude, Longitude, Share

MAX_NUMBER = 1e9
"""Largest number that a file may give, in any unit: what is larger has no physics."""
MIN_POSITIVE = 1e-12
"""Smallest number that a file may give where one above 0 is needed."""
MAX_COORDINATE = 1e6
"""Farthest coordinate [m] that a file may give."""

COLORS: Mapping[str, tuple[float, float, float]] = {
    name: (red, green, blue)
    for name, (red, green, blue) in json.loads((Path(__file__).parent / "colors.json").read_bytes()).items()
}
"""Colours by name, each [r, g, b] in 0..1. The pure ones are those of Gazebo's stock materials."""

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}", re.ASCII)
_SWITCHES = {"yes": True, "on": True, "no": False, "off": False}


def numbers(labels: str, more: str = "") -> BeforeValidator:
    """Demands one number for each of the space-separated `labels`; those of `more` may be left out, and are 0."""
    few = labels.split()
    names = few + more.split()
    form = " or ".join(f"{len(some)} numbers [{', '.join(some)}]" for some in (few, names)[: 1 + bool(more)])
    return several(form, len(few), len(names))


def several(form: str, *counts: int, rest: float = 0.0) -> BeforeValidator:
    """Demands a list of one of these counts of values, which `form` describes; what a short one lacks is `rest`."""

    def check(value: object) -> object:
        if isinstance(value, str) or not isinstance(value, Sequence) or len(value) not in counts:
            raise fault(f"expected {form}, got {literal(value)}{_in_brackets(value, *counts)}")
        return (*value, *[rest] * (counts[-1] - len(value)))

    return BeforeValidator(check)


def _in_brackets(value: object, *counts: int) -> str:
    """Advice for so many numbers side by side without brackets, as in Gazebo's files; empty for anything else."""
    parts = re.split(r"[\s,]+", value.strip()) if isinstance(value, str) else []
    if len(parts) not in counts or not all(
        re.fullmatch(r"[-+]?\d*\.?\d+(e[-+]?\d+)?", part, re.ASCII) for part in parts
    ):
        return ""
    return f"; write [{', '.join(f'{float(part):g}' for part in parts)}]"


def by_type(expected: str, words: Sequence[str] = (), **members: type | tuple[type, ...]) -> Discriminator:
    """Chooses the member of a union: `word` for one of the words, others by type; `expected` names them all."""

    def tag(value: object) -> str | None:
        if isinstance(value, str):
            return "word" if value in words else None
        return next((tag for tag, types in members.items() if isinstance(value, types)), None)

    return Discriminator(tag, "union_of_types", f"expected {expected}")


def rising(low: str, high: str) -> AfterValidator:
    """Demands that the first of two values is below the second, which these names call."""
    return demand(lambda ends: ends[0] < ends[1], f"{low} must be below {high}, got {{}}")


def demand(holds: Callable[[Any], object], message: str) -> AfterValidator:
    """Demands that a value passes a test; `{}` in the message is the value as its file would write it."""

    def check(value: object) -> object:
        if not holds(value):
            raise fault(message.format(literal(value)))
        return value

    return AfterValidator(check)


_Six = tuple[float, float, float, float, float, float]


def _possible(value: _Six) -> _Six:
    """No principal moment is negative, and none exceeds the sum of the others, in any body that exists."""
    xx, yy, zz, xy, xz, yz = value
    low, middle, high = sorted(value[:3])
    if xy or xz or yz:
        import numpy as np

        low, middle, high = map(float, np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if low <= 0.0:
        raise fault(f"impossible moments of inertia: about a principal axis it is {low:g}")
    if high > (low + middle) * (1 + 1e-9):
        raise fault(f"impossible moments of inertia: {high:g} is more than the sum of the other two")
    return value


def _of_name(value: object) -> object:
    """The colour of a name; anything else as it is."""
    if not isinstance(value, str) or _in_brackets(value, 3, 4):
        return value
    if value not in COLORS:
        raise fault(str(UnknownNameError("colour", value, COLORS)))
    return COLORS[value]


def as_switch(value: object) -> object:
    """Yes, no, on and off as true and false; anything else as it is."""
    return _SWITCHES.get(value.lower(), value) if isinstance(value, str) else value


NotEmpty = demand(bool, "must not be empty")
"""Demands at least one entry in a list."""

_NOT_TINY = demand(lambda value: value is None or value >= MIN_POSITIVE, f"must be at least {MIN_POSITIVE:g}, got {{}}")
Number = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER)]
Positive = Annotated[float, Field(gt=0, le=MAX_NUMBER), _NOT_TINY]
NonNegative = Annotated[float, Field(ge=0, le=MAX_NUMBER)]
Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE, le=MAX_COORDINATE)]

Vec3 = Annotated[tuple[Coordinate, Coordinate, Coordinate], numbers("x y z")]
Inertia = Annotated[
    tuple[Positive, Positive, Positive, Number, Number, Number],
    numbers("ixx iyy izz", "ixy ixz iyz"),
    AfterValidator(_possible),
]
"""Moments of inertia of a body about its centre of mass [kg m2]."""

Point = Annotated[tuple[Coordinate, Coordinate], numbers("x y")]
"""x, y [m]."""

Geodetic = Annotated[tuple[Latitude, Longitude, Number], numbers("latitude longitude yaw")]
"""Latitude, longitude [degrees, WGS84] and yaw [rad, from east]."""

Cartesian = Annotated[tuple[Coordinate, Coordinate, Number], numbers("x y yaw")]
"""x, y [m] and yaw [rad, from x]."""

Pose = Annotated[tuple[Coordinate, Coordinate, Coordinate, Number, Number, Number], numbers("x y z roll pitch yaw")]
"""x, y, z [m], roll, pitch, yaw [rad]; R = Rz(yaw) Ry(pitch) Rx(roll), body to world."""

_RGBA = several("a colour's name, [r, g, b] or [r, g, b, a]", 3, 4, rest=1.0)
Color = Annotated[tuple[Share, Share, Share, Share], _RGBA, BeforeValidator(_of_name)]
"""Red, green, blue, alpha in 0..1. A file gives a name, [r, g, b] or [r, g, b, a]."""

Name = Annotated[
    str, demand(_NAME.fullmatch, "expected a name of up to 64 letters A-Z, digits, '_', '-' or '.', got {}")
]
"""A name that MJCF, recordings and files can all carry."""

Switch = Annotated[bool, BeforeValidator(as_switch)]
"""True or false; a file may also say yes, no, on or off."""


@dataclass(frozen=True)
class NumberOf(GroupedMetadata):
    """Mark of a number whose range, unit and meaning a dataclass of `model` declares.

    A narrower range that the key has after the mark goes before, and so does a docstring of its own, with other words
    or for a file's degrees.
    """

    record: Any
    """The dataclass."""
    name: str
    """Its field."""

    def __iter__(self) -> Iterator[Any]:
        """Limits of the field, of sizes that files may give."""
        kind = next(field.type for field in fields(self.record) if field.name == self.name)
        kind = get_args(kind)[0] if get_origin(kind) is Union else kind
        limits = [limit for mark in getattr(kind, "__metadata__", ()) for limit in getattr(mark, "metadata", ())]
        for limit in limits:
            for size in (getattr(limit, name) for name in ("ge", "gt", "le", "lt") if hasattr(limit, name)):
                yield type(limit)(min(max(size, -MAX_NUMBER), MAX_NUMBER))
        if Gt(0.0) in limits:
            yield _NOT_TINY
