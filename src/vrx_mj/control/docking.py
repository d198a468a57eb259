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
"""Distance before the placard to stay at [m]: the middle of the zones of 2018, well inside those of 2022 and 2023."""
LINE_UP = 15.0
"""Distance before the placard to line up at [m]: outside the zone to back out through, which ends at 10.8."""
_ENTRY_DISTANCE = 12.5
"""Beyond this distance before the placard [m], a boat within 2 m of the axis may begin to enter."""
COMMIT = 9.0
"""Within this distance [m] the boat goes on in; before, it waits until it is in line: the fingers end at 8.5."""
_ENTRY_TOLERANCE = (0.35, 0.10)
"""Largest distance from the bay's axis [m] and error of heading [rad] to enter: the bay leaves 0.78 m on each side."""
BAY_SPEED = 0.8
"""Speed into and out of the bay [m/s]: the boat stops within half a metre."""
_AXIS_RATE = 0.7
"""Rate at which errors along and across the bay's axis decay [1/s]: the pilot's rate for a position."""
_CRUISING_SPEED = 2.6
"""Speed outside the bay [m/s]."""
STAY_TIME = 11.5
"""Time to stay in the bay [s]: the task asks for 10, from when the boat is inside."""
_FINGER_CLEARANCE = 7.0
"""Distance to keep from both sides of a placard outside the bay [m]: the bays are 6 m long."""
_OBSTACLE_CLEARANCE = 3.5
"""Distance to keep from everything that the lidar sees [m]."""
_AVOIDANCE_RANGE = 16.0
"""Distance from which the boat avoids obstacles [m]."""
_FACE_PATIENCE = 40.0
"""Longest time spent within `_READING_RANGE` on reading one placard [s]."""
_READING_RANGE = 40.0
"""Distance within which that time counts [m]."""
_LAMP_RANGE = 32.0
"""Distance from which the lights are read [m]: a lamp is 5 pixels wide there."""
_TOWER_PATIENCE = 70.0
"""Longest time spent on one tower that may be the light buoy [s]."""
_TOWER_RANGE = 180.0
"""Largest distance from the start at which an unlit tower is inspected [m]."""
_LIGHTS_TIME = 130.0
"""Time since the start of the task after which the bay comes before the lights [s]: docking may take as long."""
_DOCKING_TIME = 75.0
"""Time to line up, go in, stay and back out, in waves and wind [s]."""
_MEAN_SPEED = 1.5
"""Mean speed on the way to a bay [m/s]."""
_MAX_AXIS_OFFSET = 1.3
"""A boat within `COMMIT` that is further from the axis than this [m] missed the bay: it backs out and tries again."""
_STUCK_TIME, _STUCK_DISTANCE = 9.0, 1.5
"""A boat that did not get this far [m] in this time [s] is aground or caught."""
_ASTERN_TIME = 6.0
"""Time to go astern after that [s]."""
_OBSTRUCTION_DISTANCE = 4.0
"""Assumed distance ahead of the boat's origin of what it is stuck on [m]."""
_LOOK_AROUND_TIME = 13.0
"""Time to look around at the start, until a lit tower is seen [s]: a whole turn."""
_LOOK_AROUND_LEAD = 0.45
"""Angle [rad] by which the commanded heading leads while the boat looks around: it then turns at 0.5 rad/s."""
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
        self._colors: list[str] | None = None
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
        if math.isnan(self._started):
            self._started, self._roam = t, Roam(seen.place, self._heading, t)
        if self._stage == "find":
            return self._find(now)
        return self._dock(now)

    # Finding what there is

    def _find(self, now: Moment) -> Commands:
        """Read the lights, if the task asks for that, then find the bay."""
        right, resort, running = self._right_bay(now.task), self._last_resort(now), now.t - self._started
        time_for_lights = running < _LIGHTS_TIME or (right is not None and resort is None)  # the bay can wait
        if now.task.get("color_sequence_open") and time_for_lights:
            tower = self._tower(now.seen)
            if running < _LOOK_AROUND_TIME and not (tower and tower.is_lit):
                return self._turn(now)
            if tower is not None:
                return self._scan(now, tower)
            return self._go(now, self._roam.next(now.seen, now.t)) if right else self._explore(now)
        bay = right or resort
        if bay is None:
            return self._explore(now)
        self._bay, self._stage = bay, "line up"
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
        needed = _DOCKING_TIME + seen.to(*best.ahead(LINE_UP))[0] / _MEAN_SPEED
        return best if now.task.get("remaining_time", math.inf) < needed else None

    def _tower(self, seen: Estimate) -> Tower | None:
        """The tower that may be the light buoy: one that was seen lit, or else the nearest."""
        may_be_course, towers = self._roam.may_be_course, self.lookout.towers
        places = [tower.place for tower in towers]
        known = [
            tower
            for tower in towers
            if tower.is_lit or (may_be_course(tower.place, _TOWER_RANGE) and not in_a_row(tower.place, places))
        ]
        return min(known, key=lambda tower: (not tower.is_lit, tower.far(seen)), default=None)

    def _scan(self, now: Moment, tower: Tower) -> Commands:
        """Go where the lights can be read, and watch them."""
        seen, t = now.seen, now.t
        tower.since = min(tower.since, t)
        tower.rejected = tower.rejected or t - tower.since > _TOWER_PATIENCE
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
        seen, t = now.seen, now.t
        view = self._view(seen)
        if view is None:
            return self._go(now, self._roam.next(seen, t))
        face, place = view
        distance, _ = seen.to(*place)
        if distance < _READING_RANGE and t - self._then < 1.0:
            face.tried += t - self._then
        self._then = t
        return self._go(now, place) if distance > 3.0 else self.stop(now, seen.to(*face.place)[1])

    def _view(self, seen: Estimate) -> tuple[Face, Point] | None:
        """The next thing to look at, and the place for it: in front of an unread face, or behind one that was read."""
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
        ahead, left = self._bay.offset(*now.seen.place)
        if self._stage == "line up":
            place = self._bay.ahead(LINE_UP)
            if now.seen.to(*place)[0] > 3.0 and not (ahead > _ENTRY_DISTANCE and abs(left) < 2.0):
                return self._go(now, place)
            self._stage = "in"
        if self._stage == "in" and ahead < COMMIT and abs(left) > _MAX_AXIS_OFFSET:
            self._stage = "out"
        if self._stage == "in" and abs(ahead - BERTH) < 0.5:
            self._stage, self._since = "stay", now.t
        if self._stage == "stay" and now.t - self._since > STAY_TIME:
            self._stage = "out"
        if self._stage == "out" and ahead > LINE_UP - 1.0:  # the points would have come on the way
            self._stage = "line up"
        return self._along(self._bay, now, LINE_UP if self._stage == "out" else BERTH)

    def _along(self, bay: Face, now: Moment, to: float) -> Commands:
        """Move along the bay's axis to a distance [m] before the placard, the bow toward it."""
        heading = wrap_angle(bay.facing + math.pi)
        ahead, left = bay.offset(*now.seen.place)
        wide = abs(left) > _ENTRY_TOLERANCE[0] or abs(wrap_angle(heading - now.seen.heading)) > _ENTRY_TOLERANCE[1]
        if to < ahead and ahead > COMMIT and wide:
            to = max(to, min(ahead, LINE_UP - 3.0))
        velocity = from_axes(
            bay.facing, clamp(_AXIS_RATE * (to - ahead), BAY_SPEED), clamp(-_AXIS_RATE * left, BAY_SPEED)
        )
        return self.pilot.sail(now.seen, now.t, *velocity, heading)

    # How to go

    def _turn(self, now: Moment) -> Commands:
        """Look around, on the spot."""
        return self.stop(now, now.seen.heading + _LOOK_AROUND_LEAD)

    def _go(self, now: Moment, place: Point) -> Commands:
        """Commands toward a place, clear of placards and of all that the lidar sees."""
        seen = now.seen
        distance, bearing = seen.to(*place)
        sides = [face.ahead(side) for face in self.lookout.faces for side in (-3.5, 3.5)]
        discs = [(side, _FINGER_CLEARANCE) for side in sides if math.dist(side, place) > _FINGER_CLEARANCE]
        discs += [(bank, _OBSTACLE_CLEARANCE) for bank in [*self.lookout.banks, *self._stuck_on]]
        if self._is_stuck(seen, now.t):
            return self.sail(now, 1.0, seen.heading + math.pi, seen.heading)
        speed = min(_CRUISING_SPEED, 0.3 + 0.35 * distance)
        return self.sail_clear(now, bearing, discs, reach=min(_AVOIDANCE_RANGE, distance), speed=speed, least=0.1)

    def _is_stuck(self, seen: Estimate, t: float) -> bool:
        """Whether to go astern: for a while, after the boat did not get on; what it is stuck on is kept off then."""
        here = seen.place
        if t - self._last_went > 1.0 or math.dist(here, self._last_moved[0]) > _STUCK_DISTANCE:
            self._last_moved = here, t
        self._last_went = t
        if t - self._last_moved[1] > _STUCK_TIME:
            self._last_moved, self._astern_until = (here, t), t + _ASTERN_TIME
            self._stuck_on.append(beside(here, seen.heading, _OBSTRUCTION_DISTANCE))
        return t < self._astern_until
