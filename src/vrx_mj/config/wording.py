"""How values, choices and names read in a message."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from pydantic_core import PydanticCustomError

from vrx_mj.errors import first_names, nearest, shorten
from vrx_mj.errors import quote as in_python

_TABLES = json.loads((Path(__file__).parent / "wording.json").read_bytes())
PYDANTIC: Mapping[str, str] = _TABLES["pydantic"]
"""Messages of pydantic's errors by type; `got` is the value, other names in braces are of the error's context."""
PYYAML: Mapping[str, str] = _TABLES["pyyaml"]
"""Messages of PyYAML's errors, by how they begin in its words."""
_LONGEST = 60


def fault(message: str, **where: object) -> PydanticCustomError:
    """An error about the value at hand; `where` is what the loader makes its place of."""
    return PydanticCustomError("vrx", "{message}", {"message": message, **where})


def literal(value: object) -> str:
    """A value as its file would write it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "keys and values" if value else "no keys"
    if isinstance(value, str):
        return f"'{_short(value)}'"
    if isinstance(value, list | tuple):
        return _short(f"[{', '.join(map(literal, value[:_LONGEST]))}]")
    huge = isinstance(value, int) and abs(value) >= 10**_LONGEST
    return f"a number of more than {_LONGEST} digits" if huge else in_python(value).removesuffix(".0")


def choice(value: object, allowed: Sequence[str]) -> str:
    """The message about a value that is not among the allowed ones."""
    close = nearest(value, allowed) if isinstance(value, str) else None
    hint = f"; did you mean '{close}'?" if close else ""
    return f"expected {one_of(allowed)}, got {literal(value)}{hint}"


def one_of(allowed: Sequence[str]) -> str:
    """The allowed values in words: "a, b or c"."""
    return " or ".join(filter(None, [", ".join(allowed[:-1]), allowed[-1]]))


def unknown_key(key: str, known: Iterable[str]) -> str:
    """The message about a key that the place does not have."""
    names = tuple(known)
    close = nearest(key, names)
    if ":" in key:
        return f"unknown key '{_short(key)}'; type a space after ':'"
    hint = f"did you mean '{close}'?" if close else f"allowed: {', '.join(names)}"
    return f"unknown key '{_short(key)}'; {hint}"


def _short(text: str) -> str:
    return shorten(text, _LONGEST)


ALLOWED = "a letter, then letters, digits and '_'"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_SHOWN = 8


def is_ros_name(name: str) -> bool:
    """Whether ROS allows a name in a topic: a letter, then letters, digits and underscores."""
    return _NAME.fullmatch(name) is not None


def ros_names_note(kind: str, names: Iterable[str]) -> list[str]:
    """A line about those of the names that ROS refuses; none if it allows all."""
    odd = [name for name in dict.fromkeys(names) if not is_ros_name(name)]
    if not odd:
        return []
    return [
        f"ROS refuses topics with the name of {kind} {first_names(map(literal, odd), _SHOWN)}: {ALLOWED} are allowed"
    ]
