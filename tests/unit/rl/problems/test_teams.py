"""What the problems for teams reward: by hand, on made-up places."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.rl.problem import Team, boats_too_near, mean_of, team_of
from vrx_mj.rl.problems.encounter import GIVE_WAY, HEAD_ON, OVERTAKEN, OVERTAKING, STAND_ON, Encounter
from vrx_mj.rl.problems.fleets import Formation, Rendezvous

GOING, WAITING = np.ones(1, bool), np.zeros(1, bool)


def team(spots, present=None):
    """One world; a spot is x, y, heading and speed along it."""
    x, y, yaw, speed = np.array(spots, float).T[:, None]
    here = np.ones_like(x, dtype=bool) if present is None else np.array([present])
    motion = np.zeros((*x.shape, 7))
    motion[..., 0], motion[..., 3], motion[..., 4] = np.cos(yaw / 2), np.sin(yaw / 2), speed
    return Team(x, y, yaw, motion, np.zeros((*x.shape, 9)), here)


def begun(kind, boats, seed=1, **attributes):
    problem = kind(SimpleNamespace(n=1, boats=tuple("abcdefgh"[:boats])))
    spots = problem.start(0, np.random.default_rng(seed))
    for name, value in attributes.items():
        setattr(problem, name, value)
    now = team(spots)
    problem.begin(now.present, now)
    return problem, spots


def test_what_a_team_sees_is_over_ground():
    """Heading north and heeled, a boat that makes 2 m/s ahead goes north; one to port of its bow goes west."""
    half = math.pi / 4
    features = np.zeros((2, 3, 13))
    features[..., 3], features[..., 6] = math.cos(half), math.sin(half)
    features[1, 2, :2], features[1, 2, 7:9] = (4, 5), (2, 0.5)
    seen = team_of(features, np.array([[0.0, 0.0], [0.0, 3.0]]), np.ones((2, 3), bool))
    np.testing.assert_allclose([seen.x[1, 2], seen.y[1, 2], seen.yaw[1, 2]], [4, 5, math.pi / 2])
    np.testing.assert_allclose([speed[1, 2] for speed in seen.velocity()], [-0.5, 2], atol=1e-12)
    np.testing.assert_allclose(seen.own[:, :, 7], [[0] * 3, [3] * 3], atol=1e-12)
    np.testing.assert_allclose(np.array(seen.toward(np.array([[0.0]]), np.array([[5.0]])))[:, 1, 2], [0, 4], atol=1e-12)


def test_boats_are_too_near_within_six_metres_if_both_are_there():
    spots = [(0, 0, 0, 0), (5.9, 0, 0, 0), (12, 0, 0, 0), (12, 3, 0, 0)]
    assert boats_too_near(team(spots, [True, True, True, False])).tolist() == [[True, True, False, False]]
    np.testing.assert_allclose(mean_of(np.array([[1.0, 5.0, np.nan]]), np.array([[True, True, False]])), [3])


# Formation


def test_a_formation_loses_by_what_each_is_off():
    problem, _ = begun(Formation, 3, _leader=np.zeros((1, 3)), _leader_speed=np.ones(1), _bend=np.zeros(1))
    places = problem._slots[0] + (0.1, 0.0)  # after a step the leader is 0.1 m ahead
    spots = [(x + off, y, 0, 1) for (x, y), off in zip(places, (0, 2, -3), strict=True)]
    judged = problem.judge(team(spots), GOING)
    np.testing.assert_allclose(judged.own, [[0, -0.2, -0.3]], atol=1e-12)
    np.testing.assert_allclose(judged.team_reward(np.ones((1, 3), bool)), [-0.5 / 3])
    np.testing.assert_allclose(problem.facts()["off"], [[0, 2, 3]], atol=1e-12)
    assert not judged.ended.any()
    without = problem.judge(team(spots, [True, False, True]), WAITING)
    np.testing.assert_allclose(without.team_reward(np.array([[True, False, True]])), [-0.15])
    np.testing.assert_allclose(without.own, [[0, 0, -0.3]], atol=1e-12)


def test_who_is_too_near_loses_one():
    problem, _ = begun(Formation, 2, _leader=np.zeros((1, 3)), _leader_speed=np.zeros(1), _bend=np.zeros(1))
    place = (*problem._slots[0, 0], 0, 0)
    judged = problem.judge(team([place, place]), GOING)
    assert judged.own[0, 0] == pytest.approx(-1)
    assert judged.own[0, 1] == pytest.approx(-1 - 0.1 * np.hypot(*np.diff(problem._slots[0], axis=0)[0]))


def test_places_move_with_a_leader_that_turns():
    """Their velocities are the differences of where they are, to the first order of a step of 0.1 s."""
    problem, spots = begun(Formation, 4, seed=3)
    still = team([(0, 0, 0, 0)] * 4)
    for _ in range(30):
        seen = problem.observe(still)[0]
        before = seen[:, :2]
        problem.judge(still, GOING)
        moved = problem.observe(still)[0]
        mean = 0.5 * (seen[:, 2:4] + moved[:, 2:4])
        np.testing.assert_allclose((moved[:, :2] - before) / 0.1, mean, atol=0.02)
    assert np.ptp(seen[:, 2]) > 0.05  # it does turn
    assert len(spots) == 4


def test_a_formation_starts_near_its_places_apart():
    for seed in range(20):
        problem, spots = begun(Formation, 5, seed=seed)
        assert (problem.facts()["off"] <= 3 * math.sqrt(2)).all()
        assert not boats_too_near(team(spots), 5.0).any()


# Rendezvous

PLACES = np.array([[[15.0, 0.0], [-15.0, 0.0]]])


def rendezvous(spots):
    problem, _ = begun(Rendezvous, len(spots), _places=PLACES.copy(), _drift=np.zeros((1, 2, 2)))
    now = team(spots)
    problem.begin(now.present, now)
    return problem


def test_to_come_nearer_is_gained_alone_and_together():
    problem = rendezvous([(35, 0, 0, 0), (-35, 0, 0, 0)])  # 20 m each from the nearest; (20 + 50) / 2 together
    assert problem.facts()["distance"][0] == pytest.approx(35)
    judged = problem.judge(team([(30, 0, 0, 0), (-28, 0, 0, 0)]), GOING)
    np.testing.assert_allclose(judged.own, [[0.5, 0.7]])
    np.testing.assert_allclose(judged.team, [0.1 * (35 - (13 + 45) / 2)])


def test_they_have_met_when_all_were_at_one_place_for_three_seconds():
    there = [(15, 5, 0, 0), (15, -2, 0, 0)]
    problem = rendezvous(there)
    assert not any(problem.judge(team(there), WAITING).ended.any() for _ in range(40))
    done = [bool(problem.judge(team(there), GOING).ended.all()) for _ in range(30)]
    assert done == [False] * 29 + [True]
    last = problem.judge(team(there), GOING)
    np.testing.assert_allclose(last.own, [[10, 10]])
    np.testing.assert_allclose(last.team, [10])
    assert problem.facts()["met"][0]


def test_at_two_places_they_have_not_met():
    apart = [(15, 0, 0, 0), (-15, 0, 0, 0)]
    problem = rendezvous(apart)
    assert not any(problem.judge(team(apart), GOING).ended.any() for _ in range(40))
    one = [True, False]  # who is not in the water is not waited for
    assert any(problem.judge(team(apart, one), GOING).ended.any() for _ in range(40))


def test_a_boat_that_leaves_is_no_gain_for_the_team():
    spots = [(35, 0, 0, 0), (-35, 0, 0, 0)]
    problem = rendezvous(spots)
    assert problem.judge(team(spots, [True, False]), GOING).team[0] == pytest.approx(0)


# Encounter


def encounter(spots, **attributes):
    problem = begun(Encounter, 2, **attributes)[0]
    now = team(spots)
    problem.begin(now.present, now)
    return problem


def reward_without_goals(problem, spots):
    problem._goals[:] = [[[1e3, 1e3], [1e3, 1e3]]]
    now = team(spots)
    problem._far = problem._distances(now)  # no progress is counted
    return problem.judge(now, GOING).own[0]


NORTH, SOUTH, WEST = math.pi / 2, -math.pi / 2, math.pi
MEETING = [(0, -27, NORTH, 1.5), (0, 27, SOUTH, 1.5)]
CROSSING = [(0, -27, NORTH, 1.5), (27, 0, WEST, 1.5)]  # the second comes from the first one's starboard side
OVERTAKES = [(0, -36, NORTH, 2.0), (0, -14.4, NORTH, 0.8)]


@pytest.mark.parametrize(
    ("spots", "roles"),
    [(MEETING, [HEAD_ON] * 2), (CROSSING, [GIVE_WAY, STAND_ON]), (OVERTAKES, [OVERTAKING, OVERTAKEN])],
)
def test_who_keeps_clear_is_at_fault_while_they_would_collide(spots, roles):
    problem = encounter(spots)
    assert problem.facts()["role"][0].tolist() == roles
    np.testing.assert_allclose(reward_without_goals(problem, spots), [-0.1, -0.1 if roles[0] == HEAD_ON else 0])


def test_give_way_to_starboard_is_without_fault_once_the_way_is_clear():
    problem = encounter(CROSSING)
    clear = [(0, -27, NORTH - math.radians(60), 1.5), CROSSING[1]]
    own = reward_without_goals(problem, clear)
    # velocities (1.299, 0.75) and (-1.5, 0) from a relative place (27, 27): the closest is 27 * 2.049 / 2.898 m
    assert 27 * (2.799 - 0.75) / math.hypot(2.799, 0.75) > 15
    np.testing.assert_allclose(own, [0, 0], atol=1e-12)


def test_who_stands_on_holds_course_and_speed():
    problem = encounter(CROSSING)
    turned = [CROSSING[0], (27, 0, WEST + math.radians(15), 1.5)]
    assert reward_without_goals(problem, turned)[1] == pytest.approx(-0.05)
    slower = [CROSSING[0], (27, 0, WEST, 0.75)]
    assert reward_without_goals(problem, slower)[1] == pytest.approx(-0.05)


def test_who_stood_on_for_half_of_the_time_gets_half_of_the_score():
    """15 degrees to starboard all the way: half of a departure that is readily apparent."""
    way = [[(0, y - 25.0, NORTH, 1.5), (-y, 0, WEST - math.radians(15), 1.5)] for y in np.arange(-27, 27, 0.15)]
    problem = encounter(CROSSING)
    problem._closest[:] = 1e3
    for spots in way[:60]:  # while the other is farther than where it may act
        problem.judge(team(spots), GOING)
    assert problem._held[0, 1] / problem._steps[0] == pytest.approx(0.5)
    for spots in way[60:]:
        problem.judge(team(spots), GOING)
    assert problem.facts()["score"][0, 1] == pytest.approx(0.5)


def test_near_by_the_stand_on_vessel_may_act_but_not_to_port():
    problem = encounter(CROSSING)
    near = [(0, -9, NORTH, 1.5), (9, 0, WEST - math.radians(15), 1.5)]
    assert reward_without_goals(problem, near)[1] == pytest.approx(0)
    near[1] = 9, 0, WEST + math.radians(15), 1.5
    assert reward_without_goals(problem, near)[1] == pytest.approx(-0.05)


def test_head_on_a_turn_to_port_is_a_fault():
    wide = [(8, -27, NORTH, 1.5), (-8, 27, SOUTH, 1.5)]  # 16 m apart when they pass: no risk
    problem = encounter(wide)
    problem._role[:] = HEAD_ON
    assert reward_without_goals(problem, wide)[0] == pytest.approx(0)
    port = [(8, -27, NORTH + math.radians(6), 1.5), wide[1]]
    starboard = [(8, -27, NORTH - math.radians(6), 1.5), wide[1]]
    assert reward_without_goals(problem, starboard)[0] == pytest.approx(0)
    assert reward_without_goals(problem, port)[0] < -0.1 * 6 / 30 + 1e-9


def passed(spots_by_step, first):
    """The scores of two who go through places."""
    problem = encounter(first)
    problem._closest[:] = 1e3  # the way begins elsewhere
    for spots in spots_by_step:
        judged = problem.judge(team(spots), GOING)
    return problem.facts()["score"][0], judged


@pytest.mark.parametrize(("side", "expected"), [(-1, 1.0), (1, 0.0)])
def test_head_on_they_pass_port_to_port(side, expected):
    """`side` -1: each leaves the other to port, 16 m abeam."""
    way = [[(-side * 8, y, NORTH, 1.5), (side * 8, -y, SOUTH, 1.5)] for y in np.arange(-27, 27, 0.15)]
    score, _ = passed(way, MEETING)
    np.testing.assert_allclose(score, [expected] * 2, atol=1e-3)  # places are 0.15 m apart


def test_crossing_astern_is_worth_more_than_ahead():
    def score(shift):
        way = [[(0, y - shift, NORTH, 1.5), (-y, 0, WEST, 1.5)] for y in np.arange(-27, 27, 0.15)]
        return passed(way, CROSSING)[0]

    behind, ahead = score(25.0), score(-25.0)
    assert behind[0] == pytest.approx(0.5 * (1 - math.cos(math.radians(135))), abs=0.02)
    assert ahead[0] == pytest.approx(0.5 * (1 - math.cos(math.radians(45))), abs=0.02)
    assert behind[1] == pytest.approx(1)


@pytest.mark.parametrize("side", [-16, 16])
def test_overtaking_gives_way_on_either_side(side):
    way = [[(side, -36 + 0.2 * k, NORTH, 2.0), (0, -14.4 + 0.08 * k, NORTH, 0.8)] for k in range(400)]
    score, _ = passed(way, OVERTAKES)
    np.testing.assert_allclose(score, [1, 1])


def test_a_close_shave_scores_less():
    way = [[(10.5, -36 + 0.2 * k, NORTH, 2.0), (0, -14.4 + 0.08 * k, NORTH, 0.8)] for k in range(400)]
    np.testing.assert_allclose(passed(way, OVERTAKES)[0], [0.5, 0.5], atol=1e-6)


def sailed(first, way, goals):
    """What both get on a way, step by step, until one or both leave; and the problem."""
    problem = encounter(first, _goals=np.array([goals], float))
    rewards, present = [], np.ones(2, bool)
    for spots in way:
        judged = problem.judge(team(spots, present.tolist()), GOING)
        rewards.append(judged.own[0])
        present = present & ~judged.ended[0]
        if not present.any():
            break
    return problem, np.array(rewards), present


def wide(k):
    """Head-on, 16 m apart to port, for 15 cm a step."""
    return [(8, -27 + 0.15 * k, NORTH, 1.5), (-8, 27 - 0.15 * k, SOUTH, 1.5)]


BEYOND = [(8, 20), (-8, -20)]


def test_the_score_is_paid_at_the_goal_once():
    problem, rewards, present = sailed(MEETING, [wide(k) for k in range(400)], BEYOND)
    assert not present.any()
    np.testing.assert_allclose(rewards[-1], [0.015 + 10] * 2, atol=1e-6)  # 5 for the goal, 5 for the score
    assert (rewards > 4.9).sum(axis=0).tolist() == [1, 1]
    np.testing.assert_allclose(problem.facts()["score"], [[1, 1]])


def test_to_brake_until_the_range_opens_is_not_to_pass():
    """Both go astern for 20 s, which counted as passed with a score of 1; then straight on into each other."""
    back = [[(0, -27 - 0.1 * k, NORTH, -1.0), (0, 27 + 0.1 * k, SOUTH, -1.0)] for k in range(200)]
    on = [[(0, -47 + 0.15 * k, NORTH, 1.5), (0, 47 - 0.15 * k, SOUTH, 1.5)] for k in range(320)]
    problem, rewards, present = sailed(MEETING, back + on, [(0, 20), (0, -20)])
    assert not present.any()
    facts = problem.facts()
    assert (facts["passed"][0], facts["collided"][0], facts["score"].tolist()) == (False, True, [[0.0, 0.0]])
    assert rewards[-1].max() < -9.9
    assert rewards[210:240, 0].max() < 0.015  # at fault as soon as they approach again


def test_to_stop_and_wait_until_the_other_is_at_its_goal_is_not_to_pass():
    """The other one gets its goal, and neither a score; nobody leaves before they have passed."""
    way = [[(0, -40, NORTH, 0.0), (20, 27 - 0.15 * min(k, 300), SOUTH, 1.5)] for k in range(500)]
    problem, rewards, present = sailed(MEETING, way, [(0, 20), (20, -18)])
    assert present.all()
    assert not problem.facts()["passed"][0]
    assert (rewards[:, 1] > 4.9).sum() == 1
    assert rewards[:, 0].sum() < 0.1 * 13 + 1e-9


def test_to_turn_away_for_good_gains_nothing():
    way = [[(0.15 * k, -27, 0.0, 1.5), (-0.15 * k, 27, WEST, 1.5)] for k in range(500)]
    problem, rewards, present = sailed(MEETING, way, [(0, 20), (0, -20)])
    assert present.all()
    assert not problem.facts()["score"].any()
    assert (rewards.sum(axis=0) < -3).all()


def test_a_collision_after_they_have_passed_counts():
    """They pass 16 m apart, turn round and meet again."""
    first = [wide(k) for k in range(220)]
    again = [[(8 - 0.1 * k, 6 - 0.05 * k, WEST, 1.0), (-8 + 0.1 * k, -6 + 0.05 * k, 0.0, 1.0)] for k in range(100)]
    problem, rewards, present = sailed(MEETING, first + again, [(0, 30), (0, -30)])
    assert not present.any()
    assert problem.facts()["collided"][0]
    assert not problem.facts()["score"].any()
    assert rewards[-1].max() < -9


def test_a_collision_ends_it_for_both():
    problem = encounter(MEETING)
    judged = problem.judge(team([(0, -2.9, NORTH, 0), (0, 2.9, SOUTH, 0)]), GOING)
    assert judged.ended.tolist() == [[True, True]]
    assert (judged.own < -7).all()


def test_a_goal_is_worth_5_once_and_lets_nobody_leave_before_they_have_passed():
    problem = encounter(MEETING, _goals=np.array([[[0.0, 20.0], [0.0, -20.0]]]))
    spots = [(0, 16, NORTH, 0), (0, -10, SOUTH, 0)]  # there, in one leap: the range has not opened
    judged = problem.judge(team(spots), GOING)
    assert judged.ended.tolist() == [[False, False]]
    assert judged.own[0] == pytest.approx([0.1 * 43 + 5, 0.1 * 37])
    problem.judge(team(spots), GOING)
    judged = problem.judge(team([(0, 17, NORTH, 0), (0, -11, SOUTH, 0)]), GOING)
    assert judged.ended.tolist() == [[True, False]]
    alone = problem.judge(team([(0, 17, NORTH, 0), (0, -16, SOUTH, 0)], [False, True]), GOING)
    assert alone.ended.tolist() == [[False, True]]


def test_all_situations_are_drawn_and_are_what_they_are_meant_to_be():
    found = set()
    for seed in range(60):
        problem, spots = begun(Encounter, 2, seed=seed)
        found.add(tuple(problem.facts()["role"][0].tolist()))
        now = team(spots)
        ends = [(x + 18 * speed * math.cos(yaw), y + 18 * speed * math.sin(yaw)) for x, y, yaw, speed in spots]
        assert math.dist(*ends) < 1e-9
        ahead, port = now.toward(*np.moveaxis(problem._goals, -1, 0))
        assert (ahead > 30).all()
        np.testing.assert_allclose(port, 0, atol=1e-9)
    assert found == {
        (HEAD_ON, HEAD_ON), (GIVE_WAY, STAND_ON), (STAND_ON, GIVE_WAY), (OVERTAKING, OVERTAKEN), (OVERTAKEN, OVERTAKING)
    }  # fmt: skip
