"""A cosine that costs a third of the C library's and is the same on every machine: waves need many."""

import math

import numpy as np

from vrx_mj.physics.kernel import kernel

__all__ = ["cosine"]

_LIMIT = 1.0e6
"""Up to here [rad] the number of half turns has 19 bits, and its products with the parts of pi are exact."""

_P1, _P2, _P3 = 3.1415926534682512, 1.2154201012607932e-10, 4.044532497591901e-21
"""pi in parts of 33, 33 and 53 bits: twice those of FDLIBM's e_rem_pio2.c (Sun Microsystems, 1993)."""

_TAYLOR = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(11))
"""The cosine's series in x^2; what follows is below 2e-17 for |x| <= pi / 2."""


@kernel
def cosine(angle: float) -> float:
    """Return the cosine of `angle` [rad], within 4e-16.

    Half turns are taken off first (Cody and Waite, 1980). The series is summed pairwise, which waits
    less than Horner's rule. Beyond a million radians it falls back to the C library.
    """
    if not abs(angle) < _LIMIT:
        return math.cos(angle)
    turns = float(np.floor(angle * (1.0 / math.pi) + 0.5))
    x = ((angle - turns * _P1) - turns * _P2) - turns * _P3
    c, z = _TAYLOR, x * x
    z2 = z * z
    z4 = z2 * z2
    low = (1.0 + z * c[1]) + z2 * (c[2] + z * c[3])
    middle = (c[4] + z * c[5]) + z2 * (c[6] + z * c[7])
    high = (c[8] + z * c[9]) + z2 * c[10]
    value = low + z4 * (middle + z4 * high)
    return -value if int(turns) & 1 else value
