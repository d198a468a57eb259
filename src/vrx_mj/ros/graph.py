"""One graph of ROS: nodes, topics, services and parameters, whatever wire they came by.

All but the simulation's table lives in the network's thread.
"""

import asyncio
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.ros import interface
from vrx_mj.ros.interface import LEVELS, LOG, ROSOUT, Answer, Delivery, Entry, Inbox, RosInterface, Traffic, log_message
from vrx_mj.ros.limits import Mailbox
from vrx_mj.ros.messages import Message, is_known, new
from vrx_mj.ros.network import Network, Notices
from vrx_mj.ros.parameters import Parameters, join_names, plain

_LOGGER = "ros.vrx_mj"
_SERVICE_PREFIXES = ("/gazebo/", "/vrx/")
"""Prefixes of the names of the simulation's services."""
_TOPIC_ROLES = ("publisher", "subscriber")
"""Roles of a node at a topic."""
_REGISTRATION_KINDS = (*_TOPIC_ROLES, "service", "parameter")
"""Kinds of registrations."""
_KINDS = {interface.Output: "publisher", interface.Input: "subscriber", interface.Service: "service"}
"""Kinds of registrations of the entries of a table."""
MOST_REGISTRATIONS = 100_000
"""Largest number of registrations of all nodes."""


class Registrations:
    """Nodes by name, and what each has registered."""

    def __init__(self, replaced: Callable[[str, str, list[tuple[str, str]]], None]) -> None:
        self.nodes: dict[str, str] = {}
        """URI by node's name."""
        self._replaced = replaced
        self._entries: dict[str, dict[str, dict[str, tuple[str, str]]]] = {kind: {} for kind in _REGISTRATION_KINDS}
        """URIs and types by kind, name and node: the service's own URI for a service, otherwise the node's."""
        self._held: Counter[str] = Counter()
        self._count = 0

    def add(self, kind: str, key: str, node: str, node_api: str, api: str = "", type_name: str = "*") -> None:
        """Register; the type `*` is unknown. A node that had another URI is forgotten first.

        `replaced` is then called with its name, its old URI, and the kinds and names of what it had registered.

        Raises:
            CommandError: there are too many.
        """
        if self._count >= MOST_REGISTRATIONS:
            raise CommandError(f"more than {MOST_REGISTRATIONS} registrations")
        old = self.nodes.get(node)
        if old is not None and old != node_api:
            self._replaced(node, old, self.forget(node))
        self.nodes[node] = node_api
        entries = self._entries[kind].setdefault(key, {})
        if node not in entries:
            self._held[node] += 1
            self._count += 1
        entries[node] = api or node_api, type_name
        if kind == "service":  # the last node to register it has it
            for other in entries.keys() - {node}:
                self._drop(kind, key, other)

    def remove(self, kind: str, key: str, node: str, api: str) -> int:
        """Take back; returns how many that were."""
        if self._entries[kind].get(key, {}).get(node, ("", ""))[0] != api:
            return 0
        self._drop(kind, key, node)
        return 1

    def forget(self, node: str) -> list[tuple[str, str]]:
        """Take back all that a node has registered; returns kinds and names."""
        gone = [(kind, key) for kind, keys in self._entries.items() for key, nodes in keys.items() if node in nodes]
        for kind, key in gone:
            self._drop(kind, key, node)
        return gone

    def move(self, nodes: Collection[str], uri: str, service_uri: str) -> None:
        """Set the URIs of some nodes."""
        self.nodes |= dict.fromkeys(self.nodes.keys() & nodes, uri)
        for kind, keys in self._entries.items():
            api = service_uri if kind == "service" else uri
            for entries in keys.values():
                entries |= {node: (api, entries[node][1]) for node in entries.keys() & nodes}

    def apis(self, kind: str, key: str) -> list[str]:
        """URIs that are registered under a name."""
        return list(self.holders(kind, key).values())

    def names(self, kind: str) -> list[str]:
        """All names of a kind."""
        return list(self._entries[kind])

    def holders(self, kind: str, key: str) -> dict[str, str]:
        """URIs that are registered under a name, by node; safe to ask from any thread."""
        return {node: api for node, (api, _) in list(self._entries[kind].get(key, {}).items())}

    def types(self, kind: str, key: str) -> list[tuple[str, str]]:
        """Nodes that are registered under a name, each with the type that it gave, if it gave one; the last first."""
        entries = self._entries[kind].get(key, {})
        return [(node, type_name) for node, (_, type_name) in reversed(entries.items()) if type_name != "*"]

    def state(self, kind: str) -> list[list[object]]:
        """Names with their nodes, as `getSystemState` has it."""
        return [[key, list(nodes)] for key, nodes in self._entries[kind].items()]

    def _drop(self, kind: str, key: str, node: str) -> None:
        nodes = self._entries[kind][key]
        del nodes[node]
        if not nodes:
            del self._entries[kind][key]
        self._count -= 1
        self._held[node] -= 1
        if not self._held[node]:
            del self._held[node]
            del self.nodes[node]


