"""A map of what floats around: places from the lidar, and colours and shapes from a camera, over many looks.

A place is the mean of the last looks, as buoys drift; a colour is that of most looks. What was seen once, or has gone
from where the lidar must see it, is forgotten.

A buoy contrasts with the water around it, whatever the light and the fog; so what is judged is the difference
between the pixels that differ and the background, and how those lean towards one colour, not their brightness.
"""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, ByteArray, FloatArray, IntArray
from vrx_mj.constants import EARLY
from vrx_mj.control.navigation import Estimate, Place, Point, nearest, sensor_named
from vrx_mj.control.pilot import Moment
from vrx_mj.runtime.timing import Pause

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation
    from vrx_mj.sensors.readings import Reading

CELL = 0.5
"""Side of the grid's cells [m]: returns in cells that touch, corners included, are one group."""
_HULL_BOX = (-3.2, 3.2, 1.8)
"""x of the stern and of the bow, and largest |y| [m, body frame]: returns within are from the boat itself."""

_MATCH_RADIUS = 2.0
"""A cluster within this distance [m] of a known buoy is that buoy; in some of VRX's fields they are 1 m apart."""
_MAX_BUOY_WIDTH = 1.4
"""Something wider than this [m] is shore or dock, not a buoy."""
_MAX_BUOY_TOP = 2.0
"""Something that rises higher than this [m] is not a buoy: VRX's reach 1 m, and waves lift them by another."""
_LOOK_WEIGHT = 0.4
"""Weight of the last look in the mean position of a buoy."""
_MIN_LOOKS = 2
"""Least number of looks that confirm a buoy, and of votes that confirm its colour."""
FORGET_TIME = 12.0
"""A buoy within `_CLEAR_RANGE` that was not seen for this time [s] is forgotten."""
_CLEAR_RANGE = 18.0
"""Up to this distance [m] the lidar sees every buoy that nothing hides, though waves heave it between two rings."""
_MARKER_HEIGHT = 0.68
"""A buoy that rises out of the water higher than this [m], and higher than it is wide, is a marker, not a ball."""
_LASTING_LOOKS = 6
"""A buoy seen in this many looks is never forgotten: it may be hidden by another, or far off."""
_LOOK_PERIOD = 1.0
"""Time between two looks [s]."""
_LIDAR_RANGE = 75.0
"""Lidar returns from further off than this [m] are not used."""
_SHORE_GAP = 3.0
"""Something narrow within this distance [m] of something wide is a stone of the shore, not a buoy."""
_MIN_LOOK_DISTANCE, _MAX_LOOK_DISTANCE = 6.0, 45.0
"""Least and largest distance at which a buoy is looked at through the camera [m]."""
_KIND_VOTES = 4
"""Votes for a kind after which the camera looks at a buoy no more."""
_PLAIN_VIEW_DISTANCE = 25.0
"""Only looks from nearer than this [m] count as looks without a kind; further off a wave may hide the buoy."""
_WINDOW_SIZE = (1.4, 2.4)
"""Width and height [m] of the part of a picture that is examined: a marker fits in wherever the lidar hit it."""
_HALF_FIELD = 0.62
"""Half the angle [rad] in which a buoy is well inside the picture: VRX's camera sees 0.7 to either side."""
_MIN_CONTRAST = 40.0
"""Least difference from the background of a pixel of a thing: sum over red, green and blue, of 0 to 255 each."""
_MIN_SATURATION = 0.22
"""Least difference between the brightest and the darkest channel of a coloured pixel, as a share of the brightest."""
_MIN_BLUE_SATURATION = 0.45
"""Least saturation of a blue pixel: that of water is 0.1 to 0.3."""
_ORANGE_RATIO = 0.13
"""Orange is red with at least this (green - blue) / (red - blue): VRX's red buoys have 0, its orange ones 0.19."""


class Cluster(NamedTuple):
    """Returns that belong together."""

    x: float
    """Position of the middle [m], in the level axes of the points."""
    y: float
    extent: float
    """Largest horizontal distance across [m]."""
    bottom: float
    """Height of the lowest return [m]."""
    top: float
    """Height of the highest [m]."""
    returns: int
    """Number of returns."""


