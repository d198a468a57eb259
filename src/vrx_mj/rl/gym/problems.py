"""The problems by name."""

from vrx_mj.rl.gym.docking import Docking
from vrx_mj.rl.gym.follow_path import FollowPath
from vrx_mj.rl.gym.problem import Problem
from vrx_mj.rl.gym.stationkeeping import StationKeeping
from vrx_mj.rl.gym.wayfinding import Wayfinding

__all__ = ["PROBLEMS"]

PROBLEMS: dict[str, type[Problem]] = {
    "StationKeeping": StationKeeping,
    "Wayfinding": Wayfinding,
    "FollowPath": FollowPath,
    "Docking": Docking,
}
