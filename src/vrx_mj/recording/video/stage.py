"""Draws moments of a recording: its world's drawing model, the sea of that moment, foam behind the boats."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.mjcf.drawing import drawing_model
from vrx_mj.model.world import Parameters
from vrx_mj.physics.surface import EDGE, draw_surface
from vrx_mj.recording.boat_sets import BoatSet
from vrx_mj.recording.simulation_scene import check_columns
from vrx_mj.recording.video.eye import Eye, view_of
from vrx_mj.recording.video.footage import Instant
from vrx_mj.runtime.sensing import painted
from vrx_mj.runtime.warmup import announced
from vrx_mj.sensors.canvas import Canvas
from vrx_mj.sensors.displays import check_display_marks, displays_of
from vrx_mj.sensors.sea import SeaSkin
from vrx_mj.sensors.view import View

__all__ = ["LASTS", "PIECES_PER_SECOND", "Stage", "Wake", "add_triangles", "sterns", "strip_of", "triangles_of"]

Paths = Mapping[str, FloatArray]

SAMPLES = 4
"""Per pixel, so that edges are smooth."""
STEEP = 0.5
"""Height of the view's axis [unit vector], negative, from which a picture is one from above."""
RELIEF = 5.0
"""How much more the slopes of waves shade a sea that is seen from above, where little of the sky mirrors in it."""
LIGHTER = 0.14
"""Share of the sky by which a sea that is seen from above is lighter."""
TRIANGLES = 4
"""Triangles of foam per piece: two between two pieces, and as many to spare."""


class Stage:
    """The world of boats that sail together, with a drawing context."""

    def __init__(self, boat_set: BoatSet, paths: Paths, size: tuple[int, int]) -> None:
        """Compile and open what is needed.

        Args:
            boat_set: the boats and their world.
            paths: by boat, times [s], places [m] and headings [rad], (n, 4), of the whole recording.
            size: of the largest picture: width, height [pixels].

        Raises:
            RenderError: nothing can draw here.
            StateError: the recording holds no world.
            RecordError: its rows are not of that world.
        """
        world = boat_set.world
        parameters = world.parameters
        self._model = drawing_model(world)
        check_columns(boat_set, self._model)
        self._data = mujoco.MjData(self._model)
        self._sea = SeaSkin(self._model, parameters.sea)
        self._displays = displays_of(parameters)
        self._wakes = [Wake(paths[boat], stern) for boat, stern in sterns(parameters) if boat in paths]
        self._foam_at = math.nan, (np.zeros((0, 3, 3)), np.zeros(0))
        width, height = size
        self._canvas = Canvas(
            self._model,
            width=width,
            height=height,
            fog=parameters.scene.fog,
            samples=SAMPLES,
            spare=64 + len(self._wakes) * math.ceil(TRIANGLES * LASTS * PIECES_PER_SECOND),
        )
        self.level = parameters.sea.level
        """Mean height of the water [m]."""

    def draw(self, moment: Instant, eye: Eye, size: tuple[int, int]) -> ByteArray:
        """The picture (height, width, 3) of what an eye sees at a moment."""
        width, height = size
        model, data = self._model, self._data
        data.qpos[:] = moment.qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        check_display_marks(self._displays, moment.marks[None])
        for geom, rgba in painted(model, self._displays, moment.marks, moment.time).items():
            model.geom_rgba[geom] = rgba
        view = view_of(eye, width, height)
        with announced(draw_surface, "the sea's pictures", 8):
            self._move_sea(view, moment.time)
        out = np.empty((height, width, 3), np.uint8)
        foam = self._foam(moment.time)
        self._canvas.draw(data, view, self._sea, out, lambda scene: add_triangles(scene, *foam))
        return out[::-1]

    def close(self) -> None:
        """Free the drawing context."""
        self._canvas.close()

    def _foam(self, time: float) -> tuple[FloatArray, FloatArray]:
        """The triangles of foam behind all hulls at a time [s]; the same for several pictures of it."""
        if self._foam_at[0] != time:
            wakes = self._wakes if self._sea.wet else ()
            found = [(np.zeros((0, 3, 3)), np.zeros(0)), *(wake.triangles(time, self._sea.height) for wake in wakes)]
            corners, shades = zip(*found, strict=True)
            self._foam_at = time, (np.concatenate(corners), np.concatenate(shades))
        return self._foam_at[1]

    def _move_sea(self, view: View, time: float) -> None:
        """The sea as it is seen; from above waves are shaded more, and do not glitter."""
        sun = np.array([0.0, 0.0, 1.0])
        if self._model.nlight:
            sun = np.asarray(-self._data.light_xdir[0], np.float64)
        above = view.rotation[2, 0] < -STEEP
        self._sea.move(view.position, RELIEF * sun if above else sun, *view.horizontal_range(), time)
        if above:
            mirrored, glitter = self._sea.palette.T
            np.clip(mirrored + LIGHTER, EDGE, 1.0 - EDGE, out=mirrored)
            glitter[:] = EDGE


def sterns(parameters: Parameters) -> Sequence[tuple[str, tuple[float, float]]]:
    """Boats and where their hulls leave foam, body axes [m]: at engines behind the middle."""
    found = ((parameters.boats[engine.hull].name, engine.position[:2]) for engine in parameters.thrusters)
    return list(dict.fromkeys((boat, place) for boat, place in found if place[0] < 0.0))


