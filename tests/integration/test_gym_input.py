"""The Gymnasium environments: what is wrong is told as Gymnasium tells it, and changes nothing."""

import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, Error, InvalidAction, ResetNeeded
from gymnasium.wrappers import RescaleAction

from vrx_mj.errors import UnknownNameError
from vrx_mj.rl import Env, VectorEnv

HALF = np.full(4, 0.5, np.float32)
SEED = "a whole number of 0 or more is needed"


@pytest.fixture(scope="module")
def env():
    return Env("StationKeeping")


@pytest.fixture(scope="module")
def rows():
    return VectorEnv("StationKeeping", 2)


def onward(env, action):
    """What the next step, and the episode after it, are like."""
    observation, reward, *_ = env.step(action)
    return [*observation.ravel(), *np.atleast_1d(reward), *env.reset()[0].ravel()]


@pytest.fixture(scope="module")
def undisturbed(env, rows):
    env.reset(seed=1)
    rows.reset(seed=1)
    return onward(env, HALF), onward(rows, [HALF, HALF])


ALONE = [
    ([0, 0, 0], "invalid action of shape (3,): (4,) is needed"),
    ([[0, 0, 0, 0]], "invalid action of shape (1, 4): (4,) is needed"),
    (None, "invalid action of shape (): (4,) is needed"),
    ("ahead", "invalid action: an array of numbers is needed"),
    ({"left": 1}, "invalid action: an array of numbers is needed"),
    ([0, [0], 0, 0], "invalid action: an array of numbers is needed"),
    ([0, np.nan, 0, 0], "invalid action nan for right of wamv: a number from -1 to 1 is needed"),
    ([0, 0, 0, -np.inf], "invalid action -inf for right_angle of wamv: a number from -1 to 1 is needed"),
    ([1.000002, 0, 0, 0], "invalid action 1.000002 for left of wamv: a number from -1 to 1 is needed"),
    ([1.5, 0, 0, 0], "invalid action 1.5 for left of wamv: a number from -1 to 1 is needed"),
]
MANY = [
    ([0, 0, 0, 0], "invalid actions of shape (4,): (2, 4) is needed"),
    ("ahead", "invalid actions: an array of numbers is needed"),
    ([HALF, [0, 0, 0]], "invalid actions: an array of numbers is needed"),
    ([HALF, [0, 0, np.nan, 0]], "row 1: invalid action nan for left_angle of wamv: a number from -1 to 1 is needed"),
]


@pytest.mark.parametrize(("action", "message"), ALONE)
def test_an_action_that_is_none(env, undisturbed, action, message):
    env.reset(seed=1)
    with pytest.raises(InvalidAction) as caught:
        env.step(action)
    assert str(caught.value) == message
    assert onward(env, HALF) == undisturbed[0]


@pytest.mark.parametrize("beyond", [1 + 1e-6, -1 - 1e-7, np.nextafter(np.float32(1), np.float32(2))])
def test_what_is_rounded_beyond_a_bound_is_the_bound(env, rows, beyond):
    for made, shape in ((env, (4,)), (rows, (2, 4))):
        found = []
        for value in (beyond, np.sign(beyond)):
            made.reset(seed=1)
            found.append(onward(made, np.full(shape, value)))
        assert found[0] == found[1]


def test_every_bound_of_a_rescaled_space_is_an_action(env):
    """Gymnasium's wrapper computes in float32: one bound in six came out one bit beyond."""
    env.reset(seed=1)
    for low, high in np.sort(np.random.default_rng(0).uniform(-20, 20, (100, 2)).round(2).astype(np.float32)):
        rescaled = RescaleAction(env, low, high)
        for action in (rescaled.action_space.low, rescaled.action_space.high):
            rescaled.step(action)


OPTIONS = [
    ({"pose": [0, 0, 0]}, UnknownNameError, "no reset option named 'pose'; known: "),
    ({"reset_masks": None}, UnknownNameError, "no reset option named 'reset_masks'; "),
    ({3: None}, UnknownNameError, "no reset option named '3'; known: "),
    ([1], Error, "invalid options [1]: a mapping is needed"),
]


@pytest.mark.parametrize(("options", "kind", "message"), OPTIONS)
def test_options_of_reset_that_are_none(env, rows, undisturbed, options, kind, message):
    for made, known in ((env, "none"), (rows, "reset_mask")):
        made.reset(seed=1)
        with pytest.raises(kind) as caught:
            made.reset(seed=9, options=options)
        assert str(caught.value).startswith(message)
        assert kind is Error or known in str(caught.value)
    assert onward(env, HALF) == undisturbed[0]
    assert onward(rows, [HALF, HALF]) == undisturbed[1]


