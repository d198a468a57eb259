"""What a problem to learn consists of."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.mjcf.world import World
from vrx_mj.rl.seen import Seen

__all__ = ["LOSS", "Entry", "Judged", "Problem", "Start", "open_water"]

Start = tuple[float, float, float]
"""x, y [m] and heading [rad] of a boat at the start of an episode."""


LOSS = 20.0
"""Reward that a boat forfeits by sinking or capsizing, at least."""


class Entry(NamedTuple):
    """A number that is observed."""

    name: str
    scale: float
    """It is observed in this unit."""


class Judged(NamedTuple):
    """What a step was worth, (n,) each."""

    reward: FloatArray
    done: BoolArray
    """The problem is solved, or lost."""


class Problem(ABC):
    """A task for one boat, in `n` worlds at a time; the boat's own state is observed beside `entries`."""

    world: ClassVar[Mapping[str, Any]]
    """What to compile."""
    duration: ClassVar[float]
    """An episode is cut after so long [s]."""
    entries: ClassVar[tuple[Entry, ...]]
    """What is observed of the task, body axes."""

    def __init__(self, n: int, world: World) -> None:
        self.n = n

    @abstractmethod
    def start(self, row: int, random: np.random.Generator) -> Start:
        """Draw an episode of a row, and where its boat starts."""

    @abstractmethod
    def begin(self, rows: IntArray, seen: Seen) -> None:
        """Note how these rows stand at the start of their episodes."""

    @abstractmethod
    def observe(self, seen: Seen) -> FloatArray:
        """What is observed of the task, (n, len(entries)), in the entries' units."""

    @abstractmethod
    def judge(self, seen: Seen, going: BoolArray) -> Judged:
        """Judge a step, once; only the rows that were `going`, (n,), count."""

    @abstractmethod
    def facts(self) -> dict[str, npt.NDArray[Any]]:
        """What `info` tells, (n,) each."""

    @abstractmethod
    def drawn(self) -> dict[str, npt.NDArray[Any]]:
        """What `start` drew, (n, ...) each: goals and the like, which `info` tells when an episode begins."""

    def forfeit(self, left: IntArray) -> FloatArray:
        """What a boat that is lost forfeits, (n,), with so many steps of its episode left.

        At least as much as the rest of the episode could cost a boat that stays where it is: to end an episode by
        sinking is never better than to go on. Here: nothing is charged for time, and `LOSS` is a drift of 200 m.
        """
        forfeit: FloatArray = np.where(left > 0, LOSS, 0.0)
        return forfeit


def open_water(**more: Any) -> dict[str, Any]:
    """A world without a shore, with gusts and waves, grown at the start already; the wind acts on boats."""
    return {
        "extends": "ocean",
        "description": "open water with waves and wind",
        "sea": {"model": "pms", "number": 3, "scale": 1.5, "gain": 0.2, "period": 5, "direction": [1, 0.5],
                "angle": 0.4, "tau": 0},
        "wind": {"direction": 0, "mean_velocity": 0, "var_gain": 1, "var_time": 5,
                 "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
    } | more  # fmt: skip
