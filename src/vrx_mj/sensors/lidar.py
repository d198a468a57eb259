"""Lidars, planar ones and those of several rings, as VRX's Gazebo plugins make them.

What they see is what Gazebo's rendered lidar sees: the shapes that are looked at, but not the water. Nothing is
seen that is nearer than the range begins, so a lidar's own housing does not blind it; the rest of its boat is seen.
"""

from typing import NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.noise import normal
from vrx_mj.physics.tables import Table
from vrx_mj.sensors.rays import VIEW, cast, reflecting, shapes_of
from vrx_mj.sensors.readings import PointCloud, Scan
from vrx_mj.sensors.sea_returns import cast_at_sea
from vrx_mj.sensors.windows import angles, grid

__all__ = ["Lidar", "Water", "noisy"]


class Water(NamedTuple):
    """The sea at the moment of a scan, for a lidar with `sea_returns`."""

    waves: Table
    """`tables.WAVE`."""
    sea: Table
    """`tables.SEA`, one row."""
    time: float
    """[s]"""


class Lidar:
    """A lidar on a body. It keeps its rays, and no state: a scan is a function of the poses, a key and a number."""

    def __init__(
        self,
        model: mujoco.MjModel,
        config: LidarConfig,
        body: int,
        position: npt.ArrayLike,
        rotation: npt.ArrayLike,
    ) -> None:
        """A lidar.

        Args:
            model: with visual geoms, such as `Simulation.visual_model`.
            config: what it is like.
            body: number of the body that carries it.
            position: (3,) of its measuring frame (x forward, z up) in the body's frame [m].
            rotation: (3, 3) from its measuring frame's axes to the body's.
        """
        self._model, self._config, self._body = model, config, body
        self._position = np.array(position, np.float64)
        self._rotation = np.array(rotation, np.float64)
        self._rays = grid(config.rings, config.samples, config.elevation, config.azimuth, config.range)
        rays = self._rays[0]
        self._directions = _directions(angles(rays["elevation"], config.rings), angles(rays["azimuth"], config.samples))
        self._geoms = reflecting(model)

    def scan(self, data: mujoco.MjData, key: int, index: int, sea: Water | None = None) -> PointCloud | Scan:
        """What the lidar gives: a cloud of its returns, or a planar scan.

        A ray's noise depends on the key, the scan's number and the ray's own number alone, not on what else is
        hit. In a cloud, as in VRX's, a return is dropped when noise carries it out of the range; in a scan it
        stays at the range's end.

        Args:
            data: of the model, with positions of bodies and geoms computed (`mj_kinematics`).
            key: of the stream of noise, from `physics.noise.stream_key`.
            index: number of the scan, from 0.
            sea: needed if the lidar has `sea_returns`, else not looked at.
        """
        first = np.uint64(index * len(self._directions))
        config, found = self._config, self.ranges(data, sea)
        noisy(config.noise, config.resolution, np.uint64(key), first, found)
        return self._cloud(found) if config.output == "points" else self._planar(found)

    def ranges(self, data: mujoco.MjData, sea: Water | None = None) -> FloatArray:
        """The true distances (rays,) to what the rays meet, infinite where nothing is within the range [m].

        They go sample by sample, in each from ring 0 up. `data` and `sea` are those of `scan`.
        """
        view, found = np.zeros(1, VIEW)[0], np.empty(len(self._directions))
        turned = data.xmat[self._body].reshape(3, 3)
        view["model"], view["data"] = self._model._address, data._address
        view["origin"] = data.xpos[self._body] + turned @ self._position
        view["rotation"] = turned @ self._rotation
        cast(view, self._rays[0], self._directions, shapes_of(self._model, data), self._geoms, found)
        if self._config.sea_returns:
            assert sea is not None, f"{self._config.name} sees the sea, and was given none"
            cast_at_sea(view, self._rays[0], self._directions, sea.waves, sea.sea[0], sea.time, found)
        found[found >= self._config.range[1]] = np.inf
        return found

    def _cloud(self, found: FloatArray) -> PointCloud:
        near, far = self._config.range
        valid = np.flatnonzero((found > near) & (found < far))
        points = (found[valid, None] * self._directions[valid]).astype(np.float32)
        ring = (valid % self._config.rings).astype(np.uint16)
        return PointCloud(points, np.zeros(len(valid), np.float32), ring)

    def _planar(self, found: FloatArray) -> Scan:
        near, far = self._config.range
        ranges = np.where(np.isfinite(found), np.clip(found, near, far), np.inf).astype(np.float32)
        first, step = (float(value) for value in self._rays["azimuth"][0])
        return Scan(ranges, first, first + step * (self._config.samples - 1), step, near, far)


def _directions(elevation: FloatArray, azimuth: FloatArray) -> FloatArray:
    """Unit vectors in the sensor's frame, (samples * rings, 3): sample by sample, in each from ring 0 up."""
    up, course = (angle.reshape(-1) for angle in np.meshgrid(elevation, azimuth))
    return np.stack((np.cos(up) * np.cos(course), np.cos(up) * np.sin(course), np.sin(up)), axis=1)


@kernel
def noisy(noise: float, resolution: float, key: np.uint64, first: np.uint64, found: FloatArray) -> None:
    """Add noise of standard deviation `noise` to finite distances and round them to multiples of `resolution` [m].

    Ray `i` takes number `first` + i of stream `key`. A `resolution` of zero leaves distances as they are.
    """
    for ray in range(len(found)):
        if found[ray] < np.inf:
            if noise > 0.0:
                found[ray] += noise * normal(key, first + np.uint64(ray))
            if resolution > 0.0:
                found[ray] = resolution * np.floor(found[ray] / resolution + 0.5)
