"""The drawn sea as meshes: one around the fleet, with small cells near boats, and a fine patch in each boat's frame.

The fleet's mesh is shown for a while and boats move on meanwhile; a patch is made for every shown pose. Under a patch
the fleet's mesh lies a little lower, so that the water at a hull is the patch's.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, ByteArray, FloatArray, Uint32Array
from vrx_mj.frames import in_world_axes
from vrx_mj.physics.kernel import kernel
from vrx_mj.recording.record_scene import RecordedBody, SeaHeight
from vrx_mj.recording.timeline import Deadband

STEP, KEEP = 1.0 / 64.0, 0.75
"""Step to which heights are rounded [m], and largest error of a shown height, in steps: equal heights take no space."""
_CELL, _CORE = 3.0, 7.0
"""Size of the smallest cells, and distance from a boat up to which they reach [m]."""
_GROWTH, _REACH = (0.6, 0.9), (40.0, 500.0)
"""Growth of a cell per metre from there on, up to distances [m]; beyond the last there is one cell to the horizon."""
_STRIDE, _MOST_STRIDES = 2.0, 4000
"""Steps in which cells are added up to lines [m], and their number at most: a run may diverge."""
MOST_LINES = 72
"""Largest number of lines of one axis."""
HORIZON = 2500.0
"""Distance of the outermost vertices [m]."""
CALM = (5.0, 13.0)
"""Size of cells from which waves fade, and of those that show none [m]."""


RATES = (2.0, 2.5, 4.0)
"""Rates of pictures of the sea [Hz], which divide that of the rows."""
_MIN_PHASES, _MAX_LAG = 8.0, 0.056
"""Least number of pictures in a period of the waves, and largest motion of the surface in half the time of one [m,
rms]."""
FAST_SURFACE = 0.07
"""Vertical speed of the surface from which every row is shown [m/s, rms]: three times it is 1 cm from row to row."""
_SAMPLES = 1000
"""Number of places at which motion and shape of a sea are sampled."""
_INSTANT, _SPAN = 0.05, 0.3
"""Time [s] and distance [m] over which speed, acceleration and curvature are taken."""
_BAND_ROWS = 10
"""Rows of cells in one entity: of so few vertices rerun's LZ4 finds each in the frame before."""
_HULL_CELL = 0.6
"""Least size of a patch's cells [m]; there are up to `_HULL_CELLS` of them along a side."""
_HULL_CELLS = 24
"""Largest number of cells along a side of a patch."""
_FLATNESS, CHORD = 0.006, 0.0025
"""Largest distance from the surface [m] of the planes of cells, and of heights between evaluated ones."""
STILL_ERROR = 0.0195
"""Largest distance of the shown heights of a patch from the surface for which the patch is kept [m]."""
_HULL_MARGIN, RIM = 0.25, 1.2
"""Water around a hull's bounding box, and around that a rim that goes down under the fleet's mesh [m]."""
_RIM_STEP = 1.0 / 16.0
"""Step to which heights of the rim are rounded [m]."""
_DEFAULT_HULL = np.array([[-2.5, -1.25], [2.5, 1.25]])
"""Corners of a hull without a mesh [m]."""
_LIGHT_DIRECTION = (0.55, 0.35)
"""Direction from which the light comes, east and north."""
DEEP, CREST, _HAZE = np.array([[5.0, 30.0, 52.0], [84.0, 146.0, 168.0], [150.0, 182.0, 204.0]])
"""Colours of deep water, of crests and of haze."""
CALM_LIGHT = 0.38
"""Light of a calm sea, dark enough for white names on a viewer's light plates."""
_SHADES, _HAZES = 32, 16
"""Numbers of shades and of hazes in the palette."""
_HAZE_SHARES = np.linspace(0.0, 1.0, _HAZES)[:, None, None]
"""Share of haze in each row of the palette."""


