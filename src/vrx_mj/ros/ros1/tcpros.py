"""TCPROS: topics and services that nodes of this process provide, topics they listen to, and calls without a node.

A `Subscription` connects to each publisher, and connects anew for as long as the publisher is registered.
"""

import asyncio
import contextlib
import itertools
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.graph import Graph, Service
from vrx_mj.ros.limits import Counts, Intake, Outbox
from vrx_mj.ros.messages import (
    Message,
    decode,
    definition,
    encode,
    full_name,
    full_text,
    is_known,
    md5sum,
    service_md5sum,
    typestore,
)
from vrx_mj.ros.network import Notices, end_tasks
from vrx_mj.ros.parameters import MAX_NAME
from vrx_mj.ros.ros1.connection import (
    LARGEST_CALL,
    LARGEST_HEADER,
    LENGTH,
    Peer,
    decode_header,
    dial,
    encode_header,
    with_length,
)
from vrx_mj.ros.ros1.xmlrpc import CALL_ERRORS, DEFAULT_MASTER, Proxy, ask

_HIGH_WATER = 1 << 18
"""Bytes of a connection that asyncio holds before its outbox fills."""
_MOST_FRAMES = 256
"""Largest number of messages that wait for one subscriber."""
_WRITE_SIZE = 1 << 18
"""Bytes that are given to asyncio at one time: it copies what it cannot send."""
_MOST_IDLE_TALK = 1 << 16
"""Largest number of bytes that a subscriber may send after its header; they are ignored."""
_MOST_MET = 1000
"""Largest number of names of subscribers that are remembered."""
_REQUEST_TIMEOUT = 10.0
"""Wall time in which the request of a one-time caller must begin [s]."""
MOST_PUBLISHERS = 64
"""Largest number of publishers of a topic that a subscription connects to."""
_LARGEST_MESSAGE = 1 << 22
"""Largest incoming message [bytes]: commands are small."""
_LARGEST_LATCHED = 1 << 20
"""Largest latched message that is kept for later subscribers [bytes]."""
_LONGEST_CALL = 600.0
"""Longest wall time of a call of a service [s]."""
_READ_SIZE, _MOST_IN_A_BITE = 1 << 16, 1000
"""Bytes, and messages, that are taken from a stream at one time."""
_MOST_AT_ONCE = 64
"""Largest number of these messages that are read: only the newest."""
_MOST_PER_SECOND = 5000
"""Largest rate of the messages of one publisher [Hz]; a faster one has to wait."""
_HANDSHAKE_TIMEOUT = 10.0
"""Wall time in which a connection must be made [s]."""
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 8.0
"""First and longest wall time until a connection is tried again [s]."""
_LOOKUP_PERIOD = 0.2
"""Wall time between two requests for the address of a service [s]."""


class Stream:
    """Common part of a node's publications."""

    def __init__(self, node: str) -> None:
        self.node = node
        self.counts = Counts()
        self.numbers = itertools.count(1)
        """Numbers of connections."""


class Publication:
    """A topic of the nodes of this process, and its subscribers."""

    def __init__(
        self,
        stream: Stream,
        name: str,
        type_name: str,
        *,
        latched: bool = False,
        last: Callable[[], Sequence[Message]] = tuple,
    ) -> None:
        """`last`: gives the messages that new subscribers get."""
        self.stream, self.name, self.type, self.latched = stream, name, type_name, latched
        self._latest = last
        self.readers: set[Reader] = set()
        self.met: set[str] = set()
        """Nodes that have ever connected."""
        self._sequence = 0
        self._kind: Any = typestore().get_msgdef(full_name(type_name))
        self._numbered = definition(type_name).startswith(("Header header\n", "std_msgs/Header header\n"))

    def refusal(self, header: Mapping[str, str]) -> str | None:
        """Why somebody cannot subscribe."""
        if len(self.met) >= _MOST_MET:
            self.met.clear()
        self.met.add(header["callerid"][:MAX_NAME])
        wanted, own = header["md5sum"], md5sum(self.type)
        kind = header.get("type", "*")
        if kind not in {"*", self.type}:
            return f"topic types do not match: [{kind}] vs. [{self.type}]"
        if wanted in {"*", own}:
            return None
        return (
            f"Client [{header['callerid']}] wants topic [{self.name}] to have datatype/md5sum "
            f"[{kind}/{wanted}], but our version has [{self.type}/{own}]. Dropping connection."
        )

    def reply(self) -> dict[str, str]:
        """Our own header."""
        return {
            "callerid": self.stream.node,
            "latching": "1" if self.latched else "0",
            "md5sum": md5sum(self.type),
            "message_definition": full_text(self.type),
            "topic": self.name,
            "type": self.type,
        }

    def join(self, reader: "Reader") -> None:
        """Add a subscriber, to whom our header has been sent."""
        self.readers.add(reader)
        for message in self._latest():
            with contextlib.suppress(Exception):  # whatever rosbags raises of one of another type
                reader.send(self._frame(message))

    def send(self, message: Message) -> None:
        """Send a message to all who are there.

        Raises:
            Exception: whatever rosbags raises of a message of another type.
        """
        frame = self._frame(message) if self.readers else bytearray()
        for reader in self.readers:
            reader.send(frame)

    def close(self) -> None:
        """Close all connections."""
        for reader in self.readers:
            reader.peer.close()

    def _frame(self, message: Message) -> bytearray:
        """A message with its length before it, written once and without copies: pictures have some MB."""
        size = self._kind.getsize_ros1(0, message, typestore())
        frame = bytearray(LENGTH.size + size)
        LENGTH.pack_into(frame, 0, size)
        end = self._kind.serialize_ros1(memoryview(frame), LENGTH.size, message, typestore())
        assert end == len(frame)
        if self._numbered:  # as roscpp and rospy do: messages are numbered by who publishes them
            LENGTH.pack_into(frame, LENGTH.size, self._sequence & 0xFFFFFFFF)
            self._sequence += 1
        return frame


