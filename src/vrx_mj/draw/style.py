"""Colours and text of maps and charts.

Each colour has a contrast of at least 3:1 with white and with black. Fonts cover every script, and names are placed so
that they do not overlap.
"""

import colorsys
import contextlib
import logging
import math
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vrx_mj.model.boats import Boat

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text


Rgb = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""

_SHADES = (0.27, 0.18, 0.12)
"""Relative luminances: WCAG 2 gives 3:1 with white up to 0.300, and with black from 0.100 on."""
LABEL: Rgb = (255, 255, 255)
"""Names in the views of recordings: a viewer's plates under them are half its grey, light or dark, half the water."""
_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
"""Shares of red, green and blue in the luminance, by WCAG 2."""
_FIRST_HUE, _GOLDEN = 0.09, (3.0 - math.sqrt(5.0)) / 2.0
"""The first boat's hue, and from one boat to the next, in turns: the golden angle, after which no two are equal."""
_SATURATIONS = (0.9, 0.6, 0.4)
"""In turn, so that of a hundred boats no two look alike."""
_PER_SHADE = 12
"""Boats of one luminance, before the next have another."""
INK = "#20313c"
_FONTS = (
    "DejaVu Sans",
    "Noto Sans CJK SC",
    "Noto Sans SC",
    "Microsoft YaHei",
    "PingFang SC",
    "SimHei",
    "WenQuanYi Zen Hei",
)
"""Fonts that are tried for each letter, in this order."""


def boat_color(number: int, own: Sequence[float] | None = None) -> Rgb:
    """The colour of a boat, a controller or a curve by its number in its world, campaign or chart.

    `own`: the colour (0 to 1) of a boat's hull.
    """
    hue = colorsys.hsv_to_rgb((_FIRST_HUE + _GOLDEN * number) % 1.0, _SATURATIONS[number % 3], 1.0)
    return shade(own[:3] if own else hue, _SHADES[number // _PER_SHADE % len(_SHADES)])


def boat_colors(names: Iterable[str], boats: Iterable[Boat] = ()) -> dict[str, Rgb]:
    """The colour of every boat by its name, in the order in which they came; `boats` of them may have their own."""
    hulls = {boat.name: boat.color for boat in boats}
    return {name: boat_color(number, hulls.get(name)) for number, name in enumerate(names)}


def hex_color(rgb: Iterable[int]) -> str:
    """A colour (0 to 255) as `#rrggbb`."""
    return f"#{bytes(rgb).hex()}"


def shade(rgb: Sequence[float], luminance: float = _SHADES[0]) -> Rgb:
    """A colour (0 to 1) of the same hue with a relative luminance."""
    color = np.array(rgb)
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)  # sRGB
    own, brightest = float(_WEIGHTS @ linear), float(linear.max())
    scale = min(luminance / own, 1.0 / brightest) if own else 1.0
    white = (luminance - scale * own) / (1.0 - scale * own or 1.0)  # where the hue alone is too dark
    linear = scale * linear + white * (1.0 - scale * linear)
    red, green, blue = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.abs(linear) ** (1.0 / 2.4) - 0.055)
    return round(255 * red), round(255 * green), round(255 * blue)


WIND_COLOR, WAVE_COLOR, CURRENT_COLOR = shade((1.0, 0.45, 0.1)), shade((0.1, 0.7, 1.0)), shade((0.2, 1.0, 0.5))


_Box = tuple[float, float, float, float]
_Spot = tuple[float, float, Literal["left", "center", "right"], Literal["bottom", "center", "top"]]
"""Where a label goes: x, y, horizontal and vertical alignment."""


@dataclass(frozen=True)
class Thing:
    """Something that names must not cover, round it `radius`; lengths in m, world frame."""

    name: str
    """Text beside it; empty for none."""
    x: float
    y: float
    radius: float
    """Radius of what the name must not cover [m]; 0 for a name that is written on its thing."""
    must: bool = False
    """Whether the name must appear even where it covers something."""


