"""ROS 1 without ROS: the graph on TCPROS, with the master that there is or with one of our own."""

import asyncio
import contextlib
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.graph import Graph, Wire
from vrx_mj.ros.interface import Traffic
from vrx_mj.ros.limits import ConnectionLimit, Intake
from vrx_mj.ros.messages import Message
from vrx_mj.ros.network import (
    Notices,
    addresses,
    announced_address,
    begin_task,
    end_tasks,
    is_local,
    listening_addresses,
    own_names,
)
from vrx_mj.ros.parameters import MAX_NAME, resolve
from vrx_mj.ros.ros1.connection import LARGEST_HEADER, HttpServer, Listener, Peer, decode_header, encode_header
from vrx_mj.ros.ros1.master import Api, Reply
from vrx_mj.ros.ros1.registrar import Link, MasterAccess, Registrar, SystemState, is_ours, open_master
from vrx_mj.ros.ros1.tcpros import MOST_PUBLISHERS, Publication, Reader, ServiceHost, Stream, Subscription, call_service
from vrx_mj.ros.ros1.xmlrpc import CALL_ERRORS, DEFAULT_MASTER, address, ask

HEADER_TIMEOUT = 10.0
"""Wall time in which a header must arrive [s]."""
_RESTRICTED = {"shutdown", "publisherUpdate", "paramUpdate"}
"""Methods that only programs on this machine and the master's may call."""
_MASTER = "/master"
"""Name of the caller that masters give."""
_PUBLIC = {"/rosout", "/rosout_agg", "/clock", "/tf", "/tf_static", "/statistics", "/diagnostics"}
"""Topics on which many nodes publish."""
_CONNECT_TIMEOUT = 10.0
"""Wall time in which a subscriber should have connected [s]."""
_MOST_WAITING = 1000
"""Largest number of unfinished connections of subscribers that are watched."""
_INCOMING_BYTES = 1 << 27
"""Largest size of all messages and requests that are being received [bytes]."""
_MOST_SOURCES = 1024
"""Largest number of connections to publishers of other processes."""
_MOST_LATCHED = 64
"""Largest number of latched messages of other processes that are kept."""
_OPEN_TIMEOUT = 15.0
"""Wall time to find the master and to register [s]."""
_CLOSE_TIMEOUT = 2.0
"""Wall time to withdraw everything and to close [s]."""


