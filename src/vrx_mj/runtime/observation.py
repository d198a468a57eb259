"""What a boat's controller sees."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vrx_mj.physics.motion import rotation_matrix

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class BoatObservation:
    """Pose and velocity of a boat's `base_link` origin."""

    position: FloatArray
    """(3,): position [m, ENU]."""
    quaternion: FloatArray
    """(4,): orientation (w, x, y, z), body to world."""
    velocity: FloatArray
    """(3,): linear velocity u, v, w [m/s], body axes (forward, left, up)."""
    angular_velocity: FloatArray
    """(3,): angular velocity p, q, r [rad/s], body axes."""

    @property
    def roll(self) -> float:
        """Roll [rad]; positive lowers the starboard side."""
        w, x, y, z = (float(value) for value in self.quaternion)
        return math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))

    @property
    def pitch(self) -> float:
        """Pitch [rad]; positive lowers the bow."""
        w, x, y, z = (float(value) for value in self.quaternion)
        return math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))

    @property
    def heading(self) -> float:
        """Heading [rad], counter-clockwise from east."""
        w, x, y, z = (float(value) for value in self.quaternion)
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    @property
    def speed(self) -> float:
        """Speed over ground [m/s], horizontal."""
        u, v, w = self.velocity
        turn = rotation_matrix(self.quaternion)
        return math.hypot(*(float(turn[row] @ (u, v, w)) for row in (0, 1)))