def level_points(
    points: npt.ArrayLike, mount: tuple[FloatArray, FloatArray], attitude: FloatArray, *, reach: float
) -> FloatArray:
    """Lidar returns in level axes, (n, 3) [m]: east, north and up from the boat's origin.

    Args:
        points: (n, 3) returns [m], sensor frame.
        mount: where the sensor is on the boat: position (3,) [m] and rotation (3, 3), sensor to body.
        attitude: (3, 3) rotation of the body to level axes.
        reach: returns further off than this [m], and those from the boat itself, are left out.
    """
    position, rotation = mount
    seen = np.asarray(points, np.float64) @ rotation.T + position
    stern, bow, side = _HULL_BOX
    own = (seen[:, 0] > stern) & (seen[:, 0] < bow) & (np.abs(seen[:, 1]) < side)
    near = np.hypot(seen[:, 0], seen[:, 1]) < reach
    return seen[near & ~own] @ attitude.T


def lidar_points(now: Moment, pause: Pause, period: float, *, reach: float) -> FloatArray | None:
    """Points of a boat's lidar, as `level_points`; None before a pause is over, which lasts a period [s].

    None also without a lidar; a planar one does not count.
    """
    name = sensor_named(now.boat, "lidar")
    if name is None or not pause.is_over(now.t):
        return None
    pause.begin(now.t, period)
    reading = now.boat.sensors[name]
    if not hasattr(reading.data, "points"):
        return None
    return level_points(reading.data.points, mounting(reading), now.seen.rotation, reach=reach)


def connected_groups(points: FloatArray) -> list[FloatArray]:
    """Points, (n, 3) [m], in groups of those that belong together, seen from above."""
    if not len(points):
        return []
    cells = np.floor(points[:, :2] / CELL).astype(np.int64)
    kinds, member = np.unique((cells[:, 0] << 32) + cells[:, 1], return_inverse=True)
    label = _parts(kinds)[member]
    order = np.argsort(label, kind="stable")
    ends = np.cumsum(np.bincount(label))[:-1]
    return [part for part in np.split(points[order], ends) if len(part)]


def _parts(keys: IntArray) -> IntArray:
    """The part, a number, that each cell belongs to, of sorted keys: column, times 2^32, plus row."""
    label = np.arange(len(keys))
    ends = [_neighbours(keys, (i << 32) + j) for i, j in ((0, 1), (1, -1), (1, 0), (1, 1))]
    one, other = (np.concatenate(side) for side in zip(*ends, strict=True))
    while True:
        least = np.minimum(label[one], label[other])
        after = label.copy()
        np.minimum.at(after, one, least)
        np.minimum.at(after, other, least)
        after = after[after]
        if np.array_equal(after, label):
            return label
        label = after


def _neighbours(keys: IntArray, step: int) -> tuple[IntArray, IntArray]:
    """Rows of the cells that have a neighbour one step on, and the rows of those."""
    place = np.minimum(np.searchsorted(keys, keys + step), len(keys) - 1)
    rows = np.nonzero(keys[place] == keys + step)[0]
    return rows, place[rows]


def _cluster(points: FloatArray) -> Cluster:
    low, high = points.min(axis=0), points.max(axis=0)
    x, y = (low[:2] + high[:2]) / 2.0
    across = float(np.hypot(*(high - low)[:2]))
    return Cluster(float(x), float(y), across, float(low[2]), float(high[2]), len(points))


def standing_free(
    points: FloatArray, *, widest: float, apart: float, high: float = 3.5
) -> tuple[list[Cluster], FloatArray]:
    """Clusters that are narrow and separate, and the returns of wide things, (n, 3) [m], such as shores and docks.

    Of level returns, (n, 3) [m]: clusters up to `widest` [m] across that keep `apart` [m] from all wider ones.
    """
    groups = connected_groups(points[(points[:, 2] > -0.6) & (points[:, 2] < high)])
    found = [(_cluster(group), group) for group in groups]
    small = [cluster for cluster, _ in found if cluster.extent <= widest]
    broad = [group for cluster, group in found if cluster.extent > widest]
    if not broad:
        return small, np.empty((0, 3))
    wide = np.concatenate(broad)
    free = [one for one in small if float(np.hypot(wide[:, 0] - one.x, wide[:, 1] - one.y).min()) > apart]
    return free, wide


