"""Boats that are lost: sunk or capsized. Their episodes end."""

from typing import Protocol

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray

__all__ = ["CAPSIZED", "SUNK", "Watch"]

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
    def features(self) -> FloatArray:
        """State of every boat, (n, boats, 13)."""

    def afloat(self, boat: str, places: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        """Poses and velocities, (rows, 6) each, with which a boat floats."""

    def sea_height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height [m] of each row's sea at points, (n, points)."""

    def set_boat(self, boat: str, *, pose: FloatArray, velocity: FloatArray, rows: IntArray) -> None:
        """Set the poses and velocities of a boat in some rows."""


class Watch:
    """Which boats of a batch are lost, (n, boats)."""

    def __init__(self, batch: Waters) -> None:
        self._batch = batch
        self._rest = np.zeros((batch.n, len(batch.boats)))

    def launch(self, boat: int, rows: IntArray, spots: FloatArray, surge: FloatArray | float = 0.0) -> None:
        """Put a boat of rows on the water, at x, y [m] and heading [rad], (rows, 3), with a surge velocity [m/s]."""
        name = self._batch.boats[boat]
        poses, velocities = self._batch.afloat(name, spots, rows)
        velocities[:, 0] += surge
        self._batch.set_boat(name, pose=poses, velocity=velocities, rows=rows)
        self._rest[rows, boat] = 0.0
        self._rest[rows, boat] = self._heights()[rows, boat]

    def sunk(self) -> BoolArray:
        """Who is under water."""
        deep: BoolArray = self._heights() - self._rest < -SUNK
        return deep

    def capsized(self) -> BoolArray:
        """Who lies upside down, or nearly so."""
        features = self._batch.features
        x, y = features[..., 4], features[..., 5]
        over: BoolArray = 1.0 - 2.0 * (x * x + y * y) < np.cos(CAPSIZED)
        return over

    def _heights(self) -> FloatArray:
        """Of the boats' origins over the surface [m]; NaN of those that have diverged."""
        features = self._batch.features
        heights: FloatArray = features[..., 2] - self._batch.sea_height(features[..., 0], features[..., 1])
        return heights
