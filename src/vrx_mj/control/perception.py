"""Perception: name and locate what shows up before the boat, by its camera."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.control.buoy_map import CELL, camera_ahead, connected_groups, intrinsics, mounting, project
from vrx_mj.control.navigation import Estimate, Place, nearest
from vrx_mj.control.pilot import Commands, Moment, Skipper
from vrx_mj.runtime.timing import Pause

_STRIDE = 2
"""Every so many pixels one is examined: a ball of 0.5 m at 15 m is 25 pixels wide."""
_MIN_SATURATION = 0.45
"""Least saturation of a coloured pixel: water has 0.7, but is blue."""
_WHITE_MIN, _WHITE_EXCESS = 90.0, 100.0
"""White: least value of the darkest channel, and least excess of all three together over the water, of 0 to 255."""
_BLACK_MAX, _BLACK_DEFICIT = 55.0, 30.0
"""Black: largest value of the brightest channel, and least deficit of all three together below the water."""
_MIN_ASPECT = 0.5
"""Height over width below which something is a streak of foam or light on a wave."""
_BOW_ROW = 0.72
"""Share of the picture's height below which the boat's own bows are."""
_MIN_AREA = 12
"""Least number of examined pixels of a thing."""
_ORANGE_RATIO = 0.09
"""Orange is red with at least this (green - blue) / (red - blue): VRX's red has 0, its orange 0.19."""
_PALE_RATIO = 0.3
"""Darkest over brightest channel from which a colour is pale: the cans of 2019 have 0.4 and 0.6, totems 0."""
_NOTHING, _RED, _ORANGE, _GREEN, _BLUE, _YELLOW, _WHITE, _BLACK = range(8)
"""Numbers of the colours of pixels."""
_NAMES = ("", "red", "orange", "green", "blue", "yellow", "white", "black")
"""Names of the colours, by number."""

OLD = "2019"
"""The catalogue of VRX 2019, at Sand Island."""
SYDNEY = "2022"
"""The catalogue of VRX 2022 and 2023."""
_TALL_ASPECT = 1.25
"""Height over width from which something is tall."""
_PICTURE_PERIOD = 0.95
"""Time between two pictures [s]: things are up for 5 s, and a picture takes tens of milliseconds of computing."""
_MIN_SIGHTINGS = 2
"""Pictures that must show a thing before it is reported: one just dropped is still bobbing."""
_MATCH_RADIUS = 0.9
"""Two sightings of one type within this distance [m] are the same thing."""
_FORGET_TIME = 1.5 * _PICTURE_PERIOD
"""A thing that was not seen for this time [s] is forgotten."""
_MAX_DISTANCE = 25.0
"""Something that seems further off than this [m] is not one of the task's things."""
_HORIZON_MARGIN = 6.0
"""Rows [pixels] below the horizon at which the search begins."""
_HORIZON_BEARINGS = (-0.65, 0.0, 0.65)
"""Bearings from the bow [rad] at which the horizon is located: the camera sees 0.7 to either side."""


@dataclass(frozen=True)
class Blob:
    """A thing in a picture [pixels]."""

    color: str
    column: float
    """Column of its middle [pixels]."""
    row: float
    """Row of its middle, from the top [pixels]."""
    width: float
    height: float
    pale: bool
    """Whether its colour is a pale one."""


@dataclass(frozen=True)
class Kind:
    """Kind of a thing that was recognized."""

    type: str
    """Name of its type in reports."""
    width: float
    """Width of the thing [m]."""


_MARKERS: dict[str, dict[str, Kind]] = {
    SYDNEY: {color: Kind(f"mb_marker_buoy_{color}", 0.65) for color in ("red", "green", "white", "black")},
    OLD: {
        **{color: Kind(f"{color}_totem", 0.28) for color in ("red", "green", "blue", "yellow", "black")},
        "white": Kind("surmark46104", 0.45),
    },
}
"""Tall things, by colour; widths from VRX's models."""
_CANS = {"red": Kind("surmark950410", 0.46), "green": Kind("surmark950400", 0.46)}
"""Objects of VRX 2019, in pale colours."""
_BALLS: dict[str, dict[str, tuple[Kind, ...]]] = {
    SYDNEY: {"orange": (Kind("mb_round_buoy_orange", 0.51),), "black": (Kind("mb_round_buoy_black", 0.51),)},
    OLD: {"black": (Kind("polyform_a3", 0.432), Kind("polyform_a5", 0.686), Kind("polyform_a7", 0.991))},
}
"""Round things, by colour."""
_TYPE_NAMES = {
    name: {kind.type for kinds in (_MARKERS[name], _CANS if name == OLD else {}) for kind in kinds.values()}
    | {kind.type for kinds in _BALLS[name].values() for kind in kinds}
    for name in (SYDNEY, OLD)
}
"""Names of the types in each catalogue."""


