"""Placards of docks: upright panels, found by the lidar, and the coloured symbols on them, read through a camera."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from vrx_mj.arrays import BoolArray, ByteArray, FloatArray, IntArray
from vrx_mj.constants import EARLY
from vrx_mj.control.buoy_map import (
    Cluster,
    banks,
    camera_ahead,
    connected_groups,
    cutout,
    lidar_points,
    middle_part,
    standing_free,
)
from vrx_mj.control.guidance import wrap_angle
from vrx_mj.control.navigation import Estimate, Place, Point, beside, in_axes, nearest
from vrx_mj.control.pilot import Moment
from vrx_mj.runtime.timing import Pause

_COLORS = ("red", "green", "blue", "yellow")
"""Colours of symbols and lamps."""
_PANEL_BOTTOM, _PANEL_TOP = 0.9, 3.8
"""Heights above the boat's origin [m] between which panels are searched for: free of docks and buoys, not above
panels."""
_NEAR_RANGE, _MIN_HEIGHT = 18.0, 0.9
"""Within this distance [m] a panel shows at least this much of its height [m]; if less, it is something lower."""
_MIN_PANEL_WIDTH, _MAX_PANEL_WIDTH = 1.4, 2.5
"""Least and largest width of a panel [m]: VRX's are 2 m wide."""
_PLANE_TOLERANCE = 0.12
"""Largest distance of returns from their plane [m]: the lidar errs by 1 cm, and the dock rolls."""
_PLANE_SHARE = 0.6
"""Least share of the returns that must lie on the plane: the rest may be of the panel behind."""
_PLANE_SAMPLES = 10
"""Number of returns through which planes are fitted."""
_MATCH_RADIUS = 1.2
"""Faces within this distance [m] that look the same way are one."""
_LOOK_WEIGHT = 0.3
"""Weight of the last look in the mean position of a face."""
_MIN_SATURATION = 0.55
"""Least saturation of a symbol or a lamp: that of water is 0.3, of panels below 0.1. Fog of half the depth of colour
halves it: there a symbol is read from nearer."""
_MIN_BRIGHTNESS = 40.0
"""Brightness, of 255, below which a pixel has no colour."""
_SIDE_SLOPES = tuple(np.linspace(-0.3, 0.3, 9))
"""Slopes that the sides of symbols may have in a picture, in waves."""

OFF = "off"
"""Value of `lamp_color` for a dark lamp."""
_MIN_LAMP_PIXELS = 4
"""Least number of pixels of one colour of a lit lamp."""
_LAMP_PURITY = 0.6
"""Least share of the vivid pixels that have the lamp's colour."""
_PART_GAP = 0.07
"""Share of the picture's height, 2.8 m, that separates two things: lamp and box are 0.4 m apart."""
_LIDAR_PERIOD = 0.5
"""Time between two looks with the lidar [s]."""
_PICTURE_PERIOD = 1.0
"""Time between two pictures of placards [s]."""
_LIGHTS_PERIOD = 0.4
"""Time between two pictures of the lights [s]: two or three in each colour's second."""
_LIDAR_RANGE = 120.0
"""Lidar returns from further off than this [m] are not used."""
_READING_RANGE = (5.0, 45.0)
"""Distances between which a symbol is read [m]: nearer it does not fit into the picture, further off it is 15
pixels."""
_PLAIN_VIEW_DISTANCE = 25.0
"""Distance at which a symbol is read in all of VRX's fogs [m]."""
_MAX_READING_ANGLE = 1.0
"""Largest angle from its axis at which a placard is read [rad]."""
_HALF_FIELD = 0.6
"""Half the angle [rad] in which something is well inside the picture: VRX's camera sees 0.7 to either side."""
_ENOUGH_READINGS, _MAX_LOOKS = 5, 12
"""Number of symbols read after which a placard is known, and of pictures without one after which it is not read
again."""
_GLANCES = 7
"""Pictures after which a tower is known to be lit or not: the period is 5 s, of which 2 s are dark."""
_PANEL_HALF_SIZE = (1.1, 1.4)
"""Half the width and height of the part of a placard that is examined, about `_PANEL_HEIGHT` [m]."""
_PANEL_HEIGHT = 1.9
"""Height of the middle of a symbol [m]: 1.5 in 2022, 2.35 in 2018, with half a metre to either side."""
_LAMP_HEIGHT = 1.3
"""Height above water of the middle between a light buoy's lamps, at 1.6, and the box below them, at 0.9 [m]: VRX's."""
_LAMP_HALF_SIZE = (0.35, 1.4)
"""Half the width and height of the part of a picture that is examined there [m]: the buoy, 0.5 m up or down in
waves."""
_LAMP_SIGHT_RANGE = 60.0
"""Distance within which the boat looks for a lit lamp in passing [m]."""
_LAMP_PLAIN_DISTANCE = 35.0
"""Something that shows no colours within this distance [m] is no light buoy, in any of VRX's fogs."""
_MIN_TOWER_TOP, _MAX_TOWER_TOP = 1.15, 3.2
"""Least and largest height of a light buoy's top [m]: VRX's is 2.5, and a lidar may miss its top."""
_MAX_TOWER_WIDTH = 2.6
"""Largest width of a light buoy [m]: VRX's float is 1.6 m square."""
_DOUBT_LOOKS = 20.0
"""A tower seen this many times counts as twice as far off as it is; see `Tower.far`."""
_SHORE_GAP = 4.0
"""Least distance of a light buoy from everything wider [m]."""
_DARK_TIME, _WATCHING_TIME = 7.0, 20.0
"""A tower that stays dark for `_DARK_TIME` [s], or shows no three colours in `_WATCHING_TIME` [s], is no light buoy:
its period is 5 s."""
_BANK_CELL, _BANK_MEMORY, _BANK_REACH = 2.0, 20.0, 25.0
"""Side of the cells in which places of banks are kept [m], for how long [s], and within which distance [m]. A flat
beach near by is under the lidar's lowest ring."""


