"""What cameras and lidars see: the drawing model, posed as the world was at a moment."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.mjcf.world import World
from vrx_mj.physics.kernel import cached
from vrx_mj.physics.surface import draw_surface
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.runtime.sample_clocks import Moment
from vrx_mj.runtime.warmup import announced
from vrx_mj.sensors.camera import Cameras
from vrx_mj.sensors.displays import Display
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.lidar import Lidar, Water, noisy
from vrx_mj.sensors.rays import cast
from vrx_mj.sensors.readings import Image, PointCloud, Scan
from vrx_mj.sensors.sea_returns import cast_at_sea

__all__ = ["Sights", "painted"]

SEA = ("the sea's pictures", 8)
"""What cameras compile, and for how long, about [s]."""


class Sights:
    """The cameras and lidars of a run; the drawing model is made for the first that is used."""

    def __init__(self, world: World, rig: LoopArrays, drawing: Callable[[], mujoco.MjModel]) -> None:
        self._world, self._rig, self._drawing = world, rig, drawing
        self._data: mujoco.MjData | None = None
        self._cameras: Cameras | None = None
        self._lidars: dict[tuple[str, str], Lidar] = {}

    def image(self, sensor: Mounted, now: Moment, draw: Draw) -> Image:
        """The picture of a camera."""
        model = self._drawing()
        if self._cameras is None:
            self._cameras = Cameras(model, self._world.parameters)
        place = sensor.place(now.qpos, now.qvel)
        data = self._scene(model, now)
        if self._rig.displays:
            self._cameras.paint(painted(model, self._rig.displays, self._rig.shown(now.device_state), now.time))
        at = place.position, place.rotation, now.time
        with announced(draw_surface, *SEA):
            return self._cameras.image(sensor.config, data, *at, draw.key, draw.index)

    def scan(self, sensor: Mounted, now: Moment, draw: Draw) -> PointCloud | Scan:
        """The scan of a lidar."""
        model = self._drawing()
        key = sensor.boat, sensor.name
        if key not in self._lidars:
            body = int(model.body(sensor.body).id)
            mount = sensor.mount
            self._lidars[key] = Lidar(model, sensor.config, body, mount.position, mount.rotation)
        water = Water(self._rig.waves, self._rig.sea, now.time) if sensor.config.sea_returns else None
        with announced(cast, "the lidar", 8):
            return self._lidars[key].scan(self._scene(model, now), draw.key, draw.index, water)

    def compile(self, sensors: Sequence[Mounted], now: Moment) -> None:
        """Have the kernels that cameras and lidars need compiled, if they are not; `now` is any moment.

        What is cached is left for the first reading to load, in a fraction of a second.
        """
        if any(sensor.config.type == "camera" for sensor in sensors) and not cached(draw_surface):
            with announced(draw_surface, *SEA):
                Cameras(self._drawing(), self._world.parameters).compile()
        lidars = (sensor for sensor in sensors if sensor.config.type == "lidar")
        for sea, sensor in {sensor.config.sea_returns: sensor for sensor in lidars}.items():
            if not (cached(cast) and cached(noisy) and (cached(cast_at_sea) or not sea)):
                self.scan(sensor, now, Draw(0, sensor.boat, sensor.name, 0, sensor.config.rate))

    def _scene(self, model: mujoco.MjModel, now: Moment) -> mujoco.MjData:
        """Where everything was at a moment."""
        if self._data is None:
            self._data = mujoco.MjData(model)
        self._data.qpos[:] = now.qpos
        mujoco.mj_kinematics(model, self._data)
        return self._data


def painted(
    model: mujoco.MjModel, displays: Sequence[Display], marks: FloatArray, time: float
) -> dict[int, tuple[float, ...]]:
    """Colours of lights and placards by the numbers of their geoms in a model, by their marks at a time [s]."""
    now = np.array([time])
    colors: dict[int, tuple[float, ...]] = {}
    for display in displays:
        parts = display.colors(int(display.codes(marks[None], now)[0]))
        colors |= {int(model.geom(name).id): parts[part] for part in parts for name in display.parts[part]}
    return colors
