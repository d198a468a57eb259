"""Names and parameters of ROS 1: the tree of values, and whom a change in it concerns."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple
from xmlrpc.client import Binary, DateTime

import numpy as np

from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.errors import CommandError

_INTEGERS = range(-(2**31), 2**31)
"""Integers of XML-RPC."""
MAX_NAME = 1024
"""Longest name [characters]."""
_LEGAL = re.compile(r"[~/A-Za-z][A-Za-z0-9_/]*\Z")
"""A legal name."""
_TYPE = re.compile(r"(\*|[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*)\Z")
"""A legal type."""

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 does not allow."""
MOST_BYTES = 1 << 26
"""Approximate limit of the size of all names and values together [bytes]."""
_MAX_DEPTH = 32
"""Largest depth of names in a key, and of lists and structures in a value."""


def is_legal(name: object) -> bool:
    """Whether something can name a topic, a service or a node."""
    return isinstance(name, str) and 0 < len(name) <= MAX_NAME and _LEGAL.match(name) is not None


def is_type(name: object) -> bool:
    """Whether something can name a type; `*` is any type."""
    return isinstance(name, str) and len(name) <= MAX_NAME and _TYPE.match(name) is not None


def join_names(*parts: str) -> str:
    """An absolute name without doubled or trailing slashes."""
    return "/" + "/".join(part for name in parts for part in name.split("/") if part)


def resolve(name: str, node: str) -> str:
    """The absolute name that a node means by a name."""
    if name.startswith("/"):
        return join_names(name)
    if name.startswith("~"):
        return join_names(node, name[1:])
    return join_names(node.rpartition("/")[0], name)


def command_topic(boat: str, command: str) -> str:
    """VRX's topic of a command of a boat, `/wamv/thrusters/left_thrust_cmd` for `left`."""
    thruster = command.removesuffix(ANGLE_SUFFIX)
    return f"/{boat}/thrusters/{thruster}{'_thrust_cmd' if thruster == command else '_thrust_angle'}"


class Update(NamedTuple):
    """Update that a subscriber of a parameter gets."""

    subscribed: str
    """Absolute name of the parameter or namespace."""
    key: str
    """Which one has changed; it ends with a slash, as ROS's master has it."""
    value: object
    """An empty dictionary if it is gone."""


class Parameters:
    """Parameters by absolute name; a namespace is a dictionary."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {}
        self._bytes = value_size(self.tree)

    def get(self, key: str) -> object:
        """The value, or the tree under a namespace; None for an unknown key."""
        value: object = self.tree
        for part in _parts(key):
            value = value.get(part) if isinstance(value, dict) else None
        return value

    def has(self, key: str) -> bool:
        """Whether there is such a parameter or namespace."""
        return self.get(key) is not None

    def set(self, key: str, value: object) -> None:
        """Set it; what was under this name is gone.

        Raises:
            CommandError: the root gets something else than a dictionary, the name is too deep, all is too much.
        """
        parts = _parts(key)
        if len(parts) > _MAX_DEPTH or (not parts and not isinstance(value, dict)):
            raise CommandError(
                f"cannot set {key[:100]}: the root must be a dictionary, with names of at most {_MAX_DEPTH} levels"
            )
        if self._bytes + value_size(value) > MOST_BYTES:
            raise CommandError(f"more than {MOST_BYTES} bytes of parameters")
        if not parts and isinstance(value, dict):
            self.tree, self._bytes = value, value_size(value)
            return
        place = self.tree
        for part in parts[:-1]:
            if not isinstance(place.get(part), dict):
                self._put(place, part, {})
            place = place[part]
        self._put(place, parts[-1], value)

    def delete(self, key: str) -> None:
        """Take it away; KeyError for an unknown key, or the root."""
        parts = _parts(key)
        if not parts:
            raise KeyError(key)
        place = self.get("/".join(parts[:-1]))
        if not isinstance(place, dict):
            raise KeyError(key)
        self._bytes -= len(parts[-1]) + value_size(place.pop(parts[-1]))

    def search(self, place: str, key: str) -> str | None:
        """Full name of a key as seen from a namespace: the nearest one upwards that has its first part."""
        if key.startswith("/"):
            return join_names(key) if self.has(key) else None
        parts, spaces = _parts(key), _parts(place)
        if not parts:
            return None
        for depth in range(len(spaces), -1, -1):
            if self.has(join_names(*spaces[:depth], parts[0])):
                return join_names(*spaces[:depth], *parts)
        return None

    def names(self) -> list[str]:
        """Absolute names of all that are no namespaces."""
        return [name for name, value in _walk("", self.tree) if not isinstance(value, dict)]

    def _put(self, place: dict[str, object], name: str, value: object) -> None:
        if name in place:
            self._bytes -= len(name) + value_size(place[name])
        self._bytes += len(name) + value_size(value)
        place[name] = value


def updates(subscribed: Iterable[str], key: str, value: object) -> list[Update]:
    """Whom it concerns that a parameter was set; of one that was deleted the value is an empty dictionary."""
    changed = _with_slash(key)
    below = (
        {_with_slash(join_names(key) + name): part for name, part in _walk("", value)}
        if isinstance(value, dict)
        else {}
    )
    found = []
    for name in subscribed:
        full = _with_slash(name)
        if changed.startswith(full):
            found.append(Update(name, changed, value))
        elif full in below:
            found.append(Update(name, full, below[full]))
        elif full.startswith(changed):
            found.append(Update(name, full, {}))
    return found


def _parts(key: str) -> list[str]:
    return [part for part in key.split("/") if part]


def _with_slash(name: str) -> str:
    clean = join_names(name)
    return clean if clean == "/" else f"{clean}/"


def _walk(place: str, tree: dict[str, object]) -> Iterator[tuple[str, object]]:
    """All names in a tree, namespaces included, and what they have."""
    for name, value in tree.items():
        full = f"{place}/{name}"
        yield full, value
        if isinstance(value, dict):
            yield from _walk(full, value)


def value_size(value: object) -> int:
    """Bytes that a value of XML-RPC takes, about."""
    if isinstance(value, dict):
        return 64 + sum(len(name) + value_size(part) for name, part in value.items())
    if isinstance(value, list | tuple):
        return 64 + sum(map(value_size, value))
    if isinstance(value, Binary):
        return 64 + len(value.data)
    return 64 + len(value) if isinstance(value, str) else 64


def plain(value: object, depth: int = 0) -> object:
    """A value as XML-RPC can carry it: whole numbers that are too large become floats.

    Raises:
        CommandError: it cannot.
    """
    if depth > _MAX_DEPTH:
        raise CommandError(f"a value is nested more than {_MAX_DEPTH} levels deep")
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(plain(str(name), depth)): plain(part, depth + 1) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part, depth + 1) for part in value]
    if isinstance(value, int) and value not in _INTEGERS:
        return float(value)
    if not isinstance(value, str | int | float | Binary | DateTime):
        raise CommandError(f"a {type(value).__name__} cannot be the value of a parameter")
    if isinstance(value, str) and (bad := _NO_XML.search(value)):
        raise CommandError(f"a value has the character U+{ord(bad.group()):04X}, which XML-RPC cannot carry")
    return value
