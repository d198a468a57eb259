"""rerun's own program as a server of recordings for a browser, which connects to nothing else."""

import contextlib
import http.client
import re
import socket
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import quote

from vrx_mj.errors import RecordError
from vrx_mj.recording.parts import viewer_binary, viewer_environment

LOOPBACK = "127.0.0.1"
_PAGE_PORT, _DATA_PORT = 9090, 9876
"""Ports of the page and of its data where they are free: rerun's own."""
_MEMORY, _MEMORY_RATIO = 500_000_000, 3
"""What the server keeps for pages that are opened later, and of files by size [bytes]; the oldest goes first."""
_START_TIMEOUT = 20.0
"""Longest wall time that starting may take [s]."""
_POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self' data: blob: {data}; form-action 'none'"
)
"""What rerun's page may load, and where it may connect: to its own server and its data."""
_FOREIGN_LINK = re.compile(rb'<link[^>]*"https://[^>]*>')
"""Tags that have a browser connect elsewhere, whatever the policy."""


class Server:
    """rerun's server of a page and of its data, both on 127.0.0.1; the page connects to nothing else."""

    def __init__(self, *files: Path) -> None:
        """`files` are shown; without any, what is sent to `data_url`."""
        self._hidden_port, self.data_port = free_port(0), free_port(_DATA_PORT)
        self.data_url = f"rerun+http://{LOOPBACK}:{self.data_port}/proxy"
        """Address to which recordings are sent."""
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 -- closed with the process
        memory = _MEMORY + _MEMORY_RATIO * sum(file.stat().st_size for file in files)
        command = [
            str(viewer_binary()), *map(str, files), "--serve-web", "--bind", LOOPBACK, "--port", str(self.data_port),
            "--web-viewer-port", str(self._hidden_port), "--server-memory-limit", f"{memory // 1_000_000}MB",
        ]  # fmt: skip
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C is for us: we end it when all is sent
            env=viewer_environment(),
        )
        self._pages: ThreadingHTTPServer | None = None
        try:
            until = time.monotonic() + _START_TIMEOUT
            while not (_answers(self.data_port) and _answers(self._hidden_port)):
                if not self.is_running() or time.monotonic() > until:
                    raise RecordError(f"rerun's browser viewer does not start: {self._last_line()}")
                time.sleep(0.05)
            self.page_port = free_port(_PAGE_PORT)
            policy = _POLICY.format(data=f"http://{LOOPBACK}:{self.data_port}")
            self._pages = ThreadingHTTPServer((LOOPBACK, self.page_port), partial(_Page, self._hidden_port, policy))
            threading.Thread(target=self._pages.serve_forever, name="vrx_mj page", daemon=True).start()
        except BaseException:
            self.close()
            raise

    @property
    def page_url(self) -> str:
        """URL of the page to open in a browser."""
        return f"http://{LOOPBACK}:{self.page_port}/?url={quote(self.data_url, safe='')}&hide_welcome_screen=1"

    @property
    def ports(self) -> tuple[int, ...]:
        """Ports of the page and of its data."""
        return self.page_port, self.data_port

    def is_running(self) -> bool:
        """Whether the process lives."""
        return self._process.poll() is None

    def wait(self) -> int:
        """Wait until the process ends; returns its exit code."""
        return self._process.wait()

    def close(self) -> None:
        """End the process and the page's server."""
        if self._pages is not None:
            self._pages.shutdown()
            self._pages.server_close()
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._output.close()

    def _last_line(self) -> str:
        self._output.seek(0)
        lines = self._output.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-1] if lines else f"nothing after {_START_TIMEOUT:g} s"


class _Page(BaseHTTPRequestHandler):
    """The pages that rerun serves at a port, under a policy."""

    def __init__(self, port: int, policy: str, *of_connection: Any) -> None:
        self._port, self._policy = port, policy
        super().__init__(*of_connection)

    def do_GET(self) -> None:
        """Answer with what rerun answers."""
        with contextlib.closing(http.client.HTTPConnection(LOOPBACK, self._port)) as inner:
            inner.request("GET", self.path)
            answer = inner.getresponse()
            content, kind = answer.read(), answer.getheader("Content-Type", "application/octet-stream")
        if kind.startswith("text/html"):
            content = _FOREIGN_LINK.sub(b"", content)
        self.send_response(answer.status)
        own = {"Content-Type": kind, "Content-Length": str(len(content)), "Content-Security-Policy": self._policy}
        for name, value in own.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: object) -> None:
        """Drop the line that the server would print for a request."""


def where_to_look(server: Server, reason: str) -> Iterator[str]:
    """Lines for the person who watches: why in a browser, and how."""
    yield f"Opening in the browser ({reason})."
    yield f"Open {server.page_url}"
    tunnel = " ".join(f"-L {port}:{LOOPBACK}:{port}" for port in server.ports)
    yield f"It listens on this machine only; from another machine, first run: ssh {tunnel} this-machine"


def free_port(wanted: int) -> int:
    """`wanted` where nothing on this machine has that port, else any that is free."""
    for port in (wanted, 0):
        with contextlib.suppress(OSError), socket.socket() as probe:
            probe.bind((LOOPBACK, port))
            return int(probe.getsockname()[1])
    raise RecordError(f"no free port on {LOOPBACK}")


def _answers(port: int) -> bool:
    with contextlib.suppress(OSError), socket.create_connection((LOOPBACK, port), timeout=0.5):
        return True
    return False
