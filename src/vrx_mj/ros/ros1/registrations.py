"""Who publishes, subscribes and serves what, as a ROS 1 master knows it."""

from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

from vrx_mj.errors import CommandError

__all__ = ["KINDS", "Registrations"]

KINDS = ("publisher", "subscriber", "service", "parameter")
MOST = 100_000
"""Registrations, at most."""


class _Entry(NamedTuple):
    node: str
    api: str
    """Of a service its own, of all else that of the node."""


class Registrations:
    """Nodes by name, and what each has registered."""

    def __init__(self, replaced: Callable[[str, str, list[tuple[str, str]]], None]) -> None:
        self.nodes: dict[str, str] = {}
        """URI by node's name."""
        self._replaced = replaced
        self._entries: dict[str, dict[str, list[_Entry]]] = {kind: {} for kind in KINDS}
        self._held: Counter[str] = Counter()

    def add(self, kind: str, key: str, node: str, node_api: str, api: str = "") -> None:
        """Register. A node that had another URI is forgotten first.

        `replaced` is then called with its name, its old URI, and the kinds and names of what it had registered.

        Raises:
            CommandError: there are too many.
        """
        if self._held.total() >= MOST:
            raise CommandError(f"more than {MOST} registrations")
        old = self.nodes.get(node)
        if old is not None and old != node_api:
            self._replaced(node, old, self.forget(node))
        self.nodes[node] = node_api
        entries = self._entries[kind].setdefault(key, [])
        entry = _Entry(node, api or node_api)
        if kind == "service":
            for other in [other for other in entries if other != entry]:  # the last one to register it has it
                self.remove(kind, key, other.node, other.api)
            entries = self._entries[kind].setdefault(key, [])
        if entry not in entries:
            entries.append(entry)
            self._held[node] += 1

    def remove(self, kind: str, key: str, node: str, api: str) -> int:
        """Take back; returns how many that were."""
        entries = self._entries[kind].get(key, [])
        if _Entry(node, api) not in entries:
            return 0
        entries.remove(_Entry(node, api))
        self._held[node] -= 1
        if not entries:
            del self._entries[kind][key]
        if not self._held[node]:
            del self._held[node]
            self.nodes.pop(node, None)
        return 1

    def forget(self, node: str) -> list[tuple[str, str]]:
        """Take back all that a node has registered; returns kinds and names."""
        gone = [(kind, key, entry) for (kind, key), entry in self._all() if entry.node == node]
        for kind, key, entry in gone:
            entries = self._entries[kind][key]
            entries.remove(entry)
            if not entries:
                del self._entries[kind][key]
        del self._held[node]
        self.nodes.pop(node, None)
        return [(kind, key) for kind, key, _ in gone]

    def apis(self, kind: str, key: str) -> list[str]:
        """URIs that are registered under a name."""
        return [entry.api for entry in self._entries[kind].get(key, [])]

    def names(self, kind: str) -> list[str]:
        """All names of a kind."""
        return list(self._entries[kind])

    def holders(self, kind: str, key: str) -> list[tuple[str, str]]:
        """Nodes and URIs that are registered under a name."""
        return [(entry.node, entry.api) for entry in self._entries[kind].get(key, [])]

    def state(self, kind: str) -> list[list[object]]:
        """Names with their nodes, as `getSystemState` has it."""
        return [[key, [entry.node for entry in entries]] for key, entries in self._entries[kind].items()]

    def _all(self) -> Iterator[tuple[tuple[str, str], _Entry]]:
        for kind, keys in self._entries.items():
            for key, entries in keys.items():
                for entry in entries:
                    yield (kind, key), entry