def catalogue_of(types: Iterable[str]) -> str:
    """The catalogue that has most of a task's types, the newer one of two that have as many."""
    return max((SYDNEY, OLD), key=lambda name: len(_TYPE_NAMES[name].intersection(types)))


def kind_of(blob: Blob, catalogue: str, scale: float | None = None) -> Kind | None:
    """Kind of a blob; None if nothing in the catalogue looks like it.

    Of balls of several sizes that one is taken that has the blob's width at the `scale` [pixels/m], or the middle one.
    """
    tall = blob.height > _TALL_ASPECT * blob.width
    balls = _BALLS[catalogue].get(blob.color, ())
    if balls and (not tall or blob.color == "orange"):
        if scale is None:
            return balls[len(balls) // 2]
        return min(balls, key=lambda kind: abs(kind.width - blob.width / scale))
    if catalogue == OLD and blob.pale and blob.color in _CANS:
        return _CANS[blob.color]
    return _MARKERS[catalogue].get(blob.color)


def blobs(picture: ByteArray, horizon: float) -> list[Blob]:
    """The things in a picture (height, width, 3) below a row, the largest first; not the boat's own bows."""
    first, last = max(0, int(horizon)) // _STRIDE * _STRIDE, int(_BOW_ROW * picture.shape[0])
    part = picture[first:last:_STRIDE, ::_STRIDE].astype(np.float64)
    if not part.size:
        return []
    water = np.median(part, axis=1)[:, None, :]
    kinds = _kinds(part, np.broadcast_to(water, part.shape))
    found = [blob for kind in range(1, len(_NAMES)) for blob in _of_kind(kinds, kind, part)]
    found = [_full_size(blob, first) for blob in sorted(found, key=lambda blob: -blob.width * blob.height)]
    return [blob for blob in _merge_parts(found) if blob.height > _MIN_ASPECT * blob.width]


def _kinds(pixels: FloatArray, water: FloatArray) -> IntArray:
    """The colour of each pixel, as a number."""
    red, green, blue = (pixels[..., channel] for channel in range(3))
    most, least = pixels.max(axis=-1), pixels.min(axis=-1)
    lighter = (pixels - water).sum(axis=-1)
    strong = (most - least > _MIN_SATURATION * most) & (most > 30.0)
    reddish = strong & (red == most)
    orange = green - blue > _ORANGE_RATIO * (red - blue)
    yellow = green - blue > 0.6 * (red - blue)
    greenish = (green == most) & (green - np.maximum(red, blue) > 0.12 * most) & (most > 25.0)
    bluish = strong & (blue == most) & (blue - green > 0.6 * blue) & (lighter > 0.0)
    kinds = np.zeros(most.shape, int)
    kinds[(least > _WHITE_MIN) & (lighter > _WHITE_EXCESS) & ~strong] = _WHITE
    kinds[(most < _BLACK_MAX) & (lighter < -_BLACK_DEFICIT) & (blue - red < 0.45 * blue + 8.0)] = _BLACK
    kinds[bluish] = _BLUE
    kinds[greenish] = _GREEN
    kinds[reddish] = _RED
    kinds[reddish & orange] = _ORANGE
    kinds[(reddish | (strong & (green == most))) & yellow & (red > 0.5 * green)] = _YELLOW
    return kinds


def _of_kind(kinds: IntArray, kind: int, pixels: FloatArray) -> list[Blob]:
    rows, columns = np.nonzero(kinds == kind)
    if len(rows) < _MIN_AREA:
        return []
    half = CELL / 2.0  # pixels within two of each other belong together
    groups = connected_groups(np.stack([columns, rows], axis=1).astype(np.float64) * half)
    return [_blob(np.rint(part / half).astype(int), _NAMES[kind], pixels) for part in groups if len(part) >= _MIN_AREA]


def _blob(places: IntArray, color: str, pixels: FloatArray) -> Blob:
    (left, top), (right, bottom) = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    typical = np.median(pixels[places[:, 1], places[:, 0]], axis=0)
    pale = bool(typical.min() > _PALE_RATIO * typical.max())
    return Blob(color, (left + right) / 2.0, (top + bottom) / 2.0, right - left + 1.0, bottom - top + 1.0, pale)


def _full_size(blob: Blob, first: int) -> Blob:
    """The blob in pixels of the whole picture."""
    column, row = blob.column * _STRIDE + (_STRIDE - 1) / 2.0, blob.row * _STRIDE + first + (_STRIDE - 1) / 2.0
    return Blob(blob.color, column, row, blob.width * _STRIDE, blob.height * _STRIDE, blob.pale)


def _merge_parts(found: list[Blob]) -> list[Blob]:
    """Parts of one thing, which a band divides, put together; bands and shadows left out. The largest come first."""
    whole: list[Blob] = []
    for blob in found:
        at = next((index for index, other in enumerate(whole) if _is_part(blob, other)), None)
        if at is None:
            whole.append(blob)
        elif blob.color == whole[at].color:
            whole[at] = _union(whole[at], blob)
    return whole


def _is_part(blob: Blob, whole: Blob) -> bool:
    beside = abs(blob.column - whole.column) > 0.3 * max(whole.width, blob.width)
    gap = abs(blob.row - whole.row) - 0.5 * (whole.height + blob.height)
    return not beside and gap < 0.5 * whole.height and blob.width < 1.5 * whole.width


def _union(one: Blob, other: Blob) -> Blob:
    left = min(one.column - one.width / 2.0, other.column - other.width / 2.0)
    right = max(one.column + one.width / 2.0, other.column + other.width / 2.0)
    top = min(one.row - one.height / 2.0, other.row - other.height / 2.0)
    bottom = max(one.row + one.height / 2.0, other.row + other.height / 2.0)
    return Blob(one.color, (left + right) / 2.0, (top + bottom) / 2.0, right - left, bottom - top, one.pale)


@dataclass
class Sight(Place):
    """Something seen, in the local frame."""

    type: str
    x: float
    """East [m]: the mean so far."""
    y: float
    """North [m]: the mean so far."""
    count: int = 1
    """Number of pictures in which it was seen."""
    last: float = 0.0
    """Time of the last picture in which it was seen [s]."""
    reported: bool = False


@dataclass(frozen=True)
class View:
    """A camera at the moment of a picture."""

    position: FloatArray
    """Position of the camera, (3,) [m], body frame."""
    turned: FloatArray
    """Rotation (3, 3) from the camera's link, x forward and z up, to the body."""
    matrix: FloatArray
    """Intrinsic matrix (3, 3) [pixels]."""
    seen: Estimate

    def ray(self, column: float, row: float) -> FloatArray:
        """Ray through a pixel, (3,) in east-north-up, of depth 1 m."""
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
        for edge in _HORIZON_BEARINGS:
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

    It takes one picture a second while the task runs. What differs from the water is a thing (`blobs`); its colour and
    proportions give its kind (`kind_of`), and the known width of the kind gives the distance: an error of 2 pixels of
    60 at 8 m is 0.3 m. The lidar misses balls nearer than 6 m, so it is not used.
    """

    def __init__(self, catalogue: str | None = None) -> None:
        """Set the catalogue, `OLD` or `SYDNEY`; by default that which knows most of the task's types."""
        self._given = catalogue
        super().__init__()

    def begin(self) -> None:
        """Forget what was seen, at the start of a run."""
        self._pause = Pause()
        self._sights: list[Sight] = []

    def listen(self, now: Moment) -> None:
        """Take a picture, if one is due, and report what is new."""
        boat, seen, task, t = now
        if task.get("state") != "running" or not self._pause.is_over(t):
            return
        self._pause.begin(t, _PICTURE_PERIOD)
        camera = camera_ahead(boat)
        if camera is None:
            return
        reading = boat.sensors[camera]
        self._catalogue = self._given or catalogue_of(task.get("types", ()))
        view = View(*mounting(reading), intrinsics(reading), seen)
        for blob in blobs(reading.data.rgb, view.horizon() + _HORIZON_MARGIN):
            self._take(view, blob, t)
        self._sights = [sight for sight in self._sights if t - sight.last < _FORGET_TIME]
        new = [sight for sight in self._sights if sight.count >= _MIN_SIGHTINGS and not sight.reported]
        for sight in new:
            sight.reported = True
        if new:
            self.messages["landmark"] = [
                {"type": sight.type, **self.navigator.report(sight.x, sight.y)} for sight in new
            ]

    def steer(self, now: Moment) -> Commands:
        """Return no commands: the task holds the boat."""
        return {}

    def _take(self, view: View, blob: Blob, t: float) -> None:
        """Take a blob for something seen before, or for something new."""
        kind = kind_of(blob, self._catalogue, view.scale(blob))
        if kind is None:
            return
        x, y = view.place(blob, kind.width)
        if view.seen.to(x, y)[0] > _MAX_DISTANCE:
            return
        old = [sight for sight in self._sights if sight.type == kind.type and sight.last < t]
        known = nearest(old, (x, y))
        if known is None or math.dist(known.place, (x, y)) > _MATCH_RADIUS:
            self._sights.append(Sight(kind.type, x, y, last=t))
            return
        known.count, known.last = known.count + 1, t
        known.x += (x - known.x) / known.count
        known.y += (y - known.y) / known.count
