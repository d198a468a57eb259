"""Cameras: pictures of a moment of the world, drawn without a screen."""

import copy
import functools
import math
from collections.abc import Mapping, Sequence
from statistics import NormalDist

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.model.world import Parameters
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.noise import bits
from vrx_mj.physics.tables import Table
from vrx_mj.sensors.canvas import Canvas
from vrx_mj.sensors.readings import Image
from vrx_mj.sensors.sea import SeaSkin
from vrx_mj.sensors.view import View, intrinsics

LEVELS = 4096
"""Quantiles of the normal distribution that a pixel's noise is one of: 12 random bits choose it."""

_LEVELS_PER_WORD = 5
"""Number of pixels whose noise one random word of 64 bits chooses."""
_12, _4095 = np.uint64(12), np.uint64(4095)


@functools.lru_cache(maxsize=16)
def grain_table(noise: float) -> npt.NDArray[np.int32]:
    """Noise of a pixel (LEVELS,) [counts of 255], for a standard deviation `noise` of full scale.

    The medians of equally likely parts of the normal distribution, brought to its variance: none beyond 3.8
    standard deviations. They are rounded, as a pixel with noise would be.
    """
    normal = NormalDist()
    quantiles = np.array([normal.inv_cdf((index + 0.5) / LEVELS) for index in range(LEVELS)])
    quantiles /= np.sqrt(np.mean(quantiles**2))
    return np.rint(np.clip(255.0 * noise * quantiles, -255.0, 255.0)).astype(np.int32)


@kernel
def with_grain(drawn: ByteArray, table: npt.NDArray[np.int32], key: np.uint64, out: ByteArray) -> None:
    """Write `drawn` (height, width, 3), whose first row is the lowest, into `out`, first row highest, with noise.

    A pixel's three channels get the same number of stream `key`, as VRX's do.
    """
    height, width = drawn.shape[0], drawn.shape[1]
    word, left, counter = np.uint64(0), 0, np.uint64(0)
    for row in range(height):
        source, target = drawn[height - 1 - row], out[row]
        for column in range(width):
            if left == 0:
                word, left, counter = bits(key, counter), _LEVELS_PER_WORD, counter + np.uint64(1)
            change = table[word & _4095]
            word, left = word >> _12, left - 1
            for channel in range(3):
                target[column, channel] = np.uint8(min(max(np.int32(source[column, channel]) + change, 0), 255))


class Cameras:
    """All cameras of a world: those of the same `antialiasing` share a drawing context, which the first picture makes.

    Pictures must be drawn in one thread; another thread makes its own `Cameras`. The same moment gives the same
    bits on the same machine with the same way of drawing (`MUJOCO_GL`).
    """

    def __init__(self, model: mujoco.MjModel, world: Parameters) -> None:
        """Take a world's drawing model and its parameters; nothing is drawn or opened yet."""
        self._model = copy.copy(model)
        self._fog = world.scene.fog
        self._sea = SeaSkin(model, world.sea)
        self._canvases: dict[int, Canvas] = {}
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
            RenderError: nothing can draw here, with what to install.
        """
        view = self.view(config, position, rotation)
        samples, width, height = config.antialiasing, config.width, config.height
        if samples not in self._canvases:
            self._canvases[samples] = Canvas(self._model, width=width, height=height, fog=self._fog, samples=samples)
        if self._drawn.shape[:2] != (config.height, config.width):
            self._drawn = np.empty((config.height, config.width, 3), np.uint8)
        mujoco.mj_camlight(self._model, data)
        self._sea.move_into(view, data, time)
        self._canvases[samples].draw(data, view, [self._sea], self._drawn)
        rgb = np.empty_like(self._drawn)
        if config.noise > 0.0:
            own = np.uint64(bits(np.uint64(key), np.uint64(index)))  # numba returns it as a plain int
            with_grain(self._drawn, grain_table(config.noise), own, rgb)
        else:
            np.copyto(rgb, self._drawn[::-1])
        return Image(rgb=rgb, info=intrinsics(config))

    def seen_geoms(self, config: CameraConfig) -> IntArray:
        """Numbers (height, width) of the geoms that the pixels of the last picture, which this camera took, show."""
        return self._canvases[config.antialiasing].seen_geoms(self._drawn)[::-1]

    def paint(self, colors: Mapping[int, Sequence[float]]) -> None:
        """Give geoms of the drawing model, by number, another colour: red, green, blue and alpha, 0 to 1."""
        for geom, rgba in colors.items():
            self._model.geom_rgba[geom] = rgba

    def set_sea(self, waves: Table) -> None:
        """Draw a sea of these waves, `tables.WAVE`, instead of the world's from now on."""
        self._sea.set_waves(waves)

    def compile(self) -> None:
        """Compile the kernels that pictures need; nothing is drawn."""
        dot = np.zeros((1, 1, 3), np.uint8)
        self._sea.move(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.0, math.pi, 0.0)
        with_grain(dot, grain_table(0.01), np.uint64(0), dot.copy())

    def close(self) -> None:
        """Free the drawing context; the next picture makes a new one."""
        while self._canvases:
            self._canvases.popitem()[1].close()

    @staticmethod
    def view(config: CameraConfig, position: FloatArray, rotation: FloatArray) -> View:
        """The camera's view of the world from a place [m] and with a rotation (3, 3), camera to world axes."""
        place, turn = np.asarray(position, np.float64), np.asarray(rotation, np.float64).reshape(3, 3)
        size, reach = (config.width, config.height), (config.near, config.far)
        return View.of_camera(place, turn, config.horizontal_fov, size, reach)
