"""The velocity loop: a wanted surge speed and yaw rate, held by the thrusters.

Two laws of proportional and integral action, one for each, with the drag of the wanted motion fed forward (Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 15.3). The boat is not pushed sideways: it may drift
in a turn or a wind, and its guidance makes up for that.
"""

import math
from collections.abc import Mapping

from vrx_mj.control.allocation import Allocation, Propeller
from vrx_mj.control.craft import Craft, craft_of
from vrx_mj.control.navigation import Estimate

__all__ = ["VelocityKeeper"]

SURGE_RATE = 1.2
"""How fast an error of surge speed dies [1/s]: a sixth of what calls at 10 Hz would allow."""
TURN_RATE = 2.5
"""How fast an error of yaw rate dies [1/s]; twice as fast, for a guidance that steers by it goes around this loop."""
INTEGRAL = 0.2
"""What the integral takes over of that each second, as a share of the rate: wind and unknown drag, in some 5 s."""


class VelocityKeeper:
    """Holds the surge speed and the yaw rate of one boat."""

    def __init__(self, thrusters: Mapping[str, Propeller], craft: Craft | None = None) -> None:
        """`craft` tells the boat's figures; by default they are the WAM-V's."""
        self.craft = craft or craft_of(thrusters)
        self._allocation = Allocation(thrusters, centre=self.craft.centre)
        plenty = 2.0 * sum(thruster.max_forward for thruster in thrusters.values())
        self.top_speed = self.craft.top_speed(self._allocation(plenty, 0.0, 0.0).surge)
        """Full ahead in calm water [m/s]."""
        self._pushed = (0.0, 0.0)
        self._then = math.inf

    def __call__(self, seen: Estimate, t: float, surge: float, turn: float) -> dict[str, float]:
        """Commands at the time `t` [s] for a surge speed [m/s] and a yaw rate [rad/s], positive to port."""
        ahead = self.craft.mass * SURGE_RATE * (surge - seen.surge)
        around = self.craft.inertia * TURN_RATE * (turn - seen.turn)
        force = self.craft.drag(surge, 0.0)[0] + ahead + self._pushed[0]
        moment = self.craft.turning_drag(turn) + around + self._pushed[1]
        thrust = self._allocation(force, 0.0, moment)
        self._integrate(t, (ahead, force, thrust.surge), (around, moment, thrust.yaw))
        return thrust.commands

    def _integrate(self, t: float, *axes: tuple[float, float, float]) -> None:
        """Take over what is lacking; not along an axis whose thrusters do not reach what is asked of them.

        An axis is what the error asks for, what all asks for, and what was given [N, N m].
        """
        interval, self._then = t - self._then, t
        if not 0.0 < interval < 1.0:
            return
        surge, turn = (
            pushed + rate * INTEGRAL * interval * (error if abs(given - wanted) < 1.0 else 0.0)
            for pushed, rate, (error, wanted, given) in zip(self._pushed, (SURGE_RATE, TURN_RATE), axes, strict=True)
        )
        self._pushed = (surge, turn)
