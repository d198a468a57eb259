"""A running simulation in a browser: the chunks of a recording, sent while they are made."""

from __future__ import annotations

import itertools
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from urllib.parse import quote

import rerun as rr

from vrx_mj.drive.session import Session
from vrx_mj.errors import RecordError
from vrx_mj.recording.blueprint import blueprint_bytes, layout
from vrx_mj.recording.motion_chunks import MovingChunks, event_chunk
from vrx_mj.recording.record_scene import RecordScene
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.recording.static_chunks import boat_chunks, still_chunks
from vrx_mj.recording.writer import APPLICATION, viewer_binary
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import Pause

__all__ = ["LOOPBACK", "Browser", "Server", "free_port"]

FLEET_PERIOD, OTHERS_PERIOD = 0.1, 0.5
"""Wall time between pictures of the boats, and of all else that moves [s]: each body is a chunk of its own, and pages
fall behind at more than a few hundred chunks a second."""


class Browser:
    """rerun's browser viewer; keys come from elsewhere, since its page gives none."""

    def __init__(self, sim: Simulation, clock: Callable[[], float] = time.perf_counter, *, keys: bool = True) -> None:
        """Open it; `keys`: whether any are read, so that it is worth a line which boat they drive."""
        self._clock, self._keys = clock, keys
        self._scene: RecordScene = scene_of(sim)
        self._views = blueprint_bytes(self._scene, APPLICATION)
        self._server = Server()
        self._stream: rr.RecordingStream | None = None
        self._shown, self._fleet_pause, self._others_pause = -1.0, Pause(), Pause()
        self._boat = ""
        try:
            self._begin()
        except BaseException:
            self._server.close()
            raise

    @property
    def url(self) -> str:
        """What to open in a browser."""
        return self._server.page_url

    @property
    def ports(self) -> tuple[int, ...]:
        """Ports of the page and of its data, both on 127.0.0.1."""
        return self._server.page_port, self._server.data_port

    def is_open(self) -> bool:
        """False once the server is gone; whether a page looks at it is not known."""
        return self._server.is_running()

    def pressed(self) -> Iterable[str]:
        """None."""
        return ()

    def show(self, session: Session) -> None:
        """Send the present moment where that is due."""
        sim, now = session.sim, self._clock()
        if sim.time > self._shown and self._fleet_pause.is_over(now):
            self._shown = sim.time
            self._fleet_pause.begin(now, FLEET_PERIOD)
            self._send(sim, now)
        if self._keys and session.pilot.boat != self._boat:
            self._boat = session.pilot.boat
            event = (sim.time, f"the keys drive {self._boat}", "INFO", "")
            rr.send_chunks(event_chunk([event]), recording=self._stream)

    def _send(self, sim: Simulation, now: float) -> None:
        row = sim.row()[None]
        rr.send_chunks(self._fleet(row), recording=self._stream)
        if self._others_pause.is_over(now):
            self._others_pause.begin(now, OTHERS_PERIOD)
            others = itertools.islice(self._others(row), 1, None)  # the exact rows are sent already
            rr.send_chunks(others, recording=self._stream)

    def restart(self) -> None:
        """Begin another recording on the same page: time began again."""
        self._end()
        self._begin()

    def close(self) -> None:
        """Send what is left, and end the server."""
        self._end()
        self._server.close()

    def _begin(self) -> None:
        self._stream = rr.RecordingStream(APPLICATION)
        self._stream.connect_grpc(self._server.data_url)
        rr.send_blueprint(layout(self._scene, live=True), recording=self._stream)
        rr.send_chunks(still_chunks(self._scene, self._views), recording=self._stream)
        rr.send_chunks(boat_chunks(self._scene), recording=self._stream)
        self._fleet = MovingChunks(_only(self._scene, boats=True))
        self._others = MovingChunks(_only(self._scene, boats=False))
        self._shown, self._boat = -1.0, ""
        self._fleet_pause.end()
        self._others_pause.end()

    def _end(self) -> None:
        if self._stream is not None:
            self._stream.disconnect()
            self._stream = None


def _only(scene: RecordScene, *, boats: bool) -> RecordScene:
    """The scene with its boats alone, or with all but them."""
    return replace(scene, bodies=tuple(body for body in scene.bodies if (body.kind == "boat") == boats))


LOOPBACK = "127.0.0.1"
PAGE_PORT, DATA_PORT = 9090, 9876
"""Ports of the page and of its data where they are free: rerun's own."""
MEMORY = "500MB"
"""What the server keeps for pages that are opened later; the oldest goes first."""
START_TIMEOUT = 20.0
"""Wall time [s] that starting may take."""


class Server:
    """The process and its addresses."""

    def __init__(self) -> None:
        self.page_port = free_port(PAGE_PORT)
        self.data_port = free_port(DATA_PORT)
        self.data_url = f"rerun+http://{LOOPBACK}:{self.data_port}/proxy"
        """Address to which recordings are sent."""
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 -- closed with the process
        command = [
            str(viewer_binary()), "--serve-web", "--bind", LOOPBACK, "--port", str(self.data_port),
            "--web-viewer-port", str(self.page_port), "--server-memory-limit", MEMORY,
        ]  # fmt: skip
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
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
        self._output.close()

    def _wait(self) -> None:
        """Until both ports answer."""
        until = time.monotonic() + START_TIMEOUT
        while not (_answers(self.data_port) and _answers(self.page_port)):
            if not self.is_running() or time.monotonic() > until:
                raise RecordError(f"rerun's browser viewer does not start: {self._last_line()}")
            time.sleep(0.05)

    def _last_line(self) -> str:
        self._output.seek(0)
        lines = self._output.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-1] if lines else f"nothing after {START_TIMEOUT:g} s"


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
