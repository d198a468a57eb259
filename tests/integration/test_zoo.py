"""The PettingZoo environments: what PettingZoo checks, one world against many, who comes and goes, bad input."""

import warnings

import gymnasium
import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test, render_test
from pettingzoo.utils.conversions import parallel_to_aec

import vrx_mj
from vrx_mj.adapters.zoo import ActionError, ParallelEnv, TeamVectorEnv
from vrx_mj.adapters.zoo.problems import PROBLEMS
from vrx_mj.adapters.zoo.refereed import RefereedRow

ROWS = 3
VARIED = {"wind_speed": (0, 6), "gusts": 1, "waves": (0.2, 1), "thrust": (0.8, 1.1), "mass": (0.9, 1.1)}
MOVING = {"joining": 0.7, "leaving": 0.7}
MIXED = {
    "usv_count": 3, "layout": "line", "spacing": 12, "sensors": "none",
    "boats": [{"name": "wamv2", "thrusters": "X"}, {"name": "wamv3", "robot": "skiff"}],
}  # fmt: skip

HELD = {
    "extends": "stationkeeping_task",
    "task": {"type": "station_keeping", "goal": [-33.722702498, 150.67402097002, 3.14159],
             "initial_state_duration": 1, "ready_state_duration": 1, "running_state_duration": 2},
}  # fmt: skip


@pytest.fixture(scope="module", params=sorted(PROBLEMS))
def problem(request):
    return request.param


def options(problem):
    return {} if PROBLEMS[problem].fixed else MOVING


def drawn(env, steps, seed=5):
    rng = np.random.default_rng(seed)
    shape = (*env.present.shape, max(map(len, env.action_names.values())))
    return rng.uniform(-1, 1, (steps, *shape)).astype(np.float32)


# What PettingZoo checks


def test_pettingzoo_s_checkers_have_nothing_to_say(problem):
    more = {"duration": 6.0, **options(problem)}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(ParallelEnv(problem, **more), num_cycles=100)
        parallel_seed_test(lambda: ParallelEnv(problem, **more), num_cycles=30)


def test_pettingzoo_s_render_test_has_nothing_to_say():
    render_test(
        lambda render_mode: parallel_to_aec(ParallelEnv("Formation", render_mode=render_mode, width=64, height=48))
    )


