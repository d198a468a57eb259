"""A picture of a hull: from above, from the side and from astern, with its waterline, centre of mass and engines."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.compliance_picture import DPI, FRONT, SIDE, TOP, draw_surfaces
from vrx_mj.draw.labels import font_warnings_hidden

__all__ = ["draw_hull"]

WATER, WEIGHT, ENGINE = "#2f6db5", "#c8242b", "#16181c"


def draw_hull(corners: FloatArray, center: Sequence[float], engines: Sequence[Sequence[float]], path: Path) -> None:
    """Draw triangles (n, 3, 3) [m] whose water is at z = 0, with the centre of mass and engines [m], as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 8), dpi=DPI, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    low, high = corners.reshape(-1, 3).min(axis=0) - 0.1, corners.reshape(-1, 3).max(axis=0) + 0.1
    size = high - low
    grid = figure.add_gridspec(2, 2, width_ratios=(size[0], size[1]), height_ratios=(size[1], size[2]))
    for view, place in ((TOP, grid[0, 0]), (SIDE, grid[1, 0]), (FRONT, grid[1, 1])):
        axes = figure.add_subplot(place, aspect="equal", title=view.title)
        draw_surfaces(axes, view, [(corners, 0.8)])
        axes.set(xlim=(low[view.right], high[view.right]), ylim=(low[view.up], high[view.up]))
        if view.up == 2:
            axes.axhline(0.0, color=WATER, linewidth=1.0)
        axes.plot(*np.take(center, [view.right, view.up]), "+", color=WEIGHT, markersize=12)
        axes.plot(*np.take(engines, [view.right, view.up], axis=1).T, "o", color=ENGINE, markersize=5)
        if view.flip:
            axes.invert_xaxis()
    with font_warnings_hidden():
        figure.savefig(path, metadata={"Software": None})
