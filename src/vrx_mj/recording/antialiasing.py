"""Smooth edges in a picture that was drawn with one sample per pixel, in a tenth of the time of four samples."""

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray
from vrx_mj.physics.kernel import kernel

__all__ = ["antialias"]

CONTRAST, LEAST = 8, 48
"""An edge has a range of brightness of the brightest over this, and at least this [of 1020]."""
REACH = 8.0
"""Pixels along an edge over which it is smoothed, at most."""


@kernel
def antialias(drawn: ByteArray, luma: npt.NDArray[np.int16], out: ByteArray) -> None:
    """Write `drawn` (height, width, 3), whose first row is the lowest, into `out`, first row highest, edges smoothed.

    FXAA (Lottes, 2009): where brightness changes much, two or four places along the edge are averaged. `luma`
    (height, width) is overwritten with the brightness, 0 to 1020.
    """
    height, width = drawn.shape[0], drawn.shape[1]
    for row in range(height):
        source, bright, target = drawn[row], luma[row], out[height - 1 - row]
        for column in range(width):
            target[column, 0], target[column, 1], target[column, 2] = (
                source[column, 0],
                source[column, 1],
                source[column, 2],
            )
            bright[column] = np.int16(source[column, 0]) + 2 * np.int16(source[column, 1]) + np.int16(source[column, 2])
    for row in range(1, height - 1):
        below, here, above, target = luma[row - 1], luma[row], luma[row + 1], out[height - 1 - row]
        for column in range(1, width - 1):
            a, b, c, d = below[column - 1], below[column + 1], above[column - 1], above[column + 1]
            low, high = min(a, b, c, d, here[column]), max(a, b, c, d, here[column])
            if high - low > max(LEAST, high // CONTRAST):
                _smooth(drawn, row, column, float(a + b - c - d), float(b + d - a - c), low, high, target[column])


@kernel
def _smooth(
    drawn: ByteArray, row: int, column: int, along: float, across: float, low: int, high: int, out: ByteArray
) -> None:
    """Write the mean along an edge into a pixel `out` (3,): of four places, if it is in the range of brightness."""
    scale = max(min(abs(along), abs(across)) + (abs(along) + abs(across)) / 32.0, 1.0)
    x, y = min(max(along / scale, -REACH), REACH), min(max(across / scale, -REACH), REACH)
    bright = 0.0
    for channel in range(3):
        near = _at(drawn, row - y / 6.0, column - x / 6.0, channel) + _at(
            drawn, row + y / 6.0, column + x / 6.0, channel
        )
        far = _at(drawn, row - y / 2.0, column - x / 2.0, channel) + _at(
            drawn, row + y / 2.0, column + x / 2.0, channel
        )
        out[channel] = np.uint8(near / 4.0 + far / 4.0 + 0.5)
        bright += (1 + channel % 2) * out[channel]
    if bright < low or bright > high:
        for channel in range(3):
            near = _at(drawn, row - y / 6.0, column - x / 6.0, channel)
            near += _at(drawn, row + y / 6.0, column + x / 6.0, channel)
            out[channel] = np.uint8(near / 2.0 + 0.5)


@kernel
def _at(drawn: ByteArray, row: float, column: float, channel: int) -> float:
    """Return a channel of a picture between its pixels, bilinearly."""
    row = min(max(row, 0.0), drawn.shape[0] - 1.001)
    column = min(max(column, 0.0), drawn.shape[1] - 1.001)
    i, j = int(row), int(column)
    s, t = row - i, column - j
    first = (1.0 - t) * drawn[i, j, channel] + t * drawn[i, j + 1, channel]
    second = (1.0 - t) * drawn[i + 1, j, channel] + t * drawn[i + 1, j + 1, channel]
    return float((1.0 - s) * first + s * second)
