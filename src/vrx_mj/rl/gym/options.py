"""Options that environments for one boat and for teams share, checked."""

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from vrx_mj.arguments import as_number
from vrx_mj.errors import shown

__all__ = [
    "PERIOD", "as_floats", "check_count", "check_picture", "episode_steps", "is_number", "reset_mode", "step_limit",
]  # fmt: skip

PERIOD = 0.1
"""Of an action [s]: 10 physics steps."""
LONGEST = 1e9
"""Episode, at most [s]."""
ENDLESS = 1 << 60
"""Steps of an episode that is not truncated."""
MOST = 1_000_000
"""Rows of an environment."""
LARGEST = 8192
"""Width and height of a picture, at most [pixels]."""


def episode_steps(duration: Any) -> int:
    """Steps of an episode; gymnasium.error.Error: its duration [s] is none."""
    if not is_number(duration) or duration < PERIOD:
        raise gymnasium.error.Error(f"invalid duration {shown(duration)}: a number of {PERIOD:g} s or more is needed")
    if duration > LONGEST:
        raise gymnasium.error.Error(f"invalid duration {shown(duration)}: at most {LONGEST:g} s")
    return round(float(duration) / PERIOD)


def step_limit(duration: Any, most: Any, default: float) -> int:
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
    limit = ENDLESS if most == -1 else min(int(most), ENDLESS)
    steps = limit if duration is None else episode_steps(duration)
    if steps > limit:
        text = f"truncates an episode after {limit * PERIOD:g} s; give max_episode_steps={steps} instead"
        raise gymnasium.error.Error(f"invalid duration {shown(duration)}: max_episode_steps={limit} {text}")
    return steps


def check_count(name: str, value: Any) -> None:
    """gymnasium.error.Error: the option of that name is not a whole number from 1 to a million."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 1:
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: a whole number above 0 is needed")
    if value > MOST:
        raise gymnasium.error.Error(f"invalid {name} {shown(value)}: at most {MOST} are possible")


def check_picture(mode: Any, modes: Sequence[str], width: Any, height: Any) -> None:
    """gymnasium.error.Error: `mode` is none of the ways to draw, or pictures have no such size [pixels]."""
    if mode is not None and not (isinstance(mode, str) and mode in modes):
        possible = ", ".join(["None", *map(repr, modes[:-1])])
        raise gymnasium.error.Error(f"invalid render_mode {shown(mode)}: {possible} or {modes[-1]!r} is needed")
    for name, size in (("width", width), ("height", height)):
        if not isinstance(size, int | np.integer) or isinstance(size, bool) or not 1 <= size <= LARGEST:
            text = f"a whole number of pixels from 1 to {LARGEST} is needed"
            raise gymnasium.error.Error(f"invalid {name} {shown(size)}: {text}")


def reset_mode(mode: Any) -> AutoresetMode:
    """When rows are reset; gymnasium.error.Error: Gymnasium has no such mode."""
    try:
        return AutoresetMode(mode)
    except (TypeError, ValueError):
        known = ", ".join(repr(one.value) for one in AutoresetMode)
        raise gymnasium.error.Error(f"invalid autoreset_mode {shown(mode)}: one of {known} is needed") from None


def is_number(value: Any) -> bool:
    """Whether it is a finite number."""
    return isinstance(value, int | float | np.integer | np.floating) and math.isfinite(as_number(value))


def as_floats(action: Any, name: str = "action") -> npt.NDArray[np.float32]:
    """An action as an array; gymnasium.error.InvalidAction: it has values that are not numbers."""
    try:
        with np.errstate(over="ignore"):  # an infinity is out of range like the number
            given = np.asarray(action)
            if given.dtype.kind == "c":
                raise TypeError
            return np.asarray(given, np.float32)
    except (TypeError, ValueError, OverflowError):
        raise gymnasium.error.InvalidAction(f"invalid {name}: an array of numbers is needed") from None
