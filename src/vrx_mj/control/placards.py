"""Placards of docks: upright panels, found by the lidar, and the coloured symbols on them, read through a camera."""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, ByteArray, FloatArray
from vrx_mj.control.clusters import grouped
from vrx_mj.control.guidance import Point
from vrx_mj.control.pictures import middle_part

__all__ = ["Face", "FaceMap", "faces", "symbol_in", "vivid"]

COLORS = ("red", "green", "blue", "yellow")
LOW, HIGH = 0.9, 3.8
"""From what height above the boat's origin [m] a panel is seen free of docks and buoys, and what it does not exceed."""
NEAR, TALL = 18.0, 0.9
"""Within that distance [m] a panel shows at least so much of its height [m], or it is something lower."""
NARROW, WIDE = 1.4, 2.5
"""Of a panel [m]: VRX's are 2 m wide."""
THICK = 0.12
"""Returns of a plane lie at most so far off it [m]: the lidar errs by 1 cm, and the dock rolls."""
MOST = 0.6
"""Share of the returns that must lie on it: the rest may be of the panel behind."""
PICKED = 10
"""Through so many of the returns planes are laid."""
SAME = 1.2
"""Faces nearer than this [m] that look the same way are one."""
SHARE = 0.3
"""Weight of the last look in a face's place."""
VIVID = 0.55
"""Share of the brightest channel by which a symbol's or a lamp's colour leads; 0.3 of water, below 0.1 of panels.

Fog of half the depth of colour halves it: there a symbol is read from nearer."""
FAINT = 40.0
"""Of 255: what is darker has no colour."""
LEANS = tuple(np.linspace(-0.3, 0.3, 9))
"""Slopes that the sides of symbols may have in a picture, in waves."""


@dataclass
class Face:
    """One side of a panel."""

    x: float
    """Of its middle [m]."""
    y: float
    """[m]"""
    facing: float
    """Direction away from it [rad]."""
    seen: int = 1
    """How often."""
    looks: int = 0
    """How often it was looked at through a camera from near."""
    tried: float = 0.0
    """For how long it was tried to see it from before [s]."""
    votes: Counter[str] = field(default_factory=Counter)
    """Symbols read."""

    @property
    def place(self) -> Point:
        """Where its middle is [m]."""
        return self.x, self.y

    def note(self, symbol: str, *, near: bool = True) -> None:
        """It was looked at, and this symbol read, or none; from afar that says little, in haze."""
        self.looks += near
        if symbol:
            self.votes[symbol] += 1

    @property
    def symbol(self) -> str:
        """The symbol, as red_circle; empty where none was read twice."""
        best = self.votes.most_common(1)
        return best[0][0] if best and best[0][1] >= 2 else ""

    def ahead(self, distance: float, left: float = 0.0) -> Point:
        """The place at a distance [m] before it, and to the left of who looks away from it."""
        cos, sin = math.cos(self.facing), math.sin(self.facing)
        return self.x + distance * cos - left * sin, self.y + distance * sin + left * cos

    def offset(self, x: float, y: float) -> tuple[float, float]:
        """How far a place is before it and to its left [m], as `ahead` has them."""
        cos, sin = math.cos(self.facing), math.sin(self.facing)
        return (x - self.x) * cos + (y - self.y) * sin, (y - self.y) * cos - (x - self.x) * sin


class FaceMap:
    """The faces met so far."""

    def __init__(self) -> None:
        self.faces: list[Face] = []

    def see(self, here: Point, found: list[Face]) -> None:
        """Take the faces of one look from `here` [m]; their places are relative to it."""
        for face in found:
            face.x, face.y = face.x + here[0], face.y + here[1]
            known = min(self.faces, key=lambda other: math.dist(other.place, face.place), default=None)
            if known is None or math.dist(known.place, face.place) > SAME or math.cos(known.facing - face.facing) < 0.5:
                near = [f for f in self.faces if math.dist(f.place, face.place) < SAME]
                known = next((f for f in near if math.cos(f.facing - face.facing) >= 0.5), None)
            if known is None:
                self.faces.append(face)
                continue
            known.x += SHARE * (face.x - known.x)
            known.y += SHARE * (face.y - known.y)
            known.facing += SHARE * math.remainder(face.facing - known.facing, math.tau)
            known.seen += 1


def faces(points: FloatArray) -> list[Face]:
    """The faces of panels among level returns, (n, 3) [m] from the boat's origin; each faces the boat."""
    high = points[points[:, 2] > LOW]
    found = [_face(part) for part in grouped(high) if len(part) >= 5]
    return [face for face in found if face is not None]