class Reader:
    """A subscriber elsewhere. What it does not take in time waits in an outbox, and the oldest of that goes first."""

    def __init__(self, publication: Publication, peer: Peer, node: str) -> None:
        self.publication, self.peer, self.node = publication, peer, node
        self.number = next(publication.stream.numbers)
        self.sent = self.messages = 0
        self._outbox: Outbox[bytearray] = Outbox(publication.stream.counts, _MOST_FRAMES, self._write)
        self._rest = memoryview(b"")
        """Rest of the message being sent that asyncio has not been given yet."""
        self._full = asyncio.Event()
        peer.writer.transport.set_write_buffer_limits(high=_HIGH_WATER)

    def send(self, frame: bytearray) -> None:
        """Send a message now or later."""
        self._outbox.push(frame, len(frame))

    async def stay(self) -> None:
        """Send until it leaves, or talks: nothing is expected of it."""
        writing = asyncio.create_task(self._write_rest())
        try:
            await self.peer.reader.readexactly(_MOST_IDLE_TALK)
        finally:
            writing.cancel()
            self.publication.readers.discard(self)
            self._outbox.forget()

    async def _write_rest(self) -> None:
        """Go on when the connection takes more."""
        with contextlib.suppress(OSError):
            while True:
                await self._full.wait()
                self._full.clear()
                await self.peer.writer.drain()
                self._write()

    def _write(self) -> None:
        """Send what there is until the connection is full."""
        transport = self.peer.writer.transport
        while not transport.is_closing():
            if transport.get_write_buffer_size() > _HIGH_WATER:
                self._full.set()
                return
            if not self._rest:
                frame = self._outbox.pop()
                if frame is None:
                    return
                self._rest = memoryview(frame)
                self.sent += len(frame)
                self.messages += 1
                self.publication.stream.counts.sent += len(frame)
            piece, self._rest = self._rest[:_WRITE_SIZE], self._rest[_WRITE_SIZE:]
            transport.write(piece)


