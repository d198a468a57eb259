"""The water of a batch's rows: how high it stands, and how boats float on it."""

import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import check_name, whole
from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.row_arguments import Rows, as_numbers, row_vectors, which_rows
from vrx_mj.runtime.row_seas import row_heights
from vrx_mj.runtime.row_tables import RowTables
from vrx_mj.runtime.turns import Turn, in_turn

__all__ = ["RowWater"]


class RowWater(RowTables):
    """The part of a batch that answers questions about its rows' seas."""

    _turn: Turn

    @property
    def largest_masses(self) -> FloatArray:
        """Factor of its mass up to which each boat floats at rest on a calm, (boats,); beyond, an end goes under."""
        return self._afloat.largest_masses()

    @in_turn
    def waves(self, row: int) -> Table:
        """Waves of a row's sea, a copy: records of amplitude [m], wavenumber, frequency, direction and phase [rad]."""
        row = whole("row", row, 0, self.n - 1)
        return self._waves_of(row)

    @in_turn
    def sea_height(self, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        """Height [m] of each row's sea at points x, y, (n, points) [m, ENU], at the row's present time.

        Raises:
            CommandError: the points are not numbers, or do not have that shape.
        """
        east, north = (np.ascontiguousarray(as_numbers(name, value)) for name, value in (("x", x), ("y", y)))
        if east.ndim != 2 or east.shape != north.shape or len(east) != self.n:
            text = f"({self.n}, points) of both is needed"
            raise CommandError(f"invalid x and y of shapes {east.shape} and {north.shape}: {text}")
        out = np.empty(east.shape)
        row_heights(self._stacks["waves"], self._rig.sea, east, north, self._time, out)
        return out

    @in_turn
    def afloat(self, boat: str, places: npt.ArrayLike, rows: Rows = None) -> tuple[FloatArray, FloatArray]:
        """Poses and velocities, (rows, 6) each as in `set_boat`, with which a boat floats on the rows' present seas.

        Its weight is that of the row, engines included; wind and thrust are left out. A boat that the water cannot
        carry is upright, with its origin at the surface.

        Args:
            boat: name of the boat.
            places: x, y [m] and yaw [rad], (rows, 3).
            rows: mask or numbers of the rows; by default all.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the shape is wrong, or a number is not finite or too large.
        """
        check_name("boat", boat, self.boats)
        which, number = which_rows(self.n, rows), self.boats.index(boat)
        spots = row_vectors(f"places of {boat}", places, len(which), 3)
        times, masses = self._time.tolist(), self._masses.tolist()
        floating = [
            self._afloat.pose(number, self._waves_of(row), (x, y, yaw), times[row], masses[row])
            for row, (x, y, yaw) in zip(which.tolist(), spots.tolist(), strict=True)
        ]
        poses, velocities = (np.array([pair[k] for pair in floating]).reshape(-1, 6) for k in range(2))
        return poses, velocities

    def _waves_of(self, row: int) -> Table:
        waves = self._stacks["waves"]
        own: Table = waves[row if len(waves) > 1 else 0].copy()
        return own
