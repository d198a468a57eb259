"""Base of the models of users' files, and how a model reports what is wrong."""

import ast
import inspect
import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails, PydanticCustomError

from vrx_mj.config.tree import Section, fault, literal, one_of, unknown_key
from vrx_mj.config.values import NumberOf

Fault = tuple[tuple[str | int, ...], str | PydanticCustomError]
"""A mistake inside the value at hand: its path from here, and the message or the error."""
Faults = Iterator[Fault]


def faults(*found: Fault) -> ValidationError:
    """Errors about things inside the value at hand."""
    details = [
        InitErrorDetails(type=fault(error) if isinstance(error, str) else error, loc=path, input=None)
        for path, error in found
    ]
    return ValidationError.from_exception_data("config", details)


def column_faults(
    key: str, values: Sequence[float], what: str, unit: str = "", ends: tuple[float, float] | None = None
) -> Faults:
    """Rows of a table whose number is not above that of the row before, and a table of rows with other `ends`.

    `what` the number is, as "an angle".
    """
    for index, (before, value) in enumerate(itertools.pairwise(values), 1):
        if value <= before:
            yield (key, index), f"{what} above {before:g}{unit}, that of the previous row, is needed, got {value:g}"
    if ends and values and (values[0], values[-1]) != ends:
        plural, (first, last) = f"{what.partition(' ')[2]}s", ends
        yield (key,), f"{plural} from {first:g} to {last:g} are needed, got {values[0]:g} to {values[-1]:g}"


def exclusive(thing: "Config", *keys: str, required: bool = False) -> Faults:
    """Keys of which at most one is to be given, or with `required` exactly one, as faults where that is not so."""
    given = [key for key in keys if getattr(thing, key) not in {None, ()}]
    if len(given) > 1:
        yield (given[1],), f"give {one_of(keys)}, not {'both' if len(keys) == 2 else ' and '.join(given)}"
    elif required and not given:
        yield (keys[0],), f"required unless {one_of(keys[1:])} is given"


def duplicate_names(**groups: Iterable[Any]) -> list[Fault]:
    """Names that are given more than once, as faults at the later ones."""
    seen = Counter[str | None]()
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
        """Error in the value of the field beside that of the other field, if any; None stands for a field not given."""
        allowed = self.allows(selected)
        if allowed is (value is not None) or (allowed and not self.required):
            return None
        chosen, *known = (literal(each).strip("'") for each in (selected, *self.values))
        if allowed:
            return fault(f"required for `{self.selector}: {chosen}`")
        where = f"without `{self.selector}`" if selected is None else f"for `{self.selector}: {chosen}`"
        return fault(f"not allowed {where}{f'; allowed for {one_of(known)}' if known else ''}", selector=self.selector)


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
        fields = cls.model_fields
        plain = {
            key: tuple(value) if isinstance(value, list) else value
            for key, value in data.items()
            if value is not None or not (key in fields and _may_be_empty(fields[key]))
        }
        if not plain.keys() <= fields.keys():  # for the message about an unknown key
            plain |= dict.fromkeys(plain.keys() - fields.keys(), keys_of(cls))
        if isinstance(data, Section):
            plain = without_ignored_keys(cls, plain, data)
            for own in (name for name, field in fields.items() if field.exclude):
                if own in data:
                    raise faults(((own,), unknown_key(own, keys_of(cls))))
                plain[own] = data.folder_of(cls.folder_keys.get(own, ""))
        return plain

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        given = self.model_fields_set
        misplaced: list[Fault] = [
            ((key,), error)
            for key, only in limited_keys(type(self))
            if (error := only.fault(getattr(self, only.selector), getattr(self, key) if key in given else None))
        ]
        if found := misplaced or list(self._faults()):
            raise faults(*found)
        return self

    def _faults(self) -> Iterable[Fault]:
        """Mistakes in its values beside each other, once each alone is right and counts."""
        return ()


Folder = Annotated[Path | None, Field(exclude=True, repr=False, strict=False)]
"""The folder of the file that this came from, in which its relative paths start. The loader sets it."""


class InFolder(Config):
    """A part of a file with relative paths."""

    folder: Folder = None


class FromFile(InFolder):
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
    """The docstrings under a model's fields, its base classes' included; of numbers without, those of `model`.

    Read when asked for: pydantic's `use_attribute_docstrings` reads the source of every model in every process.
    """
    found = {key: own_docstrings(mark.record)[mark.name] for key, mark in marked_numbers(model)}
    for owner in (base for base in reversed(model.__mro__) if issubclass(base, Config)):
        found |= own_docstrings(owner)
    return found


@cache
def marked_numbers(model: type[Config]) -> Sequence[tuple[str, NumberOf]]:
    """Fields of a model that are numbers of a dataclass, or such a number or None."""
    hints = ((key, (field, *get_args(field.annotation))) for key, field in model.model_fields.items())
    marks = (
        (key, getattr(part, "metadata", getattr(part, "__metadata__", ()))) for key, parts in hints for part in parts
    )
    return [(key, mark) for key, found in marks for mark in found if isinstance(mark, NumberOf)]


def own_docstrings(owner: type) -> dict[str, str]:
    """The docstrings under the fields that a class itself declares."""
    (definition,) = ast.parse(inspect.getsource(owner)).body
    assert isinstance(definition, ast.ClassDef), "a model is a class of a module"
    found: dict[str, str] = {}
    for field, text in itertools.pairwise(definition.body):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(docstring))):
                found[name] = inspect.cleandoc(docstring)
    return found


@cache
def limited_keys(model: type[Config]) -> Sequence[tuple[str, Only]]:
    """Fields of a model that have a meaning only with some values of another one; a field may need several."""
    marks = ((key, mark) for key, field in model.model_fields.items() for mark in field.metadata)
    return [(key, mark) for key, mark in marks if isinstance(mark, Only)]


def without_ignored_keys(
    model: type[Config], content: Mapping[str, Any], section: Section | None = None
) -> dict[str, Any]:
    """The keys of a model without those that do nothing with the values of others.

    With the `section` of a file only those stay away whose selector's value is further down the chain of `extends`.
    """
    depth = {} if section is None else {key: entry.depth for key, entry in section.entries.items()}
    ignored = {
        key
        for key, only in limited_keys(model)
        if key in content
        and (section is None or depth.get(only.selector, math.inf) < depth.get(key, math.inf))
        and not only.allows(content.get(only.selector, model.model_fields[only.selector].default))
    }
    return {key: value for key, value in content.items() if key not in ignored}


def _may_be_empty(field: FieldInfo) -> bool:
    """Whether a file may leave a key empty: a section or a list that has a default, or what need not be given."""
    optional = field.default is None and type(None) not in get_args(field.annotation)
    return optional or bool(field.default_factory) or field.default == () or isinstance(field.default, Config)
