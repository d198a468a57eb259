"""Controllers of courses: hold a pose, visit waypoints with their headings, circle the animals of the wildlife task."""

import math
from typing import TYPE_CHECKING

from vrx_mj.control.guidance import around, best_order, orbit, wrap_angle
from vrx_mj.control.navigation import Estimate, Point, polar
from vrx_mj.control.pilot import Commands, Moment, Pilot, Skipper

if TYPE_CHECKING:
    from vrx_mj.runtime.task_runner import TaskObservation

_TURNING_DISTANCE = 6.0
"""Within this distance of its place [m] a boat turns to the wanted heading; beyond, it goes there bow first. The turn
takes the WAM-V 7 s at most and the rest of the way as long; at 6 m the heading weighs 0.18 in the score."""
_TURNING_LENGTHS = 1.0
"""Turning distance, in lengths, of a boat that cannot push sideways."""
_GOOD_ERROR = 0.08
"""Error [m] below which the boat goes on to the next waypoint: 5 cm and 2 degrees."""
_FAIR_ERROR = 0.25
"""Error [m] below which a waypoint is not visited again."""
_WAYPOINT_TIME = 12.0
"""Longest time spent near one waypoint [s]: a half turn takes 7 s."""
_WAYPOINT_RADIUS = 4.0
"""Distance from a waypoint within which that time counts [m]."""
_SENSES = {"platypus": -1.0, "turtle": 1.0}
"""Sense of the circle around each kind of animal: clockwise -1, counter-clockwise 1."""
_CIRCLE_RADIUS = 5.5
"""Radius of the circles [m]: half of what engages, so that neither a gust nor the boat's length spoils it."""
_MIN_RADIUS = 4.0
"""Least radius of a circle beside a crocodile [m]: the boat's length allows no less without touching the animal."""
_ENGAGED_DISTANCE = 9.0
"""Distance from an animal within which circling surely counts [m]; the task demands 10 m, in space."""
_CROCODILE_CLEARANCE = 13.0
"""Distance to keep from a crocodile [m]: what engages it, and 3 m for what it swims between two messages."""
_CLEARANCE = 5.0
"""Distance to keep from other animals on the way [m]: a boat's length."""
_FIELD_WIDTH = 3.0
"""Distance from a circle at which the course is 45 degrees toward it [m]."""
_MIN_CLEARANCE = 3.0
"""Least distance to keep from any animal [m]."""
_MAX_CENTRIPETAL = 0.55
"""Largest acceleration in a circle [m/s2]: 160 N for the WAM-V."""
_FULL_CIRCLE = math.tau + math.radians(30.0)
"""Angle around an animal that completes a circle [rad]: all eight gates, and a margin for where the first was."""
_MAX_CRAB_ANGLE = math.radians(50.0)
"""Largest angle by which the bow points into the circle [rad]."""


class PoseHold:
    """How to come to a pose and hold it: bow first from afar, then with the heading wanted."""

    def __init__(self) -> None:
        self._near = False

    def hold(self, pilot: Pilot, now: Moment, place: Point, heading: float) -> Commands:
        """Commands to be at a place [m] with a heading [rad]."""
        distance, bearing = now.seen.to(*place)
        limit = _TURNING_DISTANCE if pilot.every_way else _TURNING_LENGTHS * pilot.craft.length
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
        self._pose_hold = PoseHold()
        self._goal: tuple[Point, float] | None = None

    def steer(self, now: Moment) -> Commands:
        """Commands that go to the goal and hold it."""
        goal = now.task.get("goal")
        if goal is not None:
            self._goal = self.navigator.place(goal), self.navigator.direction(goal)
        elif self._goal is None:
            self._goal = now.seen.place, now.seen.heading
        place, heading = self._goal
        return self._pose_hold.hold(self.pilot, now, place, wrap_angle(heading))


def waypoint_error(seen: Estimate, place: Point, heading: float) -> float:
    """The error [m] that wayfinding keeps the least of: e = d + 0.75^d h of the distance d [m] and heading error h."""
    distance, _ = seen.to(*place)
    return distance + math.pow(0.75, distance) * abs(wrap_angle(heading - seen.heading))


class WaypointFollower(Skipper):
    """Visits all waypoints on the shortest way and stops at each, since the least error at each is scored.

    A waypoint is finished when the error is below `_GOOD_ERROR`, or after `_WAYPOINT_TIME`. The remaining time is used
    for those with the largest errors. The approach is that of `PoseHold`: bow first, then the heading; braking limits
    the speed.
    """

    def begin(self) -> None:
        """Forget the waypoints, at the start of a run."""
        self._pose_hold = PoseHold()
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
        return self._pose_hold.hold(self.pilot, now, *self._poses[self._order[0]])

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
        if seen.to(*self._poses[here][0])[0] < _WAYPOINT_RADIUS:
            self._since = min(self._since, t)
        if errors[here] < _GOOD_ERROR or t - self._since > _WAYPOINT_TIME:
            self._go_on(here)

    def _go_on(self, here: int) -> None:
        """Go on to the next waypoint, or to the worst; if that is fair, stay."""
        if len(self._order) > 1:
            self._order.pop(0)
        else:
            worst = max(range(len(self._poses)), key=lambda number: self._least[number])
            self._order = [worst if self._least[worst] > _FAIR_ERROR else here]
        self._since, self._pose_hold = math.inf, PoseHold()


