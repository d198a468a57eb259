"""Docking: read the lights, find the bay with the right symbol, drive in, stay, and back out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from vrx_mj.control.avoidance import clear_course
from vrx_mj.control.clusters import Cluster, leveled, standing_free
from vrx_mj.control.guidance import Point, wrapped
from vrx_mj.control.lights import OFF, lamp_color, sequence
from vrx_mj.control.navigation import Estimate, sensor_named
from vrx_mj.control.pictures import project
from vrx_mj.control.placards import Face, FaceMap, faces, symbol_in
from vrx_mj.control.search import Roam
from vrx_mj.control.skipper import Commands, Skipper

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["Docking"]

FloatArray = npt.NDArray[np.float64]
PERIOD = 0.5
"""Between two looks of the lidar [s]."""
READING = 1.0
"""Between two pictures of placards [s]."""
BLINKING = 0.4
"""Between two pictures of the lights [s]: two or three in each colour's second."""
REACH = 120.0
"""How far the lidar's returns are taken [m]."""
BERTH = 4.9
"""How far before the placard to stay [m]: the middle of the zones of 2018, well inside of those of 2022 and 2023."""
LINE_UP = 15.0
"""How far before it to line up [m]: outside of the zone that is backed out through, which ends at 10.8."""
CLEAR = 12.5
"""How far before it the boat has backed out [m]."""
COMMIT = 9.0
"""Nearer than this [m] the boat goes on in; before, it waits until it is in line: the fingers end at 8.5."""
IN_LINE = (0.35, 0.10)
"""How far off the bay's axis [m] and its heading [rad] the boat may be to go in: the bay leaves 0.78 m to either side."""
SLOW = 0.8
"""Speed into and out of the bay [m/s]: it stops within half a metre."""
CRUISE = 2.0
"""Speed on the way [m/s]."""
STAY = 11.5
"""How long to stay [s]: 10 are asked for, from when the boat is inside."""
LEGIBLE = (5.0, 45.0)
"""From where to where a symbol is read [m]: nearer it does not fit into the picture, further it is 15 pixels."""
KEEP_OFF = 7.0
"""How far to keep from the middle of a dock's bay on the way [m]."""
OFF_BANK = 3.5
"""How far to keep from whatever the lidar sees [m]."""
FACE_PATIENCE = 40.0
"""How long to try to read what may be a placard, once near [s]."""
LAMP_HEIGHT = 1.65
"""Of the lamps above the water [m], VRX's light buoy: 1.3 m and its float's 0.37."""
LAMP = (0.25, 0.4)
"""Half the width and height of what is looked at there [m]: a lamp of 0.19 x 0.39 m, and waves; no placard behind it."""
LAMP_RANGE = 32.0
"""From where the lights are read [m]: there a lamp is 5 pixels wide."""
LOW_TOWER, HIGH_TOWER = 1.15, 3.2
"""How high a light buoy rises [m]: VRX's 2.5, and a lidar may miss its top."""
TOWER_PATIENCE = 50.0
"""How long to try for one of them [s]."""
LIGHTS_UNTIL = 150.0
"""How long the lights are looked for [s since the task runs]; then the bay comes first."""
SHAPES = {"red": "circle", "green": "triangle", "blue": "cross", "yellow": "rectangle"}
"""Shape of the right placard by the third colour of the lights; the first one is its colour (the organisers' rule)."""


@dataclass
class Tower:
    """Something narrow and high that may be a light buoy."""

    place: Point
    """[m]"""
    seen: int = 1
    """How often the lidar saw it."""
    looks: int = 0
    """How often it was looked at in passing."""
    lit: bool = False
    """Whether it had a colour then."""
    since: float = math.inf
    """When it was first gone to [s]."""
    shows: list[tuple[float, str]] = field(default_factory=list)
    """What was seen when it was watched: time [s] and colour."""
    dark: bool = False
    """Whether it is given up, as no light buoy."""