@dataclass
class Slave(Api):
    """Answers with what a node has."""

    node: str
    master_uri: str
    publications: dict[str, Publication]
    subscriptions: dict[str, Subscription]
    notices: Notices
    is_masters_own: bool
    """Whether the master is this process's own, which never ends its node; others may have it call us."""
    uri: str = ""
    stream: tuple[str, int] = ("", 0)
    """Host and port of TCPROS."""
    trusted: Callable[[str], bool] = lambda host: False
    """Whether a caller at such an address may command the node."""
    on_shutdown: Callable[[str], None] | None = None
    """Called with the reason when somebody shuts the node down."""

    def __post_init__(self) -> None:
        self.methods = {
            "getBusStats": ("", self._bus_stats),
            "getBusInfo": ("", self._bus_info),
            "getMasterUri": ("", lambda _: (1, self.master_uri, self.master_uri)),
            "getUri": ("", lambda _: (1, "", self.uri)),
            "getName": ("", lambda _: (1, "", self.node)),
            "getPid": ("", lambda _: (1, "", os.getpid())),
            "getSubscriptions": ("", lambda _: (1, "subscriptions", _topic_list(self.subscriptions))),
            "getPublications": ("", lambda _: (1, "publications", _topic_list(self.publications))),
            "paramUpdate": ("vv", lambda *_: (-1, "not subscribed", 0)),
            "publisherUpdate": ("vv", self._publisher_update),
            "requestTopic": ("vv", self._request_topic),
            "shutdown": ("*", self._shutdown),
        }

    def refusal(self, method: str, caller: str, host: str) -> str:
        """Why a caller may not use a method: some are for this machine and the master's alone. Empty if it may."""
        if method not in _RESTRICTED or self.trusted(host):
            return ""
        text = f"{host} ({caller[:100]}) called {method}: only this machine and the master's machine may"
        self.notices.write("WARN", method, host, text)
        return f"{method} is refused: {host} is neither this machine nor the master's"

    def _bus_stats(self, _: str) -> Reply:
        sent = [
            [
                topic.name,
                sum(one.sent for one in topic.readers),
                [[one.number, one.sent, one.messages, True] for one in topic.readers],
            ]
            for topic in self.publications.values()
        ]
        got = [
            [topic.name, [[one.number, one.received, -1, one.peer is not None] for one in topic.sources.values()]]
            for topic in self.subscriptions.values()
        ]
        return 1, "", [sent, got, []]

    def _bus_info(self, _: str) -> Reply:
        rows: list[list[Any]] = [
            ["o", one.number, one.peer, one.node, topic.name]
            for topic in self.publications.values()
            for one in topic.readers
        ]
        rows += [
            ["i", one.number, one.peer, one.uri, topic.name]
            for topic in self.subscriptions.values()
            for one in topic.sources.values()
        ]
        return 1, "bus info", [_bus_row(*row) for row in rows]

    def _publisher_update(self, _: str, topic: object, publishers: object) -> Reply:
        if not isinstance(topic, str) or not isinstance(publishers, list):
            return -1, "publisherUpdate takes a topic and a list of URIs", 0
        if topic in self.subscriptions:
            self.subscriptions[topic].update(uri for uri in publishers if isinstance(uri, str))
        return 1, "", 0

    def _request_topic(self, _: str, topic: object, protocols: object) -> Reply:
        name = resolve(topic, self.node) if isinstance(topic, str) else ""
        if name not in self.publications:
            return -1, f"Not a publisher of [{str(topic)[:100]}]", []
        known = [one[0] for one in protocols if isinstance(one, list) and one] if isinstance(protocols, list) else []
        if "TCPROS" not in known:
            return 0, "no supported protocol implementations: TCPROS is spoken here", []
        host, port = self.stream
        return 1, f"ready on {host}:{port}", ["TCPROS", host, port]

    def _shutdown(self, caller: str, *reason: object) -> Reply:
        if self.is_masters_own and caller == _MASTER:
            return -1, "shutdown is refused: this master does not end this node", 0
        self.end(f"{caller[:100]} shut it down: {str(reason[0])[:200] if reason else 'no reason given'}")
        return 1, "shutdown", 0

    def end(self, reason: str) -> None:
        """Shut down: report the reason, and call `on_shutdown`."""
        self.notices.write("WARN", "shutdown", reason, f"node {self.node}: {reason}")
        if self.on_shutdown is not None:
            self.on_shutdown(reason)


def _bus_row(direction: str, number: int, peer: Peer | None, other: str, topic: str) -> list[object]:
    """The row of a connection in `getBusInfo`."""
    there, here = (peer.address(end) if peer else ("?", 0) for end in ("peername", "sockname"))
    about = f"TCPROS connection on port {here[1]} to [{there[0]}:{there[1]} on socket {number}]"
    return [number, other, direction, "TCPROS", topic, peer is not None, about]


def _topic_list(topics: Mapping[str, Publication] | Mapping[str, Subscription]) -> list[list[str]]:
    return [[topic.name, topic.type] for topic in topics.values()]


