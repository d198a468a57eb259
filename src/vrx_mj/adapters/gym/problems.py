"""The problems by name."""

from vrx_mj.adapters.gym.docking import Docking
from vrx_mj.adapters.gym.follow_path import FollowPath
from vrx_mj.adapters.gym.problem import Problem
from vrx_mj.adapters.gym.stationkeeping import StationKeeping
from vrx_mj.adapters.gym.wayfinding import Wayfinding

__all__ = ["PROBLEMS"]

PROBLEMS: dict[str, type[Problem]] = {
    "StationKeeping": StationKeeping,
    "Wayfinding": Wayfinding,
    "FollowPath": FollowPath,
    "Docking": Docking,
}
