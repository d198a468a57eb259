"""Formations: boats that keep their places beside a leader, while it goes its way and when the shape changes.

Three loops, one in the other. Guidance: every boat has a slot that moves along the leader's track, and wants the slot's
velocity and one toward it, the constant bearing guidance of Breivik, Hovstein and Fossen, Straight-line target tracking
for unmanned surface vehicles, 2008 (Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 12.1).
Of that velocity is taken what leads into another boat. Its length and direction are a surge speed and, by a law of
proportion, a yaw rate, which `VelocityKeeper` holds. Beside a slot at rest there is no direction to go: there a `Pilot`
holds the boat, if it can push every way.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, get_args

import numpy as np
from scipy.optimize import linear_sum_assignment

from vrx_mj.arguments import check_name
from vrx_mj.config.layouts import Layout, LayoutName, spots
from vrx_mj.control.guidance import CHORD_LENGTH, POINT_SPACING, Spot, Track, round_corners, wrap_angle
from vrx_mj.control.navigation import Estimate, Navigator, Point, TangentPlane, beside, in_axes, polar
from vrx_mj.control.pilot import Pilot
from vrx_mj.control.velocity import VelocityKeeper, clamp, craft_of
from vrx_mj.errors import SensorError, VrxError

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation, Observation

WAITING_LAG = 15.0
"""Lag of the last boat behind its slot at which a virtual leader stops [m]; below it the leader slows down in
proportion."""
_MIN_TRACK_SPEED = 0.3
"""A leader slower than this over ground [m/s] carries its track along instead of extending it."""
_ASTERN_COSINE = -0.5
"""So does one whose course and heading have a cosine below this: they are more than 120 degrees apart."""
_COURSE_TIME_CONSTANT = 1.5
"""Time constant with which the velocity of a leading boat is smoothed [s]."""
SHAPES = tuple(sorted(get_args(LayoutName)))
"""Names of the shapes."""
CLOSING_SPEED = 1.0
"""Largest speed relative to its slot at which a boat goes to it [m/s]."""
_CLOSING_DISTANCE = 4.0
"""Distance from its slot [m] at which a boat has 0.7 of that speed; small errors decay at the ratio of the two
[1/s]."""
_HEADING_RATE = 0.8
"""Rate at which errors of heading decay [1/s]: a third of that of the inner loop, of the yaw rate."""
_MAX_YAW_RATE = 0.6
"""Largest commanded yaw rate [rad/s]."""
_STEADY_SPEED = 0.5
"""A slot slower than this [m/s] draws the bow to its own direction: a boat near its slot would turn about for it."""
_HOLD_SPEED = 0.3
"""A pilot holds slots slower than this [m/s]: bow first, a boat would go around them for ever."""
_HOLD_DISTANCE = 5.0
"""A pilot holds such a slot within this distance from it [m]."""
_SKID_LEAD = 1.5
"""Share of the error of velocity by which the bow leads: a WAM-V skids on for 7 s, its mass over its drag."""
_MAX_ASTERN_SPEED = 0.3
"""Largest commanded speed astern [m/s]."""
YIELD_RATE = 0.3
"""Largest rate at which two boats may use up the distance that is left between them [1/s]."""
_MIN_EXTENT = 0.01
"""Least distance between a path's first point and the one furthest from it [m]."""