@dataclass(eq=False)
class ServiceHost:
    """A service of a node of this process, and its callers."""

    graph: Graph
    name: str
    service: Service
    callers: set[Peer] = field(default_factory=set)

    def refusal(self, header: Mapping[str, str]) -> str | None:
        """Why somebody cannot call it."""
        kind = self.service.type
        if not (is_known(f"{kind}Request") and is_known(f"{kind}Response")):
            return f"[{self.name}] has the type [{kind}], which only clients of rosbridge can call"
        wanted, own = header["md5sum"], service_md5sum(kind)
        if wanted in {"*", own}:
            return None
        return f"request from [{header['callerid']}]: md5sums do not match: [{wanted}] vs. [{own}]"

    def reply(self) -> dict[str, str]:
        """Our own header."""
        kind = self.service.type
        return {
            "callerid": self.service.node,
            "md5sum": service_md5sum(kind),
            "request_type": f"{kind}Request",
            "response_type": f"{kind}Response",
            "service": self.name,
            "type": kind,
        }

    async def answer(self, peer: Peer, node: str, *, persistent: bool) -> None:
        """Answer a node that calls once or again and again, one call at a time; errors are those of `Peer.frame`."""
        self.callers.add(peer)
        try:
            while True:
                asked = await peer.frame(LARGEST_CALL, None if persistent else _REQUEST_TIMEOUT)
                await peer.send(await self._answer(asked, node))
                if not persistent:
                    return
        finally:
            self.callers.discard(peer)

    def close(self) -> None:
        """Close all connections."""
        for caller in list(self.callers):
            caller.close()

    async def _answer(self, asked: bytes, node: str) -> bytes:
        """The bytes that answer a request."""
        try:
            request = decode(asked, f"{self.service.type}Request")
            response = await self.graph.call(self.service, request, node)
            return b"\x01" + with_length(encode(response, f"{self.service.type}Response"))
        except CommandError as error:
            why = str(error)
        except Exception as error:  # whatever rosbags raises of an invalid response
            why = str(CommandError(f"{self.name}: the response cannot be written: {error}"))
        return b"\x00" + with_length(why.encode("utf-8", "replace"))


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
        """Connect to these publishers, and to no others."""
        wanted = list(dict.fromkeys(uri for uri in uris if len(uri) <= MAX_NAME and uri != self.own))[:MOST_PUBLISHERS]
        for uri in set(self.sources) - set(wanted):
            self.sources.pop(uri).task.cancel()
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
        sources, self.sources = self.sources, {}
        await end_tasks(source.task for source in sources.values())


class Source:
    """A publisher of another process."""

    def __init__(self, topic: Subscription, uri: str, number: int) -> None:
        self.topic, self.uri, self.number = topic, uri, number
        self.received = self.messages = 0
        self.peer: Peer | None = None
        self.task = asyncio.create_task(self._run())

    async def _run(self) -> None:
        pause = FIRST_PAUSE
        while True:
            before = self.messages
            try:
                await self._listen()
            except (*CALL_ERRORS, Fault) as error:
                why = str(error) or "it does not answer"
                text = f"{self.topic.name}: no messages from its publisher at {self.uri}: {why}"
                self.topic.notices.write("WARN", "publisher", f"{self.topic.name} {self.uri}", text)
            pause = FIRST_PAUSE if self.messages > before else min(2.0 * pause, LONGEST_PAUSE)
            await asyncio.sleep(pause)

    async def _listen(self) -> None:
        """Connect, and stay until the connection ends."""
        topic = self.topic
        self.peer = peer = await dial(await self._where(), "tcpros", topic.intake, timeout=_HANDSHAKE_TIMEOUT)
        try:
            with contextlib.suppress(OSError, EOFError):  # it has closed the connection, or says nothing
                await self._messages(peer)
        finally:
            self.peer = None
            peer.close()

    async def _messages(self, peer: Peer) -> None:
        topic = self.topic
        peer.writer.write(encode_header(topic.header()))
        header = decode_header(await peer.frame(LARGEST_HEADER, _HANDSHAKE_TIMEOUT))
        if "error" in header:
            raise CommandError(f"it reports: {header['error'][:300]}")
        sent, own = header.get("md5sum", ""), md5sum(topic.type)
        if sent not in {"*", own}:
            kind = header.get("type", "?")
            raise CommandError(f"it sends [{kind}/{sent}], but this topic is [{topic.type}/{own}]")
        sender = header.get("callerid", "")[:MAX_NAME] or self.uri
        while True:
            await self._take(peer, sender, latching=header.get("latching") == "1")

    async def _take(self, peer: Peer, sender: str, *, latching: bool) -> None:
        """Take what has come; of too much only the newest messages, and then none for a while."""
        frames, size = [await peer.frame(_LARGEST_MESSAGE)], 0
        with contextlib.suppress(OSError, EOFError):
            while size < _READ_SIZE and len(frames) < _MOST_IN_A_BITE:
                frames.append(await peer.frame(_LARGEST_MESSAGE, 0.0))
                size += len(frames[-1])
        self.messages += len(frames)
        for frame in frames[-_MOST_AT_ONCE:]:
            self.received += len(frame)
            message, kept = decode(frame, self.topic.type), latching and len(frame) <= _LARGEST_LATCHED
            self.topic.take(self.topic.name, message, sender, kept)
        if len(frames) > _MOST_AT_ONCE:
            await asyncio.sleep(len(frames) / _MOST_PER_SECOND)

    async def _where(self) -> str:
        """Where the publisher sends this topic."""
        answer = await ask(self.uri, "requestTopic", self.topic.node, self.topic.name, [["TCPROS"]])
        match answer:
            case ["TCPROS", str(host), int(port), *_]:
                return f"tcpros://{host}:{port}"
        raise CommandError(f"it answers {str(answer)[:60]!r} instead of its TCPROS address")


