"""A boat's camera as a control law uses it: which one looks ahead, and what of its picture shows a place."""

from typing import TYPE_CHECKING, Any

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.control.navigation import Estimate, sensor_named
from vrx_mj.control.pictures import project

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["camera_ahead", "cutout", "intrinsics", "mounting"]


def camera_ahead(boat: "BoatObservation") -> str | None:
    """The camera that looks ahead: one named so, as VRX's two, or else the first; None on a boat without."""
    return sensor_named(boat, "front") or sensor_named(boat, "camera")


def mounting(reading: Any) -> tuple[FloatArray, FloatArray]:
    """Where a sensor's link is on the boat: position (3,) [m] and rotation (3, 3) to the body frame."""
    return np.asarray(reading.mount.position), np.asarray(reading.mount.rotation)


def intrinsics(reading: Any) -> FloatArray:
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
