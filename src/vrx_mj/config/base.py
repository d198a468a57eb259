"""What every model of a user's file is built on."""

import ast
import inspect
import itertools
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, Self, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from vrx_mj.config.tree import Entry, Section
from vrx_mj.config.wording import one_of, shown, unknown_key
from vrx_mj.errors import UnknownNameError

MAX_NUMBER = 1e9
"""Largest number that a file may give, in any unit: what is larger has no physics."""
MIN_POSITIVE = 1e-12
"""Smallest number that a file may give where one above 0 is needed."""
MAX_COORDINATE = 1e6
"""Farthest coordinate [m] that a file may give."""

COLORS = {
    "white": (1.0, 1.0, 1.0),
    "black": (0.0, 0.0, 0.0),
    "red": (1.0, 0.0, 0.0),
    "green": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "yellow": (1.0, 1.0, 0.0),
    "orange": (1.0, 0.5, 0.0),
    "purple": (0.5, 0.0, 0.5),
    "magenta": (1.0, 0.0, 1.0),
    "cyan": (0.0, 1.0, 1.0),
    "turquoise": (0.0, 1.0, 1.0),
    "pink": (1.0, 0.6, 0.7),
    "brown": (0.45, 0.28, 0.12),
    "grey": (0.5, 0.5, 0.5),
    "gray": (0.5, 0.5, 0.5),
    "dark_grey": (0.175, 0.175, 0.175),
    "light_grey": (0.75, 0.75, 0.75),
}
"""Colours by name, each [r, g, b] in 0..1. The pure ones are those of Gazebo's stock materials."""

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}", re.ASCII)
_SWITCHES = {"yes": True, "on": True, "no": False, "off": False}


Fault = tuple[tuple[str | int, ...], str | PydanticCustomError]
"""What is wrong with something inside the value at hand: its path from here, and the message or the error."""


def fault(message: str, **where: object) -> PydanticCustomError:
    """An error about the value at hand; `where` is what the loader makes its place of."""
    return PydanticCustomError("vrx", "{message}", {"message": message, **where})


def faults(*found: Fault) -> ValidationError:
    """Errors about things inside the value at hand."""
    details = [
        InitErrorDetails(type=fault(error) if isinstance(error, str) else error, loc=path, input=None)
        for path, error in found
    ]
    return ValidationError.from_exception_data("config", details)


def unsorted_rows(key: str, values: Iterable[float], what: str, unit: str = "") -> list[Fault]:
    """Rows of a table whose number is not above that of the row before; `what` the number is, as "an angle"."""
    return [
        ((key, index), f"{what} above that of the row before, {before:g}{unit}, is needed, got {value:g}")
        for index, (before, value) in enumerate(itertools.pairwise(values), 1)
        if value <= before
    ]


def exclusive(thing: "Config", *keys: str, required: bool = False) -> Iterator[Fault]:
    """Keys of which at most one is to be given, or with `required` exactly one, as faults where that is not so."""
    given = [key for key in keys if getattr(thing, key) not in {None, ()}]
    if len(given) > 1:
        yield (given[1],), f"give {one_of(keys)}, not {'both' if len(keys) == 2 else ' and '.join(given)}"
    elif required and not given:
        yield (keys[0],), f"required, unless {one_of(keys[1:])} is given"


class _Called(Protocol):
    """What has a name."""

    @property
    def name(self) -> str: ...


def repeated(**groups: Iterable[_Called]) -> list[Fault]:
    """Names that are given more than once, as faults at the later ones."""
    seen: Counter[str] = Counter()
    found: list[Fault] = []
    for key, group in groups.items():
        for index, thing in enumerate(group):
            if seen[thing.name]:
                found.append(((key, index, "name"), f"duplicate name '{thing.name}'"))
            seen[thing.name] += 1
    return found