class Muster:
    """Estimates of all boats, each by a `Navigator` of its own, exchanged as if by radio."""

    def __init__(self, origin: TangentPlane | None = None) -> None:
        """East and north count from an `origin`; by default, from the first fix of the first boat."""
        self.plane = origin
        """The frame; of no meaning where boats navigate by ground truth, for they share the world's."""
        self._navigators: dict[str, Navigator] = {}

    def __call__(self, boats: "Mapping[str, BoatObservation]", t: float) -> dict[str, Estimate]:
        """Where the boats are at the time `t` [s].

        Raises:
            SensorError: some boats navigate by GPS and some by ground truth, so that they share no frame.
        """
        self._navigators = {name: self._navigators.get(name) or Navigator() for name in boats}
        seen = {name: navigator(boats[name], t) for name, navigator in self._navigators.items()}
        blind = [name for name, navigator in self._navigators.items() if navigator.plane is None]
        if len(blind) == len(seen):
            return seen
        if blind:
            raise SensorError(f"no GPS receiver or no IMU: {', '.join(blind)}; the other boats of the fleet have both")
        return {name: self._in_fleet_frame(self._navigators[name], own) for name, own in seen.items()}

    def _in_fleet_frame(self, navigator: Navigator, own: Estimate) -> Estimate:
        """An estimate in the fleet's frame, whose axes are parallel to the boat's own over a fleet's breadth."""
        assert navigator.plane is not None, "navigates by ground truth"
        if self.plane is None:
            self.plane = navigator.plane
        x, y = self.plane.local(*navigator.plane.geodetic(own.x, own.y))
        return replace(own, x=x, y=y)


class Leader:
    """Leader of a formation: a boat, or a virtual one."""

    name: str | None = None
    """Name of the boat that leads; None of a virtual leader."""
    track: Track
    """Where it goes and came along."""
    along = 0.0
    """How far it has come [m]."""
    speed = 0.0
    """Along its track [m/s]."""
    drift = (0.0, 0.0)
    """Velocity with which its track is carried along [m/s, east and north]."""
    pose = (0.0, 0.0, 0.0)
    """East, north [m] and heading [rad]: of the track of a virtual leader, of a boat whatever its course."""


class PathLeader(Leader):
    """A virtual leader, which goes along a path and waits for boats that fall behind."""

    def __init__(self, path: Sequence[Point], speed: float, radius: float) -> None:
        """Along a path at a speed [m/s], its corners made arcs of a radius [m]."""
        self.track = Track(round_corners(path, radius))
        self.pose = self.track.spot(0.0)[:3]
        self._full = speed
        self._then = math.inf

    def move(self, seen: Mapping[str, Estimate], t: float, lag: float) -> None:
        """Go on until the time `t` [s]; the boat that is furthest behind its slot is so by `lag` [m]."""
        self.along = min(self.along + self.speed * max(0.0, t - self._then), self.track.length)
        pace = self._full * max(0.0, min(1.0, 1.0 - lag / WAITING_LAG))
        self.speed = 0.0 if self.has_arrived else pace
        self.pose = self.track.spot(self.along)[:3]
        self._then = t

    @property
    def has_arrived(self) -> bool:
        """Whether it is at the end of its path."""
        return self.along >= self.track.length


class BoatLeader(Leader):
    """A boat that leads the others on the track that it lays over ground; ahead of it, and at first, that is straight.

    The track follows the boat's course, whatever its heading: sideways too. While the boat is nearly at rest or goes
    astern its course gives no place to the others, and the whole track is carried along with it.
    """

    def __init__(self, name: str) -> None:
        self.name: str = name
        self.track = Track([(0.0, 0.0), (1.0, 0.0)])
        self._velocity = (0.0, 0.0)
        self._place: Point | None = None
        self._gone = 0.0
        self._then = 0.0

    def move(self, seen: Mapping[str, Estimate], t: float, lag: float) -> None:
        """Take in where the boat is; it does not know who is behind.

        Raises:
            UnknownNameError: the boat is not there.
        """
        check_name("boat", self.name, seen)
        boat = seen[self.name]
        self.pose = boat.x, boat.y, boat.heading
        if self._place is None:
            start = beside(boat.place, boat.heading, -CHORD_LENGTH)
            self.track, self._velocity = Track([start, boat.place]), (boat.vx, boat.vy)
            self._place = boat.place
        east, north = boat.x - self._place[0], boat.y - self._place[1]
        self._smooth(east, north, t - self._then)
        self._place, self._then = boat.place, t
        vx, vy = self._velocity
        speed = math.hypot(vx, vy)
        if speed < _MIN_TRACK_SPEED or in_axes(boat.heading, vx, vy)[0] < _ASTERN_COSINE * speed:
            self.track.shift(east, north)
            self.speed, self.drift = 0.0, self._velocity
        else:
            self.speed, self.drift = speed, (0.0, 0.0)
            self._lay(boat, vx / speed, vy / speed)
        self.along = self.track.length + self._gone

    def _smooth(self, east: float, north: float, interval: float) -> None:
        """The velocity over ground without what waves do to it."""
        if interval > 0.0:
            share, (vx, vy) = 1.0 - math.exp(-interval / _COURSE_TIME_CONSTANT), self._velocity
            self._velocity = vx + share * (east / interval - vx), vy + share * (north / interval - vy)

    def _lay(self, boat: Estimate, east: float, north: float) -> None:
        """Extend the track by what the boat has come along its course, a unit vector."""
        x, y = self.track.end
        self._gone = max(0.0, (boat.x - x) * east + (boat.y - y) * north)
        if self._gone >= POINT_SPACING:
            self.track.extend(boat.place)
            self._gone = 0.0


