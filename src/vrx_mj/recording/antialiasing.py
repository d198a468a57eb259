"""Smooth edges in a picture that was drawn with one sample per pixel, in a tenth of the time of four samples."""

import numpy as np

from vrx_mj.arrays import ByteArray
from vrx_mj.physics.kernel import inlined_kernel, kernel

_CONTRAST = 12
"""Range of green around a pixel, of 255, from which there is an edge."""
_REACH = 8.0
"""Pixels along an edge over which it is smoothed, at most."""


def antialias(drawn: ByteArray) -> ByteArray:
    """The picture (height, width, 3) with smooth edges, first row highest; the first row of `drawn` is the lowest.

    FXAA (Lottes, 2009): where brightness, here green, changes much, two or four places along the edge are averaged.
    """
    out, green = drawn[::-1].copy(), np.ascontiguousarray(drawn[..., 1])
    smooth(drawn, green, np.zeros(green.shape[1], np.uint8), np.zeros(green.shape[1], np.uint8), out)
    return out


@kernel
def smooth(drawn: ByteArray, green: ByteArray, low: ByteArray, high: ByteArray, out: ByteArray) -> None:
    """Write the means along edges into `out`; `low` and `high` (width,) are room for ranges of a row's green."""
    height, width = green.shape
    for row in range(1, height - 1):
        before, here, after = green[row - 1], green[row], green[row + 1]
        for i in range(1, width - 1):
            low[i] = min(before[i - 1], before[i + 1], here[i], after[i - 1], after[i + 1])
            high[i] = max(before[i - 1], before[i + 1], here[i], after[i - 1], after[i + 1])
        for i in range(1, width - 1):
            if high[i] - low[i] > _CONTRAST:
                a, b, c, d = float(before[i - 1]), float(before[i + 1]), float(after[i - 1]), float(after[i + 1])
                along, across = a + b - c - d, b + d - a - c
                scale = max(min(abs(along), abs(across)) + (abs(along) + abs(across)) / 32.0, 0.25)
                x, y = min(max(along / scale, -_REACH), _REACH), min(max(across / scale, -_REACH), _REACH)
                target = out[height - 1 - row, i]
                for share in (2.0, 6.0):  # of four places, or of the near two if that leaves the range
                    for channel in range(3):
                        near = _at(drawn, row - y / 6.0, i - x / 6.0, channel)
                        near += _at(drawn, row + y / 6.0, i + x / 6.0, channel)
                        far = _at(drawn, row - y / share, i - x / share, channel)
                        far += _at(drawn, row + y / share, i + x / share, channel)
                        target[channel] = np.uint8(0.25 * (near + far) + 0.5)
                    if low[i] <= target[1] <= high[i]:
                        break


@inlined_kernel
def _at(drawn: ByteArray, row: float, column: float, channel: int) -> float:
    """Return a channel of a picture between its pixels, bilinearly."""
    row = min(max(row, 0.0), drawn.shape[0] - 1.001)
    column = min(max(column, 0.0), drawn.shape[1] - 1.001)
    i, j = int(row), int(column)
    s, t = row - i, column - j
    first = (1.0 - t) * drawn[i, j, channel] + t * drawn[i, j + 1, channel]
    second = (1.0 - t) * drawn[i + 1, j, channel] + t * drawn[i + 1, j + 1, channel]
    return float((1.0 - s) * first + s * second)
