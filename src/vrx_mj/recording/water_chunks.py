"""The water of a recording, as rerun chunks: the sea, the wakes on it, and the tracks of the boats by speed."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import ByteArray, Float32Array, FloatArray, IntArray
from vrx_mj.recording import sea_meshes as sea
from vrx_mj.recording.record_scene import RecordedBody, SeaHeight
from vrx_mj.recording.sea_meshes import Grid, Lines, Swell
from vrx_mj.recording.timeline import Deadband, Ticker, chunk_at, numbers, static

TRAIL_RATE = 1.0
"""Pieces of a trail [Hz]."""
MAX_COLOR_SPEED = 3.0
"""Speed of the last colour of a trail [m/s]; the first is that of a boat at rest."""
_SPEED_COLORS = (203, 70, 121), (229, 108, 91), (248, 149, 64), (253, 197, 39), (240, 249, 33)
"""Colours of a trail, evenly spaced over the speed: the light part of the map plasma (Smith and van der Walt, 2015)."""
_SEA_FRAMES = 256
"""Pictures of the sea in one chunk: 4 MB."""
LEAD = 0.4
"""When a picture of the sea is right, in shares of its time: half-way from its first shown moment to its last."""
_RELAID = 8.0
"""Distance that a boat moves before the cells are laid again [m]."""
_ROW_SHIFT = 1e-3
"""Shift along x of each row of vertices from the one before [m]."""
SUNK = 1.0
"""Depth of the fleet's mesh under hulls, in standard deviations of the sea."""
_WAKE_RATE = 1.5
"""Rate of the points that a boat leaves [Hz]."""
WAKE_POINTS = 20
"""Number of points of a wake, the boat's place included."""
_WAKE_STEPS = np.tile([1.0 / 128.0, 1.0 / 128.0, sea.STEP], 2 * WAKE_POINTS)
"""Steps to which both sides of points are rounded [m]."""
WAKE_WIDTHS = (0.7, 1.3)
"""Width of a wake at the boat and behind it [m]."""
_MIN_WAY = 1.0
"""Distance between two points below which a wake is narrower [m]: a boat that hardly moves makes no foam."""
_FOAM = sea.packed_colors(sea.ramp([(214, 232, 240), (94, 134, 156), (36, 76, 99)], np.linspace(0.0, 1.0, WAKE_POINTS)))
"""Colours of a wake from the boat to its end, where it is nearly that of the sea."""
HEIGHTS = (0.04, 0.15)
"""Height of a wake over the drawn sea [m], and more in standard deviations of the sea: cells are flat."""


class HullWater(NamedTuple):
    """The drawn water at a boat."""

    lines: Lines
    """Lines of the patch at its hull."""
    heights: Deadband
    bright: Deadband
    wake: Deadband


