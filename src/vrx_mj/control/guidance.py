"""Guidance: where to go and how fast, as pure functions of places."""

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from itertools import permutations
from typing import TYPE_CHECKING, NamedTuple

from vrx_mj.control.navigation import Estimate, Point, beside, direction_to, in_axes, polar
from vrx_mj.control.velocity import Allocation, Craft, clamp, steady_rate
from vrx_mj.errors import CommandError

if TYPE_CHECKING:
    from vrx_mj.runtime.hull import Propeller

_MAX_PERMUTED = 7
"""Largest number of places of which all orders are tried."""
_DISC_MARGIN = 0.1
"""Distance beyond the rim of a disc of a place that was moved out of it [m]."""

POINT_SPACING = 0.5
"""Distance between the points of an arc, and of a track that a boat lays [m]."""
CHORD_LENGTH = 2.0
"""Distance either way over which the direction of a track is taken [m], so that corners and noise count little."""
_SURGE_RATE = 1.2
"""Rate at which errors of surge speed decay [1/s]."""
_HEADING_RATE = 1.0
"""Rate at which errors of heading decay [1/s], at most a third of what turning at full power allows."""
_TURN_RATE = 2.5
"""Rate at which errors of yaw rate decay [1/s]."""
_MAX_YAW_RATE = 0.8
"""Largest commanded yaw rate [rad/s]."""
_ARRIVAL_LENGTHS = 0.5
"""A boat stops within this many lengths of its place: it cannot come nearer without turning on the spot."""
_RETURN_LENGTHS = 1.0
"""A boat that stopped goes back once it is this many lengths from its place."""
_REST_SPEED = 0.05
"""Velocities below this count as 0 [m/s]."""
_SLIDING_SPEED = 0.3
"""A stopping boat that is faster than this points one of its ends to where it goes [m/s]."""
_TURNING_SHARE = 0.3
"""Share of the top speed at which a boat that turns by rudder goes about."""
_COURSE_STEP = math.radians(5.0)
"""Angle between the courses that are tried [rad]."""
_COURSE_STEPS = 26
"""Number of courses tried on each side: up to 130 degrees."""
_OBSTACLE_COST = 6.0
"""Cost of a course straight through something near, in radians of turning away."""
_SWITCHING_COST = 0.15
"""Cost [rad] of leaving the side that was chosen before, so that the boat does not waver in front of a buoy."""


def wrap_angle(angle: float) -> float:
    """The angle [rad] within half a turn either way."""
    return math.remainder(angle, math.tau)


def approach_speed(distance: float, rate: float, braking: float) -> float:
    """The speed [m/s] at a distance [m] from where the boat is to stop.

    Near by it is proportional to the distance, `rate` [1/s]; from where that would be braking harder than `braking`
    [m/s2], it is the speed that braking evenly brings to nothing.
    """
    if distance <= braking / rate**2:
        return rate * distance
    return math.sqrt(braking * (2.0 * distance - braking / rate**2))


def orbit(offset: Point, radius: float, sense: float, width: float) -> Point:
    """The direction, a unit vector, that leads from `offset` [m] from a centre into a circle around it and along it.

    `sense` 1 goes counter-clockwise, -1 clockwise. A vector field: `width` [m] off the circle the course is 45 degrees
    towards it (Nelson et al., Vector field path following for miniature air vehicles, 2007).
    """
    away = math.hypot(*offset)
    out = (offset[0] / away, offset[1] / away) if away > 1e-9 else (1.0, 0.0)
    along = (-sense * out[1], sense * out[0])
    inward = math.atan((away - radius) / width)
    cos, sin = math.cos(inward), math.sin(inward)
    return along[0] * cos - out[0] * sin, along[1] * cos - out[1] * sin


