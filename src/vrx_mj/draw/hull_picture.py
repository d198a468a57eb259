"""A picture of a hull: from above, from the side and from astern, with its waterline, centre of mass and engines."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.compliance_picture import DPI, FRONT, SIDE, TOP, draw_surfaces
from vrx_mj.draw.labels import font_warnings_hidden


def draw_hull(corners: FloatArray, center: Sequence[float], engines: Sequence[Sequence[float]], path: Path) -> None:
    """Draw triangles (n, 3, 3) [m] whose water is at z = 0, with the centre of mass and engines [m], as PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 5), dpi=DPI, layout="constrained")
    figure.suptitle("cross: centre of mass; dots: engines; blue: waterline", y=0.02, va="bottom", fontsize=10)
    for axes, view in zip(figure.subplots(1, 3), (TOP, SIDE, FRONT), strict=True):
        draw_surfaces(axes, view, [(corners, 0.8)])
        axes.plot(*np.take(center, [view.right, view.up]), "+", color="#c8242b", markersize=12)
        axes.plot(*np.take(engines, [view.right, view.up], axis=1).T, "o", color="#16181c", markersize=5)
        if view.up == 2:
            axes.axhline(0.0, color="#2f6db5", linewidth=1.0)
        axes.set(aspect="equal", title=f"{view.title} [m]")
        axes.xaxis.set_inverted(view.flip)
    with font_warnings_hidden():
        figure.savefig(path, metadata={"Software": None})
