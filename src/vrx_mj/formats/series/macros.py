"""The macros of VRX's worlds (vrx_gazebo/worlds/xacros, gazebo_classic), which are a xacro file of ours."""

import contextlib
import functools
import re
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import quoteattr

from vrx_mj.config.search import SCHEME
from vrx_mj.config.tree import File, Place, literal
from vrx_mj.config.values import as_switch
from vrx_mj.errors import ConfigError, UnknownNameError, VrxWarning
from vrx_mj.formats.gazebo.document import Element, parse
from vrx_mj.formats.series.axes import BLOCK, Call
from vrx_mj.formats.series.pieces import TABLE
from vrx_mj.formats.urdf.elements import numbers_of, truth
from vrx_mj.formats.urdf.expand import MACROS
from vrx_mj.formats.urdf.xml_document import read_text

REQUIRED = object()
"""Marks a parameter without a default, which must be given."""
PLACES = {f"{name}{end}" for name in ("sydneyregatta", "sandisland", "marina") for end in ("", "_minus_scene")}
"""Macros that make a place."""
_PARTS = {"ocean_waves": "sea", "usv_wind_gazebo": "wind", "scene_macro": "scene", "insert_model": "objects"}
"""What other macros make; of those that are not here it is the task."""
_BLOCKS = TABLE["blocks"]
"""Blocks of macros: the `element` in each, what is `inside` of it, and whether a call `needs` the block."""
Line = tuple[str, Place]
"""A line of a xacro file, and where the axes file says it."""
_PARAMETER = re.compile(r"(\*\*)?(\w+)(?::=('[^']*'|\S+))?")
_DOLLARS = re.compile(r"\$+(?=[{(])")


@dataclass(frozen=True)
class Macro:
    """Parameters of a macro, and the part of a world that it makes."""

    part: str
    """Part of the world that the macro makes; there is one of each, but any number of objects."""
    defaults: Mapping[str, Any]
    blocks: tuple[str, ...]


@functools.cache
def macros() -> Mapping[str, Macro]:
    """All macros by name, as our xacro file has them."""
    found = {}
    for element in parse(read_text(MACROS), File(MACROS.name, MACROS.parent)).walk():
        name = element.attributes.get("name", "")
        if element.tag == "xacro:macro" and not name.startswith(("vrx_mj_", "include_all")):
            said = _PARAMETER.findall(element.attributes.get("params", ""))
            defaults = {key: _default(text) for stars, key, text in said if not stars}
            part = "base" if name in PLACES else _PARTS.get(name, "task")
            found[name] = Macro(part, defaults, tuple(key for stars, key, _ in said if stars))
    return found


def _default(text: str) -> object:
    number, switch = _number(text), truth(text)
    return REQUIRED if not text else number if number is not None else text.strip("'") if switch is None else switch


def lines_of(call: Call) -> list[Line]:
    """A call as xacro.

    Raises:
        ConfigError: the macro is unknown, or does not take what the call gives.
    """
    macro = macros().get(call.macro)
    if macro is None:
        raise call.fault(None, str(UnknownNameError("macro", call.macro, macros())))
    known = [*macro.defaults, *(BLOCK + name for name in macro.blocks)]
    for key in call.parameters:
        if key not in known:
            raise call.fault(key, str(UnknownNameError(f"parameter of {call.macro}", key, known)))
    required = [key for key, value in macro.defaults.items() if value is REQUIRED]
    for key in (*required, *(BLOCK + name for name in macro.blocks if _BLOCKS[name]["needs"])):
        if key not in call.parameters:
            raise call.fault(None, f"{call.macro} needs the parameter {key!r}")
    given = ((key, _text(call, key, value)) for key, value in macro.defaults.items() if key in call.parameters)
    words = "".join(f" {key}={quoteattr(_literal(text))}" for key, text in given)
    blocks = [(_block(call, name), call.place_of(BLOCK + name)) for name in macro.blocks]
    return [(f"<xacro:{call.macro}{words}>", call.place), *blocks, (f"</xacro:{call.macro}>", call.place)]


def _text(call: Call, key: str, default: object) -> str:
    """The argument of a parameter: of the kind of its default."""
    value = call.parameters[key]
    if isinstance(default, bool):
        switch = truth(str(as_switch(str(value).strip())))
        if switch is None:
            raise call.fault(key, f"expected true or false, got {literal(value)}")
        return str(switch).lower()
    if isinstance(default, float) or default == "":
        number = 0.0 if default == "" and value in ("", None) else _number(value)
        if number is None or (default == "" and number % 1):
            raise call.fault(key, f"expected a {'whole ' * (default == '')}number, got {literal(value)}")
        return str(number)
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise call.fault(key, f"expected text, got {literal(value)}")
    text = str(value).strip()
    return f"'{text.removeprefix(SCHEME) if key.endswith('uri') else text}'"


def _literal(text: str) -> str:
    """A text that xacro takes as it is: what begins as an expression is none."""
    return _DOLLARS.sub(r"$\g<0>", text)


def _number(value: object) -> float | None:
    with contextlib.suppress(ValueError):
        return numbers_of(str(value), "value")[0]
    return None


def _block(call: Call, name: str) -> str:
    """The XML of a block on one line; an empty one where the call has none."""
    key = BLOCK + name
    value = call.parameters.get(key)
    if value is not None and not isinstance(value, str | int | float):
        raise call.fault(key, f"expected XML in quotes, got {literal(value)}")
    text = _literal("" if value is None else str(value))
    try:
        element = _block_element(f"<{name}>{text}</{name}>", call.place.file.name)
    except ConfigError as error:
        raise call.fault(key, re.sub(r" of line \d+", "", error.problems[0].message)) from None
    for fault in _odd_elements(name, element):
        raise call.fault(key, fault)
    if element.children and element.own_text:
        stray = literal(" ".join(element.own_text.split()))
        problem = f"{call.place.file.name}:{call.place_of(key).line}: {stray} between the elements of {key}"
        warnings.warn(f"{problem} is ignored", VrxWarning, stacklevel=2)
    return f"<{name}>{' '.join(text.split())}</{name}>"


@functools.lru_cache(maxsize=1000)
def _block_element(text: str, name: str) -> Element:
    """The block of a text: worlds of a series have the same ones."""
    return parse(text, File(name, None))


def _odd_elements(block: str, element: Element) -> Iterator[str]:
    """Messages about elements of a block."""
    name, known = _BLOCKS[block]["element"], _BLOCKS[block]["inside"]
    if name and element.own_text and not element.children:
        yield f"expected elements <{name}>, got {literal(element.own_text)}"
    whole = block == name and element.child(name) is None  # of a fog the block may have what is in it
    for child in [element] if whole else element.children:
        if name and child.tag != name:
            yield str(UnknownNameError("element of this block", child.tag, [name]))
        for inner in child.children if name else ():
            if inner.tag not in known:
                yield str(UnknownNameError(f"element of <{name}>", inner.tag, known))
