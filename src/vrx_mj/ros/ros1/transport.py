"""ROS 1 without ROS: a table offered by a node of our own, on the master that there is or on one of our own."""

import asyncio
import contextlib
import os
from collections import deque
from collections.abc import Callable, Sequence

from vrx_mj.errors import NetworkError
from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.network import Network
from vrx_mj.ros.offer import Sent, Table, Traffic
from vrx_mj.ros.ros1.address import announced, bound, own_names
from vrx_mj.ros.ros1.connection_limit import ConnectionLimit
from vrx_mj.ros.ros1.graph import Graph, is_ours, open_graph
from vrx_mj.ros.ros1.node import Node
from vrx_mj.ros.ros1.notices import Notices

__all__ = ["Ros1"]

DEFAULT_MASTER = "http://localhost:11311"
OPENING = 15.0
"""Wall time to find the master and to register [s]."""
CLOSING = 2.0
MOST_BATCHES = 64
"""Batches that wait for the network's thread; the oldest goes first."""


class Ros1:
    """A `Transport` (see `vrx_mj.ros.offer`)."""

    title = "ROS 1"

    def __init__(
        self,
        network: Network,
        inbox: Inbox,
        *,
        master_uri: str | None = None,
        host: str = "127.0.0.1",
        node: str = "/gazebo",
    ) -> None:
        self.master_uri = (master_uri or os.environ.get("ROS_MASTER_URI") or DEFAULT_MASTER).rstrip("/")
        self.on_shutdown: Callable[[str], None] | None = None
        """Called by the network's thread with the reason when `rosnode kill` or the master ends our node."""
        self.notices = Notices()
        """What goes wrong on the network; `notices.listener` may be set."""
        self._network, self._inbox, self._host, self._name = network, inbox, host, node
        self._connection_limit = ConnectionLimit()
        self._graph: Graph | None = None
        self._node: Node | None = None
        self._batches: deque[Sequence[Sent]] = deque()
        self._lost = 0

    def start(self) -> Sequence[str]:
        """Find the master or become it, and open the node; returns lines that say where that is.

        Raises:
            NetworkError: that cannot be done, and why.
        """
        try:
            return self._network.call(self._open(), OPENING)
        except TimeoutError:
            raise NetworkError(f"{self.master_uri} does not answer within {OPENING:.0f} s") from None

    def offer(self, table: Table) -> None:
        """Offer this table from now on, and nothing else."""
        self._network.soon(self._apply, table)

    @property
    def wanted(self) -> frozenset[str]:
        """Topics that have a subscriber now."""
        return frozenset() if self._node is None else self._node.wanted

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send messages of one moment; they must not change afterwards."""
        if len(self._batches) >= MOST_BATCHES:
            self._shed()
        self._batches.append(batch)
        self._network.soon(self._send)

    def log(self, level: str, text: str) -> None:
        """A line on /rosout."""
        self._network.soon(self._say, level, text)

    @property
    def traffic(self) -> Traffic:
        """Connections now, bytes sent, messages dropped."""
        if self._node is None:
            return Traffic(0, 0, self._lost)
        return Traffic(self._node.clients, self._node.stream.sent, self._node.stream.dropped + self._lost)

    def close(self) -> None:
        """Withdraw all, and close every connection. Nothing happens where there is nothing to close."""
        if self._graph is not None:
            with contextlib.suppress(TimeoutError):
                self._network.call(self._end(), CLOSING)

    def settle(self, timeout: float = 5.0) -> None:
        """Wait until the master knows all that is offered; TimeoutError: it does not, so long [s]."""
        if self._node is not None:
            self._network.call(self._settled(self._node), timeout)

    def _shed(self) -> None:
        """Throw the oldest batches away, but for the newest message of each latched topic."""
        kept: dict[str, Sent] = {}
        with contextlib.suppress(IndexError):  # the network's thread takes from the same end
            while len(self._batches) >= MOST_BATCHES - 1:
                batch = self._batches.popleft()
                self._lost += len(batch) + len(kept)
                kept |= {sent.output.name: sent for sent in batch if sent.output.latched}
                self._lost -= len(kept)
        if kept:
            self._batches.appendleft(list(kept.values()))

    async def _open(self) -> Sequence[str]:
        names = own_names(self._host, self.master_uri)
        graph = await open_graph(self.master_uri, self._host, self._name, self._connection_limit, self.notices, names)
        where = announced(self._host, graph.host)
        node = Node(
            self._name, self.master_uri, graph, self._network, self._inbox, self._connection_limit, self.notices
        )
        try:
            await node.start(bound(self._host), where)
        except OSError as error:
            await node.close()
            await graph.close()
            raise NetworkError(f"ROS 1: cannot listen at {self._host}: {error}") from error
        node.slave.on_shutdown = self._told_to_end
        self._graph, self._node = graph, node
        if graph.master is not None:
            graph.master.changed = node.registrar.wake
        self.notices.listener = self._say
        own = "own master" if graph.master is not None else "the master"
        lines = [f"ROS 1: {own} at {self.master_uri}, node {self._name} at {node.slave.uri}"]
        if not is_ours(where, bound(self._host)):
            lines.append(
                f"ROS 1: nodes get the address {where} (ROS_HOSTNAME or ROS_IP), but this server listens at "
                f"{', '.join(bound(self._host))} only: give --host {where} or --host 0.0.0.0"
            )
        return lines

    async def _end(self) -> None:
        self.notices.listener = None
        node, graph = self._node, self._graph
        self._node = self._graph = None
        if node is not None:
            await node.close()
        if graph is not None:
            await graph.close()
        for _ in range(3):  # what was aborted is closed in the loop's next turns
            await asyncio.sleep(0)

    async def _settled(self, node: Node) -> None:
        await node.registrar.settled.wait()

    def _apply(self, table: Table) -> None:
        if self._node is not None:
            self._node.apply(table)

    def _send(self) -> None:
        with contextlib.suppress(IndexError):
            batch = self._batches.popleft()
            if self._node is not None:
                self._node.publish(batch)

    def _say(self, level: str, text: str) -> None:
        if self._node is not None:
            self._node.rosout.log(level, text)

    def _told_to_end(self, reason: str) -> None:
        if self.on_shutdown is not None:
            self.on_shutdown(reason)
