"""A world's own task as a problem: its score is the reward, whichever scores are the better ones."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.rl.problem import Team
from vrx_mj.rl.problems.score import Score

GOING = np.ones(1, bool)


def row(kind, score=0.0):
    """A world of three boats of which the second is scored; the third heads north."""
    task = {"type": kind, "name": kind, "boat": "b", "state": "running", "elapsed_time": 1.0, "remaining_time": 120.0}
    task |= {"num_collisions": 2, "score": score, "goal": [1, 2]}
    features = np.zeros((1, 3, 13))
    features[0, :, :2], features[0, :, 3] = ((0, 0), (10, 5), (20, 0)), 1.0
    features[0, 2, 3], features[0, 2, 6] = math.cos(math.pi / 4), math.sin(math.pi / 4)
    world = SimpleNamespace(parameters=SimpleNamespace(task=SimpleNamespace(durations=(10.0, 10.0, 300.0))))
    sim = SimpleNamespace(world=world, task=task, task_is_over=False)
    return SimpleNamespace(n=1, boats=tuple("abc"), features=features, sim=sim, world=world)


def team(there):
    x, y = there.features[:, :, 0], there.features[:, :, 1]
    return Team(x, y, np.zeros((1, 3)), np.zeros((1, 3, 7)), np.zeros((1, 3, 9)), np.ones((1, 3), bool))


@pytest.mark.parametrize(("kind", "gain"), [("follow_path", 11.0), ("dock", 11.0), ("wayfinding", -11.0)])
def test_the_reward_is_by_how_much_the_score_got_better(kind, gain):
    there = row(kind, score=5.0)
    problem = Score(there)
    problem.begin(np.ones((1, 3), bool), team(there))
    there.sim.task["score"] = 16.0
    judged = problem.judge(team(there), GOING)
    assert judged.team.tolist() == [gain]
    assert judged.own.tolist() == [[0.0, gain, 0.0]]
    assert not judged.ended.any()
    assert problem.judge(team(there), GOING).team.tolist() == [0.0]


def test_the_end_of_the_task_ends_it_for_all():
    there = row("dock")
    problem = Score(there)
    there.sim.task_is_over = True
    assert problem.judge(team(there), GOING).ended.all()
    assert problem.duration == 321.0


def test_boats_start_where_the_fleet_has_them():
    problem = Score(row("dock"))
    spots = problem.start(0, np.random.default_rng(1))
    assert spots[1] == (10.0, 5.0, 0.0, 0.0)
    assert spots[2] == pytest.approx((20.0, 0.0, math.pi / 2, 0.0))


def test_a_boat_sees_its_way_since_the_start_the_task_and_whether_it_is_scored():
    there = row("dock")
    problem = Score(there)
    moved = team(there)._replace(x=np.array([[3.0, 10.0, 20.0]]), y=np.array([[-4.0, 5.0, 0.0]]))
    seen = problem.observe(moved)
    assert seen[0, 0].tolist() == [3.0, -4.0, 1.0, 0.0, 1.0, 120.0, 0.0]
    assert seen[0, 1, -1] == 1.0
    facts = problem.facts()
    assert (facts["score"][0], facts["num_collisions"][0]) == (0.0, 2)
    assert facts["outputs"][0] == {"remaining_time": 120.0, "goal": [1, 2]}
