"""What all clients share."""

import itertools
from typing import Protocol

from vrx_mj.ros.graph import Graph
from vrx_mj.ros.limits import ClientPace, Counts, Intake
from vrx_mj.ros.network import Notices
from vrx_mj.ros.rosbridge.rosapi import Rosapi
from vrx_mj.ros.rosbridge.topics import Services, Topics

__all__ = ["Hub"]

MOST_FRAGMENTS = 1 << 25
"""Characters of all clients' fragments that wait for the rest of their messages, at most."""


class Ending(Protocol):
    """A client, as far as the hub is concerned."""

    host: str
    """The peer's address."""
    is_silent: bool
    """Whether it has said nothing yet."""

    def abort(self) -> None:
        """End its connection at once."""


class Hub:
    """The graph as clients have it, and who is there."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.counts = Counts()
        self.flooding: set[ClientPace] = set()
        self.fragments = Intake(MOST_FRAGMENTS)
        self.topics = Topics(graph)
        self.services = Services(graph)
        self.clients: dict[int, Ending] = {}
        self.numbers = itertools.count(1)
        self._notices = Notices()
        self._rosapi = Rosapi(graph, self.services)

    def open(self) -> None:
        """Show the graph to clients, and them to it."""
        self.graph.wires.append(self.topics)
        self._rosapi.provide()

    def tell_once(self, peer: str, kind: str, text: str) -> None:
        """Warn people, once for a peer and kind of mistake."""
        self._notices.tell("WARN", kind, peer, f"rosbridge: {peer}: {text}")