class Service(NamedTuple):
    """A service of a node in this process."""

    node: str
    type: str
    call: Callable[[Message, str, Answer], None]
    """Takes the request, the caller's name, and what is to be called with the response."""


class Wire:
    """One way into the graph, which overrides what concerns it. Its methods are called in the network's thread."""

    listened: frozenset[str] = frozenset()
    """Topics that somebody on this wire listens to; safe to ask from any thread."""

    def registration_changed(self, kind: str, name: str) -> None:
        """A publisher, a subscriber or a service of a name has come or gone."""

    def node_replaced(self, node: str, uri: str) -> None:
        """Another node has taken the name of a node, whose URI was this."""

    def deliver(self, name: str, type_name: str, message: Message) -> None:
        """Send a message to who listens on this wire."""

    def parameter_changed(self, key: str, value: object, setter: str) -> None:
        """A node has set a parameter; if it was deleted, the value is an empty dictionary."""


_RemoteMaster = Callable[[str, Sequence[Any]], Awaitable[Any]]
"""Calls a method of another process's master with values after the caller; gives the value, None where it fails."""
_RemoteCall = Callable[[str, Callable[[str], Message] | None], Awaitable[tuple[str, Message | None]]]
"""Calls a service of another process, with the request made for its type; gives the type and the response.

Without a request it only asks for the type.
"""


