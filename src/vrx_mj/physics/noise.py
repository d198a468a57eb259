"""Random numbers without a generator's state: the n-th number of a stream is a function of (key, n).

A stream's key comes from the seed and the name of what uses it, so no stream depends on which others exist
or on the order of drawing. The mixing is that of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
"""

import hashlib
import math

import numpy as np

from vrx_mj.physics.kernel import kernel

__all__ = ["bits", "normal", "stream_key", "uniform"]

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_27, _30, _31, _11, _1 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11), np.uint64(1)
_ULP = 2.0**-53


def stream_key(seed: int, *names: str | int) -> int:
    """Return the 64-bit key of the stream that `names` (a boat, a sensor, a life, ...) have under `seed`."""
    text = "\0".join(f"{type(name).__name__}:{name}" for name in (int(seed), *names))
    return int.from_bytes(hashlib.blake2b(text.encode("utf-8"), digest_size=8).digest(), "little")


@kernel
def bits(key: int | np.uint64, counter: int | np.uint64) -> np.uint64:
    """Return 64 random bits, the `counter`-th of stream `key`; all three are unsigned 64-bit."""
    z = np.uint64(key) + (np.uint64(counter) + _1) * _GAMMA
    z = (z ^ (z >> _30)) * _MIX_1
    z = (z ^ (z >> _27)) * _MIX_2
    return z ^ (z >> _31)


@kernel
def uniform(key: int | np.uint64, counter: int | np.uint64) -> float:
    """Return a number in [0, 1), the `counter`-th of stream `key`, a multiple of 2^-53."""
    return float(bits(key, counter) >> _11) * _ULP


@kernel
def normal(key: int | np.uint64, counter: int | np.uint64) -> float:
    """Return a number of the standard normal distribution, the `counter`-th of stream `key`.

    Box and Muller (1958), the cosine half. It uses the stream's numbers 2 `counter` and 2 `counter` + 1.
    """
    even = np.uint64(counter) * np.uint64(2)
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(key, even)))
    return radius * math.cos(2.0 * math.pi * uniform(key, even + _1))
