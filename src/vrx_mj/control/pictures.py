"""What a camera shows of something whose place is known: its colour and its shape.

A buoy contrasts with the water around it, whatever the light and the fog; so what is judged is the difference
between the pixels that differ and the background, and how those lean towards one colour, not their brightness.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, ByteArray, FloatArray
from vrx_mj.control.navigation import Estimate, sensor_named

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation
    from vrx_mj.sensors.readings import Reading

_CONTRAST = 40.0
"""Sum over red, green and blue [of 255 each] by which a pixel of a thing differs from the background."""
_LEAN = 0.22
"""Share of the brightest channel by which one colour must lead."""
_DEEP = 0.45
"""Least saturation of blue, of which water has 0.1 to 0.3."""
_ORANGE = 0.13
"""Green over blue, as a share of red over blue, from which red is orange: 0 of VRX's red buoys, 0.19 of its orange."""


def camera_ahead(boat: "BoatObservation") -> str | None:
    """The camera that looks ahead: one named so, as VRX's two, or else the first; None on a boat without."""
    return sensor_named(boat, "front") or sensor_named(boat, "camera")


def mounting(reading: Any) -> tuple[FloatArray, FloatArray]:
    """Where a sensor's link is on the boat: position (3,) [m] and rotation (3, 3) to the body frame."""
    return np.asarray(reading.mount.position), np.asarray(reading.mount.rotation)


def intrinsics(reading: "Reading") -> FloatArray:
    """(3, 3) intrinsic matrix of a camera [pixels]."""
    return np.asarray(reading.data.info.K, np.float64).reshape(3, 3)


def cutout(
    reading: Any, seen: Estimate, place: tuple[float, float, float], half: tuple[float, float]
) -> ByteArray | None:
    """What of a picture shows a place, (rows, columns, 3); None if it is not in the picture as a whole.

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
    mask = middle_part(np.abs(off).sum(axis=2) > _CONTRAST)
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
    if most - least < _LEAN * most or most < 25.0:
        return ""
    if red == most:
        if green - blue > 0.6 * (red - blue):
            return "yellow"
        return "orange" if green - blue > _ORANGE * (red - blue) else "red"
    if green == most:
        return "yellow" if red - blue > 0.6 * (green - blue) else "green"
    return "blue" if blue - max(red, green) > _DEEP * blue else ""


def middle_part(mask: BoolArray) -> BoolArray:
    """What of a mask is joined, along columns and then along rows, to its most crowded ones near the middle."""
    columns = _middle_run(mask.sum(axis=0))
    part = np.zeros_like(mask)
    part[:, columns] = mask[:, columns]
    rows = _middle_run(part.sum(axis=1))
    whole = np.zeros_like(mask)
    whole[rows] = part[rows]
    return whole


def _middle_run(crowd: npt.NDArray[np.int_]) -> slice:
    """The run of numbers above 0 about the largest, those near the middle preferred."""
    middle = len(crowd) / 2.0 - 0.5
    weight = crowd * np.exp(-(((np.arange(len(crowd)) - middle) / (0.35 * len(crowd))) ** 2))
    low = high = int(np.argmax(weight))
    while low > 0 and crowd[low - 1] > 0:
        low -= 1
    while high < len(crowd) - 1 and crowd[high + 1] > 0:
        high += 1
    return slice(low, high + 1)
