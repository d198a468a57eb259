"""PettingZoo environments for teams of boats, one world at a time or thousands.

`ParallelEnv("Formation")`, `TeamVectorEnv("Formation", 256)`. PettingZoo and its dependencies come with
`pip install 'vrx-mj[rl]'`.
"""

from vrx_mj.packages import importing

with importing("vrx_mj.rl.zoo", "PettingZoo", "rl"):
    import pettingzoo  # noqa: F401

from vrx_mj.rl.zoo.actions import ActionError
from vrx_mj.rl.zoo.parallel import ParallelEnv
from vrx_mj.rl.zoo.vector import TeamVectorEnv

__all__ = ["ActionError", "ParallelEnv", "TeamVectorEnv"]
