"""Topics: those of the table, and those that clients make among themselves."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from vrx_mj.errors import CommandError
from vrx_mj.ros.offer import Table
from vrx_mj.ros.rosbridge.kinds import ros1_name
from vrx_mj.ros.rosbridge.subscription import Subscription
from vrx_mj.ros.rosbridge.writing import Parcel

__all__ = ["ROSOUT", "Topic", "Topics"]

ROSOUT = "/rosout"
LOG = "rosgraph_msgs/Log"
MOST = 10_000
"""Topics that clients may bring, at most."""


@dataclass(eq=False)
class Topic:
    """What clients do with a topic; keys are their numbers."""

    type: str
    listeners: dict[int, list[Subscription]] = field(default_factory=dict)
    publishers: set[int] = field(default_factory=set)
    latched: dict[int, Parcel] = field(default_factory=dict)
    """The last messages of the clients that latch."""


class Topics:
    """All topics by absolute name."""

    def __init__(self) -> None:
        self.table = Table()
        self._topics: dict[str, Topic] = {}
        self._latched: dict[str, Parcel] = {}
        self.wanted: frozenset[str] = frozenset()
        """Outputs of the table that somebody listens to."""

    def offer(self, table: Table) -> None:
        """Have this table in place of the one before."""
        self.table = table
        self._latched = {name: parcel for name, parcel in self._latched.items() if name in table.outputs}
        self._want()

    def type_of(self, name: str) -> str | None:
        """A topic's type, where it is known."""
        for entries in (self.table.outputs, self.table.inputs):
            if name in entries:
                return ros1_name(entries[name].type)
        if name in self._topics:
            return self._topics[name].type
        return LOG if name == ROSOUT else None

    def all(self) -> dict[str, str]:
        """Every topic's type, by name."""
        names = {*self.table.outputs, *self.table.inputs, *self._topics, ROSOUT}
        return {name: self.type_of(name) or "" for name in sorted(names)}

    def find(self, name: str) -> Topic | None:
        """What clients do with a topic, if they do anything."""
        return self._topics.get(name)

    def clients(self) -> Iterator[tuple[str, Topic]]:
        """What clients do with every topic."""
        yield from self._topics.items()

    def join(self, name: str, type_name: str) -> Topic:
        """A topic, made where there is none; CommandError: it has another type."""
        known = self.type_of(name)
        if known is not None and known != type_name:
            raise CommandError(f"topic {name} is a {known}, not a {type_name}")
        if name not in self._topics:
            if len(self._topics) >= MOST:
                raise CommandError(f"topic {name}: there are already {MOST} topics; no more are accepted")
            self._topics[name] = Topic(type_name)
        return self._topics[name]

    def listen(self, name: str, topic: Topic, client: int, subscription: Subscription) -> list[Parcel]:
        """Have a client's subscription get a topic's messages; returns those that wait for late ones."""
        mine = topic.listeners.setdefault(client, [])
        if subscription not in mine:
            mine.append(subscription)
        self._want()
        own = [self._latched[name]] if name in self._latched else []
        return own + list(topic.latched.values())

    def leave(self, name: str, client: int, subscription: Subscription) -> None:
        """End a subscription."""
        topic = self._topics[name]
        topic.listeners[client].remove(subscription)
        if not topic.listeners[client]:
            del topic.listeners[client]
        self._tidy(name, topic)

    def retire(self, name: str, client: int) -> None:
        """A client publishes no more."""
        topic = self._topics[name]
        topic.publishers.discard(client)
        topic.latched.pop(client, None)
        self._tidy(name, topic)

    def send(self, name: str, parcel: Parcel) -> bool:
        """Give a message to who listens; whether anybody does."""
        topic = self._topics.get(name)
        if topic is None or not topic.listeners:
            return False
        for subscriptions in topic.listeners.values():
            for subscription in subscriptions:
                subscription.take(parcel)
        return True

    def keep(self, name: str, parcel: Parcel) -> None:
        """Keep a message of the simulation for who listens later."""
        if name in self.table.outputs:
            self._latched[name] = parcel

    def _tidy(self, name: str, topic: Topic) -> None:
        if not topic.listeners and not topic.publishers:
            del self._topics[name]
        self._want()

    def _want(self) -> None:
        listened = {name for name, topic in self._topics.items() if topic.listeners}
        self.wanted = frozenset(listened & self.table.outputs.keys())