class Docking(Skipper):
    """Docks in the bay whose placard shows the right symbol; also scans the light buoy where the task asks for that.

    Perception: upright panels of 2 m from the lidar are placards (`placards.faces`), their symbols are read by the camera
    ahead; narrow towers may be light buoys, and are watched from near until three colours were seen between two darks.
    The symbol comes from the task, where it tells, else from the lights. Guidance: line up on the bay's axis `LINE_UP`
    before the placard, go in slowly along it, stay, and back out, where the points come. The zones of VRX's docks lie
    alike before their placards, so nothing else of the dock need be known; it is kept off with discs before its placards.
    """

    def begin(self) -> None:
        """Forget the dock and the lights."""
        self._faces, self._towers = FaceMap(), list[Tower]()
        self._next_look = self._next_picture = -math.inf
        self._started: float | None = None
        self._colors: list[str] | None = None
        self._bay: Face | None = None
        self._stage, self._since, self._then = "find", 0.0, 0.0
        self._course: float | None = None
        self._heading, self._roam = math.nan, None
        self._banks: list[Point] = []

    def status(self):
        return self._stage, self._colors, [(round(f.x),round(f.y),f.symbol,f.seen,f.looks) for f in self._faces.faces if f.seen>2], [(round(x.place[0]),round(x.place[1]),x.lit,x.dark,"".join(c[0] for _,c in x.shows)) for x in self._towers if x.seen>3][:9]

    def steer(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> Commands:
        """Look, and do what is next."""
        if math.isnan(self._heading):
            self._heading = seen.heading
        self._look(boat, seen, t)
        if task.get("state") != "running":
            return self._turn(seen, t)
        if self._started is None:
            self._started, self._roam = t, Roam((seen.x, seen.y), self._heading, t)
        if task.get("color_sequence_open") and self._stage == "find" and t - self._started < LIGHTS_UNTIL:
            commands = self._scan(boat, seen, t)
            if commands is not None:
                return commands
        return self._dock(seen, task, t)

    @property
    def _search(self) -> Roam:
        assert self._roam is not None, "before the task runs"
        return self._roam

    # Looking

    def _look(self, boat: "BoatObservation", seen: Estimate, t: float) -> None:
        """Find panels and towers, and read symbols."""
        lidar = sensor_named(boat, "lidar")
        if lidar is None or t < self._next_look - 1e-6:
            return
        self._next_look = t + PERIOD
        reading = boat.sensors[lidar]
        points = leveled(reading.data.points, _mount(reading), seen.rotation, reach=REACH)
        self._faces.see((seen.x, seen.y), faces(points))
        self._banks = banks(points, (seen.x, seen.y))
        if self._stage == "find":
            for cluster in standing_free(points, high=4.0, widest=2.6, apart=4.0):
                self._note_tower(cluster, seen)
        if t >= self._next_picture - 1e-6 and self._stage in ("find", "line up"):
            self._read(boat, seen, t)

    def _note_tower(self, cluster: Cluster, seen: Estimate) -> None:
        if not LOW_TOWER < cluster.top < HIGH_TOWER:
            return
        place = (seen.x + cluster.x, seen.y + cluster.y)
        for tower in self._towers:
            if math.dist(tower.place, place) < 1.5:
                tower.place, tower.seen = place, tower.seen + 1
                return
        self._towers.append(Tower(place))

    def _read(self, boat: "BoatObservation", seen: Estimate, t: float) -> None:
        """Read the symbols that can be read from here."""
        wanted = [face for face in self._faces.faces if self._legible(face, seen)]
        towers = [tower for tower in self._towers if not tower.lit and self._in_view(tower, seen)]
        camera = sensor_named(boat, "front_left") or sensor_named(boat, "camera")
        if not (wanted or towers) or camera is None:
            return
        self._next_picture = t + READING
        reading = boat.sensors[camera]
        for face in wanted:
            window = _window(reading, seen, (face.x, face.y, 1.9), (1.1, 1.4))
            if window is not None:
                face.looks += 1
                symbol = symbol_in(window)
                if symbol:
                    face.votes[symbol] += 1
        for tower in towers:
            window = _window(reading, seen, (*tower.place, LAMP_HEIGHT), LAMP)
            tower.looks += 1
            tower.lit = window is not None and lamp_color(window) != OFF

    @staticmethod
    def _in_view(tower: "Tower", seen: Estimate) -> bool:
        distance, bearing = seen.to(*tower.place)
        return tower.seen > 2 and tower.looks < 8 and distance < 50.0 and abs(wrapped(bearing - seen.heading)) < 0.6

    def _legible(self, face: Face, seen: Estimate) -> bool:
        distance, bearing = seen.to(*face.place)
        oblique = abs(wrapped(bearing + math.pi - face.facing))
        ahead = abs(wrapped(bearing - seen.heading))
        near, far = LEGIBLE
        return near < distance < far and oblique < 1.0 and ahead < 0.6 and sum(face.votes.values()) < 5 and face.looks < 12

    # The lights

    def _scan(self, boat: "BoatObservation", seen: Estimate, t: float) -> Commands | None:
        """Watch the light buoy; None where there is none to be watched now."""
        tower = self._tower(seen)
        if tower is None:
            return None
        tower.since = min(tower.since, t)
        if t - tower.since > TOWER_PATIENCE:
            tower.dark = True
        distance, bearing = seen.to(*tower.place)
        if distance > LAMP_RANGE:
            return self._go(seen, t, tower.place)
        if abs(wrapped(bearing - seen.heading)) < 0.5:
            self._watch(boat, seen, tower, t)
        return self.pilot.sail(seen, t, 0.0, 0.0, bearing)

    def _tower(self, seen: Estimate) -> "Tower | None":
        """The tower that may be the light buoy: one that was seen lit, or else the nearest."""
        known = [tower for tower in self._towers if tower.seen > 3 and not tower.dark]
        panels = [face.place for face in self._faces.faces]
        known = [tower for tower in known if all(math.dist(tower.place, panel) > 2.5 for panel in panels)]
        known = [tower for tower in known if tower.lit or self._search.likely(tower.place, 60.0)]
        return min(known, key=lambda tower: (not tower.lit, seen.to(*tower.place)[0]), default=None)

    def _watch(self, boat: "BoatObservation", seen: Estimate, tower: "Tower", t: float) -> None:
        """Take one more look at the lamps; who stays dark for 7 s is no light buoy."""
        shows = tower.shows
        if shows and t < shows[-1][0] + BLINKING - 1e-6:
            return
        camera = sensor_named(boat, "front_left") or sensor_named(boat, "camera")
        if camera is None:
            tower.dark = True
            return
        window = _window(boat.sensors[camera], seen, (*tower.place, LAMP_HEIGHT), LAMP)
        shows.append((t, lamp_color(window) if window is not None else OFF))
        self._colors = sequence(shows)
        if self._colors:
            self.messages["color_sequence"] = self._colors
        lit = sum(color != OFF for _, color in shows)
        if t - shows[0][0] > (7.0 if lit < 4 else 20.0):
            tower.dark = True

    # The bay

    def _dock(self, seen: Estimate, task: Mapping[str, Any], t: float) -> Commands:
        """Line up, go in, stay, back out."""
        if self._stage == "find":
            self._bay = self._right_bay(task)
            if self._bay is None:
                return self._explore(seen, t)
            self._stage = "line up"
        assert self._bay is not None
        ahead, left = self._bay.offset(seen.x, seen.y)
        heading = wrapped(self._bay.facing + math.pi)
        if self._stage == "line up":
            place = self._bay.ahead(LINE_UP)
            if seen.to(*place)[0] > 3.0 and not (ahead > CLEAR and abs(left) < 2.0):
                return self._go(seen, t, place)
            self._stage = "in"
        if self._stage == "in":
            if abs(ahead - BERTH) < 0.5:
                self._stage, self._since = "stay", t
            return self._along(seen, t, BERTH, heading)
        if self._stage == "stay":
            if t - self._since > STAY:
                self._stage = "out"
            return self._along(seen, t, BERTH, heading)
        return self._along(seen, t, LINE_UP, heading)

    def _right_bay(self, task: Mapping[str, Any]) -> Face | None:
        """The face that shows the symbol that is looked for."""
        wanted = task.get("symbol")
        if wanted is None and self._colors:
            wanted = f"{self._colors[0]}_{SHAPES[self._colors[2]]}"
        return next((face for face in self._faces.faces if face.symbol and face.symbol == wanted), None)

    def _along(self, seen: Estimate, t: float, to: float, heading: float) -> Commands:
        """Move along the bay's axis to a distance [m] before the placard, the bow toward it."""
        assert self._bay is not None
        ahead, left = self._bay.offset(seen.x, seen.y)
        off, turned = IN_LINE
        wide = abs(left) > off or abs(wrapped(heading - seen.heading)) > turned
        if to < ahead and ahead > COMMIT and wide:
            to = max(to, min(ahead, LINE_UP - 3.0))
        out = max(-SLOW, min(SLOW, 0.7 * (to - ahead)))
        side = max(-SLOW, min(SLOW, -0.7 * left))
        cos, sin = math.cos(self._bay.facing), math.sin(self._bay.facing)
        return self.pilot.sail(seen, t, out * cos - side * sin, out * sin + side * cos, heading)

    def _explore(self, seen: Estimate, t: float) -> Commands:
        """Go where a placard can be read that was not yet; else where nobody was."""
        known = [face for face in self._faces.faces if face.seen > 3 and self._search.likely(face.place, 250.0)]
        views = [(face, face.ahead(LINE_UP + 2.0)) for face in known if face.looks < 5 and face.tried < FACE_PATIENCE]
        if not views:
            signs = [face for face in known if face.symbol]
            views = [(face, face.ahead(-LINE_UP - 3.0)) for face in signs if face.tried < 2 * FACE_PATIENCE]
        if not views:
            return self._go(seen, t, self._search.next(seen, t))
        face, place = min(views, key=lambda view: seen.to(*view[1])[0])
        if seen.to(*place)[0] < 40.0:
            face.tried += t - self._then
        self._then = t
        if seen.to(*place)[0] > 3.0:
            return self._go(seen, t, place)
        return self.pilot.sail(seen, t, 0.0, 0.0, seen.to(*face.place)[1])

    # How to go

    def _go(self, seen: Estimate, t: float, place: Point) -> Commands:
        """Commands toward a place, clear of the dock and of towers."""
        distance, bearing = seen.to(*place)
        discs = [(face.ahead(side * 3.5), KEEP_OFF) for face in self._faces.faces if face.seen > 2 for side in (-1, 1)]
        discs = [disc for disc in discs if math.dist(disc[0], place) > KEEP_OFF] + [(bank, OFF_BANK) for bank in self._banks]
        course = clear_course((seen.x, seen.y), bearing, discs, reach=min(16.0, distance), before=self._course)
        self._course = course
        speed = min(CRUISE, 0.3 + 0.35 * distance) * max(0.1, math.cos(wrapped(course - seen.heading)) ** 3)
        return self.pilot.sail(seen, t, speed * math.cos(course), speed * math.sin(course), course)

    def _turn(self, seen: Estimate, t: float) -> Commands:
        """Look around, on the spot."""
        return self.pilot.sail(seen, t, 0.0, 0.0, seen.heading + 0.45)


def banks(points: FloatArray, here: Point, *, reach: float = 20.0, cell: float = 2.0) -> list[Point]:
    """Where something stands out of the water near by [m], one place in each cell that has returns, (n, 3) from `here`."""
    near = points[(np.hypot(points[:, 0], points[:, 1]) < reach) & (points[:, 2] > -0.3)]
    cells = np.unique(np.floor(near[:, :2] / cell), axis=0)
    return [(here[0] + float(x), here[1] + float(y)) for x, y in (cells + 0.5) * cell]


def _mount(reading: Any) -> tuple[FloatArray, FloatArray]:
    return np.asarray(reading.mount.position), np.asarray(reading.mount.rotation)


def _window(
    reading: Any, seen: Estimate, place: tuple[float, float, float], half: tuple[float, float]
) -> npt.NDArray[np.uint8] | None:
    """What of a picture shows a place [m; the height above the boat's origin], half a width and height [m] to each side.

    None if it is not in the picture as a whole.
    """
    picture, matrix = reading.data.rgb, np.asarray(reading.data.info.K, np.float64).reshape(3, 3)
    point = np.array([place[0] - seen.x, place[1] - seen.y, place[2]])
    where = project(point, _mount(reading), seen.rotation, matrix)
    if where is None:
        return None
    column, row, ahead = where
    scale = float(matrix[0, 0]) / ahead
    left, right = round(column - half[0] * scale), round(column + half[0] * scale) + 1
    top, bottom = round(row - half[1] * scale), round(row + half[1] * scale) + 1
    if left < 0 or top < 0 or right > picture.shape[1] or bottom > picture.shape[0]:
        return None
    window: npt.NDArray[np.uint8] = picture[top:bottom, left:right]
    return window
