"""What the values of parameters mean: numbers, switches, names and places, with their `${...}` expressions.

A function here takes what YAML gave and returns what is meant, or raises ValueError with the reason.
"""

import math
import re
from typing import Any

from vrx_mj.config.base import MAX_COORDINATE
from vrx_mj.config.parts.catalogue import Parameter
from vrx_mj.config.urdf.expression_values import GLOBALS, MATH, Budget, ExpressionError, Module
from vrx_mj.config.urdf.expressions import Names, evaluate
from vrx_mj.config.wording import shown
from vrx_mj.errors import shortened

__all__ = ["has_expression", "meant", "triple_of"]

_NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]{0,63}")
_WORD = re.compile(r"[A-Za-z0-9_./-]{1,64}")
_SWITCHES = {
    "true": True, "yes": True, "on": True, "1": True,
    "false": False, "no": False, "off": False, "0": False,
}  # fmt: skip
_EXPRESSION = re.compile(r"\$\{([^}]*)\}")
NAMES = Names({**GLOBALS, "math": Module("math", MATH)})
"""What an expression may use: those of xacro that no file defines, `radians` and `pi` among them."""
WORK = 20_000
"""Limit of the work on one expression, about 1 us each."""
LONGEST = 2000
"""Characters of a text with an expression in it."""
LARGEST = {"Hz": 10_000.0}
"""Largest value by unit; any other number is a coordinate or an angle."""


def meant(parameter: Parameter, value: Any) -> str | float | bool:
    """What a parameter's value means.

    Raises:
        ValueError: it is nothing that the parameter can be, and why.
    """
    if parameter.form == "number":
        return number(value, parameter.unit)
    if parameter.form == "switch":
        return switch(value)
    if parameter.form == "triple":
        return triple(value)
    return _text(value, named=parameter.form == "name")


def number(value: Any, unit: str = "") -> float:
    """A finite number, as YAML has it, in quotes, or as an expression."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a number, got {shown(value)}")  # noqa: TRY004
    text = _substituted(value).strip() if isinstance(value, str) else repr(value)
    if isinstance(value, str) and not _NUMBER.fullmatch(text):
        raise ValueError(f"expected a number, got {shown(value)}{_result(value, text)}")
    found, most = float(text) if isinstance(value, str) else _float(value), LARGEST.get(unit, MAX_COORDINATE)
    if not math.isfinite(found):
        raise ValueError(f"must be finite, got {shown(value)}")
    if unit == "Hz" and not 0.0 < found <= most:
        raise ValueError(f"must be above 0 and at most {most:g} Hz, got {shown(value)}")
    if abs(found) > most:
        raise ValueError(f"must lie between -{most:g} and {most:g}, got {shown(value)}")
    return found


def switch(value: Any) -> bool:
    """True or false, as YAML has it, as a word, or as an expression."""
    text = _substituted(value) if isinstance(value, str) else repr(value)
    found = _SWITCHES.get(text.strip().lower())
    if found is None:
        raise ValueError(f"expected true or false, got {shown(value)}{_result(value, text)}")
    return found


def triple(value: Any) -> str:
    """Three numbers with blanks between, from such a text or from a list."""
    text = _substituted(value) if isinstance(value, str) else ""
    words = text.split() if isinstance(value, str) else value
    if not isinstance(words, list | tuple) or len(words) != 3:
        raise ValueError(f"expected three numbers as in '1.0 0 -1.0', got {shown(value)}{_result(value, text)}")
    try:
        numbers = [number(word) for word in words]
    except ValueError as error:
        raise ValueError(f"expected three numbers as in '1.0 0 -1.0', got {shown(value)}: {error}") from None
    return " ".join(map(_written, numbers))


def triple_of(text: str) -> tuple[float, float, float]:
    """The three numbers of a text that `triple` made."""
    x, y, z = map(float, text.split())
    return x, y, z


def has_expression(value: Any) -> bool:
    """Whether a value, or one in a list of values, needs evaluating."""
    if isinstance(value, list | tuple):
        return any(map(has_expression, value))
    return isinstance(value, str) and len(value) <= LONGEST and _EXPRESSION.search(value) is not None


def _text(value: Any, *, named: bool) -> str:
    if not isinstance(value, str):
        hint = "; put it in quotes" if isinstance(value, int | float) and not isinstance(value, bool) else ""
        raise ValueError(f"expected text, got {shown(value)}{hint}")  # noqa: TRY004
    if named and not _NAME.fullmatch(value):
        raise ValueError(f"expected a name of up to 64 letters A-Z, digits, '_' or '-', got {shown(value)}")
    if not named and not _WORD.fullmatch(value):
        raise ValueError(f"expected up to 64 letters A-Z, digits, '_', '-', '.' or '/', got {shown(value)}")
    return value


def _substituted(text: str) -> str:
    """The text with its expressions worked out."""
    if len(text) > LONGEST:
        raise ValueError(f"expected at most {LONGEST} characters, got {shown(text)}")
    return _EXPRESSION.sub(lambda found: _worked_out(found[1]), text)


def _worked_out(expression: str) -> str:
    try:
        found = evaluate(expression, NAMES, Budget(WORK))
    except ExpressionError as error:
        raise ValueError(f"'${{{shortened(expression)}}}': {error}") from None
    return repr(found) if isinstance(found, float) else str(found)


def _result(value: Any, text: str) -> str:
    """What an expression came to, where a message needs it."""
    return f", which is {shown(text)}" if has_expression(value) else ""


def _float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _written(value: float) -> str:
    return repr(value).removesuffix(".0")