def test_a_fleet_of_unlike_boats_passes_too():
    env = ParallelEnv("Formation", fleet=MIXED, duration=2.0, **MOVING)
    assert [env.action_space(boat).shape for boat in env.possible_agents] == [(4,), (8,), (2,)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(env, num_cycles=30)


# One world and many


def test_a_row_is_an_environment_alone(problem):
    """Over the ends of episodes, with boats that come and go."""
    more = {"duration": 1.5, **VARIED, **options(problem)}
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
        env.reset(seed=6)
    first = {env: env._batch.features[0, 0].copy() for env in (still, moving)}
    np.testing.assert_array_equal(*first.values())
    came, went = 0, 0
    for actions in drawn(still, 59):
        still.step(actions)
        *_, cut, info = moving.step(actions)
        came += int((info["present"] & ~info["acted"]).sum())
        went += int(cut.sum())
        np.testing.assert_array_equal(still._batch.features[0, 0], moving._batch.features[0, 0])
    assert (came, went) == (3, 3)


def test_who_is_away_is_far_away_sees_nothing_and_is_seen_by_nobody():
    env = TeamVectorEnv("Rendezvous", 4, joining=1.0, range=1000.0, delay=0.0)
    seen, info = env.reset(seed=1)
    assert info["present"].tolist() == [[True, False, False, False]] * 4
    assert (env._batch.features[:, 1:, :2] > 9000).all()
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


def test_a_row_that_diverges_ends_without_reward_and_begins_anew():
    env = TeamVectorEnv("Formation", 2)
    env.reset(seed=1)
    env._batch.set_boat("wamv2", velocity=(9e5, 0, 0, 0, 0, 0), rows=[0])
    still = np.zeros((2, 4, 4), np.float32)
    observation, reward, ended, _, info = env.step(still)
    assert info["diverged"].tolist() == [True, False]
    assert ended.tolist() == [[True] * 4, [False] * 4]
    assert not reward[0].any()
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
        env._rows._problem._goals[0, 0] = env._rows._batch.features[0, 0, :2]
        _, reward, ended, _, _ = env.step({boat: np.zeros(4) for boat in env.agents})
        assert ended == {"wamv1": True, "wamv2": False}
        assert env.agents == ["wamv2"]
        assert reward["wamv1"] > 4
        assert env._rows._batch.features[0, 0, 0] > 9000


# Any world with a task


def test_a_world_s_task_passes_the_checkers_too():
    more = {"world": HELD, "boats": 3, "reward": "team", **MOVING}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(ParallelEnv("Score", **more), num_cycles=60)
        parallel_seed_test(lambda: ParallelEnv("Score", **more), num_cycles=10)


@pytest.mark.parametrize("world", ["ocean", "vrx2023/nbpark"])
def test_a_refereed_row_is_a_row_of_a_batch(world):
    """The same names, limits, motion and wind, to the last bit, in both profiles and with unlike boats."""
    alike = {"usv_count": 2, "layout": "line", "sensors": "none", "origin": "spawn"}
    fleet = alike if "2023" in world else MIXED
    wind = {"direction": 30, "mean_velocity": 4, "var_gain": 1, "var_time": 2}
    compiled = vrx_mj.compile_world({"extends": world, "wind": wind}, fleet=fleet)
    row, batch = RefereedRow(compiled), vrx_mj.Batch(compiled, 1)
    assert (row.boats, row.channels) == (batch.boats, batch.channels)
    np.testing.assert_array_equal(row.largest, batch.largest)
    row.reset(np.arange(1), seed=[9])
    batch.reset(seed=[9])
    rows, pose, moving = np.arange(1), np.array([[3.0, 60.0, 0.1, 0, 0, 1.0]]), np.array([[1.0, 0, 0, 0, 0, 0]])
    for one in (row, batch):
        one.set_boat("wamv2", pose=pose, velocity=moving, rows=rows)
        for values in np.random.default_rng(1).uniform(-1, 1, (10, 1, len(batch.channels))):
            one.step(values * batch.largest[:, 1], duration=0.1, rows=rows)
    for name in ("wind", "time", "qpos", "diverged"):
        np.testing.assert_array_equal(getattr(row, name), getattr(batch, name), err_msg=name)
    np.testing.assert_allclose(row.features, batch.features, atol=1e-13)  # numpy and the kernel round body axes unlike


def test_rewards_add_up_to_the_referee_s_score():
    """The same commands in a `Simulation` alone get the same score, and what all were given adds up to it."""
    env = ParallelEnv("Score", world=HELD, boats=2, delay=0.0)
    env.reset(seed=3)
    world = vrx_mj.compile_world(
        HELD, fleet={"usv_count": 2, "layout": "line", "spacing": 12, "origin": "spawn", "sensors": "none"}
    )
    sim = vrx_mj.Simulation(world)
    sim.reset(seed=env._rows._batch.sim.seed)
    sums, ended = {"wamv1": 0.0, "wamv2": 0.0}, {}
    names = [name for boat, name in env._rows._batch.channels if boat == "wamv1"]
    greatest = [limit[1] for (boat, _), limit in zip(env._rows._batch.channels, env._rows._batch.largest, strict=True)
                if boat == "wamv1"]  # fmt: skip
    for _ in range(60):
        if not env.agents:
            break
        actions = {boat: np.full(len(names), share, np.float32) for boat, share in (("wamv1", 0.5), ("wamv2", -0.25))}
        _, reward, ended, _, info = env.step(actions)
        sums = {boat: sums[boat] + reward[boat] for boat in sums}
        sim.step({"wamv1": {name: 0.5 * limit for name, limit in zip(names, greatest, strict=True)},
                  "wamv2": {name: -0.25 * limit for name, limit in zip(names, greatest, strict=True)}},
                 duration=0.1)  # fmt: skip
    assert ended == {"wamv1": True, "wamv2": True}
    assert sim.task_is_over
    assert info["wamv1"]["score"] == sim.task["score"] > 1
    assert sums["wamv1"] == pytest.approx(-sim.task["score"])
    assert sums["wamv2"] == 0
    assert info["wamv1"]["outputs"]["goal"] == sim.task["goal"]


# What it shows and tells


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


# What is none


@pytest.fixture(scope="module")
def pair():
    return ParallelEnv("Encounter")


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ([0, 0], "actions are a list: a mapping of boats to actions is needed"),
        ({"wamv1": np.zeros(4)}, "no action for wamv2, which is in the water"),
        ({"wamv1": np.zeros(4), "cora": np.zeros(4)}, "an action is for cora: the boats are wamv1, wamv2"),
        ({"wamv2": np.zeros(4), "wamv1": np.zeros(3)}, "the action of wamv1 has shape (3,) instead of (4,)"),
        ({"wamv2": np.zeros(4), "wamv1": "ahead"}, "the action of wamv1 is no array of numbers"),
        (
            {"wamv1": np.zeros(4), "wamv2": [0, np.nan, 0, 0]},
            "step() cannot take in a nan action: right of wamv2 is nan, and must be within -1 and 1",
        ),
        (
            {"wamv1": np.zeros(4), "wamv2": [0, 0, 0, 1.5]},
            "action is not in action space: right_angle of wamv2 is 1.5, and must be within -1 and 1",
        ),
    ],
)
def test_actions_that_are_none_leave_all_as_it_was(pair, actions, message):
    pair.reset(seed=1)
    before = pair._rows._batch.features.copy(), pair._rows._batch.time.copy(), pair.state()
    with pytest.raises(AssertionError) as caught:
        pair.step(actions)
    assert str(caught.value) == message
    assert isinstance(caught.value, gymnasium.error.InvalidAction)
    for one, other in zip(before, (pair._rows._batch.features, pair._rows._batch.time, pair.state()), strict=True):
        np.testing.assert_array_equal(one, other)
    still = {boat: np.zeros(4) for boat in pair.agents}
    fresh = ParallelEnv("Encounter")
    fresh.reset(seed=1)
    np.testing.assert_array_equal(pair.step(still)[0]["wamv1"], fresh.step(still)[0]["wamv1"])


