"""rosbridge: the server in the network's loop, and its clients, whose operations run one after the other."""

import asyncio
import contextlib
import functools
import http
import itertools
import json
import logging
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from vrx_mj.errors import CommandError, NetworkError, UnknownNameError, VrxError
from vrx_mj.ros import messages
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Traffic
from vrx_mj.ros.limits import ConnectionLimit, Counts, Frame, Intake, Outbox, Pace, Place, pieces
from vrx_mj.ros.messages import known_type, ros1_name
from vrx_mj.ros.network import Names, Notices, Origins, checked_origins, end_tasks, host_of, is_address, refusal
from vrx_mj.ros.rosbridge.codec import (
    MOST_INCOMING,
    Operation,
    Options,
    absolute,
    flag,
    from_png,
    message_of,
    number,
    operation,
    options,
    reply_frames,
    text,
)
from vrx_mj.ros.rosbridge.nodes import Republisher, Rosapi
from vrx_mj.ros.rosbridge.topics import Provider, QueuedFrames, Services, Subscription, Topics, node_name, respond

MOST_CONNECTIONS = 512
"""Largest number of clients."""
_MOST_FRAGMENTS = 1 << 25
"""Largest size of all clients' fragments that wait for the rest of their messages [characters]."""
_FRAGMENT_OVERHEAD = 100
"""Size that a fragment counts for in addition to its own [characters]."""
CLIENTS_SHARE = 0.5
"""Share of the time that messages of all clients may take in the long run."""
CLIENT_BURST = 0.2
"""Time that the messages of one client may take at once [s]."""
MOST_ANSWERS, MOST_MESSAGES = 2000, 1000
"""Largest numbers of answers and of messages that wait for a client; one with more unread answers is disconnected."""
_LEVELS = ("none", "error", "warning", "info")
"""Levels of status messages."""
_MAX_DEPTH = 2
"""Largest depth of operations within operations: a PNG in fragments."""
MOST_HELD = 4096
"""Largest number of topics, services and calls of one client."""
PIECE = 1 << 17
"""Bytes of a frame that are sent at once."""
_HANDSHAKE_TIMEOUT = 10.0
"""Longest wall time of a handshake [s]."""
_ALIVE_TIMEOUT = 60.0
"""Wall time after which a client that does not answer is disconnected [s]."""
_CLOSE_TIMEOUT = 1.0
"""Longest wall time of closing [s]."""
_OPEN_TIMEOUT = 10.0
"""Longest wall time of opening [s]."""


class Hub:
    """The graph as clients see it, and the clients."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.counts = Counts()
        self.flooding: set[Pace] = set()
        self.connections = ConnectionLimit(MOST_CONNECTIONS)
        self.fragments = Intake(_MOST_FRAGMENTS)
        self.topics = Topics(graph)
        self.services = Services(graph)
        self.clients: dict[int, Client] = {}
        self.numbers = itertools.count(1)
        self._notices = Notices()
        self._rosapi = Rosapi(graph, self.services)

    def open(self) -> None:
        """Show the graph to clients, and them to it."""
        self.graph.wires.append(self.topics)
        self._rosapi.provide()
        Republisher(self.graph).open()

    def report_once(self, peer: str, kind: str, text: str) -> None:
        """Log a warning, once for a peer and kind of mistake."""
        self._notices.write("WARN", kind, peer, f"rosbridge: {peer}: {text}")


class Fragments:
    """A client's messages that are not whole yet. `intake` bounds those of all clients together."""

    def __init__(self, intake: Intake, place: Place) -> None:
        self._intake, self._place = intake, place
        self._open: dict[str, dict[int, str]] = {}
        self._size = 0

    def add(self, message: Operation) -> str | None:
        """Add a fragment, in any order; returns the whole message with the last one.

        Raises:
            CommandError: what is wrong with it.
        """
        identity, data = text(message, "id"), _data(message)
        total = _whole(message, "total", 1, MOST_INCOMING)
        index = _whole(message, "num", 0, total - 1)
        parts = self._open.setdefault(identity, {})
        before = parts.get(index)
        self._size += len(data) + _FRAGMENT_OVERHEAD - (0 if before is None else len(before) + _FRAGMENT_OVERHEAD)
        parts[index] = data
        if self._size > MOST_INCOMING:
            self.end()
            raise CommandError(f"fragment: more than {MOST_INCOMING} characters of incomplete messages")
        if len(parts) >= total:
            whole = "".join(parts[each] for each in sorted(parts))
            self._forget(identity)
            return whole
        self._intake.hold(self._place, self._size)
        return None

    def end(self) -> None:
        """Forget all fragments."""
        self._open.clear()
        self._size = 0
        self._intake.hold(self._place, 0)

    def _forget(self, identity: str) -> None:
        self._size -= sum(len(data) + _FRAGMENT_OVERHEAD for data in self._open.pop(identity).values())
        self._intake.hold(self._place, self._size)


