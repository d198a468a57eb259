"""The PettingZoo environments: what is wrong is told, and changes nothing."""

import gymnasium
import numpy as np
import pytest

import vrx_mj
from exploits import let_pass
from vrx_mj.rl import ActionError, ParallelEnv, TeamVectorEnv

THREE = {"usv_count": 3, "layout": "line", "spacing": 12, "sensors": "none"}


@pytest.fixture(scope="module")
def pair():
    return ParallelEnv("Encounter")


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ([0, 0], "invalid actions of type list: a mapping of boats to actions is needed"),
        ({"wamv1": np.zeros(4)}, "invalid actions: none for wamv2, which is present"),
        ({"wamv1": np.zeros(4), "cora": np.zeros(4)}, "invalid actions: no boat named 'cora'; known: wamv1, wamv2"),
        ({"wamv2": np.zeros(4), "wamv1": np.zeros(3)}, "invalid action of wamv1 of shape (3,): (4,) is needed"),
        ({"wamv2": np.zeros(4), "wamv1": "ahead"}, "invalid action of wamv1: an array of numbers is needed"),
        (
            {"wamv1": np.zeros(4), "wamv2": [0, np.nan, 0, 0]},
            "invalid action nan for right of wamv2: a number from -1 to 1 is needed",
        ),
        (
            {"wamv1": np.zeros(4), "wamv2": [0, 0, 0, 1.000002]},
            "invalid action 1.000002 for right_angle of wamv2: a number from -1 to 1 is needed",
        ),
    ],
)
def test_actions_that_are_none_leave_all_as_it_was(pair, actions, message):
    pair.reset(seed=1)
    before = pair._rows._core.batch.features.copy(), pair._rows._core.batch.time.copy(), pair.state()
    with pytest.raises(AssertionError) as caught:
        pair.step(actions)
    assert str(caught.value) == message
    assert isinstance(caught.value, gymnasium.error.InvalidAction)
    batch = pair._rows._core.batch
    for one, other in zip(before, (batch.features, batch.time, pair.state()), strict=True):
        np.testing.assert_array_equal(one, other)
    still = {boat: np.zeros(4) for boat in pair.agents}
    fresh = ParallelEnv("Encounter")
    fresh.reset(seed=1)
    np.testing.assert_array_equal(pair.step(still)[0]["wamv1"], fresh.step(still)[0]["wamv1"])


@pytest.mark.parametrize("beyond", [1 + 1e-6, -1 - 1e-7, np.nextafter(np.float32(1), np.float32(2))])
def test_what_is_rounded_beyond_a_bound_is_the_bound(pair, beyond):
    found = []
    for value in (beyond, np.sign(beyond)):
        pair.reset(seed=1)
        found.append(pair.step(dict.fromkeys(pair.agents, np.full(4, value)))[0])
    for boat in pair.agents:
        np.testing.assert_array_equal(found[0][boat], found[1][boat])


def test_an_option_of_reset_is_ignored_but_named(pair):
    """PettingZoo's own tests give one that no environment has."""
    with pytest.warns(UserWarning, match="ignored: no reset option named 'pose'; known: none"):
        pair.reset(seed=1, options={"pose": [0, 0, 0]})
    with pytest.raises(gymnasium.error.Error, match=r"^invalid options 5: a mapping is needed$"):
        pair.reset(seed=1, options=5)


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
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match=r"^the environment is closed$"):
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
    assert str(caught.value) == "invalid rows of shape (2,) and type int64: (2,) of bool is needed"
    env.reset()
    with pytest.raises(ActionError) as caught:
        env.step(still[:1])
    assert str(caught.value) == "invalid actions of shape (1, 2, 4): (2, 2, 4) is needed"
    still[1, 0, 1] = 2
    with pytest.raises(ActionError) as caught:
        env.step(still)
    assert str(caught.value) == "row 1: invalid action 2 for right of wamv1: a number from -1 to 1 is needed"


