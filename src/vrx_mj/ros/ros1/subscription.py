"""A topic that we listen to over TCPROS: a connection to each publisher, made anew while it is registered."""

import asyncio
import socket
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import Intake, Place, Stall
from vrx_mj.ros.messages import Message, decode, encode, full_text, is_known, md5sum, service_md5sum
from vrx_mj.ros.network import Notices
from vrx_mj.ros.parameters import LONGEST
from vrx_mj.ros.ros1.connection import LARGEST_HEADER, Splitter, decode_header, encode_header, with_length
from vrx_mj.ros.ros1.publication import keep_alive
from vrx_mj.ros.ros1.xmlrpc import BROKEN, LARGEST_REPLY, Proxy, address

MOST_PUBLISHERS = 64
_LARGEST_MESSAGE = 1 << 22
"""Bytes, at most: commands are small."""
_LARGEST_LATCHED = 1 << 20
"""Bytes of a latched message that is kept for who subscribes later, at most."""
_LONGEST_CALL = 600.0
"""Wall time that a service may take [s]."""
_MOST_AT_ONCE = 64
"""Messages of one piece of a stream that are read; only the newest ones."""
_MOST_PER_SECOND = 5000
"""Messages of one publisher; if there are more, it has to wait."""
_HANDSHAKE = 10.0
"""Wall time in which a connection must be made [s]."""
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 8.0
"""Wall time until a connection is tried again [s]."""


@dataclass(eq=False)
class Subscription:
    """A topic that nodes of this process listen to, and its publishers elsewhere."""

    node: str
    """Name of our own node."""
    name: str
    """Name of the topic."""
    type: str
    """Type of its messages."""
    take: Callable[[str, Message, str, bool], None]
    """Takes the topic, a message, who sent it, and whether its publisher latches it."""
    intake: Intake
    """Bounds what has begun to come."""
    notices: Notices
    own: str = ""
    """URI of the nodes of this process, whose messages come another way."""
    has_room: Callable[[], bool] = lambda: True
    """Whether there may be one more connection."""
    sources: dict[str, "Source"] = field(default_factory=dict)
    """Sources by the publisher's URI."""
    last_number: int = 0

    def update(self, uris: Iterable[str]) -> None:
        """These are the publishers now."""
        wanted = list(dict.fromkeys(uri for uri in uris if len(uri) <= LONGEST and uri != self.own))[:MOST_PUBLISHERS]
        for uri in set(self.sources) - set(wanted):
            self.sources.pop(uri).close()
        for uri in wanted:
            if uri not in self.sources and not self.has_room():
                text = f"{self.name}: too many publishers are connected; no messages from {uri}"
                self.notices.write("WARN", "publishers", self.name, text)
            elif uri not in self.sources:
                self.last_number += 1
                self.sources[uri] = Source(self, uri, self.last_number)

    def header(self) -> dict[str, str]:
        """Our own header."""
        return {
            "callerid": self.node,
            "md5sum": md5sum(self.type),
            "message_definition": full_text(self.type),
            "tcp_nodelay": "1",
            "topic": self.name,
            "type": self.type,
        }

    async def close(self) -> None:
        """Close all connections."""
        tasks = [source.close() for source in self.sources.values()]
        self.sources.clear()
        await asyncio.gather(*tasks, return_exceptions=True)


class Source:
    """A publisher of another process."""

    def __init__(self, topic: Subscription, uri: str, number: int) -> None:
        self.topic, self.uri, self.number = topic, uri, number
        self.received = self.messages = 0
        self.receiver: Receiver | None = None
        self._task = asyncio.get_running_loop().create_task(self._run())

    def close(self) -> asyncio.Task[None]:
        """Leave it; the task ends soon."""
        self._task.cancel()
        return self._task

    def info(self) -> list[object]:
        """The row of this connection in `getBusInfo`."""
        name = self.topic.name
        there = here = ("?", 0)
        if self.receiver is not None and self.receiver.transport is not None:
            there = self.receiver.transport.get_extra_info("peername") or there
            here = self.receiver.transport.get_extra_info("sockname") or here
        about = f"TCPROS connection on port {here[1]} to [{there[0]}:{there[1]} on socket {self.number}]"
        return [self.number, self.uri, "i", "TCPROS", name, self.receiver is not None, about]

    async def _run(self) -> None:
        pause = FIRST_PAUSE
        while True:
            before = self.messages
            try:
                await self._listen()
            except (*BROKEN, Fault) as error:
                why = str(error) or "it does not answer"
                text = f"{self.topic.name}: no messages from its publisher at {self.uri}: {why}"
                self.topic.notices.write("WARN", "publisher", f"{self.topic.name} {self.uri}", text)
            pause = FIRST_PAUSE if self.messages > before else min(2.0 * pause, LONGEST_PAUSE)
            await asyncio.sleep(pause)

    async def _listen(self) -> None:
        """Connect, and stay until the connection ends."""
        host, port = await self._where()
        loop = asyncio.get_running_loop()
        async with asyncio.timeout(_HANDSHAKE):
            transport, receiver = await loop.create_connection(
                lambda: Receiver(self), host, port, family=socket.AF_INET
            )
        self.receiver = receiver
        try:
            await receiver.ended
        finally:
            self.receiver = None
            transport.abort()
            if receiver.ended.done() and not receiver.ended.cancelled():
                receiver.ended.exception()  # seen, even if nobody waits for it any more

    async def _where(self) -> tuple[str, int]:
        """Where the publisher sends this topic."""
        proxy = Proxy(self.uri, LARGEST_REPLY)
        try:
            answer = await proxy.ros("requestTopic", self.topic.node, self.topic.name, [["TCPROS"]])
        finally:
            proxy.close()
        match answer:
            case ["TCPROS", str(host), int(port), *_]:
                return address(f"tcpros://{host}:{port}", "tcpros")
        raise CommandError(f"it answers {str(answer)[:60]!r} instead of the address where it sends")


