"""MuJoCo's own window on a running simulation."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from vrx_mj.drive.helm.keys import HELP, OURS, window_key
from vrx_mj.drive.view.sea import sea_of, window_model
from vrx_mj.drive.view.session import Session
from vrx_mj.runtime.simulation import Simulation

__all__ = ["Window"]

DISTANCE, ELEVATION = 16.0, -18.0
"""Where the camera starts: [m] from the boat, [deg] looking down."""
CLOSING = 2.0
"""Wall time [s] that the window may take to close."""


class Upload:
    """Hands the sea's mesh to the graphics card.

    MuJoCo's call returns when the window has drawn, and never where it was closed in that moment: so it is made in a
    thread that may be left behind.
    """

    def __init__(self, handle: Any, mesh: int) -> None:
        self._handle, self._mesh = handle, mesh
        self._asked, self._done = threading.Event(), threading.Event()
        self._done.set()
        threading.Thread(target=self._run, name="vrx_mj view", daemon=True).start()

    def __call__(self) -> None:
        """Upload, and return when that is done or the window is closed."""
        self._done.clear()
        self._asked.set()
        self.wait()

    def wait(self) -> None:
        """Return when nothing is under way, or the window is closed."""
        while not self._done.wait(0.2) and self._handle.is_running():
            pass

    def _run(self) -> None:
        while True:
            self._asked.wait()
            self._asked.clear()
            self._handle.update_mesh(self._mesh)
            self._done.set()


class Window:
    """MuJoCo's passive viewer with a moving sea; its camera follows the chosen boat."""

    def __init__(self, sim: Simulation) -> None:
        from mujoco import viewer

        self._model = window_model(sim.world)
        self._data = mujoco.MjData(self._model)
        self._sea = sea_of(self._model, sim.sea.height)
        self._keys: queue.SimpleQueue[int] = queue.SimpleQueue()
        others = set(threading.enumerate())
        self._handle = viewer.launch_passive(
            self._model, self._data, key_callback=self._keys.put, show_left_ui=False, show_right_ui=False
        )
        self._drawing = [thread for thread in threading.enumerate() if thread not in others]
        self._upload = Upload(self._handle, self._sea.mesh) if self._sea is not None else None
        self._start(sim)

    url = None
    ports = ()

    def is_open(self) -> bool:
        """False once it was closed."""
        return bool(self._handle.is_running())

    def pressed(self) -> Iterator[str]:
        """The names of the keys pressed since the last call."""
        while not self._keys.empty():
            name = window_key(self._keys.get())
            if name is not None:
                yield name

    def show(self, session: Session) -> None:
        """Draw the present moment."""
        sim, model, data = session.sim, self._model, self._data
        data.qpos[:], data.qvel[:], data.time = sim.data.qpos, sim.data.qvel, sim.time
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        place = sim.observe()[session.pilot.boat].position
        if self._sea is not None:
            self._sea.follow(data, (float(place[0]), float(place[1])), sim.time)
        with self._handle.lock():
            sim.paint(model)
            self._handle.cam.lookat[:] = (*place[:2], 0.5)
            self._keep_flags()
        self._handle.set_texts(_texts(session))
        self._handle.sync()
        if self._upload is not None:
            self._upload()

    def restart(self) -> None:
        """Nothing here remembers."""

    def close(self) -> None:
        """Take the window away."""
        if self._upload is not None:
            self._upload.wait()  # closed in the middle of one, the window would wait for it for ever
        self._handle.close()
        for thread in self._drawing:  # it must not draw while Python ends
            thread.join(CLOSING)

    def _start(self, sim: Simulation) -> None:
        """Set the camera, the fog, and the flags whose keys are ours."""
        handle = self._handle
        with handle.lock():
            handle.cam.distance, handle.cam.elevation = DISTANCE, ELEVATION
            handle.cam.azimuth = float(np.degrees(sim.observe()[sim.boats[0]].heading)) + 20.0
            handle.user_scn.flags[mujoco.mjtRndFlag.mjRND_FOG] = bool(sim.world.tree["scene"]["fog"])
        self._visual = _taken(mujoco.mjVISSTRING, handle.opt.flags)
        self._render = _taken(mujoco.mjRNDSTRING, handle.user_scn.flags)
        self._groups = np.array(handle.opt.geomgroup)

    def _keep_flags(self) -> None:
        """MuJoCo's viewer toggles a flag at most letters, and groups of geoms at digits: not at those that drive."""
        for flags, taken in ((self._handle.opt.flags, self._visual), (self._handle.user_scn.flags, self._render)):
            for index, value in taken.items():
                flags[index] = value
        self._handle.opt.geomgroup[:] = self._groups


def _taken(names: Any, flags: Any) -> dict[int, int]:
    """The flags that MuJoCo's viewer toggles with a key of ours, and their values now."""
    return {i: int(flags[i]) for i, (_, _, key) in enumerate(names) if key and key.lower() in OURS}


def _texts(session: Session) -> list[tuple[int, int, str, str]]:
    font, grid = mujoco.mjtFontScale.mjFONTSCALE_100, mujoco.mjtGridPos
    status, keys = session.status(), HELP
    return [
        (font, grid.mjGRID_TOPLEFT, "\n".join(row[0] for row in status), "\n".join(row[1] for row in status)),
        (font, grid.mjGRID_BOTTOMLEFT, "\n".join(row[0] for row in keys), "\n".join(row[1] for row in keys)),
    ]
