"""Wind, waves and current in a recording: arrows with figures, beside the boats and in the plan's corner."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.colors import CURRENT_COLOR, WAVE_COLOR, WIND_COLOR, text_color
from vrx_mj.frames import compass
from vrx_mj.recording.eyes import FLEET, PLAN, PLAN_LINE, PLAN_SLOPE, east_and_north, followed_circle, plan_eye, sea_eye
from vrx_mj.recording.record_scene import RecordScene
from vrx_mj.recording.timeline import Ticker, static, times

RATE = 2.0
"""Arrows and figures [Hz]."""
KINDS = {
    "wind": (WIND_COLOR, "wind {0:.1f} m/s from {1:.0f} deg"),
    "waves": (WAVE_COLOR, "waves Hs {0:.2g} m, Tp {2:.2g} s from {1:.0f} deg"),
    "current": (CURRENT_COLOR, "current {0:.2g} m/s toward {1:.0f} deg"),
}
"""Colours, and texts of speed or significant height, compass direction and period."""


class Corner(NamedTuple):
    """Where arrows and figures are in a view; lengths in units of the view."""

    path: str
    axes: FloatArray
    """Unit vectors (2, 3) to the right and upward in the view."""
    arrow: float
    """Middle of the arrows, to the right of the view's middle."""
    text: float
    """Middle of the figures."""
    top: float
    """The first line, over the view's middle."""
    line: float
    """From one line to the next."""
    length: float
    """Length of an arrow."""

    def spots(self, across: float, count: int) -> FloatArray:
        """Places (count, 3) of lines."""
        spots: FloatArray = np.column_stack([[across] * count, self.top - self.line * np.arange(count)]) @ self.axes
        return spots


def corners_of(scene: RecordScene) -> tuple[Corner, Corner]:
    """Those of the sea's view, in units of the distance of its eye, and of the plan, in units of half its height."""
    back = sea_eye(0.0) / np.linalg.norm(sea_eye(0.0))
    right = np.cross((0.0, 0.0, 1.0), back) / math.hypot(*back[:2])
    plan = np.hstack([east_and_north(scene), np.zeros((2, 1))])
    return (
        Corner(f"{FLEET}/weather", np.array([right, np.cross(back, right)]), -0.66, -0.36, 0.2, 0.065, 0.16),
        Corner(f"{PLAN}/weather", plan, -1.1, -0.1, 0.88, 2.0 * PLAN_LINE, 0.2),
    )


def flows(scene: RecordScene, rows: FloatArray) -> dict[str, npt.NDArray[np.complex128]]:
    """What there is at (n, columns) rows: speed [m/s] or significant height [m] along x + i y, (n,)."""
    turned = np.exp(1j * rows[:, scene.layout().wind_angle].sum(axis=1))
    found = {"wind": rows[:, 1] * turned * complex(*scene.wind_direction)}
    if scene.parameters and (sea := scene.parameters.sea).waves:
        toward = complex(*sea.direction)
        found["waves"] = np.full(len(rows), sea.significant_height * toward / abs(toward))
    if scene.parameters and (flow := scene.parameters.current):
        tide = flow.tide_frequency * rows[:, 0] + flow.tide_phase
        turn = np.cos(tide) * complex(*flow.tide_major) + np.sin(tide) * complex(*flow.tide_minor)
        found["current"] = complex(*flow.mean) + turn
    return {name: found[name] for name in scene.weather()}


def figures(scene: RecordScene, name: str, flow: npt.NDArray[np.complex128]) -> list[str]:
    """What a flow (n,) is, in words."""
    x = scene.parameters.x_from_east if scene.parameters else 0.0
    text, period = KINDS[name][1], scene.parameters.sea.period if scene.parameters else math.nan
    bearings = np.round(compass(np.angle(-flow if " from " in text else flow) + x)) % 360.0
    return [text.format(*pair, period) for pair in zip(np.abs(flow), bearings, strict=True)]


class WeatherChunks:
    """Turns rows into chunks; it knows what was shown last."""

    def __init__(self) -> None:
        self._ticker = Ticker(RATE)
        self._texts: tuple[str, ...] = ()

    def __call__(self, scene: RecordScene, rows: FloatArray) -> Iterator[Chunk]:
        """Chunks of (n, columns) rows, where a figure changes."""
        rows = rows[self._ticker(rows[:, 0])]
        found = flows(scene, rows)
        texts = list(zip(*(figures(scene, *item) for item in found.items()), strict=True))
        news = [i for i, line in enumerate(texts) if line != (texts[i - 1] if i else self._texts)]
        if not news:
            return
        if not self._texts:
            yield from still_weather(scene)
        self._texts = texts[-1]
        at, counts = [times(rows[news, 0])], [len(found)] * len(news)
        toward = np.angle(np.stack(list(found.values()), axis=1)[news])
        arrows = np.stack([np.cos(toward), np.sin(toward), 0.0 * toward], axis=-1)
        words = rr.Points3D.columns(labels=[text for i in news for text in texts[i]]).partition(counts)
        for corner in corners_of(scene):
            vectors = corner.length * arrows
            origins = corner.spots(corner.arrow, len(found)) - vectors / 2.0
            columns = rr.Arrows3D.columns(vectors=vectors.reshape(-1, 3), origins=origins.reshape(-1, 3))
            yield Chunk.from_columns(corner.path, at, columns.partition(counts))
            yield Chunk.from_columns(f"{corner.path}/figures", at, words)


def still_weather(scene: RecordScene) -> Iterator[Chunk]:
    """Colours and places of arrows and figures, and the size of those beside the boats."""
    colors = [KINDS[name][0] for name in scene.weather()]
    for corner in corners_of(scene):
        yield static(corner.path, rr.Arrows3D.from_fields(colors=colors, radii=[rr.Radius.ui_points(2.5)]))
        spots, tints = corner.spots(corner.text, len(colors)), [text_color(color) for color in colors]
        points = rr.Points3D.from_fields(positions=spots, colors=tints, radii=[0.0], show_labels=True)
        yield static(f"{corner.path}/figures", points)
    distance = float(np.linalg.norm(sea_eye(followed_circle(scene)[1])))
    yield static(f"{FLEET}/weather", rr.Transform3D(scale=distance))


def plan_chunks(scene: RecordScene, track: FloatArray) -> Iterator[Chunk]:
    """Where the plan is that frames a track (2, 2) [m]."""
    middle, height = plan_eye(scene, track)
    yield static(PLAN, rr.Transform3D(translation=(*middle, 0.0), scale=height * PLAN_SLOPE))
