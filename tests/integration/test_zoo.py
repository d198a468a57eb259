"""The PettingZoo environments: what PettingZoo checks, one world against many, who comes and goes, bad input."""

import contextlib
import warnings

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test, render_test
from pettingzoo.utils.conversions import parallel_to_aec

from exploits import let_pass
from integration.variety import variety
from vrx_mj.rl import ParallelEnv, TeamVectorEnv
from vrx_mj.rl.problems import PROBLEMS, TEAMS

ROWS = 3
VARIED = {"wind_speed": (0, 6), "gusts": 1, "waves": (0.2, 1), "thrust": (0.8, 1.1), "mass": (0.9, 1.1)}
MOVING = {"joining": 0.7, "leaving": 0.7}
MIXED = {
    "usv_count": 3, "layout": "line", "spacing": 12, "sensors": "none",
    "boats": [{"name": "wamv2", "thrusters": "X"}, {"name": "wamv3", "robot": "skiff"}],
}  # fmt: skip


@pytest.fixture(scope="module", params=sorted(TEAMS))
def problem(request):
    return request.param


def options(problem):
    return {} if PROBLEMS[problem].fixed else MOVING


def drawn(env, steps, seed=5):
    rng = np.random.default_rng(seed)
    shape = (*env.present.shape, max(map(len, env.action_names.values())))
    return rng.uniform(-1, 1, (steps, *shape)).astype(np.float32)


# What PettingZoo checks


@contextlib.contextmanager
def strictly():
    """Warnings are errors; but PettingZoo's test gives `reset` an option that no environment has."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*ignored: no reset option named 'options'")
        yield


@pytest.mark.slow
def test_pettingzoo_s_checkers_have_nothing_to_say(problem):
    more = {"duration": 6.0, **options(problem)}
    with strictly():
        parallel_api_test(ParallelEnv(problem, **more), num_cycles=100)
        parallel_seed_test(lambda: ParallelEnv(problem, **more), num_cycles=30)


@pytest.mark.slow
@pytest.mark.render
def test_pettingzoo_s_render_test_has_nothing_to_say():
    render_test(
        lambda render_mode: parallel_to_aec(ParallelEnv("Formation", render_mode=render_mode, width=64, height=48))
    )


def test_a_fleet_of_unlike_boats_passes_too():
    env = ParallelEnv("Formation", fleet=MIXED, duration=2.0, **MOVING)
    assert [env.action_space(boat).shape for boat in env.possible_agents] == [(4,), (8,), (2,)]
    spaces = [env.action_space(boat) for boat in env.possible_agents]
    assert all((space.low == -1.0).all() and (space.high == 1.0).all() for space in spaces)
    with strictly():
        parallel_api_test(env, num_cycles=30)


# One world and many


def test_a_row_is_an_environment_alone(problem):
    """Over the ends of episodes, with boats that come and go."""
    more = {"duration": 1.5, **variety(problem, VARIED), **options(problem)}
    many = TeamVectorEnv(problem, ROWS, threads=2, **more)
    alone = [ParallelEnv(problem, **more) for _ in range(ROWS)]
    seen, info = many.reset(seed=3)
    for row, env in enumerate(alone):
        first, _ = env.reset(seed=3 + row)
        compare(env, first, seen[row], info["present"][row])
    for actions in drawn(many, 40):
        seen, reward, ended, cut, info = many.step(actions)
        for row, env in enumerate(alone):
            if not env.agents:
                first, _ = env.reset()
                compare(env, first, seen[row], info["present"][row])
                continue
            own = {boat: actions[row, k] for k, boat in enumerate(env.possible_agents)}
            told = env.step(own)
            compare(env, told[0], seen[row], info["acted"][row] | info["present"][row])
            for mapping, array in zip(told[1:4], (reward, ended, cut), strict=True):
                assert mapping == {boat: array[row, env.possible_agents.index(boat)] for boat in told[0]}


def compare(env, mapping, array, there):
    assert list(mapping) == [boat for boat, here in zip(env.possible_agents, there, strict=True) if here]
    for boat, here, values in zip(env.possible_agents, there, array, strict=True):
        np.testing.assert_array_equal(values, mapping[boat] if here else np.zeros_like(values))


def test_the_same_seed_gives_the_same_episode_and_another_one_does_not():
    env = TeamVectorEnv("Formation", 2, **MOVING)
    first = env.reset(seed=1)[0].copy()
    assert not np.array_equal(env.reset()[0], first)
    assert not np.array_equal(env.reset(seed=2)[0], first)
    np.testing.assert_array_equal(env.reset(seed=1)[0], first)


def test_wrappers_draw_from_what_episodes_are_drawn_from():
    """As SuperSuit's `frame_skip` does, before the first episode too."""
    env, other = ParallelEnv("Formation"), ParallelEnv("Formation")
    env.np_random.integers(2, 5)
    with pytest.raises(AssertionError, match="reset"):
        env.step({})
    for one in (env, other):
        one.reset(seed=4)
        one.first = one.np_random.integers(2, 5, 20).tolist()
    assert env.first == other.first
    other.np_random.integers(2, 5)
    assert not np.array_equal(env.reset()[0]["wamv1"], other.reset()[0]["wamv1"])


