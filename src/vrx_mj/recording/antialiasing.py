"""Pictures of a film: smooth edges from one sample a pixel, in a tenth of the time of four, and the film's colours."""

import math

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, Uint32Array
from vrx_mj.physics.kernel import inlined_kernel, kernel

_MIN_CONTRAST = 24
"""Range of green around a pixel, of 255, above which there is an edge."""
_MAX_EDGE = 8.0
"""Largest number of pixels along an edge over which it is smoothed."""
_SKY_PIXELS = 4
"""Pixels of a row that show one of the sky: it is as wide in a film."""


def antialias(drawn: ByteArray) -> ByteArray:
    """The picture (height, width, 3) with smooth edges, first row highest.

    `drawn` (height, width, 4) has opacities too, which do not count, and its lowest row first.
    FXAA (Lottes, 2009): where brightness, here green, changes much, two or four places along the edge are averaged,
    of which the nearest pixels count.
    """
    height, width = drawn.shape[:2]
    out, green = np.empty((height, width, 3), np.uint8), np.empty((height, width), np.uint8)
    smooth(drawn, green, np.zeros(-(-width // 8) * 8, np.uint8), out)
    return out


@kernel
def smooth(drawn: ByteArray, green: ByteArray, edges: ByteArray, out: ByteArray) -> None:
    """Write the picture into `out`; `green` (height, width) and `edges` (width rounded up to 8) are room."""
    height, width = green.shape
    for row in range(height):
        line, copy, target = drawn[row].reshape(-1), green[row], out[height - 1 - row].reshape(-1)
        for i in range(width):
            copy[i] = line[4 * i + 1]
            target[3 * i], target[3 * i + 1], target[3 * i + 2] = line[4 * i], line[4 * i + 1], line[4 * i + 2]
    for row in range(1, height - 1):
        before, here, after = green[row - 1], green[row], green[row + 1]
        for i in range(1, width - 1):
            low = min(before[i - 1], before[i + 1], here[i], after[i - 1], after[i + 1])
            high = max(before[i - 1], before[i + 1], here[i], after[i - 1], after[i + 1])
            edges[i] = high - low > _MIN_CONTRAST
        eights = edges.view(np.uint64)
        for eight in range(eights.size):
            if eights[eight]:
                for i in range(8 * eight, 8 * eight + 8):
                    if edges[i]:
                        _smooth_pixel(drawn, green, row, i, out[height - 1 - row, i])


@inlined_kernel
def _smooth_pixel(drawn: ByteArray, green: ByteArray, row: int, i: int, target: ByteArray) -> None:
    """Write the mean along the edge at a pixel."""
    above, below, here = green[row - 1], green[row + 1], float(green[row, i])
    a, b, c, d = float(above[i - 1]), float(above[i + 1]), float(below[i - 1]), float(below[i + 1])
    low, high = min(a, b, here, c, d), max(a, b, here, c, d)
    along, across = a + b - c - d, b + d - a - c
    scale = max(min(abs(along), abs(across)) + (abs(along) + abs(across)) / 32.0, 0.25)
    x, y = min(max(along / scale, -_MAX_EDGE), _MAX_EDGE), min(max(across / scale, -_MAX_EDGE), _MAX_EDGE)
    for share in (2.0, 6.0):  # of four pixels, or of the near two if that leaves the range
        for channel in range(3):
            near = _sum_of_two(drawn, row, i, y / 6.0, x / 6.0, channel)
            target[channel] = (near + _sum_of_two(drawn, row, i, y / share, x / share, channel) + 2) >> 2
        if low <= target[1] <= high:
            break


@inlined_kernel
def _sum_of_two(drawn: ByteArray, row: int, i: int, down: float, right: float, channel: int) -> int:
    """Return the sum of a channel of the pixels nearest to two opposite places around a pixel."""
    below, beside, last, end = math.floor(down + 0.5), math.floor(right + 0.5), drawn.shape[0] - 1, drawn.shape[1] - 1
    one = drawn[min(max(row - below, 0), last), min(max(i - beside, 0), end), channel]
    return int(one) + int(drawn[min(max(row + below, 0), last), min(max(i + beside, 0), end), channel])


@kernel
def fill_sky(drawn: Uint32Array, sky: Uint32Array, rotation: FloatArray, half_width: float, half_height: float) -> None:
    """Write the sky where nothing else was drawn, in a fraction of Mesa's time.

    Args:
        drawn: picture (height, width), its lowest row first, of colours and opacities; 0 where nothing is.
        sky: six faces (6 side, side), as `mjcf.scene.sky_cube` has them.
        rotation: (3, 3), camera to world axes.
        half_width: of the picture at distance 1.
        half_height: likewise.
    """
    height, width, side = drawn.shape[0], drawn.shape[1], sky.shape[1]
    for row in range(height):
        line, empty = drawn[row], 0
        for i in range(width):
            empty += line[i] == 0
        up, color = half_height * (2.0 * (row + 0.5) / height - 1.0), np.uint32(0)
        for i in range(width if empty else 0):
            if i % _SKY_PIXELS == 0:
                color = np.uint32(0)
            if line[i] == 0:
                if color == 0:
                    left = half_width * (1.0 - 2.0 * (i + 0.5) / width)
                    face, a, b = _sky_place(
                        rotation[0, 0] + rotation[0, 1] * left + rotation[0, 2] * up,
                        rotation[1, 0] + rotation[1, 1] * left + rotation[1, 2] * up,
                        rotation[2, 0] + rotation[2, 1] * left + rotation[2, 2] * up,
                    )
                    color = sky[side * face + int(b * side), int(a * side)]
                line[i] = color


@inlined_kernel
def _sky_place(x: float, y: float, z: float) -> tuple[int, float, float]:
    """Return a direction's face, and its place to the right and downward there, 0 to 1."""
    if abs(x) >= max(abs(y), abs(z)):
        face, a, b = (0, y / x, -z / x) if x > 0.0 else (1, y / x, z / x)
    elif abs(z) >= abs(y):
        face, a, b = (2, x / z, -y / z) if z > 0.0 else (3, -x / z, -y / z)
    else:
        face, a, b = (5, -x / y, -z / y) if y > 0.0 else (4, -x / y, z / y)
    return face, 0.4999 * (a + 1.0), 0.4999 * (b + 1.0)


@kernel
def write_yuv(picture: ByteArray, planes: ByteArray) -> None:
    """Write a picture (height, width, 3) as YUV 4:2:0 into `planes` (3/2 height, width), in a sixth of FFmpeg's time.

    As ITU-R BT.601 has it, of 16 to 235; a colour is the mean of four pixels. Both sides are even.
    """
    height, width = picture.shape[:2]
    colors = planes[height:].reshape(2, height // 2, width // 2)
    for row in range(0, height, 2):
        above, below = picture[row].reshape(-1), picture[row + 1].reshape(-1)
        blue, red = colors[0, row // 2], colors[1, row // 2]
        for line, luma in ((above, planes[row]), (below, planes[row + 1])):
            for i in range(width):
                luma[i] = (16829 * line[3 * i] + 33039 * line[3 * i + 1] + 6416 * line[3 * i + 2] + 1081344) >> 16
        for i in range(width // 2):
            r = above[6 * i] + above[6 * i + 3] + below[6 * i] + below[6 * i + 3]
            g = above[6 * i + 1] + above[6 * i + 4] + below[6 * i + 1] + below[6 * i + 4]
            b = above[6 * i + 2] + above[6 * i + 5] + below[6 * i + 2] + below[6 * i + 5]
            blue[i] = (-9714 * r - 19071 * g + 28784 * b + 33685504) >> 18
            red[i] = (28784 * r - 24103 * g - 4681 * b + 33685504) >> 18


@kernel
def blend(place: ByteArray, tile: ByteArray) -> None:
    """Lay a tile (height, width, 4) of colours and opacities over a place (height, width, 3) of a picture."""
    for row in range(tile.shape[0]):
        for i in range(tile.shape[1]):
            opacity = np.uint32(tile[row, i, 3])
            for channel in range(3):
                mixed = place[row, i, channel] * (np.uint32(255) - opacity) + tile[row, i, channel] * opacity
                place[row, i, channel] = (mixed + np.uint32(127)) // np.uint32(255)
