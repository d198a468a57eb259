"""Cosine, sine and exponential: the same on every processor, one or several at a time."""

import math

import numpy as np

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.lanes import Real, by_quarters, larger, power_of_two, product_and

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
    x, sign = _less_half_turns(angle)
    return sign * _even_series(_TAYLOR, x * x)


@kernel
def near_cosine_and_sine(angle: Real) -> tuple[Real, Real]:
    """Return `cosine_and_sine` of an angle below `FAR`, or of several, without branches.

    Quarter turns are taken off, with halves of the parts of pi, so that the series are short: after an odd number, the
    cosine is the sine's and the other way round.
    """
    shifted = product_and(angle, 2.0 / math.pi, _SHIFT)  # the last bits of this number are the quarter turns
    turns = shifted - _SHIFT
    x = product_and(turns, -0.5 * _P3, product_and(turns, -0.5 * _P2, product_and(turns, -0.5 * _P1, angle)))
    z = x * x
    z2 = z * z
    z4 = z2 * z2
    c, s = _SERIES, _SERIES_SINE
    c01, c23, c45, c67 = _pair(z, c[0], c[1]), _pair(z, c[2], c[3]), _pair(z, c[4], c[5]), _pair(z, c[6], c[7])
    s01, s23, s45, s67 = _pair(z, s[0], s[1]), _pair(z, s[2], s[3]), _pair(z, s[4], s[5]), _pair(z, s[6], s[7])
    even = product_and(z4, product_and(z4, c[8], product_and(z2, c67, c45)), product_and(z2, c23, c01))
    odd = x * product_and(z4, product_and(z2, s67, s45), product_and(z2, s23, s01))
    return by_quarters(shifted + 1.0, odd, even), by_quarters(shifted, odd, even)


@kernel
def _pair(z: Real, first: float, second: float) -> Real:
    """Return two terms of a series."""
    return product_and(z, second, first)


@kernel
def _less_half_turns(angle: float) -> tuple[float, float]:
    """Return an angle less the nearest number of half turns, and 1 or, where that is odd, -1."""
    shifted = angle * (1.0 / math.pi) + _SHIFT  # the last bits of this number are the half turns
    turns = shifted - _SHIFT
    odd = float(np.float64(shifted).view(np.int64) & 1)
    return ((angle - turns * _P1) - turns * _P2) - turns * _P3, 1.0 - 2.0 * odd


@kernel
def exponential(x: Real) -> Real:
    """Return e^x for x <= 0, or several, within 4e-16; without branches, and the same on every processor.

    x = n ln 2 + r; the number of e^r that is 2^n larger has n more in its exponent. Below -700 it is e^-700.
    """
    x = larger(x, -700.0)
    shifted = product_and(x, _PER_LN2, _SHIFT)  # the last bits of this number are n
    n = shifted - _SHIFT
    r = product_and(n, -_LN2_LOW, product_and(n, -_LN2_HIGH, x))
    c, r2 = _TAYLOR_EXPONENTIAL, r * r
    r4 = r2 * r2
    low = product_and(r2, _pair(r, c[2], c[3]), r + 1.0)
    middle = product_and(r2, _pair(r, c[6], c[7]), _pair(r, c[4], c[5]))
    high = product_and(r2, _pair(r, c[10], c[11]), _pair(r, c[8], c[9]))
    whole = product_and(r4, product_and(r4, product_and(r4, _pair(r, c[12], c[13]), high), middle), low)
    return whole * power_of_two(shifted)


@kernel
def _even_series(c: tuple[float, ...], z: float) -> float:
    """Return the sum of c_k z^k, pairwise."""
    z2 = z * z
    z4 = z2 * z2
    low = (1.0 + z * c[1]) + z2 * (c[2] + z * c[3])
    middle = (c[4] + z * c[5]) + z2 * (c[6] + z * c[7])
    high = (c[8] + z * c[9]) + z2 * c[10]
    return low + z4 * (middle + z4 * high)
