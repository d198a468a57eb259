"""The lookout of a boat that docks: placards and light buoys by the lidar, symbols and lights by the camera ahead."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import EARLY
from vrx_mj.control.cameras import camera_ahead, cutout, mounting
from vrx_mj.control.clusters import Cluster, banks, leveled, standing_free
from vrx_mj.control.guidance import Point, wrapped
from vrx_mj.control.lights import OFF, lamp_color, sequence
from vrx_mj.control.navigation import Estimate, sensor_named
from vrx_mj.control.placards import Face, FaceMap, faces, symbol_in
from vrx_mj.runtime.timing import Pause

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["DockLookout", "Tower"]

PERIOD = 0.5
"""Between two looks of the lidar [s]."""
READING = 1.0
"""Between two pictures of placards [s]."""
BLINKING = 0.4
"""Between two pictures of the lights [s]: two or three in each colour's second."""
REACH = 120.0
"""How far the lidar's returns are taken [m]."""
LEGIBLE = (5.0, 45.0)
"""From where to where a symbol is read [m]: nearer it does not fit into the picture, further it is 15 pixels."""
PLAIN = 25.0
"""From where a symbol is read in any haze of VRX's [m]."""
OBLIQUE = 1.0
"""Largest angle [rad] off its axis from which a placard is read."""
FIELD = 0.6
"""Half the angle [rad] in which something is well inside the picture: VRX's camera sees 0.7 to either side."""
READ, LOOKS = 5, 12
"""So many symbols read are enough, and so many pictures without one."""
GLANCES = 7
"""So many pictures of a tower tell whether it is lit: its period is 5 s, of which it is dark for 2."""
PANEL = (1.1, 1.4)
"""Half the width and height [m] of what is looked at of a placard, about `PANEL_HEIGHT`."""
PANEL_HEIGHT = 1.9
"""[m]: symbols of 2022 are at 1.5, of 2018 at 2.35, with half a metre to either side."""
LAMP_HEIGHT = 1.3
"""Above the water [m], of the middle between the lamps, at 1.6, and the box below them, at 0.9: VRX's light buoy."""
LAMP = (0.35, 1.4)
"""Half the width and height of what is looked at there [m]: the whole buoy, 0.5 m up or down in waves."""
LAMP_SIGHT = 60.0
"""From how far a lit lamp is looked for in passing [m]."""
LAMP_PLAIN = 35.0
"""What shows no colours from within this distance [m] is no light buoy, in any haze of VRX's."""
LOW_TOWER, HIGH_TOWER = 1.15, 3.2
"""How high a light buoy rises [m]: VRX's 2.5, and a lidar may miss its top."""
TOWER = 2.6
"""How wide it is at most [m]: VRX's float is 1.6 m square."""
DOUBT = 20.0
"""What was seen so often counts as twice as far off as it is, see `Tower.far`."""
OFFSHORE = 4.0
"""How far from all that is wider it must be [m]."""
DARK_FOR, WATCHED = 7.0, 20.0
"""What stays dark for so long [s], or tells no three colours in so long, is no light buoy: its period is 5 s."""
BANK_CELL, BANK_MEMORY, BANK_REACH = 2.0, 20.0, 25.0
"""Places of banks are told apart by so much [m] and kept for so long [s]: a flat beach near by is under the lidar's
lowest ring; those further off than that [m] are left out."""


@dataclass
class Tower:
    """Something narrow and high that may be a light buoy."""

    place: Point
    """[m]"""
    seen: int = 1
    """How often the lidar saw it."""
    looks: int = 0
    """How often it was looked at in passing."""
    colors: set[str] = field(default_factory=set)
    """Those seen then."""
    since: float = math.inf
    """When it was first gone to [s]."""
    shows: list[tuple[float, str]] = field(default_factory=list)
    """What was seen when it was watched: time [s] and colour."""
    dark: bool = False
    """Whether it is given up, as no light buoy."""

    @property
    def lit(self) -> bool:
        """Whether it showed two colours: trees and stones, in the light of the evening, show one at most."""
        return len(self.colors) > 1

    def far(self, seen: Estimate) -> float:
        """How far off it is [m], more so if it was hardly seen: of a shore a lidar sees now this stone, now that."""
        return seen.to(*self.place)[0] * (1.0 + DOUBT / self.seen)


