"""What the problems of the Gymnasium environments reward: by hand, on made-up places."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.config.docks import Bay
from vrx_mj.frames import compose, quaternion
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.model.world import tree_of
from vrx_mj.rl.problem import Team, open_water, pose_error, team_of, wrap_angle
from vrx_mj.rl.problems.courses import FollowPath, StationKeeping, Wayfinding
from vrx_mj.rl.problems.docking import Docking, _place_of
from vrx_mj.tasks.courses import pose_error as scored_error
from vrx_mj.tasks.referee import Pose


@pytest.fixture(scope="module")
def sea():
    return compile_world(open_water(), fleet={"sensors": "none"})


@pytest.fixture(scope="module")
def docks():
    return compile_world(Docking.world, fleet={"sensors": "none"})


GOING = np.ones(1, bool)


def at(x, y, yaw):
    """One world with one boat, at rest."""
    x, y, yaw = (np.array([[value]], float) for value in (x, y, yaw))
    return Team(x, y, yaw, np.zeros((1, 1, 7)), np.zeros((1, 1, 9)), np.ones((1, 1), bool))


def problem_of(kind, world):
    return kind(SimpleNamespace(n=1, boats=("wamv",), world=world))


def begun(kind, world, *, seed=1):
    problem = problem_of(kind, world)
    ((*start, _),) = problem.start(0, np.random.default_rng(seed))
    problem.begin(np.ones((1, 1), bool), at(*start))
    return problem, start


@pytest.mark.parametrize(("x", "y", "yaw"), [(0, 0, 0), (3, -4, 3.0), (-20, 1, -3.1), (0.3, 0.1, 1.6)])
def test_the_error_of_a_pose_is_that_of_the_scorer(x, y, yaw):
    goal = SimpleNamespace(x=1.0, y=-2.0, yaw=0.4)
    ours = pose_error(at(x, y, yaw), *(np.array([[value]]) for value in (goal.x, goal.y, goal.yaw)))
    assert ours[0, 0] == pytest.approx(scored_error(Pose(x, y, 0.0, quaternion(0.0, 0.0, yaw)), goal), abs=1e-12)


def test_angles_fold():
    np.testing.assert_allclose(
        wrap_angle(np.array([0.0, 3.5, -3.5, 7.0])), [0, 3.5 - math.tau, math.tau - 3.5, 7 - math.tau]
    )


def test_what_is_seen_is_in_body_axes():
    """Heading north, rolled to starboard by 0.2: air that goes north goes ahead."""
    yaw, roll = math.pi / 2, 0.2
    cr, sr, cy, sy = math.cos(roll / 2), math.sin(roll / 2), math.cos(yaw / 2), math.sin(yaw / 2)
    features = np.array([[[4, 5, 0, cr * cy, sr * cy, sr * sy, cr * sy, 1, 2, 3, 0.1, 0.2, 0.3]]], float)
    seen = team_of(features, np.array([[0.5, 6.0]]), np.ones((1, 1), bool))
    np.testing.assert_allclose(seen.own[0, 0], [1, 2, 0.3, roll, 0, 0.1, 0.2, 6, -0.5], atol=1e-12)
    np.testing.assert_allclose(seen.yaw, yaw)
    np.testing.assert_allclose(seen.toward(np.array([4.0]), np.array([8.0])), [[[3]], [[0]]], atol=1e-12)


def test_station_keeping_loses_by_the_error(sea):
    problem, _ = begun(StationKeeping, sea)
    ahead, port, *near, sine, cosine = problem.observe(at(0, 0, 0))[0, 0]
    assert near == [ahead, port]  # the same, in smaller units
    there = at(ahead, port, math.atan2(sine, cosine))
    assert problem.judge(there, GOING).own[0, 0] == pytest.approx(0, abs=1e-12)
    away = at(ahead + 2, port, math.atan2(sine, cosine))
    assert problem.judge(away, GOING).own[0, 0] == pytest.approx(-0.2)
    assert problem.facts()["mean_pose_error"][0, 0] == pytest.approx(1.0)


def test_wayfinding_gains_what_it_comes_nearer_and_goes_on(sea):
    problem, start = begun(Wayfinding, sea)
    first = problem._points[0, 0]
    error = pose_error(at(*start), *first[:, None, None])[0, 0]
    judged = problem.judge(at(*first), GOING)
    assert judged.own[0, 0] == pytest.approx(0.1 * error + 5)
    assert not judged.ended[0, 0]
    for point in problem._points[0, 1:]:
        judged = problem.judge(at(*point), GOING)
    assert judged.ended[0, 0]
    assert problem.facts()["reached"][0, 0] == 3


def test_after_a_waypoint_the_way_to_the_next_one_counts(sea):
    problem, _ = begun(Wayfinding, sea)
    first, second = problem._points[0, :2]
    problem.judge(at(*first), GOING)
    error = pose_error(at(*first), *second[:, None, None])[0, 0]
    assert problem.facts()["pose_error"][0, 0] == pytest.approx(error)
    assert problem.judge(at(*first), GOING).own[0, 0] == pytest.approx(0, abs=1e-12)  # it came no nearer


def gate(problem, number, along, aside):
    x, y, course = problem._points[0, number]
    return at(x + along * math.cos(course) - aside * math.sin(course),
              y + along * math.sin(course) + aside * math.cos(course), course)  # fmt: skip


def test_gates_are_passed_between_their_ends_only(sea):
    problem, _ = begun(FollowPath, sea)
    rewards = []
    for number, aside in enumerate((0.0, 4.9, 5.1, -4.9, -5.1, 0.0)):
        problem.judge(gate(problem, number, -0.3, aside), GOING)
        rewards.append(problem.judge(gate(problem, number, 0.3, aside), GOING).own[0, 0])
    assert (problem.facts()["passed"][0, 0], problem.facts()["missed"][0, 0]) == (4, 2)
    assert [round(reward) for reward in rewards] == [2, 3, -2, 2, -2, 2]
    assert problem.judge(gate(problem, problem.count - 1, 1.0, 0.0), GOING).ended[0, 0]


@pytest.mark.parametrize(("before", "after", "passed"), [(4.0, 7.0, False), (7.0, 4.0, False), (4.0, 5.9, True)])
def test_what_counts_is_where_the_line_between_the_ends_is_crossed(sea, before, after, passed):
    """Half way between two places, a gate 10 m wide is crossed up to 5 m beside its middle."""
    problem, _ = begun(FollowPath, sea)
    problem.judge(gate(problem, 0, -0.3, before), GOING)
    problem.judge(gate(problem, 0, 0.3, after), GOING)
    assert problem.facts()["passed"][0, 0] == passed


def test_a_path_may_lead_anywhere(sea):
    headings = [begun(FollowPath, sea, seed=seed)[1][2] for seed in range(64)]
    assert np.histogram(headings, 4, (-math.pi, math.pi))[0].min() > 8  # of 16


def test_backwards_through_a_gate_is_nothing(sea):
    problem, _ = begun(FollowPath, sea)
    problem.judge(gate(problem, 0, 0.3, 8.0), GOING)
    assert problem.facts()["missed"][0, 0] == 1  # it went round: that crossed the line's continuation
    other, _ = begun(FollowPath, sea)
    other._along[:] = 0.5
    other.judge(gate(other, 0, -0.5, 0.0), GOING)
    assert (other.facts()["passed"][0, 0], other.facts()["missed"][0, 0]) == (0, 0)


def test_the_ends_of_a_gate_are_port_and_starboard(sea):
    problem, _ = begun(FollowPath, sea)
    ahead, left, starboard_ahead, right = problem.observe(gate(problem, 0, -7.0, 0.0))[0, 0, :4]
    np.testing.assert_allclose([ahead, left, starboard_ahead, right], [7, 5, 7, -5], atol=1e-9)


def test_docking_is_to_stay_inside_bow_in(docks):
    problem, start = begun(Docking, docks)
    x, y, inward, depth, width, mouth = problem._goal[0]
    assert problem.episode_facts()["bay"].tolist() == [[x, y, inward]]
    assert (2 * depth, 2 * width, mouth) == pytest.approx(
        (4.0, 1.5, 2.5)
    )  # VRX's dock_2022, bays 4 m wide and 6 m deep
    assert 8 <= math.hypot(start[0] - x, start[1] - y) - mouth <= 19
    cost = problem._cost[0, 0]
    assert problem.judge(at(x, y, inward), GOING).own[0, 0] == pytest.approx(0.1 * cost + 0.1)
    done = [bool(problem.judge(at(x, y, inward), GOING).ended[0, 0]) for _ in range(29)]
    assert done == [False] * 28 + [True]
    assert not problem.judge(at(x, y, inward + math.pi), GOING).ended[0, 0]
    assert not problem.facts()["inside"][0, 0]


@pytest.mark.parametrize("opens", [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_bay_is_as_deep_and_wide_whichever_way_it_opens(opens, docks):
    """One of 6 by 4 m: the zone inside is two thirds of its depth, up to 0.5 m from its mouth, and 1.5 m wide."""
    (dock,), last = docks.parameters.docks, (11, 7) if opens[0] else (7, 11)
    dock = replace(dock, pose=(0.0,) * 6, block=0.5)
    x, y, inward, *sizes = _place_of(Bay((0, 0), last, opens), dock)
    assert sizes == pytest.approx([2.0, 0.75, 2.5])
    assert (math.cos(inward), math.sin(inward)) == pytest.approx((-opens[0], -opens[1]))
    assert (x, y) == pytest.approx([0.25 * end + 0.5 * way for end, way in zip(last, opens, strict=True)])


def test_bays_turn_with_their_dock(docks):
    (dock,), place = docks.parameters.docks, (7.0, -4.0, 0.0, 0.0, 0.0, 0.7)
    straight, turned = (
        problem_of(Docking, SimpleNamespace(parameters=SimpleNamespace(docks=[replace(dock, pose=pose)])))._bays
        for pose in ((0.0,) * 6, place)
    )
    for (x, y, inward, *sizes), found in zip(straight, turned, strict=True):
        *middle, _, _, _, heading = compose(place, (x, y, 0.0, 0.0, 0.0, inward))
        assert found == pytest.approx((*middle[:2], heading, *sizes))


def sailed_in_the_bay(docks, way, speed=0.5):
    """The rewards of a boat that is so far before the middle of its bay [m], step by step."""
    problem, _ = begun(Docking, docks)
    x, y, inward = problem._goal[0, :3]
    own = np.zeros((1, 1, 9))
    own[..., 0] = speed
    places = [at(x - far * math.cos(inward), y - far * math.sin(inward), inward)._replace(own=own) for far in way]
    problem.begin(np.ones((1, 1), bool), places[0])
    return problem, [float(problem.judge(place, GOING).own[0, 0]) for place in places[1:]]


def test_to_hover_in_and_out_of_the_bay_pays_nothing(docks):
    """It paid 25 in 90 s, more than to dock: each step inside paid, and was kept."""
    cycle = [8.0, *([1.0] * 29), *([5.0] * 16)]
    problem, rewards = sailed_in_the_bay(docks, cycle * 20)
    assert not problem.facts()["docked"][0, 0]
    assert sum(rewards) < 1.0
    _, rewards = sailed_in_the_bay(docks, [8.0, *([0.0] * 30)])
    assert sum(rewards) == pytest.approx(0.8 + 3 + 10)


@pytest.mark.parametrize(("speed", "worth"), [(0.9, 10.0), (1.5, 5.0), (3.0, 0.0)])
def test_to_have_docked_is_worth_less_the_faster_the_approach(docks, speed, worth):
    problem, fast = sailed_in_the_bay(docks, [8.0, 4.0, *([0.0] * 30)], speed)
    assert sum(fast) == pytest.approx(0.8 + 3 + worth)
    assert problem.facts()["approach_speed"][0, 0] == speed


def test_who_goes_off_again_may_come_back_slowly(docks):
    problem, _ = sailed_in_the_bay(docks, [8.0, 4.0], 3.0)
    x, y, inward = problem._goal[0, :3]
    problem.judge(at(x - 6.0 * math.cos(inward), y - 6.0 * math.sin(inward), inward), GOING)
    assert problem.facts()["approach_speed"][0, 0] == 0


def test_a_lost_boat_forfeits_more_than_to_stay_where_it_is(sea, docks):
    """Of what is left of an episode; problems without a cost of time have a fixed sum."""
    left = np.array([300])
    problem, start = begun(StationKeeping, sea)
    stays = -sum(float(problem.judge(at(*start), GOING).own[0, 0]) for _ in range(300))
    assert problem.forfeit(left)[0, 0] == pytest.approx(stays + 300)
    for kind, world in ((Wayfinding, sea), (FollowPath, sea), (Docking, docks)):
        assert begun(kind, world)[0].forfeit(left).tolist() == [[20.0]]


def test_every_bay_is_drawn_and_looks_into_the_dock(docks):
    problem = problem_of(Docking, docks)
    goals = set()
    for seed in range(20):
        problem.start(0, np.random.default_rng(seed))
        goals.add(tuple(np.round(problem._goal[0, :3], 6)))
    assert len(goals) == 3
    (dock,) = tree_of(docks.parameters)["docks"]
    middle = np.array(dock["pose"][:2])
    for x, y, inward in goals:
        assert np.dot(middle - (x, y), (math.cos(inward), math.sin(inward))) > -2.0


def test_a_row_that_stood_still_counts_nothing(sea):
    problem, start = begun(StationKeeping, sea)
    problem.judge(at(*start), ~GOING)
    assert problem.facts()["mean_pose_error"][0, 0] == 0