class Swell(NamedTuple):
    """The sea that is drawn; rms values once it has grown."""

    height: SeaHeight
    level: float
    """Mean height [m]."""
    deviation: float
    """Standard deviation of the surface [m]."""
    speed: float = 0.0
    """Its vertical speed [m/s]."""
    acceleration: float = 0.0
    """Its vertical acceleration [m/s^2]."""
    curvature: float = 0.0
    """Its curvature along x or y [1/m]."""

    @property
    def rate(self) -> float:
        """Pictures of it [Hz]."""
        frequency = self.speed / (2.0 * math.pi * max(self.deviation, 1e-9))
        wanted = max(_MIN_PHASES * frequency, self.speed / (2.0 * _MAX_LAG))
        return next((rate for rate in RATES if rate >= wanted), RATES[-1])

    @property
    def interval(self) -> float:
        """Time between heights [s] from which linear interpolation is off by `CHORD` where they change fast."""
        return math.sqrt(8.0 * CHORD / max(3.0 * self.acceleration, 1e-3))

    @property
    def cell(self) -> float:
        """Size of a patch's cells [m], whose planes are off by `_FLATNESS` where the surface is most curved."""
        return max(math.sqrt(8.0 * _FLATNESS / max(3.0 * self.curvature, 1e-3)), _HULL_CELL)


def swell_of(height: SeaHeight) -> Swell:
    """A sea, its level, and how it moves and bends, from heights all over it."""
    x, y, t = 1e3 * np.random.default_rng(0).random((3, 4 * _SAMPLES)) + np.array([[0.0], [0.0], [1e4]])
    sample = np.asarray(height(x, y, t))
    x, y, t, z = x[:_SAMPLES], y[:_SAMPLES], t[:_SAMPLES], sample[:_SAMPLES]
    (before, after), *sides = (
        (np.asarray(height(x - u, y - v, t - w)), np.asarray(height(x + u, y + v, t + w)))
        for u, v, w in ((0.0, 0.0, _INSTANT), (_SPAN, 0.0, 0.0), (0.0, _SPAN, 0.0))
    )
    curvature = max(_rms(low + high - 2.0 * z) for low, high in sides) / _SPAN**2
    speed, acceleration = _rms(after - before) / (2.0 * _INSTANT), _rms(after + before - 2.0 * z) / _INSTANT**2
    return Swell(height, float(sample.mean()), float(sample.std()), speed, acceleration, curvature)


def _rms(values: FloatArray) -> float:
    return math.sqrt(float(np.mean(values**2)))


class Grid(NamedTuple):
    """Lines of the fleet's mesh."""

    x: FloatArray
    """Coordinates (columns,) [m]."""
    y: FloatArray
    """Coordinates (rows,) [m]."""
    cells: tuple[FloatArray, FloatArray]
    """Sizes (columns,) and (rows,) of the cells around each line [m]."""
    haze: FloatArray
    """How much of the horizon's colour each vertex has, 0 to 1."""

    def heights(self, sea: Swell, time: FloatArray) -> FloatArray:
        """Heights (n, rows, columns) [m] at times (n,) [s]: waves as far as cells resolve them."""
        cells = np.maximum(self.cells[0], self.cells[1][:, None])
        shown = np.clip((CALM[1] - cells) / (CALM[1] - CALM[0]), 0.0, 1.0)
        row, column = np.nonzero(shown)
        z = np.full((len(time), *shown.shape), sea.level)
        waves = np.asarray(sea.height(self.x[column], self.y[row], time[:, None])) - sea.level
        z[:, row, column] += waves * shown[row, column]
        return z

    def toward(self, z: FloatArray) -> FloatArray:
        """Slopes toward the light of heights (n, rows, columns) [m]."""
        slopes = np.zeros_like(z)
        slopes[:, :, 1:-1] = (z[:, :, 2:] - z[:, :, :-2]) * (_LIGHT_DIRECTION[0] / (self.x[2:] - self.x[:-2]))
        slopes[:, 1:-1] += (z[:, 2:] - z[:, :-2]) * (_LIGHT_DIRECTION[1] / (self.y[2:] - self.y[:-2]))[:, None]
        return slopes

    def near(self, places: FloatArray, reach: FloatArray) -> BoolArray:
        """Which vertices (n, rows, columns) are within `reach` (boats,) [m] and a cell of places (n, boats, 2) [m]."""
        inside = [
            (np.abs(line - places[..., axis, None]) < reach[:, None] + cells).astype(np.float32)
            for axis, (line, cells) in enumerate(zip((self.x, self.y), self.cells, strict=True))
        ]
        return np.swapaxes(inside[1], 1, 2) @ inside[0] > 0.0

    def heights_at(self, z: FloatArray, points: FloatArray) -> FloatArray:
        """Heights (n, ...) of the mesh at points (n, ..., 2 or 3) [m], by those of its vertices (n, rows, columns)."""
        sampled = np.empty(points.shape[:-1])
        each = np.ascontiguousarray(points).reshape(len(z), -1, points.shape[-1])
        _sample(self.x, self.y, z, each, sampled.reshape(len(z), -1))
        return sampled


