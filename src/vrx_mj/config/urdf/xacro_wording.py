"""What went wrong in xacro, in our words and with its place."""

import re
from pathlib import Path
from typing import Any

from vrx_mj.config.search import display
from vrx_mj.config.tree import Place
from vrx_mj.config.urdf.xacro_document import FileError, place_of
from vrx_mj.config.urdf.xacro_engine import Engine
from vrx_mj.config.urdf.xacro_limits import ExpressionError
from vrx_mj.errors import Problem

__all__ = ["problem_of"]

_WORDS = (
    (r"invalid expression: (\$[{(].*)", r"'\1' is never closed"),
    (r"invalid expression: (.*)", r"'\1': write '$$' for a plain '$' before a bracket"),
    (r"circular variable definition: ([^\n]*).*", r"properties refer to each other in a circle: \1"),
    (r"Not enough blocks", "macro needs one more block: an element inside this one"),
    (r'Unused block "(.*)"', r"macro takes no further block: <\1> is one too many"),
    (r'Undefined block "(.*)"', r"no block named '\1'; a macro gets it as a parameter *\1 or **\1"),
    (r"Undefined property to forward: (.*)", r"macro needs '\1', or a property of that name where it is called"),
    (r"Property names must be valid python identifiers: ?(.*)",
     r"'\1' is not a valid name for a property: letters, digits, _"),
    (r"Property names must not start with double underscore: ?(.*)",
     r"'\1': names that begin with '__' are not allowed"),
    (r"Property attributes default, value, and remove are mutually exclusive: ?(.*)",
     r"property '\1': give one of value, default and remove"),
    (r'Xacro conditional "(.*)" evaluated to "(.*)", which is not a boolean expression\.',
     r"'\1' gives '\2', which is neither true nor false"),
    (r"Invalid use of macro name 'call'", "a macro cannot be named 'call'"),
    (r"macro names must not contain '\.' \(reserved for namespaces\): (.*)",
     r"'\1': a macro's name cannot contain '.'"),
    (r"xacro:(element|attribute): empty name", "its name is empty"),
    (r"'\w+' object has no attribute .*", "expected text, got a number or list"),
    (r"xacro:call is missing the 'macro' attribute", "attribute 'macro' is required, but missing"),
)  # fmt: skip
_CALLERS = 3


def problem_of(error: BaseException, engine: Engine, file: Path) -> Problem:
    """The problem that stopped an expansion."""
    cause = _root(error)
    if isinstance(cause, FileError):
        return _placed(cause.place, cause.key, str(cause))
    message = _said(cause)
    if engine.expression:
        message = f"{engine.expression[:200]}: {message}"
    if engine.texts:
        place, tag = engine.texts[-1].place, engine.texts[-1].tag
    elif engine.element is not None and place_of(engine.element):
        place, tag = place_of(engine.element), engine.element.tagName
    else:
        return Problem(display(file), None, None, "", message)
    return _placed(_pointed(place, engine.expression), f"<{tag}>", message + _callers(engine))


def _placed(place: Place, key: str, message: str) -> Problem:
    return Problem(place.file.name, place.line, place.column, key, message)


def _root(error: BaseException) -> BaseException:
    """The error that xacro's errors were made from."""
    while isinstance(getattr(error, "exc", None), BaseException) and not isinstance(error, ExpressionError):
        error = error.exc  # type: ignore[attr-defined]
    return error


def _said(error: BaseException) -> str:
    if isinstance(error, RecursionError | MemoryError):
        return "nested too deeply: does something refer to itself?"
    text = str(error)
    if isinstance(error, ExpressionError | FileNotFoundError):
        return text
    for pattern, ours in _WORDS:
        found = re.fullmatch(pattern, text, re.DOTALL)
        if found:
            return found.expand(ours)[:300]
    return f"cannot be expanded: {text.splitlines()[0] if text else type(error).__name__}"[:300]


def _pointed(place: Place, expression: str) -> Place:
    """The place of an expression, looked for from the element it is in."""
    start = (place.line or 1) - 1
    for number, line in enumerate(place.file.lines[start : start + 40], start + 1):
        column = line.find(expression, (place.column or 1) - 1 if number == place.line else 0)
        if expression and column >= 0:
            return Place(place.file, number, column + 1)
    return place


def _callers(engine: Engine) -> str:
    """Which macros led here, the innermost first."""
    inside: list[Any] = list(reversed(engine.calls))
    if engine.element is not None and inside and place_of(engine.element) == inside[0][1]:
        inside = inside[1:]
    said = dict.fromkeys(f"in macro '{name}' called at {place.file.name}:{place.line}" for name, place in inside)
    return f" ({', '.join(list(said)[:_CALLERS])})" if said else ""
