"""Boats that float at rest: where the water carries them, and how heavy they may be for it."""

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.hydrostatics import greatest_lift, settle
from vrx_mj.physics.tables import Table
from vrx_mj.physics.waves import surface_height
from vrx_mj.runtime.loop_arrays import LoopArrays

_LATER = 1e-3
"""Of two moments between which a boat's motion with the water is measured [s]."""
_LEAN = 0.5
"""Roll and pitch of a boat at rest on waves, at most [rad]; on steeper ones it starts as on a calm."""
_HALVINGS = 20
"""Of the interval in which the largest mass is."""


class Afloat:
    """Weights and centres of mass of a world's boats, engines included, as its file has them."""

    def __init__(self, arrays: LoopArrays) -> None:
        model, data = arrays.model, mujoco.MjData(arrays.model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        bodies = arrays.hulls["body"].astype(np.int64)
        self._arrays, gravity = arrays, -float(model.opt.gravity[2])
        self._weights: FloatArray = model.body_subtreemass[bodies] * gravity
        turned = data.xmat[bodies].reshape(-1, 3, 3).transpose(0, 2, 1)
        away = data.subtree_com[bodies] - data.xpos[bodies]
        self._centers = np.ascontiguousarray((turned @ away[:, :, None])[..., 0])

    def largest_masses(self) -> FloatArray:
        """(boats,): factors of mass up to which boats float at rest on a calm; beyond, an end goes under.

        Found by halving, below the factor with which all that can be under water just carries the weight.
        """
        found = np.zeros(len(self._weights))
        for boat, hull in enumerate(self._arrays.hulls):
            least, most = 0.0, greatest_lift(hull, self._arrays.stations) / self._weights[boat]
            for _ in range(_HALVINGS):
                middle = 0.5 * (least + most)
                floats = self._settled(boat, self._arrays.waves[:0], np.zeros(6), 0.0, middle)
                least, most = (middle, most) if floats else (least, middle)
            found[boat] = least
        return found

    def pose(
        self, boat: int, waves: Table, place: tuple[float, float, float], time: float, mass: float = 1.0
    ) -> tuple[FloatArray, FloatArray]:
        """Pose and velocity, (6,) each, with which a boat goes up and down with the water.

        Args:
            boat: its number.
            waves: `tables.WAVE`.
            place: x, y [m] and yaw [rad].
            time: simulated [s].
            mass: factor of its mass and inertia.
        """
        x, y, yaw = place
        height = surface_height(waves, self._arrays.sea[0], x, y, time)
        calm, velocity = np.array([x, y, self._arrays.sea["level"][0], 0.0, 0.0, yaw]), np.zeros(6)
        if not self._settled(boat, waves[:0], calm, time, mass):
            return np.array([x, y, height, 0.0, 0.0, yaw]), velocity
        calm[2] += height - self._arrays.sea["level"][0]  # the water's surface is higher here, and leans a little
        now = calm.copy()
        if not self._settled(boat, waves, now, time, mass) or np.abs(now[3:5]).max() > _LEAN:
            return calm, velocity
        later = now.copy()
        if self._settled(boat, waves, later, time + _LATER, mass):
            velocity[2:5] = (later[2:5] - now[2:5]) / _LATER  # tilted by a few degrees, body and world axes are alike
        return now, velocity

    def _settled(self, boat: int, waves: Table, pose: FloatArray, time: float, mass: float) -> bool:
        arrays, weight = self._arrays, mass * self._weights[boat]
        return bool(
            settle(arrays.hulls[boat], arrays.stations, waves, arrays.sea[0], weight, self._centers[boat], pose, time)
        )
