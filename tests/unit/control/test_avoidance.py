"""Courses past buoys."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.control.guidance import clear_course


def passed(course, centre):
    """How near a straight course from the origin passes a place that lies ahead [m]."""
    return abs(centre[1] * math.cos(course) - centre[0] * math.sin(course))


def test_nothing_near_nothing_changed():
    assert clear_course((0.0, 0.0), 0.3, [((50.0, 15.0), 2.7)], reach=16.0) == 0.3
    assert clear_course((0.0, 0.0), 0.3, [], reach=16.0) == 0.3


def test_what_lies_behind_or_beside_is_no_matter():
    discs = [((-4.0, 0.0), 2.7), ((5.0, 6.0), 2.7)]
    assert clear_course((0.0, 0.0), 0.0, discs, reach=16.0) == pytest.approx(0.0)


@given(distance=st.floats(6.0, 15.0), bearing=st.floats(-0.4, 0.4), wanted=st.floats(-math.pi, math.pi))
def test_one_buoy_ahead_is_passed_at_its_distance_within_a_step(distance, bearing, wanted):
    centre = (distance * math.cos(wanted + bearing), distance * math.sin(wanted + bearing))
    course = clear_course((0.0, 0.0), wanted, [(centre, 2.7)], reach=16.0)
    assert passed(course, centre) > 2.7 - distance * math.radians(5.0)
    assert abs(math.remainder(course - wanted, math.tau)) < math.asin(2.7 / distance) + abs(bearing) + math.radians(
        10.0
    )


def test_the_side_chosen_before_is_kept():
    disc = [((8.0, 0.1), 2.7)]  # hardly nearer to port
    assert clear_course((0.0, 0.0), 0.0, disc, reach=16.0) < 0.0
    port = math.radians(20.0)
    assert clear_course((0.0, 0.0), 0.0, disc, reach=16.0, before=port) > 0.0


def test_between_two_buoys_there_is_a_way_if_they_leave_it():
    discs = [((8.0, 4.0), 2.7), ((8.0, -4.0), 2.7)]
    assert clear_course((0.0, 0.0), 0.0, discs, reach=16.0) == pytest.approx(0.0)
    shut = [((8.0, 2.0), 2.7), ((8.0, -2.0), 2.7)]
    assert abs(clear_course((0.0, 0.0), 0.0, shut, reach=16.0)) > 0.3