@dataclass
class Face(Place):
    """One side of a panel."""

    x: float
    """Position of its middle, along x [m]."""
    y: float
    """Position of its middle, along y [m]."""
    facing: float
    """Direction away from it [rad]."""
    seen: int = 1
    """Number of looks that saw it."""
    looks: int = 0
    """Number of looks through a camera from near."""
    tried: float = 0.0
    """Time spent on trying to see it from in front [s]."""
    votes: Counter[str] = field(default_factory=Counter)
    """Symbols read."""

    def is_like(self, other: "Face") -> bool:
        """Whether another is in the same place and looks the same way."""
        return math.dist(self.place, other.place) < _MATCH_RADIUS and math.cos(self.facing - other.facing) >= 0.5

    def note(self, symbol: str, *, near: bool = True) -> None:
        """Count a look from `near`, and the symbol that was read, if any: from afar haze may hide it."""
        self.looks += near
        if symbol:
            self.votes[symbol] += 1

    @property
    def symbol(self) -> str:
        """The symbol, as red_circle; empty where none was read twice."""
        best = self.votes.most_common(1)
        return best[0][0] if best and best[0][1] >= 2 else ""

    def ahead(self, distance: float, left: float = 0.0) -> Point:
        """The place at a distance [m] in front of it and `left` [m] of its normal, seen along that."""
        return beside(self.place, self.facing, distance, left)

    def offset(self, x: float, y: float) -> tuple[float, float]:
        """Distances of a place in front of it and to the left [m], the inverse of `ahead`."""
        return in_axes(self.facing, x - self.x, y - self.y)


class FaceMap:
    """The faces met so far."""

    def __init__(self) -> None:
        self.faces: list[Face] = []

    def see(self, here: Point, found: list[Face]) -> None:
        """Add the faces of one look from `here` [m], to which their places are relative."""
        for face in found:
            face.x, face.y = face.x + here[0], face.y + here[1]
            known = nearest(self.faces, face.place)
            if known is None or not known.is_like(face):
                known = next((other for other in self.faces if other.is_like(face)), None)
            if known is None:
                self.faces.append(face)
                continue
            known.x += _LOOK_WEIGHT * (face.x - known.x)
            known.y += _LOOK_WEIGHT * (face.y - known.y)
            known.facing += _LOOK_WEIGHT * math.remainder(face.facing - known.facing, math.tau)
            known.seen += 1


def faces(points: FloatArray) -> list[Face]:
    """The faces of panels among level returns, (n, 3) [m] from the boat's origin; each faces the boat."""
    high = points[points[:, 2] > _PANEL_BOTTOM]
    found = [_face(part) for part in connected_groups(high) if len(part) >= 5]
    return [face for face in found if face is not None]