@kernel
def _sample(x: FloatArray, y: FloatArray, z: FloatArray, points: FloatArray, sampled: FloatArray) -> None:
    """Write the heights of triangles with corners (n, rows, columns) at points (n, m, 2 or 3) into `sampled` (n, m)."""
    for i in range(points.shape[0]):
        column, row = 0, 0
        for j in range(points.shape[1]):
            east, north = points[i, j, 0], points[i, j, 1]
            column, row = _cell(x, east, column), _cell(y, north, row)
            u = (east - x[column]) / (x[column + 1] - x[column])
            v = (north - y[row]) / (y[row + 1] - y[row])
            first, last = z[i, row, column], z[i, row + 1, column + 1]
            other = z[i, row, column + 1] if u > v else z[i, row + 1, column]
            sampled[i, j] = first + (other - first) * max(u, v) + (last - other) * min(u, v)


@kernel
def _cell(line: FloatArray, at: float, near: int) -> int:
    """Return the cell of a line in which a coordinate is, by the one of a coordinate that is `near`."""
    cell = near
    while cell > 0 and line[cell] >= at:
        cell -= 1
    while cell < line.size - 2 and line[cell + 1] < at:
        cell += 1
    return cell


def grid_around(places: FloatArray) -> Grid:
    """The grid for boats at places (n, 2) [m]."""
    x, y = _lines(places[:, 0]), _lines(places[:, 1])
    low, high = places.min(axis=0), places.max(axis=0)
    east, north = (np.maximum(np.maximum(low[i] - line, line - high[i]), 0.0) for i, line in enumerate((x, y)))
    return Grid(x, y, (np.gradient(x), np.gradient(y)), 1.0 - np.exp(-np.hypot(north[:, None], east) / 600.0))


def _lines(places: FloatArray) -> FloatArray:
    """Lines along one axis: even near boats, wider and wider away from them; a multiple of eight of them."""
    low, high = places.min() - _REACH[1], places.max() + _REACH[1]
    way, stride = np.linspace(low, high, min(math.ceil((high - low) / _STRIDE), _MOST_STRIDES), retstep=True)
    away = np.maximum(np.abs(way - places[:, None]).min(axis=0) - _CORE, 0.0)
    density = stride / (_CELL + _GROWTH[0] * away + _GROWTH[1] * np.maximum(away - _REACH[0], 0.0))
    index = np.cumsum(density) - density[0]
    count = min(8 * math.ceil((index[-1] + 3.0) / 8.0), MOST_LINES)
    inner = np.interp(np.linspace(0.0, index[-1], count - 2), index, way)
    return np.concatenate([[way[0] - HORIZON], inner, [way[-1] + HORIZON]])


def bands(rows: int) -> list[slice]:
    """The rows of a grid by bands, of which each begins with the last row of the one before."""
    return [slice(first, first + _BAND_ROWS + 1) for first in range(0, rows - 1, _BAND_ROWS)]


def triangles(rows: int, columns: int) -> Uint32Array:
    """Triangles (2 (rows - 1) (columns - 1), 3) of a grid, counter-clockwise from above."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    first = corner + np.array([0, 1, columns + 1])
    second = corner + np.array([0, columns + 1, columns])
    return np.concatenate([first, second]).astype(np.uint32)


Lines = tuple[FloatArray, FloatArray]
"""Lines of a patch along x and y of its boat's frame [m]."""


def hull_lines(boat: RecordedBody, cell: float) -> Lines:
    """Lines of a boat's patch along x and y of its frame [m]: around its looks, `cell` apart at most."""
    vertices = np.concatenate([part.vertices[:, :2] for part in boat.surfaces] or [_DEFAULT_HULL])
    low, high = vertices.min(axis=0) - _HULL_MARGIN, vertices.max(axis=0) + _HULL_MARGIN
    count = np.minimum(np.ceil((high - low) / cell), _HULL_CELLS).astype(int) + 1
    x, y = (np.concatenate([[low[i] - RIM], np.linspace(low[i], high[i], count[i]), [high[i] + RIM]]) for i in range(2))
    return x, y


def hull_water(lines: Lines) -> Deadband:
    """Heights of a patch as they are shown: those of its rim, which lies lower, are rounded more."""
    low = np.pad(np.zeros((len(lines[1]) - 2, len(lines[0]) - 2), np.bool_), 1, constant_values=True).ravel()
    return Deadband(np.where(low, _RIM_STEP, STEP), keep=KEEP, within=np.where(low, 2.0 * _RIM_STEP, STILL_ERROR))


