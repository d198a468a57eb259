import math
from itertools import pairwise, permutations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from unit.control.test_allocation import LAYOUTS, summed
from vrx_mj.control.guidance import (
    Course,
    _charge,
    approach_speed,
    around,
    best_order,
    clear_course,
    clear_of,
    orbit,
    wrap_angle,
)
from vrx_mj.control.navigation import Estimate, beside, polar
from vrx_mj.control.velocity import WAMV, Allocation

places = st.tuples(st.floats(-50, 50), st.floats(-50, 50))


def test_near_its_place_a_boat_slows_down_in_proportion():
    assert approach_speed(0.5, 0.7, 0.5) == pytest.approx(0.35)


def test_far_off_it_goes_as_fast_as_it_can_brake():
    # closed form: braking evenly from v takes v^2 / 2a, down to the last a / rate^2, half of which is the rest
    assert approach_speed(20.0, 0.7, 0.5) == pytest.approx(math.sqrt(0.5 * (40.0 - 0.5 / 0.49)))


@given(distance=st.floats(0, 100), more=st.floats(1e-6, 1))
def test_further_off_is_never_slower_and_never_jumps(distance, more):
    near, far = approach_speed(distance, 0.7, 0.5), approach_speed(distance + more, 0.7, 0.5)
    assert near <= far <= near + 0.7 * more + 1e-9


@pytest.mark.parametrize(("sense", "north"), [(1.0, 1.0), (-1.0, -1.0)])
def test_on_the_circle_the_course_is_along_it(sense, north):
    assert orbit((5.0, 0.0), 5.0, sense, 3.0) == pytest.approx((0.0, north))


def test_a_width_outside_the_course_is_45_degrees_inward():
    assert orbit((8.0, 0.0), 5.0, 1.0, 3.0) == pytest.approx((-math.sqrt(0.5), math.sqrt(0.5)))


@given(offset=places, sense=st.sampled_from([1.0, -1.0]))
def test_a_course_is_a_unit_vector_that_turns_in_the_sense(offset, sense):
    assume(math.hypot(*offset) > 0.1)
    east, north = orbit(offset, 5.0, sense, 3.0)
    assert math.hypot(east, north) == pytest.approx(1.0)
    assert sense * (offset[0] * north - offset[1] * east) > 0.0


def test_a_free_way_is_straight():
    assert around((0, 0), (10, 0), [((5, 8), 3), ((-5, 0), 3), ((15, 0), 3)]) == (10, 0)


@given(y=st.floats(-2.9, 2.9))
def test_a_disc_in_the_way_is_passed_along_its_tangent_on_the_nearer_side(y):
    aim = around((0.0, 0.0), (20.0, 0.0), [((10.0, y), 3.0)])
    assert math.dist(aim, (10.0, y)) == pytest.approx(3.0)
    assert aim[0] * (aim[0] - 10.0) + aim[1] * (aim[1] - y) == pytest.approx(0.0, abs=1e-9)  # a right angle
    assert aim[1] * y <= 0.0


def test_who_is_inside_goes_straight_out():
    assert around((9.0, 0.0), (20.0, 0.0), [((10.0, 0.0), 3.0)]) == pytest.approx((6.0, 0.0))
    assert around((9.4, -0.8), (20.0, 0.0), [((10.0, 0.0), 3.0)]) == pytest.approx((9.4 - 1.8, -0.8 - 2.4))


def test_the_first_of_two_discs_counts():
    first, second = ((10.0, 1.0), 3.0), ((18.0, -1.0), 3.0)
    assert around((0, 0), (30, 0), [second, first]) == around((0, 0), (30, 0), [first])


@given(place=places)
def test_a_place_in_a_disc_is_put_at_its_rim(place):
    found = clear_of(place, [((0.0, 0.0), 4.0)])
    assert math.hypot(*found) >= 4.0 - 1e-9
    if math.hypot(*place) >= 4.0:
        assert found == place


def test_few_places_are_put_into_the_shortest_order():
    start, spots = (0.0, 0.0), [(30.0, 0.0), (10.0, 5.0), (20.0, -5.0), (-5.0, 0.0)]

    def length(order):
        way = [start, *(spots[number] for number in order)]
        return sum(math.dist(one, other) for one, other in pairwise(way))

    assert length(best_order(start, spots)) == min(length(order) for order in permutations(range(4)))


def test_many_places_are_all_visited_nearest_first():
    spots = [(float(number * 7 % 10), 0.0) for number in range(10)]
    order = best_order((-1.0, 0.0), spots)
    assert [spots[number][0] for number in order] == sorted(spot[0] for spot in spots)


@given(angle=st.floats(-100, 100))
def test_wrapped_is_within_half_a_turn(angle):
    assert abs(wrap_angle(angle)) <= math.pi
    assert math.cos(wrap_angle(angle)) == pytest.approx(math.cos(angle))


