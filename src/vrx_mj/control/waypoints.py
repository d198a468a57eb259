"""Station-keeping: be at a pose and stay there.

Wayfinding: come near to every waypoint, with its heading.
"""

import math
from typing import TYPE_CHECKING

from vrx_mj.control.guidance import best_order, wrap_angle
from vrx_mj.control.navigation import Estimate, Point
from vrx_mj.control.pilot import Commands, Moment, Pilot, Skipper

if TYPE_CHECKING:
    from vrx_mj.runtime.task_runner import TaskObservation


_NEAR = 6.0
"""Within this distance [m] of its place a boat turns to the heading that it is to have, beyond it goes there bow first.

The turn takes the WAM-V 7 s at most and the rest of the way as long; at 6 m the heading weighs 0.18 in the score."""
_NEAR_WITHOUT_SWAY = 1.0
"""Distance from its place, in its lengths, within which a boat that cannot push sideways turns, if it can."""


class Berth:
    """How to come to a pose and hold it: bow first from afar, then with the heading wanted."""

    def __init__(self) -> None:
        self._near = False

    def hold(self, pilot: Pilot, now: Moment, place: Point, heading: float) -> Commands:
        """Commands to be at a place [m] with a heading [rad]."""
        distance, bearing = now.seen.to(*place)
        limit = _NEAR if pilot.every_way else _NEAR_WITHOUT_SWAY * pilot.craft.length
        self._near = distance < (1.5 * limit if self._near else limit)  # no turning to and fro at the limit
        return pilot.hold(now.seen, now.t, *place, heading if self._near else bearing)


class StationKeeper(Skipper):
    """Holds the goal of a station-keeping task, or else the start pose, by dynamic positioning.

    The law is `Pilot.hold`: a velocity toward the goal that falls with the distance, a force for the error of velocity,
    and an observer of wind and waves, so that a steady wind leaves no offset. The boat approaches bow first. Layouts T
    and X push sideways with their thrusters kept straight, layout H by steering both.
    """

    def begin(self) -> None:
        """Forget the goal, at the start of a run."""
        self._berth = Berth()
        self._goal: tuple[Point, float] | None = None

    def steer(self, now: Moment) -> Commands:
        """Commands that go to the goal and hold it."""
        goal = now.task.get("goal")
        if goal is not None:
            self._goal = self.navigator.place(goal), self.navigator.direction(goal)
        elif self._goal is None:
            self._goal = now.seen.place, now.seen.heading
        place, heading = self._goal
        return self._berth.hold(self.pilot, now, place, wrap_angle(heading))


_GOOD = 0.08
"""An error [m] good enough to go on to the next waypoint: 5 cm and 2 degrees."""
_FAIR = 0.25
"""An error [m] with which a waypoint need not be visited again."""
_WAYPOINT_TIME = 12.0
"""How long a waypoint is tried for, once near [s]: a half turn takes 7 s."""
_CLOSE = 4.0
"""Distance from a waypoint within which that time runs [m]."""


def waypoint_error(seen: Estimate, place: Point, heading: float) -> float:
    """The error [m] that wayfinding keeps the least of: e = d + 0.75^d h of the distance d [m] and heading error h."""
    distance, _ = seen.to(*place)
    return distance + math.pow(0.75, distance) * abs(wrap_angle(heading - seen.heading))


class WaypointFollower(Skipper):
    """Visits all waypoints on the shortest way and stops at each, since the least error at each is scored.

    A waypoint is finished when the error is below `_GOOD`, or after `_WAYPOINT_TIME`. The remaining time is used for
    those with the largest errors. The approach is that of `Berth`: bow first, then the heading; braking limits the
    speed.
    """

    def begin(self) -> None:
        """Forget the waypoints, at the start of a run."""
        self._berth = Berth()
        self._poses: list[tuple[Point, float]] = []
        self._least: list[float] = []
        self._order: list[int] = []
        self._since = math.inf

    def steer(self, now: Moment) -> Commands:
        """Commands that lead to the next waypoint."""
        if not self._poses:
            self._plan(now.seen, now.task)
        if not self._poses:
            return {}
        if now.task.get("state") == "running":
            self._look(now.seen, now.t)
        return self._berth.hold(self.pilot, now, *self._poses[self._order[0]])

    def _plan(self, seen: Estimate, task: "TaskObservation") -> None:
        waypoints = task.get("waypoints", ())
        self._poses = [(self.navigator.place(waypoint), self.navigator.direction(waypoint)) for waypoint in waypoints]
        self._least = [math.inf] * len(self._poses)
        self._order = self.order(seen, [place for place, _ in self._poses])

    def order(self, seen: Estimate, places: list[Point]) -> list[int]:
        """Order of the shortest way through the positions [m]."""
        return best_order(seen.place, places)

    def _look(self, seen: Estimate, t: float) -> None:
        """Take the errors of now, and see whether it is time to go on."""
        errors = [waypoint_error(seen, *pose) for pose in self._poses]
        self._least = list(map(min, self._least, errors))
        here = self._order[0]
        if seen.to(*self._poses[here][0])[0] < _CLOSE:
            self._since = min(self._since, t)
        if errors[here] < _GOOD or t - self._since > _WAYPOINT_TIME:
            self._go_on(here)

    def _go_on(self, here: int) -> None:
        """Go on to the next waypoint, or to the worst; if that is fair, stay."""
        if len(self._order) > 1:
            self._order.pop(0)
        else:
            worst = max(range(len(self._poses)), key=lambda number: self._least[number])
            self._order = [worst if self._least[worst] > _FAIR else here]
        self._since, self._berth = math.inf, Berth()