def slots(shape: str, n: int, spacing: float) -> list[Point]:
    """Places (ahead, left) of a leader [m] for `n` boats whose neighbours are `spacing` [m] apart: a fleet's layouts.

    The leader is in the middle of a circle, and in front of the others' middle. Slots are numbered from the front to
    the back and from the middle outwards, port first; on a circle counter-clockwise, from the one ahead. A leading boat
    has the first. `random` is the same for as many boats at any time.

    Raises:
        UnknownNameError: no shape has that name.
    """
    check_name("shape", shape, SHAPES)
    radius = 0.0 if n < 2 else 0.5 * spacing / math.sin(math.pi / n)
    places = spots(Layout.model_construct(layout=shape, radius=radius, spacing=spacing), n)
    if shape == "circle":
        return list(places)
    front = max((ahead for ahead, _ in places), default=0.0)
    return sorted(((ahead - front, left) for ahead, left in places), key=_rank)


def _rank(place: Point) -> tuple[float, float, float]:
    ahead, left = place
    return round(-ahead, 6), round(abs(left), 6), -left  # to a rounding, for mirrored places are equal


def assignment(places: Sequence[Point], goals: Sequence[Point]) -> list[int]:
    """The goal of each place, such that the distances [m] together are least; as many goals as places."""
    gaps = np.array([[math.dist(place, goal) for goal in goals] for place in places]).reshape(len(places), len(goals))
    return [int(goal) for goal in linear_sum_assignment(gaps)[1]]


def pursuit(seen: Estimate, slot: Spot, speed: float, *, drift: Point = (0.0, 0.0)) -> Point:
    """The velocity [m/s, east and north] that brings a boat to a slot, which moves with its leader at a `speed` [m/s].

    `drift` [m/s, east and north] is the velocity of the track itself. Constant bearing guidance: seen from the slot,
    the boat comes straight at it.
    """
    dx, dy = slot.x - seen.x, slot.y - seen.y
    closing = CLOSING_SPEED / math.sqrt(dx * dx + dy * dy + _CLOSING_DISTANCE * _CLOSING_DISTANCE)
    east, north = polar(slot.pace(speed), slot.direction)
    return east + drift[0] + closing * dx, north + drift[1] + closing * dy


def apart_velocity(seen: Estimate, wanted: Point, others: Sequence[Estimate], apart: float) -> Point:
    """The part of a wanted velocity [m/s] with which the boat does not come nearer to others than `apart` [m].

    Toward another boat the velocity is at most that boat's plus `YIELD_RATE` times the distance that is left: a barrier
    (Wang, Ames and Egerstedt, Safety barrier certificates for collisions-free multirobot systems, 2017). What is too
    much of it goes to starboard by half, so that two who meet head on pass each other (COLREG 14).
    """
    vx, vy = wanted
    for other in others:
        distance, bearing = seen.to(other.x, other.y)
        east, north = math.cos(bearing), math.sin(bearing)
        allowed = other.vx * east + other.vy * north + YIELD_RATE * (distance - apart)
        excess = vx * east + vy * north - allowed
        if excess > 0.0:
            vx, vy = vx - excess * (east - 0.5 * north), vy - excess * (north + 0.5 * east)
    return vx, vy