class WildlifeCircler(Skipper):
    """Circles the animals that must be circled, on the shortest way, clear of the others.

    A vector field leads into the circle and along it. A catamaran has hardly any drag sideways, so thrust must give the
    centripetal force. The bow therefore points into the circle, along the sum of the forces against drag and toward
    the centre, and the main thrusters give all of it. Its speed is what `_MAX_CENTRIPETAL` allows.
    """

    def begin(self) -> None:
        """Forget the animals, at the start of a run."""
        self._order: list[int] | None = None
        self._bearing: float | None = None
        self._swept = 0.0

    def steer(self, now: Moment) -> Commands:
        """Commands that follow the present circle, or lead to the next one."""
        animals = [(str(animal["name"]), self.navigator.place(animal)) for animal in now.task.get("animals", ())]
        if self._order is None and animals:
            wanted = [number for number, (name, _) in enumerate(animals) if name in _SENSES]
            order = best_order(now.seen.place, [animals[number][1] for number in wanted])
            self._order = [wanted[number] for number in order]
        if not self._order:
            return self.stop(now)
        self._sweep(now.seen, *animals[self._order[0]])
        if self._swept > _FULL_CIRCLE:
            self._order.pop(0)
            self._bearing, self._swept = None, 0.0
            return self.steer(now)
        return self._circle(now, self._order[0], animals)

    def _sweep(self, seen: Estimate, name: str, centre: Point) -> None:
        """Add up the way around [rad]; away from the animal, or the wrong way, it starts over."""
        distance, bearing = seen.to(*centre)
        if distance > _ENGAGED_DISTANCE or self._swept < 0.0:
            self._swept, self._bearing = 0.0, None
        if distance <= _ENGAGED_DISTANCE:
            if self._bearing is not None:
                self._swept += _SENSES[name] * wrap_angle(bearing - self._bearing)
            self._bearing = bearing

    def _circle(self, now: Moment, number: int, animals: list[tuple[str, Point]]) -> Commands:
        """Sail along the vector field, or around what is in the way."""
        (name, centre), seen = animals[number], now.seen
        here, sense = seen.place, _SENSES[name]
        radius = self._radius(centre, animals)
        speed = self._speed(seen.to(*centre)[0] - radius, radius)
        discs = [(place, _clearance(name, math.dist(place, centre))) for name, place in animals if place != centre]
        aim = around(here, centre, discs)
        if aim != centre:
            return self.sail(now, speed, seen.to(*aim)[1])
        ahead = orbit((here[0] - centre[0], here[1] - centre[1]), radius, sense, _FIELD_WIDTH)
        return self._along(now, centre, radius, (ahead[0] * speed, ahead[1] * speed), sense)

    def _along(self, now: Moment, centre: Point, radius: float, velocity: Point, sense: float) -> Commands:
        """Sail with a velocity that turns as the circle does, the bow along the force that it takes."""
        distance, bearing = now.seen.to(*centre)
        speed = math.hypot(*velocity)
        inward = speed * speed / radius if distance < radius + 2.0 * _FIELD_WIDTH else 0.0
        drag, _ = self.pilot.craft.drag(speed, 0.0)
        crab = min(_MAX_CRAB_ANGLE, math.atan2(self.pilot.craft.mass * inward, drag))
        return self.pilot.sail(
            now.seen,
            now.t,
            *velocity,
            math.atan2(velocity[1], velocity[0]) + sense * crab,
            turn=sense * inward / max(speed, 0.1),
            acceleration=polar(inward, bearing),
        )

    @staticmethod
    def _radius(centre: Point, animals: list[tuple[str, Point]]) -> float:
        """Radius of a circle [m]: smaller beside a crocodile."""
        free = [math.dist(centre, place) - _CROCODILE_CLEARANCE + 1.0 for name, place in animals if name not in _SENSES]
        return max(_MIN_RADIUS, min([_CIRCLE_RADIUS, *free]))

    def _speed(self, off: float, radius: float) -> float:
        """Speed [m/s] at a distance `off` from the circle [m]."""
        circling = math.sqrt(_MAX_CENTRIPETAL * radius)
        braked = math.sqrt(circling**2 + 2.0 * self.pilot.braking * max(0.0, off - _FIELD_WIDTH))
        return min(braked, 0.95 * self.pilot.top_speed)


def _clearance(name: str, apart: float) -> float:
    """How far [m] to stay from an animal that is so far from the one to circle: not so far that no circle fits."""
    return max(_MIN_CLEARANCE, min(_CLEARANCE if name in _SENSES else _CROCODILE_CLEARANCE, apart - _MIN_RADIUS - 1.5))
