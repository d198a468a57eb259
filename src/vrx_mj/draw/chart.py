"""Charts as SVG, and the templates of pages: static files without script or network."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy.typing as npt
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from vrx_mj.draw.style import INK, boat_color, font_warnings_hidden, hex_color
from vrx_mj.packages import root

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_SIZE = (6.4, 3.5)
"""Width and height of a chart [inch]."""
_PLACE = (0.122, 0.13, 0.856, 0.785)
"""Left and lower edge, width and height of the axes, in shares of the chart's."""
_SETTINGS = {
    "svg.fonttype": "none", "svg.hashsalt": "vrx_mj", "font.size": 9, "axes.grid": True, "grid.color": "#e3e9ee",
    "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "lines.markersize": 5,
}  # fmt: skip
"""Settings of matplotlib: texts stay texts, and the same chart gives the same SVG."""
_SHARED = "campaign"
"""Folder of the style that all pages have."""


@dataclass(frozen=True)
class Series:
    """A curve or points of a chart."""

    label: str
    """Text of the legend, where equal ones are shown once; empty: it is not in the legend."""
    x: npt.ArrayLike
    """Abscissae."""
    y: npt.ArrayLike
    """Ordinates; where one is not finite the curve is cut."""
    reference: bool = False
    """Whether it is what is compared with: in the colour of text, and dashed if it is a curve."""
    kind: Literal["line", "points"] = "line"
    """How it is drawn."""
    color: int | None = None
    """Number of its colour; None: its own among the series."""
    low: npt.ArrayLike | None = None
    """Lower edge of a band around the curve, if it has one."""
    high: npt.ArrayLike | None = None
    """Upper edge."""


@dataclass(frozen=True)
class Chart:
    """Curves over one abscissa."""

    title: str
    """Text above the frame."""
    x: str
    """Name and unit of the abscissa."""
    y: str
    """Name and unit of the ordinate."""
    series: Sequence[Series]
    """Series of the chart, the first below the others."""
    equal: bool = False
    """Whether both axes have the same scale, as for tracks."""


def chart_svg(chart: Chart) -> Markup:
    """The chart as an `<svg>` element; texts are escaped."""
    from matplotlib import rc_context

    text = io.StringIO()
    with rc_context(_SETTINGS), font_warnings_hidden():
        _figure(chart).savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    head = Markup('<svg class="chart" role="img" aria-label="{}" ').format(chart.title)
    return head + Markup(text.getvalue().partition("<svg ")[2])


def _figure(chart: Chart) -> "Figure":
    from matplotlib.figure import Figure

    literal: dict[str, Any] = {"color": INK, "parse_math": False}
    figure = Figure(figsize=_SIZE)
    axes = figure.add_axes(_PLACE)
    axes.set_title(chart.title, loc="left", fontweight="bold", **literal)
    axes.set_xlabel(chart.x, **literal)
    axes.set_ylabel(chart.y, **literal)
    axes.set_aspect("equal" if chart.equal else "auto", adjustable="datalim")
    for number, series in enumerate(chart.series):
        style = "o" if series.kind == "points" else "--" if series.reference else "-"
        color = INK if series.reference else hex_color(boat_color(number if series.color is None else series.color))
        axes.plot(series.x, series.y, style, color=color, label=series.label)
        if series.low is not None and series.high is not None:
            axes.fill_between(series.x, series.low, series.high, color=color, alpha=0.25, linewidth=0)
    named = {series.label: line for line, series in zip(axes.lines, chart.series, strict=True) if series.label}
    for text in axes.legend(handles=list(named.values()), framealpha=0.7).get_texts():
        text.set(**literal)
    return figure


def page_environment(folder: str) -> Environment:
    """The templates of a folder of `templates`, which escape whatever they are given."""
    folders = [root() / "templates" / name for name in dict.fromkeys((folder, _SHARED))]
    return Environment(
        loader=FileSystemLoader(folders, encoding="utf-8"),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
