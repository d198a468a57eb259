"""Topics and services: those of the table, and those that clients make among themselves."""

import asyncio
import functools
import itertools
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol

from vrx_mj.errors import CommandError, UnknownNameError, VrxError
from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.limits import Outgoing
from vrx_mj.ros.messages import Message, known_types, ros1_name
from vrx_mj.ros.network import Network
from vrx_mj.ros.offer import Table
from vrx_mj.ros.rosbridge.codec import Parcel, plain, request, taken
from vrx_mj.ros.rosbridge.protocol import Options

__all__ = ["LONGEST_CALL", "ROSOUT", "Caller", "Offered", "Services", "Subscription", "Topic", "Topics", "respond"]

MOST_IDS = 256
"""Subscriptions of one topic by one client, at most."""


class Subscription:
    """All of a client's subscriptions of one topic: it gets every message once, as rosbridge_server has it.

    Where they differ, the shortest throttle, queue and fragment count, and png before cbor-raw, cbor and none.
    A throttle without a queue drops what comes too early; with a queue that waits, and the oldest is dropped.
    """

    def __init__(self, topic: str, outgoing: Outgoing) -> None:
        self.topic = topic
        """As the client writes it, which is how it gets its messages."""
        self._outgoing = outgoing
        self._wishes: dict[str, Options] = {}
        self._options = Options()
        self._waiting: deque[Parcel] = deque(maxlen=0)
        self._last = -float("inf")
        self._timer: asyncio.TimerHandle | None = None

    @property
    def used(self) -> bool:
        """Whether any is left."""
        return bool(self._wishes)

    def add(self, identity: str, options: Options) -> None:
        """One more, or other options for one; CommandError: there are too many."""
        if identity not in self._wishes and len(self._wishes) >= MOST_IDS:
            raise CommandError(
                f"subscribe: {self.topic} has {MOST_IDS} subscriptions of this client; no more are accepted"
            )
        self._wishes[identity] = options
        self._choose()

    def remove(self, identity: str | None) -> None:
        """End one, or all."""
        if identity is None:
            self._wishes.clear()
        else:
            self._wishes.pop(identity, None)
        if self._wishes:
            self._choose()
        else:
            self.end()

    def end(self) -> None:
        """Send nothing more."""
        self._waiting.clear()
        self._outgoing.forget(self)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def take(self, parcel: Parcel) -> None:
        """A message was published."""
        now = asyncio.get_running_loop().time()
        if self._timer is None and now - self._last >= self._options.throttle:
            self.send(parcel, now)
        elif self._options.queue:
            self._waiting.append(parcel)
            if self._timer is None:
                self._wait()

    def send(self, parcel: Parcel, now: float) -> None:
        """Send a message whatever the throttle."""
        self._last = now
        chosen = self._options
        make = functools.partial(parcel.frames, self.topic, chosen.compression, chosen.fragment_size)
        self._outgoing.message(self, make, chosen.compression.startswith("cbor"), parcel.weight, chosen.queue)

    def _wait(self) -> None:
        self._timer = asyncio.get_running_loop().call_at(self._last + self._options.throttle, self._due)

    def _due(self) -> None:
        self._timer = None
        if self._waiting:
            self.send(self._waiting.popleft(), asyncio.get_running_loop().time())
        if self._waiting:
            self._wait()

    def _choose(self) -> None:
        wishes = self._wishes.values()
        sizes = [wish.fragment_size for wish in wishes if wish.fragment_size]
        compressions = {wish.compression for wish in wishes}
        self._options = Options(
            throttle=min(wish.throttle for wish in wishes),
            queue=min(wish.queue for wish in wishes),
            fragment_size=min(sizes, default=0),
            compression=next(name for name in ("png", "cbor-raw", "cbor", "none") if name in compressions),
        )
        self._waiting = deque(self._waiting, maxlen=self._options.queue)


ROSOUT = "/rosout"
LOG = "rosgraph_msgs/Log"
MOST_TOPICS = 10_000
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
            if len(self._topics) >= MOST_TOPICS:
                raise CommandError(f"topic {name}: there are already {MOST_TOPICS} topics; no more are accepted")
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


LONGEST_CALL = 600.0
"""Wall time after which a call has failed, unless it says otherwise, and at most [s]."""
MOST_CALLS = 256
"""Calls of one client that wait, at most."""
MOST_OFFERED = 256
"""Services that one client offers, at most."""


class Caller(Protocol):
    """A client, as far as services are concerned."""

    number: int
    sender: str
    """For people."""

    def send(self, message: dict[str, Any], options: Options = ...) -> None:
        """Send it an operation."""


@dataclass(frozen=True)
class Offered:
    """A service that a client offers."""

    type: str
    name: str
    """As that client writes it."""
    client: Caller


@dataclass(eq=False)
class Pending:
    """A call that waits for its answer."""

    caller: Caller
    identity: str | None
    name: str
    """The service, as the caller writes it."""
    type: str
    options: Options
    server: Caller | None
    """The client that answers; None: the simulation."""
    timer: asyncio.TimerHandle | None = None