def around(start: Point, goal: Point, discs: Sequence[tuple[Point, float]]) -> Point:
    """Where to steer for from `start` on the way to `goal`, clear of discs, given by centre and radius [m].

    The first disc in the way is passed along its tangent, on the side that is nearer; who is inside goes straight out.
    """
    length = math.dist(goal, start)
    if length < 1e-9:
        return goal
    ahead = ((goal[0] - start[0]) / length, (goal[1] - start[1]) / length)
    found = [(_entry(start, ahead, length, *disc), *disc) for disc in discs]
    hits = [(entry, centre, radius) for entry, centre, radius in found if entry is not None]
    return _tangent(start, ahead, *min(hits)[1:]) if hits else goal


def clear_of(place: Point, discs: Sequence[tuple[Point, float]]) -> Point:
    """The place, or where discs of a centre and a radius [m] leave off that it lies in, straight out of each."""
    for centre, radius in discs:
        dx, dy = place[0] - centre[0], place[1] - centre[1]
        away = math.hypot(dx, dy)
        if away < radius:
            east, north = (dx / away, dy / away) if away > 1e-9 else (1.0, 0.0)
            place = (centre[0] + (radius + _DISC_MARGIN) * east, centre[1] + (radius + _DISC_MARGIN) * north)
    return place


def best_order(start: Point, places: Sequence[Point]) -> list[int]:
    """The order that makes the way from `start` through all places shortest; of many places, the nearest is next."""
    if len(places) <= _MAX_PERMUTED:

        def length(order: Iterable[int]) -> float:
            way = [places[number] for number in order]
            return sum(map(math.dist, [start, *way], way))

        return list(min(permutations(range(len(places))), key=length))
    left, order, here = set(range(len(places))), [], start
    while left:
        nearest = min(sorted(left), key=lambda number: math.dist(here, places[number]))
        left.remove(nearest)
        order.append(nearest)
        here = places[nearest]
    return order


def _entry(start: Point, ahead: Point, length: float, centre: Point, radius: float) -> float | None:
    """How far along the way [m] a disc is entered; None if it is not in the way."""
    dx, dy = centre[0] - start[0], centre[1] - start[1]
    along, across = dx * ahead[0] + dy * ahead[1], ahead[0] * dy - ahead[1] * dx
    if abs(across) >= radius:
        return None
    half = math.sqrt(radius * radius - across * across)
    if along + half <= 0.0 or along - half >= length:
        return None
    return along - half


def _tangent(start: Point, ahead: Point, centre: Point, radius: float) -> Point:
    """A place on the tangent from `start` to a disc, level with its centre; from inside it, straight out."""
    dx, dy = centre[0] - start[0], centre[1] - start[1]
    away = math.hypot(dx, dy)
    if away <= radius:
        scale = radius / max(away, 1e-9)
        return start[0] - dx * scale, start[1] - dy * scale
    side = 1.0 if ahead[0] * dy - ahead[1] * dx < 0.0 else -1.0  # a centre to starboard is passed to port of it
    turn = math.atan2(dy, dx) + side * math.asin(radius / away)
    return beside(start, turn, math.sqrt(away * away - radius * radius))


class Spot(NamedTuple):
    """A place beside a track."""

    x: float
    """East [m]."""
    y: float
    """North [m]."""
    direction: float
    """Direction of the track [rad], counter-clockwise from east."""
    curvature: float
    """Curvature of the track [1/m], positive to port."""
    left: float
    """Length of the track that is left [m]."""

    def pace(self, speed: float) -> float:
        """The speed [m/s] of this spot when that of its track has a `speed`: in a turn, the outer side goes faster."""
        return speed * (1.0 - self.curvature * self.left)


