"""Every registered environment as rows, against Gymnasium's own vectorisation of single ones: all that is returned."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import RenderCollection

import vrx_mj.rl  # noqa: F401
from integration.returned import plain
from integration.variety import variety
from vrx_mj.rl import VectorEnv
from vrx_mj.rl.options import PERIOD
from vrx_mj.rl.problems import PROBLEMS

IDS = sorted(name for name in gymnasium.registry if name.startswith("vrx_mj/"))
ROWS = 4
DIVERGES, LATE = 2, 1
"""A row that diverges, and one whose episodes begin later than those of the others."""
VARIED = {"wind_speed": (0, 6), "gusts": 1, "waves": (0.2, 1), "thrust": (0.8, 1.1), "mass": (0.9, 1.1)}


def problem_of(name):
    return name.removeprefix("vrx_mj/").removesuffix("-v0")


def varied(name):
    return variety(problem_of(name), VARIED)


def pair(name, mode, **options):
    """The rows, and Gymnasium's own vectorisation of as many single environments."""
    ours = gymnasium.make_vec(name, num_envs=ROWS, autoreset_mode=mode, **options)
    theirs = gymnasium.make_vec(
        name, num_envs=ROWS, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **options
    )
    return ours, theirs


def batches(env):
    """The `Batch` of each row, and the number of the row in it."""
    if isinstance(env, VectorEnv):
        return [(env._core.batch, row) for row in range(ROWS)]
    return [(one.unwrapped._rows._core.batch, 0) for one in env.envs]


def played(env, steps=14):
    """What was returned, and the same as it reads after all steps."""
    random, masked = np.random.default_rng(5), np.arange(ROWS) == LATE
    returned = [env.reset(seed=3)]
    copies = [plain(returned[0])]
    for step in range(steps):
        if step == 2:
            returned.append(env.reset(options={"reset_mask": masked.copy()}))
        if step == 3:
            batch, row = batches(env)[DIVERGES]
            batch.set_boat(batch.boats[0], velocity=(9e6, 0, 0, 0, 0, 9e6), rows=[row])
        action = random.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        returned.append(env.step(action))
        ended = returned[-1][2] | returned[-1][3]
        if env.metadata["autoreset_mode"] is AutoresetMode.DISABLED and ended.any():
            returned.append(env.reset(options={"reset_mask": ended.copy()}))
        copies += [plain(one) for one in returned[len(copies) :]]
    return returned, copies


def bootstraps(returned):
    """How many values of last observations a learner adds: Gymnasium's masks of those that were truncated."""
    return sum(int((one[4]["_final_obs"] & one[3]).sum()) for one in returned if "_final_obs" in one[-1])


@pytest.mark.parametrize(
    ("name", "mode"),
    [*((IDS[0], mode) for mode in AutoresetMode), *((name, AutoresetMode.SAME_STEP) for name in IDS[1:])],
)
def test_rows_return_what_gymnasium_s_own_vectorisation_returns(name, mode):
    """Observations, rewards, ends, and every key of `info` with its mask, type and nesting, over ends of all kinds."""
    ours, theirs = pair(name, mode, max_episode_steps=5, **varied(name))
    for space in ("observation_space", "action_space", "single_observation_space", "single_action_space"):
        assert getattr(ours, space) == getattr(theirs, space)
    (found, seen), (expected, wanted) = played(ours), played(theirs)
    for number, (one, other) in enumerate(zip(seen, wanted, strict=True)):
        assert one == other, f"call {number}"
    assert [plain(one) for one in found] == seen, "what was returned changed afterwards"
    steps = [one for one in expected if len(one) == 5]
    assert any(one[2].any() for one in steps)
    assert any(one[3].any() and not one[3].all() for one in steps)
    assert bootstraps(found) == bootstraps(expected)
    assert (bootstraps(expected) > 0) == (mode is AutoresetMode.SAME_STEP)
    ours.close()
    theirs.close()


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
@pytest.mark.parametrize("name", IDS)
def test_what_is_pickled_continues(name, make):
    """Over the end of an episode, of rows that were drawn apart."""
    env = make(name, max_episode_steps=5, **varied(name))
    random = np.random.default_rng(5)
    actions = random.uniform(-1, 1, (7, *env.action_space.shape)).astype(np.float32)
    env.reset(seed=3)
    for action in actions[:3]:
        env.step(action)
    other = pickle.loads(pickle.dumps(env))
    for action in actions[3:5]:
        assert plain(other.step(action)) == plain(env.step(action))
    assert plain(other.reset()) == plain(env.reset())
    for action in actions[5:]:
        assert plain(other.step(action)) == plain(env.step(action))
    env.close()
    other.close()


