"""Formations: places, who takes which, and the velocities that lead there and past each other."""

import math
from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.control.formation import (
    CLOSING_SPEED,
    SHAPES,
    WAITING_LAG,
    YIELD_RATE,
    BoatLeader,
    Formation,
    PathLeader,
    apart_velocity,
    assignment,
    pursuit,
    slots,
)
from vrx_mj.control.guidance import Spot, Track, round_corners
from vrx_mj.control.navigation import Estimate
from vrx_mj.errors import UnknownNameError, VrxError

D = 6.0 / math.sqrt(2.0)
PLACES = st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=1, max_size=5)


def boat(x=0.0, y=0.0, heading=0.0, vx=0.0, vy=0.0):
    return Estimate(x, y, 0.0, heading, vx, vy, 0.0, np.eye(3))


# Slots


@pytest.mark.parametrize(
    ("shape", "n", "expected"),
    [
        ("column", 3, [(0, 0), (-6, 0), (-12, 0)]),
        ("line", 3, [(0, 0), (0, 6), (0, -6)]),
        ("line", 4, [(0, 3), (0, -3), (0, 9), (0, -9)]),
        ("wedge", 5, [(0, 0), (-D, D), (-D, -D), (-2 * D, 2 * D), (-2 * D, -2 * D)]),
        ("grid", 5, [(0, 0), (0, 6), (0, -6), (-6, 3), (-6, -3)]),
        ("circle", 4, [(D, 0), (0, D), (-D, 0), (0, -D)]),
        ("circle", 1, [(0, 0)]),
        ("wedge", 1, [(0, 0)]),
    ],
)
def test_slots_are_counted_from_the_front_to_the_back_and_outwards_port_first(shape, n, expected):
    assert slots(shape, n, 6.0) == [pytest.approx(place, abs=1e-9) for place in expected]


@given(n=st.integers(1, 40), spacing=st.floats(1.0, 50.0))
@pytest.mark.parametrize("shape", SHAPES)
def test_neighbours_are_a_spacing_apart(shape, n, spacing):
    found = slots(shape, n, spacing)
    gaps = [math.dist(a, b) for a, b in combinations(found, 2)]
    assert len(found) == n
    assert min(gaps, default=spacing) >= spacing * (1 - 1e-9)  # sums are rounded
    if shape != "random":
        assert min(gaps, default=spacing) == pytest.approx(spacing)
    if shape != "circle":
        assert max(ahead for ahead, _ in found) == 0.0


@given(places=PLACES, data=st.data())
def test_boats_take_the_places_that_are_nearest_all_in_all(places, data):
    goals = data.draw(st.permutations([(y - 1.0, 2.0 * x) for x, y in places]))
    order = assignment(places, goals)
    ways = [
        math.fsum(math.dist(place, goals[k]) for place, k in zip(places, way, strict=True))
        for way in permutations(range(len(goals)))
    ]
    assert sorted(order) == list(range(len(goals)))
    taken = math.fsum(math.dist(place, goals[k]) for place, k in zip(places, order, strict=True))
    assert taken == pytest.approx(min(ways))


# Velocities


def test_a_boat_in_its_slot_wants_the_slot_s_velocity():
    slot = Spot(3.0, 4.0, math.pi / 2, 0.02, -10.0)  # on the outer side of a turn of 50 m
    assert pursuit(boat(3.0, 4.0), slot, 1.5) == pytest.approx((0.0, 1.5 * 60 / 50))


@given(x=st.floats(-100, 100), y=st.floats(-100, 100))
def test_seen_from_the_slot_a_boat_comes_straight_at_it_and_not_too_fast(x, y):
    vx, vy = pursuit(boat(x, y), Spot(0.0, 0.0, 0.0, 0.0, 0.0), 1.0)
    vx -= 1.0  # of the slot
    assert math.hypot(vx, vy) < CLOSING_SPEED
    assert vx * x + vy * y == pytest.approx(-math.hypot(vx, vy) * math.hypot(x, y))


def test_far_from_others_nothing_is_taken_of_a_velocity():
    assert apart_velocity(boat(), (1.4, 0.3), [boat(40.0, 0.0)], 7.0) == (1.4, 0.3)


@given(
    wanted=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    x=st.floats(-12, 12).filter(lambda x: abs(x) > 0.1),
    y=st.floats(-12, 12),
    vx=st.floats(-2, 2),
)
def test_what_is_kept_of_a_velocity_does_not_lead_into_another_boat(wanted, x, y, vx):
    other = boat(x, y, vx=vx)
    kept = apart_velocity(boat(), wanted, [other], 7.0)
    distance = math.hypot(x, y)
    closing = ((kept[0] - vx) * x + kept[1] * y) / distance
    assert closing <= max(YIELD_RATE * (distance - 7.0), ((wanted[0] - vx) * x + wanted[1] * y) / distance) + 1e-9
    assert kept == wanted or closing == pytest.approx(YIELD_RATE * (distance - 7.0), abs=1e-9)


