"""Topics and services: those of the table, and those that clients make among themselves."""

import asyncio
import functools
import inspect
import itertools
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar

from vrx_mj.arguments import check_name
from vrx_mj.errors import CommandError, VrxError
from vrx_mj.ros.graph import Graph, Service, Wire
from vrx_mj.ros.interface import Answer
from vrx_mj.ros.limits import Frame, Outbox
from vrx_mj.ros.messages import Message, known_types, ros1_name
from vrx_mj.ros.rosbridge.codec import Options, Parcel, message_of, plain, request

QueuedFrames = tuple[Callable[[], Iterable[Frame]], bool]
"""Frames for a client: the function that makes them when they can be sent, and whether they are binary."""
_NODE_PREFIX = "/rosbridge/client_"
"""Prefix of the names of clients as nodes."""
_LONGEST_CALL = 600.0
"""Wall time after which a call has failed, unless it gives another, and longest time that it may give [s]."""
_MOST_ELSEWHERE = 64
"""Largest number of simultaneous calls of services of other processes: each has a connection."""


class Subscription:
    """All of a client's subscriptions of one topic: it gets every message once, as rosbridge_server has it.

    Where they differ, the shortest throttle, queue and fragment count, and png before cbor-raw, cbor and none.
    A throttle without a queue drops what comes too early; with a queue that waits, and the oldest is dropped.
    """

    def __init__(self, topic: str, outbox: Outbox[QueuedFrames]) -> None:
        self.topic = topic
        """Name of the topic as the client writes it; messages carry this name."""
        self._outbox = outbox
        self._wishes: dict[str, Options] = {}
        self._options = Options()
        self._waiting: deque[Parcel] = deque(maxlen=0)
        self._last = -float("inf")
        self._timer: asyncio.TimerHandle | None = None

    def __len__(self) -> int:
        return len(self._wishes)

    def add(self, identity: str, options: Options) -> None:
        """Add one more, or change the options of one."""
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
        self._outbox.forget(self)
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
        make = functools.partial(parcel.frames, self.topic, chosen)
        self._outbox.push((make, chosen.is_binary), parcel.weight, self, chosen.queue)

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


def node_name(number: int) -> str:
    """The node that a client is to the others."""
    return f"{_NODE_PREFIX}{number}"


class Topics(Wire):
    """Topics of rosbridge's clients: a `Wire` (see `vrx_mj.ros.graph`)."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._listeners: dict[str, dict[int, list[Subscription]]] = {}
        """Subscriptions by topic and client."""

    def listen(self, name: str, type_name: str, client: int, subscription: Subscription) -> list[Parcel]:
        """Subscribe a client to a topic; returns the latched messages.

        Raises:
            CommandError: the topic has another type, or there are too many.
        """
        self.check(name, type_name)
        mine = self._listeners.setdefault(name, {}).setdefault(client, [])
        if subscription not in mine:
            mine.append(subscription)
        if len(mine) == 1:
            self._graph.register("subscriber", name, node_name(client), type_name)
        self.listened = frozenset(self._listeners)
        return [Parcel(message, type_name, self._graph.time) for message in self._graph.latched_messages(name)]

    def leave(self, name: str, client: int, subscription: Subscription) -> None:
        """End a subscription."""
        listeners = self._listeners[name]
        listeners[client].remove(subscription)
        if listeners[client]:
            return
        del listeners[client]
        if not listeners:
            del self._listeners[name]
            self.listened = frozenset(self._listeners)
        self._graph.unregister("subscriber", name, node_name(client))

    def deliver(self, name: str, type_name: str, message: Message) -> None:
        """Send a message to the clients that listen."""
        listeners = self._listeners.get(name)
        if not listeners:
            return
        try:
            parcel = Parcel(message, ros1_name(type_name), self._graph.time)
        except Exception as error:  # one that is not of its type must not stop the others
            text = f"rosbridge: {name}: a message is not a {type_name}: {type(error).__name__}: {error}"
            self._graph.notices.write("ERROR", "encode", name, text)
            return
        for subscriptions in listeners.values():
            for subscription in subscriptions:
                subscription.take(parcel)

    def check(self, name: str, type_name: str) -> None:
        """CommandError: the topic has another type."""
        known = self._graph.type_of(name)
        if known is not None and known != type_name:
            raise CommandError(f"topic {name} is a {known}, not a {type_name}")


_Answer = TypeVar("_Answer")


class Caller(Protocol):
    """A caller of a service."""

    number: int
    sender: str
    """For people."""

    def send(self, message: Mapping[str, object], options: Options = ...) -> None:
        """Send it an operation."""


@dataclass(frozen=True)
class Provider:
    """Client that provides a service to others."""

    type: str
    name: str
    """Name of the service as the client writes it."""
    client: Caller


class Pending(NamedTuple):
    """A call that waits for a client's answer."""

    server: Caller
    type: str
    name: str
    """The service, as the caller writes it."""
    answer: "asyncio.Future[tuple[object, bool]]"
    """Values, and whether they are a response."""