def banks(points: FloatArray, here: Point, *, reach: float = 20.0, cell: float = 2.0) -> list[Point]:
    """Where something rises out of the water near by [m], one place in each cell with returns, (n, 3) from `here`."""
    near = points[(np.hypot(points[:, 0], points[:, 1]) < reach) & (points[:, 2] > -0.3)]
    cells = np.unique(np.floor(near[:, :2] / cell), axis=0)
    return [(here[0] + float(x), here[1] + float(y)) for x, y in (cells + 0.5) * cell]


@dataclass
class Buoy(Place):
    """Something that floats."""

    x: float
    """East [m]."""
    y: float
    """North [m]."""
    z: float = 0.4
    """Height above the boat's origin of what the last look saw of it [m]."""
    seen: int = 1
    """Number of looks that saw it."""
    last: float = 0.0
    """Time of the last look that saw it [s]."""
    looks: int = 0
    """Number of looks through a camera from near."""
    tried: float = 0.0
    """Time spent on trying to see it [s]."""
    votes: Counter[str] = field(default_factory=Counter)
    """Kinds that the looks at it found, see `kind`."""

    @property
    def kind(self) -> str:
        """red, green, white, blue or black of a marker, `ball` of any ball; empty as long as it is unsure."""
        if not self.votes:
            return ""
        (kind, count), *rest = self.votes.most_common()
        return kind if count >= _MIN_LOOKS and all(less < count for _, less in rest) else ""


class BuoyMap:
    """The buoys met so far."""

    def __init__(self) -> None:
        self.buoys: list[Buoy] = []

    @property
    def sure(self) -> list[Buoy]:
        """Return the buoys that were seen often enough to be there."""
        return [buoy for buoy in self.buoys if buoy.seen >= _MIN_LOOKS]

    def of(self, *kinds: str) -> list[Buoy]:
        """Return the sure buoys of some kinds."""
        return [buoy for buoy in self.sure if buoy.kind in kinds]

    def see(self, here: Point, found: Iterable[Cluster], time: float) -> None:
        """Take the clusters of one look from `here` [m]; their places are relative to it."""
        for cluster in found:
            if cluster.extent < _MAX_BUOY_WIDTH and cluster.top < _MAX_BUOY_TOP:
                self._see(here[0] + cluster.x, here[1] + cluster.y, (cluster.bottom + cluster.top) / 2.0, time)
        self.buoys = [buoy for buoy in self.buoys if not self._is_gone(buoy, here, time)]

    def _see(self, x: float, y: float, z: float, time: float) -> None:
        known = nearest(self.buoys, (x, y))
        if known is None or math.dist(known.place, (x, y)) > _MATCH_RADIUS:
            self.buoys.append(Buoy(x, y, z, last=time))
            return
        if known.last != time:
            known.seen += 1
            known.x += _LOOK_WEIGHT * (x - known.x)
            known.y += _LOOK_WEIGHT * (y - known.y)
            known.z, known.last = z, time

    @staticmethod
    def _is_gone(buoy: Buoy, here: Point, time: float) -> bool:
        unseen = time - buoy.last
        clear = math.dist(buoy.place, here) < _CLEAR_RANGE and buoy.seen < _LASTING_LOOKS
        return unseen > FORGET_TIME and (buoy.seen < _MIN_LOOKS or clear)