class Watch:
    """Looks at one state after the other."""

    def __init__(self, graph: Graph, link: Link, publications: Mapping[str, Publication]) -> None:
        self._graph, self._link = graph, link
        self._publications = publications
        self.announced = ""
        """The address that others get."""
        self.clock: Callable[[], float] = time.monotonic
        self._unknown_publishers: set[tuple[str, str]] = set()
        self._since: dict[tuple[str, str], float] = {}
        self._work: set[asyncio.Task[None]] = set()

    def look(self, state: SystemState, types: Mapping[str, str], inputs: Mapping[str, object]) -> None:
        """Find what is new in a state; `types` are those of topics, and `inputs` the topics that we listen to."""
        publishers, subscribers = state[0], state[1]
        unknown_publishers = {
            (topic, node)
            for topic, nodes in publishers.items()
            if topic not in _PUBLIC and topic not in inputs and topic not in self._publications
            if not set(subscribers.get(topic, [])) - {self._graph.node}
            for node in nodes
            if node not in self._graph.local
        }
        new, self._unknown_publishers = unknown_publishers - self._unknown_publishers, unknown_publishers
        for topic, node in sorted(new):
            self._graph.inbox.unknown_publisher(topic, types.get(topic, "*"), node)
        silent = self._silent(subscribers)
        if silent:
            begin_task(self._report_unreachable(silent), self._work)

    async def close(self) -> None:
        """Stop the node."""
        await end_tasks(self._work)

    def _silent(self, subscribers: Mapping[str, list[str]]) -> list[tuple[str, str]]:
        """Topics and nodes that subscribed to them long ago and never connected; of a node only one topic."""
        waiting = {
            (topic, node)
            for topic, publication in self._publications.items()
            for node in subscribers.get(topic, [])
            if node not in self._graph.local and node not in publication.met
        }
        now = self.clock()
        since = {pair: self._since.get(pair, now) for pair in sorted(waiting)[:_MOST_WAITING]}
        late = {node: topic for (topic, node), begun in since.items() if now - begun > _CONNECT_TIMEOUT}
        self._since = {pair: begun for pair, begun in since.items() if pair[1] not in late}
        return [(topic, node) for node, topic in late.items()]

    async def _report_unreachable(self, silent: list[tuple[str, str]]) -> None:
        try:
            uris = await self._link.many([("lookupNode", (self._graph.node, node)) for _, node in silent])
        except (*CALL_ERRORS, Fault):
            return
        for (_, node), uri in zip(silent, map(str, uris), strict=True):
            try:
                host, _ = address(uri)
                if not await _answers(uri):
                    continue  # it has died, and its registration has stayed
            except CommandError:
                continue
            where = "this machine" if await asyncio.to_thread(is_local, host) else host
            text = (
                f"subscriber {node} on {where} never connected: can it reach {self.announced}, "
                "the address set by ROS_HOSTNAME, ROS_IP or --host?"
            )
            self._graph.notices.write("WARN", "unreachable", node, text)


async def _answers(uri: str) -> bool:
    """Whether a node is alive."""
    try:
        await ask(uri, "getPid", "/vrx_mj", timeout=2.0)
    except (*CALL_ERRORS, Fault):
        return False
    return True


