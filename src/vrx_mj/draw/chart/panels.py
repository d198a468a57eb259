"""The panels beside the plan: compass, legend, overview."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from vrx_mj.draw.chart.course import Row, course_rows
from vrx_mj.draw.chart.ground import SOFT, Box, ground, nice_length
from vrx_mj.draw.chart.labels import INK, write

if TYPE_CHECKING:
    from vrx_mj.draw.map import MapScene

__all__ = ["compass", "legend", "overview"]

WIND_COLOR, WAVE_COLOR, FRAME_COLOR = "#c2571a", "#1b6f94", "#d1495b"
LEGEND_ROWS = 16
FEW_BOATS = 4
"""Most boats that the legend names."""


def compass(axes: Any, scene: "MapScene") -> None:
    """Where north is, and where wind and waves go."""
    from matplotlib.patches import Circle

    axes.set_axis_off()
    axes.set_xlim(-2.0, 2.0)
    axes.set_ylim(-2.55, 1.55)
    axes.set_aspect("equal", anchor="N")
    axes.add_patch(Circle((0, 0), 1.0, facecolor="#f4f8fa", edgecolor=SOFT, linewidth=1.0))
    for name, x, y in (("N", 0.0, 1.24), ("E", 1.24, 0.0), ("S", 0.0, -1.24), ("W", -1.24, 0.0)):
        write(axes, x, y, name, size=10, ha="center", va="center", weight="bold" if name == "N" else "normal")
    lines = [("calm sea", SOFT), ("no wind", SOFT)]
    if scene.wave:
        toward = math.degrees(math.atan2(scene.wave.direction[1], scene.wave.direction[0])) % 360.0
        _arrow(axes, toward, WAVE_COLOR, 4.0)
        lines[0] = (
            f"waves {scene.wave.height:.2f} m, {scene.wave.period:g} s, toward {toward:.0f}°",
            WAVE_COLOR,
        )
    if scene.wind:
        _arrow(axes, scene.wind.direction, WIND_COLOR, 2.0)
        lines[1] = (
            f"wind {scene.wind.speed:.1f} m/s, toward {scene.wind.direction % 360.0:.0f}°",
            WIND_COLOR,
        )
    for row, (text, color) in enumerate(lines):
        write(axes, 0.0, -1.68 - 0.3 * row, text, size=10, color=color, ha="center", va="center", weight="bold")
    if scene.wind or scene.wave:
        write(
            axes,
            0.0,
            -2.34,
            "degrees counter-clockwise from east",
            size=8,
            color=SOFT,
            ha="center",
            va="center",
        )


def _arrow(axes: Any, toward: float, color: str, width: float) -> None:
    x, y = math.cos(math.radians(toward)), math.sin(math.radians(toward))
    style = {
        "arrowstyle": "-|>",
        "color": color,
        "linewidth": width,
        "mutation_scale": 20,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    axes.annotate("", (0.92 * x, 0.92 * y), (-0.92 * x, -0.92 * y), arrowprops=style)


def legend(axes: Any, scene: "MapScene") -> None:
    """Boats, then the task's places, then each kind of object with its colour and number, what floats first."""
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-LEGEND_ROWS - 0.5, 0.5)
    rows = list(_legend_rows(scene))
    left_out = len(rows) - LEGEND_ROWS
    for row, (marker, face, edge, text) in enumerate(rows[:LEGEND_ROWS] if left_out > 0 else rows):
        drawn = str(marker).startswith("$")  # a letter: what looks well about a disc would blot it
        size, width = (13, 0.2) if drawn else (8, 0.8 if edge is INK else 1.6)
        axes.plot([0.04], [-row], marker=marker, ms=size, color=face, markeredgecolor=edge, markeredgewidth=width)
        write(axes, 0.11, -row, text, size=9.5, va="center")
    if left_out > 0:
        write(axes, 0.11, -LEGEND_ROWS, f"and {left_out} more kinds", size=9, color=SOFT, va="center")


def _legend_rows(scene: "MapScene") -> Iterator[Row]:
    if len(scene.boats) <= FEW_BOATS:
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


def overview(axes: Any, scene: "MapScene", view: Box) -> None:
    """The whole terrain, with the plan's frame in it."""
    from matplotlib.patches import Rectangle

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
    axes.add_patch(Rectangle(view[:2], width, height, facecolor="none", edgecolor=FRAME_COLOR, lw=1.6, zorder=5))
    for things, color in ((scene.objects, INK), (scene.boats, FRAME_COLOR)):
        places = np.array([(thing.x, thing.y) for thing in things]).reshape(-1, 2)
        axes.plot(*places.T, linestyle="", marker="o", markersize=1.6, color=color, zorder=4)
    length = nice_length(float(high[0] - low[0]) / 3.0)
    extent = high - low
    axes.set_title(f"whole terrain, {extent[0]:.0f} m × {extent[1]:.0f} m", fontsize=9, color=SOFT)
    axes.plot([low[0], low[0] + length], [low[1], low[1]], color=INK, linewidth=2)
    place = (low[0] + length / 2, low[1] + margin / 2)
    write(axes, *place, f"{length:g} m", size=8, ha="center", va="bottom", zorder=6)