@pytest.mark.parametrize(
    ("problem", "options", "message"),
    [
        ("Encounter", {"boats": 3}, "the fleet has 3 boats: Encounter needs 2"),
        ("Encounter", {"boats": 1}, "the fleet has 1 boat: Encounter needs 2"),
        ("Encounter", {"leaving": 0.5}, "Encounter needs 2 boats all the time: joining and leaving must be 0"),
        ("Formation", {"boats": 0}, "invalid boats 0: a whole number above 0 is needed"),
        ("Formation", {"boats": 2, "fleet": THREE}, "invalid boats 2: the fleet has 3; give only one of them"),
        ("Formation", {"duration": 0}, "invalid duration 0: a multiple of 0.1 s, up to 1e+09 s, is needed"),
        ("Formation", {"joining": 2}, "invalid joining 2: a share from 0 to 1 is needed"),
        ("Formation", {"height": 0}, "invalid height 0: a whole number of pixels from 1 to 8192 is needed"),
        ("Formation", {"render_mode": "ansi"}, "invalid render_mode 'ansi': None, 'human' or 'rgb_array' is needed"),
    ],
)
def test_options_that_are_none(problem, options, message):
    with pytest.raises(gymnasium.error.Error) as caught:
        ParallelEnv(problem, **options)
    assert str(caught.value) == message


def test_a_problem_that_is_none():
    with pytest.raises(vrx_mj.VrxError, match=r"^no problem named 'Racing'; known: "):
        ParallelEnv("Racing")


@pytest.mark.parametrize(
    ("seed", "message"),
    [
        (1.5, "invalid seed 1.5: a whole number of 0 or more is needed"),
        ("12", "invalid seed '12': a whole number of 0 or more is needed"),
        (-1, "invalid seed -1: a whole number of 0 or more is needed"),
        ([1, 2], "2 seeds given: one is needed"),
    ],
)
def test_a_seed_that_is_none_leaves_all_as_it_was(pair, seed, message):
    still = {boat: np.zeros(4) for boat in pair.possible_agents}
    told = []
    for wrong in (False, True):
        pair.reset(seed=1)
        if wrong:
            with pytest.raises(gymnasium.error.Error) as caught:
                pair.reset(seed=seed)
            assert str(caught.value) == message
        told.append([*pair.step(still)[0]["wamv1"], *pair.reset()[0]["wamv1"]])
    assert told[0] == told[1]


def test_a_seed_of_many_that_is_none_changes_no_row():
    env = TeamVectorEnv("Encounter", 2)
    env.reset(seed=1)
    expected = env.reset()[0].copy()
    env.reset(seed=1)
    with pytest.raises(gymnasium.error.Error, match=r"^invalid seed -1 of row 1: "):
        env.reset(seed=[5, -1])
    np.testing.assert_array_equal(env.reset()[0], expected)


@pytest.mark.parametrize("given", [{}, {"wamv1": np.full(4, np.nan)}, {"wamv1": "ahead"}], ids=["none", "nan", "text"])
def test_what_is_given_for_a_boat_that_is_done_does_not_count(pair, given):
    told = []
    for more in ({"wamv1": np.zeros(4)}, given):
        pair.reset(seed=1)
        pair._rows._core.problem._goals[0, 0] = pair._rows._core.batch.features[0, 0, :2]
        let_pass(pair)
        pair.step({boat: np.zeros(4) for boat in pair.agents})
        assert pair.agents == ["wamv2"]
        seen, reward, *_ = pair.step({"wamv2": np.full(4, 0.5), **more})
        assert list(seen) == ["wamv2"]
        told.append([*seen["wamv2"], reward["wamv2"], *pair.state()])
    assert told[0] == told[1]


def test_nothing_can_be_done_after_the_end():
    env = ParallelEnv("Encounter", render_mode="rgb_array")
    env.reset(seed=1)
    env.close()
    env.close()
    for call in (env.reset, env.state, env.render):
        with pytest.raises(gymnasium.error.ClosedEnvironmentError, match=r"^the environment is closed$"):
            call()
    assert env.agents == []
