"""What the plan and the overview share: water, land, and round lengths."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from vrx_mj.draw.map import MapScene

__all__ = ["SOFT", "Box", "ground", "nice_length"]

Box = tuple[float, float, float, float]
"""West, south, east and north [m]."""

WATER, LAND, SHORE, SOFT = "#dbe9f0", "#e9e2cd", "#9a8f6d", "#6c7f8a"


def nice_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most `most`."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most * (1 + 1e-9))


def ground(axes: Any, scene: "MapScene", view: Box) -> None:
    """Water, land and the frame of the axes."""
    axes.set_facecolor(WATER)
    axes.set_xlim(view[0], view[2])
    axes.set_ylim(view[1], view[3])
    axes.set_aspect("equal")
    for side in axes.spines.values():
        side.set_color(SOFT)
    if not scene.shore:
        return
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    rings = [Outline(np.vstack([ring, ring[:1]]), closed=True) for ring in scene.shore]
    land = PathPatch(Outline.make_compound_path(*rings), facecolor=LAND, edgecolor=SHORE, linewidth=1.1, zorder=0.5)
    axes.add_patch(land)
