"""The transport: what the simulation's thread calls, and the server in the network's loop."""

import asyncio
import contextlib
import functools
import http
import logging
import os
from collections.abc import Sequence
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.http11 import Request, Response

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros import messages
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Traffic
from vrx_mj.ros.limits import ConnectionLimit, Place
from vrx_mj.ros.network import Names, Origins, checked_origins, host_of, is_address, refusal
from vrx_mj.ros.rosbridge.client import Client, Hub
from vrx_mj.ros.rosbridge.codec import MOST_INCOMING

_HANDSHAKE = 10.0
"""Wall time for a handshake [s]."""
_ALIVE = 60.0
"""Wall time after which who does not answer is gone [s]."""
_CLOSING = 1.0
_OPENING = 10.0
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
        """Traffic since the start."""
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
            create_connection=functools.partial(Socket, self._hub.connections),  # type: ignore[arg-type]  # it makes one
        )
        self.port = self._server.sockets[0].getsockname()[1]
        self._hub.open()

    async def _serve(self, connection: ServerConnection) -> None:
        assert isinstance(connection, Socket)
        await Client(connection, connection.place, self._hub).serve()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a handshake, or not."""
        assert isinstance(connection, Socket)
        reached = str(connection.local_address[0])
        asked = ", ".join(request.headers.get_all("Host"))
        host = host_of(asked)
        for origin in request.headers.get_all("Origin"):  # programs send none
            if not (is_address(host) or self._names.has(host, reached)):
                text = f"{ascii(asked)[:100]} is not a name of this machine; to give it that name, set ROS_HOSTNAME"
                return self._refusal(connection, http.HTTPStatus.MISDIRECTED_REQUEST, "host", text)
            if not self._origins.welcome(origin, host):
                text = f"pages of {ascii(origin)[1:-1][:200]} may not connect{_allowing(origin)}"
                return self._refusal(connection, http.HTTPStatus.FORBIDDEN, f"origin {origin}", text)
        if not self._hub.connections.has_room(connection.place):
            text = f"too many clients are connected; no more of {connection.place.host} are accepted"
            return self._refusal(connection, http.HTTPStatus.SERVICE_UNAVAILABLE, "crowd", text)
        return None

    def _refusal(self, connection: Socket, status: http.HTTPStatus, kind: str, text: str) -> Response:
        self._hub.report_once(connection.place.host, kind, text)
        return connection.respond(status, f"{text}\n")

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
