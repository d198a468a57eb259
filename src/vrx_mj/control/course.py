"""Motion control of boats that cannot push sideways: they go where the bow points, and slide in turns.

A velocity over ground is to be held, as by `Pilot`. The bow points to that velocity plus what lacks of it, so that a
slide is pushed away, too; the surge speed is the part of the velocity along the bow. Rudders turn a boat as far as its
speed and its propeller's race let them.
"""

import math
from collections.abc import Mapping

from vrx_mj.control.allocation import Allocation, Propeller
from vrx_mj.control.craft import Craft
from vrx_mj.control.guidance import approach_speed, wrapped
from vrx_mj.control.navigation import Estimate

__all__ = ["Course"]

SURGE_RATE = 1.2
"""How fast an error of surge speed dies [1/s]."""
HEADING_RATE = 1.0
"""How fast an error of heading dies [1/s], and at most a third of what turning at full power allows."""
TURN_RATE = 2.5
"""How fast an error of turning rate dies [1/s]."""
FASTEST_TURN = 0.8
"""Turning rate wanted at most [rad/s]."""
ARRIVED = 0.5
"""Within so many lengths of its place a boat stops: it cannot come nearer without turning on the spot."""
LEFT = 1.0
"""Beyond so many lengths of its place it goes back there."""
SLOW = 0.05
"""Velocities below this are none [m/s]."""
SLIDING = 0.3
"""A boat that stops and goes faster than this turns one of its ends to where it goes [m/s]."""
TURNING_SPEED = 0.3
"""Share of the top speed with which a boat whose rudder turns it goes about."""


class Course:
    """Steers one boat by its bow."""

    def __init__(self, thrusters: Mapping[str, Propeller], craft: Craft, allocation: Allocation) -> None:
        self._craft, self._allocation = craft, allocation
        plenty = 2.0 * sum(thruster.max_forward + thruster.max_reverse for thruster in thrusters.values())
        self._full = allocation(plenty, 0.0, 0.0).surge
        turning = allocation(0.0, 0.0, plenty * craft.length).yaw
        self._by_rudder = bool(craft.rudders) and turning < 1e-6 * plenty
        self._fastest = min(FASTEST_TURN, _balance(craft.yaw_drag, turning)) if not self._by_rudder else FASTEST_TURN
        self._heading_rate = min(HEADING_RATE, 3.0 * self._fastest)
        self._staying = False

    def hold(
        self, seen: Estimate, x: float, y: float, heading: float, *, speed: float, braking: float
    ) -> dict[str, float]:
        """Commands to come to a place [m] and stay within a length of it, at most at a `speed` [m/s].

        `braking` [m/s2] is the deceleration to rely on. Within the limits the boat has the heading [rad], if it can.
        """
        distance, bearing = seen.to(x, y)
        self._staying = distance < (LEFT if self._staying else ARRIVED) * self._craft.length
        if self._staying:
            return self.sail(seen, 0.0, 0.0, heading)
        way = max(0.0, distance - 0.5 * ARRIVED * self._craft.length)
        wanted = min(approach_speed(way, 0.5 * self._fastest, braking), speed)
        return self.sail(seen, wanted * math.cos(bearing), wanted * math.sin(bearing), heading)

    def sail(self, seen: Estimate, vx: float, vy: float, heading: float) -> dict[str, float]:
        """Commands for a velocity over ground [m/s, east and north]; at rest, for a heading [rad]."""
        off = wrapped(self._bow(seen, vx, vy, heading) - seen.heading)
        along = vx * math.cos(seen.heading) + vy * math.sin(seen.heading)
        wanted = max(0.0, along) if math.hypot(vx, vy) > SLOW else 0.0
        if self._by_rudder and wanted < (least := TURNING_SPEED * self._top) and math.hypot(vx, vy) > SLOW:
            wanted = least  # no rudder turns a boat without way
        turn = max(-self._fastest, min(self._fastest, self._heading_rate * off))
        surge = self._craft.mass * SURGE_RATE * (wanted - seen.surge) + self._craft.drag(wanted, 0.0)[0]
        moment = self._craft.inertia * TURN_RATE * (turn - seen.turn) + self._craft.turning_drag(turn)
        thrust = self._allocation(surge, 0.0, 0.0 if self._by_rudder else moment)
        return {**thrust.commands, **self._craft.rudder_angles(moment, seen.surge, thrust.surge)}

    @property
    def _top(self) -> float:
        return self._craft.top_speed(self._full)

    def _bow(self, seen: Estimate, vx: float, vy: float, heading: float) -> float:
        """Where the bow is to point [rad]."""
        if math.hypot(vx, vy) > SLOW:
            return math.atan2(2.0 * vy - seen.vy, 2.0 * vx - seen.vx)
        if self._by_rudder:
            return seen.heading
        if math.hypot(seen.vx, seen.vy) > SLIDING:
            course = math.atan2(seen.vy, seen.vx)
            return course if abs(wrapped(course - seen.heading)) < math.pi / 2 else course + math.pi
        return heading


def _balance(drag: tuple[float, float], moment: float) -> float:
    """The turning rate [rad/s] that a moment [N m] keeps up against linear and quadratic drag."""
    linear, quadratic = drag
    if quadratic == 0.0:
        return moment / linear if linear > 0.0 else math.inf
    return (math.sqrt(linear * linear + 4.0 * quadratic * moment) - linear) / (2.0 * quadratic)
