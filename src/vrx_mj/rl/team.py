"""What a problem for a team consists of, and what it sees: arrays of worlds x boats."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.physics.motion import in_world_axes
from vrx_mj.rl.problem import LOSS, Entry
from vrx_mj.rl.seen import seen_of

__all__ = ["CLEAR", "Spot", "Team", "TeamJudged", "TeamProblem", "crowded", "mean_of", "team_of"]

CLEAR = 6.0
"""Boats whose origins are nearer than this are too near [m]; a WAM-V is 4.9 m long."""
Spot = tuple[float, float, float, float]
"""Where a boat starts: x, y [m], heading [rad], and surge velocity [m/s]."""


class Team(NamedTuple):
    """The boats at a moment, (n, boats) each unless it says otherwise."""

    x: FloatArray
    """East of the world's origin [m]."""
    y: FloatArray
    """North [m]."""
    yaw: FloatArray
    """Heading, counter-clockwise from east [rad]."""
    east: FloatArray
    """Velocity over ground [m/s]."""
    north: FloatArray
    own: FloatArray
    """(n, boats, 9): what `seen.OWN_NAMES` says, in its units."""
    present: BoolArray
    """Which are in the water; the others' numbers mean nothing."""

    def toward(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where points are, ahead and to port [m] of each boat; they broadcast with (n, boats)."""
        return self.turned(x - self.x, y - self.y)

    def turned(self, east: FloatArray, north: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors of the world in each boat's axes, ahead and to port."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return cos * east + sin * north, cos * north - sin * east


class TeamJudged(NamedTuple):
    """What a step was worth."""

    team: FloatArray
    """(n,): to all."""
    own: FloatArray
    """(n, boats): to each."""
    ended: BoolArray
    """(n, boats): who has solved, or lost, the problem."""


class TeamProblem(ABC):
    """A task for several boats, in `n` worlds at a time; a boat's own state and its neighbours are observed beside."""

    world: ClassVar[Mapping[str, Any]]
    """What to compile."""
    duration: float
    """An episode is cut after so long [s]."""
    entries: ClassVar[tuple[Entry, ...]]
    """What a boat observes of the task, its own axes."""
    boats: ClassVar[int] = 4
    """How many there are by default."""
    fixed: ClassVar[bool] = False
    """Whether there must be exactly so many, all the time."""
    placed: ClassVar[bool] = True
    """Whether boats start where `start` says, and not where the fleet has them."""
    anchor: int = 0
    """The boat that neither comes late nor goes early."""

    def __init__(self, n: int, boats: int) -> None:
        self.n, self.size = n, boats

    @abstractmethod
    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """Draw an episode of a row, and where its boats start."""

    @abstractmethod
    def entrance(self, row: int, boat: int, random: np.random.Generator) -> Spot:
        """Draw where a boat joins an episode under way."""

    @abstractmethod
    def begin(self, who: BoolArray, team: Team) -> None:
        """Note how these boats, (n, boats), stand where their parts begin."""

    @abstractmethod
    def observe(self, team: Team) -> FloatArray:
        """What is observed of the task, (n, boats, len(entries)), in the entries' units."""

    @abstractmethod
    def judge(self, team: Team, going: BoolArray) -> TeamJudged:
        """Judge a step, once; only the rows that were `going`, (n,), count, and the boats that were present."""

    @abstractmethod
    def facts(self) -> dict[str, npt.NDArray[Any]]:
        """What `info` tells, (n,) or (n, boats) each."""

    def drawn(self) -> dict[str, npt.NDArray[Any]]:
        """What `start` drew, (n, ...) each: goals and the like, which `info` tells when an episode begins."""
        return {}

    def forfeit(self, left: IntArray) -> FloatArray:
        """What each boat forfeits that is lost, (n, boats), with so many steps of the episode left, (n,).

        As for `Problem.forfeit`: at least what the rest could cost a boat that stays where it is.
        """
        return np.repeat(np.where(left > 0, LOSS, 0.0)[:, None], self.size, axis=1)


def team_of(features: FloatArray, wind: FloatArray, present: BoolArray) -> Team:
    """What is seen, from a batch's features, (n, boats, 13), and its wind, (n, 2) [m/s]."""
    n, boats, _ = features.shape
    seen = seen_of(features.reshape(n * boats, -1), np.repeat(wind, boats, axis=0))
    x, y, yaw = (part.reshape(n, boats) for part in seen[:3])
    own = seen.own.reshape(n, boats, -1)
    east, north, _ = np.moveaxis(in_world_axes(features[..., 3:7], features[..., 7:10]), -1, 0)
    return Team(x.copy(), y.copy(), yaw, east, north, own, present)


def mean_of(values: FloatArray, who: BoolArray) -> FloatArray:
    """The mean over these boats, (n,); 0 where there are none."""
    mean: FloatArray = np.where(who, values, 0.0).sum(axis=1) / np.maximum(who.sum(axis=1), 1)
    return mean


def crowded(team: Team, distance: float = CLEAR) -> BoolArray:
    """(n, boats): who is nearer than `distance` [m] to another one."""
    gaps = np.hypot(team.x[:, :, None] - team.x[:, None], team.y[:, :, None] - team.y[:, None])
    both = team.present[:, :, None] & team.present[:, None] & ~np.eye(team.x.shape[1], dtype=np.bool_)
    return np.asarray(((gaps < distance) & both).any(axis=2))
