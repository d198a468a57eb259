"""How values and choices read in a message."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from vrx_mj.errors import nearest

__all__ = ["choice", "shown", "unknown_key"]

_LONGEST = 60


def shown(value: Any) -> str:
    """A value as its file would write it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"'{_short(value)}'"
    if isinstance(value, Mapping):
        return "keys and values" if value else "no keys"
    if isinstance(value, Sequence) and not isinstance(value, bytes):
        return _short(f"[{', '.join(shown(item) for item in value[:_LONGEST])}]")
    if isinstance(value, int) and abs(value) >= 10**_LONGEST:
        return f"a number of over {_LONGEST} digits"
    return _short(repr(value))


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
    hint = f"did you mean '{close}'?" if close else f"allowed: {', '.join(names)}"
    return f"unknown key '{_short(key)}'; {hint}"


def _short(text: str) -> str:
    line = text.replace("\n", "\\n")
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}..."
