"""The learning problems by name: each has one row here."""

from vrx_mj.rl.problem import Problem
from vrx_mj.rl.problems.courses import FollowPath, StationKeeping, Wayfinding
from vrx_mj.rl.problems.docking import Docking
from vrx_mj.rl.problems.encounter import Encounter
from vrx_mj.rl.problems.fleets import Formation, Rendezvous
from vrx_mj.rl.problems.score import Score

__all__ = ["ALONE", "PROBLEMS", "SCORE", "TEAMS"]

PROBLEMS: dict[str, type[Problem]] = {
    "StationKeeping": StationKeeping,
    "Wayfinding": Wayfinding,
    "FollowPath": FollowPath,
    "Docking": Docking,
    "Formation": Formation,
    "Rendezvous": Rendezvous,
    "Encounter": Encounter,
    "Score": Score,
}
SCORE = "Score"
"""The problem that is a world's own task; it needs a referee."""
ALONE = tuple(name for name, kind in PROBLEMS.items() if kind.fixed and kind.boats == 1)
"""Problems for one boat: environments of Gymnasium."""
TEAMS = tuple(name for name in PROBLEMS if name not in {*ALONE, SCORE})
"""Problems for teams: environments of PettingZoo, as `SCORE` is."""