def _whole(message: Operation, key: str, low: int, high: int) -> int:
    value = message.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise CommandError(f"fragment: invalid {key} {str(value)[:40]!r}; allowed: a whole number from {low} to {high}")
    return value


@dataclass
class Advertisement:
    """A topic on which a client publishes."""

    type: str
    latch: bool
    reported: bool = False
    """Whether it was reported that nothing subscribes to it."""
    kept: int = 0
    """Characters of the message that is kept."""


class Client:
    """A connection and what it has asked for."""

    def __init__(self, connection: ServerConnection, place: Place, hub: Hub) -> None:
        host, port = connection.remote_address[:2]
        self.number = next(hub.numbers)
        self.sender = f"{host}:{port}"
        self._connection, self._place = connection, place
        self._hub = hub
        self._filled = asyncio.Event()
        self._answers: Outbox[QueuedFrames] = Outbox(hub.counts, MOST_ANSWERS, self._filled.set)
        self._messages: Outbox[QueuedFrames] = Outbox(hub.counts, MOST_MESSAGES, self._filled.set)
        self._pace = Pace(CLIENTS_SHARE, CLIENT_BURST, hub.flooding)
        self._fragments = Fragments(hub.fragments, place)
        self._subscriptions: dict[str, Subscription] = {}
        self._topics: dict[str, Advertisement] = {}
        self._level = "error"
        self._operations: dict[str, Callable[[Operation], None]] = {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "service_response": self._service_response,
            "advertise_service": self._advertise_service,
            "unadvertise_service": lambda message: hub.services.unadvertise(absolute(text(message, "service")), self),
            "set_level": self._set_level,
            "status_level": self._set_level,
            "status": lambda _message: None,
            "auth": _auth,
        }

    async def serve(self) -> None:
        """Run its operations until it disconnects."""
        self._hub.clients[self.number] = self
        self._hub.connections.wait(self._place)
        is_settled = False
        writing = asyncio.create_task(self._write())
        writing.add_done_callback(self._note_end_of_writing)
        try:
            while True:
                data = await self._connection.recv()
                if not is_settled and not self._hub.connections.settle(self._place):
                    break
                is_settled = True
                begin = time.perf_counter()
                self._incoming(data)
                spent = time.perf_counter() - begin
                await asyncio.sleep(self._pace.wait(spent, asyncio.get_running_loop().time()))
        except ConnectionClosed:
            pass
        finally:
            del self._hub.clients[self.number]
            await end_tasks([writing])
            self._forget()

    def send(self, message: Mapping[str, object], options: Options = Options()) -> None:  # noqa: B008  # it is frozen
        """Send an operation other than a topic's message; a client that does not read them is disconnected."""
        frames = reply_frames(message, options)
        size = sum(map(len, itertools.chain.from_iterable(frames)))
        if self._answers.has_room(size):
            self._answers.push((lambda: frames, options.is_binary), size)
        else:
            self._hub.report_once(
                self._place.host, "slow", f"{self.sender} did not read its replies, and was disconnected"
            )
            self.abort()

    def abort(self) -> None:
        """End the connection at once."""
        self._connection.transport.abort()

    def status(self, level: str, what: str, identity: object = None) -> None:
        """Send it what is wrong, if it wants lines of that level."""
        if _LEVELS.index(level) <= _LEVELS.index(self._level):
            message = {"op": "status", "level": level, "msg": what}
            self.send(message | {"id": identity} if isinstance(identity, str) else message)

    async def _write(self) -> None:
        """Send all that waits, answers before messages of topics, until it is cancelled."""
        while True:
            await self._filled.wait()
            while (written := self._answers.pop() or self._messages.pop()) is not None:
                make, binary = written
                try:
                    frames = make()
                except Exception as error:  # a message that is not of its type must not stop the others
                    reason = f"a message cannot be written: {type(error).__name__}: {error}"
                    self._hub.report_once("", str(error), reason)
                    continue
                del written, make  # of what is being sent there is nothing else
                for frame in frames:
                    await self._send(frame, binary)
                    self._hub.counts.sent += sum(map(len, frame))
            self._filled.clear()

    async def _send(self, frame: Frame, binary: bool) -> None:
        small = sum(map(len, frame)) <= PIECE  # a connection holds no more than a piece for a client that does not read
        await self._connection.send(b"".join(frame) if small else pieces(frame, PIECE), text=not binary)

    def _note_end_of_writing(self, writing: asyncio.Task[None]) -> None:
        if not writing.cancelled() and not isinstance(writing.exception(), ConnectionClosed):
            self._hub.report_once(self._place.host, "write", f"{self.sender} was disconnected: {writing.exception()!r}")
            self.abort()

    def _incoming(self, data: str | bytes) -> None:
        message: Operation = {}
        try:
            message = operation(data)
            self._handle(message, 0)
        except VrxError as error:
            self._refuse(message, str(error))
        except Exception as error:  # a mistake of ours must not end what others do
            self._refuse(message, f"{type(error).__name__}: {error}")

    def _refuse(self, message: Operation, why: str) -> None:
        kind = message.get("op", "")
        self._hub.report_once(self._place.host, kind if kind in self._operations else "", why)
        self.status("error", why, message.get("id"))

    def _handle(self, message: Operation, depth: int) -> None:
        kind = message["op"]
        if kind in {"fragment", "png"}:
            if depth >= _MAX_DEPTH:
                raise CommandError(f"{kind}: nested operations are more than {_MAX_DEPTH} deep")
            inner = self._fragments.add(message) if kind == "fragment" else from_png(_data(message), MOST_INCOMING)
            if inner is not None:
                self._handle(operation(inner), depth + 1)
            return
        if kind not in self._operations:
            raise UnknownNameError("operation", kind[:40], [*self._operations, "fragment", "png"])
        self._operations[kind](message)

    def _check_room(self, message: Operation) -> None:
        """Refuse an operation after which the client would hold too much."""
        held = len(self._topics) + sum(map(len, self._subscriptions.values())) + self._hub.services.held_by(self)
        if held >= MOST_HELD:
            raise CommandError(
                f"{message['op']}: this client has {held} topics, services and calls; no more are accepted"
            )

    def _advertise(self, message: Operation) -> None:
        self._check_room(message)
        name, type_name = absolute(text(message, "topic")), known_type(text(message, "type"))
        self._publish_on(name, type_name, flag(message, "latch", False))

    def _publish_on(self, name: str, type_name: str, latch: bool) -> None:
        """Become a publisher of a topic; CommandError: it has another type."""
        if name not in self._topics:
            self._hub.topics.check(name, type_name)
            self._hub.graph.register("publisher", name, node_name(self.number), type_name, latched=latch)
        elif self._topics[name].type != type_name:
            raise CommandError(f"topic {name} is a {self._topics[name].type}, not a {type_name}")
        self._topics.setdefault(name, Advertisement(type_name, latch)).latch = latch  # what is kept still counts

    def _unadvertise(self, message: Operation) -> None:
        name = absolute(text(message, "topic"))
        if self._topics.pop(name, None) is None:
            raise CommandError(f"unadvertise: {name} is not advertised by this client")
        self._hub.graph.unregister("publisher", name, node_name(self.number))

    def _publish(self, message: Operation) -> None:
        graph, name = self._hub.graph, absolute(text(message, "topic"))
        if name not in self._topics:
            known = text(message, "type", "") or graph.type_of(name)
            if known is None:
                raise CommandError(f"publish: the type of topic {name} is not known; advertise it first")
            self._check_room(message)
            self._publish_on(name, known_type(known), flag(message, "latch", False))
        advertised, entry, value = self._topics[name], graph.table.inputs.get(name), message.get("msg", {})
        type_name = entry.type if entry else advertised.type
        made = message_of(value, type_name, graph.time, name)
        is_kept = advertised.latch and self._keep(name, len(json.dumps(value)))
        graph.publish(name, type_name, made, node_name(self.number), latched=is_kept, sender=self.sender)
        if not advertised.reported and not graph.registrations.apis("subscriber", name):
            advertised.reported = True
            graph.inbox.unknown_publisher(name, type_name, self.sender)
        if advertised.latch and not is_kept:
            raise CommandError(f"publish: {name} is latched, but {MOST_INCOMING} characters are already kept")

    def _keep(self, name: str, size: int) -> bool:
        """Whether a latched message of so many characters may be kept."""
        others = sum(advertised.kept for other, advertised in self._topics.items() if other != name)
        if others + size > MOST_INCOMING:
            return False
        self._topics[name].kept = size
        return True

    def _subscribe(self, message: Operation) -> None:
        written, identity, wish = text(message, "topic"), text(message, "id", ""), options(message)
        name = absolute(written)
        asked = text(message, "type", "")
        known = self._hub.graph.type_of(name)
        if not asked and known is None:
            raise CommandError(f"subscribe: the type of topic {name} is not known yet; give it as type")
        self._check_room(message)
        subscription = self._subscriptions.get(written) or Subscription(written, self._messages)
        subscription.add(identity, wish)
        type_name = known_type(asked or known or "")
        parcels = self._hub.topics.listen(name, type_name, self.number, subscription)
        self._subscriptions[written] = subscription
        for parcel in parcels:
            subscription.send(parcel, asyncio.get_running_loop().time())

    def _unsubscribe(self, message: Operation) -> None:
        written = text(message, "topic")
        subscription = self._subscriptions.get(written)
        if subscription is None:
            self.status("warning", f"unsubscribe: {written} is not subscribed", message.get("id"))
            return
        subscription.remove(text(message, "id") if message.get("id") is not None else None)
        if not subscription:
            del self._subscriptions[written]
            self._hub.topics.leave(absolute(written), self.number, subscription)

    def _call_service(self, message: Operation) -> None:
        written = text(message, "service")
        identity = text(message, "id", "") if message.get("id") is not None else None
        try:
            self._check_room(message)
            wish, timeout = options(message), number(message, "timeout", 1e9)
            self._hub.services.call(absolute(written), written, self, message.get("args"), identity, wish, timeout)
        except VrxError as error:
            respond(self, written, identity, Options(), str(error), False)

    def _service_response(self, message: Operation) -> None:
        result = flag(message, "result", True)
        self._hub.services.respond(text(message, "id"), self, message.get("values"), result)

    def _advertise_service(self, message: Operation) -> None:
        written = text(message, "service")
        self._check_room(message)
        self._hub.services.advertise(absolute(written), Provider(ros1_name(text(message, "type")), written, self))

    def _set_level(self, message: Operation) -> None:
        level = text(message, "level")
        if level not in _LEVELS:
            raise CommandError(f"set_level: invalid level {level!r}; allowed: {', '.join(_LEVELS)}")
        self._level = level

    def _forget(self) -> None:
        self._pace.end()
        self._answers.forget()
        self._fragments.end()
        for written, subscription in self._subscriptions.items():
            subscription.end()
            self._hub.topics.leave(absolute(written), self.number, subscription)
        for name in self._topics:
            self._hub.graph.unregister("publisher", name, node_name(self.number))
        self._hub.services.forget(self)
        self._hub.graph.forget(node_name(self.number))


