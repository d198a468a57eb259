"""A message from what a client's JSON holds: strict, with defaults for what is missing.

null stands for NaN where a float is wanted, `uint8[]` and `char[]` are base64 or lists, moments are `{secs, nsecs}`,
`{sec, nanosec}` or "now", and a header without a stamp gets the present moment, as rosbridge_server does.
"""

import base64
import math
import reprlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from vrx_mj.errors import CommandError, nearest
from vrx_mj.ros import messages
from vrx_mj.ros.messages import Message
from vrx_mj.ros.rosbridge.kinds import INTEGERS, MOMENT, SPAN, Field, fields

__all__ = ["request", "taken"]

LARGEST_FLOAT32 = float(np.finfo(np.float32).max)
FLOATS = frozenset({"float32", "float64"})
PARTS = {"secs": "sec", "nsecs": "nanosec", "sec": "sec", "nanosec": "nanosec"}
SHOWN = 60
"""Characters of a wrong value that are shown, at most."""
_short = reprlib.Repr()
_short.maxstring = _short.maxlong = _short.maxother = SHOWN


def taken(value: Any, type_name: str, now: float, place: str) -> Message:
    """The message that a JSON object describes, at a moment [s]; `place` says where it came for errors.

    Raises:
        CommandError: a field is unknown or has a wrong value; it names the field, the value and what is allowed.
    """
    if not isinstance(value, Mapping):
        raise _wrong(place, value, f"an object with the fields of {type_name}")
    known = fields(type_name)
    for name in value:
        if name not in known:
            raise CommandError(f"{place}: {type_name} has no field {_shown(name)}; {_known(name, known)}")
    given = {name: _field(value[name], known[name], now, f"{place}.{name}") for name in value}
    for name, field in known.items():
        if name not in given and field.type == "std_msgs/Header" and field.length < 0:
            given[name] = taken({}, field.type, now, place)
    if type_name == "std_msgs/Header":
        given.setdefault("stamp", messages.stamp(now))
    return messages.new(type_name, **given)


def request(arguments: Any, type_name: str, now: float, place: str) -> Message:
    """A service's request, from an object, or from a list of its fields' values in their order.

    Raises:
        CommandError: as `taken` does, and where the list is too long.
    """
    if isinstance(arguments, list):
        names = list(fields(type_name))
        if len(arguments) > len(names):
            raise CommandError(f"{place}: {len(arguments)} arguments; {type_name} has {len(names)} fields")
        arguments = dict(zip(names, arguments, strict=False))
    return taken({} if arguments is None else arguments, type_name, now, place)


def _field(value: Any, field: Field, now: float, place: str) -> Any:
    if field.length < 0:
        return _single(value, field.type, now, place)
    if field.type in {"uint8", "char"} and isinstance(value, str):
        value = _decoded(value, place)
    elif not isinstance(value, list):
        raise _wrong(place, value, f"a list of {field.type}")
    if field.length and len(value) != field.length:
        raise CommandError(f"{place}: {len(value)} values; {field.type}[{field.length}] has {field.length}")
    return _array(value, field.type, now, place)


def _array(values: Any, type_name: str, now: float, place: str) -> Any:
    if isinstance(values, bytes):
        return np.frombuffer(values, np.uint8)
    if type_name == "string" or type_name in {MOMENT, SPAN} or "/" in type_name:
        return _each(values, type_name, now, place)
    layout = {"byte": "uint8", "char": "uint8"}.get(type_name, type_name)
    made = _numbers(values, type_name, layout)
    return np.array(_each(values, type_name, now, place), layout) if made is None else made


def _numbers(values: list[Any], type_name: str, layout: str) -> Any:
    """An array of a list that is right as it is, which is quick for long ones; None where it holds null or worse."""
    kinds = set(map(type, values))
    if type_name in INTEGERS and kinds == {int}:
        low, high = INTEGERS[type_name]
        return np.array(values, layout) if low <= min(values) and max(values) <= high else None
    if type_name not in FLOATS or not kinds <= {int, float}:
        return None
    try:
        made = np.array(values, np.float64)
    except OverflowError:
        return None
    finite = made[np.isfinite(made)]
    too_large = type_name == "float32" and np.abs(finite).max(initial=0.0) > LARGEST_FLOAT32
    return None if too_large else made.astype(layout)


def _each(values: list[Any], type_name: str, now: float, place: str) -> list[Any]:
    made = []
    for index, value in enumerate(values):
        try:
            made.append(_single(value, type_name, now, place))
        except CommandError:
            _single(value, type_name, now, f"{place}[{index}]")  # again, as to write the place for each would take long
            raise
    return made


def _single(value: Any, type_name: str, now: float, place: str) -> Any:
    if type_name in {MOMENT, SPAN}:
        return _moment(value, type_name, now, place)
    if "/" in type_name:
        return taken(value, type_name, now, place)
    if type_name == "string":
        return _text(value, place)
    if type_name == "bool":
        if not isinstance(value, bool):
            raise _wrong(place, value, "true or false")
        return value
    return _integer(value, type_name, place) if type_name in INTEGERS else _float(value, type_name, place)


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str):
        raise _wrong(place, value, "a string")
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise _wrong(place, ascii(value), "a string of whole characters") from error
    return value


def _integer(value: Any, type_name: str, place: str) -> int:
    low, high = INTEGERS[type_name]
    whole = isinstance(value, int) or (isinstance(value, float) and value.is_integer())
    if isinstance(value, bool) or not whole or not low <= value <= high:
        raise _wrong(place, value, f"{type_name}, a whole number from {low} to {high}")
    return int(value)


def _float(value: Any, type_name: str, place: str) -> float:
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(place, value, f"{type_name}, a number")
    try:
        number = float(value)
    except OverflowError as error:
        raise _wrong(place, value, f"{type_name}, a number") from error
    if type_name == "float32" and math.isfinite(number) and abs(number) > LARGEST_FLOAT32:
        raise _wrong(place, value, f"{type_name}, a number of at most {LARGEST_FLOAT32:.7g}")
    return number


def _moment(value: Any, type_name: str, now: float, place: str) -> Message:
    if value == "now" and type_name == MOMENT:
        return messages.stamp(now)
    if not isinstance(value, Mapping):
        raise _wrong(place, value, f"a {type_name}, {{secs, nsecs}}")
    moment = messages.stamp(0.0) if type_name == MOMENT else messages.duration(0.0)
    for name, number in value.items():
        if name not in PARTS:
            raise CommandError(f"{place}: a {type_name} has no field {_shown(name)}; known: secs, nsecs")
        whole = _integer(number, "int32", f"{place}.{name}")
        if type_name == MOMENT and whole < 0:
            raise _wrong(f"{place}.{name}", number, "a time of 0 or more")
        setattr(moment, PARTS[name], whole)
    return moment


def _decoded(text: str, place: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except ValueError as error:
        raise _wrong(place, text, f"base64 or a list of numbers ({error})") from error


def _wrong(place: str, value: Any, allowed: str) -> CommandError:
    return CommandError(f"{place}: invalid value {_shown(value)}; allowed: {allowed}")


def _shown(value: Any) -> str:
    """A value as far as it fits into a line."""
    text = _short.repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def _known(name: str, known: Mapping[str, Field]) -> str:
    close = nearest(name, known) if len(name) <= SHOWN else None
    return f"did you mean '{close}'?" if close else f"known: {', '.join(known) or 'none'}"