async def call_service(
    uri: str, node: str, name: str, make: Callable[[str], Message] | None
) -> tuple[str, Message | None]:
    """Call a service at a URI as a node, with the request that `make` makes for its type; the type and the response.

    Without `make` nothing is called.

    Raises:
        CommandError: the service cannot be called, or refuses, and why.
        OSError, EOFError, TimeoutError: it does not answer.
    """
    peer = await dial(uri, "rosrpc", Intake(_LARGEST_MESSAGE), timeout=_HANDSHAKE_TIMEOUT)
    try:
        probe = {} if make is not None else {"probe": "1"}
        peer.writer.write(encode_header({"callerid": node, "md5sum": "*", "service": name} | probe))
        header = decode_header(await peer.frame(LARGEST_HEADER, _HANDSHAKE_TIMEOUT))
        type_name = header.get("type", "")
        if "error" in header or not type_name:
            raise CommandError(f"{name}: {header.get('error', 'its type is not known')[:300]}")
        if make is None:
            return type_name, None
        if not (is_known(f"{type_name}Request") and is_known(f"{type_name}Response")):
            raise CommandError(f"{name} has the unknown type {type_name}")
        if header.get("md5sum") not in {"*", service_md5sum(type_name)}:
            raise CommandError(f"{name}: its {type_name} differs from ours")
        peer.writer.write(with_length(encode(make(type_name), f"{type_name}Request")))
        async with asyncio.timeout(_LONGEST_CALL):
            done = await peer.reader.readexactly(1)
        body = await peer.frame(_LARGEST_MESSAGE)
        if done != b"\x01":
            raise CommandError(f"{name}: {body[:1000].decode('utf-8', 'replace')}")
        return type_name, decode(body, f"{type_name}Response")
    finally:
        peer.close()


class Client:
    """A caller of a master's graph, with a name and a namespace."""

    def __init__(self, name: str, uri: str | None = None, namespace: str | None = None) -> None:
        self.uri = uri or os.environ.get("ROS_MASTER_URI") or DEFAULT_MASTER
        given = os.environ.get("ROS_NAMESPACE", "") if namespace is None else namespace
        self.namespace = f"/{given.strip('/')}/" if given.strip("/") else "/"
        self.name = f"{self.namespace}{name}"

    def parameter(self, name: str) -> object:
        """A parameter, whose name is relative to the namespace unless it begins with a slash.

        Raises:
            NetworkError: the master cannot be asked.
            CommandError: it has no such parameter.
        """
        full = name if name.startswith("/") else f"{self.namespace}{name}"
        value = self._ask("getParam", full)
        if value is None:
            raise CommandError(f"no parameter {full} at the master {self.uri}")
        return value

    def wait(self, service: str, seconds: float) -> None:
        """Wait until a service is there; NetworkError: it is not, so long [s]."""
        end = time.monotonic() + seconds
        while not self._api(service):
            if time.monotonic() > end:
                raise NetworkError(f"no service {service} within {seconds:g} s at the master {self.uri}")
            time.sleep(_LOOKUP_PERIOD)

    def call(self, service: str, type_name: str, request: Message) -> Message:
        """Call a service, and return its response.

        Raises:
            NetworkError: it is not there, or the connection fails.
            CommandError: it answers with an error.
        """
        api = self._api(service)
        if not api:
            raise NetworkError(f"no service {service} at the master {self.uri}")

        def make(found: str) -> Message:
            if found != type_name:
                raise CommandError(f"{service} is of type {found}, not {type_name}")
            return request

        try:
            return asyncio.run(call_service(api, self.name, service, make))[1]
        except (OSError, EOFError) as error:
            raise NetworkError(f"the service {service} at {api}: {error}") from None

    def _api(self, service: str) -> str:
        """The address of a service; empty without one."""
        return str(self._ask("lookupService", service) or "")

    def _ask(self, method: str, value: str) -> object:
        """The value that the master answers; None where it has none."""

        async def ask() -> object:
            with contextlib.closing(Proxy(self.uri)) as proxy:
                return await proxy.call(method, self.name, value)

        try:
            answer: Any = asyncio.run(ask())
            code, _, result = answer
        except (*CALL_ERRORS, Fault, ValueError, TypeError) as error:
            raise NetworkError(f"no answer from a ROS master at {self.uri}: {error}") from None
        return result if code == 1 else None
