"""The lookout of a boat that docks: placards and light buoys by the lidar, symbols and lights by the camera ahead."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from vrx_mj.control.cameras import camera_ahead, cutout, mounting
from vrx_mj.control.clusters import Cluster, banks, leveled, standing_free
from vrx_mj.control.guidance import Point, wrapped
from vrx_mj.control.lights import OFF, lamp_color, sequence
from vrx_mj.control.navigation import Estimate, sensor_named
from vrx_mj.control.placards import Face, FaceMap, faces, symbol_in

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["DockLookout", "Tower"]

FloatArray = npt.NDArray[np.float64]
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
PANEL = (1.1, 1.4)
"""Half the width and height [m] of what is looked at of a placard, about `PANEL_HEIGHT`."""
PANEL_HEIGHT = 1.9
"""[m]: symbols of 2022 are at 1.5, of 2018 at 2.35, with half a metre to either side."""
LAMP_HEIGHT = 1.65
"""Of the lamps above the water [m], VRX's light buoy: 1.3 m and its float's 0.37."""
LAMP = (0.25, 0.4)
"""Half the width and height of what is looked at there [m]: a lamp of 0.19 x 0.39 m, and waves; nothing behind it."""
LAMP_SIGHT = 60.0
"""From how far a lit lamp is looked for in passing [m]."""
LOW_TOWER, HIGH_TOWER = 1.15, 3.2
"""How high a light buoy rises [m]: VRX's 2.5, and a lidar may miss its top."""
TOWER = 2.6
"""How wide it is at most [m]: VRX's float is 1.6 m square."""
OFFSHORE = 4.0
"""How far from all that is wider it must be [m]."""
DARK_FOR, WATCHED = 7.0, 20.0
"""What stays dark for so long [s], or tells no three colours in so long, is no light buoy: its period is 5 s."""


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


class DockLookout:
    """Keeps a map of placards and of towers, in the local frame of the boat's navigation."""

    def __init__(self) -> None:
        self._map, self._towers = FaceMap(), list[Tower]()
        self.banks: list[Point] = []
        """Where the lidar sees something near by [m], see `banks`."""
        self._next_look = self._next_picture = -math.inf

    @property
    def faces(self) -> list[Face]:
        """What may be placards: seen more than three times."""
        return [face for face in self._map.faces if face.seen > 3]

    @property
    def towers(self) -> list[Tower]:
        """What may be light buoys: seen more than three times, not given up, and no placard's edge."""
        known = [tower for tower in self._towers if tower.seen > 3 and not tower.dark]
        return [tower for tower in known if all(math.dist(tower.place, face.place) > 2.5 for face in self._map.faces)]

    def look(self, boat: "BoatObservation", seen: Estimate, t: float, *, near_only: bool = False) -> None:
        """Look, if it is time to; `near_only` is for who has found the bay and needs no more but where that is."""
        lidar = sensor_named(boat, "lidar")
        if lidar is None or t < self._next_look - 1e-6:
            return
        self._next_look = t + PERIOD
        reading = boat.sensors[lidar]
        points = leveled(reading.data.points, mounting(reading), seen.rotation, reach=30.0 if near_only else REACH)
        self._map.see((seen.x, seen.y), faces(points))
        if near_only:
            return
        self.banks = banks(points, (seen.x, seen.y))
        free, _ = standing_free(points, high=4.0, widest=TOWER, apart=OFFSHORE)
        for cluster in free:
            self._note_tower(cluster, seen)
        if t >= self._next_picture - 1e-6:
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
        lit = sum(color != OFF for _, color in shows)
        tower.dark = t - shows[0][0] > (DARK_FOR if lit < 4 else WATCHED)
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

    def _read(self, boat: "BoatObservation", seen: Estimate, t: float) -> None:
        """Read the symbols that can be read from here, and see which towers are lit."""
        signs = [face for face in self._map.faces if _legible(face, seen)]
        towers = [tower for tower in self.towers if not tower.lit and tower.looks < LOOKS and _in_view(tower, seen)]
        camera = camera_ahead(boat)
        if not (signs or towers) or camera is None:
            return
        self._next_picture = t + READING
        reading = boat.sensors[camera]
        for face in signs:
            window = cutout(reading, seen, (face.x, face.y, PANEL_HEIGHT), PANEL)
            if window is not None:
                face.note(symbol_in(window), near=seen.to(*face.place)[0] < PLAIN)
        for tower in towers:
            window = cutout(reading, seen, (*tower.place, LAMP_HEIGHT), LAMP)
            tower.looks += 1
            tower.lit = window is not None and lamp_color(window) != OFF


def _legible(face: Face, seen: Estimate) -> bool:
    distance, bearing = seen.to(*face.place)
    if not LEGIBLE[0] < distance < LEGIBLE[1] or abs(wrapped(bearing - seen.heading)) > FIELD:
        return False
    unread = sum(face.votes.values()) < READ and face.looks < LOOKS
    return unread and abs(wrapped(bearing + math.pi - face.facing)) < OBLIQUE


def _in_view(tower: Tower, seen: Estimate) -> bool:
    distance, bearing = seen.to(*tower.place)
    return distance < LAMP_SIGHT and abs(wrapped(bearing - seen.heading)) < FIELD