def test_boats_that_meet_head_on_both_go_to_starboard():
    a, b = boat(0.0, 0.0, vx=1.0), boat(8.0, 0.0, heading=math.pi, vx=-1.0)
    assert apart_velocity(a, (1.0, 0.0), [b], 7.0)[1] < -0.1
    assert apart_velocity(b, (-1.0, 0.0), [a], 7.0)[1] > 0.1


# Tracks and leaders


def test_rounded_corners_are_arcs_of_the_radius():
    track = Track(round_corners([(0, 0), (40, 0), (40, 60)], 10.0))
    assert track.length == pytest.approx(30 + 5 * math.pi + 50, abs=0.01)  # its chords are 0.5 m
    middle = track.spot(30 + 2.5 * math.pi, left=2.0)
    assert math.hypot(middle.x - 30, middle.y - 10) == pytest.approx(8.0, abs=0.01)
    assert middle.direction == pytest.approx(math.pi / 4, abs=0.03)  # that of a chord of 4 m
    assert middle.curvature == pytest.approx(0.1, rel=0.03)
    assert middle.pace(1.0) == pytest.approx(0.8, abs=0.01)


def test_a_short_leg_makes_the_arc_smaller_and_a_straight_corner_none():
    assert round_corners([(0, 0), (4, 0), (4, 50)], 10.0)[1] == pytest.approx((2.0, 0.0))
    assert round_corners([(0, 0), (4, 0), (50, 0)], 10.0) == [(0, 0), (4, 0), (50, 0)]


def test_a_track_goes_on_straight_at_both_ends():
    track = Track([(1, 1), (1, 1), (1, 5)])
    assert track.length == 4.0
    for along, place in ((-3.0, (1, -2)), (2.0, (1, 3)), (9.0, (1, 10))):
        spot = track.spot(along)
        assert (spot.x, spot.y, spot.direction, spot.curvature) == pytest.approx((*place, math.pi / 2, 0.0))


def test_a_virtual_leader_goes_slower_for_boats_that_are_behind_and_waits():
    leader = PathLeader([(0, 0), (100, 0)], 2.0, 10.0)
    speeds = []
    for t, lag in enumerate((0.0, 0.0, WAITING_LAG / 2, WAITING_LAG, 2 * WAITING_LAG, -5.0)):
        leader.move({}, float(t), lag)
        speeds.append(leader.speed)
    assert speeds == [2.0, 2.0, 1.0, 0.0, 0.0, 2.0]
    assert leader.along == 5.0
    leader.move({}, 100.0, 0.0)
    assert (leader.along, leader.speed, leader.has_arrived) == (100.0, 0.0, True)


def test_a_boat_that_leads_lays_the_track_of_the_others():
    leader = BoatLeader("first")
    for t in range(101):
        angle = t / 50.0
        leader.move({"first": boat(10 * math.sin(angle), 10 - 10 * math.cos(angle), angle, 1.0)}, t / 10, 0.0)
    behind = leader.track.spot(leader.along - 10.0)
    assert math.hypot(behind.x, behind.y - 10.0) == pytest.approx(10.0, abs=0.1)
    assert leader.along - 2.0 == pytest.approx(20.0, abs=0.3)  # the track begins 2 m behind it
    with pytest.raises(UnknownNameError) as caught:
        leader.move({"other": boat()}, 11.0, 0.0)
    assert str(caught.value) == "no boat named 'first'; known: other"


def led(places, heading=0.0):
    """A leader that was at places, called ten times a second."""
    leader = BoatLeader("first")
    for number, (x, y) in enumerate(places):
        leader.move({"first": boat(x, y, heading)}, number / 10, 0.0)
    return leader


@pytest.mark.parametrize("course", [0.6, math.pi / 2, -math.pi / 2, 1.9])
def test_a_track_follows_the_course_over_ground_whatever_the_heading(course):
    leader = led([(0.1 * i * math.cos(course), 0.1 * i * math.sin(course)) for i in range(301)])
    assert leader.speed == pytest.approx(1.0, abs=1e-3)
    for behind in (0.0, 10.0, 20.0):
        spot = leader.track.spot(leader.along - behind)
        assert (spot.x, spot.y) == pytest.approx(
            ((30 - behind) * math.cos(course), (30 - behind) * math.sin(course)), abs=0.6
        )  # to a step
        assert spot.direction == pytest.approx(course, abs=0.05)


@pytest.mark.parametrize(
    ("vx", "vy"),
    [
        (0.0, 0.2),  # nearly at rest, as in a wind
        (-1.0, 0.0),  # astern
        (-0.9, 0.3),
        (0.0, 0.0),
    ],
)
def test_at_rest_and_astern_the_places_are_carried_along_with_the_leader(vx, vy):
    leader = led([(0.1 * i * vx, 0.1 * i * vy) for i in range(301)])
    assert (leader.speed, leader.drift) == (0.0, pytest.approx((vx, vy), abs=1e-3))
    spot = leader.track.spot(leader.along - 10.0, left=3.0)
    assert (spot.x, spot.y, spot.direction) == pytest.approx((30 * vx - 10.0, 30 * vy + 3.0, 0.0), abs=0.6)


