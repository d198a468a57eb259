"""The problems for teams by name."""

from vrx_mj.rl.zoo.encounter import Encounter
from vrx_mj.rl.zoo.formation import Formation
from vrx_mj.rl.zoo.rendezvous import Rendezvous
from vrx_mj.rl.zoo.team import TeamProblem

__all__ = ["PROBLEMS"]

PROBLEMS: dict[str, type[TeamProblem]] = {
    "Formation": Formation,
    "Rendezvous": Rendezvous,
    "Encounter": Encounter,
}
