"""MuJoCo's own window: on a running simulation, and on a robot that stands still."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.drive.pilot import HELP, KEYS, window_key
from vrx_mj.drive.session import Session
from vrx_mj.mjcf.scene import add_signs
from vrx_mj.mjcf.world import World
from vrx_mj.recording.record_scene import SeaHeight
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.signals import ended_by_signals

if TYPE_CHECKING:
    from mujoco.viewer import Handle

_DISTANCE, _ELEVATION = 16.0, -18.0
"""Distance [m] and elevation [deg] of the camera at the start."""
_CLOSE_TIMEOUT = 2.0
"""Wall time [s] that the window may take to close."""
SIDE = 129
"""Number of vertices along one side: odd, so that the horizon's rings are alike on both sides."""
CELL = 0.6
"""Size of the cells at the boat [m]."""
HORIZON = 2500.0
"""Distance of the outermost vertices [m]."""
_CALM = (60.0, 160.0)
"""Distances [m] between which waves fade: beyond, cells are too long to draw them."""
_RELIEF = 5.0
"""How much steeper than it is a slight sea is lit, so that it shows; its heights are the true ones."""
_NAME = "vrx_mj/sea"
"""Name of the drawn sea in the model."""
_WATER = "water"
"""The geom of flat water, and its material, as worlds have them."""
_PICTURE_PERIOD = 1 / 60
"""Wall time between two pictures [s]."""
_ROBOT_AZIMUTH, _ROBOT_ELEVATION = 140.0, -20.0
"""Azimuth and elevation of the camera at the start [deg]."""


class Upload:
    """Hands the sea's mesh to the graphics card.

    MuJoCo's call returns when the window has drawn, and never where it was closed in that moment: so it is made in a
    thread that may be left behind.
    """

    def __init__(self, handle: Handle, mesh: int) -> None:
        self._handle, self._mesh = handle, mesh
        self._asked, self._done = threading.Event(), threading.Event()
        self._done.set()
        threading.Thread(target=self._upload, name="vrx_mj view", daemon=True).start()

    def __call__(self) -> None:
        """Upload, and return when that is done or the window is closed."""
        self._done.clear()
        self._asked.set()
        self.wait()

    def wait(self) -> None:
        """Return when nothing is under way, or the window is closed."""
        while not self._done.wait(0.2) and self._handle.is_running():
            pass

    def _upload(self) -> None:
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

    server = None

    def is_open(self) -> bool:
        """False once it was closed."""
        return bool(self._handle.is_running())

    def pressed_keys(self) -> Iterator[str]:
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

    def close(self) -> None:
        """Take the window away."""
        if self._upload is not None:
            self._upload.wait()  # closed in the middle of one, the window would wait for it for ever
        self._handle.close()
        for thread in self._drawing:  # it must not draw while Python ends
            thread.join(_CLOSE_TIMEOUT)

    def _start(self, sim: Simulation) -> None:
        """Set the camera, the fog, and the flags whose keys are ours."""
        handle = self._handle
        with handle.lock():
            handle.cam.distance, handle.cam.elevation = _DISTANCE, _ELEVATION
            handle.cam.azimuth = float(np.degrees(sim.observe()[sim.boats[0]].heading)) + 20.0
            handle.user_scn.flags[mujoco.mjtRndFlag.mjRND_FOG] = sim.world.parameters.scene.fog
        self._visual = _flags_of_keys(mujoco.mjVISSTRING, handle.opt.flags)
        self._render = _flags_of_keys(mujoco.mjRNDSTRING, handle.user_scn.flags)
        self._groups = np.array(handle.opt.geomgroup)

    def _keep_flags(self) -> None:
        """MuJoCo's viewer toggles a flag at most letters, and groups of geoms at digits: not at those that drive."""
        for flags, taken in ((self._handle.opt.flags, self._visual), (self._handle.user_scn.flags, self._render)):
            for index, value in taken.items():
                flags[index] = value
        self._handle.opt.geomgroup[:] = self._groups


def _flags_of_keys(names: Sequence[tuple[str, str, str]], flags: Sequence[int]) -> dict[int, int]:
    """The flags that MuJoCo's viewer toggles with a key of ours, and their values now."""
    return {i: int(flags[i]) for i, (_, _, key) in enumerate(names) if key and key.lower() in KEYS}


def _texts(session: Session) -> list[tuple[int, int, str, str]]:
    font, grid = mujoco.mjtFontScale.mjFONTSCALE_100, mujoco.mjtGridPos
    return [
        (font, place, "\n".join(row[0] for row in rows), "\n".join(row[1] for row in rows))
        for place, rows in ((grid.mjGRID_TOPLEFT, session.status()), (grid.mjGRID_BOTTOMLEFT, HELP))
    ]


