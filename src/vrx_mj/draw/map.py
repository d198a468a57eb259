"""Maps of worlds, drawn with matplotlib: a plan, and a panel with compass, legend and overview beside it."""

import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.text import Text

from vrx_mj.arguments import as_int, as_path, check_kind
from vrx_mj.draw.course import MapScene, nice_length
from vrx_mj.draw.plan import SOFT, Box, Row, course_rows, draw_arrow, draw_plan, ground, view_of
from vrx_mj.draw.style import INK, font_warnings_hidden, write
from vrx_mj.errors import CommandError, VrxError, quote
from vrx_mj.frames import compass as compass_degrees
from vrx_mj.outputs import atomic_write

FORMATS = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
"""Kinds of pictures, and what is left out of each so that the same scene gives the same file."""
_SVG = {"svg.fonttype": "none", "svg.hashsalt": "vrx_mj"}
"""Settings of matplotlib: texts of an SVG stay texts, and the same scene gives the same one."""
_HALO = "[id^=halo] text{paint-order: stroke; stroke: #fff; stroke-opacity: 0.8; stroke-width: 2.4}"
"""Style of the names in an SVG, whose white edges would else be paths."""
_DPI = 100
_MAX_SIDE = 16384
"""Largest width and height of a map [px]."""
_AXIS = 75
"""Width of the y axis's numbers and name, on a small map [px]."""
_WIND_COLOR, _WAVE_COLOR, _FRAME_COLOR = "#c2571a", "#1b6f94", "#d1495b"
_LEGEND_ROWS = 16
_FEW_BOATS = 4
"""Most boats that the legend names."""


def draw_map(scene: MapScene, path: str | Path, size: tuple[int, int] = (1600, 1100)) -> None:
    """Draw a scene as PNG, PDF or SVG, by the path's suffix. A PNG or SVG is the same bytes every time.

    Args:
        scene: what to draw.
        path: the picture to write; its folder is made if need be.
        size: width and height [px].

    Raises:
        VrxError: an argument is invalid, or the file cannot be written.
    """
    file = as_path("path", path)
    if file.suffix.lower() not in FORMATS:
        raise VrxError(f"invalid file name {quote(file.name)} for a map: it must end in {', '.join(FORMATS)}")
    with atomic_write(file, "the map") as target:
        file.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(_picture(scene, size, file.suffix.lower()))


def map_png(scene: MapScene, size: tuple[int, int]) -> bytes:
    """A scene as a PNG of `size` pixels."""
    return _picture(scene, size, ".png")


def _picture(scene: MapScene, size: tuple[int, int], suffix: str) -> bytes:
    check_kind("a map", scene, MapScene, "a MapScene, as map_of(world)")
    picture = io.BytesIO()
    with font_warnings_hidden(), rc_context(_SVG):
        figure = chart(scene, _pixels(size))
        haloed = figure.findobj(lambda artist: isinstance(artist, Text) and bool(artist.get_path_effects()))
        for number, name in enumerate(haloed if suffix == ".svg" else ()):
            name.set(path_effects=[], gid=f"halo{number}")
        figure.savefig(picture, format=suffix[1:], metadata=FORMATS[suffix])
    drawn = picture.getvalue()
    return drawn.replace(b"</style>", f"{_HALO}</style>".encode(), 1) if suffix == ".svg" else drawn


def _pixels(size: object) -> tuple[int, int]:
    """Width and height of a picture."""
    if not isinstance(size, Sequence) or len(size) != 2:
        raise CommandError(f"invalid size {quote(size)}: width and height are needed")
    width, height = (as_int("size", value, 1, _MAX_SIDE) for value in size)
    return width, height


