"""A window may be too wide, never too narrow: whatever point of a hull is looked at, its ray is in the window."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.sensors import rays as module
from vrx_mj.sensors.rays import angles, sample_window, turns, window

COORDINATE = st.floats(-20, 20).map(lambda metres: round(metres, 9))  # squares of less than a nanometre may be 0
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)
HULL = st.lists(POINT, min_size=3, max_size=8)
TURNS = st.sampled_from([-1, 0, 1])


def grid(rings, samples, elevation, azimuth, reach):
    """The rays of a lidar with these, within its limits or not."""
    config = SimpleNamespace(rings=rings, samples=samples, elevation=elevation, azimuth=azimuth, range=reach)
    return module.grid(config)


def inside(rays, corners, ring, sample):
    lowest, highest, azimuth, half = window(rays, corners)
    first, last = turns(rays, azimuth, half)
    spans = [sample_window(rays, azimuth, half, turn) for turn in range(first, last + 1)]
    return lowest <= ring <= highest and any(begin <= sample <= end for begin, end in spans)


@given(hull=HULL, shares=st.lists(st.floats(0, 1), min_size=8, max_size=8), turn=TURNS, step=st.floats(-0.3, 0.3))
def test_a_ray_at_any_point_of_a_hull_is_in_its_window(hull, shares, turn, step):
    corners, weights = np.array(hull), np.array(shares[: len(hull)]) + 1e-3
    x, y, z = weights / weights.sum() @ corners
    elevation, azimuth = math.atan2(z, math.hypot(x, y)), math.atan2(y, x) + 2 * math.pi * turn
    rise = 0.02 if elevation < 0 else -0.02  # the other rings are nearer the horizon
    levels, courses = (elevation, elevation + 5 * rise), (azimuth - 7 * step, azimuth + 3 * step)
    rays = grid(6, 11, levels, courses, (0.0, 1e3))[0]
    assert inside(rays, corners, 0, 7)


@given(hull=HULL)
def test_what_begins_beyond_the_range_or_ends_before_it_has_an_empty_window(hull):
    corners = np.array(hull)
    everywhere = {"elevation": (-1.5, 1.5), "azimuth": (-3.1, 3.1)}
    beyond = corners + np.array([200.0, 0.0, 0.0])
    first, last, *_ = window(grid(40, 90, reach=(0.1, 100.0), **everywhere)[0], beyond)
    assert last < first
    first, last, *_ = window(grid(40, 90, reach=(40.0, 100.0), **everywhere)[0], corners)
    assert last < first


def test_what_is_straight_above_may_be_in_all_samples():
    rays = grid(16, 90, (-1.5, 1.5), (-math.pi, math.pi), (0.1, 130.0))[0]
    assert window(rays, np.array([(0.0, 0.0, 2.0), (0.0, 0.0, 5.0)]))[3] == math.inf


def test_a_small_box_ahead_has_a_small_window():
    corners = np.array([(10.0 + x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    rays = grid(16, 1875, (math.radians(-15), math.radians(15)), (-math.pi, math.pi), (0.1, 130.0))[0]
    lowest, highest, azimuth, half = window(rays, corners)
    assert (lowest, highest) == (6, 9)  # -3 to 3 degrees: its near edges are at 3.01
    assert azimuth == pytest.approx(0.0, abs=1e-9)
    assert half == pytest.approx(math.atan2(0.5, 9.5), abs=2e-6)
    begin, end = sample_window(rays, azimuth, half, 0)
    seen = angles(rays["azimuth"], 1875)[begin : end + 1]
    assert len(seen) == 31
    assert np.abs(seen).max() <= half


def test_a_box_astern_is_seen_by_the_first_and_the_last_samples():
    corners = np.array([(-10.0 + x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    rays = grid(1, 1875, (0.0, 0.0), (-math.pi, math.pi), (0.1, 130.0))[0]
    _, _, azimuth, half = window(rays, corners)
    first, last = turns(rays, azimuth, half)
    seen = [sample_window(rays, azimuth, half, turn) for turn in range(first, last + 1)]
    assert sorted(seen) == [(0, 15), (1859, 1874)]


@pytest.mark.parametrize("corner", [(0.0, 0.0, 5.0), (1e-9, 0.0, 5.0)])
def test_a_hull_with_a_corner_overhead_is_looked_for_all_round(corner):
    corners = np.array([corner, (1.0, 0.0, 5.0), (0.0, 1.0, 5.0)])
    assert window(grid(4, 9, (0.0, 1.5), (-3.0, 3.0), (0.1, 9.0))[0], corners)[3] == math.inf