def patch_heights(sea: Swell, lines: Lines, time: FloatArray, pose: FloatArray, drop: float) -> FloatArray:
    """Heights (n, rows, columns) of a patch at times (n,) [s] with poses (n, 7), its rim lower by more than `drop` [m].

    At some times the surface is met along the vertical from the frame's plane, between them on straight lines; how far
    the vertical leans in the frame is made good with the slope. A boat upside down has no patch.
    """
    last = len(time) - 1
    some = np.unique([*np.searchsorted(time, np.arange(time[0], time[last], sea.interval)), last])
    points = patch_points(lines, pose[some])
    met = np.asarray(sea.height(points[0], points[1], time[some, None, None]))
    after = np.searchsorted(some, np.arange(last + 1))
    before = np.maximum(after - 1, 0)
    share = ((np.arange(last + 1) - some[before]) / np.maximum(some[after] - some[before], 1))[:, None, None]
    ahead, aside, upright = _axes(pose)[..., 2].T[..., None, None]
    over = met[before] * (1.0 - share) + met[after] * share
    over -= pose[:, 2, None, None] + ahead * lines[0] + aside * lines[1][:, None]
    across, along = np.gradient(over, *lines[::-1], axis=(1, 2))
    z = over * upright * (1.0 - along * ahead - across * aside)
    z[:, [0, -1]] -= 1.5 * drop
    z[:, 1:-1, [0, -1]] -= 1.5 * drop
    shown: FloatArray = np.where(upright > 0.3, z, -1e4 * np.sign(upright))
    return shown


def patch_points(lines: Lines, pose: FloatArray) -> FloatArray:
    """Coordinates (3, n, rows, columns) [m] of a patch's vertices, were all in the frame's plane."""
    place, bow, port = (each.T[..., None, None] for each in (pose[:, :3], *np.moveaxis(_axes(pose)[:, :2], 1, 0)))
    points: FloatArray = place + bow * lines[0] + port * lines[1][:, None]
    return points


def _axes(pose: FloatArray) -> FloatArray:
    """The three axes (n, 3, 3) of frames with poses (n, 7)."""
    return in_world_axes(pose[:, None, 3:], np.broadcast_to(np.eye(3), (len(pose), 3, 3)))


def light(z: FloatArray, toward: FloatArray) -> FloatArray:
    """Light, 0 to 1, of heights over the mean [m] with slopes toward the sun: crests and what faces it are bright.

    tanh: a calm sea shows, a steep one is not cut off.
    """
    return np.clip(CALM_LIGHT - 0.36 * np.tanh(12.0 * toward) + 0.4 * z, 0.0, 1.0)


def colors(bright: FloatArray, haze: FloatArray | float = 0.0) -> Uint32Array:
    """Colours 0xRRGGBBAA of light, from deep water to crest, with a share of the horizon's colour."""
    far = np.round(np.asarray(haze) * (_HAZES - 1)).astype(np.intp)
    return _PALETTE[far, np.round(bright * (_SHADES - 1)).astype(np.uint8)]


def shades() -> Deadband:
    """Light as it is shown, in whole shades."""
    return Deadband(1.0 / (_SHADES - 1), keep=1.0)


def packed_colors(rgb: FloatArray | ByteArray) -> Uint32Array:
    """Colours 0xRRGGBBAA of red, green and blue (..., 3), 0 to 255."""
    red, green, blue = np.moveaxis(np.round(rgb).astype(np.uint32), -1, 0)
    colors: Uint32Array = (red << 24) | (green << 16) | (blue << 8) | np.uint32(255)
    return colors


def ramp(colors: npt.ArrayLike, share: FloatArray) -> FloatArray:
    """Red, green and blue (n, 3) at shares (n,), 0 to 1, of a scale of evenly spaced colours (k, 3)."""
    parts = np.asarray(colors, np.float64).T
    place = np.linspace(0.0, 1.0, parts.shape[1])
    return np.column_stack([np.interp(share, place, part) for part in parts])


_PALETTE = packed_colors(
    (DEEP + (CREST - DEEP) * np.linspace(0.0, 1.0, _SHADES)[:, None]) * (1.0 - _HAZE_SHARES) + _HAZE * _HAZE_SHARES
)
"""Colours of each haze and shade."""
