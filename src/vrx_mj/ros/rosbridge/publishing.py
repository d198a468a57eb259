"""What a client publishes."""

import json
from dataclasses import dataclass
from typing import Any

from vrx_mj.errors import CommandError
from vrx_mj.ros.rosbridge.hub import Hub
from vrx_mj.ros.rosbridge.reading import taken
from vrx_mj.ros.rosbridge.writing import Parcel

__all__ = ["Publishing"]

MOST_TOPICS = 1024
MOST_LATCHED = 8 << 20
"""Characters of JSON of the messages that are kept for one client, at most."""


@dataclass
class Advertised:
    """A topic on which a client publishes."""

    type: str
    latch: bool
    told: bool = False
    """Whether the simulation knows that nobody listens."""
    kept: int = 0
    """Characters of the message that is kept."""


class Publishing:
    """A client's topics, by absolute name."""

    def __init__(self, hub: Hub, number: int, sender: str) -> None:
        self._hub = hub
        self._number = number
        self._sender = sender
        self._topics: dict[str, Advertised] = {}

    def has(self, name: str) -> bool:
        """Whether a topic is advertised."""
        return name in self._topics

    def advertise(self, name: str, type_name: str, latch: bool) -> None:
        """Say that this client publishes; CommandError: the topic has another type, or there are too many."""
        if name not in self._topics and len(self._topics) >= MOST_TOPICS:
            raise CommandError(f"advertise: this client has {MOST_TOPICS} topics; no more are accepted")
        self._hub.topics.join(name, type_name).publishers.add(self._number)
        self._topics[name] = Advertised(type_name, latch)

    def unadvertise(self, name: str) -> None:
        """Publish no more on a topic; CommandError: it is not advertised."""
        if self._topics.pop(name, None) is None:
            raise CommandError(f"unadvertise: {name} is not advertised by this client")
        self._hub.topics.retire(name, self._number)

    def publish(self, name: str, value: Any) -> None:
        """A message, to the simulation and to who listens; CommandError: it is no message of the topic's type."""
        topics, advertised = self._hub.topics, self._topics[name]
        type_name = topics.type_of(name) or advertised.type
        message = taken(value, type_name, self._hub.now, name)
        parcel = Parcel(message, type_name, self._hub.now)
        is_input = name in topics.table.inputs
        if is_input:
            self._hub.inbox.message(name, message, self._sender)
        heard = topics.send(name, parcel)
        if not is_input and not heard and not advertised.told:
            advertised.told = True
            self._hub.inbox.unknown_publisher(name, type_name, self._sender)
        if advertised.latch:
            self._keep(name, parcel, len(json.dumps(value)))

    def end(self) -> None:
        """The client has gone."""
        for name in self._topics:
            self._hub.topics.retire(name, self._number)
        self._topics.clear()

    def _keep(self, name: str, parcel: Parcel, size: int) -> None:
        others = sum(advertised.kept for other, advertised in self._topics.items() if other != name)
        if others + size > MOST_LATCHED:
            raise CommandError(f"publish: {name} is latched, but {MOST_LATCHED} characters are already kept")
        topic = self._hub.topics.find(name)
        if topic is not None:
            topic.latched[self._number] = parcel
            self._topics[name].kept = size
