"""Options of the environments, checked."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

import gymnasium
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_number, check_name
from vrx_mj.arrays import BoolArray
from vrx_mj.errors import shown
from vrx_mj.rl.neighbours import NeighbourView

PERIOD = 0.1
"""Duration of an action [s]: 10 physics steps."""
_ROUNDING = 1e-6
"""An action so near to a bound is the bound: wrappers compute actions, and round them."""
_LONGEST = 1e9
"""Longest duration of an episode [s]."""
_ENDLESS = 1 << 60
"""Steps of an episode that is not truncated."""
_MOST = 1_000_000
"""Greatest number of rows."""
_LARGEST = 8192
"""Greatest width and height of a picture [pixels]."""
_MOST_NEIGHBOURS = 10_000
"""Greatest number of neighbours that are observed."""
_LONGEST_DELAY = 3600.0
"""Longest delay of what boats observe of each other [s]."""


class ActionError(gymnasium.error.InvalidAction, AssertionError):
    """An invalid action: an AssertionError, as in PettingZoo, and an InvalidAction, as in Gymnasium."""


def episode_steps(duration: object) -> int:
    """Steps of an episode; gymnasium.error.Error: its duration [s] is invalid."""
    if not is_number(duration) or duration < PERIOD:
        raise gymnasium.error.Error(f"invalid duration {shown(duration)}: a number of {PERIOD:g} s or more is needed")
    if duration > _LONGEST:
        raise gymnasium.error.Error(f"invalid duration {shown(duration)}: at most {_LONGEST:g} s")
    return round(float(duration) / PERIOD)


def step_limit(duration: object, most: object, default: float) -> int:
    """Steps after which an episode is truncated.

    Args:
        duration: of an episode [s], or None.
        most: Gymnasium's `max_episode_steps`, -1 for no such number, or None.
        default: duration [s] where neither is given.

    Raises:
        gymnasium.error.Error: one of both is invalid, or the duration is longer than so many steps.
    """
    if most is None:
        return episode_steps(default if duration is None else duration)
    if not isinstance(most, int | np.integer) or isinstance(most, bool) or (most < 1 and most != -1):
        text = "a whole number above 0 is needed, or -1 for no limit"
        raise gymnasium.error.Error(f"invalid max_episode_steps {shown(most)}: {text}")
    limit = _ENDLESS if most == -1 else min(int(most), _ENDLESS)
    steps = limit if duration is None else episode_steps(duration)
    if steps > limit:
        text = f"truncates an episode after {limit * PERIOD:g} s; give max_episode_steps={steps} instead"
        raise gymnasium.error.Error(f"invalid duration {shown(duration)}: max_episode_steps={limit} {text}")
    return steps


def check_count(name: str, value: object) -> None:
    """gymnasium.error.Error: the option of that name is not a whole number from 1 to a million."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 1:
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: a whole number above 0 is needed")
    if value > _MOST:
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: at most {_MOST} are possible")


def check_picture(mode: object, modes: Sequence[str], width: object, height: object) -> None:
    """gymnasium.error.Error: `mode` is not one of the ways to draw, or pictures have no such size [pixels]."""
    if mode is not None and not (isinstance(mode, str) and mode in modes):
        possible = ", ".join(["None", *map(repr, modes[:-1])])
        raise gymnasium.error.Error(f"invalid render_mode {shown(mode)}: {possible} or {modes[-1]!r} is needed")
    for name, size in (("width", width), ("height", height)):
        if not isinstance(size, int | np.integer) or isinstance(size, bool) or not 1 <= size <= _LARGEST:
            text = f"a whole number of pixels from 1 to {_LARGEST} is needed"
            raise gymnasium.error.Error(f"invalid {name} {shown(size)}: {text}")


def reset_options(options: object, *known: str) -> Mapping[str, Any]:
    """What `reset` was given.

    Raises:
        gymnasium.error.Error: it is not a mapping.
        UnknownNameError: an option is unknown.
    """
    given = {} if options is None else options
    if not isinstance(given, Mapping):
        raise gymnasium.error.Error(f"invalid options {shown(options)}: a mapping is needed")
    for name in given:
        check_name("reset option", name, known)
    return given


