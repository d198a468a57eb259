"""Errors of instruments: a constant offset, a slow drift and white noise, each a function of (key, index).

Nothing is kept between measurements. The n-th one has the same errors whether those before it were made or not.
"""

import math

import numpy as np

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.noise import bits, normal

__all__ = ["FORGOTTEN", "axis_error", "gauss_markov"]

FORGOTTEN = 40.0
"""Time constants after which a drift has nothing to do with what it was: exp(-40) is below rounding."""
_MOST_LEVELS = 50
"""Of halvings; a drift that would need more stays what it is."""


@kernel
def gauss_markov(key: np.uint64, index: int, reversion: float) -> float:
    """Return number `index` of a Gauss-Markov sequence with mean 0 and variance 1.

    Neighbours are correlated by exp(-`reversion`), and so n apart by exp(-n `reversion`): an Ornstein-Uhlenbeck
    process, sampled exactly. It is built by halving: numbers at multiples of 2^L, too far apart to be correlated, are
    drawn independently; the number in the middle between two neighbours at distance h is, given both,
        N(r (left + right) / (1 + r^2), (1 - r^2) / (1 + r^2)),     r = exp(-h `reversion`)
    (a Gaussian's conditional distribution). Every index is the middle of one pair only, and draws number `index`.
    """
    levels = 0
    while levels <= _MOST_LEVELS and 2.0**levels * reversion < FORGOTTEN:
        levels += 1
    if levels > _MOST_LEVELS:
        return normal(key, np.uint64(0))
    half = 1 << levels
    start = index - index % half
    left, right = normal(key, np.uint64(start)), normal(key, np.uint64(start + half))
    while start != index:
        half //= 2
        r = math.exp(-half * reversion)
        spread = math.sqrt(-math.expm1(-2.0 * half * reversion) / (1.0 + r * r))
        middle = r * (left + right) / (1.0 + r * r) + spread * normal(key, np.uint64(start + half))
        if index < start + half:
            right = middle
        else:
            start, left = start + half, middle
    return left


@kernel
def axis_error(
    key: np.uint64, axis: int, index: int, offset: float, drift: float, reversion: float, noise: float
) -> float:
    """Return the error of measurement `index` along an axis: `offset` + drift + white noise.

    `drift` and `noise` are standard deviations; `reversion` is the interval between measurements over the drift's
    time constant. Axes have streams of their own under the sensor's `key`.
    """
    error = offset
    if drift > 0.0:
        error += drift * gauss_markov(bits(key, np.uint64(2 * axis + 1)), index, reversion)
    if noise > 0.0:
        error += noise * normal(bits(key, np.uint64(2 * axis)), np.uint64(index))
    return error
