"""Python's `%` on a text, worked out one conversion at a time: no text is made that an expression could not hold."""

import re
from collections.abc import Iterator
from typing import Any

from vrx_mj.config.urdf.xacro_limits import LONGEST_TEXT, MOST_DIGITS, Budget, ExpressionError, measure

__all__ = ["formatted"]

_PIECE = re.compile(
    r"[^%]+|%%|%(?P<key>\([^()]*\))?(?P<flags>[-#0 +]*)(?P<width>\*|[0-9]*)(?:\.(?P<precision>\*|[0-9]*))?"
    r"[hlL]?(?P<kind>[diouxXeEfFgGcrsa])"
)
"""Plain text, a '%' or a conversion of Python's, in full."""


def formatted(pattern: str, values: Any, budget: Budget) -> str:
    """What `pattern % values` is.

    Raises:
        ExpressionError: a width or precision is above the limit, or the text becomes too long.
        TypeError, ValueError, LookupError: as Python does, for values that do not fit the pattern.
    """
    rest: Iterator[Any] = iter(values if isinstance(values, tuple) else (values,))
    parts: list[str] = []
    place = length = 0
    while place < len(pattern):
        piece = _PIECE.match(pattern, place)
        if piece is None:
            raise ValueError("unsupported format")
        parts.append(_written(piece, values, rest, budget))
        place, length = piece.end(), length + len(parts[-1])
        if length > LONGEST_TEXT:
            raise ExpressionError(f"a text of more than {LONGEST_TEXT} characters is too long")
    if not isinstance(values, list | dict | range) and next(rest, rest) is not rest:
        raise TypeError("not all values are used")
    return "".join(parts)


def _written(piece: re.Match[str], values: Any, rest: Iterator[Any], budget: Budget) -> str:
    if piece["kind"] is None:
        return piece[0].replace("%%", "%")
    for digits in (piece["width"], piece["precision"] or ""):
        if digits == "*" or len(digits.lstrip("0")) > len(str(MOST_DIGITS)) or int(digits or 0) > MOST_DIGITS:
            raise ExpressionError(f"'{piece[0][:20]}': a width is at most {MOST_DIGITS}")
    value = _taken(piece["key"], values, rest)
    budget.spend(5 * measure(value, budget))
    precision = "" if piece["precision"] is None else f".{piece['precision']}"
    return f"%{piece['flags']}{piece['width']}{precision}{piece['kind']}" % (value,)


def _taken(key: str | None, values: Any, rest: Iterator[Any]) -> Any:
    """The value that a conversion is for: that of its key, or the next one."""
    if key is None:
        try:
            return next(rest)
        except StopIteration:
            raise TypeError("not enough values") from None
    if not isinstance(values, dict):
        raise TypeError("a key needs a mapping")
    return values[key[1:-1]]