# Courses past buoys


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


@pytest.mark.parametrize(
    ("along", "across", "share"),
    [
        (1.0, 0.0, 1.0), (2.0, 0.0, 1.0), (2.0, -1.0, 0.5), (2.0, 2.0, 0.0), (10.0, 0.0, 0.575), (10.0, 0.5, 0.43125),
        (18.0, 0.0, 0.15), (30.0, 0.0, 0.15), (-1.0, 0.0, 0.0),
    ],
)  # fmt: skip
def test_a_disc_costs_most_through_its_middle_and_near_by(along, across, share):
    """Of 6 rad: all where it is touched, less in proportion to how far off it is, down to 15 % at the reach."""
    centre = beside((3.0, 4.0), 0.7, along, across)
    assert _charge((3.0, 4.0), 0.7, centre, 2.0, 16.0) == pytest.approx(6.0 * share, abs=1e-9)


@pytest.mark.parametrize(("gap", "course"), [(125, 125), (130, 130), (-130, -130), (135, 130), (-135, -130)])
def test_courses_up_to_130_degrees_off_are_tried_on_each_side(gap, course):
    """Buoys all around leave one gap."""
    bearings = [math.radians(gap + off) for off in range(20, 341, 16)]
    ring = [((8.0 * math.cos(bearing), 8.0 * math.sin(bearing)), 2.7) for bearing in bearings]
    assert math.degrees(clear_course((0.0, 0.0), 0.0, ring, reach=16.0)) == pytest.approx(course)


def test_between_two_buoys_there_is_a_way_if_they_leave_it():
    discs = [((8.0, 4.0), 2.7), ((8.0, -4.0), 2.7)]
    assert clear_course((0.0, 0.0), 0.0, discs, reach=16.0) == pytest.approx(0.0)
    shut = [((8.0, 2.0), 2.7), ((8.0, -2.0), 2.7)]
    assert abs(clear_course((0.0, 0.0), 0.0, shut, reach=16.0)) > 0.3


# Steering by the bow


ENGINES = LAYOUTS["T"]


@pytest.fixture
def course():
    return Course(ENGINES, WAMV, Allocation(ENGINES))


def seen(heading=0.0, velocity=(0.0, 0.0), x=0.0):
    return Estimate(x, 0.0, 0.0, heading, *velocity, 0.0, None)


@pytest.mark.parametrize(
    ("slide", "bow"),
    [(0.2, 0.2), (1.5, 1.5), (-1.5, -1.5), (1.7, 1.7 - math.pi), (-1.7, math.pi - 1.7), (3.0, 3.0 - math.pi)],
)
@pytest.mark.parametrize("heading", [0.4, -2.0])
def test_a_stopping_boat_points_its_nearer_end_to_where_it_slides(course, heading, slide, bow):
    turning = summed(ENGINES, course.sail(seen(heading), 0.0, 0.0, heading + bow))[2]
    sliding = course.sail(seen(heading, polar(0.31, heading + slide)), 0.0, 0.0, heading + 1.0)
    assert summed(ENGINES, sliding)[2] == pytest.approx(turning)
    assert turning * bow > 0.0
    slow = course.sail(seen(heading, polar(0.29, heading + slide)), 0.0, 0.0, heading + bow)
    assert summed(ENGINES, slow)[2] == pytest.approx(turning)


def test_a_bow_leans_against_what_the_velocity_is_off(course):
    wanted, velocity = (1.0, 0.2), (0.8, -0.1)
    turning = summed(ENGINES, course.sail(seen(), 0.0, 0.0, math.atan2(0.5, 1.2)))[2]
    assert summed(ENGINES, course.sail(seen(0.0, velocity), *wanted, 0.0))[2] == pytest.approx(turning)
    ahead, _, _ = summed(ENGINES, course.sail(seen(0.0, velocity), *wanted, 0.0))
    assert ahead == pytest.approx(WAMV.mass * 1.2 * (1.0 - 0.8) + WAMV.drag(1.0, 0.0)[0])


def test_a_boat_stays_within_half_a_length_of_its_place_and_goes_back_from_a_whole_one(course):
    going = []
    for lengths in (3.0, 0.51, 0.49, 0.99, 1.01, 0.51, 0.49):
        here = seen(x=-lengths * WAMV.length)
        commands = course.hold(here, 0.0, 0.0, 0.3, speed=0.5, braking=0.1)
        speed = min(0.5, approach_speed((lengths - 0.25) * WAMV.length, 0.5 * course._fastest, 0.1))
        going.append(commands == course.sail(here, speed, 0.0, 0.3))
        assert going[-1] != (commands == course.sail(here, 0.0, 0.0, 0.3))
    assert going == [True, True, False, False, True, True, False]
