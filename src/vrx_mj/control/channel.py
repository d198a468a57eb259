"""Channels: buoyed gates crossed in their order, found with lidar and camera; and what the gymkhana adds to that."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from vrx_mj.control.acoustics import Roam, in_a_row
from vrx_mj.control.buoy_map import Buoy, Lookout
from vrx_mj.control.guidance import wrap_angle
from vrx_mj.control.navigation import Point, beside, direction_to, in_axes, nearest
from vrx_mj.control.pilot import Commands, Moment, Skipper

_MIN_GATE_WIDTH, _MAX_GATE_WIDTH = 5.0, 32.0
"""Least and largest width of a gate [m]: VRX's are 8 to 29 m wide."""
_TURN_COST = 8.0
"""Distance [m] that counts as much as one radian of turning in the choice of the next gate."""
_MAX_GATE_DISTANCE = 75.0
"""Largest distance from one gate to the next [m]: VRX's are 19 to 72."""

_CRUISING_SHARE = 0.9
"""Cruising speed as a share of the top speed: the rest is left for wind and turning."""
_MAX_SPEED = 3.0
"""Largest speed [m/s]: at two looks a second a buoy comes 1.5 m nearer between them."""
_BUOY_CLEARANCE = 2.7
"""Distance to keep from a buoy's middle [m]: 1.2 for half the beam, 0.35 for the buoy, 1.1 for waves and gusts."""
_BANK_CLEARANCE = 3.5
"""Distance to keep from a shore [m]."""
_AVOIDANCE_RANGE = 16.0
"""Distance from which the boat avoids a buoy [m]: time for a turn of 60 degrees at 2 m/s."""
_RUN_UP = 9.0
"""Distance before a gate at which the boat lines up with it [m]."""
_RUN_OUT = 7.0
"""Distance behind a gate of the point that the boat steers for [m]: the crossing counts for the boat's origin."""
_MAX_ENTRY_SLOPE = 1.2
"""Largest slope, to the gate's course, of the line to the point behind it; above, the boat lines up first."""
_GOAL_RADIUS = 4.0
"""Within this distance of the black box [m] the boat holds its position, whatever lies beside it."""
_MATCH_RADIUS = 4.0
"""A buoy, or a gate's middle, within this distance [m] of a known one is the same: buoys drift."""
_LOOK_AROUND_LEAD = 0.55
"""Angle [rad] by which the commanded heading leads while the boat looks around: it then turns at 0.6 rad/s."""
_ENTRY_TIME = 14.0
"""Time for which only a gate with a white buoy, the entry, is taken for the first [s]: a whole turn takes 11 s."""
_GATE_PATIENCE = 75.0
"""Longest time spent on one gate [s]: the longest way to one is 70 m, and around it 30 m."""
_DOUBT_TIME = 30.0
"""Time after a gate in which the boat inspects buoys that lie nearer than the next known gate [s]."""
_INSPECTION_RANGE = 70.0
"""Largest distance of a buoy of unknown kind that the boat goes to [m]."""
_INSPECTION_DISTANCE = 14.0
"""Distance at which the boat looks at it [m]: a buoy is 40 pixels high there."""
_LOOK_TIME = 12.0
"""Longest time spent on the inspection of one buoy [s]."""
_APPROACH_WEIGHT = 0.2
"""Weight in that time of the way to the buoy: something may block it."""
_PARTNER_TIME = 40.0
"""Longest time spent near a buoy on the search for its partner [s]."""
_MAX_LOOKS = 8
"""Pictures without a colour after which a buoy is not inspected again."""
_EXIT_COLORS = ("blue", "black")
"""Colours of the partner of the last gate's red buoy."""
_PARTNER_COLORS = ("green", "white", *_EXIT_COLORS)
"""Colours of the partners of red buoys."""


class Gate(NamedTuple):
    """A gate, by its buoys."""

    red: Point
    """Place of its red buoy [m]."""
    partner: Point
    """Place of the buoy to port [m]."""
    middle: Point
    """Place between them [m]."""
    course: float
    """Direction in which to cross it [rad], counter-clockwise from east."""
    width: float
    """Distance between its buoys [m]."""

    def offset(self, place: Point) -> tuple[float, float]:
        """How far a place is behind it and to port of its middle [m]."""
        return in_axes(self.course, place[0] - self.middle[0], place[1] - self.middle[1])