def test_rewards_are_the_teams_the_boats_or_a_share_of_both():
    found = {}
    for reward in ("team", "individual", 0.25):
        env = TeamVectorEnv("Formation", 2, reward=reward)
        env.reset(seed=4)
        for actions in drawn(env, 5):
            _, found[reward], _, _, info = env.step(actions)
    np.testing.assert_array_equal(found["team"], np.repeat(info["team_reward"][:, None], 4, axis=1))
    np.testing.assert_array_equal(found["individual"], info["own_reward"])
    np.testing.assert_allclose(found[0.25], 0.25 * found["team"] + 0.75 * found["individual"], rtol=1e-14)
    assert np.ptp(found["individual"]) > 0.01


# Who comes and goes


def test_joins_and_leaves_leave_the_others_as_they_were():
    """Boats of one start place, with and without others that come and go beside them: equal to the last bit."""
    still, moving = (TeamVectorEnv("Formation", 1, duration=6.0, joining=share, leaving=share) for share in (0, 1))
    for env in (still, moving):
        env.reset(seed=7)
    first = {env: env._core.batch.features[0, 0].copy() for env in (still, moving)}
    np.testing.assert_array_equal(*first.values())
    came, went = 0, 0
    for actions in drawn(still, 59):
        still.step(actions)
        *_, cut, info = moving.step(actions)
        came += int((info["present"] & ~info["acted"]).sum())
        went += int(cut.sum())
        np.testing.assert_array_equal(still._core.batch.features[0, 0], moving._core.batch.features[0, 0])
    assert (came, went) == (3, 3)


def test_who_is_away_is_far_away_sees_nothing_and_is_seen_by_nobody():
    env = TeamVectorEnv("Rendezvous", 4, joining=1.0, range=1000.0, delay=0.0)
    seen, info = env.reset(seed=1)
    assert info["present"].tolist() == [[True, False, False, False]] * 4
    assert (env._core.batch.features[:, 1:, :2] > 9000).all()
    assert not seen[:, 1:].any()
    one = [k for k, name in enumerate(env.observation_names) if name.startswith("neighbour 1: is seen")]
    assert not seen[:, 0, one].any()
    actions = np.full((4, 4, 4), np.nan, np.float32)
    actions[:, 0] = 0
    _, reward, ended, cut, _ = env.step(actions)  # what is given for absent boats does not count
    assert not reward[:, 1:].any()
    assert not (ended | cut)[:, 1:].any()


