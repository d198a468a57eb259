"""Perception: name and locate what shows up before the boat, by its camera."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.control.cameras import camera_ahead, intrinsics, mounting
from vrx_mj.control.navigation import Estimate
from vrx_mj.control.pictures import project
from vrx_mj.control.sightings import OLD, SYDNEY, Blob, blobs, kind_of
from vrx_mj.control.skipper import Commands, Skipper
from vrx_mj.runtime.timing import Pause

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["Perceiver", "Sight"]

PERIOD = 0.95
"""Between two pictures [s]; things are up for 5 s, and a picture costs tens of milliseconds of computing."""
ENOUGH = 2
"""Reported once seen in so many pictures: what has just been dropped is still bobbing."""
SAME = 0.9
"""Things of one type nearer to each other than this [m] in two pictures are one."""
GONE = 1.5 * PERIOD
"""Not seen for so long [s], it is gone."""
FAR = 25.0
"""What seems further off than this [m] is none of the task's things."""
BELOW = 6.0
"""Rows [pixels] below the horizon at which looking begins."""
EDGES = (-0.65, 0.0, 0.65)
"""Bearings from the bow [rad] at which the horizon is looked for: the camera sees 0.7 to either side."""


@dataclass
class Sight:
    """Something seen, in the local frame."""

    type: str
    x: float
    """East [m]: the mean so far."""
    y: float
    """North [m]: as above."""
    count: int = 1
    """In so many pictures."""
    last: float = 0.0
    """When [s]."""
    reported: bool = False


@dataclass(frozen=True)
class View:
    """A camera at the moment of a picture."""

    position: FloatArray
    """(3,) [m], body frame."""
    turned: FloatArray
    """(3, 3): camera's link, x forward and z up, to body."""
    matrix: FloatArray
    """(3, 3): intrinsic [pixels]."""
    seen: Estimate

    def ray(self, column: float, row: float) -> FloatArray:
        """(3,): through a pixel, of depth 1 m, in east-north-up."""
        focal = self.matrix[0, 0]
        own = np.array([1.0, (self.matrix[0, 2] - column) / focal, (self.matrix[1, 2] - row) / focal])
        return np.asarray(self.seen.rotation @ self.turned @ own)

    def scale(self, blob: Blob) -> float:
        """Pixels per metre across a thing that floats on level water where the blob ends below."""
        height = self.seen.z + float((self.seen.rotation @ self.position)[2])
        depth = height / max(1e-3, -float(self.ray(blob.column, blob.row + blob.height / 2.0)[2]))
        return self._stretch(blob.column) / depth

    def place(self, blob: Blob, width: float) -> tuple[float, float]:
        """East and north [m] of a thing of a width [m]."""
        depth = width * self._stretch(blob.column) / blob.width
        x, y, _ = (self.seen.rotation @ self.position + depth * self.ray(blob.column, blob.row)).tolist()
        return self.seen.x + x, self.seen.y + y

    def horizon(self) -> float:
        """The lowest row [pixels] at which there is sky."""
        mount, rows = (self.position, self.turned), []
        for edge in EDGES:
            bearing = self.seen.heading + edge
            far = 1e5 * np.array([math.cos(bearing), math.sin(bearing), 0.0])
            found = project(far, mount, self.seen.rotation, self.matrix)
            rows.append(found[1] if found else 0.0)
        return max(rows)

    def _stretch(self, column: float) -> float:
        """Pixels times depth per metre across: more off the axis, where a picture is flat and a thing is round."""
        focal = float(self.matrix[0, 0])
        return math.hypot(focal, column - float(self.matrix[0, 2]))


class Perceiver(Skipper):
    """Reports each landmark once: its type from colour and outline, its position from camera and apparent width.

    It takes one picture a second while the task runs. What differs from the water is a thing (`sightings.blobs`); its
    colour and proportions give its kind (`sightings.kind_of`), and the known width of the kind gives the distance: an
    error of 2 pixels of 60 at 8 m is 0.3 m. The lidar misses balls nearer than 6 m, so it is not used. North of the
    equator is Sand Island with the catalogue of 2019, south of it Sydney with that of 2022 and 2023.
    """

    def __init__(self, catalogue: str | None = None) -> None:
        """Set the catalogue, `sightings.OLD` or `sightings.SYDNEY`; by default the latitude selects it."""
        self._catalogue = catalogue
        super().__init__()

    def begin(self) -> None:
        """Forget what was seen, at the start of a run."""
        self._pause = Pause()
        self._sights: list[Sight] = []

    def listen(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> None:
        """Take a picture, if one is due, and report what is new."""
        if task.get("state") != "running" or not self._pause.is_over(t):
            return
        self._pause.begin(t, PERIOD)
        camera = camera_ahead(boat)
        if camera is None:
            return
        reading = boat.sensors[camera]
        view = View(*mounting(reading), intrinsics(reading), seen)
        for blob in blobs(reading.data.rgb, view.horizon() + BELOW):
            self._take(view, blob, t)
        self._sights = [sight for sight in self._sights if t - sight.last < GONE]
        new = [sight for sight in self._sights if sight.count >= ENOUGH and not sight.reported]
        for sight in new:
            sight.reported = True
        if new:
            self.messages["landmark"] = [
                {"type": sight.type, **self.navigator.report(sight.x, sight.y)} for sight in new
            ]

    def steer(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> Commands:
        """Return no commands: the task holds the boat."""
        return {}

    @property
    def _known(self) -> str:
        """The catalogue."""
        plane = self.navigator.plane
        return self._catalogue or (OLD if plane is not None and plane.latitude > 0.0 else SYDNEY)

    def _take(self, view: View, blob: Blob, t: float) -> None:
        """Take a blob for something seen before, or for something new."""
        kind = kind_of(blob, self._known, view.scale(blob))
        if kind is None:
            return
        x, y = view.place(blob, kind.width)
        if view.seen.to(x, y)[0] > FAR:
            return
        old = [sight for sight in self._sights if sight.type == kind.type and sight.last < t]
        known = min(old, key=lambda sight: math.dist((sight.x, sight.y), (x, y)), default=None)
        if known is None or math.dist((known.x, known.y), (x, y)) > SAME:
            self._sights.append(Sight(kind.type, x, y, last=t))
            return
        known.count, known.last = known.count + 1, t
        known.x += (x - known.x) / known.count
        known.y += (y - known.y) / known.count
