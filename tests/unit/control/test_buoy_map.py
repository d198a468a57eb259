"""The map of buoys: places, kinds, and what is forgotten."""

import math
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.control.buoy_map import (
    FORGET_TIME,
    Buoy,
    BuoyMap,
    Cluster,
    Lookout,
    banks,
    connected_groups,
    level_points,
    standing_free,
)
from vrx_mj.control.navigation import Estimate
from vrx_mj.control.pilot import Moment


def cluster(x, y, extent=0.4, top=0.9):
    """A buoy as the lidar sees it."""
    return Cluster(x, y, extent, 0.1, top, 5)


def test_a_buoy_seen_from_two_places_is_one():
    chart = BuoyMap()
    chart.see((0.0, 0.0), [cluster(10.0, 0.0)], 0.0)
    assert chart.sure == []
    chart.see((4.0, 0.0), [cluster(6.2, 0.1)], 1.0)
    (buoy,) = chart.sure
    assert buoy.seen == 2
    assert (buoy.x, buoy.y) == (pytest.approx(10.08), pytest.approx(0.04))


def test_what_is_wide_or_high_is_no_buoy():
    chart = BuoyMap()
    chart.see((0.0, 0.0), [cluster(10.0, 0.0, extent=5.0), cluster(20.0, 0.0, top=3.0)], 0.0)
    assert chart.buoys == []


def test_two_buoys_side_by_side_stay_two():
    chart = BuoyMap()
    for time in range(3):
        chart.see((0.0, 0.0), [cluster(10.0, 0.0), cluster(10.0, 4.0)], float(time))
    assert [round(buoy.y) for buoy in chart.sure] == [0, 4]


def test_what_was_seen_once_is_forgotten_and_what_was_seen_often_is_not():
    chart = BuoyMap()
    for time in range(8):
        chart.see((0.0, 0.0), [cluster(10.0, 0.0)], float(time))
    chart.see((0.0, 0.0), [cluster(40.0, 0.0)], 8.0)
    chart.see((0.0, 0.0), [], 9.0 + FORGET_TIME)
    assert [buoy.x for buoy in chart.buoys] == [pytest.approx(10.0)]


@pytest.mark.parametrize(
    ("votes", "kind"),
    [({}, ""), ({"red": 1}, ""), ({"red": 2}, "red"), ({"red": 2, "ball": 2}, ""), ({"red": 3, "ball": 2}, "red")],
)
def test_a_kind_needs_two_votes_and_the_most(votes, kind):
    assert Buoy(0.0, 0.0, votes=Counter(votes)).kind == kind


# Lidar returns: level, without the boat's own, and in groups


MOUNT = (np.array([0.7, 0.0, 1.8]), np.eye(3))


def yaw(angle):
    """(3, 3): a turn to port."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def test_a_return_ahead_of_a_boat_that_heads_north_lies_north():
    level = level_points([[10.0, 0.0, -1.0]], MOUNT, yaw(math.pi / 2), reach=50.0)
    np.testing.assert_allclose(level, [[0.0, 10.7, 0.8]], atol=1e-12)


def test_the_boat_itself_and_what_is_out_of_reach_are_left_out():
    own, far, kept = [-2.0, 1.0, -1.0], [60.0, 0.0, 0.0], [5.0, 5.0, 0.0]
    level = level_points([own, far, kept], MOUNT, np.eye(3), reach=50.0)
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
    found = {frozenset(number[tuple(point)] for point in group) for group in connected_groups(points)}
    assert found == flooded(points)


def test_a_cluster_has_the_middle_and_the_measures_of_its_returns():
    seen = np.array([[10.0, 5.0, 0.1], [10.3, 5.4, 0.9], [30.0, 0.0, 0.5], [10.1, 5.2, 9.0]])
    one, other = sorted(standing_free(seen, widest=math.inf, apart=0.0)[0])
    assert one == Cluster(pytest.approx(10.15), pytest.approx(5.2), pytest.approx(0.5), 0.1, 0.9, 2)
    assert (other.x, other.y, other.returns, other.extent) == (30.0, 0.0, 1, 0.0)


def test_nothing_seen_is_no_cluster():
    assert standing_free(np.empty((0, 3)), widest=math.inf, apart=0.0)[0] == []
    assert standing_free(np.array([[5.0, 5.0, -9.0]]), widest=math.inf, apart=0.0)[0] == []


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


def test_only_looks_from_near_by_count_for_what_they_do_not_tell():
    """Grey boxes at 12 and 35 m, which are of no kind."""
    box = np.stack(np.meshgrid((-0.1, 0.1), (-0.1, 0.1), (-1.2, -0.8)), axis=-1).reshape(-1, 3)
    data = SimpleNamespace(
        points=(box + np.array([[[12.0, 0.0, 0.0]], [[35.0, 3.0, 0.0]]])).reshape(-1, 3),
        rgb=np.full((720, 1280, 3), 120, np.uint8),
        info=SimpleNamespace(K=(760.0, 0.0, 640.0, 0.0, 760.0, 360.0, 0.0, 0.0, 1.0)),
    )
    reading = SimpleNamespace(data=data, mount=SimpleNamespace(position=np.array([0.0, 0.0, 1.5]), rotation=np.eye(3)))
    boat, seen = SimpleNamespace(sensors={"lidar": reading, "front": reading}), Estimate(*[0.0] * 7, np.eye(3))
    lookout = Lookout()
    assert [lookout.look(Moment(boat, seen, None, t)) for t in (0.0, 0.5, 1.0, 2.0)] == [True, False, True, True]
    found = sorted((round(buoy.x), buoy.seen, buoy.looks, buoy.kind) for buoy in lookout.map.sure)
    assert found == [(12, 3, 2, ""), (35, 3, 0, "")]  # of two looks since they are sure