def test_boats_join_in_the_first_half_and_leave_in_the_second():
    env = TeamVectorEnv("Formation", 20, duration=4.0, joining=1.0, leaving=1.0)
    env.reset(seed=2)
    still = np.zeros((20, 4, 4), np.float32)
    there = np.array([env.step(still)[4]["present"] for _ in range(39)])
    assert there[:, :, 0].all()
    assert there[19, :, 1:].mean() > 0.9  # all have come, but for a few that found no room
    assert there[20:, :, 1:].mean() < 0.7
    changes = np.diff(there[:, :, 1:].astype(int), axis=0)
    assert (changes[19:] <= 0).mean() > 0.95
    assert (changes[:18] >= 0).all()


def test_who_joins_is_seen_at_once_and_gains_nothing_by_it():
    """Without delay; 14 km nearer than it was before would be worth 1,400."""
    env = TeamVectorEnv("Rendezvous", 4, duration=3.0, joining=1.0, range=1000.0, delay=0.0)
    env.reset(seed=3)
    seen = [k for k, name in enumerate(env.observation_names) if "is seen" in name]
    joins = 0
    for actions in drawn(env, 29):
        observation, _, _, _, info = env.step(actions)
        np.testing.assert_array_equal(observation[:, 0, seen].sum(axis=1), info["present"][:, 1:].sum(axis=1))
        assert np.abs(info["own_reward"]).max() < 2
        assert np.abs(info["team_reward"]).max() < 2
        joins += int((info["present"] & ~info["acted"]).sum())
    assert joins >= 10


def test_a_row_that_diverges_ends_forfeits_what_lost_boats_do_and_begins_anew():
    env = TeamVectorEnv("Formation", 2)
    env.reset(seed=1)
    env._core.batch.set_boat("wamv2", velocity=(9e5, 0, 0, 0, 0, 0), rows=[0])
    still = np.zeros((2, 4, 4), np.float32)
    observation, reward, ended, _, info = env.step(still)
    assert info["diverged"].tolist() == [True, False]
    assert ended.tolist() == [[True] * 4, [False] * 4]
    assert (reward[0] < -1000).all()
    assert info["team_reward"][0] == reward[0].mean()
    assert np.isfinite(observation).all()
    *_, info = env.step(still)
    assert info["present"].all()
    observation, reward, *_ = env.step(still)
    assert np.isfinite(observation).all()
    assert (reward < 0).all()


def test_time_is_up_for_all_and_the_next_step_begins_another():
    env = TeamVectorEnv("Formation", 2, duration=0.3)
    env.reset(seed=1)
    still = np.zeros((2, 4, 4), np.float32)
    assert [env.step(still)[3].all().item() for _ in range(4)] == [False, False, True, False]
    assert not TeamVectorEnv("Formation", 2).present.any()


def test_a_goal_takes_one_boat_out():
    env = ParallelEnv("Encounter", waves=0, wind_speed=0, gusts=0)
    for seed in range(3):
        env.reset(seed=seed)
        env._rows._core.problem._goals[0, 0] = env._rows._core.batch.features[0, 0, :2]
        let_pass(env)
        _, reward, ended, _, _ = env.step({boat: np.zeros(4) for boat in env.agents})
        assert ended == {"wamv1": True, "wamv2": False}
        assert env.agents == ["wamv2"]
        assert reward["wamv1"] > 4
        assert env._rows._core.batch.features[0, 0, 0] > 9000


# What it shows and tells


@pytest.mark.render
def test_pictures_show_the_team():
    env = ParallelEnv("Formation", render_mode="rgb_array", width=160, height=96)
    env.reset(seed=1)
    picture = env.render()
    assert picture.shape == (96, 160, 3)
    white = (picture[20:].min(axis=2) > 150).any(axis=0)  # columns with a piece of a boat
    assert len(np.flatnonzero(np.diff(white.astype(int)) > 0)) >= 3


def test_the_state_is_what_all_observe():
    env = ParallelEnv("Formation", joining=1.0)
    seen, _ = env.reset(seed=1)
    state = env.state()
    assert env.state_space.contains(state)
    np.testing.assert_array_equal(state.reshape(4, -1)[0], seen["wamv1"])
    assert not state.reshape(4, -1)[1:].any()
