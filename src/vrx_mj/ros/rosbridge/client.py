"""One client: its operations, one after the other."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from vrx_mj.errors import CommandError, UnknownNameError, VrxError
from vrx_mj.ros.intake import Place
from vrx_mj.ros.rosbridge.fragments import Fragments
from vrx_mj.ros.rosbridge.hub import Hub
from vrx_mj.ros.rosbridge.kinds import known_type, ros1_name
from vrx_mj.ros.rosbridge.outgoing import Outgoing
from vrx_mj.ros.rosbridge.pace import Pace
from vrx_mj.ros.rosbridge.png import from_png
from vrx_mj.ros.rosbridge.protocol import (
    MOST_INCOMING,
    Operation,
    Options,
    absolute,
    flag,
    number,
    operation,
    options,
    text,
)
from vrx_mj.ros.rosbridge.publishing import Publishing
from vrx_mj.ros.rosbridge.services import Offered, respond
from vrx_mj.ros.rosbridge.subscription import Subscription
from vrx_mj.ros.rosbridge.writing import reply_frames

__all__ = ["Client"]

LEVELS = ("none", "error", "warning", "info")
DEEPEST = 2
"""Operations within operations: a PNG in fragments."""
MOST_SUBSCRIPTIONS = 4096
TOO_SLOW = 1008
"""Why a connection is closed (RFC 6455: policy)."""


class Client:
    """A connection and what it has asked for."""

    def __init__(self, connection: ServerConnection, hub: Hub) -> None:
        host, port = connection.remote_address[:2]
        self.number = next(hub.numbers)
        self.sender = f"{host}:{port}"
        self.host = str(host)
        self._connection = connection
        self._hub = hub
        self._outgoing = Outgoing(hub.counts)
        self._pace = Pace(hub.flooding)
        self._fragments = Fragments(hub.fragments, Place(self.host, self.abort))
        self.is_silent = True
        self._subscriptions: dict[str, Subscription] = {}
        self._publishing = Publishing(hub, self.number, self.sender)
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
            "unadvertise_service": self._unadvertise_service,
            "set_level": self._set_level,
            "status_level": self._set_level,
            "status": lambda _message: None,
            "auth": _auth,
        }

    async def serve(self) -> None:
        """Do what it asks until it goes."""
        self._hub.clients[self.number] = self
        writing = asyncio.create_task(self._outgoing.run(self._send, self._unwritten))
        writing.add_done_callback(self._stopped)
        try:
            while True:
                data = await self._connection.recv()
                self.is_silent = False
                begin = time.perf_counter()
                self._incoming(data)
                await self._pace.spent(time.perf_counter() - begin)
        except ConnectionClosed:
            pass
        finally:
            del self._hub.clients[self.number]
            writing.cancel()
            await asyncio.gather(writing, return_exceptions=True)
            self._forget()

    def send(self, message: dict[str, Any], options: Options = Options()) -> None:  # noqa: B008  # it is frozen
        """Send an operation that is no topic's message; a client that takes none has to go."""
        frames, binary = reply_frames(message, options.compression, options.fragment_size)
        if not self._outgoing.reply(frames, binary):
            self._hub.tell_once(self.host, "slow", f"{self.sender} does not read its answers, and was disconnected")
            self.abort()

    def abort(self) -> None:
        """End the connection at once."""
        self._connection.transport.abort()

    def status(self, level: str, what: str, identity: object = None) -> None:
        """Tell it what is wrong, if it wants to know of that level."""
        if LEVELS.index(level) <= LEVELS.index(self._level):
            message = {"op": "status", "level": level, "msg": what}
            self.send(message | {"id": identity} if isinstance(identity, str) else message)

    async def _send(self, frame: bytes, binary: bool) -> None:
        await self._connection.send(frame, text=not binary)

    def _stopped(self, writing: asyncio.Task[None]) -> None:
        if not writing.cancelled() and not isinstance(writing.exception(), ConnectionClosed):
            self._hub.tell_once(self.host, "write", f"{self.sender} was disconnected: {writing.exception()!r}")
            self.abort()

    def _unwritten(self, error: Exception) -> None:
        self._hub.tell_once("", str(error), f"a message cannot be written: {type(error).__name__}: {error}")

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
        self._hub.tell_once(self.host, kind if kind in self._operations else "", why)
        self.status("error", why, message.get("id"))

    def _handle(self, message: Operation, depth: int) -> None:
        kind = message["op"]
        if kind in {"fragment", "png"}:
            if depth >= DEEPEST:
                raise CommandError(f"{kind}: nested operations are more than {DEEPEST} deep")
            inner = self._fragments.add(message) if kind == "fragment" else from_png(_data(message), MOST_INCOMING)
            if inner is not None:
                self._handle(operation(inner), depth + 1)
            return
        if kind not in self._operations:
            raise UnknownNameError("operation", kind[:40], [*self._operations, "fragment", "png"])
        self._operations[kind](message)

    def _advertise(self, message: Operation) -> None:
        name = absolute(text(message, "topic"))
        self._publishing.advertise(name, known_type(text(message, "type")), flag(message, "latch", False))

    def _unadvertise(self, message: Operation) -> None:
        self._publishing.unadvertise(absolute(text(message, "topic")))

    def _publish(self, message: Operation) -> None:
        name = absolute(text(message, "topic"))
        if not self._publishing.has(name):
            known = text(message, "type", "") or self._hub.topics.type_of(name)
            if known is None:
                raise CommandError(f"publish: the type of topic {name} is not known; advertise it first")
            self._publishing.advertise(name, known_type(known), flag(message, "latch", False))
        self._publishing.publish(name, message.get("msg", {}))

    def _subscribe(self, message: Operation) -> None:
        written, identity, wish = text(message, "topic"), text(message, "id", ""), options(message)
        name = absolute(written)
        asked = text(message, "type", "")
        known = self._hub.topics.type_of(name)
        if not asked and known is None:
            raise CommandError(f"subscribe: the type of topic {name} is not known yet; give it as type")
        if written not in self._subscriptions and len(self._subscriptions) >= MOST_SUBSCRIPTIONS:
            raise CommandError(f"subscribe: this client has {MOST_SUBSCRIPTIONS} topics; no more are accepted")
        subscription = self._subscriptions.get(written) or Subscription(written, self._outgoing)
        subscription.add(identity, wish)
        topic = self._hub.topics.join(name, known_type(asked or known or ""))
        self._subscriptions[written] = subscription
        for parcel in self._hub.topics.listen(name, topic, self.number, subscription):
            subscription.send(parcel, asyncio.get_running_loop().time())

    def _unsubscribe(self, message: Operation) -> None:
        written = text(message, "topic")
        subscription = self._subscriptions.get(written)
        if subscription is None:
            self.status("warning", f"unsubscribe: {written} is not subscribed", message.get("id"))
            return
        subscription.remove(text(message, "id") if message.get("id") is not None else None)
        if not subscription.used:
            del self._subscriptions[written]
            self._hub.topics.leave(absolute(written), self.number, subscription)

    def _call_service(self, message: Operation) -> None:
        written = text(message, "service")
        identity = text(message, "id", "") if message.get("id") is not None else None
        try:
            wish, timeout = options(message), number(message, "timeout", 1e9)
            self._hub.services.call(
                absolute(written), written, self, message.get("args"), self._hub.now, identity, wish, timeout
            )
        except VrxError as error:
            respond(self, written, identity, Options(), str(error), False)

    def _service_response(self, message: Operation) -> None:
        result = flag(message, "result", True)
        self._hub.services.respond(text(message, "id"), self, message.get("values"), result, self._hub.now)

    def _advertise_service(self, message: Operation) -> None:
        written = text(message, "service")
        self._hub.services.advertise(absolute(written), Offered(ros1_name(text(message, "type")), written, self))

    def _unadvertise_service(self, message: Operation) -> None:
        self._hub.services.unadvertise(absolute(text(message, "service")), self)

    def _set_level(self, message: Operation) -> None:
        level = text(message, "level")
        if level not in LEVELS:
            raise CommandError(f"set_level: invalid level {level!r}; allowed: {', '.join(LEVELS)}")
        self._level = level

    def _forget(self) -> None:
        self._pace.end()
        self._fragments.end()
        for written, subscription in self._subscriptions.items():
            subscription.end()
            self._hub.topics.leave(absolute(written), self.number, subscription)
        self._publishing.end()
        self._hub.services.forget(self)


def _auth(_message: Operation) -> None:
    raise CommandError("auth: this server has no authentication; leave it out")


def _data(message: Operation) -> str:
    data = message.get("data")
    if not isinstance(data, str):
        raise CommandError(f"{message['op']}: data is missing, or not a string")
    return data
