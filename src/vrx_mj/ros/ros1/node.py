"""ROS 1 without ROS: a table offered by a node of our own, on the master that there is or on one of our own."""

import asyncio
import contextlib
import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from vrx_mj.errors import CommandError, NetworkError, VrxError
from vrx_mj.ros.access import addresses, announced, bound, is_local, own_names
from vrx_mj.ros.inbox import Answer, Inbox
from vrx_mj.ros.limits import ConnectionLimit, Intake, Place
from vrx_mj.ros.messages import Message, is_known
from vrx_mj.ros.network import Network, Notices
from vrx_mj.ros.offer import Input, Output, Sent, Service, Table, Traffic
from vrx_mj.ros.ros1.connection import encode_header
from vrx_mj.ros.ros1.http_server import HttpServer
from vrx_mj.ros.ros1.publication import Caller, Provided, Publication, Reader, Role, Stream, TcprosListener
from vrx_mj.ros.ros1.registrar import Graph, Registrar, State, is_ours, open_graph
from vrx_mj.ros.ros1.slave import Rosout, Slave, Watch
from vrx_mj.ros.ros1.subscription import MOST_PUBLISHERS, Subscription
from vrx_mj.ros.ros1.xmlrpc import address, plain

__all__ = ["Node", "Ros1"]

INCOMING_BYTES = 1 << 27
"""Bytes of messages and requests that have begun to come, of all together."""
EMPTY = Table()


