"""The fields of a client's messages, checked: names, texts and numbers of the protocol's operations."""

import json
import re
import reprlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from vrx_mj.errors import CommandError

MOST_INCOMING = 4 << 20
"""Bytes of a message from a client, at most; put together from its fragments also."""
_MOST_TEXT = 256
"""Characters of a name, a type or an id, at most."""
_MOST_QUEUE = 1000
_COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
_NAME = re.compile(r"/?[A-Za-z][A-Za-z0-9_/]*")

Operation = Mapping[str, Any]
"""A client's message."""


class Options(NamedTuple):
    """How a client wants messages."""

    throttle: float = 0.0
    """Wall time between two, at least [s]."""
    queue: int = 0
    """How many may wait, at most; 0: as many as the client's queue holds."""
    fragment_size: int = 0
    """Characters; 0: whole."""
    compression: str = "none"


def operation(data: str | bytes) -> Operation:
    """A message from its text.

    Raises:
        CommandError: it is not a JSON object with an operation.
    """
    try:
        made = json.loads(data)
    except (ValueError, RecursionError) as error:
        start = reprlib.repr(data if isinstance(data, str) else bytes(data))
        raise CommandError(f"a message is not JSON: {error}; it starts with {start}") from error
    if not isinstance(made, dict) or not isinstance(made.get("op"), str):
        raise CommandError(f"a message must be a JSON object with a string 'op', got {reprlib.repr(made)}")
    return made


def text(message: Operation, key: str, default: str | None = None) -> str:
    """A string of an operation; without a default it has to be there."""
    value = message.get(key, default)
    if value is None:
        value = default
    if not isinstance(value, str):
        missing = "is missing" if key not in message else f"{reprlib.repr(value)} is not a string"
        raise CommandError(f"{message['op']}: {key} {missing}")
    if len(value) > _MOST_TEXT:
        raise CommandError(f"{message['op']}: {key} has {len(value)} characters; at most {_MOST_TEXT}")
    return value


def number(message: Operation, key: str, largest: float, default: float = 0.0) -> float:
    """A number of an operation from 0 on."""
    value = message.get(key)
    if value is None:
        return default
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= largest:
        raise CommandError(
            f"{message['op']}: invalid {key} {reprlib.repr(value)}; allowed: a number from 0 to {largest:g}"
        )
    return float(value)


def flag(message: Operation, key: str, default: bool) -> bool:
    """A truth value of an operation."""
    value = message.get(key)
    if value is None:
        return default
    if not isinstance(value, bool):
        raise CommandError(f"{message['op']}: invalid {key} {reprlib.repr(value)}; allowed: true, false")
    return value


def options(message: Operation) -> Options:
    """How a subscription or a call wants to be answered."""
    compression = text(message, "compression", "none")
    if compression not in _COMPRESSIONS:
        known = ", ".join(_COMPRESSIONS)
        raise CommandError(f"{message['op']}: invalid compression {compression!r}; allowed: {known}")
    return Options(
        throttle=number(message, "throttle_rate", 1e9) / 1000.0,
        queue=min(int(number(message, "queue_length", 1e9)), _MOST_QUEUE),
        fragment_size=int(number(message, "fragment_size", 1e9)),
        compression=compression,
    )


def absolute(name: str) -> str:
    """A topic's, service's or parameter's name with its slash; CommandError: it is invalid."""
    if _NAME.fullmatch(name) is None or len(name) > _MOST_TEXT:
        raise CommandError(
            f"{name[:_MOST_TEXT]!r} is not a name: at most {_MOST_TEXT} letters, digits, '_' and '/', a letter first"
        )
    return "/" + "/".join(part for part in name.split("/") if part)
