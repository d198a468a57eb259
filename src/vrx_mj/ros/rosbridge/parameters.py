"""Parameters: those of the table, and over them what clients have set."""

import json
from collections.abc import Mapping
from typing import Any

from vrx_mj.errors import CommandError

__all__ = ["Parameters"]

MOST = 1024
"""Parameters that clients may set."""
MOST_TEXT = 1 << 20
"""Characters of JSON in all of them."""


class Parameters:
    """Values by absolute name; a mapping is a namespace, and is kept as the values in it."""

    def __init__(self) -> None:
        self._table: dict[str, Any] = {}
        self._set: dict[str, Any] = {}
        self._all: dict[str, Any] = {}

    def offer(self, table: Mapping[str, Any]) -> None:
        """Have these in place of those of the table before."""
        self._table = _flat(table)
        self._all = self._table | self._set

    def names(self) -> list[str]:
        """All, in order."""
        return sorted(self._all)

    def has(self, name: str) -> bool:
        """Whether there is such a parameter or namespace."""
        return any(_within(key, name) for key in self._all)

    def get(self, name: str) -> Any:
        """A value, or a mapping of what is in a namespace; KeyError where there is neither."""
        if name in self._all:
            return self._all[name]
        prefix = f"{name.rstrip('/')}/"
        found = {key[len(prefix) :]: value for key, value in self._all.items() if key.startswith(prefix)}
        if not found:
            raise KeyError(name)
        return _nested(found)

    def set(self, name: str, value: Any) -> None:
        """Set one, whatever it was; CommandError: there are too many, or too long ones."""
        kept = {key: old for key, old in self._set.items() if not _within(key, name) and not _within(name, key)}
        chosen = kept | _flat({name: value})
        if len(chosen) > MOST:
            raise CommandError(f"{name}: {len(chosen)} parameters would be set by clients; at most {MOST}")
        text = sum(len(key) + len(json.dumps(part)) for key, part in chosen.items())
        if text > MOST_TEXT:
            raise CommandError(f"{name}: {text} characters would be set by clients; at most {MOST_TEXT}")
        self._set = chosen
        self._all = self._table | self._set

    def delete(self, name: str) -> None:
        """Delete what clients have set there; CommandError: nothing is set, or by the simulation alone."""
        kept = {key: value for key, value in self._set.items() if not _within(key, name)}
        if len(kept) == len(self._set):
            if self.has(name):
                raise CommandError(f"{name}: the parameter belongs to the simulation and cannot be deleted")
            raise CommandError(f"{name}: no such parameter")
        self._set = kept
        self._all = self._table | self._set

    def search(self, name: str, namespace: str) -> str | None:
        """The absolute name of one that is in a namespace or around it, the nearest first."""
        parts = [part for part in namespace.split("/") if part]
        for count in range(len(parts), -1, -1):
            candidate = "/" + "/".join([*parts[:count], name.strip("/")])
            if self.has(candidate):
                return candidate
        return None


def _within(name: str, namespace: str) -> bool:
    return name == namespace or name.startswith(f"{namespace.rstrip('/')}/")


def _flat(values: Mapping[str, Any]) -> dict[str, Any]:
    """Every value that is no namespace, by its whole name."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping) and value:
            flat.update({f"{name.rstrip('/')}/{key}": part for key, part in _flat(value).items()})
        else:
            flat[name] = value
    return flat


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for name in sorted(flat):  # a value before what is in a namespace of its name, which wins
        *path, last = name.split("/")
        place = tree
        for part in path:
            inner = place.get(part)
            if not isinstance(inner, dict):
                inner = place[part] = {}
            place = inner
        place[last] = flat[name]
    return tree
