"""The vectorised environment: how its episodes end, and what rows that stand still are worth."""

import numpy as np
import pytest

from vrx_mj.rl import VectorEnv
from vrx_mj.rl.environment import MIN_STEPS_LEFT, Actions

STEPS = 3


@pytest.fixture(scope="module")
def env():
    env = VectorEnv("StationKeeping", 2, duration=0.1 * STEPS)
    yield env
    env.close()


def steps(env, count):
    still = np.zeros(env.action_space.shape, np.float32)
    return [env.step(still) for _ in range(count)]


def test_an_episode_is_cut_after_its_duration(env):
    env.reset(seed=1)
    assert [cut.tolist() for _, _, _, cut, _ in steps(env, STEPS)] == [[False] * 2] * (STEPS - 1) + [[True] * 2]


def test_a_problem_may_cut_an_episode_before_its_time_is_up(env, monkeypatch):
    """Which is no end of it: what comes after counts."""
    judge = env._core.problem.judge

    def cutting(team, going):
        return judge(team, going)._replace(cut=np.array([[False], [True]]))

    env.reset(seed=1)
    monkeypatch.setattr(env._core.problem, "judge", cutting)
    _, _, ended, cut, _ = steps(env, 1)[0]
    assert (ended.tolist(), cut.tolist()) == ([False, False], [False, True])


def test_in_the_step_after_its_end_a_row_begins_anew_and_gains_nothing(env):
    env.reset(seed=1)
    last = steps(env, STEPS + 2)[-2:]
    assert last[0][1].tolist() == [0.0, 0.0]
    assert not last[0][2].any()
    assert not last[0][3].any()
    assert (last[1][1] < 0.0).all()


def test_rows_end_when_their_own_time_is_up(env):
    env.reset(seed=1)
    steps(env, 1)
    env.reset(options={"reset_mask": np.array([False, True])})
    ends = [cut.tolist() for _, _, _, cut, _ in steps(env, STEPS)]
    assert ends == [[False, False], [True, False], [False, True]]


def test_what_has_diverged_ends_and_forfeits_what_a_lost_boat_does(env):
    env.reset(seed=1)
    env._core.batch.set_boat(env._core.batch.boats[0], velocity=(9e6, 0, 0, 0, 0, 9e6), rows=[1])
    for _, reward, done, cut, info in steps(env, STEPS):
        assert np.isfinite(reward).all()
        if info["diverged"][1]:
            assert reward[1] < -0.1 * 10 * MIN_STEPS_LEFT
            assert (bool(done[1]), bool(cut[1])) == (True, False)
            assert not done[0]
            return
    pytest.fail("it did not diverge")


def test_actions_are_shares_of_the_greatest_command_either_way():
    actions = Actions(["a"], [("a", "left"), ("a", "left_angle")], np.array([[-100.0, 250.0], [-1.0, 1.0]]))
    found = actions.commands(np.array([[[1.0, -0.5]], [[-1.0, 0.25]]], np.float32))
    assert found.tolist() == [[250.0, -0.5], [-100.0, 0.25]]