class Node(Wire):
    """The nodes of this process on TCPROS: a `Wire` (see `vrx_mj.ros.graph`), in the network's thread."""

    def __init__(self, graph: Graph, access: MasterAccess, master_uri: str, connection_limit: ConnectionLimit) -> None:
        self.graph, self.master_uri, self._access = graph, master_uri, access
        name, notices = graph.node, graph.notices
        self.stream = Stream(name)
        self.publications: dict[str, Publication] = {}
        self.subscriptions: dict[str, Subscription] = {}
        self.provided: dict[str, ServiceHost] = {}
        is_own = access.master is not None
        self.slave = Slave(name, master_uri, self.publications, self.subscriptions, notices, is_own)
        intake, self._connection_limit = Intake(_INCOMING_BYTES), connection_limit
        self.tcpros_listener = Listener("TCPROS", self._serve, connection_limit, intake, notices)
        self.api = HttpServer(f"node {name}", self.slave.answer, connection_limit, notices, access.names)
        self.registrar = Registrar(name, master_uri, access.link, notices)
        self.watch = Watch(graph, access.link, self.publications)
        self._kept: set[tuple[str, str]] = set()
        """Topics and nodes of other processes whose last message is kept."""
        self._closing: set[asyncio.Task[None]] = set()
        self._task: asyncio.Task[None] | None = None

    async def start(self, hosts: Sequence[str], announced_address: str) -> None:
        """Listen at addresses, and announce one of them. OSError: that cannot be done."""
        self.slave.stream = announced_address, await self.tcpros_listener.start(hosts)
        self.slave.uri = f"http://{announced_address}:{await self.api.start(hosts, 0)}/"
        self.watch.announced = announced_address
        masters = set(addresses(address(self.master_uri)[0]))
        self.slave.trusted = lambda host: host in masters or is_local(host)
        self.registrar.publishers = self._found_publishers
        self.registrar.seen = self._take_state
        self.registrar.api, self.registrar.replaced = self.slave.uri, self.slave.end
        self._join()
        self._task = asyncio.create_task(self.registrar.run())

    async def close(self) -> None:
        """Withdraw all and close all connections."""
        if self in self.graph.wires:
            self.graph.wires.remove(self)
            self.graph.remote_master = self.graph.remote_call = None
        if self._task is not None:
            await end_tasks([self._task])
        await self.registrar.withdraw()
        await self.watch.close()
        await asyncio.gather(*(topic.close() for topic in self.subscriptions.values()), *self._closing)
        await self.tcpros_listener.close()
        await self.api.close()

    @property
    def clients(self) -> int:
        """Connections that are open; safe to ask from any thread."""
        return len(self.tcpros_listener.tasks) + sum(
            source.peer is not None
            for topic in list(self.subscriptions.values())
            for source in list(topic.sources.values())
        )

    # Changes of the graph

    def registration_changed(self, kind: str, name: str) -> None:
        """A publisher, a subscriber or a service of a name has come or gone."""
        if kind == "publisher":
            self._publish(name)
            if self._access.master is not None and name in self.subscriptions:
                self.subscriptions[name].update(self.graph.registrations.apis("publisher", name))
        elif kind == "subscriber":
            self._listen(name)
        elif kind == "service":
            self._provide(name)
        if self._access.master is None:
            self.registrar.settled.clear()
        self.registrar.wake.set()

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
        if self._access.master is None and setter == self.graph.node:
            self.registrar.wake.set()

    def _join(self) -> None:
        """Take over all that is in the graph, and follow its changes."""
        graph, (host, port) = self.graph, self.slave.stream
        graph.open(self.slave.uri, f"rosrpc://{host}:{port}")
        graph.wires.append(self)
        graph.remote_call = self._call
        if self._access.master is None:
            graph.remote_master = self._ask
            self.registrar.wished = self._wished_registrations
            self.registrar.parameters = lambda: self.graph.own_parameters
        for kind in ("publisher", "subscriber", "service"):
            for name in graph.registrations.names(kind):
                self.registration_changed(kind, name)

    def _publish(self, name: str) -> None:
        """Open or close the publication of a topic, as nodes of this process publish it or not."""
        type_name, latched = self.graph.local_type("publisher", name), self.graph.is_latched(name)
        held = self.publications.get(name)
        if held is not None and (held.type, held.latched) != (type_name, latched):
            self.publications.pop(name).close()
            self._note_readers()
        if type_name is not None and name not in self.publications:
            self.publications[name] = Publication(
                self.stream, name, type_name, latched=latched, last=lambda: self.graph.latched_messages(name)
            )

    def _listen(self, name: str) -> None:
        """Open or close the subscription of a topic, as nodes of this process listen to it or not."""
        type_name = self.graph.local_type("subscriber", name)
        held = self.subscriptions.get(name)
        if held is not None and held.type != type_name:
            begin_task(self.subscriptions.pop(name).close(), self._closing)
        if type_name is not None and name not in self.subscriptions:
            self.subscriptions[name] = Subscription(
                self.graph.node,
                name,
                type_name,
                self._take_remote,
                self.tcpros_listener.intake,
                self.graph.notices,
                self.graph.uri,
                lambda: sum(len(topic.sources) for topic in self.subscriptions.values()) < _MOST_SOURCES,
            )
            self.subscriptions[name].update(self.graph.registrations.apis("publisher", name))

    def _provide(self, name: str) -> None:
        """Open or close a service, as a node of this process provides it or not."""
        service, held = self.graph.services.get(name), self.provided.get(name)
        if held is not None and held.service != service:
            self.provided.pop(name).close()
        if service is not None and name not in self.provided:
            self.provided[name] = ServiceHost(self.graph, name, service)

    # What other processes do

    def _take_remote(self, name: str, message: Message, sender: str, latched: bool) -> None:
        """A message of another process has come."""
        kept = latched and ((name, sender) in self._kept or len(self._kept) < _MOST_LATCHED)
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

    def _wished_registrations(self) -> dict[tuple[str, str, str], list[str]]:
        """All that nodes of this process have registered."""
        graph, known = self.graph, self.graph.registrations
        wished: dict[tuple[str, str, str], list[str]] = {}
        for kind in ("publisher", "subscriber", "service"):
            for name in known.names(kind):
                about = graph.service_uri if kind == "service" else graph.local_type(kind, name) or "*"
                for node in known.holders(kind, name).keys() & graph.local:
                    wished[node, kind, name] = [about, graph.uri]
        return wished

    async def _serve(self, peer: Peer) -> None:
        """Serve a connection of who wants to subscribe to a topic or to call a service."""
        async with asyncio.timeout(HEADER_TIMEOUT):
            header = decode_header(await peer.frame(LARGEST_HEADER))
        try:
            met = self._destination(header)
            lasts = isinstance(met, Publication) or header.get("persistent", "").lower() in {"1", "true"}
            if lasts and not self._connection_limit.settle(peer.place):
                raise CommandError("too many connections")
        except CommandError as error:
            await peer.send(encode_header({"error": str(error)[:1000]}))
            raise
        await peer.send(encode_header(met.reply()))
        node = header["callerid"][:MAX_NAME]
        if isinstance(met, Publication):
            reader = Reader(met, peer, node)
            met.join(reader)
            self._note_readers()
            try:
                await reader.stay()
            finally:
                self._note_readers()
        elif header.get("probe") != "1":
            await met.answer(peer, node, persistent=lasts)

    def _destination(self, header: Mapping[str, str]) -> Publication | ServiceHost:
        """The topic or service that a header asks for; CommandError: it is not for who sent it."""
        what, name = ("publisher", header["topic"]) if "topic" in header else ("provider", header.get("service", ""))
        met = self.publications.get(name) if what == "publisher" else self.provided.get(name)
        if met is None:
            raise CommandError(f"[{self.graph.node}] is not a {what} of [{name[:100]}]")
        missing = [name for name in ("md5sum", "callerid") if name not in header]
        why = f"Missing required '{missing[0]}' field" if missing else met.refusal(header)
        if why is not None:
            raise CommandError(why)
        return met

    def _note_readers(self) -> None:
        """Somebody has come or gone."""
        self.listened = frozenset(name for name, topic in self.publications.items() if topic.readers)

    def _found_publishers(self, topic: str, uris: Sequence[str]) -> None:
        if topic in self.subscriptions:
            self.subscriptions[topic].update(uris)

    def _take_state(self, state: SystemState, types: Mapping[str, str]) -> None:
        if self._access.master is None:
            self.graph.mirror(state, types)
        for name, topic in self.subscriptions.items():
            count = sum(node not in self.graph.local for node in state[0].get(name, []))
            if count != len(topic.sources) and count <= MOST_PUBLISHERS:
                self.registrar.forget(name)  # the master's news did not reach us: ask
        self._kept = {(name, node) for name, node in self._kept if node in state[0].get(name, [])}
        self.watch.look(state, types, self.subscriptions)


