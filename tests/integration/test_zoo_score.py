"""Any world with a task as a PettingZoo environment: the referee's score, and the row that it watches."""

import warnings

import gymnasium
import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

import vrx_mj
from vrx_mj.rl import ParallelEnv
from vrx_mj.rl.problem import RefereedRow

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


def test_a_world_s_task_passes_the_checkers_too():
    more = {"world": HELD, "boats": 3, "reward": "team", **MOVING}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*ignored: no reset option named 'options'")  # which PettingZoo's test gives
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
    assert [one.qpos.flags.writeable for one in (row, batch)] == [False, False]
    np.testing.assert_allclose(row.features, batch.features, atol=1e-13)  # numpy and the kernel round body axes unlike


def test_rewards_add_up_to_the_referee_s_score():
    """The same commands in a `Simulation` alone get the same score, and what all were given adds up to it."""
    env = ParallelEnv("Score", world=HELD, boats=2, delay=0.0)
    env.reset(seed=3)
    world = vrx_mj.compile_world(
        HELD, fleet={"usv_count": 2, "layout": "line", "spacing": 12, "origin": "spawn", "sensors": "none"}
    )
    sim = vrx_mj.Simulation(world)
    sim.reset(seed=env._rows._core.batch.sim.seed)
    sums, ended = {"wamv1": 0.0, "wamv2": 0.0}, {}
    batch = env._rows._core.batch
    names = [name for boat, name in batch.channels if boat == "wamv1"]
    greatest = [limit[1] for (boat, _), limit in zip(batch.channels, batch.largest, strict=True)
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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "Score: give a world with a task"),
        ({"world": "ocean"}, "Score: the world ocean has no task"),
        ({"world": HELD, "waves": 1}, "Score has no option waves: its world cannot be varied"),
        ({"world": HELD, "wave": 1}, "Score has no option wave"),
    ],
)
def test_scores_that_are_none(options, message):
    with pytest.raises(gymnasium.error.Error) as caught:
        ParallelEnv("Score", **options)
    assert str(caught.value) == message