def gate_of(red: Point, partner: Point) -> Gate:
    """The gate between two buoys [m]: across the line from the partner to the red one, that one to starboard."""
    east, north = red[0] - partner[0], red[1] - partner[1]
    middle = ((red[0] + partner[0]) / 2.0, (red[1] + partner[1]) / 2.0)
    return Gate(red, partner, middle, math.atan2(east, -north), math.hypot(east, north))


def pair_buoys(reds: Sequence[Point], partners: Sequence[Point]) -> list[Gate]:
    """The gates of buoys that are each other's nearest of the other kind, and neither too near nor too far.

    Once those have found each other, the same is asked of who is left.
    """
    gates: list[Gate] = []
    left, free = list(reds), list(partners)
    while True:
        found = _mutual(left, free)
        if not found:
            return [gate for gate in gates if _MIN_GATE_WIDTH < gate.width < _MAX_GATE_WIDTH]
        gates += found
        left = [red for red in left if all(red != gate.red for gate in found)]
        free = [other for other in free if all(other != gate.partner for gate in found)]


def _mutual(reds: Sequence[Point], partners: Sequence[Point]) -> list[Gate]:
    """The gates of buoys that are each other's nearest."""
    gates = []
    for red in reds if partners else ():
        partner = min(partners, key=lambda other: math.dist(red, other))
        if min(reds, key=lambda other: math.dist(partner, other)) == red:
            gates.append(gate_of(red, partner))
    return gates


def next_gate(here: Point, course: float | None, gates: Iterable[Gate]) -> Gate | None:
    """The gate to take next from `here`, near and with little turning; `course` [rad] is that from `here`."""

    def effort(gate: Gate) -> float:
        bearing = direction_to(here, gate.middle)
        turns = abs(wrap_angle(gate.course - bearing))
        if course is not None:
            turns += abs(wrap_angle(bearing - course))
        return math.dist(here, gate.middle) + _TURN_COST * turns

    near = [gate for gate in gates if math.dist(here, gate.middle) < _MAX_GATE_DISTANCE]
    return min(near, key=effort, default=None)


def side_of(gate: Gate, place: Point) -> str:
    """Where a place is: `before` a gate or `after` it, within its width, or else nothing."""
    ahead, left = gate.offset(place)
    if abs(left) >= gate.width / 2.0:
        return ""
    return "after" if ahead >= 0.0 else "before"


def opening(gate: Gate, buoys: Iterable[Point], berth: float) -> tuple[Point, float]:
    """Where to go through a gate [m], and how much room there is to either side [m].

    It is the gate's middle, or that of its widest part where a buoy lies in between. `berth` [m] is the distance to
    keep from buoys; what lies further before or behind the gate can be steered around.
    """
    marks = [-gate.width / 2.0, gate.width / 2.0]  # along the gate, to port positive
    for ahead, left in map(gate.offset, buoys):
        if abs(ahead) < 2.0 * berth and abs(left) < gate.width / 2.0 - 1.0:
            marks.append(left)
    room = min(abs(mark) for mark in marks)
    if room >= min(berth + 0.5, gate.width / 2.0):
        return gate.middle, room
    low, high = max(pairwise(sorted(marks)), key=lambda pair: pair[1] - pair[0])
    return beside(gate.middle, gate.course, 0.0, (low + high) / 2.0), (high - low) / 2.0


def wall(gate: Gate, *, spacing: float = 2.0) -> list[Point]:
    """Places [m] along a gate, buoys included, for who is not to go through."""
    count = max(2, math.ceil(gate.width / spacing) + 1)
    shares = [step / (count - 1) for step in range(count)]
    (x, y), (to_x, to_y) = gate.red, gate.partner
    return [(x + share * (to_x - x), y + share * (to_y - y)) for share in shares]


