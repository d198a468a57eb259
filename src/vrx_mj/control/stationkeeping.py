"""Station-keeping: be at a pose and stay there."""

from vrx_mj.control.guidance import wrap_angle
from vrx_mj.control.navigation import Point
from vrx_mj.control.pilot import Pilot
from vrx_mj.control.skipper import Commands, Moment, Skipper

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
