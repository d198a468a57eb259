"""Docking: what is looked for where, and the law along a bay's axis, without a simulator."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.control import Channel, Docking
from vrx_mj.control.acoustics import SEARCH_TIME, Roam
from vrx_mj.control.buoy_map import Buoy, cutout
from vrx_mj.control.channel import gate_of
from vrx_mj.control.docking import BAY_SPEED, BERTH, COMMIT, LINE_UP, STAY_TIME
from vrx_mj.control.navigation import Estimate
from vrx_mj.control.pilot import Moment
from vrx_mj.control.placards import Face, Tower

BAY = Face(0.0, 0.0, 0.0, seen=9)
"""It looks east; the boat comes from there."""


def estimate(x, y, heading=math.pi):
    """A boat at rest in calm water."""
    cos, sin = math.cos(heading), math.sin(heading)
    turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Estimate(x, y, 0.0, heading, 0.0, 0.0, 0.0, turned)


def moment(t, *where):
    return Moment(None, estimate(*where), {}, t)


class Log:
    """A pilot that says what it is asked for."""

    top_speed = 2.26

    def sail(self, seen, t, vx, vy, heading, **_):
        return {"vx": vx, "vy": vy, "heading": heading}


@pytest.fixture
def docking():
    controller = Docking()
    controller._pilot, controller._bay = Log(), BAY
    return controller


def test_in_line_the_boat_goes_in_slowly_with_its_bow_first(docking):
    asked = docking._along(BAY, moment(0.0, 12.0, 0.1), BERTH)
    assert asked["vx"] == -BAY_SPEED
    assert asked["vy"] == pytest.approx(-0.07)
    assert abs(asked["heading"]) == pytest.approx(math.pi)


def test_out_of_line_it_waits_before_the_bay_and_inside_it_goes_on(docking):
    assert docking._along(BAY, moment(0.0, 11.0, 1.0), BERTH)["vx"] == 0.0
    assert docking._along(BAY, moment(0.0, 11.0, 0.0, math.pi - 0.3), BERTH)["vx"] == 0.0
    assert docking._along(BAY, moment(0.0, COMMIT - 0.1, 1.0), BERTH)["vx"] == -BAY_SPEED


def test_it_lines_up_goes_in_stays_and_backs_out(docking):
    docking._stage = "line up"
    docking._dock(moment(0.0, LINE_UP + 20.0, 3.0))
    assert docking._stage == "line up"
    docking._dock(moment(1.0, LINE_UP, 0.5))
    assert docking._stage == "in"
    docking._dock(moment(20.0, BERTH + 0.2, 0.0))
    assert docking._stage == "stay"
    docking._dock(moment(20.0 + STAY_TIME, BERTH, 0.0))
    assert docking._stage == "stay"
    assert docking._dock(moment(20.1 + STAY_TIME, BERTH, 0.0))["vx"] == BAY_SPEED
    assert docking._stage == "out"


@pytest.mark.parametrize(
    ("task", "colors", "right"),
    [
        ({"symbol": "red_cross"}, None, 0),
        ({"symbol": "blue_circle"}, ["red", "green", "blue"], 1),  # what the task says counts
        ({}, ["red", "green", "blue"], 0),  # first colour, and a cross by the third
        ({}, ["red", "green", "yellow"], None),
        ({}, None, None),
    ],
)
def test_the_bay_is_the_one_with_the_symbol_of_the_task_or_of_the_lights(docking, task, colors, right):
    signs = [Face(0.0, 6.0 * row, 0.0, seen=9) for row in range(2)]
    for face, symbol in zip(signs, ("red_cross", "blue_circle"), strict=True):
        face.note(symbol)
        assert face.symbol == ""
        face.note(symbol)
    docking.lookout._map.faces = signs
    docking._colors = colors
    assert docking._right_bay(task) is (None if right is None else signs[right])


def test_a_tower_seen_lit_comes_first_and_one_behind_the_start_last(docking):
    docking._roam = Roam((0.0, 0.0), 0.0, 0.0)
    near, far, behind = Tower((20.0, 0.0), seen=9), Tower((50.0, 5.0), seen=9), Tower((-10.0, 0.0), seen=9)
    docking.lookout._towers = [behind, far, near]
    assert docking._tower(estimate(0.0, 0.0)) is near
    far.colors = {"red", "blue"}
    assert docking._tower(estimate(0.0, 0.0)) is far
    near.rejected = far.rejected = True
    assert docking._tower(estimate(0.0, 0.0)) is None


def test_the_time_is_counted_that_is_spent_near_a_face_without_reading_it(docking):
    docking._roam = Roam((60.0, 0.0), math.pi, 0.0)
    face = Face(0.0, 0.0, 0.0, seen=9)
    docking.lookout._map.faces = [face]
    for t, x in ((100.0, 50.0), (100.5, 50.0), (100.9, 50.0), (105.0, 50.0), (105.5, 70.0), (106.0, 50.0)):
        docking._explore(moment(t, x, 0.0))
    assert face.tried == pytest.approx(1.4)  # not while it was elsewhere, nor 4 s of which nothing was seen


def test_a_search_goes_on_when_it_is_there_or_has_tried_for_long():
    roam = Roam((10.0, 0.0), math.pi / 2, 0.0)
    first = roam.next(estimate(10.0, 0.0), 0.0)
    assert first == pytest.approx((10.0, 50.0))
    second = roam.next(estimate(*first), 20.0)
    assert second == pytest.approx((10.0, 100.0))
    assert roam.next(estimate(10.0, 60.0), 21.0 + SEARCH_TIME) != second
    assert roam.may_be_course((10.0, 30.0), 60.0)
    assert not roam.may_be_course((10.0, 90.0), 60.0)
    assert not roam.may_be_course((10.0, -30.0), 60.0)


def test_a_cutout_is_about_its_place_and_whole():
    picture = np.zeros((720, 1280, 3), np.uint8)
    picture[360, 640] = 255
    matrix = (760.0, 0.0, 640.0, 0.0, 760.0, 360.0, 0.0, 0.0, 1.0)
    info = SimpleNamespace(K=matrix)
    mount = SimpleNamespace(position=np.array([0.7, 0.0, 1.5]), rotation=np.eye(3))
    reading = SimpleNamespace(data=SimpleNamespace(rgb=picture, info=info), mount=mount)
    seen = estimate(0.0, 0.0, 0.0)
    window = cutout(reading, seen, (10.7, 0.0, 1.5), (0.5, 0.25))
    assert window.shape == (39, 77, 3)
    assert window[19, 38, 0] == 255
    assert cutout(reading, seen, (10.7, 8.3, 1.5), (0.5, 0.25)) is None
    assert cutout(reading, seen, (-5.0, 0.0, 1.5), (0.5, 0.25)) is None


# The channel


def channel(*buoys, done=()):
    """A controller that began at the origin, eastward, and knows these buoys: x, y and kind."""
    controller = Channel()
    controller._pilot = Log()
    controller._start, controller._since = ((0.0, 0.0), 0.0), 0.0
    controller._done = list(done)
    for x, y, kind in buoys:
        buoy = Buoy(x, y, seen=9)
        buoy.votes.update([kind] * 3 if kind else [])
        controller.lookout.map.buoys.append(buoy)
    return controller


def test_the_entry_is_the_gate_with_a_white_buoy_and_any_other_after_a_while():
    nearer = [(20.0, -5.0, "red"), (20.0, 5.0, "green")]
    entry = [(45.0, -5.0, "red"), (45.0, 5.0, "white")]
    assert channel(*nearer, *entry)._choose(1.0).middle == (45.0, 0.0)
    assert channel(*nearer)._choose(1.0) is None
    assert channel(*nearer)._choose(30.0).middle == (20.0, 0.0)


def test_a_gate_is_not_taken_while_something_unknown_or_a_red_buoy_alone_lies_nearer():
    done = [gate_of((10.0, -5.0), (10.0, 5.0))]
    after = [(60.0, -5.0, "red"), (60.0, 5.0, "green")]
    assert channel(*after, done=done)._choose(1.0).middle == (60.0, 0.0)
    assert channel(*after, (30.0, 4.0, ""), done=done)._choose(1.0) is None
    assert channel(*after, (25.0, -9.0, "red"), done=done)._choose(1.0) is None
    assert channel(*after, (30.0, 4.0, "ball"), done=done)._choose(1.0).middle == (60.0, 0.0)
    stones = [(30.0 + 2.0 * row, 14.0, "") for row in range(5)]
    assert channel(*after, *stones, done=done)._choose(1.0).middle == (60.0, 0.0)


def test_a_chart_is_followed_gate_by_gate():
    places = [({"x": 20.0, "y": -5.0}, {"x": 20.0, "y": 5.0}), ({"x": 40.0, "y": -5.0}, {"x": 40.0, "y": 5.0})]
    controller = Channel(chart=places)
    controller._pilot, controller._start, controller._since = Log(), ((0.0, 0.0), 0.0), 0.0
    gate = controller._choose(1.0)
    assert gate.middle == (20.0, 0.0)
    controller._note(moment(1.0, 19.9, 0.0, 0.0))
    controller._note(moment(1.1, 20.1, 0.0, 0.0))
    assert controller._done == [gate]
    assert controller._choose(1.2).middle == (40.0, 0.0)


def test_who_is_behind_a_gate_goes_around_it():
    controller = channel((20.0, -6.0, "red"), (20.0, 6.0, "white"))
    gate = controller._choose(1.0)
    asked = controller._cross(gate, moment(1.0, 24.0, 0.0, 0.0))
    assert abs(math.atan2(asked["vy"], asked["vx"])) > 0.0
    assert not -2.0 < math.atan2(asked["vy"], asked["vx"]) + math.pi < 0.5  # not back through it
    before = controller._cross(gate, moment(1.0, 5.0, 1.0, 0.0))
    assert math.atan2(before["vy"], before["vx"]) == pytest.approx(math.atan2(-1.0, 22.0), abs=0.01)
