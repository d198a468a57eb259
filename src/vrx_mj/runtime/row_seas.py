"""The seas of a batch's rows: by how much each differs from the world's, and the waves that follow from that."""

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import CommandError
from vrx_mj.model.water import Sea
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import WAVE, Table
from vrx_mj.physics.waves import stretched, surface_height
from vrx_mj.runtime.row_arguments import as_numbers

__all__ = ["RowSeas", "row_heights"]

_f = np.float64
NOMINAL = np.dtype([("peak", _f), ("direction", _f, (2,))], align=True)
"""Of the world's sea: angular frequency of its period [rad/s], and its direction."""
CHANGE = np.dtype([("amplitude", _f), ("period", _f), ("band", _f), ("spread", _f), ("turn", _f)], align=True)
"""Of a row: factors of amplitudes, periods, the band's width and the spread of directions, and a turn [rad]."""
FACTORS = {"waves": "amplitude", "wave_period": "period", "wave_band": "band", "wave_spread": "spread"}
"""Columns of `CHANGE` by what `Batch.vary` calls them."""


class RowSeas:
    """What the sea of each row has of its own."""

    def __init__(self, waves: Table, sea: Sea, n: int) -> None:
        """Take a world's `tables.WAVE` and its sea; all `n` rows have that sea."""
        self._world = waves
        peak = 2.0 * math.pi / sea.period if sea.period else 1.0
        self._nominal = np.array([(peak, sea.direction)], NOMINAL)
        self._change = np.array([(1.0, 1.0, 1.0, 1.0, 0.0)] * n, CHANGE)
        self._phases = np.zeros((n, len(waves)))

    @property
    def course(self) -> float:
        """Direction in which the world's sea travels [rad], counter-clockwise from east."""
        east, north = self._nominal["direction"][0].tolist()
        return math.atan2(north, east)

    def change(self, which: IntArray, given: Mapping[str, FloatArray], phases: npt.ArrayLike | None) -> Table:
        """Change these rows' seas, and return their waves (rows, waves).

        Raises:
            CommandError: the phases do not have the shape (waves,) or (rows, waves), or are not finite.
        """
        if phases is not None:
            own, shape = as_numbers("wave_phases", phases), (len(which), len(self._world))
            if own.shape not in {shape, shape[1:]} or not np.isfinite(own).all():
                text = f"{shape} or {shape[1:]}, of finite numbers, is needed"
                raise CommandError(f"invalid wave_phases of shape {own.shape}: {text}")
            self._phases[which] = own
        for name, column in FACTORS.items():
            if name in given:
                self._change[column][which] = given[name]
        if "wave_direction" in given:
            self._change["turn"][which] = given["wave_direction"] - self.course
        waves = np.zeros((len(which), len(self._world)), WAVE)
        _stretch_rows(self._world, self._nominal, self._change[which], self._phases[which], waves)
        return waves


@kernel
def _stretch_rows(world: Table, nominal: Table, change: Table, phases: FloatArray, waves: Table) -> None:
    """Write the waves of every row, (rows, waves)."""
    for i in range(change.size):
        stretched(world, nominal[0], change[i], phases[i], waves[i])


@kernel
def row_heights(waves: Table, sea: Table, x: FloatArray, y: FloatArray, t: FloatArray, out: FloatArray) -> None:
    """Write the heights of the rows' seas at points x and y, (rows, points), at times t, (rows,), to `out`."""
    for i in range(t.size):
        own = waves[i] if waves.shape[0] > 1 else waves[0]
        for k in range(x.shape[1]):
            out[i, k] = surface_height(own, sea[0], x[i, k], y[i, k], t[i])
