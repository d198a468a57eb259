"""Cosine, sine and exponential: the same on every processor, one or several at a time."""

import math

import numpy as np

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.lanes import Lanes, chosen, floor, larger, power_of_two, spread

__all__ = [
    "FAR", "cosine", "cosine_and_sine", "cosines_and_sines", "exponential", "exponentials", "near_cosine",
    "near_cosine_and_sine",
]  # fmt: skip


FAR = 1.0e6
"""Up to here [rad] the number of half turns has 19 bits, and its products with the parts of pi are exact."""

_P1, _P2, _P3 = 3.1415926534682512, 1.2154201012607932e-10, 4.044532497591901e-21
"""Pi in parts of 33, 33 and 53 bits: twice those of FDLIBM's e_rem_pio2.c (Sun Microsystems, 1993)."""

_TAYLOR = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(11))
"""The cosine's series in x^2; what follows is below 2e-17 for |x| <= pi / 2."""

_SERIES = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(9))
"""The cosine's series again, for |x| <= pi / 4: what follows is below 3e-18."""

_SERIES_SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(8))
"""The series of the sine over x; what follows is below 5e-17 of it."""

_TAYLOR_EXPONENTIAL = tuple(1.0 / math.factorial(k) for k in range(14))
"""The series of e^x; what follows is below 4e-18 for |x| <= ln 2 / 2."""

_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
"""The logarithm of 2 in parts of 32 and 53 bits, of FDLIBM's e_exp.c (Sun Microsystems, 1993)."""

_PER_LN2 = 1.0 / math.log(2.0)
_SHIFT = 6755399441055744.0
"""1.5 2^52: a number that is added to it is rounded to a whole one, which is in the sum's last bits."""
_ONE = 1023 << 52
"""The bits of the number 1."""


@kernel
def cosine(angle: float) -> float:
    """Return the cosine of `angle` [rad], within 4e-16; beyond a million radians it is the C library's."""
    if not abs(angle) < FAR:
        return math.cos(angle)
    return near_cosine(angle)


@kernel
def cosine_and_sine(angle: float) -> tuple[float, float]:
    """Return cosine and sine of `angle` [rad], within 4e-16; beyond a million radians they are the C library's."""
    if not abs(angle) < FAR:
        return math.cos(angle), math.sin(angle)
    return near_cosine_and_sine(angle)


@kernel
def near_cosine(angle: float) -> float:
    """Return `cosine` of an angle below `FAR`, without branches, so that a processor can take several at a time.

    Half turns are taken off first (Cody and Waite, 1980). The series is summed pairwise, which waits
    less than Horner's rule.
    """
    x, sign = _reduced(angle)
    return sign * _even_series(_TAYLOR, x * x)


@kernel
def near_cosine_and_sine(angle: float) -> tuple[float, float]:
    """Return `cosine_and_sine` of an angle below `FAR`, without branches.

    Quarter turns are taken off, with halves of the parts of pi, so that the series are short: after an odd number, the
    cosine is the sine's and the other way round.
    """
    turns = np.floor(angle * (2.0 / math.pi) + 0.5)
    x = ((angle - turns * (0.5 * _P1)) - turns * (0.5 * _P2)) - turns * (0.5 * _P3)
    z = x * x
    half = np.floor(0.5 * turns)
    odd, flip = turns - 2.0 * half, 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
    c, s = _SERIES, _SERIES_SINE
    z2 = z * z
    z4 = z2 * z2
    even = ((1.0 + z * c[1]) + z2 * (c[2] + z * c[3])) + z4 * (((c[4] + z * c[5]) + z2 * (c[6] + z * c[7])) + z4 * c[8])
    rest = ((1.0 + z * s[1]) + z2 * (s[2] + z * s[3])) + z4 * ((s[4] + z * s[5]) + z2 * (s[6] + z * s[7]))
    rest = x * rest
    if odd != 0.0:
        return -flip * rest, flip * even
    return flip * even, flip * rest