class Receiver(asyncio.Protocol):
    """The connection to a publisher."""

    def __init__(self, source: Source) -> None:
        loop = asyncio.get_running_loop()
        self.transport: asyncio.Transport | None = None
        self.ended: asyncio.Future[None] = loop.create_future()
        """Done when the connection is closed; CommandError: the publisher sends what it should not."""
        self._source, self._topic = source, source.topic
        self._loop = loop
        self._sender: str | None = None
        self._latching = False
        self._place = Place("?", self._abort)
        self._splitter = Splitter(LARGEST_HEADER, self._topic.intake, self._place)
        self._stall = Stall(self._abort)
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Say what is wanted."""
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        self._place.host = str((transport.get_extra_info("peername") or ("?",))[0])
        keep_alive(transport)
        transport.write(encode_header(self._topic.header()))
        self._timer = self._loop.call_later(_HANDSHAKE, transport.abort)

    def data_received(self, data: bytes) -> None:
        """A piece of what it sends."""
        if self.ended.done():
            return
        try:
            self._splitter.feed(data)
            if self._sender is None:
                self._take_header()
            if self._sender is not None:
                self._messages(self._sender)
        except CommandError as error:
            self.ended.set_exception(error)
            assert self.transport is not None
            self.transport.abort()

    def connection_lost(self, _: Exception | None) -> None:
        """It has ended."""
        if self._timer is not None:
            self._timer.cancel()
        self._stall.stop()
        self._splitter.rest()
        if not self.ended.done():
            self.ended.set_result(None)

    def _take_header(self) -> None:
        """The publisher's header, if it has come."""
        frame = self._splitter.take()
        if frame is None:
            return
        header = decode_header(frame)
        self._check(header)
        self._latching = header.get("latching") == "1"
        self._sender = header.get("callerid", "")[:LONGEST] or self._source.uri
        self._splitter.largest = _LARGEST_MESSAGE
        if self._timer is not None:
            self._timer.cancel()

    def _check(self, header: Mapping[str, str]) -> None:
        if "error" in header:
            raise CommandError(f"it reports: {header['error'][:300]}")
        sent, own = header.get("md5sum", ""), md5sum(self._topic.type)
        if sent not in {"*", own}:
            kind = header.get("type", "?")
            raise CommandError(f"it sends [{kind}/{sent}], but expected is [{self._topic.type}/{own}]")

    def _messages(self, sender: str) -> None:
        frames = []
        while (frame := self._splitter.take()) is not None:
            frames.append(frame)
        self._source.messages += len(frames)
        for frame in frames[-_MOST_AT_ONCE:]:
            self._source.received += len(frame)
            message, kept = decode(frame, self._topic.type), self._latching and len(frame) <= _LARGEST_LATCHED
            self._topic.take(self._topic.name, message, sender, kept)
        self._stall.holds(len(self._splitter))
        if len(frames) > _MOST_AT_ONCE:
            assert self.transport is not None
            self.transport.pause_reading()
            self._timer = self._loop.call_later(len(frames) / _MOST_PER_SECOND, self._resume)

    def _abort(self) -> None:
        if self.transport is not None:
            self.transport.abort()

    def _resume(self) -> None:
        if self.transport is not None and not self.transport.is_closing():
            self.transport.resume_reading()


async def call_service(
    uri: str, node: str, name: str, make: Callable[[str], Message] | None
) -> tuple[str, Message | None]:
    """Call a service at a URI as a node, with the request that `make` makes for its type; the type and the response.

    Without `make` nothing is called.

    Raises:
        CommandError: the service cannot be called, or refuses, and why.
        OSError, EOFError, TimeoutError: it does not answer.
    """
    host, port = address(uri, "rosrpc")
    async with asyncio.timeout(_HANDSHAKE):
        reader, writer = await asyncio.open_connection(host, port, family=socket.AF_INET)
    try:
        async with asyncio.timeout(_HANDSHAKE):
            probe = {} if make is not None else {"probe": "1"}
            writer.write(encode_header({"callerid": node, "md5sum": "*", "service": name} | probe))
            header = decode_header(await _frame(reader, LARGEST_HEADER))
        type_name = header.get("type", "")
        if "error" in header or not type_name:
            raise CommandError(f"{name}: {header.get('error', 'its type is not known')[:300]}")
        if make is None:
            return type_name, None
        if not (is_known(f"{type_name}Request") and is_known(f"{type_name}Response")):
            raise CommandError(f"{name} has the type {type_name}, which is not known here")
        if header.get("md5sum") not in {"*", service_md5sum(type_name)}:
            raise CommandError(f"{name}: its {type_name} differs from the one that is known here")
        writer.write(with_length(encode(make(type_name), f"{type_name}Request")))
        async with asyncio.timeout(_LONGEST_CALL):
            done = await reader.readexactly(1)
            body = await _frame(reader, _LARGEST_MESSAGE)
        if done != b"\x01":
            raise CommandError(f"{name}: {body[:1000].decode('utf-8', 'replace')}")
        return type_name, decode(body, f"{type_name}Response")
    finally:
        writer.transport.abort()


async def _frame(reader: asyncio.StreamReader, largest: int) -> bytes:
    size = int.from_bytes(await reader.readexactly(4), "little")
    if size > largest:
        raise CommandError(f"a frame of {size} bytes, where at most {largest} are allowed")
    return await reader.readexactly(size)
