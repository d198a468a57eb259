"""Lidars, planar ones and those of several rings, as VRX's Gazebo plugins make them.

What they see is what Gazebo's rendered lidar sees: the shapes that are looked at, but not the water. Nothing is
seen that is nearer than the range begins, so a lidar's own housing does not blind it; the rest of its boat is seen.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.physics.elementary import cosine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.noise import normal
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import ramp, wave_phase
from vrx_mj.sensors.rays import VIEW, angles, cast, grid, reflecting, shapes_of
from vrx_mj.sensors.readings import PointCloud, Scan

_SURFACE_TOLERANCE = 1e-9
"""Height above the surface at which a ray has met it [m]."""
_MAX_STEPS = 200
"""Number of steps after which a ray that has not met the surface only grazes it, and does not return."""


@kernel
def _along(waves: Table, x: float, y: float, dx: float, dy: float, t: float) -> tuple[float, float]:
    """Return the height [m] of the grown sea over its mean at (x, y), and its slope along (dx, dy)."""
    height, slope = 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        phase = wave_phase(wave, x, y, t)
        height += wave.amplitude * cosine(phase)
        slope -= wave.amplitude * wave.wavenumber * (wave.direction[0] * dx + wave.direction[1] * dy) * math.sin(phase)
    return height, slope


@kernel
def _bounds(waves: Table, dx: float, dy: float) -> tuple[float, float]:
    """Return the most that the grown sea rises over its mean [m], and that it bends along (dx, dy) [1/m]."""
    height, bend = 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        rate = wave.wavenumber * (wave.direction[0] * dx + wave.direction[1] * dy)
        height += abs(wave.amplitude)
        bend += abs(wave.amplitude) * rate * rate
    return height, bend


@kernel
def sea_distance(
    waves: Table, sea: Record, t: float, origin: FloatArray, along: FloatArray, begin: float, end: float
) -> float:
    """Return how far a ray goes until it first meets the sea's surface from above [m], else infinity.

    With f(s) the height of the ray over the surface, no bend of the surface is sharper than some M, so that
    f(s + h) >= f + f' h - M h^2 / 2. Each step goes to where that bound is zero: it passes no crossing, and near one
    it converges as Newton's method does.

    Args:
        waves: `tables.WAVE`.
        sea: a row of `tables.SEA`.
        t: time [s].
        origin: (3,) of the ray, world [m].
        along: (3,) its unit vector.
        begin: where on the ray to begin [m].
        end: where to end [m].
    """
    grown = ramp(sea, t)
    highest, bend = _bounds(waves, along[0], along[1])
    highest, bend = grown * highest, grown * bend
    over = origin[2] + begin * along[2] - sea.level - highest
    if over > 0.0:  # down to the height of the highest crest
        if along[2] >= 0.0:
            return math.inf
        begin -= over / along[2]
    s = begin
    for step in range(_MAX_STEPS):
        if not s < end:
            return math.inf
        x, y = origin[0] + s * along[0], origin[1] + s * along[1]
        height, slope = _along(waves, x, y, along[0], along[1], t)
        gap = origin[2] + s * along[2] - sea.level - grown * height
        if gap <= _SURFACE_TOLERANCE:
            return s if step > 0 or gap >= -_SURFACE_TOLERANCE else math.inf  # from under water nothing is seen
        rate = along[2] - grown * slope
        root = math.sqrt(rate * rate + 2.0 * bend * gap)
        if rate < 0.0:
            s += 2.0 * gap / (root - rate)
        elif bend > 0.0:
            s += (rate + root) / bend
        else:
            return math.inf
    return math.inf


@kernel
def cast_at_sea(
    view: Record, rays: Record, directions: FloatArray, waves: Table, sea: Record, t: float, found: FloatArray
) -> None:
    """Shorten rays to where they meet the sea; the arguments are those of `rays.cast` and of `sea_distance`."""
    turned, along = view.rotation, view.along
    for ray in range(len(found)):
        x, y, z = directions[ray, 0], directions[ray, 1], directions[ray, 2]
        for i in range(3):
            along[i] = turned[i, 0] * x + turned[i, 1] * y + turned[i, 2] * z
        end = min(rays.far, found[ray])
        found[ray] = min(found[ray], sea_distance(waves, sea, t, view.origin, along, rays.near, end))


class Water(NamedTuple):
    """The sea at the moment of a scan, for a lidar with `sea_returns`."""

    waves: Table
    """`tables.WAVE`."""
    sea: Table
    """`tables.SEA`, one row."""
    time: float
    """Time of the scan [s]."""


class Lidar:
    """A lidar on a body. It keeps its rays, and no state: a scan is a function of the poses, a key and a number."""

    def __init__(
        self,
        model: mujoco.MjModel,
        config: LidarConfig,
        body: int,
        position: npt.ArrayLike,
        rotation: npt.ArrayLike,
        *,
        own: bool = True,
    ) -> None:
        """A lidar.

        Args:
            model: with visual geoms, such as `Simulation.visual_model`.
            config: what it is like.
            body: number of the body that carries it.
            position: (3,) of its measuring frame (x forward, z up) in the body's frame [m].
            rotation: (3, 3) from its measuring frame's axes to the body's.
            own: whether it sees what moves with that body.
        """
        self._model, self._config, self._body = model, config, body
        self._position = np.array(position, np.float64)
        self._rotation = np.array(rotation, np.float64)
        self._rays = grid(config)
        rays = self._rays[0]
        self._directions = _directions(angles(rays["elevation"], config.rings), angles(rays["azimuth"], config.samples))
        geoms = reflecting(model)
        others = model.body_rootid[model.geom_bodyid[geoms]] != model.body_rootid[body]
        self._geoms = geoms if own else geoms[others]

    def scan(self, data: mujoco.MjData, key: int, index: int, sea: Water | None = None) -> PointCloud | Scan:
        """Output of the lidar: a cloud of its returns, or a planar scan.

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