def label(axes: "Axes", things: Sequence[Thing], pixel: float) -> None:
    """Write names beside things, each where it covers nothing yet; one that fits nowhere is left out.

    Args:
        axes: matplotlib's axes.
        things: those whose names matter most come first.
        pixel: size of a pixel [m].
    """
    taken = [_around(axes, thing, pixel) for thing in things if thing.radius > 0.0]
    for thing in things:
        if not thing.name:
            continue
        weight, size = ("bold", 9.5) if thing.must else ("normal", 8)
        text = write(axes, thing.x, thing.y, thing.name, size=size, weight=weight, zorder=7)
        _halo(text)
        spots = list(_spots(thing, pixel))
        free = next((spot for spot in spots if not _hits(axes, text, spot, taken)), None)
        if free is None and not thing.must:
            text.remove()
            continue
        _set_spot(text, free or spots[0])
        taken.append(_extent(text))


def write(place: "Axes | Figure", x: float, y: float, text: str, **style: Any) -> "Text":
    """Text taken literally (`$` too), in fonts that between them have most letters."""
    return place.text(x, y, text, **{"color": INK, "fontfamily": _fonts(), "parse_math": False, **style})


@contextlib.contextmanager
def font_warnings_hidden() -> Iterator[None]:
    """Around drawing: without matplotlib's warnings about letters and weights that no font here has."""
    fonts = logging.getLogger("matplotlib.font_manager")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        fonts.addFilter(_is_news)
        try:
            yield
        finally:
            fonts.removeFilter(_is_news)


def _is_news(record: logging.LogRecord) -> bool:
    return "Failed to find font weight" not in record.getMessage()


def _spots(thing: Thing, pixel: float) -> Iterator[_Spot]:
    """Places around a thing, the best first."""
    x, y = thing.x, thing.y
    if thing.radius == 0.0:
        yield x, y, "center", "center"
    off = thing.radius + 4.0 * pixel
    yield from ((x + off, y, "left", "center"), (x - off, y, "right", "center"))
    yield from ((x, y + off, "center", "bottom"), (x, y - off, "center", "top"))
    slant = 0.75 * off
    yield from ((x + slant, y + slant, "left", "bottom"), (x + slant, y - slant, "left", "top"))
    yield from ((x - slant, y + slant, "right", "bottom"), (x - slant, y - slant, "right", "top"))


def _hits(axes: "Axes", text: "Text", spot: _Spot, taken: Sequence[_Box]) -> bool:
    """Whether a text at this spot covers anything or leaves the axes."""
    _set_spot(text, spot)
    left, low, right, top = _extent(text)
    frame = axes.get_window_extent()
    if left < frame.x0 or right > frame.x1 or low < frame.y0 or top > frame.y1:
        return True
    return any(left < box[2] and right > box[0] and low < box[3] and top > box[1] for box in taken)


def _set_spot(text: "Text", spot: _Spot) -> None:
    text.set_position(spot[:2])
    text.set_horizontalalignment(spot[2])
    text.set_verticalalignment(spot[3])


def _extent(text: "Text") -> _Box:
    box = text.get_window_extent()
    return (box.x0 - 1.0, box.y0 - 0.5, box.x1 + 1.0, box.y1 + 0.5)


def _around(axes: "Axes", thing: Thing, pixel: float) -> _Box:
    """The square round a thing, in pixels of the figure."""
    across, up = axes.transData.transform((thing.x, thing.y))
    radius = thing.radius / pixel
    return (across - radius, up - radius, across + radius, up + radius)


def _fonts() -> list[str]:
    from matplotlib import font_manager

    known = {font.name for font in font_manager.fontManager.ttflist}
    return [name for name in _FONTS if name in known]


def _halo(text: "Text") -> None:
    from matplotlib import patheffects

    text.set_path_effects([patheffects.withStroke(linewidth=2.4, foreground="white", alpha=0.8)])
