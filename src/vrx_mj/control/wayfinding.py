"""Wayfinding: come near to every waypoint, with its heading."""

import math
from typing import TYPE_CHECKING

from vrx_mj.control.guidance import best_order, wrap_angle
from vrx_mj.control.navigation import Estimate, Point
from vrx_mj.control.skipper import Commands, Moment, Skipper
from vrx_mj.control.stationkeeping import Berth

if TYPE_CHECKING:
    from vrx_mj.runtime.task_runner import TaskObservation

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