class Only(NamedTuple):
    """Mark of a field that counts only with some values of another one."""

    selector: str
    """The other field."""
    values: tuple[object, ...] = ()
    """Its values with which the field counts; by default any but None."""
    required: bool = False
    """Whether the field must be given with these."""

    def allows(self, selected: object) -> bool:
        """Whether the field counts with a value of the other one."""
        return selected in self.values if self.values else selected is not None

    def fault(self, selected: object, value: object) -> PydanticCustomError | None:
        """What is wrong with a given value of the field beside one of the other field; None for either: not given."""
        allowed = self.allows(selected)
        if allowed is (value is not None) or (allowed and not self.required):
            return None
        chosen, *known = (shown(each).strip("'") for each in (selected, *self.values))
        if allowed:
            return fault(f"required for `{self.selector}: {chosen}`")
        said = f"without `{self.selector}`" if selected is None else f"for `{self.selector}: {chosen}`"
        return fault(f"not allowed {said}{f'; allowed for {one_of(known)}' if known else ''}", selector=self.selector)


class Config(BaseModel):
    """Frozen and strict: unknown keys, NaN and infinities are errors; whole numbers pass as floats."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)

    folder_keys: ClassVar[Mapping[str, str]] = {}
    """Key whose relative path starts in a folder, by the field of the folder; others hold that of the section."""

    @model_validator(mode="before")
    @classmethod
    def _from_file(cls, data: object) -> object:
        """Lists become tuples, an empty section its default; `folder` is where the text came from."""
        if not isinstance(data, Mapping):
            return data
        fields, sections = cls.model_fields, _sections(cls)
        plain = {
            key: tuple(value) if isinstance(value, list) else value
            for key, value in data.items()
            if value is not None or key not in sections
        }
        plain |= dict.fromkeys(plain.keys() - fields.keys(), keys_of(cls))  # for the message about an unknown key
        if isinstance(data, Section):
            plain = without_ignored_keys(cls, plain, data.entries)
            for own in (name for name, field in fields.items() if field.exclude):
                if own in data:
                    raise faults(((own,), unknown_key(own, keys_of(cls))))
                plain[own] = data.folder_of(cls.folder_keys.get(own, ""))
        return plain

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        given = self.model_fields_set
        ignored: list[Fault] = [
            ((key,), error)
            for key, only in limited_keys(type(self)).items()
            if (error := only.fault(getattr(self, only.selector), getattr(self, key) if key in given else None))
        ]
        if found := ignored or list(self._faults()):
            raise faults(*found)
        return self

    def _faults(self) -> Iterable[Fault]:
        """What is wrong with its values beside each other, once each alone is right and counts."""
        return ()


class FromFile(Config):
    """The content of a file, which knows its places."""

    _section: Section | None = PrivateAttr(default=None)

    @property
    def section(self) -> Section:
        """The content of the file, with places."""
        assert self._section is not None, "not read from a file"
        return self._section


def keys_of(model: type[Config]) -> list[str]:
    """The keys that a file may give a model, in their order."""
    return [name for name, field in model.model_fields.items() if not field.exclude]


def field_docstrings(model: type[Config]) -> dict[str, str]:
    """The docstrings under a model's fields, its base classes' included.

    Read when asked for: pydantic's `use_attribute_docstrings` reads the source of every model in every process.
    """
    found: dict[str, str] = {}
    for owner in (base for base in reversed(model.__mro__) if issubclass(base, Config)):
        (definition,) = ast.parse(inspect.getsource(owner)).body
        assert isinstance(definition, ast.ClassDef), "a model is a class of a module"
        for field, text in itertools.pairwise(definition.body):
            match field, text:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(docstring))):
                    found[name] = inspect.cleandoc(docstring)
    return found


@cache
def limited_keys(model: type[Config]) -> Mapping[str, Only]:
    """Fields of a model that have a meaning only with some values of another one."""
    marks = ((key, mark) for key, field in model.model_fields.items() for mark in field.metadata)
    return {key: mark for key, mark in marks if isinstance(mark, Only)}


def without_ignored_keys(
    model: type[Config], content: Mapping[str, Any], entries: Mapping[str, Entry] | None = None
) -> dict[str, Any]:
    """The keys of a model without those that do nothing with the values of others.

    With the `entries` of a file only those stay away whose selector's value is further down the chain of `extends`.
    """
    ignored = {
        key
        for key, only in limited_keys(model).items()
        if key in content
        and (entries is None or _overruled(entries.get(only.selector), entries.get(key)))
        and not only.allows(content.get(only.selector, model.model_fields[only.selector].default))
    }
    return {key: value for key, value in content.items() if key not in ignored}


def _overruled(selector: Entry | None, key: Entry | None) -> bool:
    return selector is not None and (key is None or selector.depth < key.depth)


@cache
def _sections(model: type[Config]) -> frozenset[str]:
    return frozenset(key for key, field in model.model_fields.items() if _is_section(field.annotation))


def _is_section(annotation: object) -> bool:
    """A nested model or a tuple of them: what a file may leave empty."""
    if isinstance(annotation, type) and issubclass(annotation, Config):
        return True
    return get_origin(annotation) is tuple and any(map(_is_section, get_args(annotation)))


def numbers(labels: str, more: str = "") -> BeforeValidator:
    """Demands one number for each of the space-separated `labels`; those of `more` may be left out, and are 0."""
    few = labels.split()
    names = few + more.split()
    form = " or ".join(f"{len(some)} numbers [{', '.join(some)}]" for some in (few, names)[: 1 + bool(more)])

    def check(value: object) -> object:
        if isinstance(value, str) or not isinstance(value, Sequence):
            raise fault(f"expected {form}, got {shown(value)}{_in_brackets(value, len(few), len(names))}")
        if len(value) not in {len(few), len(names)}:
            raise fault(f"expected {form}, got {len(value)}")
        return value if len(value) == len(names) else (*value, *[0.0] * (len(names) - len(few)))

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


def demand(holds: Callable[[Any], object], message: str) -> AfterValidator:
    """Demands that a value passes a test; `{}` in the message is the value as its file would write it."""

    def check(value: object) -> object:
        if not holds(value):
            raise fault(message.format(shown(value)))
        return value

    return AfterValidator(check)


Six = tuple[float, float, float, float, float, float]


def _possible(value: Six) -> Six:
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


def _rgba(value: object) -> object:
    if isinstance(value, str) and not _in_brackets(value, 3, 4):
        if value not in COLORS:
            raise fault(str(UnknownNameError("colour", value, COLORS)))
        return (*COLORS[value], 1.0)
    if isinstance(value, str) or not isinstance(value, Sequence) or len(value) not in {3, 4}:
        raise fault(
            f"expected a colour's name, [r, g, b] or [r, g, b, a], got {shown(value)}{_in_brackets(value, 3, 4)}"
        )
    return (*value, 1.0) if len(value) == 3 else tuple(value)


def switched(value: object) -> object:
    """Yes, no, on and off as true and false; anything else as it is."""
    return _SWITCHES.get(value.lower(), value) if isinstance(value, str) else value


Folder = Annotated[Path | None, Field(exclude=True, repr=False, strict=False)]
"""The folder of the file that this came from, in which its relative paths start. The loader sets it."""

NotEmpty = demand(bool, "must not be empty")
"""Demands at least one entry in a list."""

Number = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER)]
Positive = Annotated[
    float,
    Field(gt=0, le=MAX_NUMBER),
    demand(lambda value: value >= MIN_POSITIVE, f"must be at least {MIN_POSITIVE:g}, got {{}}"),
]
NonNegative = Annotated[float, Field(ge=0, le=MAX_NUMBER)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE, le=MAX_COORDINATE)]
Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
Share = Annotated[float, Field(ge=0, le=1)]

Vec3 = Annotated[tuple[Coordinate, Coordinate, Coordinate], numbers("x y z")]
Inertia = Annotated[
    tuple[Positive, Positive, Positive, Number, Number, Number],
    numbers("ixx iyy izz", "ixy ixz iyz"),
    AfterValidator(_possible),
]
"""Moments of inertia of a body about its centre of mass [kg m2]."""

Pose = Annotated[tuple[Coordinate, Coordinate, Coordinate, Number, Number, Number], numbers("x y z roll pitch yaw")]
"""x, y, z [m], roll, pitch, yaw [rad]; R = Rz(yaw) Ry(pitch) Rx(roll), body to world."""

Color = Annotated[tuple[Share, Share, Share, Share], BeforeValidator(_rgba)]
"""Red, green, blue, alpha in 0..1. A file gives a name, [r, g, b] or [r, g, b, a]."""

Name = Annotated[
    str, demand(_NAME.fullmatch, "expected a name of up to 64 letters A-Z, digits, '_', '-' or '.', got {}")
]
"""A name that MJCF, recordings and files can all carry."""

Switch = Annotated[bool, BeforeValidator(switched)]
"""True or false; a file may also say yes, no, on or off."""