def _face(points: FloatArray) -> Face | None:
    """The face of a panel, or None of what is no panel."""
    level, heights = points[:, :2], points[:, 2]
    if heights.max() > HIGH or (np.hypot(*level.mean(axis=0)) < NEAR and np.ptp(heights) < TALL):
        return None
    on_it = _on_a_line(level)
    if on_it.mean() < MOST:
        return None
    level = level[on_it]
    middle = level.mean(axis=0)
    along, normal = _axes(level)
    spread = (level - middle) @ along
    width = float(spread.max() - spread.min())
    if not NARROW < width < WIDE:
        return None
    x, y = middle + along * (spread.max() + spread.min()) / 2.0
    if normal @ (x, y) > 0.0:
        normal = -normal
    return Face(float(x), float(y), math.atan2(float(normal[1]), float(normal[0])))


def _on_a_line(level: FloatArray) -> BoolArray:
    """Which of the points, (n, 2) [m], lie on the line that most do: of two panels back to back one is seen whole.

    Lines are tried through pairs of points that are far apart in the order of their direction from the boat.
    """
    order = np.argsort(np.arctan2(level[:, 1], level[:, 0]))
    picked = level[order[np.linspace(0, len(level) - 1, min(len(level), PICKED)).round().astype(int)]]
    best = np.zeros(len(level), bool)
    for row, one in enumerate(picked):
        for other in picked[row + 1 :]:
            gap = float(np.hypot(*(other - one)))
            if gap > NARROW / 2.0:
                east, north = (other - one) / gap
                close = np.abs((level[:, 1] - one[1]) * east - (level[:, 0] - one[0]) * north) < THICK
                if close.sum() > best.sum():
                    best = close
    return best


def _axes(level: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Directions along and across what points, (n, 2), make, unit vectors."""
    _, axes = np.linalg.eigh(np.cov((level - level.mean(axis=0)).T))
    return axes[:, 1], axes[:, 0]


def vivid(pixels: npt.ArrayLike, *, lead: float = VIVID) -> npt.NDArray[np.int_]:
    """The colour of pixels, (..., 3) of 0 to 255: its number in red, green, blue, yellow, or -1 where there is none."""
    seen = np.asarray(pixels, np.float64)
    red, green, blue = seen[..., 0], seen[..., 1], seen[..., 2]
    most, least = seen.max(axis=-1), seen.min(axis=-1)
    gap = np.maximum(most - least, 1e-9)
    middle = (red + green + blue - most - least - least) / gap  # of the second channel, between the others
    code = seen.argmax(axis=-1)
    yellow = (blue == least) & (middle > 0.6)
    pure = (middle < 0.6) | yellow
    code = np.where(yellow, 3, code)
    return np.where((gap > lead * most) & (most > FAINT) & pure, code, -1)


def symbol_in(window: ByteArray, *, lead: float = VIVID) -> str:
    """The symbol in a picture of a placard, as red_circle; empty if there is none.

    The colour is that of most vivid pixels, the shape follows from how much of its bounding box it fills (rectangle
    all, circle pi/4, cross 0.56, triangle 1/2) and, of the last two, from whether its upper third is as wide as the
    lower.
    """
    codes = vivid(window, lead=lead)
    counts = [int((codes == code).sum()) for code in range(len(COLORS))]
    color = int(np.argmax(counts))
    if counts[color] < 60:
        return ""
    mask = middle_part(codes == color)
    rows, columns = np.nonzero(mask.sum(axis=1) > 1)[0], np.nonzero(mask.sum(axis=0) > 1)[0]
    if len(rows) < 8 or len(columns) < 5:
        return ""
    mask = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    shape = _shape(mask)
    return f"{COLORS[color]}_{shape}" if shape else ""


def _fill(mask: BoolArray) -> float:
    """How much a mask fills of the parallelogram about it: seen from aside by a boat that rolls, a square is one."""
    down, right = np.nonzero(mask)
    heights = {lean: np.ptp(down + lean * right) + 1.0 for lean in LEANS}
    widths = {lean: np.ptp(right + lean * down) + 1.0 for lean in LEANS}
    areas = [heights[one] * widths[other] / (1.0 - one * other) for one in LEANS for other in LEANS]
    return len(down) / float(min(areas))


def _shape(mask: BoolArray) -> str:
    """Of a mask that fills its box from side to side."""
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
