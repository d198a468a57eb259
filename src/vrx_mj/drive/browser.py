"""A running simulation in a browser: the chunks of a recording, sent while they are made."""

import time
from collections.abc import Callable, Iterable
from dataclasses import replace

import rerun as rr

from vrx_mj.drive.session import Session
from vrx_mj.recording.blueprint import layout
from vrx_mj.recording.motion_chunks import MovingChunks, event_chunk
from vrx_mj.recording.parts import APPLICATION
from vrx_mj.recording.reader import Event
from vrx_mj.recording.record_scene import RecordScene
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.recording.static_chunks import still_chunks
from vrx_mj.recording.viewer import Server
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import Pause

_FLEET_PERIOD, _OTHERS_PERIOD = 0.1, 0.5
"""Wall time between pictures of the boats, and of all else that moves [s]: each body is a chunk of its own, and pages
fall behind at more than a few hundred chunks a second."""


class Browser:
    """rerun's browser viewer; keys come from elsewhere, since its page gives none."""

    def __init__(self, sim: Simulation, clock: Callable[[], float] = time.perf_counter, *, keys: bool = True) -> None:
        """Open it; `keys`: whether any are read, so that it is worth a line which boat they drive."""
        self._clock, self._keys = clock, keys
        self._scene: RecordScene = scene_of(sim)
        self.server = Server()
        """Server of the page."""
        self._stream: rr.RecordingStream | None = None
        self._shown, self._fleet_pause, self._others_pause = -1.0, Pause(), Pause()
        self._boat, self._resets = "", 0
        try:
            self._begin()
        except BaseException:
            self.server.close()
            raise

    def is_open(self) -> bool:
        """False once the server is gone; whether a page looks at it is not known."""
        return self.server.is_running()

    def pressed_keys(self) -> Iterable[str]:
        """No keys: the page gives none."""
        return ()

    def show(self, session: Session) -> None:
        """Send the present moment where that is due."""
        sim, now = session.sim, self._clock()
        if session.resets != self._resets:
            self._resets = session.resets
            self.restart()
        if sim.time > self._shown and self._fleet_pause.is_over(now):
            self._shown = sim.time
            self._fleet_pause.begin(now, _FLEET_PERIOD)
            self._send(sim, now)
        if self._keys and session.pilot.boat != self._boat:
            self._boat = session.pilot.boat
            event = Event(sim.time, f"the keys drive {self._boat}", "INFO")
            rr.send_chunks(event_chunk([event]), recording=self._stream)

    def _send(self, sim: Simulation, now: float) -> None:
        row = sim.row()[None]
        rr.send_chunks(self._fleet(row), recording=self._stream)
        if self._others_pause.is_over(now):
            self._others_pause.begin(now, _OTHERS_PERIOD)
            rr.send_chunks(self._others(row), recording=self._stream)

    def restart(self) -> None:
        """Begin another recording on the same page: time began again."""
        self._end()
        self._begin()

    def close(self) -> None:
        """Send what is left, and end the server."""
        self._end()
        self.server.close()

    def _begin(self) -> None:
        self._stream = rr.RecordingStream(APPLICATION)
        self._stream.connect_grpc(self.server.data_url)
        rr.send_blueprint(layout(self._scene, live=True), recording=self._stream)
        rr.send_chunks(still_chunks(self._scene), recording=self._stream)
        self._fleet = MovingChunks(_only(self._scene, boats=True), live=True)
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
