"""Linear waves: their lengths, how high they can be, and what sea states are."""

import math
from typing import NamedTuple

SEA_STATES = (0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0)
"""Significant height [m] of sea states 0 to 6: middles of the heights in WMO's code table 3700."""
_STEEPEST = 0.142
"""Height over length of the steepest wave in deep water (Michell, 1893; Miche's factor in any depth, 1944)."""
DEEP = 20.0
"""Wavenumber times depth beyond which water is infinitely deep: tanh is 1 there to the last bit."""


class Site(NamedTuple):
    """Where waves are."""

    depth: float = math.inf
    """Depth of the water [m]."""
    gravity: float = 9.81
    """Gravity [m/s2]."""


def wavenumber(frequency: float, site: Site = Site()) -> float:  # noqa: B008  (a tuple)
    """Return the wavenumber k [rad/m] of linear waves: omega^2 = g k tanh(k h), solved to the last bits.

    Args:
        frequency: angular, above 0 [rad/s].
        site: depth and gravity.
    """
    deep = frequency * frequency / site.gravity
    if deep * site.depth > DEEP:
        return deep
    x = deep * site.depth
    y = x / math.sqrt(math.tanh(x)) if x < 1.0 else x  # y tanh(y) = x, from a guess on the safe side
    for _ in range(50):
        t = math.tanh(y)
        step = (y * t - x) / (t + y * (1.0 - t * t))
        y -= step
        if abs(step) <= 1e-15 * y:
            break
    return y / site.depth


def developed_period(height: float, gravity: float = 9.81) -> float:
    """Return the peak period [s] of a sea that the wind has fully raised to a significant height [m].

    Of Pierson and Moskowitz' spectrum (1964): Hs = 4 g sqrt(alpha / 5) / omega_p^2, alpha = 0.0081.
    """
    return 2.0 * math.pi * math.sqrt(height / (4.0 * gravity * math.sqrt(0.0081 / 5.0)))


def breaking_height(period: float, site: Site = Site()) -> float:  # noqa: B008
    """Return the height [m] at which a wave of a period [s] breaks: 0.142 L tanh(k h) (Miche, 1944)."""
    k = wavenumber(2.0 * math.pi / period, site)
    return _STEEPEST * 2.0 * math.pi / k * math.tanh(min(k * site.depth, DEEP))


def steepest_sea(period: float, site: Site = Site()) -> float:  # noqa: B008
    """Return the greatest significant height [m] of a sea of a peak period [s].

    In deep water Hs is at most a fifteenth of the peak's wave length g Tp^2 / 2 pi up to 8 s, at most a 25th of it from
    15 s on, and linear in between (DNV-RP-C205, 2010, 3.5.4); in shallow water it is at most `breaking_height`, too.
    """
    long = min(max((period - 8.0) / 7.0, 0.0), 1.0)
    share = (1.0 - long) / 15.0 + long / 25.0
    return min(share * site.gravity * period**2 / (2.0 * math.pi), breaking_height(period, site))
