"""The learning problems by name."""

from vrx_mj.rl.problem import Problem
from vrx_mj.rl.problems.docking import Docking
from vrx_mj.rl.problems.encounter import Encounter
from vrx_mj.rl.problems.follow_path import FollowPath
from vrx_mj.rl.problems.formation import Formation
from vrx_mj.rl.problems.rendezvous import Rendezvous
from vrx_mj.rl.problems.stationkeeping import StationKeeping
from vrx_mj.rl.problems.wayfinding import Wayfinding
from vrx_mj.rl.team import TeamProblem

__all__ = ["ALONE", "TEAMS"]

ALONE: dict[str, type[Problem]] = {
    "StationKeeping": StationKeeping,
    "Wayfinding": Wayfinding,
    "FollowPath": FollowPath,
    "Docking": Docking,
}
"""Problems for one boat."""
TEAMS: dict[str, type[TeamProblem]] = {
    "Formation": Formation,
    "Rendezvous": Rendezvous,
    "Encounter": Encounter,
}
"""Problems for teams."""
