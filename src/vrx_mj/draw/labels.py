"""Text on a map: fonts for every script, and names that keep out of each other's way."""

import contextlib
import logging
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

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

_Box = tuple[float, float, float, float]
_Spot = tuple[float, float, Literal["left", "center", "right"], Literal["bottom", "center", "top"]]
"""Where a label goes: x, y, horizontal and vertical alignment."""


@dataclass(frozen=True)
class Thing:
    """Something that names must not cover, round it `radius`; lengths in m, world frame."""

    name: str
    """What to write beside it; empty for nothing."""
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
