"""Charts as SVG: where values are, what is cut, and that texts are taken literally."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from fingerprints import FONTS, check, placed
from vrx_mj.draw.chart import Chart, Series, _figure, chart_svg
from vrx_mj.draw.style import boat_color, hex_color

SVG = "{http://www.w3.org/2000/svg}"


def drawn(*series, **options):
    return ET.fromstring(chart_svg(Chart("a title", "time [s]", "distance [m]", series, **options)))


def curve(svg):
    """The first series' line: where it begins, `M`, and goes on, `L`."""
    color = f"stroke: {hex_color(boat_color(0))}"
    return next(path.get("d") for path in svg.iter(f"{SVG}path") if color in path.get("style", ""))


def points_of(line):
    return np.array([[float(word) for word in pair.split()] for pair in re.split("[ML]", line)[1:]])


def test_a_straight_line_is_straight_and_inside_the_page():
    svg = drawn(Series("ours", [0.0, 1.0, 4.0], [1.0, 3.0, 5.0]))
    (x0, y0), (x1, y1), (x2, y2) = points_of(curve(svg))
    width, height = map(float, svg.get("viewBox").split()[2:])
    assert (x1 - x0) / (x2 - x0) == pytest.approx(0.25, abs=1e-3)
    assert (y1 - y0) / (y2 - y0) == pytest.approx(0.5, abs=1e-3)
    assert 0.0 < x0 < x2 < width
    assert 0.0 < y2 < y0 < height  # up is up


def test_a_label_stands_once_in_the_legend():
    svg = drawn(*(Series("closed form", [0.0, 1.0], [height] * 2, reference=True) for height in (1.0, 2.0)))
    assert [text.text for text in svg.iter(f"{SVG}text")].count("closed form") == 1


def test_values_that_are_no_numbers_cut_a_curve():
    line = curve(drawn(Series("ours", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [0.0, 1.0, np.nan, np.inf, 2.0, 5.0])))
    assert re.sub(r"[^ML]", "", line) == "MLML"


def test_long_curves_keep_their_ends_and_lose_points_between():
    x = np.linspace(0.0, 1.0, 50_000)
    points = points_of(curve(drawn(Series("ours", x, x))))
    assert len(points) < 100
    few = points_of(curve(drawn(Series("ours", x[[0, -1]], x[[0, -1]]))))
    assert points[[0, -1]] == pytest.approx(few, abs=0.01)


def test_equal_axes_have_one_scale():
    (x0, _), (x1, y1), (_, y2) = points_of(curve(drawn(Series("ours", [0.0, 3.0, 3.0], [0.0, 0.0, 3.0]), equal=True)))
    assert x1 - x0 == pytest.approx(y1 - y2, abs=0.2)


@pytest.mark.parametrize(("x", "y"), [([], []), ([2.0], [7.0]), ([np.nan], [1.0])])
def test_a_chart_of_little_is_one(x, y):
    svg = drawn(Series("ours", x, y), Series("theirs", x, y, reference=True, kind="points"), Series("", x, y))
    texts = [text.text for text in svg.iter(f"{SVG}text")]
    assert texts[-2:] == ["ours", "theirs"]  # the legend's


def test_texts_are_taken_literally():
    svg = chart_svg(Chart("<b>&$x$", "$x$", "y", (Series("<script>", [0.0, 1.0], [0.0, 1.0]),)))
    assert "<b>" not in svg
    assert "<script>" not in svg
    texts = [text.text for text in ET.fromstring(svg).iter(f"{SVG}text")]
    assert {"<b>&$x$", "$x$", "<script>"} <= {*texts}


def test_the_same_chart_gives_the_same_svg():
    chart = Chart("a", "x", "y", (Series("one", [0.0, 1.0], [0.0, 1.0], kind="points"),))
    assert chart_svg(chart) == chart_svg(chart)


def test_a_chart_is_drawn_as_it_was():
    x = np.linspace(0.0, 3.0, 7)
    series = (
        Series("ours", x, x**2, low=x**2 - 1.0, high=x**2 + 0.5), Series("", x, 2.0 * x, color=4),
        Series("closed form", x, x, reference=True), Series("measured", x, 3.0 - x, kind="points", color=0),
    )  # fmt: skip
    for equal in (False, True):
        check(
            "draw",
            f"chart, equal {equal}",
            rounding=FONTS,
            map=placed(_figure(Chart("a title", "t [s]", "d [m]", series, equal))),
        )