def _face(points: FloatArray) -> Face | None:
    """The face of a panel; None of anything else."""
    level, heights = points[:, :2], points[:, 2]
    if heights.max() > _PANEL_TOP or (np.hypot(*level.mean(axis=0)) < _NEAR_RANGE and np.ptp(heights) < _MIN_HEIGHT):
        return None
    on_it = _on_a_line(level)
    if on_it.mean() < _PLANE_SHARE:
        return None
    level = level[on_it]
    middle = level.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((level - level.mean(axis=0)).T))
    along, normal = axes[:, 1], axes[:, 0]
    spread = (level - middle) @ along
    width = float(spread.max() - spread.min())
    if not _MIN_PANEL_WIDTH < width < _MAX_PANEL_WIDTH:
        return None
    x, y = middle + along * (spread.max() + spread.min()) / 2.0
    if normal @ (x, y) > 0.0:
        normal = -normal
    return Face(float(x), float(y), math.atan2(float(normal[1]), float(normal[0])))


def _on_a_line(level: FloatArray) -> BoolArray:
    """Which of the points, (n, 2) [m], lie on the line that most do: of two panels back to back one is seen whole.

    Lines are tried through pairs of points that are far apart in the order of their direction from the boat.
    """
    order = np.argsort(np.arctan2(level[:, 1], level[:, 0]), kind="stable")
    picked = level[order[np.linspace(0, len(level) - 1, min(len(level), _PLANE_SAMPLES)).round().astype(int)]]
    best = np.zeros(len(level), bool)
    for row, one in enumerate(picked):
        for other in picked[row + 1 :]:
            gap = float(np.hypot(*(other - one)))
            if gap > _MIN_PANEL_WIDTH / 2.0:
                east, north = (other - one) / gap
                close = np.abs((level[:, 1] - one[1]) * east - (level[:, 0] - one[0]) * north) < _PLANE_TOLERANCE
                if close.sum() > best.sum():
                    best = close
    return best


def _vivid(pixels: ByteArray, *, lead: float = _MIN_SATURATION) -> IntArray:
    """The colour of pixels, (..., 3) of 0 to 255: its number in red, green, blue, yellow, or -1 for none of them."""
    seen = np.asarray(pixels, np.float64)
    red, green, blue = seen[..., 0], seen[..., 1], seen[..., 2]
    most, least = seen.max(axis=-1), seen.min(axis=-1)
    gap = np.maximum(most - least, 1e-9)
    middle = (red + green + blue - most - least - least) / gap  # of the second channel, between the others
    code = seen.argmax(axis=-1)
    yellow = (blue == least) & (middle > 0.6)
    pure = (middle < 0.6) | yellow
    code = np.where(yellow, 3, code)
    return np.where((gap > lead * most) & (most > _MIN_BRIGHTNESS) & pure, code, -1)


def _counts(codes: IntArray) -> list[int]:
    """Numbers of pixels of each colour."""
    return [int((codes == code).sum()) for code in range(len(_COLORS))]


def symbol_in(window: ByteArray, *, lead: float = _MIN_SATURATION) -> str:
    """The symbol in a picture of a placard, as red_circle; empty without one.

    The colour is that of most vivid pixels, the shape follows from how much of its bounding box it fills (rectangle
    all, circle pi/4, cross 0.56, triangle 1/2) and, of the last two, from whether its upper third is as wide as the
    lower.
    """
    codes = _vivid(window, lead=lead)
    counts = _counts(codes)
    color = int(np.argmax(counts))
    if counts[color] < 60:
        return ""
    mask = middle_part(codes == color)
    rows, columns = np.nonzero(mask.sum(axis=1) > 1)[0], np.nonzero(mask.sum(axis=0) > 1)[0]
    if len(rows) < 8 or len(columns) < 5:
        return ""
    mask = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    shape = _shape(mask)
    return f"{_COLORS[color]}_{shape}" if shape else ""


def _fill(mask: BoolArray) -> float:
    """How much a mask fills of the parallelogram about it: seen from aside by a boat that rolls, a square is one."""
    down, right = np.nonzero(mask)
    heights = {lean: np.ptp(down + lean * right) + 1.0 for lean in _SIDE_SLOPES}
    widths = {lean: np.ptp(right + lean * down) + 1.0 for lean in _SIDE_SLOPES}
    areas = [heights[one] * widths[other] / (1.0 - one * other) for one in _SIDE_SLOPES for other in _SIDE_SLOPES]
    return len(down) / float(min(areas))


