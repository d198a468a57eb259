"""Kinds of values that a compiled world is made of; what is outside them is damage."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Literal, TypeVar, cast, dataclass_transform

from pydantic import AfterValidator, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError

from vrx_mj.constants import LONGEST_STEP, SHORTEST_STEP
from vrx_mj.frames import Vector

_Class = TypeVar("_Class")

STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, revalidate_instances="always")
"""No value is turned into one of another kind, but for whole numbers into floats; no key is ignored."""
TIED = object()
"""Mark of what is no parameter by itself: other numbers of the world, or its MJCF, belong to it."""
HEADING = object()
"""Mark of a unit vector along x and y, whose parameter is its direction [rad], counter-clockwise from x."""
MAX_NUMBER = 1e12
"""Largest magnitude of a number [SI]: far beyond any boat, far from where sums overflow."""
_MOST_ROWS = 10_000_000
MAX_NAME = 500
"""Longest name [characters]."""
LONGEST_DESCRIPTION = 4_000_000
"""Most characters of a boat's URDF."""
_ROUNDING = 1e-6
"""How far the rows of a rotation may be from unit length and right angles."""


def left_out(**default: Any) -> Any:
    """Field of a record that JSON leaves out while it has its default."""
    return field(metadata={"left_out": True}, **default)


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(field, left_out))
def record(kind: type[_Class]) -> type[_Class]:
    """Make a class a frozen dataclass, given by names alone, whose values pydantic checks strictly."""
    kind.__pydantic_config__ = STRICT  # type: ignore[attr-defined]
    return dataclass(frozen=True, kw_only=True)(kind)


def record_from(kind: type[_Class], *sources: object, **own: Any) -> _Class:
    """Make a record whose fields that `own` lacks are those of the sources by name, of the first that has one."""
    names = {each.name for each in fields(cast(Any, kind))} - own.keys()
    found = {name: getattr(source, name) for source in reversed(sources) for name in names if hasattr(source, name)}
    return kind(**found, **own)


def late(rank: int) -> Mapping[str, int]:
    """Metadata of a field that JSON has after all those of a lower rank, which is 0 for most."""
    return {"rank": rank}


@dataclass(frozen=True)
class Parts:
    """Names of the numbers of a tuple, which are columns of its table and the ends of parameters' names."""

    names: tuple[str, ...]

    def __init__(self, *names: str) -> None:
        object.__setattr__(self, "names", names)


@dataclass(frozen=True)
class RowOf:
    """Mark of the number of a row in a table, that this row points at, or of the first row that is its own."""

    table: str
    owned: bool = False
    """Whether rows from that on are its own: as many as `..._count` says, or one."""


@dataclass(frozen=True)
class Unless:
    """Mark of a field that does nothing where one of these attributes of its row is true."""

    names: tuple[str, ...]

    def __init__(self, *names: str) -> None:
        object.__setattr__(self, "names", names)


def _rotation(rows: tuple[Vector, Vector, Vector]) -> tuple[Vector, Vector, Vector]:
    a, b, c = rows
    products = [_dot(a, a) - 1.0, _dot(b, b) - 1.0, _dot(c, c) - 1.0, _dot(a, b), _dot(b, c), _dot(c, a)]
    turned = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    if max(map(abs, products)) > _ROUNDING or _dot(turned, c) < 0.0:
        raise PydanticCustomError("rotation", "expected the rows of a rotation")
    return rows


def _dot(one: Vector, other: Vector) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


Real = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER)]
Positive = Annotated[float, Field(gt=0.0, le=MAX_NUMBER)]
NonNegative = Annotated[float, Field(ge=0.0, le=MAX_NUMBER)]
NonPositive = Annotated[float, Field(ge=-MAX_NUMBER, le=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Angle = Annotated[float, Field(ge=-1e6, le=1e6)]
Degrees = Angle
Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
Step = Annotated[float, Field(ge=SHORTEST_STEP, le=LONGEST_STEP)]
"""A physics step [s]."""
AtBaseLink = tuple[Literal["gps", "imu", "pinger"], ...]
"""Types of sensors that measure at the origin of `base_link`."""
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Coefficient = Angle
Vec2 = Annotated[tuple[Real, Real], Parts("x", "y")]
Vec3 = Annotated[tuple[Real, Real, Real], Parts("x", "y", "z")]
Heading = Annotated[tuple[Real, Real], HEADING]
UnitVector = Annotated[tuple[Real, Real, Real], TIED]
WindForce = Annotated[tuple[Real, Real, Real], Parts("x", "y", "yaw")]
MOTIONS = Parts("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Motions along and about the axes of a body, in the order of their numbers."""
Six = Annotated[tuple[Real, Real, Real, Real, Real, Real], MOTIONS]
SixBySix = Annotated[tuple[Six, Six, Six, Six, Six, Six], MOTIONS]
Matrix = Annotated[tuple[Vec3, Vec3, Vec3], AfterValidator(_rotation), TIED]
"""A rotation, row by row."""
Pose = tuple[Real, Real, Real, Angle, Angle, Angle]
"""x, y, z [m], roll, pitch, yaw [rad]."""
Count = Annotated[int, Field(ge=0, le=_MOST_ROWS)]
Row = Count
"""Number of a row in another table."""
Index = Annotated[int, Field(ge=-1, le=_MOST_ROWS)]
"""Number of a row in another table, or -1 for none."""
Flag = Annotated[int, Field(ge=0, le=1)]
ProfileCode = Annotated[int, Field(ge=0, le=2)]
"""`physics.tables.VRX`, `VRX3` or `MARINE`."""
Text = Annotated[str, StringConstraints(max_length=MAX_NAME)]
Description = Annotated[str, StringConstraints(max_length=LONGEST_DESCRIPTION)]
"""A URDF's text."""
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}$")]
"""Name of a boat: what ROS, recordings and file names can all carry."""
