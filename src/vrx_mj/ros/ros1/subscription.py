"""A topic that we listen to over TCPROS: a connection to each publisher, made anew while it is registered."""

import asyncio
import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import Intake
from vrx_mj.ros.messages import Message, decode, encode, full_text, is_known, md5sum, service_md5sum
from vrx_mj.ros.network import Notices
from vrx_mj.ros.parameters import LONGEST
from vrx_mj.ros.ros1.connection import LARGEST_HEADER, Peer, decode_header, dial, encode_header, with_length
from vrx_mj.ros.ros1.xmlrpc import BROKEN, ask

MOST_PUBLISHERS = 64
_LARGEST_MESSAGE = 1 << 22
"""Bytes, at most: commands are small."""
_LARGEST_LATCHED = 1 << 20
"""Bytes of a latched message that is kept for who subscribes later, at most."""
_LONGEST_CALL = 600.0
"""Wall time that a service may take [s]."""
_BITE, _MOST_IN_A_BITE = 1 << 16, 1000
"""Bytes and messages that are taken from a stream at one time."""
_MOST_AT_ONCE = 64
"""Messages of these that are read: only the newest ones."""
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
        self.peer: Peer | None = None
        self._task = asyncio.get_running_loop().create_task(self._run())

    def close(self) -> asyncio.Task[None]:
        """Leave it; the task ends soon."""
        self._task.cancel()
        return self._task

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
        topic = self.topic
        self.peer = peer = await dial(await self._where(), "tcpros", topic.intake, timeout=_HANDSHAKE)
        try:
            with contextlib.suppress(OSError, EOFError):  # it has closed the connection, or says nothing
                await self._messages(peer)
        finally:
            self.peer = None
            peer.close()

    async def _messages(self, peer: Peer) -> None:
        topic = self.topic
        peer.writer.write(encode_header(topic.header()))
        header = decode_header(await peer.frame(LARGEST_HEADER, _HANDSHAKE))
        if "error" in header:
            raise CommandError(f"it reports: {header['error'][:300]}")
        sent, own = header.get("md5sum", ""), md5sum(topic.type)
        if sent not in {"*", own}:
            kind = header.get("type", "?")
            raise CommandError(f"it sends [{kind}/{sent}], but expected is [{topic.type}/{own}]")
        sender = header.get("callerid", "")[:LONGEST] or self.uri
        while True:
            await self._take(peer, sender, latching=header.get("latching") == "1")

    async def _take(self, peer: Peer, sender: str, *, latching: bool) -> None:
        """Take what has come; of too much only the newest messages, and then none for a while."""
        frames, size = [await peer.frame(_LARGEST_MESSAGE)], 0
        with contextlib.suppress(OSError, EOFError):
            while size < _BITE and len(frames) < _MOST_IN_A_BITE:
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
        raise CommandError(f"it answers {str(answer)[:60]!r} instead of the address where it sends")


async def call_service(
    uri: str, node: str, name: str, make: Callable[[str], Message] | None
) -> tuple[str, Message | None]:
    """Call a service at a URI as a node, with the request that `make` makes for its type; the type and the response.

    Without `make` nothing is called.

    Raises:
        CommandError: the service cannot be called, or refuses, and why.
        OSError, EOFError, TimeoutError: it does not answer.
    """
    peer = await dial(uri, "rosrpc", Intake(_LARGEST_MESSAGE), timeout=_HANDSHAKE)
    try:
        probe = {} if make is not None else {"probe": "1"}
        peer.writer.write(encode_header({"callerid": node, "md5sum": "*", "service": name} | probe))
        header = decode_header(await peer.frame(LARGEST_HEADER, _HANDSHAKE))
        type_name = header.get("type", "")
        if "error" in header or not type_name:
            raise CommandError(f"{name}: {header.get('error', 'its type is not known')[:300]}")
        if make is None:
            return type_name, None
        if not (is_known(f"{type_name}Request") and is_known(f"{type_name}Response")):
            raise CommandError(f"{name} has the type {type_name}, which is not known here")
        if header.get("md5sum") not in {"*", service_md5sum(type_name)}:
            raise CommandError(f"{name}: its {type_name} differs from the one that is known here")
        peer.writer.write(with_length(encode(make(type_name), f"{type_name}Request")))
        async with asyncio.timeout(_LONGEST_CALL):
            done = await peer.reader.readexactly(1)
        body = await peer.frame(_LARGEST_MESSAGE)
        if done != b"\x01":
            raise CommandError(f"{name}: {body[:1000].decode('utf-8', 'replace')}")
        return type_name, decode(body, f"{type_name}Response")
    finally:
        peer.close()