class WaterChunks:
    """Turns places of boats into chunks; it knows where each trail ended, the wakes, and where cells were laid."""

    def __init__(self) -> None:
        self._trail, self._drop, self._sea = Ticker(TRAIL_RATE), Ticker(_WAKE_RATE), Ticker(sea.RATES[0])
        self._trail_end: dict[str, FloatArray] = {}
        self._wakes: dict[str, FloatArray] = {}
        self._left = 0
        self._hulls: dict[str, HullWater] = {}
        self._begun: set[str] = set()
        self._swell: Swell | None = None
        self._laid = np.zeros((0, 2))
        self._heights = self._bright = Deadband(0.0)
        self._mesh = ""

    @property
    def fast(self) -> bool:
        """Whether the sea moves so fast that it is shown at every row."""
        return self._swell is not None and self._swell.speed > sea.FAST_SURFACE

    def keep(self, boats: Sequence[RecordedBody], height: SeaHeight | None) -> None:
        """Go on with these boats, and forget all others; measure the sea, once. `height` None: it is not shown."""
        names = {boat.name for boat in boats}
        self._trail_end = {boat: end for boat, end in self._trail_end.items() if boat in names}
        self._wakes = {boat: wake for boat, wake in self._wakes.items() if boat in names}
        self._hulls = {boat: hull for boat, hull in self._hulls.items() if boat in names}
        if height is None:
            return
        if self._swell is None:
            self._swell = sea.swell_of(height)
            self._sea = Ticker(self._swell.rate)
        for boat in (boat for boat in boats if boat.name not in self._hulls):
            lines = sea.hull_lines(boat, self._swell.cell)
            held = sea.hull_water(lines), sea.shades(), Deadband(_WAKE_STEPS, keep=sea.KEEP)
            self._hulls[boat.name] = HullWater(lines, *held)

    def __call__(self, boats: Sequence[str], time: FloatArray, poses: FloatArray) -> Iterator[Chunk]:
        """Chunks of boats at times (n,) [s] with poses (n, boats, 7)."""
        if (taken := self._trail(time)).any():
            yield from self._trails(boats, time[taken], poses[taken])
        if self._swell is None:
            return
        for i, boat in enumerate(boats):
            yield from self._patch(boat, self._swell, time, poses[:, i])
        drops = self._drop(time)
        left, newest = self._leave(boats, poses[drops, :, :2], poses[0, :, :2]), np.cumsum(drops)
        frames = np.flatnonzero(self._sea(time))
        for part in (frames[i : i + _SEA_FRAMES] for i in range(0, len(frames), _SEA_FRAMES)):
            wakes = ribbons(poses[part, :, :2], left[newest[part, None] + np.arange(WAKE_POINTS)[::-1]])[:, :-1]
            yield from self._seas(boats, self._swell, time[part], poses[part], wakes, self._left + newest[part])
        self._left += int(newest[-1])

    def _trails(self, boats: Sequence[str], time: FloatArray, places: FloatArray) -> Iterator[Chunk]:
        """Pieces of the way at each time since the time before, in the colour of its speed."""
        for i, boat in enumerate(boats):
            here = np.column_stack([time, places[:, i, :2]])
            before = np.concatenate([self._trail_end.get(boat, here[:1]), here[:-1]])
            self._trail_end[boat] = here[-1:]
            strips = np.stack([before, here], axis=1)[..., [1, 2, 0]]
            strips[..., 2] = 0.0  # the mean water
            way = np.hypot(*(here - before)[:, 1:].T)
            speed = way / np.maximum(here[:, 0] - before[:, 0], 1e-9)
            colors = sea.packed_colors(speed_colors(speed))
            yield numbers(f"/world/trails/{boat}", time, rr.LineStrips3D, strips=strips, colors=colors)

    def _patch(self, boat: str, swell: Swell, time: FloatArray, pose: FloatArray) -> Iterator[Chunk]:
        """The water at a boat's hull, in its frame: for poses (n, 7), where it changes."""
        (x, y), path = self._hulls[boat].lines, _patch_path(boat)
        yield from self._begin(path, y, x, rr.CoordinateFrame(f"tf#/world/boats/{boat}"))
        taken, z = self._hulls[boat].heights(sea.patch_heights(swell, (x, y), time, pose, SUNK * swell.deviation))
        if taken.any():
            yield numbers(path, time[taken], rr.Mesh3D, vertex_positions=mesh_points(x, y, z[taken]))

    def _seas(
        self, boats: Sequence[str], swell: Swell, time: FloatArray, poses: FloatArray, wakes: FloatArray, left: IntArray
    ) -> Iterator[Chunk]:
        """The sea around boats with poses (n, boats, 7), as a mesh, wakes on it, and its colours for hulls' water.

        `wakes` are of boats that have left so many points each (n,).
        """
        hulls = [self._hulls[boat].lines for boat in boats]
        reach = np.array([np.hypot(*(np.abs(line).max() - sea.RIM for line in lines)) for lines in hulls])
        wet = [sea.patch_points(lines, poses[:, i]).reshape(3, len(time), -1) for i, lines in enumerate(hulls)]
        patches = np.moveaxis(np.concatenate(wet, axis=-1), 0, -1)
        ends = np.cumsum([part.shape[-1] for part in wet])
        drawn: dict[str, list[tuple[npt.NDArray[Any], ...]]] = defaultdict(list)
        for frames, grid in self._grids(poses[..., :2]):
            path = f"/world/sea/{len(grid.y)}x{len(grid.x)}"
            if path != self._mesh:
                for band in sea.bands(len(grid.y)):
                    yield from self._begin(f"{path}/{band.start}", grid.y[band], grid.x)
                if self._mesh:
                    yield chunk_at(time[frames][0], self._mesh, rr.Clear(recursive=True))
                self._mesh = path
            z = grid.heights(swell, time[frames] + LEAD / swell.rate)
            _, bright = self._bright(sea.light(z - swell.level, grid.toward(z)))
            sunk = np.where(grid.near(poses[frames, :, :2], reach), SUNK * swell.deviation, 0.0)
            _, z = self._heights(z - sunk)
            drawn[path].append((time[frames], mesh_points(grid.x, grid.y, z), sea.colors(bright, grid.haze)))
            height = grid.heights_at(z + sunk, wakes[frames]) + HEIGHTS[0] + HEIGHTS[1] * swell.deviation
            drawn["hulls"].append((height, grid.heights_at(bright, patches[frames])))
        height, bright = map(np.concatenate, zip(*drawn.pop("hulls"), strict=True))
        for path, parts in drawn.items():
            moment, points, tints = map(np.concatenate, zip(*parts, strict=True))
            for band in sea.bands(points.shape[1]):
                mesh = {"vertex_positions": points[:, band], "vertex_colors": tints[:, band]}
                yield numbers(f"{path}/{band.start}", moment, rr.Mesh3D, **mesh)
        foam = np.concatenate([wakes, height[..., None]], axis=-1)
        for i, (boat, own) in enumerate(zip(boats, np.split(bright, ends[:-1], axis=1), strict=True)):
            yield from self._wake(boat, time, foam[:, :, :, i], left)
            taken, seen = self._hulls[boat].bright(own)
            if taken.any():
                yield numbers(_patch_path(boat), time[taken], rr.Mesh3D, vertex_colors=sea.colors(seen[taken]))

    def _wake(self, boat: str, time: FloatArray, foam: FloatArray, left: IntArray) -> Iterator[Chunk]:
        """A wake through both sides (n, points, 2, 3) [m] of points: each is held in one place of a ring."""
        order = (left[:, None] + 1 - np.arange(WAKE_POINTS)) % WAKE_POINTS  # places of ages, and ages of places
        frame = np.arange(len(time))[:, None]
        taken, ring = self._hulls[boat].wake(foam[frame, order])
        if taken.any():
            yield numbers(wake_path(boat), time[taken], rr.Mesh3D, vertex_positions=ring[frame, order][taken])

    def _begin(self, path: str, y: FloatArray, x: FloatArray, *more: rr.AsComponents) -> Iterator[Chunk]:
        """Static part of an entity with a mesh: the triangles, without which a viewer drops the mesh."""
        if path not in self._begun:
            self._begun.add(path)
            yield static(path, rr.Mesh3D.from_fields(triangle_indices=sea.triangles(len(y), len(x))), *more)

    def _grids(self, places: FloatArray) -> Iterator[tuple[slice, Grid]]:
        """Spans of places (n, boats, 2) [m], each with its cells, which are laid anew when a boat has gone some way."""
        begin = 0
        while begin < len(places):
            if self._laid.shape != places[begin].shape or np.abs(places[begin] - self._laid).max() > _RELAID:
                self._laid, self._heights, self._bright = places[begin], Deadband(sea.STEP, keep=1.0), sea.shades()
            gone = np.abs(places[begin:] - self._laid).max(axis=(1, 2)) > _RELAID
            end = begin + int(np.argmax([*gone, True]))
            yield slice(begin, end), sea.grid_around(self._laid)
            begin = end

    def _leave(self, boats: Sequence[str], places: FloatArray, first: FloatArray) -> FloatArray:
        """Points (m + n, boats, 2) of wakes: the m that were left before, then places (n, boats, 2) [m] left now.

        A new boat has left all of the m at its `first` place.
        """
        before = [self._wakes.get(boat, np.tile(first[i], (WAKE_POINTS, 1))) for i, boat in enumerate(boats)]
        left = np.concatenate([np.stack(before, axis=1), places])
        self._wakes = {boat: left[-WAKE_POINTS:, i] for i, boat in enumerate(boats)}
        return left


