"""Docking: read the lights, find the bay with the right symbol, drive in, stay, and back out."""

import math
from typing import TYPE_CHECKING

from vrx_mj.control.acoustics import Roam, in_a_row
from vrx_mj.control.guidance import wrap_angle
from vrx_mj.control.navigation import Estimate, Point, beside, from_axes
from vrx_mj.control.pilot import Commands, Moment, Skipper
from vrx_mj.control.placards import DockLookout, Face, Tower
from vrx_mj.control.velocity import clamp

if TYPE_CHECKING:
    from vrx_mj.runtime.task_runner import TaskObservation

BERTH = 4.9
"""How far before the placard to stay [m]: the middle of the zones of 2018, well inside of those of 2022 and 2023."""
LINE_UP = 15.0
"""How far before it to line up [m]: outside of the zone that is backed out through, which ends at 10.8."""
_CLEAR = 12.5
"""Further than this before it [m], and in line within 2 m, a boat may as well begin to go in."""
COMMIT = 9.0
"""Nearer than this [m] the boat goes on in; before, it waits until it is in line: the fingers end at 8.5."""
_IN_LINE = (0.35, 0.10)
"""How far off the bay's axis [m] and heading [rad] the boat may be to go in: the bay leaves 0.78 m to either side."""
SLOW = 0.8
"""Speed into and out of the bay [m/s]: it stops within half a metre."""
_AXIS_RATE = 0.7
"""How fast an error along the bay's axis or across it dies [1/s], as the pilot's rate for a position."""
_CRUISE = 2.6
"""Speed on the way [m/s]."""
STAY = 11.5
"""How long to stay [s]: 10 are asked for, from when the boat is inside."""
_KEEP_OFF = 7.0
"""How far to keep from either side of a placard on the way [m]: the bays are 6 m long."""
_OFF_BANK = 3.5
"""How far to keep from whatever the lidar sees [m]."""
_REACH = 16.0
"""Distance from which the boat steers clear of that [m]."""
_FACE_PATIENCE = 40.0
"""How long to try to read what may be a placard, once within `_NEAR` [s]."""
_NEAR = 40.0
"""[m]"""
_LAMP_RANGE = 32.0
"""Distance from which the lights are read [m]: there a lamp is 5 pixels wide."""
_TOWER_PATIENCE = 70.0
"""How long to try for a tower that may be the light buoy [s]."""
_TOWER_REACH = 180.0
"""Towers that were not seen lit are gone to up to this distance from the start [m]."""
_LIGHTS_UNTIL = 130.0
"""How long the lights are looked for [s since the task runs]; then the bay comes first, which may take as long."""
_TO_DOCK = 75.0
"""How long it takes to line up, go in, stay and back out, in waves and wind [s]."""
_MADE_GOOD = 1.5
"""Speed made good on the way to a bay [m/s]."""
_ASIDE = 1.3
"""Who is further than this from the axis [m] inside of `COMMIT` is not in the bay: out, and once more."""
_STUCK, _MOVED = 9.0, 1.5
"""Who wants to go somewhere and did not get that far [m] in so long [s] is aground, or caught."""
_BACK_OFF = 6.0
"""How long to go astern then [s]."""
_AGROUND = 4.0
"""How far ahead of the boat's origin what it is stuck on is taken to lie [m]."""
_LOOK_AROUND = 13.0
"""How long to look around at first [s], until a lit tower is seen: a whole turn."""
_TURNING = 0.45
"""How far ahead of the heading [rad] the wanted one is kept in looking around: the boat turns at 0.5 rad/s."""
_SHAPES = {"red": "circle", "green": "triangle", "blue": "cross", "yellow": "rectangle"}
"""Shape of the right placard by the third colour of the lights; the first one is its colour (the organisers' rule)."""


