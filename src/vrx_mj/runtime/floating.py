"""Boats that float at rest: where the water carries them, and how heavy they may be for it."""

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.hydrostatics import greatest_lift, settle
from vrx_mj.physics.tables import Table
from vrx_mj.physics.waves import surface_height
from vrx_mj.runtime.row_tables import RowTables

_LATER = 1e-3
"""Time between two moments from which a boat's motion with the water is found [s]."""
_LEAN = 0.5
"""Largest roll and pitch of a boat at rest on waves [rad]; on steeper ones it starts as on a calm."""
_HALVINGS = 20
"""Halvings of the interval in which the largest mass is."""


class Equilibrium:
    """Boats of the rows of a batch at rest in the water: with engines, without wind and thrust."""

    def __init__(self, rows: RowTables) -> None:
        """Take the boats' weights and centres of mass from the world's model."""
        arrays = rows.arrays
        model, data = arrays.model, mujoco.MjData(arrays.model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        bodies = arrays.hulls["body"].astype(np.int64)
        self._rows, gravity = rows, -float(model.opt.gravity[2])
        self._weights: FloatArray = model.body_subtreemass[bodies] * gravity
        turned = data.xmat[bodies].reshape(-1, 3, 3).transpose(0, 2, 1)
        away = data.subtree_com[bodies] - data.xpos[bodies]
        self._centers = np.ascontiguousarray((turned @ away[:, :, None])[..., 0])

    def largest_masses(self) -> FloatArray:
        """(boats,): factors of mass up to which boats float at rest on a calm; beyond, an end goes under.

        Found by halving, below the factor with which all that can be under water just carries the weight.
        """
        found, arrays = np.zeros(len(self._weights)), self._rows.arrays
        for boat, hull in enumerate(arrays.hulls):
            least, most = 0.0, greatest_lift(hull, arrays.stations) / self._weights[boat]
            for _ in range(_HALVINGS):
                middle = 0.5 * (least + most)
                weight, center = middle * self._weights[boat], self._centers[boat]
                floats = settle(
                    hull, arrays.stations, arrays.waves[:0], arrays.sea[0], weight, center, np.zeros(6), 0.0
                )
                least, most = (middle, most) if floats else (least, middle)
            found[boat] = least
        return found

    def pose(self, row: int, boat: int, place: tuple[float, float, float]) -> tuple[FloatArray, FloatArray]:
        """Pose and velocity, (6,) each, with which a boat of a row goes up and down with the water now.

        `place` is x, y [m] and yaw [rad].
        """
        rows, time = self._rows, float(self._rows.time[row])
        hull, stations, waves, sea = (rows.part(name, row) for name in ("hulls", "stations", "waves", "sea"))
        weight, center = float(rows.masses[row]) * self._weights[boat], self._centers[boat]

        def settles(waves: Table, pose: FloatArray, time: float) -> bool:
            return bool(settle(hull[boat], stations, waves, sea[0], weight, center, pose, time))

        x, y, yaw = place
        level, height = sea["level"][0], surface_height(waves, sea[0], x, y, time)
        calm, velocity = np.array([x, y, level, 0.0, 0.0, yaw]), np.zeros(6)
        if not settles(waves[:0], calm, time):
            return np.array([x, y, height, 0.0, 0.0, yaw]), velocity
        calm[2] += height - level  # the water's surface is higher here, and leans a little
        now = calm.copy()
        if not settles(waves, now, time) or np.abs(now[3:5]).max() > _LEAN:
            return calm, velocity
        later = now.copy()
        if settles(waves, later, time + _LATER):
            velocity[2:5] = (later[2:5] - now[2:5]) / _LATER  # tilted by a few degrees, body and world axes are alike
        return now, velocity
