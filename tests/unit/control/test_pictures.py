"""Colours and shapes in made pictures."""

import numpy as np
import pytest

from vrx_mj.control.buoy_map import Look, color_of, kind_of, look_at, project

WATER = (107, 138, 160)
SCALE = 30.0
"""[pixels/m]"""
PAINT = {  # of VRX's buoys, as bright as a camera shows them
    "red": (202, 1, 7),
    "orange": (253, 48, 0),
    "green": (16, 112, 66),
    "blue": (0, 0, 255),
    "yellow": (255, 255, 0),
    "white": (245, 245, 245),
    "black": (5, 5, 5),
}
MATRIX = np.array([[760.0, 0.0, 640.0], [0.0, 760.0, 360.0], [0.0, 0.0, 1.0]])


def sea(fog=0.0, light=1.0):
    """A picture of water that gets lighter toward the horizon, with noise."""
    rows = np.linspace(1.15, 0.75, 240)[:, None, None]
    rgb = light * rows * np.array(WATER) * np.ones((240, 320, 1))
    rgb += np.random.default_rng(0).normal(0.0, 2.0, rgb.shape)
    return np.clip((1.0 - fog) * rgb + fog * 178.0, 0, 255).astype(np.uint8)


def with_box(picture, color, *, width, height, fog=0.0, light=1.0, band=False):
    """The same with a box [m] in its middle."""
    half, tall = round(width * SCALE / 2), round(height * SCALE / 2)
    paint = (1.0 - fog) * light * np.array(PAINT[color]) + fog * 178.0
    picture[120 - tall : 120 + tall, 160 - half : 160 + half] = paint.astype(np.uint8)
    if band:
        picture[118:122, 160 - half : 160 + half] = np.array([230, 230, 230])
    return picture


@pytest.mark.parametrize("color", PAINT)
def test_a_colour_is_told_in_light_in_the_dark_and_in_fog(color):
    for fog, light in ((0.0, 1.0), (0.0, 0.45), (0.35, 1.0)):
        picture = with_box(sea(fog, light), color, width=0.4, height=0.9, fog=fog, light=light, band=color != "black")
        look = look_at(picture, 160.0, 120.0, SCALE)
        assert look is not None, (color, fog, light)
        assert look.color == color, (fog, light)


def test_the_measures_are_those_of_what_stands_out():
    look = look_at(with_box(sea(), "red", width=0.6, height=1.0), 160.0, 120.0, SCALE)
    assert look.width == pytest.approx(0.6, abs=2.0 / SCALE)
    assert look.height == pytest.approx(1.0, abs=2.0 / SCALE)


def test_water_and_what_the_edge_cuts_off_are_nothing():
    assert look_at(sea(), 160.0, 120.0, SCALE) is None
    assert look_at(with_box(sea(), "red", width=0.6, height=1.0), 5.0, 120.0, SCALE) is None
    assert look_at(with_box(sea(), "red", width=0.6, height=5.0), 160.0, 120.0, SCALE) is None


def test_most_of_the_coloured_pixels_decide():
    pixels = [PAINT["red"]] * 6 + [PAINT["white"]] * 4
    assert color_of(pixels, [WATER] * 10) == "red"


def test_what_is_nearly_black_has_no_hue():
    assert color_of([(26, 2, 2)] * 4, [WATER] * 4) == "red"
    assert color_of([(24, 2, 2)] * 4, [WATER] * 4) == "black"


@pytest.mark.parametrize(
    ("look", "kind"),
    [
        (Look("red", 0.65, 0.9), "red"),
        (Look("black", 0.65, 0.9), "black"),
        (Look("black", 0.5, 0.4), "ball"),
        (Look("black", 0.69, 0.59), "ball"),  # polyform a5
        (Look("orange", 0.5, 0.4), "ball"),
        (Look("green", 0.6, 0.3), ""),
        (Look("red", 3.0, 1.0), ""),
    ],
)
def test_balls_are_told_from_markers_by_their_shape(look, kind):
    assert kind_of(look) == kind


def test_what_lies_to_port_and_low_is_left_and_below_in_the_picture():
    mount = (np.array([0.75, 0.0, 1.5]), np.eye(3))
    column, row, ahead = project(np.array([10.75, 2.0, 0.5]), mount, np.eye(3), MATRIX)
    assert (column, row, ahead) == (pytest.approx(640.0 - 760.0 * 0.2), pytest.approx(360.0 + 76.0), 10.0)
    assert project(np.array([-5.0, 0.0, 0.0]), mount, np.eye(3), MATRIX) is None