class Docking(Skipper):
    """Docks in the bay whose placard shows the right symbol; also scans the light buoy where the task asks for that.

    Perception (`DockLookout`): upright panels of 2 m are placards, whose symbols the camera ahead reads; narrow towers
    may be light buoys, which are watched from nearby until three colours were seen between two dark phases. The symbol
    comes from the task if it gives one, else from the lights. Guidance: line up on the bay's axis `LINE_UP` before the
    placard, enter slowly along it, stay, and back out, which earns the points. The zones of VRX's docks have the same
    place before every placard, so no map of the dock is needed; the boat keeps clear of all that the lidar sees, and
    of both sides of a placard. If nothing is known it explores ahead of its start (`Roam`). No balls are shot.
    """

    def begin(self) -> None:
        """Forget the dock and the lights, at the start of a run."""
        self.lookout = DockLookout()
        self._heading = math.nan
        self._roam: Roam | None = None
        self._colors: list[str] | None = None
        self._bay: Face | None = None
        self._stage, self._since = "find", 0.0
        self._stuck_on: list[Point] = []
        self._last_moved: tuple[Point, float] = (math.inf, math.inf), 0.0
        self._last_went = self._astern_until = -math.inf
        self._started = self._then = math.nan

    def steer(self, now: Moment) -> Commands:
        """Commands for the present phase: find, line up, enter, stay or back out."""
        _, seen, task, t = now
        if math.isnan(self._heading):
            self._heading = seen.heading
        self.lookout.look(now, near_only=self._stage in ("in", "stay", "out"))
        if task.get("state") != "running":
            return self._turn(now)
        if self._roam is None:
            self._started, self._roam = t, Roam(seen.place, self._heading, t)
        if self._stage == "find":
            return self._find(now)
        return self._dock(now)

    # Finding what there is

    def _find(self, now: Moment) -> Commands:
        """Read the lights, if the task asks for that, then find the bay."""
        assert self._roam is not None, "before the task runs"
        right, resort, running = self._right_bay(now.task), self._last_resort(now), now.t - self._started
        time_for_lights = running < _LIGHTS_UNTIL or (right is not None and resort is None)  # the bay can wait
        if now.task.get("color_sequence_open") and time_for_lights:
            tower = self._tower(now.seen)
            if running < _LOOK_AROUND and not (tower and tower.lit):
                return self._turn(now)
            if tower is not None:
                return self._scan(now, tower)
            return self._go(now, self._roam.next(now.seen, now.t)) if right else self._explore(now)
        self._bay = right or resort
        if self._bay is None:
            return self._explore(now)
        self._stage = "line up"
        return self._dock(now)

    def _last_resort(self, now: Moment) -> Face | None:
        """A bay, once there is just time enough to dock there: the right one, one of its colour, or the nearest."""
        wanted, seen = self._wanted_symbol(now.task) or "", now.seen

        def worth(face: Face) -> tuple[bool, bool, float]:
            other_color = face.symbol.partition("_")[0] != wanted.partition("_")[0]
            return face.symbol != wanted, other_color, seen.to(*face.place)[0]

        best = min((face for face in self.lookout.faces if face.symbol), key=worth, default=None)
        if best is None:
            return None
        needed = _TO_DOCK + seen.to(*best.ahead(LINE_UP))[0] / _MADE_GOOD
        return best if now.task.get("remaining_time", math.inf) < needed else None

    def _tower(self, seen: Estimate) -> Tower | None:
        """The tower that may be the light buoy: one that was seen lit, or else the nearest."""
        assert self._roam is not None, "before the task runs"
        may_be_course, towers = self._roam.may_be_course, self.lookout.towers
        places = [tower.place for tower in towers]
        known = [
            tower
            for tower in towers
            if tower.lit or (may_be_course(tower.place, _TOWER_REACH) and not in_a_row(tower.place, places))
        ]
        return min(known, key=lambda tower: (not tower.lit, tower.far(seen)), default=None)

    def _scan(self, now: Moment, tower: Tower) -> Commands:
        """Go where the lights can be read, and watch them."""
        seen, t = now.seen, now.t
        tower.since = min(tower.since, t)
        tower.dark = tower.dark or t - tower.since > _TOWER_PATIENCE
        distance, bearing = seen.to(*tower.place)
        if distance > _LAMP_RANGE:
            return self._go(now, tower.place)
        if abs(wrap_angle(bearing - seen.heading)) < 0.5:
            self._colors = self.lookout.watch(now, tower)
            if self._colors:
                self.messages["color_sequence"] = self._colors
        return self.stop(now, bearing)

    def _right_bay(self, task: "TaskObservation") -> Face | None:
        """The face that shows the symbol that is looked for."""
        wanted = self._wanted_symbol(task)
        return next((face for face in self.lookout.faces if face.symbol and face.symbol == wanted), None)

    def _wanted_symbol(self, task: "TaskObservation") -> str | None:
        """The symbol that is looked for, as far as the task or the lights show it."""
        if self._colors:
            lights = f"{self._colors[0]}_{_SHAPES[self._colors[2]]}"
            return str(task.get("symbol", lights))
        return task.get("symbol")

    def _explore(self, now: Moment) -> Commands:
        """Go where a placard can be read that was not yet; else where nobody was."""
        assert self._roam is not None, "before the task runs"
        seen, t = now.seen, now.t
        view = self._view(seen)
        if view is None:
            return self._go(now, self._roam.next(seen, t))
        face, place = view
        distance, _ = seen.to(*place)
        if distance < _NEAR and t - self._then < 1.0:
            face.tried += t - self._then
        self._then = t
        return self._go(now, place) if distance > 3.0 else self.stop(now, seen.to(*face.place)[1])

    def _view(self, seen: Estimate) -> tuple[Face, Point] | None:
        """What to look at next, and where from: an unread face, from before it, or the back of one that was read."""
        assert self._roam is not None, "before the task runs"
        known = [face for face in self.lookout.faces if self._roam.may_be_course(face.place, math.inf)]
        unread = [face for face in known if not face.symbol and face.looks < 5 and face.tried < _FACE_PATIENCE]
        views = [(face, face.ahead(LINE_UP + 2.0)) for face in unread]
        if not views:
            signs = [face for face in known if face.symbol and face.tried < 2 * _FACE_PATIENCE]
            views = [(face, face.ahead(-LINE_UP - 3.0)) for face in signs]
        return min(views, key=lambda view: seen.to(*view[1])[0], default=None)

    # The bay

    def _dock(self, now: Moment) -> Commands:
        """Line up, go in, stay, back out."""
        assert self._bay is not None, "before the bay is found"
        ahead, left = self._bay.offset(*now.seen.place)
        if self._stage == "line up":
            place = self._bay.ahead(LINE_UP)
            if now.seen.to(*place)[0] > 3.0 and not (ahead > _CLEAR and abs(left) < 2.0):
                return self._go(now, place)
            self._stage = "in"
        if self._stage == "in" and ahead < COMMIT and abs(left) > _ASIDE:
            self._stage = "out"
        if self._stage == "in" and abs(ahead - BERTH) < 0.5:
            self._stage, self._since = "stay", now.t
        if self._stage == "stay" and now.t - self._since > STAY:
            self._stage = "out"
        if self._stage == "out" and ahead > LINE_UP - 1.0:  # the points would have come on the way
            self._stage = "line up"
        return self._along(self._bay, now, LINE_UP if self._stage == "out" else BERTH)

    def _along(self, bay: Face, now: Moment, to: float) -> Commands:
        """Move along the bay's axis to a distance [m] before the placard, the bow toward it."""
        heading = wrap_angle(bay.facing + math.pi)
        ahead, left = bay.offset(*now.seen.place)
        wide = abs(left) > _IN_LINE[0] or abs(wrap_angle(heading - now.seen.heading)) > _IN_LINE[1]
        if to < ahead and ahead > COMMIT and wide:
            to = max(to, min(ahead, LINE_UP - 3.0))
        velocity = from_axes(bay.facing, clamp(_AXIS_RATE * (to - ahead), SLOW), clamp(-_AXIS_RATE * left, SLOW))
        return self.pilot.sail(now.seen, now.t, *velocity, heading)

    # How to go

    def _turn(self, now: Moment) -> Commands:
        """Look around, on the spot."""
        return self.stop(now, now.seen.heading + _TURNING)

    def _go(self, now: Moment, place: Point) -> Commands:
        """Commands toward a place, clear of placards and of all that the lidar sees."""
        seen = now.seen
        distance, bearing = seen.to(*place)
        sides = [face.ahead(side) for face in self.lookout.faces for side in (-3.5, 3.5)]
        discs = [(side, _KEEP_OFF) for side in sides if math.dist(side, place) > _KEEP_OFF]
        discs += [(bank, _OFF_BANK) for bank in [*self.lookout.banks, *self._stuck_on]]
        if self._is_stuck(seen, now.t):
            return self.sail(now, 1.0, seen.heading + math.pi, seen.heading)
        speed = min(_CRUISE, 0.3 + 0.35 * distance)
        return self.sail_clear(now, bearing, discs, reach=min(_REACH, distance), speed=speed, least=0.1)

    def _is_stuck(self, seen: Estimate, t: float) -> bool:
        """Whether to go astern: for a while, after the boat did not get on; what it is stuck on is kept off then."""
        here = seen.place
        if t - self._last_went > 1.0 or math.dist(here, self._last_moved[0]) > _MOVED:
            self._last_moved = here, t
        self._last_went = t
        if t - self._last_moved[1] > _STUCK:
            self._last_moved, self._astern_until = (here, t), t + _BACK_OFF
            self._stuck_on.append(beside(here, seen.heading, _AGROUND))
        return t < self._astern_until
