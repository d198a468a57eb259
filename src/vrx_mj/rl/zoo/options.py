"""Options of the environments for teams, checked."""

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from vrx_mj.errors import shown
from vrx_mj.rl.gym.options import PERIOD, is_number
from vrx_mj.rl.zoo.neighbours import Eyes

__all__ = ["RENDER_MODES", "chance", "eyes_of", "team_share"]

RENDER_MODES = ["human", "rgb_array"]


MOST_NEIGHBOURS = 10_000
LONGEST_DELAY = 3600.0
"""Of what boats see of each other [s]."""


def eyes_of(neighbours: Any, reach: Any, noise: Any, delay: Any) -> Eyes:
    """How boats see each other; gymnasium.error.Error: an option is none."""
    if not isinstance(neighbours, int | np.integer) or neighbours < 0:
        raise gymnasium.error.Error(f"invalid neighbours {shown(neighbours)}: a whole number of 0 or more is needed")
    if neighbours > MOST_NEIGHBOURS:
        raise gymnasium.error.Error(f"invalid neighbours {shown(neighbours)}: at most {MOST_NEIGHBOURS} are possible")
    if not is_number(reach) or reach <= 0.0:
        raise gymnasium.error.Error(f"invalid range {shown(reach)}: a number of metres above 0 is needed")
    given = tuple(noise) if isinstance(noise, Sequence | np.ndarray) else ()
    if len(given) != 3 or not all(is_number(one) and one >= 0.0 for one in given):
        text = "three numbers of 0 or more are needed, of places [m], velocities [m/s] and headings [rad]"
        raise gymnasium.error.Error(f"invalid noise {shown(noise)}: {text}")
    if (
        not is_number(delay)
        or not 0.0 <= delay <= LONGEST_DELAY
        or not math.isclose(delay / PERIOD, round(delay / PERIOD), abs_tol=1e-6)
    ):
        raise gymnasium.error.Error(
            f"invalid delay {shown(delay)}: a multiple of {PERIOD:g} s, up to {LONGEST_DELAY:g} s, is needed"
        )
    return Eyes(
        int(neighbours), float(reach), (float(given[0]), float(given[1]), float(given[2])), round(delay / PERIOD)
    )


def chance(name: str, value: Any) -> float:
    """A share of boats; gymnasium.error.Error: not from 0 to 1."""
    if not is_number(value) or not 0.0 <= value <= 1.0:
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: a share from 0 to 1 is needed")
    return float(value)


def team_share(reward: Any) -> float:
    """The team's share of what a boat is given, from the option `reward`; gymnasium.error.Error: it is none."""
    if isinstance(reward, str) and reward in {"team", "individual"}:
        return float(reward == "team")
    if not is_number(reward) or not 0.0 <= reward <= 1.0:
        text = "'team', 'individual' or the team's share, from 0 to 1, is needed"
        raise gymnasium.error.Error(f"invalid reward {shown(reward)}: {text}")
    return float(reward)