def test_order_of_calls():
    env = ParallelEnv("Encounter", duration=0.1)
    for call, message in ((lambda: env.step({}), "step"), (env.render, "render"), (env.state, "state")):
        with pytest.raises(AssertionError) as caught:
            call()
        assert str(caught.value) == f"reset() needs to be called before {message}."
    env.reset(seed=0)
    env.step({boat: np.zeros(4) for boat in env.agents})
    assert env.agents == []
    assert env.step({}) == ({}, {}, {}, {}, {})
    env.close()
    env.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match=r"^the environment was closed$"):
        env.step({})


def test_order_of_calls_of_many():
    env = TeamVectorEnv("Encounter", 2, duration=0.1, autoreset=False)
    still = np.zeros((2, 2, 4), np.float32)
    with pytest.raises(gymnasium.error.ResetNeeded) as caught:
        env.step(still)
    assert str(caught.value) == "call reset() before step() or render()"
    env.reset(seed=1)
    env.step(still)
    env.reset(rows=np.array([True, False]))
    with pytest.raises(gymnasium.error.ResetNeeded) as caught:
        env.step(still)
    assert str(caught.value) == "the episodes of rows [1] have ended: reset them with rows=..."
    with pytest.raises(gymnasium.error.Error) as caught:
        env.reset(rows=[0, 1])
    assert str(caught.value) == "rows has shape (2,) and type int64: (2,) of bool is needed"
    env.reset()
    with pytest.raises(ActionError) as caught:
        env.step(still[:1])
    assert str(caught.value) == "actions have shape (1, 2, 4) instead of (2, 2, 4)"
    still[1, 0, 1] = 2
    with pytest.raises(ActionError) as caught:
        env.step(still)
    assert str(caught.value) == "in row 1, the action right of wamv1 is 2: it must be within -1 and 1"


@pytest.mark.parametrize(
    ("problem", "options", "message"),
    [
        ("Encounter", {"boats": 3}, "Encounter is for 2 boats: 3 are too many"),
        ("Encounter", {"boats": 1}, "Encounter is for 2 boats: 1 are too few"),
        ("Encounter", {"leaving": 0.5}, "Encounter needs its 2 boats all the time: no joining, no leaving"),
        ("Formation", {"boats": 0}, "boats is 0: a whole number above 0 is needed"),
        ("Formation", {"boats": 2, "fleet": MIXED}, "boats is 2, and the fleet has 3: give one of both"),
        ("Formation", {"duration": 0}, "duration is 0: a number of 0.1 or more is needed [s]"),
        ("Formation", {"joining": 2}, "joining is 2: a share from 0 to 1 is needed"),
        ("Formation", {"render_mode": "ansi"}, "render_mode is 'ansi': None, 'human' or 'rgb_array' is possible"),
    ],
)
def test_options_that_are_none(problem, options, message):
    with pytest.raises(gymnasium.error.Error) as caught:
        ParallelEnv(problem, **options)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "Score: give its world, one with a task"),
        ({"world": "ocean"}, "Score: the world ocean has no task"),
        ({"world": HELD, "waves": 1}, "Score has no option waves: its world is as it is"),
        ({"world": HELD, "wave": 1}, "Score has no option wave"),
    ],
)
def test_scores_that_are_none(options, message):
    with pytest.raises(gymnasium.error.Error) as caught:
        ParallelEnv("Score", **options)
    assert str(caught.value) == message


def test_a_problem_that_is_none():
    with pytest.raises(vrx_mj.VrxError, match=r"^no problem named 'Racing'; known: "):
        ParallelEnv("Racing")
