"""The sea's skin in a drawing model: moved to where the eye looks, with the heights that the physics uses."""

import math

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.model.tables import SEA, WAVE, table_of
from vrx_mj.model.water import Sea
from vrx_mj.physics.surface import RINGS, SPOKES, draw_surface, ring_distances, ripples, spokes
from vrx_mj.physics.tables import Table
from vrx_mj.physics.waves import random_heights, random_phases, surface_heights
from vrx_mj.sensors.view import View

_HIDDEN_GROUP = 3
"""First group of geoms that pictures do not show."""
_SHORT, _LONG = 0.2, 15.0
"""Half lengths of geoms that foam surrounds [m]."""
_FOAM_RANGE, _MAX_BOXES = 40.0, 256
"""Distance up to which foam is drawn [m], and around how many boxes."""
_FOAM_SLOPE = 0.01
"""Slope of all waves together below which nothing foams."""
_BOX_LENGTH = 0.5
"""Length of waterline per box [m]."""
_NO_BOXES = np.zeros((0, 7))
"""Boxes of a sea without foam."""


def wave_table(sea: Sea, seed: int | None = None) -> Table:
    """Waves of a world's sea in the run of a seed, `tables.WAVE`; without one phases are 0 and no energy is drawn."""
    orbital = [
        sea.gravity * wave.wavenumber * wave.amplitude / wave.frequency if wave.orbital is None else wave.orbital
        for wave in sea.waves
    ]
    waves = table_of(WAVE, sea.waves, phase=np.zeros(len(sea.waves)), orbital=orbital)
    if sea.random and seed is not None:
        heights = random_heights(seed, waves["energy_shape"])
        waves["phase"] = random_phases(seed, len(waves))
        waves["amplitude"] *= heights
        waves["orbital"] *= heights
    return waves


def sea_table(sea: Sea) -> Table:
    """A world's sea as `tables.SEA`, one row."""
    return table_of(SEA, [sea], depth=[math.inf if sea.depth is None else sea.depth])


def _mesh_edges(model: mujoco.MjModel, mesh: int) -> tuple[FloatArray, IntArray]:
    """Points (n, 3) [m] of a mesh, and numbers (m, 2) of those that its edges join."""
    vertex, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    corners = model.mesh_face[face : face + model.mesh_facenum[mesh]]
    edges = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
    ends = np.unique(edges @ (1 << 32, 1))
    points = model.mesh_vert[vertex : vertex + model.mesh_vertnum[mesh]].astype(np.float64)
    return points, np.column_stack([ends >> 32, ends & 0xFFFFFFFF])


class Skin:
    """Points of a skin of a drawing model, which a canvas moves before it draws."""

    def __init__(self, number: int) -> None:
        """Make room for a number of points."""
        self.vertices = np.zeros((number, 3), np.float32)
        """Places [m], world."""
        self.normals = np.zeros((number, 3), np.float32)
        self.palette = np.zeros((number, 2), np.float32)
        """Texture coordinates."""


