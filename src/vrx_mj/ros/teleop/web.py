"""The page's server: its files and the address of the rosbridge, for browsers on this machine alone."""

import contextlib
import http
import http.server
import importlib.resources
import json
import socket
import threading
import urllib.parse
from collections import OrderedDict
from typing import Any

from vrx_mj.errors import NetworkError
from vrx_mj.ros.network import host_of, is_loopback, refusal

_LOOPBACK = "127.0.0.1"
"""Address of this machine."""
FILES = {
    "/": ("index.html", "text/html"),
    "/page.css": ("page.css", "text/css"),
    "/page.js": ("page.js", "text/javascript"),
    "/chart.js": ("chart.js", "text/javascript"),
    "/bridge.js": ("bridge.js", "text/javascript"),
    "/helm.js": ("helm.js", "text/javascript"),
    "/words.js": ("words.js", "text/javascript"),
}
"""Files by path: name and type."""
_SETTINGS_PATH = "/settings.json"
"""Path of the page's settings: `url` of the rosbridge, and `boat`."""
_SILENCE_TIMEOUT = 10.0
"""Wall time after which a silent browser is disconnected [s]."""
MOST_CONNECTIONS = 64
"""Largest number of connections, each with a thread; one more closes the oldest, as browsers open some in vain."""


class PageServer(http.server.ThreadingHTTPServer):
    """Listens on loopback from the moment that it is made; `serve_forever` answers.

    A page of another site could have its own name lead here: a request by a name that is not this machine's is
    refused.
    """

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True
    request_queue_size = 128

    def __init__(self, port: int, url: str, boat: str | None = None) -> None:
        """Open it; port 0 is any that is free.

        Raises:
            NetworkError: the port cannot be opened, or the URL is no address of a websocket.
        """
        self.policy = _policy(url)
        self.settings = json.dumps({"url": url, "boat": boat}).encode()
        if not 0 <= port <= 65535:
            raise NetworkError(f"invalid --web {port}: a port from 1 to 65535, or 0 for any free one, is needed")
        self._connections: OrderedDict[socket.socket, None] = OrderedDict()
        self._lock = threading.Lock()
        try:
            super().__init__((_LOOPBACK, port), _Answering)
        except OSError as error:
            raise NetworkError(refusal("--web", _LOOPBACK, port, error)) from None

    @property
    def page(self) -> str:
        """URL of the page to open in a browser."""
        return f"http://{_LOOPBACK}:{self.server_address[1]}/"

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread of its own."""
        with self._lock:
            self._connections[request] = None
            oldest = next(iter(self._connections)) if len(self._connections) > MOST_CONNECTIONS else None
            if oldest is not None:
                del self._connections[oldest]
                with contextlib.suppress(OSError):
                    oldest.shutdown(socket.SHUT_RDWR)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """Close a connection."""
        with self._lock:
            self._connections.pop(request, None)
        super().shutdown_request(request)

    def handle_error(self, request: object, client_address: object) -> None:
        """Browsers hang up when they like."""


class _Answering(http.server.BaseHTTPRequestHandler):
    """One connection of a browser."""

    server: PageServer
    timeout = _SILENCE_TIMEOUT
    server_version, sys_version = "vrx-mj", ""

    def do_GET(self) -> None:
        """A file, or why not."""
        self._answer(whole=True)

    def do_HEAD(self) -> None:
        """Answer with the headers of a file alone."""
        self._answer(whole=False)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 -- the name is the base class's
        """Drop the line that the server would print for a request."""

    def _answer(self, *, whole: bool) -> None:
        status, kind, body = self._response()
        self.send_response(status)
        for name, value in (
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Content-Security-Policy", self.server.policy),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Cache-Control", "no-store"),
        ):
            self.send_header(name, value)
        self.end_headers()
        if whole:
            self.wfile.write(body)

    def _response(self) -> tuple[http.HTTPStatus, str, bytes]:
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or not is_loopback(host_of(hosts[0])):
            text = (
                f"only for this machine, as {self.server.page}; not under the name {', '.join(hosts)[:200] or 'none'}\n"
            )
            return http.HTTPStatus.MISDIRECTED_REQUEST, "text/plain", text.encode()
        path = self.path.partition("?")[0]
        if path == _SETTINGS_PATH:
            return http.HTTPStatus.OK, "application/json", self.server.settings
        if path not in FILES:
            text = f"no file {path[:200]}; known: {', '.join(FILES)}\n"
            return http.HTTPStatus.NOT_FOUND, "text/plain", text.encode()
        name, kind = FILES[path]
        file = importlib.resources.files(__package__) / "page" / name
        return http.HTTPStatus.OK, kind, file.read_bytes()


def _policy(url: str) -> str:
    """A Content-Security-Policy by which the page talks to this server and to one rosbridge."""
    try:
        parts = urllib.parse.urlsplit(url)
        parts.port  # noqa: B018 -- raises where it is none
    except ValueError:
        parts = urllib.parse.urlsplit("")
    plain = url.isascii() and url.isprintable() and not set(url) & set(" ;,'\"")
    if parts.scheme not in {"ws", "wss"} or not parts.hostname or not plain:
        raise NetworkError(f"invalid rosbridge address '{url}': ws://HOST:PORT is needed, as in ws://127.0.0.1:9090")
    bridge = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}"
    return (
        f"default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self' {bridge}; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


def reaches(url: str) -> bool:
    """Whether anything listens where a rosbridge should be."""
    parts = urllib.parse.urlsplit(url)
    try:
        with socket.create_connection((parts.hostname, parts.port or 80), timeout=1.0):
            return True
    except OSError:
        return False