@pytest.mark.slow
@pytest.mark.render
@pytest.mark.parametrize("mode", AutoresetMode)
def test_lists_of_pictures_are_those_that_gymnasium_collects(mode):
    """Of rows whose episodes end at different steps, and of single ones, as `RenderCollection` keeps them."""
    options = {"width": 32, "height": 24, "max_episode_steps": 4}
    ours = gymnasium.make_vec(IDS[-1], num_envs=2, autoreset_mode=mode, render_mode="rgb_array_list", **options)
    one = [lambda: RenderCollection(gymnasium.make(IDS[-1], render_mode="rgb_array", **options))]
    theirs = SyncVectorEnv(one * 2, autoreset_mode=mode)
    late = {"reset_mask": np.array([False, True])}
    for env in (ours, theirs):
        env.reset(seed=3)
    for step in range(7):
        for env in (ours, theirs):
            if step == 2:
                env.reset(options=dict(late))
            ended = np.logical_or(*env.step(np.zeros((2, 4), np.float32))[2:4])
            if mode is AutoresetMode.DISABLED and ended.any():
                env.reset(options={"reset_mask": ended})
        if step in {1, 4, 6}:
            found, expected = ours.render(), theirs.render()
            assert [len(film) for film in found] == [len(film) for film in expected]
            for film, other in zip(found, expected, strict=True):
                np.testing.assert_array_equal(film, other)
            assert ours.render() == ([], [])


# What Gymnasium and stable-baselines3 check of single ones


@pytest.mark.render
def test_gymnasium_s_checker_draws_too(recwarn):
    env = gymnasium.make(IDS[-1], width=32, height=24)
    check_env(env.unwrapped)
    env.close()
    assert not [str(item.message) for item in recwarn]


@pytest.mark.render
def test_an_environment_that_was_drawn_and_closed_is_opened_by_its_reset():
    """As `check_env` of stable-baselines3 uses it: drawn, closed, then reset and stepped."""
    env = gymnasium.make(IDS[-1], render_mode="rgb_array", width=32, height=24)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    assert (env.render_mode, env.metadata["render_modes"]) == ("rgb_array", ["rgb_array", "rgb_array_list"])
    before = env.render()
    env.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match=r"^the environment is closed$"):
        env.step(env.action_space.sample())
    observation, _ = env.reset()
    for _ in range(10):
        assert np.isfinite(observation).all()
        observation, reward, done, cut, info = env.step(env.action_space.sample())
        assert (type(reward), type(done), type(cut), type(info)) == (float, bool, bool, dict)
    picture = env.render()
    assert (picture.shape, picture.dtype) == (before.shape, before.dtype) == ((24, 32, 3), np.uint8)
    env.close()


# How long episodes are


def length(env, most):
    """Steps until the first episode ends; None if it goes on for `most`."""
    env.reset(seed=1)
    still = np.zeros(env.action_space.shape, np.float32)
    for number in range(most):
        _, _, done, cut, _ = env.step(still)
        assert not np.any(done)
        if np.any(cut):
            return number + 1
    return None


def lengths(name, most, **options):
    """Those of a single environment, of rows, and of Gymnasium's vectorisation of single ones."""
    made = (
        gymnasium.make(name, **options),
        gymnasium.make_vec(name, num_envs=1, threads=1, **options),
        gymnasium.make_vec(name, num_envs=1, vectorization_mode="sync", **options),
    )
    return {length(env, most) for env in made}


@pytest.mark.parametrize("name", IDS)
def test_the_registered_number_of_steps_is_the_duration_of_the_problem(name):
    kind = PROBLEMS[problem_of(name)]
    registered = gymnasium.spec(name).max_episode_steps
    assert registered * PERIOD == pytest.approx(kind.duration)
    for env in (gymnasium.make(name), gymnasium.make_vec(name, num_envs=1)):
        assert env.spec.max_episode_steps == registered


@pytest.mark.slow
def test_episodes_are_as_long_as_what_makes_them_says():
    name, registered = "vrx_mj/StationKeeping-v0", 600
    assert lengths(name, 602) == {registered}
    assert lengths(name, 602, max_episode_steps=601) == {601}
    assert lengths(name, 602, max_episode_steps=-1) == {None}
    assert lengths(name, 9, max_episode_steps=4) == {4}
    assert lengths(name, 9, duration=0.3) == {3}
    assert lengths(name, 9, duration=0.3, max_episode_steps=4) == {3}
    assert lengths(name, 9, duration=0.3, max_episode_steps=-1) == {3}
    again = gymnasium.make(gymnasium.make(name, duration=0.5, max_episode_steps=8).spec)
    assert (length(again, 9), again.spec.max_episode_steps) == (5, 8)
    assert length(VectorEnv("StationKeeping", 1, duration=60.1), 602) == 601


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_a_duration_that_gymnasium_would_cut_short_is_refused(make):
    with pytest.raises(gymnasium.error.Error) as caught:
        make("vrx_mj/StationKeeping-v0", duration=90)
    assert str(caught.value) == (
        "invalid duration 90: max_episode_steps=600 truncates an episode after 60 s; "
        "give max_episode_steps=900 instead"
    )  # fmt: skip


@pytest.mark.parametrize("steps", [0, -2, 1.5, True, "many"])
def test_numbers_of_steps_that_are_none(steps):
    with pytest.raises(gymnasium.error.Error) as caught:
        VectorEnv("StationKeeping", 1, max_episode_steps=steps)
    assert str(caught.value) == (
        f"invalid max_episode_steps {steps!r}: a whole number above 0 is needed, or -1 for no limit"
    )