class SeaSkin(Skin):
    """Vertices of the sea for one model, whose first skin it is; nothing happens in a world without water.

    A scene takes `vertices` and `normals` after `mjv_updateScene`. Where a viewer updates the scene itself,
    `vertices` may be written into `model.skin_vert`: the skin's only bone is the world.
    """

    def __init__(self, model: mujoco.MjModel, sea: Sea, seed: int = 0) -> None:
        """Take a drawing model, its sea, and the seed of the run whose waves are drawn."""
        self.wet = model.nskin > 0
        self._waves = wave_table(sea, seed)
        self._shading = ripples(self._waves)
        self._sea = sea_table(sea)
        count = int(model.skin_face[0, 1]) if self.wet else SPOKES  # as `fan_triangles` has them
        self._spokes, self._sums = spokes(count), np.zeros((8, count))
        self._rings = 1 + int(model.skin_facenum[0]) // (2 * (count - 1)) if self.wet else 0
        half = model.geom_aabb[:, 3:].max(axis=1)
        afloat = (model.geom_bodyid > 0) & (model.geom_group < _HIDDEN_GROUP) & (half > _SHORT) & (half < _LONG)
        self._geoms, self._boxes = np.flatnonzero(afloat), model.geom_aabb[afloat]
        self._meshes = np.where(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH, model.geom_dataid, -1)[afloat]
        self._outlines = {mesh: _mesh_edges(model, mesh) for mesh in np.unique(self._meshes[self._meshes >= 0])}
        super().__init__(int(model.skin_vertnum[0]) if self.wet else 0)

    def set_waves(self, waves: Table) -> None:
        """Replace the world's waves by these, `tables.WAVE`, from now on."""
        if waves.tobytes() != self._waves.tobytes():
            self._waves, self._shading = waves.copy(), ripples(waves)

    def height(self, x: FloatArray, y: FloatArray, time: float) -> FloatArray:
        """Heights [m] of the surface at x, y [m, ENU, equal shapes] and simulated time [s], as the physics has them."""
        east, north = (np.ascontiguousarray(values, np.float64).reshape(-1) for values in (x, y))
        out = np.empty(east.shape)
        surface_heights(self._waves, self._sea[0], east, north, np.full(east.shape, float(time)), out)
        return out.reshape(np.shape(x))

    def drawn_height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Heights [m] of the facets that `move` made last, at x, y [m, equal shapes]; beside them, of their rim."""
        east, north = x - self._eye[0], y - self._eye[1]
        angle = (np.arctan2(north, east) - self._course + math.pi) % (2.0 * math.pi) - math.pi
        outward = np.interp(np.hypot(east, north), self._distances, np.arange(self._rings))
        count = len(self._spokes)
        across = (angle / self._half + 1.0) * 0.5 * (count - 1)
        ring, spoke = np.clip(outward, 0.0, self._rings - 1.001), np.clip(across, 0.0, count - 1.001)
        i, j = ring.astype(int), spoke.astype(int)
        u, v = ring - i, spoke - j
        z = self.vertices[: self._rings * count, 2].reshape(-1, count)
        first, last, other = z[i, j], z[i + 1, j + 1], np.where(u > v, z[i + 1, j], z[i, j + 1])
        return np.asarray(first + (other - first) * np.maximum(u, v) + (last - other) * np.minimum(u, v), np.float64)

    def floats(self, data: mujoco.MjData, eye: FloatArray, time: float) -> FloatArray:
        """Boxes for `draw_surface` of what stands in water near an eye (3,) [m] at `time` [s]; foam grows with waves.

        Meshes count by boxes along their waterline, other geoms by one, whose axis nearest to upright is left out.
        """
        slope = math.sqrt(0.5 * float(np.sum((self._waves["amplitude"] * self._waves["wavenumber"]) ** 2)))
        if slope < _FOAM_SLOPE:
            return _NO_BOXES
        axes = data.geom_xmat[self._geoms].reshape(-1, 3, 3)
        centres = data.geom_xpos[self._geoms] + (axes @ self._boxes[:, :3, None])[..., 0]
        near = np.flatnonzero(np.hypot(*(centres - eye)[:, :2].T) < _FOAM_RANGE)
        over = centres[near, 2] - self.height(centres[near, 0], centres[near, 1], time)
        wet = near[np.abs(over) < (np.abs(axes[near, 2]) * self._boxes[near, 3:]).sum(axis=1)]
        found = [self._waterline(data, number, time) for number in wet[self._meshes[wet] >= 0].tolist()]
        wet = wet[self._meshes[wet] < 0]
        row, upright, half = np.arange(len(wet)), np.abs(axes[wet, 2]).argmax(axis=1), self._boxes[wet, 3:]
        one, other = (upright + 1) % 3, (upright + 2) % 3
        edge = axes[wet, :2, one]
        edge = edge / np.maximum(np.linalg.norm(edge, axis=1, keepdims=True), 1e-6)
        boxes = np.concatenate([*found, np.column_stack([centres[wet, :2], edge, half[row, one], half[row, other]])])
        return np.column_stack([boxes, np.full(len(boxes), 0.7 * math.tanh(10.0 * slope))])[:_MAX_BOXES]

    def _waterline(self, data: mujoco.MjData, number: int, time: float) -> FloatArray:
        """Boxes (n, 6) along a mesh's waterline: east, north, direction of an edge (2,), and half lengths [m]."""
        geom, middle, half = self._geoms[number], self._boxes[number, :3], self._boxes[number, 3:]
        place, axes = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
        upright = int(np.abs(axes[2]).argmax())
        level = [(upright + 1) % 3, (upright + 2) % 3]
        spots = place + axes @ middle + axes[:, level].T * half[level, None] * [[[1.0]], [[-1.0]]]
        water = self.height(spots[..., 0], spots[..., 1], time)
        points, edges = self._outlines[self._meshes[number]]
        over = points @ axes[2] + place[2] - water.mean()
        over = (over - (points - middle)[:, level] @ ((water[0] - water[1]) / (2.0 * half[level])))[edges]
        cut = over[:, 0] * over[:, 1] < 0.0
        (first, last), share = np.swapaxes(points[edges[cut]][..., level], 0, 1), over[cut, :1]
        line = first + share / (share - over[cut, 1:]) * (last - first)
        _, cell = np.unique(np.floor(line / _BOX_LENGTH) @ (1.0, 1e4), return_inverse=True)
        low, high = np.full((2, int(cell.max(initial=-1)) + 1, 2), math.inf) * [[[1.0]], [[-1.0]]]
        np.minimum.at(low, cell, line)
        np.maximum.at(high, cell, line)
        centres = place[:2] + 0.5 * (low + high) @ axes[:2, level].T + middle[upright] * axes[:2, upright]
        edge = axes[:2, level[0]] / max(math.hypot(*axes[:2, level[0]]), 1e-6)
        return np.column_stack([centres, np.broadcast_to(edge, centres.shape), 0.5 * (high - low)])

    def move_into(self, view: View, data: mujoco.MjData, time: float, *, relief: float = 1.0) -> None:
        """Compute what a view sees of the surface at `time` [s], in the light of the first lamp or else from above.

        `data` are as `mj_camlight` leaves them; `relief` is how much more the slopes of waves shade the sea.
        """
        sun = -data.light_xdir[0] if len(data.light_xdir) else np.array([0.0, 0.0, 1.0])
        floats = self.floats(data, view.position, time)
        self.move(view.position, relief * sun, *view.horizontal_range(), time, view.elevations(), floats)

    def move(
        self,
        eye: FloatArray,
        sun: FloatArray,
        course: float,
        half: float,
        time: float,
        elevations: tuple[float, float] = (-0.5 * math.pi, 0.0),
        floats: FloatArray = _NO_BOXES,
    ) -> None:
        """Compute the surface at `time` [s] around `eye` (3,) [m], seen `half` [rad] to both sides of `course` [rad].

        `course` is counter-clockwise from x; `half` = pi: all around. `sun` (3,) is a unit vector to the sun.
        `elevations` are the lowest and the highest direction that is seen [rad], `floats` what foam surrounds.
        """
        if self.wet:
            self._sums[:2] = np.cos(course + half * self._spokes), np.sin(course + half * self._spokes)
            sea, deviation = self._sea[0], math.sqrt(0.5 * float(np.sum(self._waves["amplitude"] ** 2)))
            self._eye, self._course, self._half = np.asarray(eye, np.float64), course, float(half)
            self._distances = ring_distances(float(eye[2] - sea["level"]), deviation, *elevations, self._rings)
            draw_surface(
                self._waves,
                self._shading,
                sea,
                float(time),
                self._eye,
                np.asarray(sun, np.float64),
                self._half,
                self._distances,
                self._rings / RINGS,
                floats,
                self._sums,
                self.vertices,
                self.normals,
                self.palette,
            )