Triangles = tuple[FloatArray, FloatArray]
Height = Callable[[FloatArray, FloatArray, float], npt.ArrayLike]

LASTS = 14.0
"""How long foam is seen [s]."""
PIECES_PER_SECOND = 5.0
FULL_SPEED = 2.0
"""Speed from which foam is as white as it gets [m/s]."""
SLOWEST = 0.25
"""Speed below which a hull leaves no foam [m/s]."""
WHITE = 0.38
"""Opacity of fresh foam."""
FAINT = 0.01
"""Opacity below which foam is not drawn."""
WIDTH, SPREAD = 0.28, 0.09
"""Width of fresh foam [m], and by how much it grows [m/s]."""
OVER = 0.05
"""Height of foam over the water [m], so that the facets of the drawn sea do not hide it."""


class Wake:
    """The foam of one hull of a boat."""

    def __init__(self, path: FloatArray, stern: tuple[float, float]) -> None:
        """Follow a path (n, 4): time [s], east, north [m], heading [rad]; `stern` is the hull's end, body axes [m]."""
        self._time = path[:, 0]
        cos, sin = np.cos(path[:, 3]), np.sin(path[:, 3])
        x, y = stern
        self._place = path[:, 1:3] + np.column_stack([cos * x - sin * y, sin * x + cos * y])
        steps = np.hypot(*np.diff(self._place, axis=0).T) / np.maximum(np.diff(self._time), 1e-9)
        self._speed = np.concatenate([steps[:1], steps]) if len(steps) else np.zeros(len(path))

    def triangles(self, now: float, height: Height) -> Triangles:
        """The foam at a time [s] on a sea of a height: corners (m, 3, 3) [m] and opacities (m,)."""
        return triangles_of(*strip_of(self._time, self._place, self._speed, now, height))


def strip_of(
    time: FloatArray, place: FloatArray, speed: FloatArray, now: float, height: Height
) -> tuple[FloatArray, FloatArray]:
    """Edges (n, 2, 3) and opacities (n,) of foam left at times (m,) [s] at places (m, 2) [m] at speeds (m,) [m/s]."""
    first = max(time[0], now - LASTS)
    if len(time) < 2 or first >= min(now, time[-1]):
        return np.zeros((0, 2, 3)), np.zeros(0)
    # pieces keep their places on the water while the boat goes on: their times are whole steps of a clock
    left = np.arange(np.ceil(first * PIECES_PER_SECOND), np.floor(now * PIECES_PER_SECOND) + 1) / PIECES_PER_SECOND
    left = np.concatenate([[min(now, time[-1])], left[::-1]])
    spots = np.column_stack([np.interp(left, time, place[:, axis]) for axis in (0, 1)])
    fast = np.interp(left, time, speed)
    age = np.clip(now - left, 0.0, LASTS)
    along = np.gradient(spots, axis=0) if len(spots) > 1 else np.ones((1, 2))
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-6)
    half = 0.5 * (WIDTH + SPREAD * age)[:, None] * np.column_stack([-along[:, 1], along[:, 0]])
    edges = np.stack([spots + half, spots - half], axis=1)
    z = np.asarray(height(edges[..., 0], edges[..., 1], now)) + OVER
    opacity = WHITE * np.clip((fast - SLOWEST) / (FULL_SPEED - SLOWEST), 0.0, 1.0) * (1.0 - age / LASTS)
    return np.concatenate([edges, z[..., None]], axis=-1), opacity


def triangles_of(edges: FloatArray, opacity: FloatArray) -> Triangles:
    """Corners (m, 3, 3) and opacities (m,) of the triangles of a strip, two between two pieces."""
    shade = 0.5 * (opacity[1:] + opacity[:-1])
    near, far = edges[:-1], edges[1:]
    corners = np.stack(
        [np.stack([near[:, 0], near[:, 1], far[:, 0]], axis=1), np.stack([far[:, 1], far[:, 0], near[:, 1]], axis=1)]
    ).reshape(-1, 3, 3)
    shades = np.tile(shade, 2)
    seen = (shades > FAINT) & (np.linalg.norm(normals_of(corners), axis=1) > 1e-9)
    return corners[seen], shades[seen]


def normals_of(corners: FloatArray) -> FloatArray:
    """Normals of triangles (m, 3, 3), as long as twice their areas."""
    normals: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals


def add_triangles(scene: mujoco.MjvScene, corners: FloatArray, shades: FloatArray) -> None:
    """Add white triangles, while the scene has room.

    MuJoCo has their corners at the origin of their frames and on two of the axes, at the distances in their sizes.
    """
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], normals_of(corners)], axis=-1)
    lengths = np.linalg.norm(sides, axis=1, keepdims=True)
    axes, sizes = (sides / lengths).reshape(-1, 9), lengths[:, 0] * (1.0, 1.0, 0.0)
    colors = np.ones((len(corners), 4), np.float32)
    colors[:, 3] = shades
    for k in range(min(len(corners), scene.maxgeom - scene.ngeom)):
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_TRIANGLE, sizes[k], corners[k, 0], axes[k], colors[k])
        geom.emission, geom.specular = 0.8, 0.0
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        scene.ngeom += 1
