"""The water of a recording, as rerun chunks: the sea around the boats, their wakes, and their trails over it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.recording.record_scene import SeaHeight
from vrx_mj.recording.timeline import Ticker, times

__all__ = [
    "FADES",
    "SIDE",
    "TRAIL_HEIGHT",
    "WAKE_RATE",
    "Wake",
    "WaterChunks",
    "sea_patch",
    "sea_triangles",
    "wake_path",
]

TRAIL_RATE = 5.0
"""Pieces of a trail [Hz]."""
TRAIL_HEIGHT = 0.6
"""Height of a trail over the mean water [m], so that few waves hide it."""
SEA_RATE = 5.0
"""Pictures of the sea [Hz]."""
SEA_FRAMES = 64
"""Pictures of the sea in one chunk: 1 MB."""


class WaterChunks:
    """Turns places of boats into chunks; it knows where each trail ended, and the wakes."""

    def __init__(self) -> None:
        self._trail, self._sea, self._wake = Ticker(TRAIL_RATE), Ticker(SEA_RATE), Ticker(WAKE_RATE)
        self._trail_end: dict[str, FloatArray] = {}
        self._wakes: dict[str, Wake] = {}

    def keep(self, boats: Collection[str]) -> None:
        """Forget the trails and wakes of all other boats."""
        self._trail_end = {boat: end for boat, end in self._trail_end.items() if boat in boats}
        self._wakes = {boat: wake for boat, wake in self._wakes.items() if boat in boats}

    def __call__(
        self, boats: Sequence[str], time: FloatArray, places: FloatArray, height: SeaHeight | None
    ) -> Iterator[Chunk]:
        """Chunks of boats at times (n,) [s] and places (n, boats, 3) [m]; `height` None: the sea is not shown."""
        if (taken := self._trail(time)).any():
            yield from self._trails(boats, time[taken], places[taken])
        if height is None:
            return
        if (taken := self._sea(time)).any():
            yield from self._seas(time[taken], places[taken], height)
        if (taken := self._wake(time)).any():
            yield from self._foam(boats, time[taken], places[taken], height)

    def _trails(self, boats: Sequence[str], time: FloatArray, places: FloatArray) -> Iterator[Chunk]:
        """At each time the piece of the way since the time before."""
        here = places * (1.0, 1.0, 0.0) + (0.0, 0.0, TRAIL_HEIGHT)
        for i, boat in enumerate(boats):
            last = self._trail_end.get(boat, here[0, i])
            self._trail_end[boat] = here[-1, i]
            before = np.concatenate([last[None], here[:-1, i]])
            strips = np.stack([before, here[:, i]], axis=1).astype(np.float32)
            yield Chunk.from_columns(f"/world/trails/{boat}", [times(time)], rr.LineStrips3D.columns(strips=strips))

    def _seas(self, time: FloatArray, places: FloatArray, height: SeaHeight) -> Iterator[Chunk]:
        """The sea around the boats, as a mesh."""
        for start in range(0, len(time), SEA_FRAMES):
            part = time[start : start + SEA_FRAMES]
            patches = [sea_patch(height, places[start + k, :, :2], float(t)) for k, t in enumerate(part)]
            columns = rr.Mesh3D.columns(
                vertex_positions=np.concatenate([positions for positions, _ in patches]),
                vertex_colors=np.concatenate([colors for _, colors in patches]),
            )
            yield Chunk.from_columns("/world/sea", [times(part)], columns.partition([SIDE * SIDE] * len(part)))

    def _foam(self, boats: Sequence[str], time: FloatArray, places: FloatArray, height: SeaHeight) -> Iterator[Chunk]:
        """The wake of every boat."""
        for i, boat in enumerate(boats):
            wake = self._wakes.setdefault(boat, Wake())
            strips = [wake.strips(float(t), place[:2], height) for t, place in zip(time, places[:, i], strict=True)]
            columns = rr.LineStrips3D.columns(strips=[strip for several in strips for strip in several])
            yield Chunk.from_columns(wake_path(boat), [times(time)], columns.partition([len(FADES)] * len(time)))


def wake_path(boat: str) -> str:
    """The entity of a boat's wake."""
    return f"/world/wakes/{boat}"


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
"""Direction from which the light comes, east and north."""
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


WAKE_RATE = 2.0
"""Wakes drawn, and points that a boat leaves, per second [Hz]."""
LASTS = 20.0
"""How long a point is seen [s]."""
FADES = ((214, 232, 240), (150, 186, 204), (98, 142, 168), (60, 104, 134))
"""Colours of a wake from the boat to its end, each over as long a time: the last is nearly that of the sea."""
OVER = 0.06
"""Height over the water [m], so that the facets of the sea's mesh hide no piece."""


class Wake:
    """The wake of a boat."""

    def __init__(self) -> None:
        self._left = np.zeros((0, 3))

    def strips(self, time: float, place: FloatArray, height: SeaHeight) -> list[npt.NDArray[np.float32]]:
        """Leave a point at `time` [s] at a place (2,) [m]; the wake then, a strip (n, 3) [m] for each colour.

        Every point lies on the sea as it is at `time`. The first is the newest; strips begin where the one before ends.
        """
        self._left = np.concatenate([[(time, *place)], self._left])
        self._left = self._left[time - self._left[:, 0] <= LASTS + 1e-6]
        x, y = self._left[:, 1], self._left[:, 2]
        points = np.column_stack([x, y, np.asarray(height(x, y, time)) + OVER]).astype(np.float32)
        share = np.minimum((time - self._left[:, 0]) / LASTS * len(FADES), len(FADES) - 1e-9).astype(int)
        ends = np.searchsorted(share, np.arange(len(FADES) + 1))
        return [points[max(begin - 1, 0) : end] for begin, end in pairwise(ends)]
