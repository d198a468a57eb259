"""Charts as SVG: where values are, what is cut, and that texts are escaped."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from vrx_mj.draw.chart import HEIGHT, MOST_POINTS, WIDTH, Chart, Series, chart_svg

SVG = "{http://www.w3.org/2000/svg}"


def drawn(*series, **options):
    return ET.fromstring(chart_svg(Chart("a title", "time [s]", "way [m]", series, **options)))


def curves(svg):
    return [path.get("d") for path in svg.iter(f"{SVG}path") if path.get("stroke-width") == "1.8"]


def points_of(line):
    return np.array([[float(word) for word in pair.split()] for pair in re.split("[ML]", line)[1:]])


def test_a_straight_line_is_straight_and_inside_the_page():
    (line,) = curves(drawn(Series("ours", [0.0, 1.0, 4.0], [1.0, 2.0, 5.0])))
    (x0, y0), (x1, y1), (x2, y2) = points_of(line)
    assert (x1 - x0) / (x2 - x0) == pytest.approx(0.25, abs=1e-3)
    assert (y1 - y0) / (y2 - y0) == pytest.approx(0.25, abs=1e-3)
    assert 0.0 < x0 < x2 < WIDTH
    assert 0.0 < y2 < y0 < HEIGHT  # up is up


def test_values_that_are_no_numbers_cut_a_curve():
    (line,) = curves(drawn(Series("ours", [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, np.nan, np.inf, 2.0])))
    assert re.sub(r"[^ML]", "", line) == "MLM"


def test_long_curves_keep_their_ends_and_lose_points_between():
    x = np.linspace(0.0, 1.0, 50_000)
    points = points_of(curves(drawn(Series("ours", x, x)))[0])
    assert len(points) <= MOST_POINTS + 1
    few = points_of(curves(drawn(Series("ours", x[[0, -1]], x[[0, -1]])))[0])
    assert (points[0], points[-1]) == (pytest.approx(few[0]), pytest.approx(few[-1]))


def test_equal_axes_have_one_scale():
    (line,) = curves(drawn(Series("ours", [0.0, 3.0, 3.0], [0.0, 0.0, 3.0]), equal=True))
    (x0, _), (x1, y1), (_, y2) = points_of(line)
    assert x1 - x0 == pytest.approx(y1 - y2, abs=0.2)


@pytest.mark.parametrize(("x", "y"), [([], []), ([2.0], [7.0]), ([np.nan], [1.0])])
def test_a_chart_of_little_is_one(x, y):
    svg = drawn(Series("ours", x, y), Series("theirs", x, y, reference=True, kind="points"))
    assert len(list(svg.iter(f"{SVG}circle"))) >= 1  # the legend's


def test_texts_are_escaped():
    svg = chart_svg(Chart("<b>&", "x", "y", (Series("<script>", [0.0, 1.0], [0.0, 1.0]),)))
    assert "<b>" not in svg
    assert "<script>" not in svg
    assert ET.fromstring(svg).find(f"{SVG}title").text == "<b>&"
