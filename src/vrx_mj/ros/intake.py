"""What comes in from many connections and is not done with: where it is too much, those that hold it longest go."""

from collections import Counter, OrderedDict
from collections.abc import Callable

from vrx_mj.errors import CommandError

__all__ = ["SMALL", "Intake", "Place"]

SMALL = 1 << 16
"""Bytes that a connection may hold while others hold more."""


class Place:
    """What one connection takes of what is bounded."""

    __slots__ = ("end", "host")

    def __init__(self, host: str, end: Callable[[], object]) -> None:
        self.host = host
        """The peer's address."""
        self.end = end
        """Closes the connection at once."""


class Intake:
    """Bytes that have come and are not done with, of all connections together.

    Only what came counts, whatever was announced. Where it is too much, the host that holds most has to give: of its
    connections that which holds more than a little for longest.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self.used = 0
        self._held: dict[str, OrderedDict[Place, int]] = {}
        """By host, those that began to hold something first come first."""
        self._totals: Counter[str] = Counter()

    def hold(self, place: Place, size: int) -> None:
        """A connection now holds so many bytes.

        Raises:
            CommandError: all hold too much, and this one has to go.
        """
        held = self._held.setdefault(place.host, OrderedDict())
        change = size - held.get(place, 0)
        self.used += change
        self._totals[place.host] += change
        if size:
            held[place] = size
        else:
            held.pop(place, None)
            if not held:
                del self._held[place.host], self._totals[place.host]
        while self.used > self.most:
            victim = self._victim()
            self.hold(victim, 0)
            if victim is place:
                raise CommandError(f"more than {self.most} bytes of incomplete messages")
            victim.end()

    def _victim(self) -> Place:
        host = max(self._totals, key=lambda name: self._totals[name])
        held = self._held[host]
        return next((place for place, size in held.items() if size > SMALL), None) or next(iter(held))
