"""The sea as a recording draws it: a patch of 32 x 32 vertices that follows the fleet.

A mesh without normals is drawn unlit, so its shading is baked into the colours of its vertices. The outermost
ring of vertices lies far out at the mean level, which closes the horizon with the same mesh.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.recording.scene import SeaHeight

__all__ = ["SIDE", "sea_patch", "sea_triangles"]

SIDE = 32
"""Vertices along one side."""
MARGIN = 22.0
"""Sea around the outermost boat [m]."""
CELLS = (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)
"""Sizes of a cell [m] to choose from, so that vertices keep their places while the fleet moves."""
HORIZON = 2500.0
"""Distance of the outermost ring [m]."""
STEP = 1.0 / 64.0
"""Heights are rounded to this [m]: they compress twice as well, and nobody sees it."""
SUN = (0.55, 0.35)
"""Where the light comes from, east and north."""
DEEP, CREST = np.array([9.0, 48.0, 79.0]), np.array([112.0, 178.0, 196.0])


def sea_patch(
    height: SeaHeight, boats: FloatArray, time: float
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Positions (1024, 3) [m] and colours (1024,) of the patch around `boats` (n, 2) [m] at `time` [s]."""
    east, north, cell = _grid(boats)
    x, y = np.meshgrid(east, north)
    z = np.zeros((SIDE, SIDE))
    inner = (slice(1, -1), slice(1, -1))
    z[inner] = np.reshape(height(x[inner], y[inner], time), (SIDE - 2, SIDE - 2))
    z = np.round(z / STEP) * STEP
    positions = np.stack([x, y, z], axis=-1).astype(np.float32).reshape(-1, 3)
    return positions, _palette()[_shade(z, cell)].reshape(-1)


def _grid(boats: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """East and north coordinates of the grid lines [m], and the size of a cell [m]."""
    low, high = boats.min(axis=0), boats.max(axis=0)
    needed = (float((high - low).max()) + 2 * MARGIN) / (SIDE - 3)
    cell = next((size for size in CELLS if size >= needed), CELLS[-1])
    centre = np.round((low + high) / 2 / cell) * cell
    line = (np.arange(SIDE) - (SIDE - 1) / 2) * cell
    line[0], line[-1] = -HORIZON, HORIZON
    return line + centre[0], line + centre[1], cell


def _shade(z: FloatArray, cell: float) -> ByteArray:
    """Shades 0 to 31: slopes toward the sun and crests are light, slopes away from it and troughs dark."""
    toward_north, toward_east = np.gradient(z, cell)
    tilt = SUN[0] * toward_east + SUN[1] * toward_north
    light = 0.38 - 0.36 * np.tanh(12.0 * tilt) + 0.4 * z  # tanh: a calm sea shows, a steep one is not cut off
    light[[0, -1], :] = light[:, [0, -1]] = 0.38
    shades: ByteArray = (np.clip(light, 0.0, 1.0) * 31.0).astype(np.uint8)
    return shades


def _palette() -> npt.NDArray[np.uint32]:
    """Colours (32,) from deep water to crest, 0xRRGGBBAA."""
    share = np.linspace(0.0, 1.0, 32)[:, None]
    red, green, blue = np.round(DEEP + (CREST - DEEP) * share).astype(np.uint32).T
    colors: npt.NDArray[np.uint32] = (red << 24) | (green << 16) | (blue << 8) | np.uint32(255)
    return colors


def sea_triangles() -> npt.NDArray[np.uint32]:
    """Triangles (2 * 31 * 31, 3) of the patch."""
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1, 1)
    first = corner + np.array([0, 1, SIDE + 1])
    second = corner + np.array([0, SIDE + 1, SIDE])
    return np.concatenate([first, second]).astype(np.uint32)