class Formation:
    """A controller of all boats: they go along a path in a shape, or follow one of them in it.

    Places are east and north [m] of an origin. Given as a `TangentPlane`, that is a place on the Earth, best the
    world's georeference; by default it is where the first boat had its first fix. Boats that navigate by ground truth
    (`Navigator`) share the world's frame instead.
    """

    def __init__(
        self,
        path: Sequence[Point] = (),
        *,
        leader: str | None = None,
        shape: str = "wedge",
        spacing: float = 12.0,
        speed: float = 1.4,
        radius: float = 30.0,
        apart: float = 7.0,
        origin: TangentPlane | None = None,
    ) -> None:
        """Keep places beside a virtual leader, or a boat's.

        The virtual leader goes along a `path` at a `speed` [m/s], its corners rounded to a `radius` [m]. A `leader`, a
        boat's name, is commanded by somebody else; it has the first slot. Boats keep `apart` [m], origin from origin.

        Raises:
            UnknownNameError: no shape has that name.
            VrxError: boats would be nearer together than they may be; there is a path and a leader, or neither; the
                path leads nowhere, or the virtual leader would not move.
        """
        if (leader is None) != (len(path) > 1):
            given = f"a path of {len(path)} points and {'no leader' if leader is None else f'the leader {leader!r}'}"
            raise VrxError(f"expected either a path of 2 points or more, or a leader, got {given}")
        if leader is None:
            _check_way(path, speed, radius)
        self.apart = apart
        _check_formation(shape, spacing, apart)
        self._first = shape, spacing
        self._origin = origin
        self._new_leader = partial(PathLeader, path, speed, radius) if leader is None else partial(BoatLeader, leader)
        self.reset(0)

    def reset(self, seed: int) -> None:
        """Forget all, before a new run; nothing here is random, so the seed does nothing."""
        self.shape, self.spacing = self._first
        self.leader: PathLeader | BoatLeader = self._new_leader()
        self.muster = Muster(self._origin)
        self.places: dict[str, int] = {}
        """The number of each boat's slot; a leading boat, which has the first, is not among them."""
        self.goals: dict[str, Spot] = {}
        """The slots at the last call, by boat."""
        self.off: dict[str, float] = {}
        """How far each boat was from its slot, which hangs on the leader's track, at the last call [m]."""
        self.off_shape: dict[str, float] = {}
        """Distance of each boat from its place in the rigid shape, which turns with the leader's heading [m].

        Larger than `off` where the leader turns: the slots turn when its track does."""
        self._helms: dict[str, tuple[VelocityKeeper, Pilot]] = {}

    def change(self, shape: str, spacing: float | None = None, *, reassign: bool = False) -> None:
        """Take another shape from the next call on; boats keep the number of their slot unless they are to `reassign`.

        Raises:
            UnknownNameError: no shape has that name.
            VrxError: boats would be nearer together than they may be.
        """
        spacing = self.spacing if spacing is None else spacing
        _check_formation(shape, spacing, self.apart)
        self.shape, self.spacing = shape, spacing
        if reassign:
            self.places = {}

    def __call__(self, obs: "Observation", t: float) -> dict[str, dict[str, float]]:
        """Commands for all boats but a leading one.

        Raises:
            UnknownNameError: the leading boat is not there.
            SensorError: the boats have no frame in common.
        """
        seen = self.muster(dict(obs.items()), t)
        gaps = (
            (goal.direction, goal.x - seen[name].x, goal.y - seen[name].y)
            for name, goal in self.goals.items()
            if name in seen
        )
        lag = max((in_axes(*gap)[0] for gap in gaps), default=0.0)  # along the track
        self.leader.move(seen, t, lag)
        self._take_places(seen)
        self.off = {name: seen[name].to(goal.x, goal.y)[0] for name, goal in self.goals.items()}
        for name in self.places.keys() - self._helms.keys():
            thrusters, craft = obs[name].thrusters, craft_of(obs[name])
            self._helms[name] = VelocityKeeper(thrusters, craft), Pilot(thrusters, craft)
        return {name: self._steer(name, seen, t) for name in self.places}

    def _take_places(self, seen: Mapping[str, Estimate]) -> None:
        """Find the slots, and assign them anew if other boats are there than before."""
        offsets, leading = slots(self.shape, len(seen), self.spacing), self.leader.name
        ahead, left = (0.0, 0.0) if leading is None else offsets[0]
        track, along = self.leader.track, self.leader.along
        goals = [track.spot(along + offset[0] - ahead, offset[1] - left) for offset in offsets]
        boats = [name for name in seen if name != leading]
        first = len(seen) - len(boats)
        if self.places.keys() != set(boats):
            order = assignment([seen[name].place for name in boats], [goal[:2] for goal in goals[first:]])
            self.places = {name: first + number for name, number in zip(boats, order, strict=True)}
        self.goals = {name: goals[number] for name, number in self.places.items()}
        x, y, heading = self.leader.pose
        self.off_shape = {}
        for name, number in self.places.items():
            bow, port = offsets[number][0] - ahead, offsets[number][1] - left
            self.off_shape[name] = seen[name].to(*beside((x, y), heading, bow, port))[0]

    def _steer(self, name: str, seen: Mapping[str, Estimate], t: float) -> dict[str, float]:
        """Commands that take one boat toward its slot."""
        own, goal, speed = seen[name], self.goals[name], self.leader.speed
        keeper, pilot = self._helms[name]
        others = [other for key, other in seen.items() if key != name]
        vx, vy = apart_velocity(own, pursuit(own, goal, speed, drift=self.leader.drift), others, self.apart)
        if abs(goal.pace(speed)) < _HOLD_SPEED and self.off[name] < _HOLD_DISTANCE and pilot.every_way:
            return pilot.sail(own, t, vx, vy, goal.direction)
        steady = max(0.0, _STEADY_SPEED - abs(goal.pace(speed)))
        east = vx + _SKID_LEAD * (vx - own.vx) + steady * math.cos(goal.direction)
        north = vy + _SKID_LEAD * (vy - own.vy) + steady * math.sin(goal.direction)
        heading = math.atan2(north, east)
        surge, _ = in_axes(own.heading, vx, vy)
        turn = clamp(goal.curvature * speed + _HEADING_RATE * wrap_angle(heading - own.heading), _MAX_YAW_RATE)
        return keeper(own, t, max(-_MAX_ASTERN_SPEED, min(keeper.top_speed, surge)), turn)


def _check_way(path: Sequence[Point], speed: float, radius: float) -> None:
    """Whether a virtual leader can go that way."""
    if all(math.dist(path[0], point) < _MIN_EXTENT for point in path):
        raise VrxError(f"path: its {len(path)} points are all at {tuple(path[0])}; at least two must differ")
    if not 0.0 < speed < math.inf:
        raise VrxError(f"invalid speed {speed:g} m/s: a number above 0 is needed")
    if not 0.0 <= radius < math.inf:
        raise VrxError(f"invalid radius {radius:g} m: a number of 0 or more is needed")


def _check_formation(shape: str, spacing: float, apart: float) -> None:
    """Check that there is such a shape and that boats in it are further than `apart` [m] from each other."""
    check_name("shape", shape, SHAPES)
    if not apart < spacing < math.inf:
        raise VrxError(f"invalid spacing {spacing:g} m: more than the {apart:g} m that boats keep apart is needed")
