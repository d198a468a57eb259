"""The map of buoys: places, kinds, and what is forgotten."""

from collections import Counter

import pytest

from vrx_mj.control.buoy_map import FORGET, Buoy, BuoyMap, Cluster


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
    chart.see((0.0, 0.0), [], 9.0 + FORGET)
    assert [buoy.x for buoy in chart.buoys] == [pytest.approx(10.0)]


@pytest.mark.parametrize(
    ("votes", "kind"),
    [({}, ""), ({"red": 1}, ""), ({"red": 2}, "red"), ({"red": 2, "ball": 2}, ""), ({"red": 3, "ball": 2}, "red")],
)
def test_a_kind_needs_two_votes_and_the_most(votes, kind):
    assert Buoy(0.0, 0.0, votes=Counter(votes)).kind == kind