def window_model(world: World) -> mujoco.MjModel:
    """The model that MuJoCo's window draws: everything visible, and a sea that can move in the place of flat water."""
    spec = mujoco.MjSpec.from_string(world.mjcf, assets=dict(world.assets))
    spec.visual.quality.shadowsize = 2048
    add_signs(spec, world)
    water = spec.geom(_WATER)
    if water is None:
        return spec.compile()
    material = spec.material(_WATER)
    if material is not None:
        material.reflectance = 0.0  # waves have no one plane to mirror in
    spec.delete(water)
    points, faces = _sea_points(lambda x, y, t: 0.0 * x, (0.0, 0.0), 0.0), _sea_faces()
    spec.add_mesh(
        name=_NAME,
        uservert=points.reshape(-1),
        userface=faces.reshape(-1),
        usernormal=np.tile([0.0, 0.0, 1.0], len(points)),
        userfacenormal=faces.reshape(-1),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    spec.worldbody.add_geom(
        name=_NAME, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=_NAME, material=_WATER, contype=0, conaffinity=0, group=1
    )
    return spec.compile()


class SeaMesh:
    """Writes the sea into the model of a window."""

    def __init__(self, model: mujoco.MjModel, height: SeaHeight) -> None:
        self._height = height
        self._model = model
        self.mesh = int(model.mesh(_NAME).id)
        """Number of the mesh, for `update_mesh`."""
        self._geom = int(model.geom(_NAME).id)
        start, first = int(model.mesh_vertadr[self.mesh]), int(model.mesh_normaladr[self.mesh])
        self._points = slice(start, start + SIDE * SIDE)
        self._normals = slice(first, first + SIDE * SIDE)

    def follow(self, data: mujoco.MjData, place: tuple[float, float], time: float) -> None:
        """Draw the sea around `place` [m, ENU] at simulated time `time` [s].

        The mesh is placed in `data` by hand: MuJoCo places what does not move once and for all.
        """
        centre = np.round(np.asarray(place) / CELL) * CELL  # vertices keep their places while the boat moves
        points = _sea_points(self._height, (float(centre[0]), float(centre[1])), time)
        self._model.mesh_vert[self._points] = points
        self._model.mesh_normal[self._normals] = normals(points)
        data.geom_xpos[self._geom] = (*centre, 0.0)
        data.geom_xmat[self._geom] = np.eye(3).reshape(-1)


def sea_of(model: mujoco.MjModel, height: SeaHeight) -> SeaMesh | None:
    """The moving sea of a window's model; None where the world has no water."""
    names = {model.mesh(number).name for number in range(model.nmesh)}
    return SeaMesh(model, height) if _NAME in names else None


def sea_lines() -> FloatArray:
    """Coordinates of the grid's lines from its middle [m]: cells grow with distance."""
    half = (SIDE - 1) // 2
    index = np.arange(-half, half + 1)
    lines: FloatArray = CELL * index * (1.0 + (HORIZON / (CELL * half) - 1.0) * (index / half) ** 4)
    return lines


def _sea_points(height: SeaHeight, centre: tuple[float, float], time: float) -> FloatArray:
    """Vertices (SIDE * SIDE, 3) [m] of the sea at simulated time `time` [s], from `centre` [m, ENU]."""
    x, y = np.meshgrid(sea_lines(), sea_lines())
    away = np.hypot(x, y)
    near = away < _CALM[1]
    z = np.zeros_like(x)
    fade = np.clip((_CALM[1] - away[near]) / (_CALM[1] - _CALM[0]), 0.0, 1.0)
    z[near] = fade * np.asarray(height(x[near] + centre[0], y[near] + centre[1], time))
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def _sea_faces() -> npt.NDArray[np.int32]:
    """Triangles (2 * (SIDE - 1)^2, 3), counter-clockwise seen from above."""
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1, 1)
    first, second = corner + np.array([0, 1, SIDE + 1]), corner + np.array([0, SIDE + 1, SIDE])
    return np.concatenate([first, second]).astype(np.int32)


def normals(points: FloatArray) -> FloatArray:
    """Unit normals (SIDE * SIDE, 3) of the surface, by its slopes along the grid's lines, steeper."""
    lines = sea_lines()
    slopes = np.gradient(points[:, 2].reshape(SIDE, SIDE), lines, lines)
    along_y, along_x = np.tanh(_RELIEF * np.stack(slopes))
    out = np.stack([-along_x, -along_y, np.ones_like(along_x)], axis=-1).reshape(-1, 3)
    unit: FloatArray = out / np.linalg.norm(out, axis=1, keepdims=True)
    return unit


def show_joints(model: mujoco.MjModel) -> None:
    """Show a model whose joints are where its controls are, until the window is closed, or Ctrl-C."""
    from mujoco import viewer

    data = mujoco.MjData(model)
    data.ctrl[:] = data.qpos
    mujoco.mj_forward(model, data)
    with (
        ended_by_signals(),
        contextlib.suppress(KeyboardInterrupt),
        viewer.launch_passive(model, data, show_left_ui=False) as window,
    ):
        with window.lock():
            _look_at_all(window.cam, model, data)
        while window.is_running():
            data.qpos[:] = data.ctrl
            mujoco.mj_forward(model, data)
            window.sync()
            time.sleep(_PICTURE_PERIOD)


def _look_at_all(camera: mujoco.MjvCamera, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Place the camera where it sees all that is drawn."""
    reach = model.geom_rbound[:, np.newaxis]
    low, high = (data.geom_xpos - reach).min(axis=0, initial=0.0), (data.geom_xpos + reach).max(axis=0, initial=0.0)
    camera.lookat[:] = (low + high) / 2
    camera.distance = 0.8 * np.linalg.norm(high - low)
    camera.azimuth, camera.elevation = _ROBOT_AZIMUTH, _ROBOT_ELEVATION
