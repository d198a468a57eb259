"""Random numbers without a generator's state: the n-th number of a stream is a function of (key, n).

A stream's key comes from the seed and the name of what uses it, so no stream depends on which others exist
or on the order of drawing. The mixing is that of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).

Errors of instruments are made of it: a constant offset, a slow drift and white noise. Nothing is kept between
measurements; the n-th one has the same errors whether those before it were made or not.
"""

import hashlib
import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel

Word = int | np.uint64
"""A key or a counter of 64 bits."""
_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_27, _30, _31, _11, _1 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11), np.uint64(1)
_ULP = 2.0**-53
_NORMAL_RATIO = math.sqrt(8.0 / math.e)
"""Width of the region of ratios of uniform numbers that are normal."""
_FORGOTTEN = 40.0
"""Time constants after which a drift has nothing to do with what it was: exp(-40) is below rounding."""
_MOST_LEVELS = 50
"""Most halvings; a drift that would need more stays what it is."""


def stream_key(seed: int, *names: str | int) -> int:
    """Return the 64-bit key of the stream that `names` (a boat, a sensor, a life, ...) have under `seed`."""
    text = "\0".join(f"{type(name).__name__}:{name}" for name in (int(seed), *names))
    return int.from_bytes(hashlib.blake2b(text.encode("utf-8"), digest_size=8).digest(), "little")


@kernel
def bits(key: Word, counter: Word) -> np.uint64:
    """Return 64 random bits, the `counter`-th of stream `key`; all three are unsigned 64-bit."""
    z = np.uint64(key) + (np.uint64(counter) + _1) * _GAMMA
    z = (z ^ (z >> _30)) * _MIX_1
    z = (z ^ (z >> _27)) * _MIX_2
    return z ^ (z >> _31)


@kernel
def uniform(key: Word, counter: Word) -> float:
    """Return a number in [0, 1), the `counter`-th of stream `key`, a multiple of 2^-53."""
    return float(bits(key, counter) >> _11) * _ULP


@kernel
def normal(key: Word, counter: Word) -> float:
    """Return a number of the standard normal distribution, the `counter`-th of stream `key`.

    Box and Muller (1958), the cosine half. It uses the stream's numbers 2 `counter` and 2 `counter` + 1.
    """
    even = np.uint64(counter) * np.uint64(2)
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(key, even)))
    return radius * math.cos(2.0 * math.pi * uniform(key, even + _1))


@kernel
def _gamma_variate(key: Word, shape: float) -> float:
    """Return a number of the Gamma distribution of `shape` >= 1 and mean `shape`, from the numbers of stream `key`.

    Marsaglia and Tsang (2000), of normal numbers that are ratios of uniform ones (Kinderman and Monahan, 1977): the
    logarithm only decides what is rejected, so that the number has the same bits on every processor.
    """
    d = shape - 1.0 / 3.0
    c = 1.0 / math.sqrt(9.0 * d)
    counter = 0
    while True:
        u = 1.0 - uniform(key, np.uint64(counter))
        x = _NORMAL_RATIO * (uniform(key, np.uint64(counter + 1)) - 0.5) / u
        w = 1.0 - uniform(key, np.uint64(counter + 2))
        counter += 3
        v = 1.0 + c * x
        if x * x <= -4.0 * math.log(u) and v > 0.0:
            cube = v * v * v
            if math.log(w) < 0.5 * x * x + d * (1.0 - cube + 3.0 * math.log(v)):
                return d * cube


@kernel
def gamma_variates(key: Word, shapes: FloatArray, out: FloatArray) -> None:
    """Write numbers of mean 1 of Gamma distributions of `shapes` (n,) to `out` (n,); of shape 0 they are 1.

    Another shape is at least 1. Each number has a stream of its own under `key`.
    """
    for i in range(shapes.size):
        out[i] = _gamma_variate(bits(key, np.uint64(i)), shapes[i]) / shapes[i] if shapes[i] > 0.0 else 1.0


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
    while levels <= _MOST_LEVELS and 2.0**levels * reversion < _FORGOTTEN:
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
