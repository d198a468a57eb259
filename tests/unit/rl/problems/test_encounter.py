"""Roles and scores by the rules of the road: by hand, on made-up places."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.rl.problems import encounter
from vrx_mj.rl.problems.encounter import GIVE_WAY, HEAD_ON, OVERTAKEN, OVERTAKING, STAND_ON

NORTH = math.pi / 2


def met(other_x, other_y, other_yaw):
    """Bearings and headings of one at the origin, heading north, and another one."""
    x, y, yaw = (np.array([[0.0, other_x]]), np.array([[0.0, other_y]]), np.array([[NORTH, other_yaw]]))
    return encounter.bearings(x, y, yaw), yaw


@pytest.mark.parametrize(
    ("roles", "place", "course", "by"),
    [
        ([HEAD_ON] * 2, (9, -1), -NORTH, True),  # abaft the beam of both
        ([HEAD_ON] * 2, (9, 1), -NORTH, False),
        ([GIVE_WAY, STAND_ON], (-9, -1), math.pi, True),  # it has crossed ahead, and is west and south
        ([GIVE_WAY, STAND_ON], (9, -1), math.pi, False),  # it is still to cross
        ([OVERTAKING, OVERTAKEN], (9, -1), NORTH, True),
        ([OVERTAKING, OVERTAKEN], (9, 1), NORTH, False),
    ],
)
def test_when_two_have_gone_by(roles, place, course, by):
    x, y, courses = np.array([[0.0, place[0]]]), np.array([[0.0, place[1]]]), np.array([[NORTH, course]])
    assert encounter.gone_by(np.array([roles]), x, y, courses).tolist() == [by]
    assert encounter.gone_by(np.array([roles[::-1]]), x[:, ::-1], y[:, ::-1], courses[:, ::-1]).tolist() == [by]


@pytest.mark.parametrize(
    ("place", "yaw", "expected"),
    [
        ((0, 40), -NORTH, [HEAD_ON, HEAD_ON]),
        ((5, 40), -NORTH - math.radians(10), [HEAD_ON, HEAD_ON]),
        ((0.1, 40), -NORTH + math.radians(20), [GIVE_WAY, GIVE_WAY]),  # not nearly reciprocal, both to starboard
        ((30, 30), math.pi, [GIVE_WAY, STAND_ON]),  # from starboard, heading west
        ((-30, 30), 0.0, [STAND_ON, GIVE_WAY]),  # from port, heading east
        ((0, 20), NORTH, [OVERTAKING, OVERTAKEN]),
        ((0, -20), NORTH, [OVERTAKEN, OVERTAKING]),
        ((-5, -20), -NORTH, [STAND_ON, STAND_ON]),  # stern to stern, each to port of the other: nobody overtakes
        ((20 * math.sin(math.radians(113)), 20 * math.cos(math.radians(113))), NORTH, [OVERTAKEN, OVERTAKING]),
    ],
)  # fmt: skip
def test_who_gives_way(place, yaw, expected):
    bearing, yaws = met(*place, yaw)
    assert encounter.roles(bearing, yaws).tolist() == [expected]


@pytest.mark.parametrize(
    ("degrees", "overtaken"), [(113, True), (112, False), (-113, True), (-112, False), (180, True)]
)
def test_the_stern_sector_begins_at_22_5_degrees_abaft_the_beam(degrees, overtaken):
    """Rule 13 (b); the other one, 60 degrees off our course, has us before its own beam."""
    bearing = np.array([[math.radians(degrees), math.radians(-20)]])
    yaw = np.array([[0.0, 0.5]])
    assert (encounter.roles(bearing, yaw).tolist() == [[OVERTAKEN, OVERTAKING]]) is overtaken


def test_bearings_are_positive_to_port():
    bearing, _ = met(-10, 10, -NORTH)
    np.testing.assert_allclose(bearing, np.radians([[45, 45]]))


def test_roles_do_not_depend_on_the_order():
    random = np.random.default_rng(4)
    x, y, yaw = (random.uniform(low, high, (2000, 2)) for low, high in ((-50, 50), (-50, 50), (-3, 3)))
    one = encounter.roles(encounter.bearings(x, y, yaw), yaw)
    x, y, yaw = x[:, ::-1], y[:, ::-1], yaw[:, ::-1]
    np.testing.assert_array_equal(one, encounter.roles(encounter.bearings(x, y, yaw), yaw)[:, ::-1])
    assert set(one.ravel().tolist()) == set(range(5))


def test_the_closest_approach_is_that_of_a_fine_search():
    random = np.random.default_rng(1)
    x, y = random.uniform(-50, 50, (2, 30, 2))
    east, north = random.uniform(-2, 2, (2, 30, 2))
    time, distance = encounter.approach(x, y, east, north)
    ahead = np.linspace(0, 400, 40_001)[:, None]
    gaps = np.hypot(np.diff(x).T + ahead * np.diff(east).T, np.diff(y).T + ahead * np.diff(north).T)
    inside = time < 399
    assert inside.sum() > 20
    np.testing.assert_allclose(distance[inside], gaps.min(axis=0)[inside], atol=0.03)  # steps of 10 ms at up to 5.7 m/s
    np.testing.assert_allclose(time[inside], ahead[gaps.argmin(axis=0), 0][inside], atol=6e-3)


def test_who_stands_still_to_each_other_is_as_near_as_it_gets():
    np.testing.assert_array_equal(
        encounter.approach(*np.array([[[0.0, 3.0]], [[0.0, 4.0]], [[1.0, 1.0]], [[2.0, 2.0]]])), [[0], [5]]
    )


PORT, STARBOARD = np.array([[NORTH, NORTH]]), np.array([[-NORTH, -NORTH]])


@pytest.mark.parametrize(
    ("role", "bearing", "expected"),
    [
        (HEAD_ON, PORT, 1.0),
        (HEAD_ON, STARBOARD, 0.0),
        (HEAD_ON, np.zeros((1, 2)), 1 / 16),
        (GIVE_WAY, np.array([[0.3, math.pi]]), 1.0),  # right astern of the other
        (GIVE_WAY, np.array([[0.3, 0.0]]), 0.0),  # right ahead
        (GIVE_WAY, np.array([[0.3, NORTH]]), 0.5),
        (OVERTAKING, STARBOARD, 1.0),
        (OVERTAKING, PORT, 1.0),
        (STAND_ON, PORT, 0.7),
        (OVERTAKEN, PORT, 0.7),
    ],
)
def test_how_they_pass(role, bearing, expected):
    score = encounter.pose_score(np.full((1, 2), role), bearing, np.full((1, 2), 0.7))
    assert score[0, 0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("distance", "expected"), [(3, 0), (6, 0), (10.5, 0.5), (15, 1), (99, 1)])
def test_the_range_counts_up_to_what_is_wanted(distance, expected):
    assert encounter.range_score(np.array([distance]), 6.0, 15.0)[0] == pytest.approx(expected)


def test_to_stand_on_is_to_keep_course_and_speed():
    turn, speed = np.radians([0, 15, -15, 0, 0, 60]), np.array([2.0, 2.0, 2.0, 1.0, 3.0, 2.0])
    np.testing.assert_allclose(encounter.departure(turn, speed, np.full(6, 2.0)), [0, 0.5, 0.5, 0.5, 0.5, 1])


def test_boats_that_cross_come_from_either_side_and_all_meet_at_the_same_time():
    problem, sides, yaws, angles = encounter.Encounter(SimpleNamespace(n=1, boats="ab", world=None)), [], [], []
    for seed in range(200):
        x, y, yaw, speed = np.array(problem.start(0, np.random.default_rng(seed))).T[:, None]
        angles.append(math.degrees(math.remainder(yaw[0, 1] - yaw[0, 0], math.tau)))
        yaws.append(yaw[0, 0])
        seconds, between = np.hypot(x, y) / speed, abs(angles[-1])
        assert seconds[0, 1] == pytest.approx(seconds[0, 0])
        roles = encounter.roles(encounter.bearings(x, y, yaw), yaw).tolist()[0]
        if between < 10.0:
            assert sorted(roles) == sorted((OVERTAKEN, OVERTAKING))
        elif between > 175.0:
            assert roles == [HEAD_ON] * 2
        else:
            assert 50.0 <= between <= 130.0
            sides.append(roles.index(GIVE_WAY))
    assert 0.3 < np.mean(sides) < 0.7
    assert abs(np.mean(np.exp(1j * np.array(yaws)))) < 0.15  # on any course: 200 draws are within 0.15 in 98 of 100
    ahead, meeting = (np.remainder(np.array(angles) + half, 360.0) - half for half in (180.0, 0.0))
    for off, most in ((ahead[np.abs(ahead) < 45.0], 10.0), (meeting[np.abs(meeting - 180.0) < 45.0] - 180.0, 5.0)):
        assert -most <= off.min() < -0.7 * most
        assert 0.7 * most < off.max() <= most