@kernel
def _reduced(angle: float) -> tuple[float, float]:
    """Return an angle less the nearest number of half turns, and 1 or, where that is odd, -1."""
    turns = np.floor(angle * (1.0 / math.pi) + 0.5)
    odd = turns - 2.0 * np.floor(0.5 * turns)
    return ((angle - turns * _P1) - turns * _P2) - turns * _P3, 1.0 - 2.0 * odd


@kernel
def exponential(x: float) -> float:
    """Return e^x for x <= 0, within 4e-16; without branches, and the same on every processor.

    x = n ln 2 + r; the number of e^r that is 2^n larger has n more in its exponent. Below -700 it is e^-700.
    """
    x = max(x, -700.0)
    shifted = x * _PER_LN2 + _SHIFT  # the last bits of this number are n
    n = shifted - _SHIFT
    r = (x - n * _LN2_HIGH) - n * _LN2_LOW
    c, r2 = _TAYLOR_EXPONENTIAL, r * r
    r4 = r2 * r2
    low = (1.0 + r) + r2 * (c[2] + r * c[3])
    middle = (c[4] + r * c[5]) + r2 * (c[6] + r * c[7])
    high = (c[8] + r * c[9]) + r2 * (c[10] + r * c[11])
    power = np.int64((np.float64(shifted).view(np.int64) << 52) + _ONE).view(np.float64)
    return float((low + r4 * (middle + r4 * (high + r4 * (c[12] + r * c[13])))) * power)


@kernel
def _even_series(c: tuple[float, ...], z: float) -> float:
    """Return the sum of c_k z^k, pairwise."""
    z2 = z * z
    z4 = z2 * z2
    low = (1.0 + z * c[1]) + z2 * (c[2] + z * c[3])
    middle = (c[4] + z * c[5]) + z2 * (c[6] + z * c[7])
    high = (c[8] + z * c[9]) + z2 * c[10]
    return low + z4 * (middle + z4 * high)


@kernel
def cosines_and_sines(angles: Lanes) -> tuple[Lanes, Lanes]:
    """Return `near_cosine_and_sine` of several angles, to the bit."""
    turns = floor(angles * (2.0 / math.pi) + 0.5)
    x = ((angles - turns * (0.5 * _P1)) - turns * (0.5 * _P2)) - turns * (0.5 * _P3)
    half = floor(turns * 0.5)
    odd, flip = turns - half * 2.0, 1.0 - (half - floor(half * 0.5) * 2.0) * 2.0
    z = x * x
    z2 = z * z
    z4 = z2 * z2
    c, s = _SERIES, _SERIES_SINE
    even = ((z * c[1] + 1.0) + z2 * (z * c[3] + c[2])) + z4 * (((z * c[5] + c[4]) + z2 * (z * c[7] + c[6])) + z4 * c[8])
    rest = x * (((z * s[1] + 1.0) + z2 * (z * s[3] + s[2])) + z4 * ((z * s[5] + s[4]) + z2 * (z * s[7] + s[6])))
    return flip * chosen(odd, 0.0 - rest, even), flip * chosen(odd, even, rest)


@kernel
def exponentials(x: Lanes) -> Lanes:
    """Return `exponential` of several numbers, to the bit."""
    x = larger(x, spread(-700.0))
    shifted = x * _PER_LN2 + _SHIFT
    n = shifted - _SHIFT
    r = (x - n * _LN2_HIGH) - n * _LN2_LOW
    c, r2 = _TAYLOR_EXPONENTIAL, r * r
    r4 = r2 * r2
    low = (r + 1.0) + r2 * (r * c[3] + c[2])
    middle = (r * c[5] + c[4]) + r2 * (r * c[7] + c[6])
    high = (r * c[9] + c[8]) + r2 * (r * c[11] + c[10])
    return (low + r4 * (middle + r4 * (high + r4 * (r * c[13] + c[12])))) * power_of_two(shifted)
