"""ROS 1 without ROS: the graph on TCPROS, with the master that there is or with one of our own."""

import asyncio
import contextlib
import os
from collections.abc import Callable, Coroutine, Mapping, Sequence

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.access import addresses, announced, bound, is_local, own_names
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Traffic
from vrx_mj.ros.limits import ConnectionLimit, Intake, Place
from vrx_mj.ros.messages import Message
from vrx_mj.ros.ros1.connection import encode_header
from vrx_mj.ros.ros1.http_server import HttpServer
from vrx_mj.ros.ros1.publication import Caller, Provided, Publication, Reader, Role, Stream, TcprosListener
from vrx_mj.ros.ros1.registrar import MasterAccess, Registrar, SystemState, is_ours, open_master
from vrx_mj.ros.ros1.slave import Slave, Watch
from vrx_mj.ros.ros1.subscription import MOST_PUBLISHERS, Subscription, call_service
from vrx_mj.ros.ros1.xmlrpc import address

__all__ = ["Node", "Ros1"]

INCOMING_BYTES = 1 << 27
"""Bytes of messages and requests that have begun to come, of all together."""
MOST_SOURCES = 1024
"""Connections to publishers of other processes, at most."""
MOST_LATCHED = 64
"""Latched messages of other processes that are kept, at most."""
DEFAULT_MASTER = "http://localhost:11311"
OPEN_TIMEOUT = 15.0
"""Wall time to find the master and to register [s]."""
CLOSE_TIMEOUT = 2.0


