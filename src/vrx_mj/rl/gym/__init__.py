"""Gymnasium environments with one boat each, one at a time or thousands; importing this package registers them.

`gymnasium.make("vrx_mj.rl.gym:vrx_mj/StationKeeping-v0")`, `gymnasium.make_vec(..., num_envs=256)`. Gymnasium and
its dependencies come with `pip install 'vrx-mj[rl]'`.
"""

from vrx_mj.packages import importing

with importing("vrx_mj.rl.gym", "Gymnasium", "rl"):
    import gymnasium

from vrx_mj.rl.gym.options import episode_steps
from vrx_mj.rl.gym.problems import PROBLEMS
from vrx_mj.rl.gym.single import Env
from vrx_mj.rl.gym.vector import VectorEnv

__all__ = ["Env", "VectorEnv"]

for _name, _problem in PROBLEMS.items():
    gymnasium.register(
        f"vrx_mj/{_name}-v0",
        entry_point="vrx_mj.rl.gym.single:RegisteredEnv",
        vector_entry_point="vrx_mj.rl.gym.vector:VectorEnv",
        max_episode_steps=episode_steps(_problem.duration),
        kwargs={"problem": _name},
    )
