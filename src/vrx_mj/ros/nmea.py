"""NMEA 0183 for chart plotters: a boat's sentences by UDP, and to every client of a TCP port; nothing is taken."""

import asyncio
import contextlib
from collections.abc import Sequence

from vrx_mj.errors import NetworkError
from vrx_mj.ros.access import bound, is_wildcard
from vrx_mj.ros.interface import RosInterface, Sent, Traffic
from vrx_mj.ros.limits import ConnectionLimit, Counts, Outbox, Place
from vrx_mj.ros.network import Network, refusal
from vrx_mj.ros.table.nmea import nmea_topics

PORT = 10110
"""The port of NMEA 0183 over IP."""
MOST_CLIENTS = 64
MOST_SENTENCES = 1000
"""Sentences that wait for a client that does not read, at most: the oldest go first."""
HELD = 1 << 12
"""Bytes that wait in a connection itself, about."""
OPENING, CLOSING = 10.0, 1.0
"""Wall time that this may take [s]."""
EVERYBODY = "255.255.255.255"
"""Where UDP goes if all networks are listened on."""


class _Client(asyncio.Protocol):
    """A connection. Once it has sent something, it is not read any more."""

    def __init__(self, wire: "Nmea") -> None:
        self._wire = wire
        self._is_paused = False
        self.outbox: Outbox[bytes] = Outbox(wire.counts, MOST_SENTENCES, self._flush)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """It was accepted."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self.place = Place(str(transport.get_extra_info("peername")[0]), transport.abort)
        if self._wire.limit.enter(self.place) and self._wire.limit.settle(self.place):
            transport.set_write_buffer_limits(HELD)
            self._wire.clients.add(self)
        else:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """It was closed."""
        self.outbox.forget()
        self._wire.limit.leave(self.place)
        self._wire.clients.discard(self)

    def data_received(self, data: bytes) -> None:
        """Somebody sends: nothing of it matters."""
        self._transport.pause_reading()

    def eof_received(self) -> bool:
        """It sends nothing more, and may go on to read."""
        return True

    def pause_writing(self) -> None:
        """It does not read."""
        self._is_paused = True

    def resume_writing(self) -> None:
        """It reads again."""
        self._is_paused = False
        self._flush()

    def _flush(self) -> None:
        while not self._is_paused and (line := self.outbox.pop()) is not None:
            self._transport.write(line)
            self._wire.counts.sent += len(line)


class Nmea:
    """A `Transport` (see `vrx_mj.ros.interface`) of one boat's topics of sentences."""

    title = "NMEA"

    def __init__(self, network: Network, boat: str, *, port: int = PORT, host: str = "127.0.0.1") -> None:
        """Of a boat; `start` opens it. Port 0 is any that is free."""
        self._network, self._boat, self._host, self.port = network, boat, host, port
        self.counts, self.limit, self.clients = Counts(), ConnectionLimit(MOST_CLIENTS), set[_Client]()
        self._server: asyncio.Server | None = None
        self._udp: asyncio.DatagramTransport | None = None
        self._to = ("", 0)
        self.wanted: frozenset[str] = frozenset()
        """Its topics, always: who listens to UDP is not known."""

    def start(self) -> Sequence[str]:
        """Open it; returns a line with its address. NetworkError: it cannot be opened, and why."""
        try:
            self._network.call(self._open(), OPENING)
        except (OSError, OverflowError, TimeoutError) as error:
            raise NetworkError(refusal("NMEA", self._host, self.port, error)) from error
        return [f"NMEA of {self._boat}: TCP port {self.port} of {self._host}, UDP to port {self.port} of {self._to[0]}"]

    def offer(self, table: RosInterface) -> None:
        """Send the sentences of this table from now on."""
        self.wanted = frozenset(nmea_topics(self._boat)) & table.outputs.keys()

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send the sentences among these messages."""
        lines = [f"{sent.message.sentence}\r\n".encode() for sent in batch if sent.output.name in self.wanted]
        if lines:
            self._network.soon(self._send, lines)

    def log(self, level: str, text: str) -> None:
        """A line for people, of whom there are none here."""

    @property
    def traffic(self) -> Traffic:
        """What it has carried."""
        return Traffic(len(self.clients), self.counts.sent, self.counts.dropped)

    def close(self) -> None:
        """Close every connection, and wait until that is done."""
        if not self._network.loop.is_closed():
            with contextlib.suppress(TimeoutError):
                self._network.call(self._close(), CLOSING)

    async def _open(self) -> None:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: _Client(self), bound(self._host), self.port)
        self.port = self._server.sockets[0].getsockname()[1]
        self._udp, _ = await loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, local_addr=(bound(self._host)[0], 0), allow_broadcast=True
        )
        here = EVERYBODY if is_wildcard(self._host) else self._udp.get_extra_info("sockname")[0]
        self._to = here, self.port

    def _send(self, lines: Sequence[bytes]) -> None:
        for line in lines:
            if self._udp is not None:
                self._udp.sendto(line, self._to)
                self.counts.sent += len(line)
            for client in self.clients:
                client.outbox.push(line, len(line))

    async def _close(self) -> None:
        for opened in (self._server, self._udp):
            if opened is not None:
                opened.close()
        for client in list(self.clients):
            client.place.end()