def test_a_slot_that_is_carried_along_is_pursued_with_its_drift():
    assert pursuit(boat(3.0, 4.0), Spot(3.0, 4.0, 1.0, 0.0, 0.0), 0.0, drift=(0.2, -0.1)) == (0.2, -0.1)


# Wrong arguments

WAY = [(0.0, 0.0), (50.0, 0.0)]
EITHER = "expected either a path of 2 points or more, or a leader, got a path of "


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"path": WAY, "shape": "triangle"}, f"no shape named 'triangle'; known: {', '.join(SHAPES)}"),
        ({"path": WAY, "spacing": 7.0}, "invalid spacing 7 m: more than the 7 m that boats keep apart is needed"),
        (
            {"path": WAY, "spacing": math.nan},
            "invalid spacing nan m: more than the 7 m that boats keep apart is needed",
        ),
        (
            {},
            EITHER + "0 points and no leader",
        ),
        (
            {"path": WAY, "leader": "a"},
            EITHER + "2 points and the leader 'a'",
        ),
        (
            {"path": [(1.0, 2.0), (1.0, 2.0)]},
            "path: its 2 points are all at (1.0, 2.0); at least two must differ",
        ),
        ({"path": WAY, "speed": 0.0}, "invalid speed 0 m/s: a number above 0 is needed"),
        ({"path": WAY, "radius": -1.0}, "invalid radius -1 m: a number of 0 or more is needed"),
    ],
)
def test_what_makes_no_formation_is_refused(arguments, message):
    with pytest.raises(VrxError) as caught:
        Formation(**arguments)
    assert str(caught.value) == message


def test_a_change_that_cannot_be_is_refused_and_changes_nothing():
    formation = Formation(WAY)
    for shape, spacing, message in (
        ("star", None, f"no shape named 'star'; known: {', '.join(SHAPES)}"),
        ("line", 5.0, "invalid spacing 5 m: more than the 7 m that boats keep apart is needed"),
    ):
        with pytest.raises(VrxError) as caught:
            formation.change(shape, spacing)
        assert str(caught.value) == message
    assert (formation.shape, formation.spacing) == ("wedge", 12.0)
    formation.change("line")
    assert (formation.shape, formation.spacing) == ("line", 12.0)
    formation.reset(0)
    assert formation.shape == "wedge"


# How far boats are off


def looked(formation, seen, monkeypatch):
    """One call of a formation for boats whose estimates are given, without their helms."""
    formation.muster = lambda _boats, _t: seen
    formation._helms = dict.fromkeys(seen)
    monkeypatch.setattr(Formation, "_steer", lambda *_: {})
    formation(seen, 0.0)
    return formation.off, formation.off_shape


@given(turn=st.floats(-math.pi, math.pi))
@pytest.mark.parametrize("shape", ["wedge", "column", "line", "circle"])
def test_a_leader_that_turns_on_the_spot_breaks_the_shape_and_moves_no_slot(shape, turn):
    """The chord of the turn: a place r from the leader moves by 2 r sin(turn / 2)."""
    with pytest.MonkeyPatch.context() as patch:
        formation = Formation(leader="a", shape=shape, spacing=12.0)
        first, *places = slots(shape, 4, 12.0)
        places = [(ahead - first[0], left - first[1]) for ahead, left in places]
        others = {name: boat(100.0 + x, -50.0 + y) for name, (x, y) in zip("bcd", places, strict=True)}
        off, off_shape = looked(formation, {"a": boat(100.0, -50.0), **others}, patch)
        assert [*off.values(), *off_shape.values()] == pytest.approx([0.0] * 6, abs=1e-9)
        off, off_shape = looked(formation, {"a": boat(100.0, -50.0, turn), **others}, patch)
        assert [*off.values()] == pytest.approx([0.0] * 3, abs=1e-9)
        chords = {
            name: 2.0 * math.hypot(*place) * abs(math.sin(turn / 2)) for name, place in zip("bcd", places, strict=True)
        }
        assert off_shape == pytest.approx(chords, abs=1e-9)


@given(along=st.floats(0.0, 60.0))
@pytest.mark.parametrize("shape", ["wedge", "line", "circle"])
def test_behind_a_virtual_leader_both_errors_are_distances_from_slots_where_its_way_is_straight(shape, along):
    with pytest.MonkeyPatch.context() as patch:
        formation = Formation([(0, 0), (300, 0)], shape=shape, spacing=12.0)
        formation.leader.along = along
        seen = {name: boat(5.0 * i, 9.0 * i) for i, name in enumerate("abcd")}
        off, off_shape = looked(formation, seen, patch)
        assert off_shape == pytest.approx(off, abs=1e-9)
        places = slots(shape, 4, 12.0)
        offs = {name: math.dist(seen[name].place, (along + places[number][0], places[number][1]))
                for name, number in formation.places.items()}  # fmt: skip
        assert off == pytest.approx(offs, abs=1e-9)