class Lookout:
    """Keeps a map of the buoys around a boat, in the local frame of its navigation."""

    def __init__(self, *, period: float = _LOOK_PERIOD) -> None:
        self.map = BuoyMap()
        self.banks: list[Point] = []
        """Where something wide is near by [m], as a shore."""
        self._period, self._pause = period, Pause(EARLY)

    def look(self, now: Moment, *, colors: bool = True) -> bool:
        """Look, if it is time to, and for `colors`, too, if they matter; returns whether it was."""
        points = lidar_points(now, self._pause, self._period, reach=_LIDAR_RANGE)
        if points is None:
            return False
        free, wide = standing_free(points, widest=_MAX_BUOY_WIDTH, apart=_SHORE_GAP)
        self.map.see(now.seen.place, free, now.t)
        self.banks = banks(wide, now.seen.place)
        if colors:
            self._color(now)
        return True

    def _color(self, now: Moment) -> None:
        """Look through the camera at those buoys in view whose kind is not settled."""
        boat, seen, _, t = now
        camera = camera_ahead(boat)
        strange = [buoy for buoy in self.map.sure if buoy.last == t and self._is_worth_a_look(buoy, seen)]
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
            buoy.looks += ahead < _PLAIN_VIEW_DISTANCE
            look = look_at(reading.data.rgb, column, row, float(matrix[0, 0]) / ahead, size=_WINDOW_SIZE)
            kind = kind_of(look) if look else ""
            if kind:
                buoy.votes[kind] += 1

    @staticmethod
    def _is_worth_a_look(buoy: Buoy, seen: Estimate) -> bool:
        distance, bearing = seen.to(buoy.x, buoy.y)
        settled = bool(buoy.kind) and max(buoy.votes.values()) >= _KIND_VOTES
        ahead = abs(math.remainder(bearing - seen.heading, math.tau)) < _HALF_FIELD
        return not settled and ahead and _MIN_LOOK_DISTANCE < distance < _MAX_LOOK_DISTANCE


def camera_ahead(boat: "BoatObservation") -> str | None:
    """The camera that looks ahead: one named so, as VRX's two, or else the first; None on a boat without."""
    return sensor_named(boat, "front") or sensor_named(boat, "camera")


def mounting(reading: Any) -> tuple[FloatArray, FloatArray]:
    """Where a sensor's link is on the boat: position (3,) [m] and rotation (3, 3) to the body frame."""
    return np.asarray(reading.mount.position), np.asarray(reading.mount.rotation)


def intrinsics(reading: "Reading") -> FloatArray:
    """Intrinsic matrix (3, 3) of a camera [pixels]."""
    return np.asarray(reading.data.info.K, np.float64).reshape(3, 3)


def cutout(
    reading: Any, seen: Estimate, place: tuple[float, float, float], half: tuple[float, float]
) -> ByteArray | None:
    """The part of a picture that shows a place, (rows, columns, 3); None if the picture does not contain all of it.

    `place` is east, north [m, local] and the height above the boat's origin [m], `half` the width and height to each
    side of it [m].
    """
    picture, matrix = reading.data.rgb, intrinsics(reading)
    point = np.array([place[0] - seen.x, place[1] - seen.y, place[2]])
    where = project(point, mounting(reading), seen.rotation, matrix)
    if where is None:
        return None
    column, row, ahead = where
    scale = float(matrix[0, 0]) / ahead
    left, right = round(column - half[0] * scale), round(column + half[0] * scale) + 1
    top, bottom = round(row - half[1] * scale), round(row + half[1] * scale) + 1
    if left < 0 or top < 0 or right > picture.shape[1] or bottom > picture.shape[0]:
        return None
    window: ByteArray = picture[top:bottom, left:right]
    return window


class Look(NamedTuple):
    """Colour and shape of something in a picture."""

    color: str
    """red, orange, green, blue, yellow, white or black."""
    width: float
    """Width of the thing [m]."""
    height: float
    """Height of the thing [m]."""


def project(
    point: FloatArray, mount: tuple[FloatArray, FloatArray], attitude: FloatArray, matrix: FloatArray
) -> tuple[float, float, float] | None:
    """Column, row [pixels] and distance ahead [m] of a point in a picture; None if it is behind the camera.

    Args:
        point: (3,) [m], level axes from the boat's origin.
        mount: the camera's link on the boat, x forward and z up: position (3,) [m], rotation (3, 3) to body.
        attitude: (3, 3) rotation of the body to level axes.
        matrix: (3, 3) intrinsic matrix [pixels].
    """
    position, rotation = mount
    ahead, left, up = rotation.T @ (attitude.T @ point - position)
    if ahead < 0.1:
        return None
    column = matrix[0, 2] - matrix[0, 0] * left / ahead
    row = matrix[1, 2] - matrix[1, 1] * up / ahead
    return float(column), float(row), float(ahead)