def chart(scene: MapScene, size: tuple[int, int]) -> Figure:
    """The map as a matplotlib figure of `size` pixels."""
    figure = Figure(figsize=(size[0] / _DPI, size[1] / _DPI), dpi=_DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    left = max(0.055, _AXIS / size[0])
    axes = figure.add_axes((left, 0.06, 0.74 - left, 0.875))
    view = view_of(scene, axes.get_window_extent().width / axes.get_window_extent().height)
    draw_plan(axes, scene, view)
    write(figure, left, 0.955, scene.title, size=17, weight="bold", va="bottom")
    _compass(figure.add_axes((0.765, 0.70, 0.215, 0.235)), scene)
    _legend(figure.add_axes((0.765, 0.33, 0.215, 0.34)), scene)
    _overview(figure.add_axes((0.765, 0.06, 0.215, 0.24)), scene, view)
    canvas.draw()
    return figure


def _compass(axes: Axes, scene: MapScene) -> None:
    """Where north is, and where wind and waves go."""
    axes.set_axis_off()
    axes.set_xlim(-2.0, 2.0)
    axes.set_ylim(-2.55, 1.55)
    axes.set_aspect("equal", anchor="N")
    axes.add_patch(Circle((0, 0), 1.0, facecolor="#f4f8fa", edgecolor=SOFT, linewidth=1.0))
    for quarter, name in enumerate("ENWS"):
        angle = quarter * math.pi / 2.0 - scene.x_from_east
        x, y = 1.24 * math.cos(angle), 1.24 * math.sin(angle)
        write(axes, x, y, name, size=10, ha="center", va="center", weight="bold" if name == "N" else "normal")
    words, wind, sea = [("calm sea", SOFT), ("no wind", SOFT)], scene.wind, scene.sea
    if sea:
        text = f"waves {sea.significant_height:.2f} m, {sea.period:.3g} s"
        words[0] = f"{text}, {_toward(axes, scene, sea.direction, _WAVE_COLOR, 4.0)}", _WAVE_COLOR
    if wind:
        words[1] = f"wind {wind.mean:.1f} m/s, {_toward(axes, scene, wind.direction, _WIND_COLOR, 2.0)}", _WIND_COLOR
    for row, (text, color) in enumerate(words):
        _write_fitted(axes, -1.68 - 0.3 * row, text, 10.0, color=color, va="center", weight="bold")
    if wind or sea:
        text = "toward: compass degrees\n(degrees counter-clockwise from x)"
        _write_fitted(axes, -2.2, text, 8.0, color=SOFT, va="top")


def _write_fitted(axes: Axes, y: float, text: str, size: float, **style: Any) -> None:
    """Text in the middle of the panel, in letters of `size` [pt] or so much smaller that it fits in."""
    label = write(axes, 0.0, y, text, size=size, ha="center", **style)
    label.set_fontsize(size / max(1.0, label.get_window_extent().width / axes.get_window_extent().width))


def _toward(axes: Axes, scene: MapScene, way: Sequence[float], color: str, width: float) -> str:
    """Draw an arrow along a vector, and return its direction in words."""
    toward = np.array(way) / math.hypot(*way)
    draw_arrow(axes, -0.92 * toward, 0.92 * toward, color, linewidth=width, mutation_scale=20)
    angle = math.atan2(toward[1], toward[0])
    return f"toward {compass_degrees(angle + scene.x_from_east):.0f}° ({math.degrees(angle) % 360.0:.0f}°)"


def _legend(axes: Axes, scene: MapScene) -> None:
    """Boats, then the task's places, then each kind of object with its colour and number, what floats first."""
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-_LEGEND_ROWS - 0.5, 0.5)
    rows = list(_legend_rows(scene))
    left_out = len(rows) - _LEGEND_ROWS
    for row, (marker, face, edge, text) in enumerate(rows[:_LEGEND_ROWS] if left_out > 0 else rows):
        drawn = str(marker).startswith("$")  # a letter: what looks well about a disc would blot it
        size, width = (13, 0.2) if drawn else (8, 0.8 if edge is INK else 1.6)
        axes.plot([0.04], [-row], marker=marker, ms=size, color=face, markeredgecolor=edge, markeredgewidth=width)
        write(axes, 0.11, -row, text, size=9.5, va="center")
    if left_out > 0:
        write(axes, 0.11, -_LEGEND_ROWS, f"and {left_out} more kinds", size=9, color=SOFT, va="center")


def _legend_rows(scene: MapScene) -> Iterator[Row]:
    if len(scene.boats) <= _FEW_BOATS:
        yield from (((5, 0, 0), boat.color, INK, boat.name) for boat in scene.boats)
    if scene.waypoints:
        yield ("D", "white", INK, "waypoint")
    yield from course_rows(scene)
    if scene.docks:
        yield ("s", "#9aa3ab", INK, "dock")
    counts: dict[tuple[str, Any], int] = {}
    for item in sorted(scene.objects, key=lambda item: not item.floating):
        counts[item.model, item.color] = counts.get((item.model, item.color), 0) + 1
    yield from (("o", color, INK, f"{model} × {count}") for (model, color), count in counts.items())


def _overview(axes: Axes, scene: MapScene, view: Box) -> None:
    """The whole terrain, with the plan's frame in it."""
    if not scene.shore:
        axes.set_axis_off()
        return
    points = np.vstack([*scene.shore, np.reshape(view, (2, 2))])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.04 * float(np.max(high - low))
    ground(axes, scene, (low[0] - margin, low[1] - margin, high[0] + margin, high[1] + margin))
    axes.set_aspect("equal", anchor="S")
    axes.set_xticks([])
    axes.set_yticks([])
    width, height = view[2] - view[0], view[3] - view[1]
    axes.add_patch(Rectangle(view[:2], width, height, facecolor="none", edgecolor=_FRAME_COLOR, lw=1.6, zorder=5))
    for things, color in ((scene.objects, INK), (scene.boats, _FRAME_COLOR)):
        places = np.array([(thing.x, thing.y) for thing in things]).reshape(-1, 2)
        axes.plot(*places.T, linestyle="", marker="o", markersize=1.6, color=color, zorder=4)
    length = nice_length(float(high[0] - low[0]) / 3.0)
    extent = high - low
    axes.set_title(f"whole terrain, {extent[0]:.0f} m × {extent[1]:.0f} m", fontsize=9, color=SOFT)
    axes.plot([low[0], low[0] + length], [low[1], low[1]], color=INK, linewidth=2)
    place = (low[0] + length / 2, low[1] + margin / 2)
    write(axes, *place, f"{length:g} m", size=8, ha="center", va="bottom", zorder=6)
