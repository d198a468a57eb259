"""Gusts of a spectrum: the one of NPD, and the harmonics that add up to it."""

import math
from itertools import pairwise

from vrx_mj.spectra import Spectrum, band_edges, band_frequencies

_BAND = 2.0 * math.pi * (1.0 / 600.0), 2.0 * math.pi * 0.5
"""Frequencies between which the NPD spectrum holds [rad/s]: 1/600 and 0.5 Hz."""
_SHAPE = 0.468
"""Exponent n of the NPD spectrum."""


def npd(speed: float, height: float) -> Spectrum:
    """Return the spectrum of the wind's speed [m2 s/rad] at a height [m] over the sea.

    NORSOK N-003; Andersen and Lovseth (1992), from measurements on Froya.

    S(f) = 320 (U/10)^2 (z/10)^0.45 / (1 + x^n)^(5 / 3n), x = 172 f (z/10)^(2/3) (U/10)^(-3/4), n = 0.468, in m2/Hz;
    `speed` U is the hour's mean at 10 m, above 0 [m/s].
    """
    level = 320.0 * (speed / 10.0) ** 2 * (height / 10.0) ** 0.45
    scale = 172.0 * (height / 10.0) ** (2.0 / 3.0) * (speed / 10.0) ** -0.75

    def density(frequency: float) -> float:
        f = frequency / (2.0 * math.pi)
        return float(level / (1.0 + (scale * f) ** _SHAPE) ** (5.0 / (3.0 * _SHAPE)) / (2.0 * math.pi))

    return density


def gust_variance(spectrum: Spectrum) -> float:
    """Return the variance of gusts [m2/s2]: the integral of their spectrum between 1/600 and 0.5 Hz."""
    return math.fsum(
        (b - a) * (spectrum(a) + 4.0 * spectrum(0.5 * (a + b)) + spectrum(b)) / 6.0
        for a, b in pairwise(band_edges(*_BAND))
    )


def gust_frequencies(spectrum: Spectrum, number: int) -> list[float]:
    """Return the angular frequencies (number,) [rad/s] of harmonics that have equal shares of the energy."""
    return band_frequencies(spectrum, *_BAND, number)
