"""Wind, waves and current in a recording: arrows with figures, beside the boats and in the plan's corner."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.colors import CURRENT_COLOR, WAVE_COLOR, WIND_COLOR, Rgb, text_color
from vrx_mj.frames import compass
from vrx_mj.recording.eyes import FLEET, PLAN, PLAN_LINE, PLAN_SLOPE, east_and_north, followed_circle, plan_eye, sea_eye
from vrx_mj.recording.record_scene import RecordScene
from vrx_mj.recording.static_chunks import static
from vrx_mj.recording.timeline import Ticker, times

__all__ = ["COLORS", "WeatherChunks", "plan_chunks"]

FLEET_WEATHER = f"{FLEET}/weather"
RATE = 2.0
"""Arrows and figures [Hz]."""
COLORS = {"wind": WIND_COLOR, "waves": WAVE_COLOR, "current": CURRENT_COLOR}
TYPICAL = {"wind": 5.0, "waves": 0.5, "current": 0.5}
"""Speed [m/s] and significant height [m] whose arrow has half of the full length."""

Weather = dict[str, tuple[FloatArray, list[str]]]
"""By what it is: vectors (n, 2) along x and y, of speed [m/s] or significant height [m], and texts."""


@dataclass(frozen=True)
class Corner:
    """Where arrows and figures are in a view; lengths in units of the view."""

    path: str
    right: FloatArray
    """Direction to the right in the view, a unit vector (3,)."""
    up: FloatArray
    """Direction upward in the view."""
    arrow: float
    """Middle of the arrows, to the right of the view's middle."""
    text: float
    """Middle of the figures."""
    top: float
    """The first line, over the view's middle."""
    line: float
    """From one line to the next."""
    length: float
    """The longest arrow."""

    def spots(self, across: float, count: int) -> FloatArray:
        """Places (count, 3) of lines."""
        return across * self.right + (self.top - self.line * np.arange(count))[:, None] * self.up


def corners_of(scene: RecordScene) -> tuple[Corner, Corner]:
    """Those of the sea's view, in units of the distance of its eye, and of the plan, in units of half its height."""
    back = sea_eye(0.0)
    right = np.cross((0.0, 0.0, 1.0), back)
    up = np.cross(back, right)
    east, north = np.hstack([east_and_north(scene), np.zeros((2, 1))])
    return (
        Corner(FLEET_WEATHER, right / np.linalg.norm(right), up / np.linalg.norm(up), -0.66, -0.36, 0.36, 0.065, 0.3),
        Corner(f"{PLAN}/weather", east, north, -1.1, -0.1, 0.88, 2.0 * PLAN_LINE, 0.3),
    )


def weather_of(scene: RecordScene, time: FloatArray, speed: FloatArray, turned: FloatArray) -> Weather:
    """What there is at times (n,) [s] of a wind of speeds (n,) [m/s] turned by angles (n,) [rad]."""
    east, north = scene.wind_direction
    wind = speed[:, None] * np.stack(
        [np.cos(turned) * east - np.sin(turned) * north, np.sin(turned) * east + np.cos(turned) * north], axis=1
    )
    found: Weather = {}
    if "wind" in scene.weather():
        found["wind"] = wind, [f"wind {size:.1f} m/s from {at:.0f} deg" for size, at in bearings(scene, -wind)]
    if scene.parameters is None:
        return found
    sea, current = scene.parameters.sea, scene.parameters.current
    if sea.waves:
        waves = np.tile(sea.significant_height * np.array(sea.direction) / math.hypot(*sea.direction), (len(time), 1))
        words = f"waves Hs {sea.significant_height:.2g} m, Tp {sea.period:.2g} s from"
        found["waves"] = waves, [f"{words} {at:.0f} deg" for _, at in bearings(scene, -waves)]
    if current is not None:
        tide = (current.tide_frequency * time + current.tide_phase)[:, None]
        flow = current.mean + np.cos(tide) * current.tide_major + np.sin(tide) * current.tide_minor
        found["current"] = flow, [f"current {size:.2g} m/s toward {at:.0f} deg" for size, at in bearings(scene, flow)]
    return found


def bearings(scene: RecordScene, vectors: FloatArray) -> Iterator[tuple[float, float]]:
    """Lengths of vectors (n, 2) and their compass directions [degrees]."""
    x = scene.parameters.x_from_east if scene.parameters else 0.0
    for east, north in vectors.tolist():
        yield math.hypot(east, north), round(compass(math.atan2(north, east) + x)) % 360


class WeatherChunks:
    """Turns rows into chunks; it knows what was shown last."""

    def __init__(self) -> None:
        self._ticker = Ticker(RATE)
        self._texts: list[str] = []

    def __call__(self, scene: RecordScene, rows: FloatArray) -> Iterator[Chunk]:
        """Chunks of (n, columns) rows, where a figure changes."""
        rows = rows[self._ticker(rows[:, 0])]
        found = weather_of(scene, rows[:, 0], rows[:, 1], rows[:, scene.layout().wind_angle].sum(axis=1))
        texts = [list(line) for line in zip(*(words for _, words in found.values()), strict=True)]
        news = [i for i, line in enumerate(texts) if line != (texts[i - 1] if i else self._texts)]
        if not news:
            return
        if not self._texts:
            yield from still_weather([COLORS[name] for name in found], scene)
        self._texts = texts[-1]
        at, counts = [times(rows[news, 0])], [len(found)] * len(news)
        words = rr.Points3D.columns(labels=[text for i in news for text in texts[i]]).partition(counts)
        for corner in corners_of(scene):
            arrows = corner.length * np.insert(shares(found)[news], 2, 0.0, axis=2)
            places = corner.spots(corner.arrow, len(found)) - arrows / 2.0
            columns = rr.Arrows3D.columns(vectors=arrows.reshape(-1, 3), origins=places.reshape(-1, 3))
            yield Chunk.from_columns(corner.path, at, columns.partition(counts))
            yield Chunk.from_columns(f"{corner.path}/figures", at, words)


def shares(weather: Weather) -> FloatArray:
    """Vectors (n, kinds, 2) of arrows, in lengths of the longest."""
    each = (
        vectors / (np.linalg.norm(vectors, axis=1, keepdims=True) + TYPICAL[name])
        for name, (vectors, _) in weather.items()
    )
    return np.stack(list(each), axis=1)


def still_weather(colors: Sequence[Rgb], scene: RecordScene) -> Iterator[Chunk]:
    """Colours and places of arrows and figures, and the size of those beside the boats."""
    for corner in corners_of(scene):
        yield static(corner.path, rr.Arrows3D.from_fields(colors=colors, radii=[rr.Radius.ui_points(2.5)]))
        spots, tints = corner.spots(corner.text, len(colors)), [text_color(color) for color in colors]
        figures = rr.Points3D.from_fields(positions=spots, colors=tints, radii=[0.0], show_labels=True)
        yield static(f"{corner.path}/figures", figures)
    distance = float(np.linalg.norm(sea_eye(followed_circle(scene)[1])))
    yield static(FLEET_WEATHER, rr.Transform3D(scale=distance))


def plan_chunks(scene: RecordScene, track: FloatArray) -> Iterator[Chunk]:
    """Where the plan is that frames a track (2, 2) [m]."""
    middle, height = plan_eye(scene, track)
    yield static(PLAN, rr.Transform3D(translation=(*middle, 0.0), scale=height * PLAN_SLOPE))