class DockLookout:
    """Keeps a map of placards and of towers, in the local frame of the boat's navigation."""

    def __init__(self) -> None:
        self._map, self._towers = FaceMap(), list[Tower]()
        self._banks: dict[tuple[int, int], float] = {}
        self._look_pause, self._picture_pause = Pause(EARLY), Pause(EARLY)

    @property
    def faces(self) -> list[Face]:
        """What may be placards: seen more than three times."""
        return [face for face in self._map.faces if face.seen > 3]

    @property
    def towers(self) -> list[Tower]:
        """What may be light buoys: seen more than three times, not given up, and no placard's edge."""
        known = [tower for tower in self._towers if tower.seen > 3 and not tower.dark]
        return [tower for tower in known if all(math.dist(tower.place, face.place) > 2.5 for face in self._map.faces)]

    @property
    def banks(self) -> list[Point]:
        """Where the lidar saw something near by of late [m]."""
        return [(BANK_CELL * column, BANK_CELL * row) for column, row in self._banks]

    def look(self, boat: "BoatObservation", seen: Estimate, t: float, *, near_only: bool = False) -> None:
        """Look, if it is time to; `near_only` is for who has found the bay and needs no more but where that is."""
        lidar = sensor_named(boat, "lidar")
        if lidar is None or not self._look_pause.is_over(t):
            return
        self._look_pause.begin(t, PERIOD)
        reading = boat.sensors[lidar]
        points = leveled(reading.data.points, mounting(reading), seen.rotation, reach=30.0 if near_only else REACH)
        self._map.see((seen.x, seen.y), faces(points))
        if near_only:
            return
        self._note_banks(points, seen, t)
        free, wide = standing_free(points, high=4.0, widest=TOWER, apart=OFFSHORE)
        for cluster in free:
            self._note_tower(cluster, seen)
        self._drop_towers(wide, seen)
        if self._picture_pause.is_over(t):
            self._read(boat, seen, t)

    def watch(self, boat: "BoatObservation", seen: Estimate, tower: Tower, t: float) -> list[str] | None:
        """Take one more look at a tower's lamps, if it is time to; the three colours once they are known."""
        shows, camera = tower.shows, camera_ahead(boat)
        if shows and t < shows[-1][0] + BLINKING - 1e-6:
            return None
        if camera is None:
            tower.dark = True
            return None
        window = cutout(boat.sensors[camera], seen, (*tower.place, LAMP_HEIGHT), LAMP)
        shows.append((t, lamp_color(window) if window is not None else OFF))
        tower.colors |= {shows[-1][1]} - {OFF}
        tower.dark = t - shows[0][0] > (WATCHED if tower.lit else DARK_FOR)
        return sequence(shows)

    # Inside

    def _note_tower(self, cluster: Cluster, seen: Estimate) -> None:
        if not LOW_TOWER < cluster.top < HIGH_TOWER:
            return
        place = (seen.x + cluster.x, seen.y + cluster.y)
        for tower in self._towers:
            if math.dist(tower.place, place) < 1.5:
                tower.place, tower.seen = place, tower.seen + 1
                return
        self._towers.append(Tower(place))

    def _note_banks(self, points: FloatArray, seen: Estimate, t: float) -> None:
        here = (seen.x, seen.y)
        for x, y in banks(points, here, cell=BANK_CELL):
            self._banks[round(x / BANK_CELL), round(y / BANK_CELL)] = t
        near = {
            cell for cell in self._banks if math.dist(here, (cell[0] * BANK_CELL, cell[1] * BANK_CELL)) < BANK_REACH
        }
        self._banks = {cell: when for cell, when in self._banks.items() if cell in near and t - when < BANK_MEMORY}

    def _drop_towers(self, wide: FloatArray, seen: Estimate) -> None:
        """Doubt the towers that turn out to stand on, or beside, something wide."""
        for tower in self._towers:
            east, north = tower.place[0] - seen.x, tower.place[1] - seen.y
            if len(wide) and float(np.hypot(wide[:, 0] - east, wide[:, 1] - north).min()) < OFFSHORE:
                tower.seen = max(1, tower.seen - 1)

    def _read(self, boat: "BoatObservation", seen: Estimate, t: float) -> None:
        """Read the symbols that can be read from here, and see which towers are lit."""
        signs = [face for face in self._map.faces if _legible(face, seen)]
        towers = [tower for tower in self.towers if not tower.lit and tower.looks < GLANCES and _in_view(tower, seen)]
        camera = camera_ahead(boat)
        if not (signs or towers) or camera is None:
            return
        self._picture_pause.begin(t, READING)
        reading = boat.sensors[camera]
        for face in signs:
            window = cutout(reading, seen, (face.x, face.y, PANEL_HEIGHT), PANEL)
            if window is not None:
                face.note(symbol_in(window), near=seen.to(*face.place)[0] < PLAIN)
        for tower in towers:
            window = cutout(reading, seen, (*tower.place, LAMP_HEIGHT), LAMP)
            if window is not None:
                tower.looks += seen.to(*tower.place)[0] < LAMP_PLAIN
                tower.colors |= {lamp_color(window)} - {OFF}
                tower.dark = tower.looks >= GLANCES and not tower.lit


def _legible(face: Face, seen: Estimate) -> bool:
    distance, bearing = seen.to(*face.place)
    if not LEGIBLE[0] < distance < LEGIBLE[1] or abs(wrapped(bearing - seen.heading)) > FIELD:
        return False
    unread = sum(face.votes.values()) < READ and face.looks < LOOKS
    return unread and abs(wrapped(bearing + math.pi - face.facing)) < OBLIQUE


def _in_view(tower: Tower, seen: Estimate) -> bool:
    distance, bearing = seen.to(*tower.place)
    return distance < LAMP_SIGHT and abs(wrapped(bearing - seen.heading)) < FIELD
