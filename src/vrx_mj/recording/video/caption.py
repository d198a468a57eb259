"""What is written into the pictures of a video: time, task and score, names of boats, what has just happened."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.recording.video.footage import Standing
from vrx_mj.sensors.view import View

if TYPE_CHECKING:
    from PIL import ImageFont
    from PIL.Image import Image

__all__ = ["clock_line", "name_boats", "project", "task_lines", "write_lines"]

Rgb = tuple[int, int, int]

FONT = "DejaVuSans.ttf"
"""The font that matplotlib carries."""
TEXT_SHARE, NAME_SHARE = 0.034, 0.026
"""Heights of letters, of the picture's height."""
SMALLEST = 9
"""Height of letters at least [pixels]."""
PANEL = (8, 22, 34, 150)
WHITE: Rgb = (255, 255, 255)
TAG_HEIGHT = 2.3
"""Height of a name over its boat's origin [m]."""
FARTHEST = 250.0
"""Distance up to which boats are named [m]."""


def clock_line(world: str, time: float, speed: float) -> str:
    """The world and the time, and how much faster than real it goes."""
    faster = "" if speed == 1.0 else f"  ×{speed:g}"
    return f"{world}  {time:.1f} s{faster}"


def task_lines(standing: Standing) -> tuple[str, str]:
    """Phase and time left, score and collisions of a task."""
    left = f", {standing.remaining:.0f} s left" if standing.phase == "running" else ""
    score = f"score {standing.score:.2f} {standing.unit}, collisions {standing.collisions}"
    return f"{standing.task}: {standing.phase}{left}", score


def project(view: View, place: FloatArray, width: int, height: int) -> tuple[float, float, float] | None:
    """Column and row [pixels] of a place (3,) [m] in a picture of a view, and its distance [m]; None: behind it."""
    ahead, left, up = (float(value) for value in (place - view.position) @ view.rotation)
    if ahead <= view.near:
        return None
    column = width / 2.0 - view.focal_length * left / ahead
    row = height / 2.0 - view.focal_length * up / ahead
    return column, row, ahead


def write_lines(picture: Image, lines: Sequence[str], *, bottom: bool = False) -> None:
    """Write lines on a dark panel in the upper left corner of a picture, or in the lower one."""
    from PIL import ImageDraw

    if not lines:
        return
    draw = ImageDraw.Draw(picture, "RGBA")
    size = max(SMALLEST, round(picture.height * TEXT_SHARE))
    font, edge, step = font_of(size), size // 2, round(1.35 * size)
    width = max(draw.textlength(line, font=font) for line in lines)
    top = picture.height - edge - len(lines) * step - edge if bottom else edge
    box = (edge, top, edge + width + 2 * edge, top + len(lines) * step + edge)
    draw.rounded_rectangle(box, radius=edge, fill=PANEL)
    for number, line in enumerate(lines):
        draw.text((2 * edge, top + edge // 2 + number * step), line, font=font, fill=WHITE)


def name_boats(
    picture: Image, view: View, places: Mapping[str, FloatArray], colors: Mapping[str, Rgb], *, away: float = FARTHEST
) -> None:
    """Write the names of boats at places (3,) [m] over them, if they are in view and no farther than `away` [m]."""
    from PIL import ImageDraw

    draw = ImageDraw.Draw(picture)
    font = font_of(max(SMALLEST, round(picture.height * NAME_SHARE)))
    for name, place in places.items():
        spot = project(view, np.add(place, (0.0, 0.0, TAG_HEIGHT)), picture.width, picture.height)
        if spot is not None and spot[2] < away:
            draw.text(spot[:2], name, font=font, fill=colors[name], anchor="mb", stroke_width=1, stroke_fill=PANEL[:3])


@cache
def font_of(size: int) -> ImageFont.FreeTypeFont:
    """Letters of a height [pixels]."""
    import matplotlib as mpl
    from PIL import ImageFont

    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / FONT), size)
