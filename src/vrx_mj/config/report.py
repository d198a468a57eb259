"""pydantic's errors in our words, each with the file, line, column and key it is about."""

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, cast, get_args

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from vrx_mj.config.base import Config, keys_of
from vrx_mj.config.tree import Place, Section, key_path, locate
from vrx_mj.config.wording import choice, shown, unknown_key
from vrx_mj.errors import Problem

__all__ = ["fault_text", "problem_at", "problems_of"]


def problems_of(error: ValidationError, model: type[Config], section: Section) -> list[Problem]:
    """Everything that pydantic found in a section, in the order of the file."""
    found = [_problem(details, model, section) for details in error.errors(include_url=False)]
    return sorted(dict.fromkeys(found), key=lambda problem: (problem.file, problem.line or 0, problem.column or 0))


def fault_text(error: ValidationError) -> str:
    """The first thing that pydantic found in data of no YAML file, with its key: `layout.nq: must be at least 0`."""
    details = error.errors(include_url=False, include_context=True)[0]
    key = key_path(tuple(step if isinstance(step, int) else step[:60] for step in details["loc"]))
    return f"{key}: {_message(details)}" if key else _message(details)


def problem_at(section: Section, loc: tuple[str | int, ...], message: str) -> Problem:
    """A problem with the value at `loc`."""
    place, path = locate(section, loc)
    return Problem(place.file.name, place.line, place.column, key_path(path), message)


def _problem(details: ErrorDetails, model: type[Config], section: Section) -> Problem:
    loc, inside = details["loc"], details.get("ctx", {})
    place, path = locate(section, loc)
    message = _message(details)
    if "row" in inside:
        place = _inside(place, inside["row"], inside["column"])
    if details["type"] == "extra_forbidden":
        key = str(loc[-1])
        message = unknown_key(key, _keys(model, section, loc[:-1]))
        place = _owner(section, loc).entries[key].key
    return Problem(place.file.name, place.line, place.column, key_path(path), message)


def _owner(section: Section, loc: tuple[str | int, ...]) -> Section:
    """The section that holds the key that `loc` ends with."""
    node: Any = section
    for step in loc[:-1]:
        if isinstance(step, int) or step in node:
            node = node[step]
    assert isinstance(node, Section), f"{loc} does not lead to a key"
    return node


def _inside(place: Place, row: int, column: int) -> Place:
    """A row and column of a block of text ('|') as a line and column of its file."""
    lines = place.file.lines[place.line or 0 :]
    header = place.file.lines[place.line - 1] if place.line and lines else ""
    if "|" not in header or row > len(lines):
        return place
    first = next(filter(str.strip, lines), "")
    digit = re.search(r"\|[-+]?(\d)", header)
    parent = len(header) - len(re.sub(r"^ *(- +)*", "", header))
    indent = parent + int(digit[1]) if digit else len(first) - len(first.lstrip(" "))
    return Place(place.file, (place.line or 0) + row, indent + column)


def _keys(model: type[Config], section: Section, path: tuple[str | int, ...]) -> list[str]:
    """The keys that a file may write at `path`."""
    owner, node = model, cast("Any", section)
    for step in path:
        node = node[step] if isinstance(step, int) or step in node else node
        if isinstance(step, str) and step in owner.model_fields:
            owner = _model_in(owner.model_fields[step].annotation, node) or owner
    top = ["extends"] if owner is model else []
    return [*top, *keys_of(owner)]


def _model_in(annotation: Any, value: Any) -> type[Config] | None:
    """The model of a value: of several that of its `type`, or else the first."""
    models = list(_models(annotation))
    kind = value.get("type") if isinstance(value, Mapping) else None
    return next((model for model in models if _is_of_type(model, kind)), models[0] if models else None)


def _models(annotation: Any) -> Iterator[type[Config]]:
    if isinstance(annotation, type) and issubclass(annotation, Config):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def _is_of_type(model: type[Config], kind: Any) -> bool:
    return "type" in model.model_fields and kind in get_args(model.model_fields["type"].annotation)


def _message(details: ErrorDetails) -> str:
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    if kind in _SAYS:
        return _SAYS[kind](value, context)
    if kind in _EXPECTED:
        return f"expected {_EXPECTED[kind]}, got {shown(value)}"
    return f"{details['msg'][:1].lower()}{details['msg'][1:]}, got {shown(value)}"


def _limit(words: str, key: str) -> Callable[[Any, Mapping[str, Any]], str]:
    def say(value: Any, context: Mapping[str, Any]) -> str:
        limit = context[key] if isinstance(context[key], int) else format(context[key], ".15g")
        return f"must be {words} {limit}, got {shown(value)}"

    return say


def _text(value: Any, _: Mapping[str, Any]) -> str:
    quote = "; put it in quotes" if isinstance(value, int | float) else ""
    return f"expected text, got {shown(value)}{quote}"


def _literal(value: Any, context: Mapping[str, Any]) -> str:
    return choice(value, context["expected"].replace(" or ", ", ").replace("'", "").split(", "))


def _tag(_: Any, context: Mapping[str, Any]) -> str:
    known = context["expected_tags"].replace("'", "").split(", ")
    return f"{str(context['discriminator']).strip(chr(39))}: {choice(context['tag'], known)}"


_SAYS: dict[str, Callable[[Any, Mapping[str, Any]], str]] = {
    "vrx": lambda _, context: str(context["message"]),
    "missing": lambda *_: "required, but missing",
    "unexpected_keyword_argument": lambda *_: "unknown key",
    "json_invalid": lambda _, context: f"not JSON: {context['error']}",
    "string_type": _text,
    "literal_error": _literal,
    "union_tag_invalid": _tag,
    "union_tag_not_found": lambda _, context: f"{context['discriminator']} is required, but missing".replace("'", ""),
    "finite_number": lambda value, _: f"must be finite, got {shown(value)}",
    "greater_than": _limit("above", "gt"),
    "greater_than_equal": _limit("at least", "ge"),
    "less_than": _limit("below", "lt"),
    "less_than_equal": _limit("at most", "le"),
}
_EXPECTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "dataclass_type": "keys and values",
    "dict_type": "keys and values",
    "model_type": "keys and values",
    "model_attributes_type": "keys and values",
}