class Services:
    """All services, and the calls that wait."""

    def __init__(self, network: Network, inbox: Inbox) -> None:
        self.table = Table()
        self.offered: dict[str, Offered] = {}
        self.built_in: dict[str, tuple[str, Callable[[Any], dict[str, Any]]]] = {}
        """rosapi's: type and answer of each, by name."""
        self._network = network
        self._inbox = inbox
        self._calls: dict[str, Pending] = {}
        self._numbers = itertools.count(1)

    def all(self) -> dict[str, str]:
        """Every service's type, by name."""
        types = {name: type_name for name, (type_name, _) in self.built_in.items()}
        types |= {name: offered.type for name, offered in self.offered.items()}
        types |= {name: ros1_name(service.type) for name, service in self.table.services.items()}
        return dict(sorted(types.items()))

    def advertise(self, name: str, offered: Offered) -> None:
        """Have a client offer a service; CommandError: there is one, or it offers too many."""
        holder = self.offered.get(name)
        if name in self.table.services or name in self.built_in or (holder and holder.client is not offered.client):
            raise CommandError(f"service {name}: it is already offered by {self.host(name)}")
        if sum(other.client is offered.client for other in self.offered.values()) >= MOST_OFFERED:
            raise CommandError(f"service {name}: a client may offer {MOST_OFFERED} services; no more are accepted")
        self.offered[name] = offered

    def unadvertise(self, name: str, client: Caller) -> None:
        """End a client's service; CommandError: it offers none of this name."""
        if name not in self.offered or self.offered[name].client is not client:
            raise CommandError(f"service {name}: this client does not offer it")
        del self.offered[name]

    def host(self, name: str) -> str:
        """Who offers a service, for people."""
        return self.offered[name].client.sender if name in self.offered else "the simulation"

    def call(
        self, name: str, written: str, caller: Caller, arguments: Any, now: float, identity: str | None,
        options: Options, timeout: float,
    ) -> None:  # fmt: skip
        """Call a service at a moment [s]; the answer goes to the caller. A VrxError: it cannot be called, and why."""
        if name in self.built_in:
            respond(caller, written, identity, options, self.built_in[name][1](arguments), True)
            return
        types = self.all()
        if name not in types:
            raise UnknownNameError("service", name, types)
        if sum(call.caller is caller for call in self._calls.values()) >= MOST_CALLS:
            raise CommandError(f"{name}: {MOST_CALLS} calls of this client wait for answers; no more are accepted")
        offered = self.offered.get(name)
        asked = self._asked(arguments, types[name], now, name)
        call = Pending(caller, identity, written, types[name], options, offered.client if offered else None)
        key = f"call_service:{name}:{next(self._numbers)}"
        self._calls[key] = call
        longest = min(timeout or LONGEST_CALL, LONGEST_CALL)
        call.timer = asyncio.get_running_loop().call_later(longest, self._late, key, longest)
        if offered is not None:
            offered.client.send({"op": "call_service", "id": key, "service": offered.name, "args": asked})
        else:
            self._inbox.call(name, asked, caller.sender, self._answer(key))

    def respond(self, key: str, server: Caller, values: Any, result: bool, now: float) -> None:
        """A client's answer to a call; CommandError: no call of this id waits for it, or it is no such response."""
        call = self._calls.get(key)
        if call is None or call.server is not server:
            raise CommandError(f"service_response: no call {key[:80]!r} waits for this client's answer")
        try:
            if result and f"{call.type}Response" in known_types():
                type_name = f"{call.type}Response"
                values = plain(taken({} if values is None else values, type_name, now, call.name), type_name)
        except VrxError as error:
            self._finish(key, f"the response of the service's client is wrong: {error}", False)
            raise
        self._finish(key, values if result or values is not None else "the service failed", result)

    def forget(self, client: Caller) -> None:
        """A client has gone, and what it offered and called with it."""
        self.offered = {name: offered for name, offered in self.offered.items() if offered.client is not client}
        for key, call in list(self._calls.items()):
            if call.caller is client:
                self._take(key)
            elif call.server is client:
                self._finish(key, f"{call.name}: the client that offers it has disconnected", False)

    def _asked(self, arguments: Any, type_name: str, now: float, name: str) -> Any:
        """The request: a message, but of a client's service what JSON holds."""
        known = f"{type_name}Request"
        if name not in self.offered:
            return request(arguments, known, now, name)
        if known not in known_types():
            return {} if arguments is None else arguments
        return plain(request(arguments, known, now, name), known)

    def _answer(self, key: str) -> Callable[[Message | None, str], None]:
        """What the simulation's thread calls."""
        return lambda response, why: self._network.soon(self._answered, key, response, why)

    def _answered(self, key: str, response: Message | None, why: str) -> None:
        if key in self._calls:
            failed = response is None
            values = why if failed else plain(response, f"{self._calls[key].type}Response")
            self._finish(key, values, not failed)

    def _late(self, key: str, seconds: float) -> None:
        self._finish(key, f"{self._calls[key].name}: no answer in {seconds:g} s", False)

    def _finish(self, key: str, values: Any, result: bool) -> None:
        call = self._take(key)
        respond(call.caller, call.name, call.identity, call.options, values, result)

    def _take(self, key: str) -> Pending:
        call = self._calls.pop(key)
        if call.timer is not None:
            call.timer.cancel()
        return call


def respond(caller: Caller, name: str, identity: str | None, options: Options, values: Any, result: bool) -> None:
    """Send the answer to a call."""
    message = {"op": "service_response", "service": name, "values": values, "result": result}
    caller.send(message if identity is None else message | {"id": identity}, options)
