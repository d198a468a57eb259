"""The velocity loop: a wanted surge speed and yaw rate, held by the thrusters.

Two laws of proportional and integral action, one for each, with the drag of the wanted motion fed forward (Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 15.3). By default the boat is not pushed sideways:
it may drift in a turn or a wind, and its guidance makes up for that. For a user without guidance a third law holds
the sway at zero, so that the course is the heading and a turn has the radius of speed over yaw rate.
"""

import math
from collections.abc import Mapping

from vrx_mj.control.allocation import Allocation, Propeller, Thrust
from vrx_mj.control.craft import Craft, wamv_of
from vrx_mj.control.navigation import Estimate

__all__ = ["VelocityKeeper"]

SURGE_RATE = 1.2
"""How fast an error of surge speed dies [1/s]: a sixth of what calls at 10 Hz would allow."""
SWAY_RATE = 1.2
"""How fast an error of sway dies [1/s]: as that of surge."""
TURN_RATE = 2.5
"""How fast an error of yaw rate dies [1/s]; twice as fast, for a guidance that steers by it goes around this loop."""
SLACK = 1.0
"""Thrusters that miss what is asked of them by more than this [N, N m] are at their limits."""
HALVINGS = 6
"""Of the interval in which the share of the force to port is sought: to 1/64."""
INTEGRAL = 0.2
"""What the integral takes over of that each second, as a share of the rate: wind and unknown drag, in some 5 s."""


class VelocityKeeper:
    """Holds the surge speed and the yaw rate of one boat."""

    def __init__(
        self, thrusters: Mapping[str, Propeller], craft: Craft | None = None, *, hold_sway: bool = False
    ) -> None:
        """`craft` tells the boat's figures; by default they are the WAM-V's.

        With `hold_sway` the boat is kept from going sideways as far as its thrusters can push it across, and the speed
        is that over ground: what sway is left counts as a part of it.
        """
        self.craft = craft or wamv_of(thrusters)
        self._allocation = Allocation(thrusters, centre=self.craft.centre)
        self._hold_sway = hold_sway
        plenty = 2.0 * sum(thruster.max_forward for thruster in thrusters.values())
        self.top_speed = self.craft.top_speed(self._allocation(plenty, 0.0, 0.0).surge)
        """Full ahead in calm water [m/s]."""
        self._pushed = (0.0, 0.0, 0.0)
        self._then = math.inf

    def __call__(self, seen: Estimate, t: float, surge: float, turn: float) -> dict[str, float]:
        """Commands at the time `t` [s] for a surge speed [m/s] and a yaw rate [rad/s], positive to port."""
        aside = sway = 0.0
        if self._hold_sway:
            surge = _along(surge, seen.sway)
            if self._allocation.every_way:
                aside = -self.craft.mass * SWAY_RATE * seen.sway
                sway = self.craft.mass * surge * turn + aside + self._pushed[1]  # toward the centre of the turn
        ahead = self.craft.mass * SURGE_RATE * (surge - seen.surge)
        around = self.craft.inertia * TURN_RATE * (turn - seen.turn)
        force = self.craft.drag(surge, 0.0)[0] + ahead + self._pushed[0]
        moment = self.craft.turning_drag(turn) + around + self._pushed[2]
        thrust = self._allocated(force, sway, moment)
        self._integrate(t, (ahead, force, thrust.surge), (aside, sway, thrust.sway), (around, moment, thrust.yaw))
        return {**thrust.commands, **self.craft.rudder_angles(moment, seen.surge, thrust.surge)}

    def _allocated(self, force: float, sway: float, moment: float) -> Thrust:
        """The force ahead goes before that to port, which is made less where the thrusters cannot give both."""
        thrust = self._allocation(force, sway, moment)
        if sway == 0.0 or abs(thrust.surge - force) < SLACK:
            return thrust
        low, high, best = 0.0, 1.0, self._allocation(force, 0.0, moment)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            thrust = self._allocation(force, middle * sway, moment)
            if abs(thrust.surge - force) < SLACK:
                low, best = middle, thrust
            else:
                high = middle
        return best

    def _integrate(self, t: float, *axes: tuple[float, float, float]) -> None:
        """Take over what is lacking; not along an axis whose thrusters do not reach what is asked of them.

        An axis is what the error asks for, what all asks for, and what was given [N, N m].
        """
        interval, self._then = t - self._then, t
        if not 0.0 < interval < 1.0:
            return
        rates = (SURGE_RATE, SWAY_RATE, TURN_RATE)
        surge, sway, turn = (
            pushed + rate * INTEGRAL * interval * (error if abs(given - wanted) < SLACK else 0.0)
            for pushed, rate, (error, wanted, given) in zip(self._pushed, rates, axes, strict=True)
        )
        self._pushed = (surge, sway, turn)


def _along(speed: float, sway: float) -> float:
    """The surge [m/s] of a boat with a speed over ground and a sway; at least half of that speed."""
    rest = math.sqrt(max(speed * speed - sway * sway, 0.25 * speed * speed))
    return math.copysign(rest, speed)