class Channel(Skipper):
    """Crosses the gates of a channel, red to starboard, and keeps clear of all buoys.

    Perception (`Lookout`): twice a second the lidar locates buoys, and the camera ahead identifies new ones. Two buoys
    that are each other's nearest, one of them red, are a gate (`pair_buoys`). The first gate is the one with a white
    buoy, the next is the one with the least distance and turning. Guidance: to a point `_RUN_UP` before the gate's
    opening and straight on, on the nearest clear course (`clear_course`). Later gates count as walls. If a
    thing of unknown kind, or a red buoy without a partner, is nearer than the next gate, the boat inspects it first;
    if nothing is known it searches ahead (`Roam`).

    `chart` gives the buoys instead, as red and partner by gate, in the frame of the world's map, x and y [m], or as
    {latitude, longitude} [degrees]; obstacles still come from the lidar.
    """

    def __init__(self, chart: Sequence[tuple[Mapping[str, object], Mapping[str, object]]] | None = None) -> None:
        self._chart = chart
        super().__init__()

    def begin(self) -> None:
        """Forget the buoys and the gates, at the start of a run."""
        self.lookout = Lookout(period=0.5)
        self._done: list[Gate] = []
        self._gate: Gate | None = None
        self._sides: list[tuple[Point, str]] = []
        self._since = math.nan
        self._then = 0.0
        self._aim: tuple[Point, float] = (math.inf, math.inf), 0.0
        self._searched: tuple[int, Roam] | None = None

    def steer(self, now: Moment) -> Commands:
        """Commands that cross the next gate, or search for it."""
        _, seen, task, t = now
        if math.isnan(self._since):
            self._start, self._since = (seen.place, seen.heading), t
        if self.lookout.look(now) or self._gate is None:
            self._gate = self._choose(t)
        if task.get("state") != "running":
            return self._look_around(now)
        self._note(now)
        if self._gate is None:
            return self._search(now)
        gate = self._gate
        if math.dist(gate.middle, self._aim[0]) > _MATCH_RADIUS:
            self._aim = gate.middle, t
        elif t - self._aim[1] > _GATE_PATIENCE:
            self._done.append(gate)
            self._gate, self._since, self._aim = self._choose(t), t, (gate.middle, t)
        return self._cross(gate, now)

    # Which gate

    def _choose(self, t: float) -> Gate | None:
        """The gate that is next, of those known now."""
        gates = self._known_gates()
        if self._done:
            last = self._done[-1]
            gate = next_gate(last.middle, last.course, gates)
            return None if gate is not None and self._doubtful(gate, last, t) else gate
        if self._chart is None and t - self._since < _ENTRY_TIME:
            white = [buoy.place for buoy in self.lookout.map.of("white")]
            gates = [gate for gate in gates if gate.partner in white]
        return next_gate(self._start[0], None, gates)

    def _doubtful(self, gate: Gate, last: Gate, t: float) -> bool:
        """Whether something unknown lies nearer to the last gate than the next one does: that may be another."""
        if self._chart is not None or t - self._since > _DOUBT_TIME:
            return False
        nearer = math.dist(last.middle, gate.middle) - 4.0
        return bool(self._strange(last.middle, nearer) or self._half(last.middle, nearer))

    def _half(self, here: Point, within: float = _INSPECTION_RANGE) -> Buoy | None:
        """The nearest buoy, `within` a distance [m], that needs a partner: a red one, or the white one of the entry."""
        paired_up = {place for gate in self._known_gates() for place in (gate.red, gate.partner)}
        halves = self.lookout.map.of("red", *(() if self._done else ("white",)))
        halves = [buoy for buoy in halves if self._new(buoy.place) and buoy.place not in paired_up]
        return nearest((b for b in halves if b.tried < _PARTNER_TIME and math.dist(b.place, here) < within), here)

    def _known_gates(self) -> list[Gate]:
        """The gates that are not crossed yet, as far as they are known."""
        if self._chart is not None:
            places = self.navigator.place
            return [gate_of(places(red), places(other)) for red, other in self._chart[len(self._done) :][:1]]
        kinds = ("red",), _PARTNER_COLORS
        return pair_buoys(*([b.place for b in self.lookout.map.of(*kind) if self._new(b.place)] for kind in kinds))

    def _new(self, place: Point) -> bool:
        """Whether a buoy is of no gate that was crossed."""
        return all(math.dist(place, old) > _MATCH_RADIUS for gate in self._done for old in (gate.red, gate.partner))

    # How to go

    def _cross(self, gate: Gate, now: Moment) -> Commands:
        """Line up with a gate and go through."""
        buoys = [buoy.place for buoy in self.lookout.map.buoys]
        middle, room = opening(gate, buoys, _BUOY_CLEARANCE)
        along, across = gate._replace(middle=middle).offset(now.seen.place)
        slope = abs(across) / (_RUN_OUT - along) if along < -0.5 else math.inf
        lined_up = slope < _MAX_ENTRY_SLOPE and slope * _RUN_OUT < max(0.5, room - _BUOY_CLEARANCE)
        ahead = _RUN_OUT if lined_up else -_RUN_UP
        walls = [point for other in self._known_gates() if other != gate for point in wall(other)]
        if along > -1.5 and not lined_up:
            walls += wall(gate)
        return self.go(now, beside(middle, gate.course, ahead), walls)

    def _note(self, now: Moment) -> None:
        """See whether a gate was crossed, whichever; they are known again by their middles, as buoys drift."""
        sides = []
        for gate in self._known_gates():
            before = next((side for middle, side in self._sides if math.dist(middle, gate.middle) < _MATCH_RADIUS), "")
            side = side_of(gate, now.seen.place)
            if before == "before" and side == "after":
                self._done.append(gate)
                self._gate, self._since = self._choose(now.t), now.t
            else:
                sides.append((gate.middle, side))
        self._sides = sides

    def go(self, now: Moment, place: Point, walls: Sequence[Point] = (), *, share: float = 1.0) -> Commands:
        """Commands toward a place [m], clear of buoys and walls, at a share of the cruising speed."""
        distance, bearing = now.seen.to(*place)
        buoys = [buoy.place for buoy in self.lookout.map.buoys if math.dist(buoy.place, place) > 1.0]
        discs = [(point, _BUOY_CLEARANCE) for point in (*buoys, *walls)]
        discs += [(bank, _BANK_CLEARANCE) for bank in self.lookout.banks]
        reach = min(_AVOIDANCE_RANGE, distance + _BUOY_CLEARANCE)
        speed = share * min(_CRUISING_SHARE * self.pilot.top_speed, _MAX_SPEED)
        return self.sail_clear(now, bearing, discs, reach=reach, speed=speed, least=0.12)

    # Where nothing is known

    def _search(self, now: Moment) -> Commands:
        """Go to see what is not known yet, first about a buoy without a partner; else where nobody was."""
        seen, t = now.seen, now.t
        half = self._half(seen.place)
        strange = self._strange(half.place, _MAX_GATE_WIDTH) if half else self._strange(seen.place)
        buoy, walls = strange or half, [point for gate in self._known_gates() for point in wall(gate)]
        if buoy is None:
            return self.go(now, self._roam(t).next(seen, t), walls, share=0.7)
        distance, bearing = seen.to(*buoy.place)
        buoy.tried += min(1.0, t - self._then) * (1.0 if distance < _INSPECTION_DISTANCE else _APPROACH_WEIGHT)
        self._then = t
        if distance > _INSPECTION_DISTANCE:
            return self.go(now, buoy.place, walls, share=0.7)
        return self.stop(now, bearing) if strange else self._look_around(now)

    def _roam(self, t: float) -> Roam:
        """The search that began at the last gate, or at the start."""
        if self._searched is None or self._searched[0] != len(self._done):
            place, course = (self._done[-1].middle, self._done[-1].course) if self._done else self._start
            self._searched = len(self._done), Roam(place, course, t)
        return self._searched[1]

    def _strange(self, here: Point, within: float = _INSPECTION_RANGE) -> Buoy | None:
        """The nearest buoy of unknown kind, `within` a distance [m], that is not given up and may be of the course."""
        unknown = [buoy for buoy in self.lookout.map.sure if not buoy.kind]
        known = (buoy for buoy in unknown if buoy.looks < _MAX_LOOKS and buoy.tried < _LOOK_TIME and buoy.seen > 3)
        known = (buoy for buoy in known if self._new(buoy.place))
        if not self._done:  # no gate shows yet where the course is
            known = (buoy for buoy in known if Roam(*self._start, 0.0).may_be_course(buoy.place, 150.0))
        unsure = [buoy.place for buoy in unknown]
        near = (buoy for buoy in known if math.dist(buoy.place, here) < within and not in_a_row(buoy.place, unsure))
        return nearest(near, here)

    def _look_around(self, now: Moment) -> Commands:
        """Turn on the spot."""
        return self.stop(now, now.seen.heading + _LOOK_AROUND_LEAD)


class Gymkhana(Channel):
    """Crosses the channel, then goes through the obstacles to the black box, whose position the task gives."""

    def steer(self, now: Moment) -> Commands:
        """Commands that cross the gates until the channel is finished, then go to the goal and hold it."""
        _, seen, task, t = now
        if task.get("channel", {}).get("state") != "finished" or "goal" not in task:
            return super().steer(now)
        place = self.navigator.place(task["goal"])
        distance, _ = seen.to(*place)
        if distance < _GOAL_RADIUS:
            return self.pilot.hold(seen, t, *place, seen.heading)
        self.lookout.look(now, colors=False)
        return self.go(now, place)
