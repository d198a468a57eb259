"""How values and choices read in a message."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from vrx_mj.errors import nearest, shortened
from vrx_mj.errors import shown as in_python

__all__ = ["choice", "one_of", "shown", "unknown_key"]

_LONGEST = 60


def shown(value: Any) -> str:
    """A value as its file would write it, shortened."""
    words = {None: "nothing", True: "true", False: "false"}
    if value is None or isinstance(value, bool):
        return words[value]
    if isinstance(value, Mapping):
        return "keys and values" if value else "no keys"
    if isinstance(value, str):
        return f"'{_short(value)}'"
    if isinstance(value, list | tuple):
        return _short(f"[{', '.join(map(shown, value[:_LONGEST]))}]")
    huge = isinstance(value, int) and abs(value) >= 10**_LONGEST
    return f"a number of more than {_LONGEST} digits" if huge else in_python(value).removesuffix(".0")


def choice(value: Any, allowed: Sequence[str]) -> str:
    """What to say about a value that is none of the allowed ones."""
    close = nearest(value, allowed) if isinstance(value, str) else None
    hint = f"; did you mean '{close}'?" if close else ""
    return f"expected {one_of(allowed)}, got {shown(value)}{hint}"


def one_of(allowed: Sequence[str]) -> str:
    """The allowed values in words: "a, b or c"."""
    return " or ".join(filter(None, [", ".join(allowed[:-1]), allowed[-1]]))


def unknown_key(key: str, known: Iterable[str]) -> str:
    """What to say about a key that the place does not have."""
    names = tuple(known)
    close = nearest(key, names)
    if ":" in key:
        return f"unknown key '{_short(key)}'; type a space after ':'"
    hint = f"did you mean '{close}'?" if close else f"allowed: {', '.join(names)}"
    return f"unknown key '{_short(key)}'; {hint}"


def _short(text: str) -> str:
    return shortened(text, _LONGEST)
