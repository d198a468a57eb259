"""Cameras: pictures of a moment of the world, drawn without a screen."""

import copy
import math
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.model.world import Parameters
from vrx_mj.physics.noise import bits
from vrx_mj.physics.surface import HORIZON
from vrx_mj.physics.tables import Table
from vrx_mj.sensors.canvas import Canvas
from vrx_mj.sensors.grain import copy_flipped, grain_table, with_grain
from vrx_mj.sensors.intrinsics import focal_length, half_heights, intrinsics
from vrx_mj.sensors.readings import Image
from vrx_mj.sensors.sea import SeaSkin
from vrx_mj.sensors.view import View

__all__ = ["Cameras"]


class Cameras:
    """All cameras of a world: they share one drawing context, which the first picture makes.

    Pictures must be drawn in one thread; another thread makes its own `Cameras`. The same moment gives the same
    bits on the same machine with the same way of drawing (`MUJOCO_GL`).
    """

    def __init__(self, model: mujoco.MjModel, world: Parameters) -> None:
        """Take a world's drawing model and its parameters; nothing is drawn or opened yet."""
        self._model = copy.copy(model)
        self._fog = world.scene.fog
        self._sea = SeaSkin(model, world.sea)
        self._canvas: Canvas | None = None
        self._drawn = np.zeros((0, 0, 3), np.uint8)

    def image(
        self,
        config: CameraConfig,
        data: mujoco.MjData,
        position: FloatArray,
        rotation: FloatArray,
        time: float,
        key: int = 0,
        index: int = 0,
    ) -> Image:
        """The picture that a camera takes.

        Args:
            config: the camera.
            data: positions of the drawing model's bodies and geoms, as `mj_kinematics` leaves them.
            position: of the camera (3,) [m], world.
            rotation: (3, 3), camera to world axes; x forward, y left, z up.
            time: simulated [s], for the waves.
            key: of the camera's stream of noise.
            index: number of the picture in that stream.

        Raises:
            RenderError: there is no way to draw here, with what to install.
        """
        view = self.view(config, position, rotation)
        self._prepare(config)
        mujoco.mj_camlight(self._model, data)
        self._sea.move(view.position, self._sun(data), *view.horizontal_range(), time)
        assert self._canvas is not None
        self._canvas.draw(data, view, self._sea, self._drawn)
        rgb = np.empty_like(self._drawn)
        if config.noise > 0.0:
            own = np.uint64(bits(np.uint64(key), np.uint64(index)))  # numba returns it as a plain int
            with_grain(self._drawn, grain_table(config.noise), own, rgb)
        else:
            copy_flipped(self._drawn, rgb)
        return Image(rgb=rgb, info=intrinsics(config))

    def paint(self, colors: Mapping[int, Sequence[float]]) -> None:
        """Give geoms of the drawing model, by number, another colour: red, green, blue and alpha, 0 to 1."""
        for geom, rgba in colors.items():
            self._model.geom_rgba[geom] = rgba

    def set_sea(self, waves: Table) -> None:
        """Draw a sea of these waves, `tables.WAVE`, instead of the world's from now on."""
        self._sea.set_waves(waves)

    def compile(self) -> None:
        """Have the kernels that pictures need compiled; nothing is drawn."""
        dot = np.zeros((1, 1, 3), np.uint8)
        self._sea.move(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.0, math.pi, 0.0)
        with_grain(dot, grain_table(0.01), np.uint64(0), dot.copy())

    def close(self) -> None:
        """Free the drawing context; the next picture makes a new one."""
        if self._canvas is not None:
            self._canvas.close()
            self._canvas = None

    @staticmethod
    def view(config: CameraConfig, position: FloatArray, rotation: FloatArray) -> View:
        """The camera's view of the world from a place [m] and with a rotation (3, 3), camera to world axes."""
        half_width, half_height = half_heights(config)
        return View(
            position=np.asarray(position, np.float64),
            rotation=np.asarray(rotation, np.float64).reshape(3, 3),
            half_width=half_width,
            half_height=half_height,
            near=config.near,
            far=config.far,
            focal_length=focal_length(config),
            end=1.2 * HORIZON,
        )

    def _prepare(self, config: CameraConfig) -> None:
        """Make the canvas when it is first needed, and the room that a picture is read into."""
        if self._canvas is None:
            self._canvas = Canvas(self._model, width=config.width, height=config.height, fog=self._fog)
        if self._drawn.shape[:2] != (config.height, config.width):
            self._drawn = np.empty((config.height, config.width, 3), np.uint8)

    def _sun(self, data: mujoco.MjData) -> FloatArray:
        """Unit vector to the sun; straight up in a world without light."""
        if not self._model.nlight:
            return np.array([0.0, 0.0, 1.0])
        return np.asarray(-data.light_xdir[0], np.float64)