class Graph:
    """Nodes, topics with their types and latched messages, services and parameters.

    The simulation is one node of it, each client of rosbridge that has registered something another one, and so are
    those that a ROS 1 master knows. The nodes of this process have one URI, the simulation's.
    """

    def __init__(self, network: Network, inbox: Inbox, node: str = "/gazebo") -> None:
        """`node`: the name of the simulation's node."""
        self.network, self.inbox, self.node = network, inbox, node
        self.uri = self.service_uri = ""
        """Where ROS 1's nodes call the nodes of this process; empty without that wire."""
        self.clock: float | None = None
        """Simulated time [s], once there is one."""
        self.table = RosInterface()
        self.wires: list[Wire] = []
        self.local = {node}
        """Nodes of this process."""
        self._master_types: Mapping[str, str] = {}
        """Types of topics, as another process's master has them."""
        self.services: dict[str, Service] = {}
        """Services of nodes of this process, by name."""
        self.parameters, self._own_parameters = Parameters(), Parameters()
        self.registrations = Registrations(self._note_replacement)
        self.notices = Notices()
        """Notices of what goes wrong on the networks."""
        self.remote_master: _RemoteMaster | None = None
        """Set while the parameters are another process's."""
        self.remote_call: _RemoteCall | None = None
        self._latched: dict[str, dict[str, Message]] = {}
        self._level = "INFO"
        self._own: dict[tuple[str, str], tuple[str, bool]] = {}
        """Registrations of the table: kind and name, type and whether it is latched."""
        self.own_parameters: Mapping[str, Any] = {}
        """Parameters of the simulation, by absolute name."""
        self.register("publisher", ROSOUT, node, LOG)
        for name, kind, call in (
            (f"{node}/get_loggers", "roscpp/GetLoggers", self._get_loggers),
            (f"{node}/set_logger_level", "roscpp/SetLoggerLevel", self._set_logger_level),
        ):
            self.provide(name, Service(node, kind, call))

    def open(self, uri: str, service_uri: str) -> None:
        """Set the URIs of the nodes of this process."""
        self.uri, self.service_uri = uri, service_uri
        self.registrations.move(self.local, uri, service_uri)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.clock or 0.0

    @property
    def subscribed_topics(self) -> frozenset[str]:
        """Outputs of the simulation that somebody listens to; safe to ask from any thread."""
        return frozenset().union(*(wire.listened for wire in self.wires)) & self.table.outputs.keys()

    # The simulation

    def offer(self, table: RosInterface) -> None:
        """Register what the table has for the simulation's node, and unregister everything else of it."""
        own = dict(self._known_entries(table))
        self.table = table
        for key in [key for key, kind in self._own.items() if own.get(key) != kind]:
            del self._own[key]
            self.unregister(*key, self.node)
        for (kind, name), (type_name, latched) in own.items():
            if (kind, name) in self._own:
                continue
            self._own[kind, name] = type_name, latched
            if kind == "service":
                self.provide(name, Service(self.node, type_name, partial(self.inbox.call, name)))
            else:
                self.register(kind, name, self.node, type_name)
        self._offer_parameters(table.parameters)

    def send(self, sent: Delivery) -> None:
        """Publish a message of the simulation."""
        output, message, self.clock = sent
        self.publish(output.name, output.type, message, self.node, latched=output.latched)

    def log(self, level: str, text: str) -> None:
        """Publish a line for people on `/rosout`."""
        line = log_message(time.time() if self.clock is None else self.clock, level, self.node, text)
        if line.level >= LEVELS[self._level]:
            self.publish(ROSOUT, LOG, line, self.node)

    # Topics

    def publish(
        self, name: str, type_name: str, message: Message, node: str, *, latched: bool = False, sender: str = "",
        origin: Wire | None = None,
    ) -> None:  # fmt: skip
        """Give a node's message to all who listen in this process and, but on the wire it came by, elsewhere.

        Args:
            name: of the topic.
            type_name: of the message.
            message: must not change afterwards.
            node: who publishes it.
            latched: whether those who subscribe later get it.
            sender: who sent it, for people; the node by default.
            origin: the wire on which it was published, if those who listen there have it.
        """
        if name in self.table.inputs:
            self.inbox.message(name, message, sender or node)
        if latched:
            self._latched.setdefault(name, {})[node] = message
        for wire in self.wires:
            if wire is not origin:
                wire.deliver(name, type_name, message)

    def latched_messages(self, name: str) -> list[Message]:
        """The messages of a topic that those get who subscribe now."""
        return list(self._latched.get(name, {}).values())

    def is_latched(self, name: str) -> bool:
        """Whether some node of this process latches a topic."""
        output = self.table.outputs.get(name)
        return (output is not None and output.latched) or name in self._latched

    def type_of(self, name: str) -> str | None:
        """The type of a topic that somebody publishes or listens to, where it is known.

        It is what the simulation gives it, else another node of this process, else the last publisher or subscriber.
        """
        known = [pair for kind in _TOPIC_ROLES for pair in self.registrations.types(kind, name)]
        if known:
            return min(known, key=lambda pair: (pair[0] != self.node, pair[0] not in self.local))[1]
        is_topic = any(self.registrations.apis(kind, name) for kind in _TOPIC_ROLES)
        return self._master_types.get(name) if is_topic else None

    def topics(self) -> dict[str, str]:
        """Every topic's type, by name; empty where it is not known."""
        names = {name for kind in _TOPIC_ROLES for name in self.registrations.names(kind)}
        return {name: self.type_of(name) or "" for name in sorted(names)}

    def local_type(self, kind: str, name: str) -> str | None:
        """The type of a topic that a node of this process publishes or listens to; None where none does."""
        return next((given for node, given in self.registrations.types(kind, name) if node in self.local), None)

    def is_local(self, kind: str, name: str) -> bool:
        """Whether a node of this process is registered under a name."""
        return not self.local.isdisjoint(self.registrations.holders(kind, name))

    # Registrations

    def register(self, kind: str, name: str, node: str, type_name: str, *, latched: bool = False) -> None:
        """Register a publisher or subscriber of a node of this process; CommandError: there are too many."""
        self.registrations.add(kind, name, node, self.uri, type_name=type_name)
        self.local.add(node)  # before wires hear of it: they ask whose it is
        if latched:
            self._latched.setdefault(name, {})
        self._notify(kind, name)

    def provide(self, name: str, service: Service) -> None:
        """Register a service of a node of this process; CommandError: there are too many."""
        self.registrations.add("service", name, service.node, self.uri, self.service_uri)
        self.local.add(service.node)
        self.services[name] = service
        self._notify("service", name)

    async def call(self, service: Service, request: Message, caller: str) -> Message:
        """The response of a service of this process; CommandError: it fails, and why."""
        done: asyncio.Future[Message] = asyncio.get_running_loop().create_future()

        def settle(response: Message | None, why: str) -> None:
            if done.done():
                return  # nobody waits any more
            if response is None:
                done.set_exception(CommandError(why))
            else:
                done.set_result(response)

        service.call(request, caller, partial(self.network.soon, settle))
        return await done

    def missed_service(self, name: str, node: str) -> None:
        """A node asked for a service that there is not: report once if it could be the simulation's."""
        services = self.table.services
        if not (services and name.startswith(_SERVICE_PREFIXES)) or name in services:
            return
        hint = self.table.elsewhere.get(name) or UnknownNameError("service", name, services)
        self.notices.write("WARN", "missed service", name, f"{node} asks for the service {name}: {hint}")

    def unregister(self, kind: str, name: str, node: str) -> None:
        """Take back what a node of this process has registered."""
        self.registrations.remove(kind, name, node, self.service_uri if kind == "service" else self.uri)
        self._note_removal(kind, name, node)

    def register_remote(
        self, kind: str, name: str, node: str, uri: str, type_name: str = "*", service_uri: str = ""
    ) -> None:
        """Register something of a node of another process; CommandError: there are too many."""
        self.registrations.add(kind, name, node, uri, service_uri, type_name)
        self._notify(kind, name)

    def unregister_remote(self, kind: str, name: str, node: str, uri: str) -> int:
        """Take back what a node of another process has registered; returns how many that were."""
        count = self.registrations.remove(kind, name, node, uri)
        if count:
            self._note_removal(kind, name, node)
        return count

    def forget(self, node: str) -> None:
        """A node has gone, and all that it had registered."""
        for kind, name in self.registrations.forget(node):
            self._note_removal(kind, name, node)
        if node != self.node:
            self.local.discard(node)

    def mirror(self, state: Sequence[Mapping[str, Sequence[str]]], types: Mapping[str, str]) -> None:
        """Replace the nodes of other processes by those that a master reports: publishers, subscribers, services."""
        self._master_types = {name: kind for name, kind in types.items() if kind != "*"}
        for kind, known in zip(_REGISTRATION_KINDS, state, strict=False):
            there = {(name, node) for name, nodes in known.items() for node in nodes if node not in self.local}
            here = {
                (name, node)
                for name in self.registrations.names(kind)
                for node in self.registrations.holders(kind, name).keys() - self.local
            }
            for name, node in here - there:
                self.unregister_remote(kind, name, node, "")
            for name, node in there - here:
                self.registrations.add(kind, name, node, "")

    # Parameters

    def set_parameter(self, key: str, value: object, setter: str) -> None:
        """Set a parameter by its absolute name.

        Raises:
            CommandError: XML-RPC cannot carry the value, or it is too deep or too much.
        """
        self.parameters.set(key, plain(value))
        self._notify_parameter(key, value, setter)

    def delete_parameter(self, key: str) -> None:
        """Delete a parameter; what the simulation has set is as it had set it then.

        Raises:
            KeyError: the parameter is not set.
            CommandError: it is the simulation's alone.
        """
        own = self._own_parameters.get(key)
        if join_names(key) != "/" and own is not None and self.parameters.get(key) == own:
            raise CommandError(f"{key}: the parameter belongs to the simulation and cannot be deleted")
        if own is None or join_names(key) == "/":
            self.parameters.delete(key)
            self._notify_parameter(key, {}, "")
        else:
            self.set_parameter(key, own, "")

    # What follows from a change

    def _known_entries(self, table: RosInterface) -> Iterator[tuple[tuple[str, str], tuple[str, bool]]]:
        """Kind and name, type and whether it is latched, of all in a table whose type is known; others are reported."""
        entries: tuple[Entry, ...] = (*table.outputs.values(), *table.inputs.values(), *table.services.values())
        for entry in entries:
            kind = _KINDS[type(entry)]
            halves = ("Request", "Response") if kind == "service" else ("",)
            if all(is_known(f"{entry.type}{half}") for half in halves):
                yield (kind, entry.name), (entry.type, getattr(entry, "latched", False))
            else:
                self.notices.write("ERROR", "type", entry.name, f"{entry.name}: unknown type {entry.type}")

    def _offer_parameters(self, given: Mapping[str, object]) -> None:
        own: dict[str, Any] = {}
        before, self._own_parameters = self._own_parameters, Parameters()
        for name, value in given.items():
            try:
                own[name] = plain(value)
            except CommandError as error:
                self.notices.write("ERROR", "parameter", name, f"parameter {name}: {error}")
            else:
                self._own_parameters.set(name, own[name])
        for name in self.own_parameters.keys() - own.keys():
            if self.parameters.has(name):
                self.parameters.delete(name)
                self._notify_parameter(name, {}, self.node)
        for name, value in own.items():
            if before.get(name) != value:
                self.set_parameter(name, value, self.node)
        self.own_parameters = own

    def _note_removal(self, kind: str, name: str, node: str) -> None:
        """Tell wires that a node's registration is gone."""
        kept = self._latched.get(name)
        if kind == "publisher" and kept is not None:
            kept.pop(node, None)
            if not kept:
                del self._latched[name]
        if kind == "service" and name in self.services and self.services[name].node == node:
            del self.services[name]
        self._notify(kind, name)

    def _note_replacement(self, node: str, uri: str, gone: Iterable[tuple[str, str]]) -> None:
        for wire in self.wires:
            wire.node_replaced(node, uri)
        for kind, name in gone:
            self._note_removal(kind, name, node)

    def _notify(self, kind: str, name: str) -> None:
        for wire in self.wires:
            wire.registration_changed(kind, name)

    def _notify_parameter(self, key: str, value: object, setter: str) -> None:
        for wire in self.wires:
            wire.parameter_changed(key, value, setter)

    def _get_loggers(self, _request: Message, _caller: str, answer: Answer) -> None:
        logger = new("roscpp/Logger", name=_LOGGER, level=self._level.lower())
        answer(new("roscpp/GetLoggersResponse", loggers=[logger]), "")

    def _set_logger_level(self, request: Message, _caller: str, answer: Answer) -> None:
        level = str(request.level).upper()
        if level not in LEVELS:
            answer(None, f"no level {request.level[:40]!r}; known: {', '.join(name.lower() for name in LEVELS)}")
            return
        self._level = level
        answer(new("roscpp/SetLoggerLevelResponse"), "")