class Node:
    """The nodes of this process on TCPROS: a `Wire` (see `vrx_mj.ros.graph`), in the network's thread."""

    def __init__(self, graph: Graph, access: MasterAccess, master_uri: str, connection_limit: ConnectionLimit) -> None:
        self.graph, self.master_uri, self._access = graph, master_uri, access
        self.listened: frozenset[str] = frozenset()
        name, notices = graph.node, graph.notices
        self.stream = Stream(name)
        self.publications: dict[str, Publication] = {}
        self.subscriptions: dict[str, Subscription] = {}
        self.provided: dict[str, Provided] = {}
        self.slave = Slave(name, master_uri, self.publications, self.subscriptions, notices)
        self.slave.is_masters_own = access.master is not None
        self.tcpros_listener = TcprosListener(
            self._meet, connection_limit, Intake(INCOMING_BYTES), notices, self._changed
        )
        self.api = HttpServer(f"node {name}", self.slave.answer, connection_limit, notices, access.names)
        self.registrar = Registrar(name, master_uri, access.link, notices)
        self.watch = Watch(graph, access.link, self.publications)
        self._kept: set[tuple[str, str]] = set()
        """Topics and nodes of other processes whose last message is kept."""
        self._closing: set[asyncio.Task[None]] = set()
        self._task: asyncio.Task[None] | None = None

    async def start(self, hosts: Sequence[str], announced: str) -> None:
        """Listen at addresses, and announce one of them. OSError: that cannot be done."""
        self.slave.stream = announced, await self.tcpros_listener.start(hosts)
        self.slave.uri = f"http://{announced}:{await self.api.start(hosts, 0)}/"
        self.watch.announced = announced
        masters = set(addresses(address(self.master_uri)[0]))
        self.slave.trusted = lambda host: host in masters or is_local(host)
        self.registrar.publishers = self._found_publishers
        self.registrar.seen = self._seen
        self.registrar.api, self.registrar.replaced = self.slave.uri, self.slave.end
        self._join()
        self._task = asyncio.get_running_loop().create_task(self.registrar.run())

    async def close(self) -> None:
        """Withdraw all and close all connections."""
        if self in self.graph.wires:
            self.graph.wires.remove(self)
            self.graph.remote_master = self.graph.remote_call = None
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        await self.registrar.withdraw()
        await self.watch.close()
        await asyncio.gather(*(topic.close() for topic in self.subscriptions.values()), *self._closing)
        await self.tcpros_listener.close()
        await self.api.close()

    @property
    def clients(self) -> int:
        """Connections that are open; safe to ask from any thread."""
        return len(self.tcpros_listener.inside) + sum(
            source.receiver is not None
            for topic in list(self.subscriptions.values())
            for source in list(topic.sources.values())
        )

    # Changes of the graph

    def registered(self, kind: str, name: str) -> None:
        """A publisher, a subscriber or a service of a name has come or gone."""
        if kind == "publisher":
            self._publish(name)
            if self._access.master is not None and name in self.subscriptions:
                self.subscriptions[name].update(self.graph.registrations.apis("publisher", name))
        elif kind == "subscriber":
            self._listen(name)
        elif kind == "service":
            self._provide(name)
        if self._access.master is not None:
            self._access.master.registered(kind, name)
        else:
            self.registrar.settled.clear()
            self.registrar.wake.set()

    def replaced(self, node: str, uri: str) -> None:
        """Another node has taken the name of a node, whose URI was this."""
        if self._access.master is not None:
            self._access.master.replaced(node, uri)

    def deliver(self, name: str, type_name: str, message: Message) -> None:
        """Send a message to who listens."""
        topic = self.publications.get(name)
        if topic is None or topic.type != type_name:
            return
        try:
            topic.send(message)
        except Exception as error:  # whatever rosbags raises of an invalid message
            self.graph.notices.write("ERROR", "encode", name, f"{name}: a message cannot be written: {error}")

    def parameter_changed(self, key: str, value: object, setter: str) -> None:
        """A node has set or deleted a parameter."""
        if self._access.master is not None:
            self._access.master.parameter_changed(key, value, setter)
        elif setter == self.graph.node:
            self.registrar.wake.set()

    def _join(self) -> None:
        """Take over all that is in the graph, and follow its changes."""
        graph, (host, port) = self.graph, self.slave.stream
        graph.open(self.slave.uri, f"rosrpc://{host}:{port}")
        graph.wires.append(self)
        graph.remote_call = self._call
        if self._access.master is None:
            graph.remote_master = self._ask
            self.registrar.wished = self._wished
            self.registrar.parameters = lambda: self.graph.own_parameters
        for kind in ("publisher", "subscriber", "service"):
            for name in graph.registrations.names(kind):
                self.registered(kind, name)

    def _publish(self, name: str) -> None:
        """Have a topic that nodes of this process publish, and no other."""
        type_name, latched = self.graph.local_type("publisher", name), self.graph.is_latched(name)
        held = self.publications.get(name)
        if held is not None and (held.type, held.latched) != (type_name, latched):
            self.publications.pop(name).close()
            self._changed()
        if type_name is not None and name not in self.publications:
            self.publications[name] = Publication(
                self.stream, name, type_name, latched=latched, last=lambda: self.graph.latched(name)
            )

    def _listen(self, name: str) -> None:
        """Have a topic that nodes of this process listen to, and no other."""
        type_name = self.graph.local_type("subscriber", name)
        held = self.subscriptions.get(name)
        if held is not None and held.type != type_name:
            self._begin(self.subscriptions.pop(name).close())
        if type_name is not None and name not in self.subscriptions:
            self.subscriptions[name] = Subscription(
                self.graph.node,
                name,
                type_name,
                self._received,
                self.tcpros_listener.intake,
                self.graph.notices,
                self.graph.uri,
                lambda: sum(len(topic.sources) for topic in self.subscriptions.values()) < MOST_SOURCES,
            )
            self.subscriptions[name].update(self.graph.registrations.apis("publisher", name))

    def _provide(self, name: str) -> None:
        """Have a service that a node of this process provides, and no other."""
        service, held = self.graph.services.get(name), self.provided.get(name)
        if held is not None and (service is None or (held.type, held.call) != (service.type, service.call)):
            self.provided.pop(name).close()
        if service is not None and name not in self.provided:
            self.provided[name] = Provided(service.node, name, service.type, service.call)

    # What other processes do

    def _received(self, name: str, message: Message, sender: str, latched: bool) -> None:
        """A message of another process has come."""
        kept = latched and ((name, sender) in self._kept or len(self._kept) < MOST_LATCHED)
        if kept:
            self._kept.add((name, sender))
        self.graph.publish(name, self.subscriptions[name].type, message, sender, latched=kept, origin=self)

    async def _ask(self, method: str, values: Sequence[object]) -> object:
        """The value that another process's master gives; None where it fails."""
        (value,) = await self._access.link.many([(method, (self.graph.node, *values))])
        return value

    async def _call(self, name: str, make: Callable[[str], Message] | None) -> tuple[str, Message | None]:
        """Call a service of another process."""
        (uri,) = await self._access.link.many([("lookupService", (self.graph.node, name))])
        if not isinstance(uri, str):
            raise CommandError(f"no service named '{name}'")
        return await call_service(uri, self.graph.node, name, make)

    def _wished(self) -> dict[tuple[str, str, str], list[str]]:
        """All that nodes of this process have registered."""
        graph, known = self.graph, self.graph.registrations
        wished: dict[tuple[str, str, str], list[str]] = {}
        for kind in ("publisher", "subscriber", "service"):
            for name in known.names(kind):
                about = graph.service_uri if kind == "service" else graph.local_type(kind, name) or "*"
                wished |= {
                    (node, kind, name): [about, graph.uri]
                    for node, _ in known.holders(kind, name)
                    if node in graph.local
                }
        return wished

    def _meet(self, header: Mapping[str, str], transport: asyncio.Transport, place: Place) -> Role | None:
        """Whoever has connected wants to subscribe or to call."""
        if "topic" in header:
            return self._meet_reader(header, transport)
        service = self.provided.get(header.get("service", ""))
        if service is None:
            raise CommandError(f"[{self.graph.node}] is not a provider of [{header.get('service', '')[:100]}]")
        why = service.refusal(header)
        if why is not None:
            raise CommandError(why)
        transport.write(encode_header(service.reply()))
        if header.get("probe") == "1":
            return None
        return Caller(service, transport, header, self.graph.network, self.tcpros_listener.intake, place)

    def _meet_reader(self, header: Mapping[str, str], transport: asyncio.Transport) -> Reader:
        topic = self.publications.get(header["topic"])
        if topic is None:
            raise CommandError(f"[{self.graph.node}] is not a publisher of [{header['topic'][:100]}]")
        why = topic.refusal(header)
        if why is not None:
            raise CommandError(why)
        transport.write(encode_header(topic.reply()))
        reader = Reader(topic, transport, header)
        topic.join(reader)
        return reader

    def _changed(self) -> None:
        """Somebody has come or gone."""
        self.listened = frozenset(name for name, topic in self.publications.items() if topic.readers)

    def _found_publishers(self, topic: str, uris: Sequence[str]) -> None:
        if topic in self.subscriptions:
            self.subscriptions[topic].update(uris)

    def _seen(self, state: SystemState, types: Mapping[str, str]) -> None:
        if self._access.master is None:
            self.graph.mirror(state, types)
        for name, topic in self.subscriptions.items():
            count = sum(node not in self.graph.local for node in state[0].get(name, []))
            if count != len(topic.sources) and count <= MOST_PUBLISHERS:
                self.registrar.forget(name)  # the master's news did not reach us: ask
        self._kept = {(name, node) for name, node in self._kept if node in state[0].get(name, [])}
        self.watch.look(state, self.subscriptions)

    def _begin(self, work: Coroutine[object, None, None]) -> None:
        task: asyncio.Task[None] = asyncio.get_running_loop().create_task(work)
        self._closing.add(task)
        task.add_done_callback(self._closing.discard)


