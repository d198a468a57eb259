"""Gates from buoys: red right returning, pairs, order, and where to go through."""

import math
from itertools import pairwise
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.control.channel import Channel, Gymkhana, gate_of, next_gate, opening, pair_buoys, side_of, wall

COURSES = {  # red and partner of each gate in order: VRX's short_navigation_course1, navigation_phase2_3, short..._5
    "short": [((0, 12), (0, 0)), ((-20, 0), (-10, -10)), ((-34, -6), (-36, -18)), ((-44, 4), (-58, 4))],
    "bend": [
        ((0, 0), (0, -15)),
        ((-20, 15), (-20, 0)),
        ((-25, 30), (-40, 30)),
        ((-20, 45), (-20, 60)),
        ((0, 60), (0, 75)),
    ],
    "long": [
        *[((0, 18), (0, 0)), ((-30, 8), (-30, -12)), ((-60, 0), (-60, -16)), ((-90, 12), (-103, 0))],
        *[((-140, 0), (-140, -20)), ((-180, -10), (-170, -30)), ((-199, -70), (-180, -55))],
        *[((-148, -83), (-145, -60)), ((-102, -77), (-108, -58))],
    ],
}


def test_red_is_to_starboard_of_who_crosses():
    gate = gate_of((5.0, 0.0), (-5.0, 0.0))  # red in the east: northward
    assert gate.middle == (0.0, 0.0)
    assert gate.width == 10.0
    assert gate.course == pytest.approx(math.pi / 2)


@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(5, 30), st.floats(-math.pi, math.pi))
def test_wherever_a_gate_is_red_lies_a_quarter_turn_to_starboard_of_its_course(x, y, width, angle):
    red = (x + width * math.cos(angle), y + width * math.sin(angle))
    gate = gate_of(red, (x, y))
    to_red = math.atan2(red[1] - gate.middle[1], red[0] - gate.middle[0])
    assert math.remainder(to_red - gate.course, math.tau) == pytest.approx(-math.pi / 2, abs=1e-6)


@pytest.mark.parametrize("course", COURSES.values(), ids=COURSES)
def test_pairs_and_their_order_are_those_of_the_course(course):
    wanted = [gate_of(red, partner) for red, partner in course]
    found = pair_buoys([red for red, _ in course], [partner for _, partner in reversed(course)])
    assert set(found) == set(wanted)
    for here, after in pairwise(wanted):
        left = [gate for gate in wanted if wanted.index(gate) > wanted.index(here)]
        assert next_gate(here.middle, here.course, left) == after


def test_neither_a_pair_too_far_apart_nor_one_too_near_is_a_gate():
    assert pair_buoys([(0.0, 0.0)], [(40.0, 0.0)]) == []
    assert pair_buoys([(0.0, 0.0)], [(3.0, 0.0)]) == []
    assert pair_buoys([(0.0, 0.0)], []) == []
    assert next_gate((0.0, 0.0), 0.0, []) is None


def test_a_third_buoy_is_left_over_and_those_left_over_pair_up():
    gates = pair_buoys([(0.0, 0.0), (0.0, 10.0)], [(12.0, 1.0), (12.0, 14.0), (30.0, 5.0)])
    assert {(gate.red, gate.partner) for gate in gates} == {((0.0, 0.0), (12.0, 1.0)), ((0.0, 10.0), (12.0, 14.0))}


def test_the_opening_is_the_middle_or_beside_what_lies_in_it():
    gate = gate_of((0.0, 12.0), (0.0, 0.0))  # westward, as VRX's navigation_course2
    assert opening(gate, [(0.0, 12.0), (0.0, 0.0), (-20.0, 6.0)], 2.7) == ((0.0, 6.0), 6.0)
    place, room = opening(gate, [(0.0, 12.0), (0.0, 0.0), (0.0, 8.0)], 2.7)
    assert place == pytest.approx((0.0, 4.0))
    assert room == pytest.approx(4.0)
    narrow = gate_of((0.0, 5.5), (0.0, 0.0))
    assert opening(narrow, [], 2.7) == ((0.0, 2.75), 2.75)


def test_a_wall_is_as_long_as_its_gate_and_has_no_holes():
    places = wall(gate_of((0.0, 12.0), (0.0, 0.0)))
    assert {places[0], places[-1]} == {(0.0, 12.0), (0.0, 0.0)}
    assert max(math.dist(*pair) for pair in pairwise(places)) <= 2.0


@pytest.mark.parametrize(("place", "side"), [((-1.0, 3.0), "after"), ((1.0, 3.0), "before"), ((1.0, 13.0), "")])
def test_a_place_is_before_or_after_a_gate_or_outside(place, side):
    assert side_of(gate_of((0.0, 12.0), (0.0, 0.0)), place) == side  # westward


@pytest.mark.parametrize(
    ("task", "far", "order"),
    [
        ({"goal": {"x": 30, "y": 0}}, 30, "channel"),
        ({"channel": {"state": "running"}, "goal": {"x": 30, "y": 0}}, 30, "channel"),
        ({"channel": {"state": "finished"}}, 30, "channel"),
        ({"channel": {"state": "finished"}, "goal": {"x": 30, "y": 0}}, 30, ("go", (30, 0))),
        ({"channel": {"state": "finished"}, "goal": {"x": 30, "y": 0}}, 3, ("hold", (30, 0))),
    ],
)
def test_a_gymkhana_goes_on_to_its_goal_after_the_channel_and_holds_it(task, far, order, monkeypatch):
    parts = {
        "lookout": SimpleNamespace(look=lambda *_, **__: None),
        "pilot": SimpleNamespace(hold=lambda seen, t, *place_and_heading: ("hold", place_and_heading[:2])),
        "go": lambda _, now, place: ("go", place),
    }
    boat = type("Boat", (Gymkhana,), {**parts, "begin": lambda _: None})()
    monkeypatch.setattr(Channel, "steer", lambda *_: "channel")
    assert boat.steer((None, SimpleNamespace(to=lambda *_: (far, 0.0), heading=0.0), task, 0.0)) == order
