"""What a boat observes of those around it: near ones only, some time ago, and not exactly."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.rl.problem import Entry, Team

_Keys = npt.NDArray[np.uint64]
FEATURES = 7
"""Numbers that are observed of a neighbour."""
_NOISE_DRAWS = 5
"""Normal numbers that an observation of one boat takes: two of its place, two of its velocity, one of its heading."""


class NeighbourView(NamedTuple):
    """How well boats see each other."""

    neighbours: int
    """Number of boats that are observed, the nearest ones."""
    range: float
    """Greatest distance at which a boat is observed [m]."""
    noise: tuple[float, float, float]
    """Standard deviations of east and north [m], of both velocities [m/s], and of the heading [rad]."""
    delay: int
    """Delay of what is observed [steps]."""

    def entries(self) -> tuple[Entry, ...]:
        """Entries of the observation, in their order."""
        unit = self.range / 5.0
        of = (
            ("is seen", 1.0), ("ahead [m]", unit), ("to port [m]", unit), ("sine of the turn to its heading", 1.0),
            ("cosine of the turn to its heading", 1.0), ("its velocity relative to this boat, ahead [m/s]", 3.0),
            ("its velocity relative to this boat, to port [m/s]", 3.0),
        )  # fmt: skip
        return tuple(Entry(f"neighbour {k + 1}: {name}", scale) for k in range(self.neighbours) for name, scale in of)


class Neighbours:
    """Looks at the boats of `n` worlds, with a memory as long as the delay.

    A boat's report is its place, velocity and heading `delay` steps ago; a boat that joined since is not seen yet, one
    that has left still is. It is seen within range of that place from where the observer is now. Every pair and every
    step has its own noise, a function of the row's key, so that it depends on nothing else.
    """

    def __init__(self, n: int, boats: int, view: NeighbourView) -> None:
        self._view, self._rows = view, np.arange(n)
        self._past = np.zeros((view.delay + 1, n, boats, 6))
        self._step, self._key = np.zeros(n, np.int64), np.zeros(n, np.uint64)
        self._pairs = np.arange(boats * boats, dtype=np.uint64).reshape(boats, boats)

    def begin(self, rows: IntArray, keys: _Keys, team: Team) -> None:
        """Start rows anew, as if their boats had been where they are all the time; `keys` are those of their noise."""
        self._past[:, rows] = _report(team)[rows]
        self._step[rows], self._key[rows] = 0, keys

    def note(self, going: BoolArray, team: Team) -> None:
        """Remember the present of rows that have gone a step."""
        self._step += going
        at = self._step[going] % len(self._past)
        self._past[at, self._rows[going]] = _report(team)[going]

    def observe(self, team: Team) -> FloatArray:
        """Neighbours (n, boats, neighbours * 7), nearest first, by the order of entries; zeros if there are fewer."""
        then = self._past[(self._step - self._view.delay) % len(self._past), self._rows]
        x, y, _, _, _, there = np.moveaxis(then, -1, 0)
        gaps = np.hypot(x[:, None] - team.x[:, :, None], y[:, None] - team.y[:, :, None])
        boats = gaps.shape[1]
        seen = (there[:, None] > 0.0) & (gaps <= self._view.range) & ~np.eye(boats, dtype=np.bool_)
        order = np.argsort(np.where(seen, gaps, np.inf), axis=2, kind="stable")[:, :, : self._view.neighbours]
        found = np.take_along_axis(seen, order, axis=2)
        reported = then[self._rows[:, None, None], order] + self._noise(order)
        whole = np.zeros((*found.shape[:2], self._view.neighbours, FEATURES))
        whole[:, :, : order.shape[2]] = np.where(found[..., None], _seen_from(team, reported), 0.0)
        return whole.reshape(*found.shape[:2], -1)

    def _noise(self, order: IntArray) -> FloatArray:
        """Noise that is added to the reports, (n, boats, k, 6), of the boats `order`, (n, boats, k)."""
        boats = len(self._pairs)
        pair = self._pairs[np.arange(boats)[None, :, None], order]
        step = self._step.astype(np.uint64)[:, None, None] * np.uint64(boats * boats)
        counters = (
            (step + pair)[..., None] * np.uint64(_NOISE_DRAWS) + np.arange(_NOISE_DRAWS, dtype=np.uint64)
        ).astype(np.uint64)
        place, velocity, heading = self._view.noise
        drawn = normals(self._key[:, None, None, None], counters) * (place, place, velocity, velocity, heading)
        return np.concatenate((drawn[..., :2], drawn[..., 4:], drawn[..., 2:4], np.zeros((*order.shape, 1))), axis=-1)


def _report(team: Team) -> FloatArray:
    """Reports (n, boats, 6) of boats: x, y, heading, east and north velocity, whether it is there."""
    return np.stack((team.x, team.y, team.yaw, *team.velocity(), team.present), axis=-1)


def _seen_from(team: Team, reported: FloatArray) -> FloatArray:
    """Reports, (n, boats, k, 6), in the observers' axes, (n, boats, k, 7)."""
    wide = Team._make(part[:, :, None] for part in team)
    x, y, yaw, east, north, _ = np.moveaxis(reported, -1, 0)
    own_east, own_north = team.velocity()
    turn = yaw - wide.yaw
    ahead, port = wide.toward(x, y)
    faster, aside = wide.body_axes(east - own_east[:, :, None], north - own_north[:, :, None])
    return np.stack((np.ones_like(x), ahead, port, np.sin(turn), np.cos(turn), faster, aside), axis=-1)


def normals(keys: _Keys, counters: _Keys) -> FloatArray:
    """Numbers of the standard normal distribution, those of `physics.noise.normal`, for whole arrays."""
    even = counters * np.uint64(2)
    radius = np.sqrt(-2.0 * np.log(1.0 - _uniform(keys, even)))
    return radius * np.cos(2.0 * math.pi * _uniform(keys, even + np.uint64(1)))


def _uniform(keys: _Keys, counters: _Keys) -> FloatArray:
    """Numbers in [0, 1), those of `physics.noise.uniform`."""
    z = keys + (counters + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    share: FloatArray = (z >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return share
