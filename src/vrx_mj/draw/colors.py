"""Colours that are seen on light and on dark: each has a contrast of at least 3:1 with white and with black."""

import colorsys
import math
from collections.abc import Iterable, Sequence

import numpy as np

from vrx_mj.model.boats import Boat

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
    white = (luminance - scale * own) / (1.0 - scale * own)  # where the hue alone is too dark
    linear = scale * linear + white * (1.0 - scale * linear)
    red, green, blue = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return round(255 * red), round(255 * green), round(255 * blue)


WIND_COLOR, WAVE_COLOR, CURRENT_COLOR = shade((1.0, 0.45, 0.1)), shade((0.1, 0.7, 1.0)), shade((0.2, 1.0, 0.5))
