"""The Gymnasium environments in processes of Gymnasium's own: as alone, to the last bit, however they are started."""

import functools
import multiprocessing

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

from vrx_mj.rl import VectorEnv

ID = "vrx_mj.rl:vrx_mj/StationKeeping-v0"
OPTIONS = {"duration": 0.5, "waves": (0, 1), "wind_speed": (0, 6)}

pytestmark = pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")


def sailed(env, steps=8):
    """Observations, rewards and ends of a run, past the end of an episode."""
    rng = np.random.default_rng(5)
    found = [env.reset(seed=3)[0].copy()]
    for _ in range(steps):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        found += [np.array(told) for told in env.step(action)[:4]]
    env.close()
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("start", "rows"), [("fork", 3), ("spawn", 1)])
def test_processes_do_what_rows_do(start, rows):
    """A spawned one knows nothing of ours before it makes the environment, whose id names the module to import."""
    if start not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {start} here")
    VectorEnv("StationKeeping", 20, threads=2).reset(seed=1)  # threads that a fork does not copy
    ours = sailed(VectorEnv("StationKeeping", rows, threads=2, **OPTIONS))
    apart = sailed(AsyncVectorEnv([functools.partial(gymnasium.make, ID, **OPTIONS)] * rows, context=start))
    for one, other in zip(ours, apart, strict=True):
        np.testing.assert_array_equal(one, other)


def test_gymnasium_makes_processes_of_an_id():
    kinds = {"async": AsyncVectorEnv, "vector_entry_point": VectorEnv}
    found = []
    for mode, kind in kinds.items():
        env = gymnasium.make_vec(ID, num_envs=2, vectorization_mode=mode, **OPTIONS)
        assert isinstance(env, kind)
        found.append(sailed(env))
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)
