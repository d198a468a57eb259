"""rerun's browser viewer as a process of its own, which listens to this machine only.

rerun's Python functions serve on all network interfaces; its executable can be told which.
"""

from __future__ import annotations

import socket
import subprocess
import tempfile
import time
from urllib.parse import quote

from vrx_mj.errors import RecordError
from vrx_mj.recording.viewer import viewer_binary

__all__ = ["LOOPBACK", "Server", "free_port"]

LOOPBACK = "127.0.0.1"
PAGE_PORT, DATA_PORT = 9090, 9876
"""Ports of the page and of its data where they are free: rerun's own."""
MEMORY = "500MB"
"""What the server keeps for pages that are opened later; the oldest goes first."""
STARTS = 20.0
"""Wall time [s] that starting may take."""


class Server:
    """The process and its addresses."""

    def __init__(self) -> None:
        self.page_port = free_port(PAGE_PORT)
        self.data_port = free_port(DATA_PORT)
        self.data_url = f"rerun+http://{LOOPBACK}:{self.data_port}/proxy"
        """Where recordings are sent."""
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 -- closed with the process
        command = [
            str(viewer_binary()), "--serve-web", "--bind", LOOPBACK, "--port", str(self.data_port),
            "--web-viewer-port", str(self.page_port), "--server-memory-limit", MEMORY,
        ]  # fmt: skip
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=self._said,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C is for us: we end it when all is sent
        )
        try:
            self._wait()
        except BaseException:
            self.close()
            raise

    @property
    def page_url(self) -> str:
        """What to open in a browser."""
        return f"http://{LOOPBACK}:{self.page_port}/?url={quote(self.data_url, safe='')}"

    def is_running(self) -> bool:
        """Whether the process lives."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._said.close()

    def _wait(self) -> None:
        """Until both ports answer."""
        until = time.monotonic() + STARTS
        while not (_answers(self.data_port) and _answers(self.page_port)):
            if not self.is_running() or time.monotonic() > until:
                raise RecordError(f"rerun's browser viewer does not start: {self._last_words()}")
            time.sleep(0.05)

    def _last_words(self) -> str:
        self._said.seek(0)
        lines = self._said.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-1] if lines else f"nothing after {STARTS:g} s"


def free_port(wanted: int) -> int:
    """`wanted` where nothing on this machine has that port, else any that is free."""
    for port in (wanted, 0):
        with socket.socket() as probe:
            try:
                probe.bind((LOOPBACK, port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise RecordError(f"no free port on {LOOPBACK}")


def _answers(port: int) -> bool:
    try:
        with socket.create_connection((LOOPBACK, port), timeout=0.5):
            return True
    except OSError:
        return False
