"""Pictures of rows and of teams, and how they are shown."""

import sys
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arrays import BoolArray, ByteArray, FloatArray
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.frames import rotation
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.mjcf.world import World
from vrx_mj.rl.problem import Rows
from vrx_mj.sensors.camera import Cameras

_CAMERA_BEHIND, _CAMERA_ABOVE, _CAMERA_DOWN = 12.0, 6.0, 0.35
"""Place of the camera behind and above a boat [m], and by how much it looks down [rad]."""
_TEAM_PITCH = 0.5
"""Angle by which the camera of a team looks down, to the north [rad]."""
_MIN_CAMERA_DISTANCE, _CAMERA_DISTANCE_FACTOR = 14.0, 1.1
"""Distance of that camera from the team's middle, at least [m], and for each m of the team's radius."""
_COLUMNS = 80
"""Width of a picture in the terminal [characters]."""


class Picture:
    """A camera; the model it draws is made for the first picture."""

    def __init__(self, world: World, width: int, height: int) -> None:
        self._world = world
        self._lens = CameraConfig(name="picture", link="base_link", width=width, height=height, noise=0.0)
        self._model: mujoco.MjModel | None = None

    def __getstate__(self) -> dict[str, Any]:
        """The camera without what is made for the first picture."""
        return {"_world": self._world, "_lens": self._lens, "_model": None}

    def close(self) -> None:
        """Free the drawing context; the next picture makes a new one."""
        if self._model is not None:
            self._cameras.close()

    def from_behind(self, rows: Rows, row: int) -> ByteArray:
        """The picture (height, width, 3) of a row, from behind and above its first boat."""
        x, y, _, w, qx, qy, z = rows.features[row, 0, :7]
        yaw = float(np.arctan2(2 * (w * z + qx * qy), 1 - 2 * (qy * qy + z * z)))
        place = np.array([x - _CAMERA_BEHIND * np.cos(yaw), y - _CAMERA_BEHIND * np.sin(yaw), _CAMERA_ABOVE])
        return self._image(rows, row, place, (0.0, _CAMERA_DOWN, yaw))

    def from_south(self, rows: Rows, row: int, present: BoolArray) -> ByteArray:
        """The picture (height, width, 3) of a row, from the south, with all boats that are present, (boats,)."""
        places = rows.features[row, present, :2]
        low, high = (places.min(axis=0), places.max(axis=0)) if len(places) else (np.zeros(2), np.zeros(2))
        away = _MIN_CAMERA_DISTANCE + _CAMERA_DISTANCE_FACTOR * 0.5 * float(np.hypot(*(high - low)))
        x, y = (low + high) / 2.0
        place = np.array([x, y - away * np.cos(_TEAM_PITCH), away * np.sin(_TEAM_PITCH)])
        return self._image(rows, row, place, (0.0, _TEAM_PITCH, np.pi / 2))

    def _image(self, rows: Rows, row: int, place: FloatArray, turned: tuple[float, float, float]) -> ByteArray:
        """The picture from a place (3,) [m], by the camera's roll, pitch and yaw [rad]; x is forward."""
        if self._model is None:
            self._model = drawing_model(self._world)
            self._data = mujoco.MjData(self._model)
            self._cameras = Cameras(self._model, self._world.parameters)
        self._data.qpos[:] = rows.qpos[row]
        mujoco.mj_kinematics(self._model, self._data)
        self._cameras.set_sea(rows.waves(row))
        axes, time = np.array(rotation(*turned)), float(rows.time[row])
        return self._cameras.image(self._lens, self._data, place, axes, time).rgb


def show(picture: ByteArray) -> None:
    """Write a picture to the terminal, two pixels to a character, over the one before."""
    step = max(1, picture.shape[1] // _COLUMNS)
    small = picture[::step, ::step]
    rows = (zip(small[k], small[k + 1], strict=True) for k in range(0, len(small) - 1, 2))
    lines = ("".join("\x1b[38;2;{};{};{}m\x1b[48;2;{};{};{}m▀".format(*up, *down) for up, down in row) for row in rows)
    sys.stdout.write("\x1b[H" + "\x1b[0m\n".join(lines) + "\x1b[0m\n")
    sys.stdout.flush()
