"""Lidar returns: level, without the boat's own, and in groups."""

import math

import numpy as np
import pytest

from vrx_mj.control.buoy_map import Cluster, banks, clusters, grouped, leveled, standing_free

MOUNT = (np.array([0.7, 0.0, 1.8]), np.eye(3))


def yaw(angle):
    """(3, 3): a turn to port."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def test_a_return_ahead_of_a_boat_that_heads_north_lies_north():
    level = leveled([[10.0, 0.0, -1.0]], MOUNT, yaw(math.pi / 2), reach=50.0)
    np.testing.assert_allclose(level, [[0.0, 10.7, 0.8]], atol=1e-12)


def test_the_boat_itself_and_what_is_out_of_reach_are_left_out():
    own, far, kept = [-2.0, 1.0, -1.0], [60.0, 0.0, 0.0], [5.0, 5.0, 0.0]
    level = leveled([own, far, kept], MOUNT, np.eye(3), reach=50.0)
    np.testing.assert_allclose(level, [[5.7, 5.0, 1.8]])


def flooded(points):
    """Groups by comparing all with all, to check the fast ones: cells of half a metre that touch."""
    cells = [tuple(cell) for cell in np.floor(points[:, :2] / 0.5).astype(int)]
    left, groups = set(range(len(points))), []
    while left:
        group, waiting = set(), [left.pop()]
        while waiting:
            one = waiting.pop()
            group.add(one)
            near = {i for i in left if max(abs(cells[i][0] - cells[one][0]), abs(cells[i][1] - cells[one][1])) <= 1}
            left -= near
            waiting += near
        groups.append(frozenset(group))
    return set(groups)


@pytest.mark.parametrize("count", [1, 2, 30, 200])
def test_groups_are_those_of_a_flood_over_the_cells(count):
    points = np.random.default_rng(count).uniform(-8.0, 8.0, (count, 3))
    number = {tuple(point): row for row, point in enumerate(points)}
    found = {frozenset(number[tuple(point)] for point in group) for group in grouped(points)}
    assert found == flooded(points)


def test_a_cluster_has_the_middle_and_the_measures_of_its_returns():
    seen = np.array([[10.0, 5.0, 0.1], [10.3, 5.4, 0.9], [30.0, 0.0, 0.5], [10.1, 5.2, 9.0]])
    one, other = sorted(clusters(seen, high=3.5))
    assert one == Cluster(pytest.approx(10.15), pytest.approx(5.2), pytest.approx(0.5), 0.1, 0.9, 2)
    assert (other.x, other.y, other.returns, other.extent) == (30.0, 0.0, 1, 0.0)


def test_nothing_seen_is_no_cluster():
    assert clusters(np.empty((0, 3))) == []
    assert clusters(np.array([[5.0, 5.0, -9.0]])) == []


def test_a_stone_on_the_shore_does_not_stand_free_and_a_buoy_off_it_does():
    shore = np.stack([np.arange(0.0, 20.0, 0.3), np.zeros(67), np.full(67, 0.5)], axis=1)
    stone, buoy = np.array([[10.0, 2.0, 0.5]]), np.array([[10.0, 6.0, 0.5]])  # a circle about the shore has both
    free, wide = standing_free(np.concatenate([shore, stone, buoy]), widest=1.4, apart=3.0)
    assert [one.y for one in free] == [6.0]
    assert len(wide) == len(shore)
    free, wide = standing_free(np.concatenate([stone, buoy]), widest=1.4, apart=3.0)
    assert {one.y for one in free} == {2.0, 6.0}
    assert wide.shape == (0, 3)


def test_banks_are_near_and_out_of_the_water():
    seen = np.array([[5.0, 0.0, 0.2], [5.3, 0.1, 0.2], [9.0, 9.0, -1.0], [60.0, 0.0, 1.0]])
    assert banks(seen, (100.0, 0.0)) == [(105.0, 1.0)]