@pytest.mark.parametrize(("actions", "message"), MANY)
def test_actions_that_are_none(rows, undisturbed, actions, message):
    rows.reset(seed=1)
    with pytest.raises(InvalidAction) as caught:
        rows.step(actions)
    assert str(caught.value) == message
    assert onward(rows, [HALF, HALF]) == undisturbed[1]


@pytest.mark.parametrize("given", [HALF.astype(np.float64), HALF.astype(np.float16), HALF.tolist(), tuple(HALF)])
def test_numbers_are_numbers_whatever_holds_them(env, undisturbed, given):
    env.reset(seed=1)
    assert onward(env, given) == undisturbed[0]


@pytest.mark.parametrize(
    ("seed", "message"),
    [
        (1.5, f"invalid seed 1.5: {SEED}, or one for each of 2 rows"),
        ("12", f"invalid seed '12': {SEED}, or one for each of 2 rows"),
        ({1, 2}, f"invalid seed {{1, 2}}: {SEED}, or one for each of 2 rows"),
        (-1, f"invalid seed -1 of row 0: {SEED}"),
        ([5, -1], f"invalid seed -1 of row 1: {SEED}"),
        ([5, "a"], f"invalid seed 'a' of row 1: {SEED}"),
        ([5, 1.5], f"invalid seed 1.5 of row 1: {SEED}"),
        ([5], "1 seeds for 2 rows: one seed, or one for each row, is needed"),
    ],
)
def test_seeds_that_are_none(rows, undisturbed, seed, message):
    rows.reset(seed=1)
    with pytest.raises(Error) as caught:
        rows.reset(seed=seed)
    assert str(caught.value) == message
    assert onward(rows, [HALF, HALF]) == undisturbed[1]


@pytest.mark.parametrize("seed", [1.5, "12", -1])
def test_a_seed_that_is_none(env, undisturbed, seed):
    env.reset(seed=1)
    with pytest.raises(Error, match=r"^Seed must be "):  # Gymnasium's own words
        env.reset(seed=seed)
    assert onward(env, HALF) == undisturbed[0]


def test_seeds_of_numpy_are_seeds(rows):
    expected = rows.reset(seed=[3, 4])[0].copy()
    for seed in (np.int64(3), np.arange(3, 5), (3, 4), range(3, 5)):
        np.testing.assert_array_equal(rows.reset(seed=seed)[0], expected)


def test_a_mask_that_is_none(rows, undisturbed):
    rows.reset(seed=1)
    with pytest.raises(Error) as caught:
        rows.reset(seed=9, options={"reset_mask": [1, 0]})
    assert str(caught.value) == "invalid reset_mask of shape (2,) and type int64: (2,) of bool is needed"
    assert onward(rows, [HALF, HALF]) == undisturbed[1]


@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
def test_rows_that_were_never_reset_do_not_sail(mode):
    """A first reset of some rows leaves the others without an episode."""
    rows = VectorEnv("StationKeeping", 2, autoreset_mode=mode)
    rows.reset(seed=1, options={"reset_mask": np.array([True, False])})
    if mode == "Disabled":
        with pytest.raises(ResetNeeded, match=r"^the episodes of rows \[1\] have ended or have not begun: "):
            rows.step([HALF, HALF])
        return
    seen, reward, *_ = rows.step([HALF, HALF])  # begins the episode of row 1
    np.testing.assert_array_equal(seen[1], VectorEnv("StationKeeping", 2).reset(seed=1)[0][1])
    assert reward[0] < 0.0 == reward[1]


def test_order_of_calls():
    env = Env("StationKeeping", duration=0.1, render_mode="rgb_array", width=32, height=32)
    for call in (lambda: env.step(HALF), env.render):
        with pytest.raises(ResetNeeded) as caught:
            call()
        assert str(caught.value) == "call reset() before step() or render()"
    env.reset(seed=1)
    assert env.step(HALF)[3]
    with pytest.raises(ResetNeeded) as caught:
        env.step(HALF)
    assert str(caught.value) == "the episode has ended: call reset()"
    env.close()
    env.close()
    for call in (lambda: env.step(HALF), env.render):
        with pytest.raises(ClosedEnvironmentError, match=r"^the environment is closed$"):
            call()
    env.reset(seed=1)
    assert env.step(HALF)[3]
