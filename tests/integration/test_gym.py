"""The Gymnasium environments: what Gymnasium checks, one row against many, seeds, episodes, rewards, bad input."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import vrx_mj.rl
from integration.variety import variety
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.model.tables import WAVE
from vrx_mj.rl import Env, VectorEnv
from vrx_mj.rl.picture import Picture
from vrx_mj.rl.problem import open_water
from vrx_mj.rl.problems import ALONE

ROWS = 3
STEPS = 12
VARIED = {"wind_speed": (0, 6), "gusts": 1, "waves": (0.2, 1), "thrust": (0.8, 1.1), "mass": (0.9, 1.1)}


def actions(env, steps=STEPS, seed=5):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (steps, *env.action_space.shape)).astype(np.float32)


def sailed(env, seed=None, steps=STEPS):
    """Observations, rewards and ends of a run."""
    found = [env.reset(seed=seed)[0].copy()]
    for action in actions(env, steps):
        observation, reward, done, cut, _ = env.step(action)
        found += [observation.copy(), reward.copy(), done.copy(), cut.copy()]
    return found


def same(one, other):
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.fixture(scope="module", params=sorted(ALONE))
def problem(request):
    return request.param


def test_gymnasium_s_checker_has_nothing_to_say(problem, recwarn):
    env = gymnasium.make(f"vrx_mj.rl:vrx_mj/{problem}-v0")
    check_env(env.unwrapped, skip_render_check=True)
    env.close()
    env.close()
    assert not [str(item.message) for item in recwarn]


def test_a_row_is_an_environment_alone(problem):
    """Against Gymnasium's own vectorisation of single ones, over the ends of episodes."""
    options = {"duration": 0.5, **variety(problem, VARIED)}
    ours = VectorEnv(problem, ROWS, **options)
    theirs = SyncVectorEnv([lambda: Env(problem, **options)] * ROWS)
    same(sailed(ours, seed=3), sailed(theirs, seed=3))


def test_rows_go_the_same_way_whoever_sails_beside_them():
    one, many = (VectorEnv("StationKeeping", n, threads=n % 2 + 1, **VARIED) for n in (1, 20))
    np.testing.assert_array_equal(one.reset(seed=8)[0], many.reset(seed=8)[0][:1])
    for action in actions(many):
        for alone, beside in zip(one.step(action[:1])[:4], many.step(action)[:4], strict=True):
            np.testing.assert_array_equal(alone, beside[:1])


def test_the_same_seed_gives_the_same_episodes():
    env = VectorEnv("Wayfinding", ROWS, duration=0.4, **VARIED)
    first = sailed(env, seed=1)
    same(first, sailed(env, seed=1))
    assert not np.array_equal(first[0], env.reset(seed=2)[0])
    assert not np.array_equal(env.reset()[0], env.reset()[0])


def test_episodes_end_when_time_is_up_and_the_next_step_begins_another():
    env = VectorEnv("StationKeeping", 2, duration=0.3)
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    env.reset(seed=1)
    still = np.zeros(env.action_space.shape, np.float32)
    assert [env.step(still)[3].tolist() for _ in range(4)] == [[False] * 2, [False] * 2, [True] * 2, [False] * 2]
    _, reward, _, _, info = env.step(still)
    assert (reward < 0).all()
    np.testing.assert_allclose(info["mean_pose_error"], info["pose_error"])  # the first step of the new episode


def test_same_step_gives_the_last_observation_beside_the_first():
    apart, same_step = (
        VectorEnv("StationKeeping", 2, duration=0.2),
        VectorEnv("StationKeeping", 2, duration=0.2, autoreset_mode="SameStep"),
    )
    for env in (apart, same_step):
        env.reset(seed=4)
        env.step(np.ones(env.action_space.shape, np.float32))
    ones = np.ones(apart.action_space.shape, np.float32)
    last, *_ = apart.step(ones)
    first, *_ = apart.step(ones)
    observation, _, _, cut, info = same_step.step(ones)
    assert cut.all()
    np.testing.assert_array_equal(np.stack(info["final_obs"]), last)
    np.testing.assert_array_equal(observation, first)


def test_disabled_leaves_the_resets_to_the_caller():
    env = VectorEnv("StationKeeping", 3, duration=0.1, autoreset_mode=AutoresetMode.DISABLED)
    begun, _ = env.reset(seed=4)
    still = np.zeros(env.action_space.shape, np.float32)
    env.step(still)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"rows \[0, 1, 2\] have ended"):
        env.step(still)
    after, _ = env.reset(options={"reset_mask": np.array([True, False, True])})
    assert (after != begun).any(axis=1).all()
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"rows \[1\] have ended"):
        env.step(still)


def test_a_rate_of_turn_and_a_speed_are_felt_in_body_axes():
    env = VectorEnv("StationKeeping", 1, waves=0, wind_speed=0, gusts=0)
    env.reset(seed=2)
    ahead = np.array([[1, 1, 0, 0]], np.float32)
    for _ in range(50):
        observation, *_ = env.step(ahead)
    assert observation[0, 0] * 3 > 1.0  # surge [m/s]
    assert abs(observation[0, 1]) < 0.02
    turn = np.array([[-1, 1, 0, 0]], np.float32)
    for _ in range(20):
        observation, *_ = env.step(turn)
    assert observation[0, 2] * 0.5 > 0.1  # starboard ahead: to port [rad/s]
    np.testing.assert_array_equal(observation[0, 9:13], turn[0])