def look_at(
    picture: ByteArray, column: float, row: float, scale: float, *, size: tuple[float, float] = (1.4, 1.8)
) -> Look | None:
    """Look at what is about a pixel; None where nothing differs, or it is cut off by the picture's edge.

    Args:
        picture: (height, width, 3).
        column: where to look [pixels].
        row: the same, from the top.
        scale: [pixels/m] at the thing's distance.
        size: width and height of the window [m].
    """
    half_width, half_height = (max(3, round(scale * side / 2.0)) for side in size)
    u, v = round(column), round(row)
    if not (half_width <= u < picture.shape[1] - half_width and half_height <= v < picture.shape[0] - half_height):
        return None
    window = picture[v - half_height : v + half_height + 1, u - half_width : u + half_width + 1].astype(np.float64)
    sides = np.concatenate([window[:, :2], window[:, -2:]], axis=1)
    background = np.median(sides, axis=1)[:, None, :]  # row by row: the horizon and the shore lie level
    off = window - background
    mask = middle_part(np.abs(off).sum(axis=2) > _MIN_CONTRAST)
    if mask.sum() < 4 or mask[0].any() or mask[-1].any():
        return None
    rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
    color = color_of(window[mask], np.broadcast_to(background, window.shape)[mask])
    wide, tall = (columns[-1] - columns[0] + 1) / scale, (rows[-1] - rows[0] + 1) / scale
    return Look(color, float(wide), float(tall))


def color_of(pixels: npt.ArrayLike, background: npt.ArrayLike) -> str:
    """Colour of pixels, (n, 3) of 0 to 255, before a background of the same shape.

    Most of the pixels decide: markers wear a band of white, and shadows are dark.
    """
    seen, behind = np.asarray(pixels, np.float64), np.asarray(background, np.float64)
    names = [_hue(pixel) for pixel in seen]
    hues = [name for name in names if name]
    if len(hues) >= 0.3 * len(names):
        return max(sorted(set(hues)), key=hues.count)
    brighter = (seen - behind).sum(axis=1) > 0.0
    return "white" if brighter.mean() > 0.5 else "black"


def _hue(pixel: FloatArray) -> str:
    """Colour of a pixel, or nothing if it has none."""
    red, green, blue = (float(value) for value in pixel)
    least, most = min(red, green, blue), max(red, green, blue)
    if most - least < _MIN_SATURATION * most or most < 25.0:
        return ""
    if red == most:
        if green - blue > 0.6 * (red - blue):
            return "yellow"
        return "orange" if green - blue > _ORANGE_RATIO * (red - blue) else "red"
    if green == most:
        return "yellow" if red - blue > 0.6 * (green - blue) else "green"
    return "blue" if blue - max(red, green) > _MIN_BLUE_SATURATION * blue else ""


def middle_part(mask: BoolArray) -> BoolArray:
    """Part of a mask that is joined, along columns and then along rows, to its fullest ones near the middle."""
    columns = _middle_run(mask.sum(axis=0))
    part = np.zeros_like(mask)
    part[:, columns] = mask[:, columns]
    rows = _middle_run(part.sum(axis=1))
    whole = np.zeros_like(mask)
    whole[rows] = part[rows]
    return whole


def _middle_run(crowd: IntArray) -> slice:
    """The run of numbers above 0 about the largest, those near the middle preferred."""
    middle = len(crowd) / 2.0 - 0.5
    weight = crowd * np.exp(-(((np.arange(len(crowd)) - middle) / (0.35 * len(crowd))) ** 2))
    low = high = int(np.argmax(weight))
    while low > 0 and crowd[low - 1] > 0:
        low -= 1
    while high < len(crowd) - 1 and crowd[high + 1] > 0:
        high += 1
    return slice(low, high + 1)


def kind_of(look: Look) -> str:
    """The kind of buoy that something looks like; empty if it looks like none."""
    if not 0.15 < look.width < 1.35 or not 0.15 < look.height < 1.5:
        return ""
    if look.height < max(_MARKER_HEIGHT, 1.1 * look.width):
        return "ball" if look.color in ("black", "orange", "blue") else ""
    return "ball" if look.color == "orange" else look.color
