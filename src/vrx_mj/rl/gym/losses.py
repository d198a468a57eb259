"""Boats that are lost: sunk or capsized. Their episodes end."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from vrx_mj.rl.gym.seen import Floats

__all__ = ["CAPSIZED", "SUNK", "Watch"]

Mask = npt.NDArray[np.bool_]
SUNK = 2.0
"""A boat is sunk when it is so much deeper under the surface at its place than where it floats at rest [m]."""
CAPSIZED = np.radians(90.0)
"""A boat has capsized when its mast leans by more than this from the vertical [rad]."""


class Waters(Protocol):
    """What is asked of a `Batch`, or of what stands for one."""

    n: int

    @property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats."""

    @property
    def features(self) -> Floats:
        """State of every boat, (n, boats, 13)."""

    def afloat(self, boat: str, places: Floats, rows: npt.NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Poses and velocities, (rows, 6) each, with which a boat floats."""

    def sea_height(self, x: Floats, y: Floats) -> Floats:
        """Height [m] of each row's sea at points, (n, points)."""

    def set_boat(self, boat: str, *, pose: Floats, velocity: Floats, rows: npt.NDArray[np.int64]) -> None:
        """Set the poses and velocities of a boat in some rows."""


class Watch:
    """Which boats of a batch are lost, (n, boats)."""

    def __init__(self, batch: Waters) -> None:
        self._batch = batch
        self._rest = np.zeros((batch.n, len(batch.boats)))

    def launch(self, boat: int, rows: npt.NDArray[np.int64], spots: Floats, surge: Floats | float = 0.0) -> None:
        """Put a boat of rows on the water, at x, y [m] and heading [rad], (rows, 3), with a surge velocity [m/s]."""
        name = self._batch.boats[boat]
        poses, velocities = self._batch.afloat(name, spots, rows)
        velocities[:, 0] += surge
        self._batch.set_boat(name, pose=poses, velocity=velocities, rows=rows)
        self._rest[rows, boat] = 0.0
        self._rest[rows, boat] = self._heights()[rows, boat]

    def sunk(self) -> Mask:
        """Who is under water."""
        deep: Mask = self._heights() - self._rest < -SUNK
        return deep

    def capsized(self) -> Mask:
        """Who lies upside down, or nearly so."""
        features = self._batch.features
        x, y = features[..., 4], features[..., 5]
        over: Mask = 1.0 - 2.0 * (x * x + y * y) < np.cos(CAPSIZED)
        return over

    def _heights(self) -> Floats:
        """Of the boats' origins over the surface [m]; NaN of those that have diverged."""
        features = self._batch.features
        heights: Floats = features[..., 2] - self._batch.sea_height(features[..., 0], features[..., 1])
        return heights