class Ros1:
    """The wire, from any thread."""

    def __init__(self, graph: Graph, *, master_uri: str | None = None, host: str = "127.0.0.1") -> None:
        """Prepare the wire; nothing is opened yet."""
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
            return self._graph.network.call(self._open(), _OPEN_TIMEOUT)
        except TimeoutError:
            raise NetworkError(f"{self.master_uri} does not answer within {_OPEN_TIMEOUT:.0f} s") from None

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
                self._graph.network.call(self._end(), _CLOSE_TIMEOUT)

    def settle(self, timeout: float = 5.0) -> None:
        """Wait until the master knows all that is offered; TimeoutError: it does not, so long [s]."""
        if self._node is not None:
            self._graph.network.call(self._node.registrar.settled.wait(), timeout)

    async def _open(self) -> Sequence[str]:
        graph = self._graph
        names = own_names(self._host, self.master_uri)
        access = await open_master(graph, self.master_uri, self._host, self._connection_limit, names)
        where = announced_address(self._host, access.host)
        node = Node(graph, access, self.master_uri, self._connection_limit)
        try:
            await node.start(listening_addresses(self._host), where)
        except OSError as error:
            await node.close()
            await access.close()
            raise NetworkError(f"ROS 1: cannot listen at {self._host}: {error}") from error
        node.slave.on_shutdown = self._shut_down
        self._access, self._node = access, node
        graph.notices.listener = graph.log
        own = "own master" if access.master is not None else "the master"
        lines = [f"ROS 1: {own} at {self.master_uri}, node {graph.node} at {node.slave.uri}"]
        if not is_ours(where, listening_addresses(self._host)):
            lines.append(
                f"ROS 1: nodes get the address {where} (ROS_HOSTNAME or ROS_IP), but this server listens at "
                f"{', '.join(listening_addresses(self._host))} only: give --host {where} or --host 0.0.0.0"
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

    def _shut_down(self, reason: str) -> None:
        if self.on_shutdown is not None:
            self.on_shutdown(reason)