def _auth(_message: Operation) -> None:
    raise CommandError("auth: this server has no authentication; leave it out")


def _data(message: Operation) -> str:
    data = message.get("data")
    if not isinstance(data, str):
        raise CommandError(f"{message['op']}: data is missing, or not a string")
    return data


_websockets_logger = logging.getLogger(f"{__name__}.websockets")
_websockets_logger.setLevel(logging.CRITICAL)  # it would print a traceback for each peer that speaks something else


class Socket(ServerConnection):
    """A connection, which gives way to new ones until its first message has come."""

    def __init__(self, connections: ConnectionLimit, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._connections = connections

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take a place among the connections."""
        super().connection_made(transport)
        self.place = Place(str(self.remote_address[0]), self.transport.abort)
        if not self._connections.enter(self.place):
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place up."""
        self._connections.leave(self.place)
        super().connection_lost(exc)


class Rosbridge:
    """A wire: a rosbridge v2 server, for roslibjs, roslibpy and what speaks like them.

    Every program that reaches the port may do everything. Pages that a browser shows reach it too: those of other sites
    than this machine's are refused by their `Origin` (see `Origins`), unless they are in `origins`. So is a page that
    asks for a name that is not this machine's (see `Names`), as its owner may have that name lead here. An address is
    taken whatever it is: no name server is asked for it, and it may be that of a router or a container's host.
    """

    def __init__(
        self,
        graph: Graph,
        *,
        port: int = 9090,
        host: str = "127.0.0.1",
        origins: Sequence[str] = (),
    ) -> None:
        """Prepare the server; nothing is opened yet, and port 0 is any that is free.

        Raises:
            NetworkError: the port is invalid.
            CommandError: an origin is invalid.
        """
        if not 0 <= port <= 65535:
            raise NetworkError(f"rosbridge: invalid port {port}; allowed: 1 to 65535, or 0 for any free one")
        self.port = port
        self.host = host
        self._network = graph.network
        self._hub = Hub(graph)
        self._server: Server | None = None
        self._origins = Origins(checked_origins(origins))
        self._names = Names([host, os.environ.get("ROS_HOSTNAME", ""), os.environ.get("ROS_IP", "")])

    def start(self) -> Sequence[str]:
        """Open it, and return lines with its address. NetworkError: it cannot be opened, and why."""
        messages.typestore()  # loading it takes a while: the first client should not wait
        try:
            self._network.call(self._open(), _OPEN_TIMEOUT)
        except (OSError, TimeoutError) as error:
            raise NetworkError(refusal("rosbridge", self.host, self.port, error)) from error
        shown = f"[{self.host}]" if ":" in self.host else self.host
        return [f"rosbridge: ws://{shown}:{self.port}"]

    @property
    def traffic(self) -> Traffic:
        """Traffic since the start."""
        counts = self._hub.counts
        return Traffic(len(self._hub.clients), counts.sent, counts.dropped)

    def close(self) -> None:
        """Withdraw all, close every connection, and wait until that is done."""
        if not self._network.loop.is_closed():
            with contextlib.suppress(TimeoutError):
                self._network.call(self._close(), 2.0 * _CLOSE_TIMEOUT)

    async def _open(self) -> None:
        self._server = await serve(
            self._serve,
            self.host,
            self.port,
            process_request=self._admit,
            compression=None,
            max_size=MOST_INCOMING,
            max_queue=2,
            open_timeout=_HANDSHAKE_TIMEOUT,
            ping_interval=_ALIVE_TIMEOUT / 2.0,
            ping_timeout=_ALIVE_TIMEOUT,
            close_timeout=_CLOSE_TIMEOUT / 2.0,
            logger=_websockets_logger,
            create_connection=functools.partial(Socket, self._hub.connections),  # type: ignore[arg-type]  # it makes one
        )
        self.port = self._server.sockets[0].getsockname()[1]
        self._hub.open()

    async def _serve(self, connection: ServerConnection) -> None:
        assert isinstance(connection, Socket)
        await Client(connection, connection.place, self._hub).serve()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """The response that refuses a handshake; None to accept it."""
        assert isinstance(connection, Socket)
        reached = str(connection.local_address[0])
        asked = ", ".join(request.headers.get_all("Host"))
        host = host_of(asked)
        for origin in request.headers.get_all("Origin"):  # programs send none
            if not (is_address(host) or self._names.has(host, reached)):
                reason = f"{ascii(asked)[:100]} is not a name of this machine; to give it that name, set ROS_HOSTNAME"
                return self._refusal(connection, http.HTTPStatus.MISDIRECTED_REQUEST, "host", reason)
            if not self._origins.welcome(origin, host):
                reason = f"pages of {ascii(origin)[1:-1][:200]} may not connect{_allowing(origin)}"
                return self._refusal(connection, http.HTTPStatus.FORBIDDEN, f"origin {origin}", reason)
        if not self._hub.connections.has_room(connection.place):
            reason = f"too many clients are connected; no more from {connection.place.host} are accepted"
            return self._refusal(connection, http.HTTPStatus.SERVICE_UNAVAILABLE, "crowd", reason)
        return None

    def _refusal(self, connection: Socket, status: http.HTTPStatus, kind: str, reason: str) -> Response:
        self._hub.report_once(connection.place.host, kind, reason)
        return connection.respond(status, f"{reason}\n")

    async def _close(self) -> None:
        if self._server is None:
            return
        self._server.close()
        try:
            await asyncio.wait_for(self._server.wait_closed(), _CLOSE_TIMEOUT)
        except TimeoutError:
            for client in self._hub.clients.values():
                client.abort()


def _allowing(origin: str) -> str:
    """How to allow an origin, if it is one."""
    try:
        return f"; to allow them: --allow-origin {checked_origins([origin])[0]}"
    except CommandError:
        return ""