class Server(Protocol):
    """One wire, as the simulation's thread has it."""

    @property
    def traffic(self) -> Traffic:
        """Traffic since the start."""

    def start(self) -> Sequence[str]:
        """Open it; returns lines for people with its address. NetworkError: it cannot be opened, and why."""

    def close(self) -> None:
        """Withdraw all, and close every connection."""


def _mailbox() -> Mailbox[Delivery]:
    return Mailbox(lambda sent: sent.output.name)


class Wires:
    """A `Transport` (see `vrx_mj.ros.interface`) of one graph and all wires on which it is shown.

    Messages that it is given are written later, in the network's thread: they must not be changed after `publish`.
    """

    def __init__(self, graph: Graph, servers: Sequence[Server]) -> None:
        self.graph, self.servers = graph, servers
        self._dropped, self._queue = 0, _mailbox()

    def start(self) -> Sequence[str]:
        """Open every wire; NetworkError: one cannot be opened, and why."""
        return [line for server in self.servers for line in server.start()]

    def offer(self, table: RosInterface) -> None:
        """Offer this table from now on, and nothing else."""
        self._dropped += self._queue.dropped
        self._queue = _mailbox()  # what was published before goes before it
        self.graph.network.soon(self.graph.offer, table)

    @property
    def subscribed_topics(self) -> frozenset[str]:
        """Names of the outputs that somebody listens to now."""
        return self.graph.subscribed_topics

    def publishers(self, topic: str) -> Sequence[str]:
        """Nodes that publish a topic now."""
        return list(self.graph.registrations.holders("publisher", topic))

    def publish(self, batch: Sequence[Delivery]) -> None:
        """Send messages of one moment to who listens."""
        if self._queue.put(batch):
            self.graph.network.soon(self._send, self._queue)

    def log(self, level: str, text: str) -> None:
        """Show people on the networks a line: `INFO`, `WARN` or `ERROR`."""
        self.graph.network.soon(self.graph.log, level, text)

    @property
    def traffic(self) -> Traffic:
        """Traffic of all wires since the start."""
        clients, sent, dropped = map(sum, zip((0, 0, 0), *(server.traffic for server in self.servers), strict=True))
        return Traffic(clients, sent, dropped + self._dropped + self._queue.dropped)

    def close(self) -> None:
        """Withdraw all, close every connection, and wait until that is done."""
        for server in reversed(self.servers):
            server.close()

    def _send(self, queue: Mailbox[Delivery]) -> None:
        for sent in queue.take():
            self.graph.send(sent)
