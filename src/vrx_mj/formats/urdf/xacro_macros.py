"""Macros of xacro: their parameters with defaults, how they are found by name, and what a call of one must give."""

import re
from typing import Any, NamedTuple
from xml.dom import minidom

from vrx_mj.formats.urdf.expression_values import LONGEST_TEXT, ExpressionError
from vrx_mj.formats.urdf.expressions import Scope, unknown
from vrx_mj.formats.urdf.xacro_document import Located

MOST_PARAMETERS = 500
"""Parameters of a macro."""
_LONGEST_MESSAGE = 300
_NAME = re.compile(r"[^\W\d][\w-]*")
_PARAMETER = re.compile(r"\*{0,2}[^\W\d][\w.-]*")
_DEFAULT = re.compile(
    r"^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?"
    r"(\$\{.*?\}|\$\(.*?\)|(?>'[^']*'|\"[^\"]*\"|[^\s'\"]+)+|)(?:\s+|$)(.*)",
    re.DOTALL,
)
"""A macro's parameter with a default, and what follows."""


class Macro(NamedTuple):
    """A macro: its element, its parameters, and the defaults: whether the caller's property comes first, and a text."""

    body: minidom.Element
    params: list[str]
    defaults: dict[str, tuple[bool, str | None]]

    @property
    def values(self) -> list[str]:
        """Parameters that are no blocks."""
        return [param for param in self.params if not param.startswith("*")]


def defined(name: str, params: str, body: minidom.Element) -> Macro:
    """The macro of an element that defines one."""
    if len(params) > LONGEST_TEXT:
        raise ExpressionError(f"params has more than {LONGEST_TEXT} characters")
    if name == "call" or not _NAME.fullmatch(name):
        raise ExpressionError(_name_message(name))
    macro = Macro(body, [], {})
    while params:
        param, default, params = _parameter(params)
        macro.params.append(param)
        if default is not None:
            macro.defaults[param] = default[0], default[1] and Located.at(default[1], body)
    if len(macro.params) > MOST_PARAMETERS:
        raise ExpressionError(f"a macro has at most {MOST_PARAMETERS} parameters, got {len(macro.params)}")
    for param in macro.params:
        if not _PARAMETER.fullmatch(param):
            raise ExpressionError(f"'{param[:60]}' in params is not a parameter; write NAME or NAME:=DEFAULT")
    return macro


def _name_message(name: str) -> str:
    if name == "call":
        return "a macro cannot be named 'call'"
    wrong = ": a macro's name cannot contain '.'" if "." in name else " is not a valid name for a macro"
    return f"'{name}'{wrong}"[:_LONGEST_MESSAGE]


def _parameter(text: str) -> tuple[str, tuple[bool, str | None] | None, str]:
    """The first parameter of a macro's `params`, its default, and the rest."""
    found = _DEFAULT.match(text)
    if found is None:
        bare, *more = text.split(None, 1)
        return bare, None, "".join(more)
    name, forward, default, rest = found.groups()
    return name, (bool(forward), default or None) if forward or default else None, rest


def macro_of(name: str, macros: Scope, symbols: Scope) -> tuple[Scope, Scope, Macro]:
    """A macro by its name, in a namespace or not, and the scopes it is defined in."""
    inner_macros: Any = macros
    inner_symbols: Any = symbols
    *spaces, last = [name] if name in macros else name.split(".")
    try:
        for space in spaces:
            inner_macros, inner_symbols = inner_macros[space], inner_symbols[space]
        macro = inner_macros[last]
    except (KeyError, TypeError):
        macro = None
    if not isinstance(macro, Macro):
        raise unknown("macro", name, macros.names())
    return inner_macros, inner_symbols, macro


def check_call(node: minidom.Element, macro: Macro) -> None:
    """Refuse attributes that a macro does not take, and the lack of those that it needs."""
    names = macro.values
    takes = f"it takes {', '.join(names)}" if names else "it takes no parameters"
    for name in node.attributes.keys():  # noqa: SIM118 - not a dict
        if name not in names:
            raise ExpressionError(f"macro has no parameter '{name}'; {takes}")
    missing = [name for name in names if name not in macro.defaults and not node.hasAttribute(name)]
    if missing:
        listed = ", ".join(f"'{name}'" for name in missing)
        raise ExpressionError(f"macro needs {listed}; {takes}")
