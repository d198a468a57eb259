"""Noise of an image's pixels."""

import functools
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.noise import bits

__all__ = ["copy_flipped", "grain_table", "with_grain"]

LEVELS = 4096
"""Quantiles of the normal distribution that a pixel's noise is one of: 12 random bits choose it."""

_PER_WORD = 5
_12, _4095 = np.uint64(12), np.uint64(4095)


@functools.lru_cache(maxsize=16)
def grain_table(noise: float) -> npt.NDArray[np.int32]:
    """Noise of a pixel (LEVELS,) [counts of 255], for a standard deviation `noise` of full scale.

    The medians of equally likely parts of the normal distribution, brought to its variance: none beyond 3.8
    standard deviations. They are rounded, as a pixel with noise would be.
    """
    normal = NormalDist()
    quantiles = np.array([normal.inv_cdf((index + 0.5) / LEVELS) for index in range(LEVELS)])
    quantiles /= np.sqrt(np.mean(quantiles**2))
    return np.rint(np.clip(255.0 * noise * quantiles, -255.0, 255.0)).astype(np.int32)


@kernel
def with_grain(drawn: ByteArray, table: npt.NDArray[np.int32], key: np.uint64, out: ByteArray) -> None:
    """Write `drawn` (height, width, 3), whose first row is the lowest, into `out`, first row highest, with noise.

    A pixel's three channels get the same number of stream `key`, as VRX's do.
    """
    height, width = drawn.shape[0], drawn.shape[1]
    word, left, counter = np.uint64(0), 0, np.uint64(0)
    for row in range(height):
        source, target = drawn[height - 1 - row], out[row]
        for column in range(width):
            if left == 0:
                word, left, counter = bits(key, counter), _PER_WORD, counter + np.uint64(1)
            change = table[word & _4095]
            word, left = word >> _12, left - 1
            for channel in range(3):
                target[column, channel] = np.uint8(min(max(np.int32(source[column, channel]) + change, 0), 255))


def copy_flipped(drawn: ByteArray, out: ByteArray) -> None:
    """Write `drawn`, whose first row is the lowest, into `out`, first row highest."""
    np.copyto(out, drawn[::-1])
