"""The sea's skin in a drawing model: moved to where the eye looks, with the heights that the physics uses."""

import math

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.model.water import Sea
from vrx_mj.physics import tables
from vrx_mj.physics.surface import draw_surface, fan, ripples
from vrx_mj.physics.waves import random_phases, surface_heights

__all__ = ["SeaSkin", "Skin", "sea_table", "wave_table"]


def wave_table(sea: Sea, seed: int) -> tables.Table:
    """Waves of a world's sea in the run of a seed, `tables.WAVE`."""
    phases = random_phases(seed, len(sea.waves)) if sea.random else np.zeros(len(sea.waves))
    rows = [{**vars(wave), "phase": float(phase)} for wave, phase in zip(sea.waves, phases, strict=True)]
    for row in rows:
        if row["orbital"] is None:
            row["orbital"] = sea.gravity * row["wavenumber"] * row["amplitude"] / row["frequency"]
    return tables.table(tables.WAVE, rows)


def sea_table(sea: Sea) -> tables.Table:
    """A world's sea as `tables.SEA`, one row."""
    row = {**vars(sea), "depth": math.inf if sea.depth is None else sea.depth}
    return tables.table(tables.SEA, [{name: row[name] for name in tables.SEA.names or ()}])


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
        self._distances, self._spokes = fan()
        super().__init__(int(model.skin_vertnum[0]) if self.wet else 0)

    def set_waves(self, waves: tables.Table) -> None:
        """Have these waves, `tables.WAVE`, instead of the world's from now on."""
        if waves.tobytes() != self._waves.tobytes():
            self._waves, self._shading = waves.copy(), ripples(waves)

    def height(self, x: FloatArray, y: FloatArray, time: float) -> FloatArray:
        """Heights [m] of the surface at x, y [m, ENU, equal shapes] and simulated time [s], as the physics has them."""
        east, north = (np.ascontiguousarray(values, np.float64).reshape(-1) for values in (x, y))
        out = np.empty(east.shape)
        surface_heights(self._waves, self._sea[0], east, north, np.full(east.shape, float(time)), out)
        return out.reshape(np.shape(x))

    def move(self, eye: FloatArray, sun: FloatArray, course: float, half: float, time: float) -> None:
        """Compute the surface at `time` [s] around `eye` (3,) [m], seen `half` [rad] to both sides of `course` [rad].

        `course` is counter-clockwise from x; `half` = pi: all around. `sun` (3,) is a unit vector to the sun.
        """
        if self.wet:
            draw_surface(
                self._waves,
                self._shading,
                self._sea[0],
                float(time),
                np.asarray(eye, np.float64),
                np.asarray(sun, np.float64),
                float(course),
                float(half),
                self._distances,
                self._spokes,
                self.vertices,
                self.normals,
                self.palette,
            )