def _shape(mask: BoolArray) -> str:
    """Shape of a mask that fills its box from side to side."""
    fill = _fill(mask)
    third = max(1, len(mask) // 3)
    upper, lower = float(mask[:third].mean()), float(mask[-third:].mean())
    if fill > 0.88:
        return "rectangle"
    if fill > 0.68:
        return "circle"
    if fill < 0.35:
        return ""
    return "triangle" if upper < 0.6 * lower else "cross"


def lamp_color(window: ByteArray) -> str:
    """The colour of the lamps in a picture of a light buoy, or `OFF`.

    Under its lamps the buoy carries a yellow box, so the upper one of two coloured things is a lamp, and something
    yellow alone is none. So nothing need be known of how high the buoy floats, nor of how waves lift it and the boat.
    """
    codes = _vivid(window)
    rows = np.nonzero((codes >= 0).any(axis=1))[0]
    parts = [codes[part] for part in np.split(rows, np.nonzero(np.diff(rows) > _PART_GAP * len(codes))[0] + 1)]
    colors = [color for color in map(_color, parts) if color]
    return colors[0] if len(colors) > 1 or colors[:1] not in ([], ["yellow"]) else OFF


def _color(codes: IntArray) -> str:
    """The colour of most of the vivid pixels; empty without any."""
    counts = _counts(codes)
    most = int(np.argmax(counts))
    return _COLORS[most] if counts[most] >= max(_MIN_LAMP_PIXELS, _LAMP_PURITY * sum(counts)) else ""


def sequence(seen: Sequence[tuple[float, str]]) -> list[str] | None:
    """The three colours between two darks, from looks at a time [s] each; None until they were seen.

    Looks must come at least three in two seconds; a colour that only one look showed counts, as long as three different
    ones in a row lie between the darks and the whole lasts 2 to 4 s.
    """
    runs: list[tuple[str, float]] = []
    for time, color in seen:
        if not runs or runs[-1][0] != color:
            runs.append((color, time))
    for start in range(len(runs) - 4):
        (before, _), *lit, (after, end) = runs[start : start + 5]
        colors = [color for color, _ in lit]
        if before == after == OFF and OFF not in colors and 2.0 <= end - lit[0][1] <= 4.0:
            return colors
    return None


@dataclass
class Tower:
    """Something narrow and high that may be a light buoy."""

    place: Point
    """Where it stands [m]."""
    seen: int = 1
    """How often the lidar saw it."""
    looks: int = 0
    """How often it was looked at in passing."""
    colors: set[str] = field(default_factory=set)
    """Colours seen when it was looked at in passing."""
    since: float = math.inf
    """Time at which the boat first went to it [s]."""
    shows: list[tuple[float, str]] = field(default_factory=list)
    """Times [s] and colours of the looks at the light."""
    rejected: bool = False
    """Whether it was found to be no light buoy."""

    @property
    def is_lit(self) -> bool:
        """Whether it showed two colours: trees and stones, in the light of the evening, show one at most."""
        return len(self.colors) > 1

    def far(self, seen: Estimate) -> float:
        """Distance to it [m], increased if it was seldom seen: on a shore a lidar sees different stones each time."""
        return seen.to(*self.place)[0] * (1.0 + _DOUBT_LOOKS / self.seen)


class DockLookout:
    """Keeps a map of placards and of towers, in the local frame of the boat's navigation."""

    def __init__(self) -> None:
        self._map, self._towers = FaceMap(), list[Tower]()
        self._banks: dict[tuple[int, int], float] = {}
        self._look_pause, self._picture_pause = Pause(EARLY), Pause(EARLY)

    @property
    def faces(self) -> list[Face]:
        """Faces that may be placards: seen more than three times."""
        return [face for face in self._map.faces if face.seen > 3]

    @property
    def towers(self) -> list[Tower]:
        """Towers that may be light buoys: seen more than three times, not rejected, and not the edge of a placard."""
        known = [tower for tower in self._towers if tower.seen > 3 and not tower.rejected]
        return [tower for tower in known if all(math.dist(tower.place, face.place) > 2.5 for face in self._map.faces)]

    @property
    def banks(self) -> list[Point]:
        """Where the lidar saw something near by of late [m]."""
        return [(_BANK_CELL * column, _BANK_CELL * row) for column, row in self._banks]

    def look(self, now: Moment, *, near_only: bool = False) -> None:
        """Look, if it is time to; with `near_only` only for faces within 30 m, as when the bay is found."""
        seen, t = now.seen, now.t
        points = lidar_points(now, self._look_pause, _LIDAR_PERIOD, reach=30.0 if near_only else _LIDAR_RANGE)
        if points is None:
            return
        self._map.see(seen.place, faces(points))
        if near_only:
            return
        self._note_banks(points, seen, t)
        free, wide = standing_free(points, high=4.0, widest=_MAX_TOWER_WIDTH, apart=_SHORE_GAP)
        for cluster in free:
            self._note_tower(cluster, seen)
        for tower in self._towers:
            east, north = tower.place[0] - seen.x, tower.place[1] - seen.y
            if len(wide) and float(np.hypot(wide[:, 0] - east, wide[:, 1] - north).min()) < _SHORE_GAP:
                tower.seen = max(1, tower.seen - 1)
        if self._picture_pause.is_over(t):
            self._read_signs(now)

    def watch(self, now: Moment, tower: Tower) -> list[str] | None:
        """Take one more look at a tower's lamps, if it is time to; the three colours once they are known."""
        boat, seen, _, t = now
        shows, camera = tower.shows, camera_ahead(boat)
        if shows and t < shows[-1][0] + _LIGHTS_PERIOD - 1e-6:
            return None
        if camera is None:
            tower.rejected = True
            return None
        window = cutout(boat.sensors[camera], seen, (*tower.place, _LAMP_HEIGHT), _LAMP_HALF_SIZE)
        shows.append((t, lamp_color(window) if window is not None else OFF))
        tower.colors |= {shows[-1][1]} - {OFF}
        tower.rejected = t - shows[0][0] > (_WATCHING_TIME if tower.is_lit else _DARK_TIME)
        return sequence(shows)

    def _note_tower(self, cluster: Cluster, seen: Estimate) -> None:
        if not _MIN_TOWER_TOP < cluster.top < _MAX_TOWER_TOP:
            return
        place = (seen.x + cluster.x, seen.y + cluster.y)
        for tower in self._towers:
            if math.dist(tower.place, place) < 1.5:
                tower.place, tower.seen = place, tower.seen + 1
                return
        self._towers.append(Tower(place))

    def _note_banks(self, points: FloatArray, seen: Estimate, t: float) -> None:
        for x, y in banks(points, seen.place, cell=_BANK_CELL):
            self._banks[round(x / _BANK_CELL), round(y / _BANK_CELL)] = t
        self._banks = {
            (column, row): when
            for (column, row), when in self._banks.items()
            if seen.to(column * _BANK_CELL, row * _BANK_CELL)[0] < _BANK_REACH and t - when < _BANK_MEMORY
        }

    def _read_signs(self, now: Moment) -> None:
        """Read the symbols that can be read from here, and see which towers are lit."""
        boat, seen, _, t = now
        signs = [face for face in self._map.faces if _legible(face, seen)]
        towers = [one for one in self.towers if not one.is_lit and one.looks < _GLANCES and _in_view(one, seen)]
        camera = camera_ahead(boat)
        if not (signs or towers) or camera is None:
            return
        self._picture_pause.begin(t, _PICTURE_PERIOD)
        reading = boat.sensors[camera]
        for face in signs:
            window = cutout(reading, seen, (face.x, face.y, _PANEL_HEIGHT), _PANEL_HALF_SIZE)
            if window is not None:
                face.note(symbol_in(window), near=seen.to(*face.place)[0] < _PLAIN_VIEW_DISTANCE)
        for tower in towers:
            window = cutout(reading, seen, (*tower.place, _LAMP_HEIGHT), _LAMP_HALF_SIZE)
            if window is not None:
                tower.looks += seen.to(*tower.place)[0] < _LAMP_PLAIN_DISTANCE
                tower.colors |= {lamp_color(window)} - {OFF}
                tower.rejected = tower.looks >= _GLANCES and not tower.is_lit


def _legible(face: Face, seen: Estimate) -> bool:
    distance, bearing = seen.to(*face.place)
    if not _READING_RANGE[0] < distance < _READING_RANGE[1] or abs(wrap_angle(bearing - seen.heading)) > _HALF_FIELD:
        return False
    unread = sum(face.votes.values()) < _ENOUGH_READINGS and face.looks < _MAX_LOOKS
    return unread and abs(wrap_angle(bearing + math.pi - face.facing)) < _MAX_READING_ANGLE


def _in_view(tower: Tower, seen: Estimate) -> bool:
    distance, bearing = seen.to(*tower.place)
    return distance < _LAMP_SIGHT_RANGE and abs(wrap_angle(bearing - seen.heading)) < _HALF_FIELD
