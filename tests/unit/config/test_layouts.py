"""Layouts: where their boats are and where they head, in the fleet's frame."""

import math
from itertools import combinations
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.config.layouts import DENSITY, Layout, LayoutName, headings, spots

NAMES = get_args(LayoutName)


def places(name, count, seed=0, **changes):
    return spots(Layout(layout=name, **changes), count, seed)


def test_boat_i_of_a_circle_is_at_the_start_angle_and_i_parts_of_a_turn():
    ring = places("circle", 8, radius=5.0, start_angle=30.0)
    degrees = [30 + 360 * i / 8 for i in range(8)]
    assert ring == tuple(
        pytest.approx((5 * math.cos(math.radians(angle)), 5 * math.sin(math.radians(angle)))) for angle in degrees
    )


@pytest.mark.parametrize(
    ("name", "count", "expected"),
    [
        ("line", 1, [(0, 0)]),
        ("line", 3, [(0, 4), (0, 0), (0, -4)]),
        ("line", 4, [(0, 6), (0, 2), (0, -2), (0, -6)]),
        ("column", 3, [(4, 0), (0, 0), (-4, 0)]),
        ("column", 2, [(2, 0), (-2, 0)]),
        ("grid", 4, [(2, 2), (2, -2), (-2, 2), (-2, -2)]),
        ("grid", 5, [(2, 4), (2, 0), (2, -4), (-2, 2), (-2, -2)]),
        ("grid", 1, [(0, 0)]),
    ],
)
def test_rows_and_columns_are_in_these_places(name, count, expected):
    assert places(name, count, spacing=4.0) == tuple(expected)


def test_a_wedge_is_swept_back_by_45_degrees_port_first():
    d = 6 / math.sqrt(2)
    assert places("wedge", 5, spacing=6.0) == tuple(
        pytest.approx(place) for place in [(0, 0), (-d, d), (-d, -d), (-2 * d, 2 * d), (-2 * d, -2 * d)]
    )


@given(count=st.integers(1, 60), spacing=st.floats(0.5, 50.0), seed=st.integers(0, 1000))
@pytest.mark.parametrize("name", [name for name in NAMES if name != "circle"])
def test_no_two_boats_of_a_layout_are_nearer_than_its_spacing(name, count, spacing, seed):
    found = places(name, count, spacing=spacing, seed=seed)
    assert len(found) == count
    assert all(math.dist(a, b) >= spacing * (1 - 1e-9) for a, b in combinations(found, 2))  # sums are rounded


def test_random_boats_are_the_seed_s_and_lie_in_their_square():
    edge = 10.0 * math.sqrt(40 / DENSITY)
    first, again, other = (places("random", 40, seed=seed) for seed in (3, 3, 4))
    assert first == again != other
    assert all(abs(x) <= edge / 2 and abs(y) <= edge / 2 for x, y in first)
    assert max(abs(x) for x, _ in first) > 0.4 * edge  # the square is used
    assert all(abs(x) <= 25.0 for place in places("random", 5, size=50.0) for x in place)


def test_the_seed_of_a_layout_is_instead_of_the_world_s():
    assert places("random", 9, seed=5) == spots(Layout(layout="random", seed=5), 9, 3) != places("random", 9, seed=3)


def test_a_full_square_gives_fewer_places():
    assert 1 <= len(places("random", 50, size=20.0)) < 10


@pytest.mark.parametrize(
    ("heading", "name", "turns"),
    [
        ("outward", "circle", [0, 90, 180, 270]),
        ("inward", "circle", [180, 270, 0, 90]),
        ("tangent", "circle", [90, 180, 270, 0]),
        (None, "circle", [0, 90, 180, 270]),
        (None, "line", [0, 0, 0, 0]),
        (35.0, "grid", [35, 35, 35, 35]),
        ("outward", "line", [90, 90, -90, -90]),
    ],
)
def test_headings_are_a_word_s_or_a_number_s(heading, name, turns):
    layout = Layout(layout=name, heading=heading)
    for yaw, turn in zip(headings(layout, spots(layout, 4)), turns, strict=True):
        assert math.remainder(yaw - math.radians(turn), math.tau) == pytest.approx(0.0, abs=1e-9)


def test_random_boats_head_anywhere_by_their_seed():
    layout = Layout(layout="random")
    yaws = headings(layout, spots(layout, 40))
    assert yaws == headings(layout, spots(layout, 40)) != headings(layout, spots(layout, 40), seed=1)
    assert {int(yaw / (math.pi / 2)) for yaw in yaws} == {0, 1, 2, 3}
