"""Placards: panels among lidar returns, symbols and lamps in made pictures."""

import math

import numpy as np
import pytest

from vrx_mj.control.placards import OFF, Face, FaceMap, _fill, faces, lamp_color, sequence, symbol_in

RGB = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "yellow": (1, 1, 0)}


def panel(x, y, facing, width=2.0, low=0.5, high=3.2):
    """Returns of an upright panel, (n, 3) [m]."""
    across, up = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.5, 0.5, 21) * width, np.linspace(low, high, 6)))
    return np.stack([x - across * math.sin(facing), y + across * math.cos(facing), up], axis=1)


@pytest.mark.parametrize("facing", [math.pi, 2.5, -2.8])
def test_a_panel_is_found_with_its_place_and_the_side_it_shows(facing):
    (face,) = faces(panel(12.0, 1.0, facing))
    assert face.place == pytest.approx((12.0, 1.0))
    assert math.remainder(face.facing - facing, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_of_two_panels_back_to_back_the_one_in_front_is_found_also_from_the_side():
    facing = math.pi + 0.7
    back = (12.0 - 1.1 * math.cos(facing), 1.0 - 1.1 * math.sin(facing))
    edge = panel(*back, facing)
    edge = edge[edge[:, 1] < back[1] - 0.6]  # what the one in front does not hide
    (face,) = faces(np.concatenate([panel(12.0, 1.0, facing), edge]))
    assert face.place == pytest.approx((12.0, 1.0), abs=0.05)
    assert math.remainder(face.facing - facing, math.tau) == pytest.approx(0.0, abs=0.02)


def test_neither_narrow_nor_wide_nor_high_nor_low_nor_thick_things_are_panels():
    block = np.concatenate([panel(12.0 + depth, 0.0, math.pi) for depth in np.linspace(0.0, 1.5, 8)])
    for other in (
        panel(12.0, 0.0, math.pi, width=1.0),
        panel(12.0, 0.0, math.pi, width=4.0),
        panel(12.0, 0.0, math.pi, high=6.0),
        panel(12.0, 0.0, math.pi, high=1.4),
        block,
    ):
        assert faces(other) == []


def test_the_two_sides_of_a_panel_are_two_faces():
    chart = FaceMap()
    chart.see((0.0, 0.0), faces(panel(12.0, 0.0, math.pi)))
    chart.see((24.0, 0.0), faces(panel(-11.0, 0.0, 0.0)))
    chart.see((2.0, 0.0), faces(panel(10.2, 0.0, math.pi)))
    assert [(round(face.x, 2), face.seen) for face in chart.faces] == [(12.06, 2), (13.0, 1)]


def test_before_a_face_and_back_again():
    face = Face(3.0, 4.0, 2.0)
    assert face.offset(*face.ahead(5.0, -1.5)) == pytest.approx((5.0, -1.5))
    assert face.offset(*face.ahead(5.0)) == pytest.approx((5.0, 0.0))
    assert math.dist(face.ahead(5.0), face.place) == pytest.approx(5.0)


def symbol(color, shape, size, *, light=0.9, lean=1.0, fog=0.0):
    """A grey placard with a symbol, `size` pixels high, seen at an angle that narrows it by `lean`."""
    width = round(2.0 * size * lean)
    v, u = np.mgrid[-size : size + 1, -width : width + 1].astype(float)
    u /= lean
    half = size / 2.0
    inside = {
        "circle": u**2 + v**2 <= half**2,
        "rectangle": (abs(u) <= half) & (abs(v) <= 0.75 * half),
        "cross": ((abs(u) <= half) & (abs(v) <= half / 3)) | ((abs(v) <= half) & (abs(u) <= half / 3)),
        "triangle": (v <= half) & (v >= -0.732 * half) & (abs(u) <= (v + 0.732 * half) / math.sqrt(3.0)),
    }[shape]
    rgb = np.full((*inside.shape, 3), 150.0 * light)
    rgb[inside] = np.array(RGB[color]) * 255.0 * light
    rgb += np.random.default_rng(1).normal(0.0, 1.5, rgb.shape)
    return np.clip((1.0 - fog) * rgb + fog * 178.0, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("shape", ["circle", "rectangle", "cross", "triangle"])
@pytest.mark.parametrize("color", RGB)
def test_every_symbol_is_read_from_afar_and_from_the_side(color, shape):
    for size, lean, light in ((16, 1.0, 0.9), (60, 1.0, 0.35), (40, 0.6, 0.9)):
        assert symbol_in(symbol(color, shape, size, light=light, lean=lean)) == f"{color}_{shape}"


def test_an_empty_placard_has_no_symbol():
    assert symbol_in(np.full((60, 40, 3), 150, np.uint8)) == ""


@pytest.mark.parametrize("color", RGB)
def test_a_lamp_is_lit_or_off(color):
    window = np.full((56, 14, 3), (120, 150, 170), np.uint8)
    assert lamp_color(window) == OFF
    window[36:40, 5:9] = np.array(RGB["yellow"]) * 180  # the box below the lamps
    assert lamp_color(window) == OFF
    for lamp in (4, 12, 20):  # waves lift the boat
        lit = window.copy()
        lit[lamp : lamp + 8, 6:9] = np.array(RGB[color]) * 230
        assert lamp_color(lit) == color


def blinking(colors, *, period=0.4, start=0.0, length=12.0):
    """Looks at a light buoy: a second each, then two of dark."""
    times = np.arange(start, start + length, period)
    return [(float(time), [*colors, OFF, OFF][int(time % 5.0)]) for time in times]


@pytest.mark.parametrize("start", [0.0, 0.7, 1.9, 2.6, 3.5, 4.9])
def test_the_colours_are_read_whenever_one_begins_to_look(start):
    assert sequence(blinking(["red", "green", "red"], start=start)) == ["red", "green", "red"]


def test_no_colours_before_both_darks_were_seen():
    looks = blinking(["red", "green", "blue"], length=2.9)
    assert sequence(looks) is None
    assert sequence([]) is None
    assert sequence([(time, OFF) for time, _ in looks]) is None


@pytest.mark.parametrize("lean", [0.0, 0.3, -0.15])
@pytest.mark.parametrize("side", [12, 40])
def test_an_upright_or_leaning_rectangle_fills_the_parallelogram_about_it(side, lean):
    v, u = np.mgrid[: 2 * side, : 2 * side]
    shifted = u - np.round(lean * v).astype(int) - side // 2
    mask = (shifted >= 0) & (shifted < side) & (abs(v - side) <= side // 2)
    assert _fill(mask) == pytest.approx(1.0, abs=0.0 if lean == 0.0 else 1.5 / side)