class Track:
    """A line through points, by its length; it goes on straight before its start and beyond its end."""

    def __init__(self, points: Sequence[Point]) -> None:
        """Draw the line through points, east and north [m], at least two of them apart."""
        self._points = [points[0]]
        self._shift = (0.0, 0.0)
        self._lengths = [0.0]
        for point in points[1:]:
            self.extend(point)

    @property
    def length(self) -> float:
        """Length of the track [m]."""
        return self._lengths[-1]

    @property
    def end(self) -> Point:
        """The last point."""
        return self._points[-1][0] + self._shift[0], self._points[-1][1] + self._shift[1]

    def extend(self, point: Point) -> None:
        """Go on to a point; one nearer than a millimetre is ignored."""
        gap = math.dist(self.end, point)
        if gap > 1e-3:
            self._points.append((point[0] - self._shift[0], point[1] - self._shift[1]))
            self._lengths.append(self._lengths[-1] + gap)

    def shift(self, east: float, north: float) -> None:
        """Carry the whole line along [m]."""
        self._shift = self._shift[0] + east, self._shift[1] + north

    def spot(self, along: float, left: float = 0.0) -> Spot:
        """The place `along` [m] from the start and `left` [m] of the track there."""
        before, here, after = (self._place(along + way) for way in (-CHORD_LENGTH, 0.0, CHORD_LENGTH))
        direction = direction_to(before, after)
        came = direction_to(before, here)
        goes = direction_to(here, after)
        return Spot(*beside(here, direction, 0.0, left), direction, wrap_angle(goes - came) / CHORD_LENGTH, left)

    def _place(self, along: float) -> Point:
        leg = min(max(bisect_right(self._lengths, along), 1), len(self._points) - 1)
        start, end = self._lengths[leg - 1], self._lengths[leg]
        share = (along - start) / (end - start)
        (x0, y0), (x1, y1) = self._points[leg - 1], self._points[leg]
        return x0 + share * (x1 - x0) + self._shift[0], y0 + share * (y1 - y0) + self._shift[1]


