"""The transport: what the simulation's thread calls, and the server in the network's loop."""

import asyncio
import contextlib
import functools
import http
import logging
import os
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.http11 import Request, Response

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros import messages
from vrx_mj.ros.access import Names, Origins, checked_origins, host_of, is_address, is_loopback
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Traffic
from vrx_mj.ros.network import refusal
from vrx_mj.ros.rosbridge.client import Client, Hub
from vrx_mj.ros.rosbridge.protocol import MOST_INCOMING

MOST_CLIENTS = 64
MOST_OF_A_HOST = MOST_CLIENTS * 3 // 4
"""Clients of one host that is not this one."""
_MOST_HANDSHAKES = 64
"""Connections that are in their handshake; with one more the oldest goes."""
_HANDSHAKE = 10.0
"""Wall time for a handshake [s]."""
_ALIVE = 60.0
"""Wall time after which who does not answer is gone [s]."""
_CLOSING = 1.0
_OPENING = 10.0
_websockets_logger = logging.getLogger(f"{__name__}.websockets")
_websockets_logger.setLevel(logging.CRITICAL)  # it would print a traceback for each peer that speaks something else


class Socket(ServerConnection):
    """A connection, which gives way to new ones while it is in its handshake."""

    def __init__(self, handshakes: "OrderedDict[Socket, None]", *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._handshakes = handshakes

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """It was accepted."""
        super().connection_made(transport)
        self._handshakes[self] = None
        if len(self._handshakes) > _MOST_HANDSHAKES:
            oldest, _ = self._handshakes.popitem(last=False)
            oldest.transport.abort()

    def admitted(self) -> None:
        """Its handshake is over."""
        self._handshakes.pop(self, None)

    def connection_lost(self, exc: Exception | None) -> None:
        """It was closed."""
        self._handshakes.pop(self, None)
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
        """Nothing is opened yet; port 0 is any that is free.

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
        self._handshakes: OrderedDict[Socket, None] = OrderedDict()
        self._origins = Origins(checked_origins(origins))
        self._names = Names([host, os.environ.get("ROS_HOSTNAME", ""), os.environ.get("ROS_IP", "")])

    def start(self) -> Sequence[str]:
        """Open it; returns where it is. NetworkError: it cannot be opened, and why."""
        messages.typestore()  # it takes a while, which the first client should not wait
        try:
            self._network.call(self._open(), _OPENING)
        except (OSError, TimeoutError) as error:
            raise NetworkError(refusal("rosbridge", self.host, self.port, error)) from error
        shown = f"[{self.host}]" if ":" in self.host else self.host
        return [f"rosbridge: ws://{shown}:{self.port}"]

    @property
    def traffic(self) -> Traffic:
        """What it has carried."""
        counts = self._hub.counts
        return Traffic(len(self._hub.clients), counts.sent, counts.dropped)

    def close(self) -> None:
        """Withdraw all, close every connection, and wait until that is done."""
        if not self._network.loop.is_closed():
            with contextlib.suppress(TimeoutError):
                self._network.call(self._close(), 2.0 * _CLOSING)

    async def _open(self) -> None:
        self._server = await serve(
            self._serve,
            self.host,
            self.port,
            process_request=self._admit,
            compression=None,
            max_size=MOST_INCOMING,
            max_queue=2,
            open_timeout=_HANDSHAKE,
            ping_interval=_ALIVE / 2.0,
            ping_timeout=_ALIVE,
            close_timeout=_CLOSING / 2.0,
            logger=_websockets_logger,
            create_connection=functools.partial(Socket, self._handshakes),  # type: ignore[arg-type]  # it makes one
        )
        self.port = self._server.sockets[0].getsockname()[1]
        self._hub.open()

    async def _serve(self, connection: ServerConnection) -> None:
        assert isinstance(connection, Socket)
        connection.admitted()
        await Client(connection, self._hub).serve()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a handshake, or not."""
        peer, reached = str(connection.remote_address[0]), str(connection.local_address[0])
        asked = ", ".join(request.headers.get_all("Host"))
        host = host_of(asked)
        for origin in request.headers.get_all("Origin"):  # programs send none
            if not (is_address(host) or self._names.has(host, reached)):
                text = f"{ascii(asked)[:100]} is not a name of this machine; to give it that name, set ROS_HOSTNAME"
                return self._refusal(connection, http.HTTPStatus.MISDIRECTED_REQUEST, "host", text)
            if not self._origins.welcome(origin, host):
                text = f"pages of {ascii(origin)[1:-1][:200]} may not connect{_allowing(origin)}"
                return self._refusal(connection, http.HTTPStatus.FORBIDDEN, f"origin {origin}", text)
        text = self._crowd(peer)
        return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, f"{text}\n") if text else None

    def _refusal(
        self, connection: ServerConnection, status: http.HTTPStatus, kind: str, text: str
    ) -> Response:  # fmt: skip
        self._hub.report_once(str(connection.remote_address[0]), kind, text)
        return connection.respond(status, f"{text}\n")

    def _crowd(self, peer: str) -> str:
        """Why one more client is refused; empty if it is not, as where a client that sends nothing makes room."""
        clients = self._hub.clients.values()
        if not is_loopback(peer) and sum(client.host == peer for client in clients) >= MOST_OF_A_HOST:
            return f"{MOST_OF_A_HOST} clients of {peer} are connected; no more are accepted"
        silent = next((client for client in clients if client.is_silent), None)
        if len(clients) < MOST_CLIENTS:
            return ""
        if silent is None:
            return f"{MOST_CLIENTS} clients are connected; no more are accepted"
        silent.abort()
        return ""

    async def _close(self) -> None:
        if self._server is None:
            return
        self._server.close()
        try:
            await asyncio.wait_for(self._server.wait_closed(), _CLOSING)
        except TimeoutError:
            for client in self._hub.clients.values():
                client.abort()


def _allowing(origin: str) -> str:
    """How to allow an origin, if it is one."""
    try:
        return f"; to allow them: --allow-origin {checked_origins([origin])[0]}"
    except CommandError:
        return ""
