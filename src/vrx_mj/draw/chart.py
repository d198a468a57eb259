"""Charts of curves and points as SVG that stands in a page by itself, without script or network."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from markupsafe import Markup, escape

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.colors import boat_color, hex_color

WIDTH, HEIGHT = 640.0, 348.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 78.0, 14.0, 52.0, 46.0
"""Margins of the frame [px]."""
_INK, _SOFT, _GRID = "#16232e", "#5d6d7a", "#e3e9ee"
MOST_POINTS = 1200
"""Points of a curve that are drawn, at most: every so many of those that there are."""
_TICKS = 6


@dataclass(frozen=True)
class Series:
    """A curve or points of a chart."""

    label: str
    """Text of the legend; empty: it is not in the legend."""
    x: Sequence[float] | FloatArray
    """Abscissae."""
    y: Sequence[float] | FloatArray
    """Ordinates; where one is not finite the curve is cut."""
    reference: bool = False
    """Whether it is what is compared with: in the colour of text, and dashed if it is a curve."""
    kind: Literal["line", "points"] = "line"
    """How it is drawn."""


@dataclass(frozen=True)
class Chart:
    """Curves over one abscissa."""

    title: str
    """Text above the frame."""
    x: str
    """Name and unit of the abscissa."""
    y: str
    """Name and unit of the ordinate."""
    series: tuple[Series, ...]
    """What is drawn, the first below the others."""
    equal: bool = False
    """Whether both axes have the same scale, as for tracks."""


@dataclass(frozen=True)
class _Frame:
    """Where values are on the page."""

    x: tuple[float, float]
    y: tuple[float, float]

    def place(self, x: float, y: float) -> tuple[float, float]:
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return _LEFT + across * (WIDTH - _LEFT - _RIGHT), HEIGHT - _BOTTOM - up * (HEIGHT - _TOP - _BOTTOM)


def chart_svg(chart: Chart) -> Markup:
    """The chart as an `<svg>` element; texts are escaped."""
    frame = _frame(chart)
    head = (
        f'<svg class="chart" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" xmlns="http://www.w3.org/2000/svg" '
        f'font-family="system-ui, sans-serif" font-size="12"><title>{escape(chart.title)}</title>'
    )
    parts = [
        head,
        f'<rect width="{WIDTH:g}" height="{HEIGHT:g}" fill="#ffffff"/>',
        f'<g font-weight="600">{_text(_LEFT, 18, chart.title, _INK, "start")}</g>',
        *_axes(chart, frame),
        *(part for number, series in enumerate(chart.series) for part in _curve(series, number, frame)),
        *_legend(chart.series),
        "</svg>",
    ]
    return Markup("\n".join(parts))


def _frame(chart: Chart) -> _Frame:
    x, y = (_range([value for each in chart.series for value in getattr(each, axis)]) for axis in "xy")
    if not chart.equal:
        return _Frame(x, y)
    scale = max((x[1] - x[0]) / (WIDTH - _LEFT - _RIGHT), (y[1] - y[0]) / (HEIGHT - _TOP - _BOTTOM))
    width, height = scale * (WIDTH - _LEFT - _RIGHT), scale * (HEIGHT - _TOP - _BOTTOM)
    middle_x, middle_y = (x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0
    return _Frame((middle_x - width / 2, middle_x + width / 2), (middle_y - height / 2, middle_y + height / 2))


def _range(values: Sequence[float]) -> tuple[float, float]:
    """A range round all finite values, a little wider than these."""
    finite = [float(value) for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    margin = 0.04 * (high - low) or 0.05 * abs(high) or 1.0
    return low - margin, high + margin


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers between two."""
    raw = (high - low) / _TICKS
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * power for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if factor * power >= raw * 0.999)
    first = math.ceil(low / step)
    return [step * number for number in range(first, math.floor(high / step) + 1)]


def _axes(chart: Chart, frame: _Frame) -> Iterator[str]:
    left, bottom = frame.place(frame.x[0], frame.y[0])
    right, top = frame.place(frame.x[1], frame.y[1])
    for value in _ticks(*frame.x):
        x, _ = frame.place(value, frame.y[0])
        yield f'<path d="M{x:.1f} {bottom:.1f}V{top:.1f}" stroke="{_GRID}"/>'
        yield _text(x, bottom + 16, f"{value + 0.0:.6g}", _SOFT)
    for value in _ticks(*frame.y):
        _, y = frame.place(frame.x[0], value)
        yield f'<path d="M{left:.1f} {y:.1f}H{right:.1f}" stroke="{_GRID}"/>'
        yield _text(left - 6, y + 4, f"{value + 0.0:.6g}", _SOFT, "end")
    yield f'<path d="M{left:.1f} {top:.1f}V{bottom:.1f}H{right:.1f}" fill="none" stroke="{_SOFT}"/>'
    yield _text((left + right) / 2, HEIGHT - 10, chart.x, _INK)
    middle = (top + bottom) / 2
    yield f'<g transform="rotate(-90 14 {middle:.1f})">{_text(14, middle, chart.y, _INK)}</g>'


def _text(x: float, y: float, text: str, color: str, anchor: str = "middle") -> str:
    style = f"text-anchor:{anchor};fill:{color}"
    return f'<text x="{x:.1f}" y="{y:.1f}" style="{style}">{escape(text)}</text>'


def _color(series: Series, number: int) -> str:
    return _INK if series.reference else hex_color(boat_color(number))


def _curve(series: Series, number: int, frame: _Frame) -> Iterator[str]:
    color = _color(series, number)
    if series.kind == "points":
        for x, y in zip(series.x, series.y, strict=True):
            if math.isfinite(x) and math.isfinite(y):
                across, up = frame.place(float(x), float(y))
                yield f'<circle cx="{across:.1f}" cy="{up:.1f}" r="3.5" fill="{color}"/>'
        return
    dash = ' stroke-dasharray="6 4"' if series.reference else ""
    style = f'fill="none" stroke="{color}" stroke-width="1.8"{dash} stroke-linejoin="round"'
    yield f'<path d="{_path(np.column_stack([series.x, series.y]), frame)}" {style}/>'


def _path(points: FloatArray, frame: _Frame) -> str:
    """Lines through points; one that is not finite parts them."""
    stride = 1 + len(points) // MOST_POINTS
    chosen = [*points[:-1:stride], *points[-1:]]
    words, letter = [], "M"
    for x, y in chosen:
        if not (math.isfinite(x) and math.isfinite(y)):
            letter = "M"
            continue
        across, up = frame.place(float(x), float(y))
        words.append(f"{letter}{across:.1f} {up:.1f}")
        letter = "L"
    return "".join(words)


def _legend(series: Sequence[Series]) -> Iterator[str]:
    x = _LEFT
    for number, each in enumerate(series):
        if not each.label:
            continue
        color = _color(each, number)
        if each.kind == "points":
            yield f'<circle cx="{x + 11:.1f}" cy="36" r="3.5" fill="{color}"/>'
        else:
            dash = ' stroke-dasharray="6 4"' if each.reference else ""
            yield f'<path d="M{x:.1f} 36h22" stroke="{color}" stroke-width="2"{dash}/>'
        yield _text(x + 28, 40, each.label, _INK, "start")
        x += 46 + 6.6 * len(each.label)