class Node:
    """The node."""

    def __init__(
        self,
        name: str,
        master_uri: str,
        graph: Graph,
        network: Network,
        inbox: Inbox,
        connection_limit: ConnectionLimit,
        notices: Notices,
    ) -> None:
        self.name, self.master_uri = name, master_uri
        self.inbox, self.network, self.notices = inbox, network, notices
        self.wanted: frozenset[str] = frozenset()
        self.stream = Stream(name)
        self.rosout = Rosout(self.stream)
        self.publications = {self.rosout.publication.name: self.rosout.publication}
        self.subscriptions: dict[str, Subscription] = {}
        self.provided: dict[str, Provided] = {}
        self.slave = Slave(name, master_uri, self.publications, self.subscriptions, notices)
        self.slave.is_masters_own = graph.master is not None
        self.tcpros_listener = TcprosListener(
            self._meet, connection_limit, Intake(INCOMING_BYTES), notices, self._changed
        )
        self.api = HttpServer(f"node {name}", self.slave.answer, connection_limit, notices, graph.names)
        self.registrar = Registrar(name, master_uri, graph.link, notices)
        self.watch = Watch(name, graph.link, inbox, notices, self.publications)
        self._table = EMPTY
        self._closing: set[asyncio.Task[None]] = set()
        self._task: asyncio.Task[None] | None = None

    async def start(self, hosts: Sequence[str], announced: str) -> None:
        """Listen at addresses, and tell others of one. OSError: that cannot be done."""
        self.slave.stream = announced, await self.tcpros_listener.start(hosts)
        self.slave.uri = f"http://{announced}:{await self.api.start(hosts, 0)}/"
        self.watch.announced = announced
        masters = set(addresses(address(self.master_uri)[0]))
        self.slave.trusted = lambda host: host in masters or is_local(host)
        self.registrar.publishers = self._found_publishers
        self.registrar.seen = self._seen
        self.registrar.api, self.registrar.replaced = self.slave.uri, self.slave.end
        for name, (kind, call) in self.rosout.services.items():
            self.provided[name] = Provided(self.name, name, kind, call)
        self._wish()
        self._task = asyncio.get_running_loop().create_task(self.registrar.run())

    async def close(self) -> None:
        """Withdraw all and close all connections."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        await self.registrar.withdraw()
        await self.watch.close()
        await asyncio.gather(*(topic.close() for topic in self.subscriptions.values()), *self._closing)
        await self.tcpros_listener.close()
        await self.api.close()

    def apply(self, table: Table) -> None:
        """Offer what is in a table, and nothing else; what stays keeps its connections."""
        table = self._known(table)
        for name, topic in list(self.publications.items()):
            output = table.outputs.get(name)
            if topic is not self.rosout.publication and (
                output is None or (output.type, output.latched) != (topic.type, topic.latched)
            ):
                self.publications.pop(name).close()
        for name, listening in list(self.subscriptions.items()):
            if name not in table.inputs or table.inputs[name].type != listening.type:
                self._begin(self.subscriptions.pop(name).close())
        for name, service in list(self.provided.items()):
            if name not in self.rosout.services and (
                name not in table.services or table.services[name].type != service.type
            ):
                self.provided.pop(name).close()
        self._add(table)
        self._table = table
        self._wish()
        self._changed()

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send messages to who listens."""
        for sent in batch:
            self.rosout.time = sent.time
            topic = self.publications.get(sent.output.name)
            if topic is None:
                continue
            try:
                topic.send(sent.message)
            except Exception as error:  # whatever rosbags raises of a message that is none
                self.notices.tell("ERROR", "encode", topic.name, f"{topic.name}: a message cannot be written: {error}")

    @property
    def clients(self) -> int:
        """Connections that are open; safe to ask from any thread."""
        return len(self.tcpros_listener.inside) + sum(
            source.receiver is not None
            for topic in list(self.subscriptions.values())
            for source in list(topic.sources.values())
        )

    def _known(self, table: Table) -> Table:
        """The table without what has a type that nobody knows, which is told."""
        every: list[Output | Input | Service] = [*table.outputs.values(), *table.inputs.values()]
        for one in every + list(table.services.values()):
            if not _has_type(one):
                self.notices.tell("ERROR", "type", one.name, f"{one.name}: unknown type {one.type}")
        return Table(
            {name: one for name, one in table.outputs.items() if _has_type(one)},
            {name: one for name, one in table.inputs.items() if _has_type(one)},
            {name: one for name, one in table.services.items() if _has_type(one)},
            table.parameters,
        )

    def _add(self, table: Table) -> None:
        """What is new in a table."""
        for name, output in table.outputs.items():
            if name not in self.publications:
                self.publications[name] = Publication(self.stream, name, output.type, latched=output.latched)
        for name, wanted in table.inputs.items():
            if name not in self.subscriptions:
                self.subscriptions[name] = Subscription(
                    self.name, name, wanted.type, self.inbox.message, self.tcpros_listener.intake, self.notices
                )
        for name, service in table.services.items():
            if name not in self.provided:
                self.provided[name] = Provided(self.name, name, service.type, self._calls(name))

    def _calls(self, name: str) -> Callable[[Message, str, Answer], None]:
        return lambda request, caller, answer: self.inbox.call(name, request, caller, answer)

    def _wish(self) -> None:
        """Tell the registrar what there is now."""
        uri, (host, port) = self.slave.uri, self.slave.stream
        wished = {("publisher", topic.name): [topic.type, uri] for topic in self.publications.values()}
        wished |= {("subscriber", topic.name): [topic.type, uri] for topic in self.subscriptions.values()}
        wished |= {("service", name): [f"rosrpc://{host}:{port}", uri] for name in self.provided}
        self.registrar.wished = wished
        self.registrar.parameters = self._parameters()
        self.registrar.settled.clear()
        self.registrar.wake.set()

    def _parameters(self) -> dict[str, Any]:
        found = {}
        for name, value in self._table.parameters.items():
            try:
                found[name] = plain(value)
            except VrxError as error:
                self.notices.tell("ERROR", "parameter", name, f"parameter {name}: {error}")
        return found

    def _meet(self, header: Mapping[str, str], transport: asyncio.Transport, place: Place) -> Role | None:
        """Whoever has connected wants to subscribe or to call."""
        if "topic" in header:
            return self._meet_reader(header, transport)
        service = self.provided.get(header.get("service", ""))
        if service is None:
            raise CommandError(f"[{self.name}] is not a provider of [{header.get('service', '')[:100]}]")
        why = service.refusal(header)
        if why is not None:
            raise CommandError(why)
        transport.write(encode_header(service.reply()))
        if header.get("probe") == "1":
            return None
        return Caller(service, transport, header, self.network, self.tcpros_listener.intake, place)

    def _meet_reader(self, header: Mapping[str, str], transport: asyncio.Transport) -> Reader:
        topic = self.publications.get(header["topic"])
        if topic is None:
            raise CommandError(f"[{self.name}] is not a publisher of [{header['topic'][:100]}]")
        why = topic.refusal(header)
        if why is not None:
            raise CommandError(why)
        transport.write(encode_header(topic.reply()))
        reader = Reader(topic, transport, header)
        topic.join(reader)
        return reader

    def _changed(self) -> None:
        """Somebody has come or gone."""
        self.wanted = frozenset(name for name, topic in self.publications.items() if topic.readers)

    def _found_publishers(self, topic: str, uris: Sequence[str]) -> None:
        if topic in self.subscriptions:
            self.subscriptions[topic].update(uris)

    def _seen(self, state: State) -> None:
        for name, topic in self.subscriptions.items():
            count = len(state[0].get(name, []))
            if count != len(topic.sources) and count <= MOST_PUBLISHERS:
                self.registrar.forget(name)  # the master's news did not reach us: ask
        self.watch.look(state, self.subscriptions)

    def _begin(self, work: Any) -> None:
        task: asyncio.Task[None] = asyncio.get_running_loop().create_task(work)
        self._closing.add(task)
        task.add_done_callback(self._closing.discard)


def _has_type(one: Output | Input | Service) -> bool:
    return (
        is_known(f"{one.type}Request") and is_known(f"{one.type}Response")
        if isinstance(one, Service)
        else is_known(one.type)
    )


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
