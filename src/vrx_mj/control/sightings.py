"""What floats before the boat, found in a picture: by colour against the water, and how far by its known size."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.control.clusters import CELL, grouped

__all__ = ["OLD", "SYDNEY", "Blob", "Kind", "blobs", "kind_of"]

STEP = 2
"""Every so many pixels one is looked at; a ball of 0.5 m at 15 m is 25 pixels wide."""
COLORED = 0.45
"""Least part of the brightest channel by which the darkest falls short: water has 0.7, but is blue."""
BRIGHT, ABOVE = 90.0, 100.0
"""White: least value of the darkest channel, and how much brighter than the water all three are together."""
DARK, BELOW = 55.0, 30.0
"""Black: largest value of the brightest channel, and how much darker than the water all three are together."""
FLAT = 0.5
"""Height over width below which something is a streak of foam or light on a wave."""
BOWS = 0.72
"""Below this share of the picture's height are the boat's own bows."""
SMALL = 12
"""Fewest looked-at pixels of a thing."""
ORANGE = 0.09
"""Green less blue over red less blue from which red is orange: VRX's red has 0, its orange 0.19."""
PALE = 0.3
"""Darkest over brightest channel from which a colour is pale: the cans of 2019 have 0.4 and 0.6, totems 0."""
NOTHING, RED, ORANGES, GREEN, BLUE, YELLOW, WHITE, BLACK = range(8)
NAMES = ("", "red", "orange", "green", "blue", "yellow", "white", "black")


@dataclass(frozen=True)
class Blob:
    """A thing in a picture [pixels]."""

    color: str
    column: float
    """Of its middle."""
    row: float
    """Of its middle, from the top."""
    width: float
    height: float
    pale: bool
    """Whether its colour is a pale one."""


@dataclass(frozen=True)
class Kind:
    """What something is."""

    type: str
    """As the task calls it."""
    width: float
    """[m]"""


OLD = "2019"
"""The catalogue of VRX 2019, at Sand Island."""
SYDNEY = "2022"
"""The catalogue of VRX 2022 and 2023."""
MARKERS: dict[str, dict[str, Kind]] = {
    SYDNEY: {color: Kind(f"mb_marker_buoy_{color}", 0.65) for color in ("red", "green", "white", "black")},
    OLD: {
        **{color: Kind(f"{color}_totem", 0.28) for color in ("red", "green", "blue", "yellow", "black")},
        "white": Kind("surmark46104", 0.45),
    },
}
"""What stands up, by colour; widths from VRX's models."""
CANS = {"red": Kind("surmark950410", 0.46), "green": Kind("surmark950400", 0.46)}
"""Of 2019, in pale colours."""
BALLS: dict[str, dict[str, tuple[Kind, ...]]] = {
    SYDNEY: {"orange": (Kind("mb_round_buoy_orange", 0.51),), "black": (Kind("mb_round_buoy_black", 0.51),)},
    OLD: {"black": (Kind("polyform_a3", 0.432), Kind("polyform_a5", 0.686), Kind("polyform_a7", 0.991))},
}
"""What is round, by colour."""
STANDING = 1.25
"""Height over width from which something stands up."""


def kind_of(blob: Blob, catalogue: str, scale: float | None = None) -> Kind | None:
    """What a blob is; None if nothing in the catalogue looks like it.

    Of balls of several sizes that one is taken that has the blob's width at the `scale` [pixels/m], or the middle one.
    """
    stands = blob.height > STANDING * blob.width
    balls = BALLS[catalogue].get(blob.color, ())
    if balls and (not stands or blob.color == "orange"):
        if scale is None:
            return balls[len(balls) // 2]
        return min(balls, key=lambda kind: abs(kind.width - blob.width / scale))
    if catalogue == OLD and blob.pale and blob.color in CANS:
        return CANS[blob.color]
    return MARKERS[catalogue].get(blob.color)


def blobs(picture: ByteArray, horizon: float) -> list[Blob]:
    """The things in a picture (height, width, 3) below a row, the largest first; not the boat's own bows."""
    first, last = max(0, int(horizon)) // STEP * STEP, int(BOWS * picture.shape[0])
    part = picture[first:last:STEP, ::STEP].astype(np.float64)
    if not part.size:
        return []
    water = np.median(part, axis=1)[:, None, :]
    kinds = _kinds(part, np.broadcast_to(water, part.shape))
    found = [blob for kind in range(1, len(NAMES)) for blob in _of_kind(kinds, kind, part)]
    found = [_placed(blob, first) for blob in sorted(found, key=lambda blob: -blob.width * blob.height)]
    return [blob for blob in _joined(found) if blob.height > FLAT * blob.width]


def _kinds(pixels: FloatArray, water: FloatArray) -> npt.NDArray[np.int_]:
    """The colour of each pixel, as a number."""
    red, green, blue = (pixels[..., channel] for channel in range(3))
    most, least = pixels.max(axis=-1), pixels.min(axis=-1)
    lighter = (pixels - water).sum(axis=-1)
    strong = (most - least > COLORED * most) & (most > 30.0)
    reddish = strong & (red == most)
    orange = green - blue > ORANGE * (red - blue)
    yellow = green - blue > 0.6 * (red - blue)
    greenish = (green == most) & (green - np.maximum(red, blue) > 0.12 * most) & (most > 25.0)
    bluish = strong & (blue == most) & (blue - green > 0.6 * blue) & (lighter > 0.0)
    kinds = np.zeros(most.shape, int)
    kinds[(least > BRIGHT) & (lighter > ABOVE) & ~strong] = WHITE
    kinds[(most < DARK) & (lighter < -BELOW) & (blue - red < 0.45 * blue + 8.0)] = BLACK
    kinds[bluish] = BLUE
    kinds[greenish] = GREEN
    kinds[reddish] = RED
    kinds[reddish & orange] = ORANGES
    kinds[(reddish | (strong & (green == most))) & yellow & (red > 0.5 * green)] = YELLOW
    return kinds


def _of_kind(kinds: npt.NDArray[np.int_], kind: int, pixels: FloatArray) -> list[Blob]:
    rows, columns = np.nonzero(kinds == kind)
    if len(rows) < SMALL:
        return []
    half = CELL / 2.0  # pixels within two of each other belong together
    groups = grouped(np.stack([columns, rows], axis=1).astype(np.float64) * half)
    return [_blob(np.rint(group / half).astype(int), NAMES[kind], pixels) for group in groups if len(group) >= SMALL]


def _blob(places: npt.NDArray[np.int_], color: str, pixels: FloatArray) -> Blob:
    (left, top), (right, bottom) = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    typical = np.median(pixels[places[:, 1], places[:, 0]], axis=0)
    pale = bool(typical.min() > PALE * typical.max())
    return Blob(color, (left + right) / 2.0, (top + bottom) / 2.0, right - left + 1.0, bottom - top + 1.0, pale)


def _placed(blob: Blob, first: int) -> Blob:
    """The same in pixels of the whole picture."""
    column, row = blob.column * STEP + (STEP - 1) / 2.0, blob.row * STEP + first + (STEP - 1) / 2.0
    return Blob(blob.color, column, row, blob.width * STEP, blob.height * STEP, blob.pale)


def _joined(found: list[Blob]) -> list[Blob]:
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