class Ros1:
    """The wire, from any thread."""

    def __init__(self, graph: Graph, *, master_uri: str | None = None, host: str = "127.0.0.1") -> None:
        """Nothing is opened yet."""
        self.master_uri = (master_uri or os.environ.get("ROS_MASTER_URI") or DEFAULT_MASTER).rstrip("/")
        self.on_shutdown: Callable[[str], None] | None = None
        """Called by the network's thread with the reason when `rosnode kill` or the master ends our node."""
        self._graph, self._host = graph, host
        self._connection_limit = ConnectionLimit()
        self._access: MasterAccess | None = None
        self._node: Node | None = None

    def start(self) -> Sequence[str]:
        """Find the master or become it, and open the node; returns lines that say where that is.

        Raises:
            NetworkError: that cannot be done, and why.
        """
        try:
            return self._graph.network.call(self._open(), OPEN_TIMEOUT)
        except TimeoutError:
            raise NetworkError(f"{self.master_uri} does not answer within {OPEN_TIMEOUT:.0f} s") from None

    @property
    def traffic(self) -> Traffic:
        """Connections now, bytes sent, messages dropped."""
        node = self._node
        if node is None:
            return Traffic(0, 0, 0)
        return Traffic(node.clients, node.stream.counts.sent, node.stream.counts.dropped)

    def close(self) -> None:
        """Withdraw all, and close every connection. Nothing happens where there is nothing to close."""
        if self._access is not None:
            with contextlib.suppress(TimeoutError):
                self._graph.network.call(self._end(), CLOSE_TIMEOUT)

    def settle(self, timeout: float = 5.0) -> None:
        """Wait until the master knows all that is offered; TimeoutError: it does not, so long [s]."""
        if self._node is not None:
            self._graph.network.call(self._settled(self._node), timeout)

    async def _open(self) -> Sequence[str]:
        graph = self._graph
        names = own_names(self._host, self.master_uri)
        access = await open_master(graph, self.master_uri, self._host, self._connection_limit, names)
        where = announced(self._host, access.host)
        node = Node(graph, access, self.master_uri, self._connection_limit)
        try:
            await node.start(bound(self._host), where)
        except OSError as error:
            await node.close()
            await access.close()
            raise NetworkError(f"ROS 1: cannot listen at {self._host}: {error}") from error
        node.slave.on_shutdown = self._told_to_end
        self._access, self._node = access, node
        if access.master is not None:
            access.master.changed = node.registrar.wake
        graph.notices.listener = graph.log
        own = "own master" if access.master is not None else "the master"
        lines = [f"ROS 1: {own} at {self.master_uri}, node {graph.node} at {node.slave.uri}"]
        if not is_ours(where, bound(self._host)):
            lines.append(
                f"ROS 1: nodes get the address {where} (ROS_HOSTNAME or ROS_IP), but this server listens at "
                f"{', '.join(bound(self._host))} only: give --host {where} or --host 0.0.0.0"
            )
        return lines

    async def _end(self) -> None:
        self._graph.notices.listener = None
        node, access = self._node, self._access
        self._node = self._access = None
        if node is not None:
            await node.close()
        if access is not None:
            await access.close()
        for _ in range(3):  # what was aborted is closed in the loop's next turns
            await asyncio.sleep(0)

    async def _settled(self, node: Node) -> None:
        await node.registrar.settled.wait()

    def _told_to_end(self, reason: str) -> None:
        if self.on_shutdown is not None:
            self.on_shutdown(reason)
