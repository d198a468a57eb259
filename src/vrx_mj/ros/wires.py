"""The simulation's end of the graph: what it publishes goes through one queue to the network's thread."""

from collections.abc import Sequence
from typing import Protocol

from vrx_mj.ros.graph import Graph
from vrx_mj.ros.limits import TopicQueue
from vrx_mj.ros.offer import Sent, Table, Traffic

__all__ = ["Server", "Wires"]


class Server(Protocol):
    """One wire, as the simulation's thread has it."""

    @property
    def traffic(self) -> Traffic:
        """What it has carried."""

    def start(self) -> Sequence[str]:
        """Open it; returns lines that tell people where it is. NetworkError: it cannot be opened, and why."""

    def close(self) -> None:
        """Withdraw all, and close every connection."""


class Wires:
    """A `Transport` (see `vrx_mj.ros.offer`) of one graph and all wires on which it is shown.

    Messages that it is given are written later, in the network's thread: they must not be changed after `publish`.
    """

    title = "ROS"

    def __init__(self, graph: Graph, servers: Sequence[Server]) -> None:
        self.graph, self.servers = graph, servers
        self._queue = TopicQueue()
        self._dropped = 0

    def start(self) -> Sequence[str]:
        """Open every wire; NetworkError: one cannot be opened, and why."""
        return [line for server in self.servers for line in server.start()]

    def offer(self, table: Table) -> None:
        """Offer this table from now on, and nothing else."""
        self._dropped += self._queue.dropped
        self._queue = TopicQueue()  # what was published before goes before it
        self.graph.network.soon(self.graph.offer, table)

    @property
    def wanted(self) -> frozenset[str]:
        """Names of the outputs that somebody listens to now."""
        return self.graph.wanted

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send messages of one moment to who listens."""
        if self._queue.put(batch):
            self.graph.network.soon(self._send, self._queue)

    def log(self, level: str, text: str) -> None:
        """Tell people on the networks a line: `INFO`, `WARN` or `ERROR`."""
        self.graph.network.soon(self.graph.log, level, text)

    @property
    def traffic(self) -> Traffic:
        """What all wires have carried."""
        clients, sent, dropped = map(sum, zip((0, 0, 0), *(server.traffic for server in self.servers), strict=True))
        return Traffic(clients, sent, dropped + self._dropped + self._queue.dropped)

    def close(self) -> None:
        """Withdraw all, close every connection, and wait until that is done."""
        for server in reversed(self.servers):
            server.close()

    def _send(self, queue: TopicQueue) -> None:
        for sent in queue.take():
            self.graph.send(sent)