class Services:
    """The calls of clients, and what they offer to each other and to the other wires."""

    def __init__(self, graph: Graph) -> None:
        self.offered: dict[str, Provider] = {}
        self.built_in: dict[str, Callable[[object], object]] = {}
        """rosapi's answers, by name."""
        self._graph = graph
        self._calls: dict[str, Pending] = {}
        self._tasks: dict[asyncio.Task[None], Caller | None] = {}
        """Calls that wait for their answers, and the clients that call; None: others."""
        self._elsewhere = asyncio.Semaphore(_MOST_ELSEWHERE)
        self._numbers = itertools.count(1)

    def build_in(self, name: str, type_name: str, answer: Callable[[object], object]) -> None:
        """Provide a service that takes and gives what JSON holds, or something to wait for that does."""
        self.built_in[name] = answer
        only_here = "only clients of rosbridge can call rosapi"
        self._graph.provide(name, Service(self._graph.node, type_name, lambda *call: call[-1](None, only_here)))

    def advertise(self, name: str, offered: Provider) -> None:
        """Register a client as a service's provider; CommandError: another one provides it."""
        holder = self.offered.get(name)
        if self._graph.registrations.apis("service", name) and (holder is None or holder.client is not offered.client):
            raise CommandError(f"service {name}: it is already offered by {self.host(name)}")
        self.offered[name] = offered

        async def ask(request: Message, answer: Answer) -> None:
            try:
                values, result = await self._forward(offered, name, plain(request, f"{offered.type}Request"), 0.0)
                response = message_of(values, f"{offered.type}Response", 0.0, name) if result else None
                answer(response, "" if result else str(values))
            except VrxError as error:
                answer(None, str(error))

        def call(request: Message, _caller: str, answer: Answer) -> None:
            self._begin(ask(request, answer))

        self._graph.provide(name, Service(node_name(offered.client.number), offered.type, call))

    def unadvertise(self, name: str, client: Caller) -> None:
        """End a client's service; CommandError: it offers none of this name."""
        if name not in self.offered or self.offered[name].client is not client:
            raise CommandError(f"service {name}: this client does not offer it")
        del self.offered[name]
        self._graph.unregister("service", name, node_name(client.number))

    def host(self, name: str) -> str:
        """Provider of a service, for people."""
        if name in self.offered:
            return self.offered[name].client.sender
        node = next(iter(self._graph.registrations.holders("service", name)), self._graph.node)
        return node if node != self._graph.node else "the simulation"

    def call(
        self, name: str, written: str, caller: Caller, arguments: object, identity: str | None, options: Options,
        timeout: float,
    ) -> None:  # fmt: skip
        """Call a service; the answer goes to the caller. A VrxError: it cannot be called, and why."""
        check_name("service", name, self._graph.registrations.names("service"))
        made = self.built_in[name](arguments) if name in self.built_in else None
        if made is not None and not inspect.isawaitable(made):
            respond(caller, written, identity, options, made, True)
            return

        async def run() -> None:
            try:
                if made is not None:
                    values, result = await _in_time(made, written, timeout), True
                else:
                    values, result = await self._answer(name, written, caller, arguments, timeout)
            except Exception as error:  # also a mistake of ours must not leave the caller without an answer
                why = f"no answer: {str(error) or type(error).__name__}"
                values, result = str(error) if isinstance(error, VrxError) else why, False
            respond(caller, written, identity, options, values, result)

        self._begin(run(), caller)

    def respond(self, key: str, server: Caller, values: object, result: bool) -> None:
        """A client's answer to a call; CommandError: no call of this id waits for it, or the response is invalid.

        As in rosbridge_suite's program, and not in the text of its protocol, a response is one whatever its `result`.
        """
        call = self._calls.get(key)
        if call is None or call.server is not server:
            raise CommandError(f"service_response: no call {key[:80]!r} is waiting for this client's answer")
        kind = f"{call.type}Response"
        try:
            if kind in known_types() and (result or isinstance(values, dict)):
                made = message_of({} if values is None else values, kind, self._graph.time, call.name)
                values, result = plain(made, kind), True
        except VrxError as error:
            call.answer.set_exception(CommandError(f"the response of the service's client is invalid: {error}"))
            raise
        finally:
            del self._calls[key]
        call.answer.set_result((values if result or values is not None else "the service failed", result))

    def forget(self, client: Caller) -> None:
        """A client has gone, and what it offered and called with it."""
        self.offered = {name: offered for name, offered in self.offered.items() if offered.client is not client}
        for task in [task for task, caller in self._tasks.items() if caller is client]:
            task.cancel()
        for call in [call for call in self._calls.values() if call.server is client and not call.answer.done()]:
            call.answer.set_exception(CommandError(f"{call.name}: the client that offers it has disconnected"))

    def held_by(self, client: Caller) -> int:
        """How many services a client offers, and calls it waits for."""
        offered = sum(one.client is client for one in self.offered.values())
        return offered + sum(caller is client for caller in self._tasks.values())

    def _begin(self, work: Coroutine[object, None, None], caller: Caller | None = None) -> None:
        """Begin work that waits for an answer, as a task of its caller."""
        task: asyncio.Task[None] = asyncio.create_task(work)
        self._tasks[task] = caller
        task.add_done_callback(self._tasks.pop)

    async def _answer(
        self, name: str, written: str, caller: Caller, arguments: object, timeout: float
    ) -> tuple[object, bool]:
        """Values of the answer to a call, and whether they are a response."""
        now, service, offered = self._graph.time, self._graph.services.get(name), self.offered.get(name)
        if offered is not None:
            known = f"{offered.type}Request"  # where the type is not known, what JSON holds
            asked = plain(request(arguments, known, now, name), known) if known in known_types() else arguments or {}
            return await self._forward(offered, written, asked, timeout)
        if service is not None:
            type_name, asking = service.type, request(arguments, f"{service.type}Request", now, name)
            response = await _in_time(self._graph.call(service, asking, caller.sender), written, timeout)
        else:
            answer = self._call_elsewhere(name, arguments)
            type_name, response = await _in_time(answer, written, timeout)
        return plain(response, f"{type_name}Response"), True

    async def _forward(self, offered: Provider, written: str, asked: object, timeout: float) -> tuple[object, bool]:
        """Pass a call to the client that answers it."""
        key, answer = f"call_service:{written}:{next(self._numbers)}", asyncio.get_running_loop().create_future()
        self._calls[key] = Pending(offered.client, offered.type, written, answer)
        offered.client.send({"op": "call_service", "id": key, "service": offered.name, "args": asked})
        try:
            return await _in_time(answer, written, timeout)
        finally:
            self._calls.pop(key, None)

    async def _call_elsewhere(self, name: str, arguments: object) -> tuple[str, Message | None]:
        """The type and the response of a service of another process."""
        assert self._graph.remote_call is not None, "who else has registered it"
        async with self._elsewhere:
            return await self._graph.remote_call(
                name, lambda type_name: request(arguments, f"{type_name}Request", self._graph.time, name)
            )


async def _in_time(answer: Awaitable[_Answer], name: str, timeout: float) -> _Answer:
    """Await the answer to a service call for so long [s] at most; CommandError without an answer."""
    longest = min(timeout or _LONGEST_CALL, _LONGEST_CALL)
    limit = asyncio.timeout(longest)
    try:
        async with limit:
            return await answer
    except TimeoutError:
        raise CommandError(f"{name}: no answer{f' in {longest:g} s' if limit.expired() else ''}") from None


def respond(caller: Caller, name: str, identity: str | None, options: Options, values: object, result: bool) -> None:
    """Send the answer to a call."""
    message = {"op": "service_response", "service": name, "values": values, "result": result}
    caller.send(message if identity is None else message | {"id": identity}, options)