def test_wind_comes_from_where_it_was_drawn():
    env = VectorEnv("StationKeeping", 40, wind_speed=7, gusts=0)
    observation, _ = env.reset(seed=3)
    np.testing.assert_allclose(np.hypot(*observation[:, 7:9].T) * 10, 7, rtol=1e-5)
    assert np.ptp(np.arctan2(*observation[:, 7:9].T)) > 3


@pytest.mark.render
def test_pictures_show_something():
    env = Env("StationKeeping", render_mode="rgb_array", width=64, height=48)
    env.reset(seed=1)
    picture = env.render()
    assert picture.shape == (48, 64, 3)
    assert picture.std() > 10
    assert Env("StationKeeping").render_mode is None


class Calm:
    """A batch as it is, on flat water."""

    def __init__(self, batch):
        self.features, self.qpos, self.time = batch.features, batch.qpos, batch.time

    def waves(self, row):
        """No waves."""
        return np.zeros(0, WAVE)


@pytest.mark.render
def test_pictures_show_the_waves_of_their_rows():
    calm = Picture(
        compile_world(open_water(sea={"model": "pms", "gain": 0, "period": 5}), fleet={"sensors": "none"}), 64, 48
    )
    for factor in (0, 2):
        env = VectorEnv("StationKeeping", 1, waves=factor, render_mode="rgb_array", width=64, height=48)
        env.reset(seed=1)
        for _ in range(30):
            env.step(np.zeros((1, 4)))
        (picture,) = env.render()
        without = calm.from_behind(Calm(env._core.batch), 0)
        assert (picture == without).all() == (factor == 0)


def test_what_is_registered():
    assert {f"vrx_mj/{name}-v0" for name in ALONE} <= set(gymnasium.registry)
    env = gymnasium.make_vec("vrx_mj/StationKeeping-v0", num_envs=2, waves=0.5)
    assert isinstance(env, VectorEnv)
    assert vrx_mj.rl.VectorEnv is VectorEnv


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([[0, 0, 0]], "invalid actions of shape (1, 3): (1, 4) is needed"),
        ([[0, np.nan, 0, 0]], "invalid action nan for right of wamv: a number from -1 to 1 is needed"),
        ([[0, 0, 0, 1.5]], "invalid action 1.5 for right_angle of wamv: a number from -1 to 1 is needed"),
    ],
)
def test_actions_that_are_none(action, message):
    env = VectorEnv("StationKeeping", 1)
    env.reset(seed=1)
    with pytest.raises(gymnasium.error.InvalidAction) as caught:
        env.step(action)
    assert str(caught.value) == message
    assert env.step(np.zeros((1, 4)))[4]["mean_pose_error"] > 0


def test_order_of_calls():
    env = VectorEnv("StationKeeping", 1)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) before step\(\) or render\(\)"):
        env.step(np.zeros((1, 4), np.float32))
    env.reset(seed=0)
    env.close()
    env.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="the environment is closed"):
        env.step(np.zeros((1, 4), np.float32))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"wind_speed": (5, 1)},
            "invalid wind_speed (5, 1): a number from 0 to 1e+06, or a pair (low, high), is needed",
        ),
        ({"mass": 0}, "invalid mass 0: a number from 0.001 to 1e+06, or a pair (low, high), is needed"),
        ({"render_mode": "human"}, "invalid render_mode 'human': None, 'rgb_array' or 'rgb_array_list' is needed"),
        ({"width": 0}, "invalid width 0: a whole number of pixels from 1 to 8192 is needed"),
        ({"height": 1.5}, "invalid height 1.5: a whole number of pixels from 1 to 8192 is needed"),
        ({"duration": 0.01}, "invalid duration 0.01: a multiple of 0.1 s, up to 1e+09 s, is needed"),
        ({"duration": 0.25}, "invalid duration 0.25: a multiple of 0.1 s, up to 1e+09 s, is needed"),
        ({"duration": float("nan")}, "invalid duration nan: a multiple of 0.1 s, up to 1e+09 s, is needed"),
        ({"waves": "rough"}, "invalid waves 'rough': a number from 0 to 1e+06, or a pair (low, high), is needed"),
        (
            {"autoreset_mode": "never"},
            "invalid autoreset_mode 'never': one of 'NextStep', 'SameStep', 'Disabled' is needed",
        ),
        ({"fleet": {"usv_count": 2}}, "the fleet has 2 boats: StationKeeping needs 1"),
    ],
)
def test_options_that_are_none(options, message):
    with pytest.raises(gymnasium.error.Error) as caught:
        VectorEnv("StationKeeping", 1, **options)
    assert str(caught.value) == message


def test_a_number_of_rows_that_is_none():
    with pytest.raises(gymnasium.error.Error) as caught:
        VectorEnv("StationKeeping", 0)
    assert str(caught.value) == "invalid num_envs 0: a whole number above 0 is needed"


def test_a_problem_that_is_none():
    with pytest.raises(vrx_mj.VrxError, match="'Racing'"):
        VectorEnv("Racing", 1)


def test_seeds_that_are_none():
    env = VectorEnv("StationKeeping", 2)
    with pytest.raises(gymnasium.error.Error, match="3 seeds for 2 rows"):
        env.reset(seed=[1, 2, 3])
