"""Learning: Gymnasium environments with one boat, PettingZoo environments with a team, one at a time or thousands.

To import this package registers the Gymnasium environments: `gymnasium.make("vrx_mj.rl:vrx_mj/StationKeeping-v0")`,
`gymnasium.make_vec(..., num_envs=256)`; `ParallelEnv("Formation")`, `TeamVectorEnv("Formation", 256)`. Gymnasium,
PettingZoo and their dependencies come with `pip install '.[rl]'` in a clone.
"""

from typing import TYPE_CHECKING, Any

from vrx_mj.packages import importing

with importing("vrx_mj.rl", "Gymnasium", "rl"):
    from vrx_mj.rl.gym import Env, VectorEnv

if TYPE_CHECKING:
    from vrx_mj.rl.options import ActionError
    from vrx_mj.rl.zoo import ParallelEnv, TeamVectorEnv

__all__ = ["ActionError", "Env", "ParallelEnv", "TeamVectorEnv", "VectorEnv"]


def __getattr__(name: str) -> Any:
    """Import a name that needs PettingZoo at its first use."""
    if name in __all__:
        from vrx_mj.rl import zoo

        return getattr(zoo, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