def ribbons(places: FloatArray, left: FloatArray) -> FloatArray:
    """Both sides (n, points, 2, boats, 2) [m] of wakes from places (n, boats, 2) back along points (n, m, boats, 2).

    What lies across a point is across the way from the point left before it; those before the last are thus final.
    A boat that hardly moves has a narrow wake.
    """
    points = np.concatenate([places[:, None], left], axis=1)
    way = points - np.concatenate([left[:, 1:2], left[:, 1:], left[:, -1:], left[:, -1:]], axis=1)[:, : points.shape[1]]
    way[:, -1] = way[:, -2]
    across = way[..., ::-1] * (-0.5, 0.5) / np.maximum(np.hypot(way[..., 0], way[..., 1]), _MIN_WAY)[..., None]
    across[:, 0] *= WAKE_WIDTHS[0]
    across[:, 1:] *= WAKE_WIDTHS[1]
    return np.stack([points - across, points + across], axis=2)


def mesh_points(x: FloatArray, y: FloatArray, z: FloatArray) -> Float32Array:
    """Vertices (n, rows, columns, 3) of heights over lines along x and y [m].

    Lines along y lean by a hair: where no two vertices have the same x, LZ4 finds each in the frame before, and a
    recording's sea is half as large.
    """
    leaning = x + _ROW_SHIFT * np.arange(len(y))[:, None]
    return np.stack(np.broadcast_arrays(leaning, y[:, None], z), axis=-1).astype(np.float32)


def speed_colors(speed: FloatArray) -> ByteArray:
    """Colours (n, 3) of speeds (n,) [m/s], in sixteen steps."""
    share = np.round(15.0 * np.clip(speed / MAX_COLOR_SPEED, 0.0, 1.0)) / 15.0
    return sea.ramp(_SPEED_COLORS, share).astype(np.uint8)


def _patch_path(boat: str) -> str:
    """The entity of the water at a boat's hull."""
    return f"/world/sea/hulls/{boat}"


def wake_path(boat: str) -> str:
    """The entity of a boat's wake."""
    return f"/world/wakes/{boat}"


def wake_looks() -> rr.Mesh3D:
    """Triangles and colours of a wake, through both sides of its points from the boat on."""
    return rr.Mesh3D.from_fields(triangle_indices=sea.triangles(WAKE_POINTS, 2), vertex_colors=_FOAM.repeat(2))
