"""Colours are seen on light and on dark, and differ."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fingerprints import check
from vrx_mj.config.docks import RGB as LIGHTS
from vrx_mj.draw import style
from vrx_mj.draw.chart import Chart, Series, chart_svg
from vrx_mj.draw.style import LABEL, boat_color, boat_colors, hex_color
from vrx_mj.recording import blueprint, motion_chunks, sea_meshes, static_chunks, task_chunks

ROOT = Path(__file__).parents[3]


def luminance(color):
    """Relative luminance of red, green and blue, 0 to 255, by WCAG 2."""
    shares = [share / 255.0 for share in color]
    linear = [share / 12.92 if share <= 0.03928 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    """Contrast of two colours, by WCAG 2."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def lab(color):
    """CIE 1976 L*, a* and b* of a colour under D65."""
    linear = [luminance((share, 0, 0)) / 0.2126 for share in color]
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    x, y, z = np.cbrt(np.maximum(xyz / [0.9505, 1.0, 1.089], 0.008856))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@example(rgb=(0.03125, 0.0, 0.0), wanted=0.05)  # the white that is missing rounds to less than none
@given(rgb=st.tuples(*[st.floats(0.0, 1.0)] * 3), wanted=st.floats(0.05, 0.9))
def test_a_shade_has_the_luminance_that_is_asked_for(rgb, wanted):
    assert luminance(style.shade(rgb, wanted)) == pytest.approx(wanted, abs=0.01)  # of 255 steps


@given(rgb=st.tuples(*[st.integers(1, 255)] * 3))
def test_a_colour_is_the_shade_of_its_own_luminance(rgb):
    found = style.shade([share / 255.0 for share in rgb], luminance(rgb))
    assert np.abs(np.array(found) - rgb).max() <= 1


LINES = {
    "wind": style.WIND_COLOR, "waves": style.WAVE_COLOR, "current": style.CURRENT_COLOR,
    "shore": static_chunks.SHORE_COLOR, "waypoints": static_chunks.WAYPOINT_COLOR,
    "thrust": static_chunks.THRUST_COLOR, "touches": task_chunks.TOUCH_COLOR,
    **task_chunks.FATES, **task_chunks.STATUS, **{kind: color for kind, (color, _) in task_chunks.MARK_KINDS.items()},
    "right": task_chunks.RIGHT, "wrong": task_chunks.WRONG, "inside": task_chunks.INSIDE, "docked": task_chunks.DOCKED,
    "lost": task_chunks.LOST, "avoid": task_chunks.AVOID, "path": task_chunks.PATH, "beacon": task_chunks.BEACON,
    "score": task_chunks.SCORE_COLOR, "hits": task_chunks.HITS_COLOR, "sound": motion_chunks.SOUND_COLOR,
    **dict(zip("xyz", motion_chunks.AXIS_COLORS, strict=True)),
    **{f"boat {number}": boat_color(number) for number in range(100)},
    **{f"hull of {name}": boat_color(0, rgb) for name, rgb in LIGHTS.items()}, "black hull": boat_color(0, (0, 0, 0)),
    **{f"engine {i}": rgb for i, rgb in enumerate(static_chunks.series_shades([boat_color(0)] * 4))},
}  # fmt: skip


def test_colours_are_those_that_people_know():
    """From maps, charts and recordings that they made before."""
    ramp = [style.shade(rgb, wanted) for rgb in np.eye(3) for wanted in (0.02, 0.1, 0.3, 0.8)]
    sky = blueprint._SKY_COLOR, blueprint.PLAN_WATER, sea_meshes.DEEP, sea_meshes.CREST, sea_meshes._PALETTE
    looks = [sky, style.LABEL, int(style.INK[1:], 16), {name: [*color] for name, color in LINES.items()}]
    check("draw", "colours", looks=looks, ramp=ramp)


@pytest.mark.parametrize("ground", [(255, 255, 255), (0, 0, 0)])
def test_lines_are_seen_on_white_and_on_black(ground):
    assert {name: color for name, color in LINES.items() if not contrast(color, ground) >= 3.0} == {}


CALM_SEA = sea_meshes.DEEP + (sea_meshes.CREST - sea_meshes.DEEP) * sea_meshes.CALM_LIGHT


@pytest.mark.parametrize("plate", [44, 225])
@pytest.mark.parametrize("water", [blueprint.PLAN_WATER, tuple(CALM_SEA)])
def test_names_are_read_on_the_water_in_both_themes(plate, water):
    """A viewer (rerun 0.41) writes them on a plate: half this grey of its dark or light theme, half what is behind."""
    assert contrast(LABEL, [(share + plate) / 2.0 for share in water]) >= 3.0


@pytest.mark.parametrize(("boats", "apart"), [(3, 40.0), (12, 15.0), (20, 12.0), (100, 4.0)])
def test_no_two_boats_look_alike(boats, apart):
    """By the distance in L*a*b*, of which 2.3 is just noticed."""
    shades = np.array([lab(boat_color(number)) for number in range(boats)])
    distance = np.linalg.norm(shades[:, None] - shades[None], axis=2) + 1e3 * np.eye(boats)
    assert distance.min() > apart


def test_a_boat_that_joins_later_leaves_the_colours_of_others():
    assert boat_colors(["a", "b", "c"]) == {**boat_colors(["a", "b"]), "c": boat_color(2)}


def test_the_hue_of_a_hull_is_kept():
    red, green, blue = boat_color(0, (0.3, 0.0, 0.0))
    assert red > 200
    assert green == pytest.approx(blue, abs=1)
    assert green < red / 2


def test_curves_and_controllers_have_the_colours_of_boats():
    """Everywhere else a list of colours would be a second rule."""
    curves = [Series(f"c{i}", [0.0, 1.0], [0.0, float(i)]) for i in range(14)]
    drawn = re.findall("stroke: (#[0-9a-f]{6}); stroke-width: 1.5", chart_svg(Chart("t", "x", "y", tuple(curves))))
    assert drawn[:14] == [hex_color(boat_color(i)) for i in range(14)]
    sources = [file for file in (ROOT / "src").rglob("*") if file.suffix in {".py", ".js", ".j2"}]
    lists = re.compile(r"""(["']#[0-9a-f]{6}["'],\s*){5}""", re.IGNORECASE)
    assert [str(file) for file in sources if lists.search(file.read_text(encoding="utf-8"))] == []
