"""The lookout: once a second through the lidar, and through the camera when there is something new to be seen.

A picture costs tens of milliseconds of computing, so none is taken unless a buoy of unknown kind is where the camera
tells reliably, from 6 m (nearer, the waves around it are as large as it) to 45 m (8 pixels).
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.constants import EARLY
from vrx_mj.control.buoy_map import WIDEST, Buoy, BuoyMap, kind_of
from vrx_mj.control.cameras import camera_ahead, intrinsics, mounting
from vrx_mj.control.clusters import banks, leveled, standing_free
from vrx_mj.control.guidance import Point
from vrx_mj.control.navigation import Estimate, sensor_named
from vrx_mj.control.pictures import look_at, project
from vrx_mj.runtime.timing import Pause

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["Lookout"]

PERIOD = 1.0
"""Between two looks [s]."""
REACH = 75.0
"""How far the lidar's returns are taken [m]."""
SHORE = 3.0
"""What is nearer than this [m] to something wide is taken for a part of it: a stone of the shore, not a buoy."""
NEAREST, FARTHEST = 6.0, 45.0
"""From where to where a buoy is looked at through the camera [m]."""
ENOUGH = 4
"""So many votes settle a kind."""
PLAIN = 25.0
"""What was looked at from nearer than this [m] and not told counts as looked at; further off a wave may hide it."""
WINDOW = (1.4, 2.4)
"""What of a picture is looked at [m]: wide enough for a marker, and high enough wherever the lidar hit it."""
FIELD = 0.62
"""Half the angle [rad] in which a buoy is well inside the picture: VRX's camera sees 0.7 to either side."""


class Lookout:
    """Keeps a map of the buoys around a boat, in the local frame of its navigation."""

    def __init__(self, *, period: float = PERIOD) -> None:
        self.map = BuoyMap()
        self.banks: list[Point] = []
        """Where something wide is near by [m], as a shore."""
        self._period, self._pause = period, Pause(EARLY)

    def look(self, boat: "BoatObservation", seen: Estimate, t: float, *, colors: bool = True) -> bool:
        """Look, if it is time to, and for `colors`, too, if they matter; tells whether it was."""
        lidar = sensor_named(boat, "lidar")
        if lidar is None or not self._pause.is_over(t):
            return False
        self._pause.begin(t, self._period)
        reading = boat.sensors[lidar]
        if not hasattr(reading.data, "points"):
            return False
        points = leveled(reading.data.points, mounting(reading), seen.rotation, reach=REACH)
        free, wide = standing_free(points, widest=WIDEST, apart=SHORE)
        self.map.see((seen.x, seen.y), free, t)
        self.banks = banks(wide, (seen.x, seen.y))
        if colors:
            self._color(boat, seen, t)
        return True

    def _color(self, boat: "BoatObservation", seen: Estimate, t: float) -> None:
        """Look through the camera at those buoys in view whose kind is not settled."""
        camera = camera_ahead(boat)
        strange = [buoy for buoy in self.map.sure if buoy.last == t and self._wanted(buoy, seen)]
        if camera is None or not strange:
            return
        reading = boat.sensors[camera]
        mount, matrix = mounting(reading), intrinsics(reading)
        for buoy in strange:
            point = np.array([buoy.x - seen.x, buoy.y - seen.y, buoy.z])
            where = project(point, mount, seen.rotation, matrix)
            if where is None:
                continue
            column, row, ahead = where
            buoy.looks += ahead < PLAIN
            look = look_at(reading.data.rgb, column, row, float(matrix[0, 0]) / ahead, size=WINDOW)
            kind = kind_of(look) if look else ""
            if kind:
                buoy.votes[kind] += 1

    @staticmethod
    def _wanted(buoy: Buoy, seen: Estimate) -> bool:
        distance, bearing = seen.to(buoy.x, buoy.y)
        settled = bool(buoy.kind) and max(buoy.votes.values()) >= ENOUGH
        ahead = abs(math.remainder(bearing - seen.heading, math.tau)) < FIELD
        return not settled and ahead and NEAREST < distance < FARTHEST