def is_number(value: object) -> TypeGuard[float]:
    """Whether it is a finite number."""
    return isinstance(value, int | float | np.integer | np.floating) and math.isfinite(as_number(value))


def as_actions(action: object, name: str = "action") -> npt.NDArray[np.float32]:
    """Actions as an array, from -1 to 1 and beyond; ActionError: some values are not numbers."""
    try:
        with np.errstate(over="ignore"):  # an infinity is out of range like the number
            given = np.asarray(action)
            if given.dtype.kind == "c":
                raise TypeError
            given = np.asarray(given, np.float32)
    except (TypeError, ValueError, OverflowError):
        raise ActionError(f"invalid {name}: an array of numbers is needed") from None
    bounded = given.clip(-1.0, 1.0)
    return np.where(np.abs(given - bounded) <= _ROUNDING, bounded, given)


def neighbour_view(neighbours: object, reach: object, noise: object, delay: object) -> NeighbourView:
    """How boats see each other; gymnasium.error.Error: an option is invalid."""
    if not isinstance(neighbours, int | np.integer) or neighbours < 0:
        raise gymnasium.error.Error(f"invalid neighbours {shown(neighbours)}: a whole number of 0 or more is needed")
    if neighbours > _MOST_NEIGHBOURS:
        raise gymnasium.error.Error(f"invalid neighbours {shown(neighbours)}: at most {_MOST_NEIGHBOURS} are possible")
    if not is_number(reach) or reach <= 0.0:
        raise gymnasium.error.Error(f"invalid range {shown(reach)}: a number of metres above 0 is needed")
    given = tuple(noise) if isinstance(noise, Sequence | np.ndarray) else ()
    if len(given) != 3 or not all(is_number(one) and one >= 0.0 for one in given):
        text = "three numbers of 0 or more are needed, of places [m], velocities [m/s] and headings [rad]"
        raise gymnasium.error.Error(f"invalid noise {shown(noise)}: {text}")
    if (
        not is_number(delay)
        or not 0.0 <= delay <= _LONGEST_DELAY
        or not math.isclose(delay / PERIOD, round(delay / PERIOD), abs_tol=1e-6)
    ):
        raise gymnasium.error.Error(
            f"invalid delay {shown(delay)}: a multiple of {PERIOD:g} s, up to {_LONGEST_DELAY:g} s, is needed"
        )
    return NeighbourView(
        int(neighbours), float(reach), (float(given[0]), float(given[1]), float(given[2])), round(delay / PERIOD)
    )


def chance(name: str, value: object) -> float:
    """A share of boats; gymnasium.error.Error: not from 0 to 1."""
    if not is_number(value) or not 0.0 <= value <= 1.0:
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: a share from 0 to 1 is needed")
    return float(value)


def team_share(reward: object) -> float:
    """The team's share of a boat's reward, from the option `reward`; gymnasium.error.Error: it is invalid."""
    if isinstance(reward, str) and reward in {"team", "individual"}:
        return float(reward == "team")
    if not is_number(reward) or not 0.0 <= reward <= 1.0:
        text = "'team', 'individual' or the team's share, from 0 to 1, is needed"
        raise gymnasium.error.Error(f"invalid reward {shown(reward)}: {text}")
    return float(reward)


def row_mask(name: str, given: object, n: int) -> BoolArray:
    """Which rows are meant; None means all.

    Raises:
        gymnasium.error.Error: `given`, the option `name`, is not a mask of `n` rows.
    """
    mask = np.ones(n, np.bool_) if given is None else np.asarray(given)
    if mask.shape != (n,) or mask.dtype != bool:
        text = f"({n},) of bool is needed"
        raise gymnasium.error.Error(f"invalid {name} of shape {mask.shape} and type {mask.dtype}: {text}")
    return mask