def round_corners(points: Sequence[Point], radius: float) -> list[Point]:
    """The way through points with corners made arcs of a radius [m], or less where legs are too short for that."""
    way = [points[0]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        way += _arc(before, corner, after, radius)
    return [*way, points[-1]]


def _arc(before: Point, corner: Point, after: Point, radius: float) -> list[Point]:
    """Arc between two legs, tangent to both, from one to the other."""
    one, other = math.dist(before, corner), math.dist(corner, after)
    heading = direction_to(before, corner)
    turn = wrap_angle(direction_to(corner, after) - heading)
    bend = math.tan(0.5 * abs(turn))
    cut = min(radius * bend, 0.5 * one, 0.5 * other)  # of each leg
    if bend < 1e-9 or cut < 1e-9:
        return [corner]
    side = math.copysign(cut / bend, turn)
    centre = beside(corner, heading, -cut, side)
    count = max(2, math.ceil(abs(side * turn) / POINT_SPACING))
    angles = [heading + turn * i / count for i in range(count + 1)]
    return [(centre[0] + side * math.sin(angle), centre[1] - side * math.cos(angle)) for angle in angles]


class Course:
    """Steers one boat by its bow."""

    def __init__(self, thrusters: "Mapping[str, Propeller]", craft: Craft, allocation: Allocation) -> None:
        self._craft, self._allocation = craft, allocation
        plenty = 2.0 * sum(thruster.max_forward - thruster.max_reverse for thruster in thrusters.values())
        self._full = allocation(plenty, 0.0, 0.0).surge
        turning = allocation(0.0, 0.0, plenty * craft.length).yaw
        self._by_rudder = bool(craft.rudders) and turning < 1e-6 * plenty
        if not self._by_rudder and turning <= 0.0:
            needed = "a second engine, a rudder or an angle of 60 degrees is needed"
            raise CommandError(f"this boat cannot turn with {', '.join(thrusters)}: {needed}")
        self._fastest = _MAX_YAW_RATE if self._by_rudder else min(_MAX_YAW_RATE, steady_rate(craft.yaw_drag, turning))
        self._heading_rate = min(_HEADING_RATE, 3.0 * self._fastest)
        self._staying = False

    def hold(
        self, seen: Estimate, x: float, y: float, heading: float, *, speed: float, braking: float
    ) -> dict[str, float]:
        """Commands to come to a place [m] and stay within a length of it, at most at a `speed` [m/s].

        `braking` [m/s2] is the deceleration to rely on. Within the limits the boat has the heading [rad], if it can.
        """
        distance, bearing = seen.to(x, y)
        self._staying = distance < (_RETURN_LENGTHS if self._staying else _ARRIVAL_LENGTHS) * self._craft.length
        if self._staying:
            return self.sail(seen, 0.0, 0.0, heading)
        way = max(0.0, distance - 0.5 * _ARRIVAL_LENGTHS * self._craft.length)
        wanted = min(approach_speed(way, 0.5 * self._fastest, braking), speed)
        return self.sail(seen, *polar(wanted, bearing), heading)

    def sail(self, seen: Estimate, vx: float, vy: float, heading: float) -> dict[str, float]:
        """Commands for a velocity over ground [m/s, east and north]; at rest, for a heading [rad]."""
        off = wrap_angle(self._bow(seen, vx, vy, heading) - seen.heading)
        along, _ = in_axes(seen.heading, vx, vy)
        wanted = max(0.0, along) if math.hypot(vx, vy) > _REST_SPEED else 0.0
        if self._by_rudder and math.hypot(vx, vy) > _REST_SPEED:  # no rudder turns a boat without way
            wanted = max(wanted, _TURNING_SHARE * self._craft.top_speed(self._full))
        turn = clamp(self._heading_rate * off, self._fastest)
        surge = self._craft.mass * _SURGE_RATE * (wanted - seen.surge) + self._craft.drag(wanted, 0.0)[0]
        moment = self._craft.inertia * _TURN_RATE * (turn - seen.turn) + self._craft.turning_drag(turn)
        thrust = self._allocation(surge, 0.0, 0.0 if self._by_rudder else moment)
        return {**thrust.commands, **self._craft.rudder_angles(moment, seen.surge, thrust.surge)}

    def _bow(self, seen: Estimate, vx: float, vy: float, heading: float) -> float:
        """Where the bow is to point [rad]."""
        if math.hypot(vx, vy) > _REST_SPEED:
            return math.atan2(2.0 * vy - seen.vy, 2.0 * vx - seen.vx)
        if self._by_rudder:
            return seen.heading
        if math.hypot(seen.vx, seen.vy) > _SLIDING_SPEED:
            course = math.atan2(seen.vy, seen.vx)
            return course if abs(wrap_angle(course - seen.heading)) < math.pi / 2 else course + math.pi
        return heading


def clear_course(
    here: Point, wanted: float, discs: Sequence[tuple[Point, float]], *, reach: float, before: float | None = None
) -> float:
    """The course [rad] to steer from `here` for a wanted one, past discs of centre and radius [m].

    Discs whose centre is further off than `reach` [m] are left for later. `before` is what was steered last.
    """
    near = [(centre, radius) for centre, radius in discs if math.dist(here, centre) < reach + radius]
    if not near:
        return wanted

    def cost(step: int) -> float:
        course = wanted + step * _COURSE_STEP
        charge = sum(_charge(here, course, centre, radius, reach) for centre, radius in near)
        kept = before is None or abs(wrap_angle(course - before)) < 2.5 * _COURSE_STEP
        return abs(step) * _COURSE_STEP + charge + (0.0 if kept else _SWITCHING_COST)

    best = min(sorted(range(-_COURSE_STEPS, _COURSE_STEPS + 1), key=abs), key=cost)
    return wrap_angle(wanted + best * _COURSE_STEP)


def _charge(here: Point, course: float, centre: Point, radius: float, reach: float) -> float:
    """Cost of passing a disc on a course [rad]: none outside of it, largest through the middle of a near one."""
    along, left = in_axes(course, centre[0] - here[0], centre[1] - here[1])
    across = abs(left)
    if along <= 0.0 or across >= radius:
        return 0.0
    nearness = max(0.0, 1.0 - max(0.0, along - radius) / reach)
    return _OBSTACLE_COST * (0.15 + 0.85 * nearness) * (1.0 - across / radius)
