"""Light and colours of the sky by the hour."""

import math
from dataclasses import dataclass

import numpy as np

from vrx_mj.config.scene import SkyConfig

__all__ = ["DAY", "Daylight", "daylight"]

RGB = tuple[float, float, float]

NOON = math.radians(60.0)
"""How high the sun stands half way between sunrise and sunset [rad]."""
LOWEST = math.radians(5.0)
"""The light never comes from lower: when the sun is down, it is that of the bright part of the sky, or the moon."""

_SKIES = (
    (-20.0, (0.015, 0.022, 0.055), (0.05, 0.06, 0.11), (0.12, 0.14, 0.20), 0.28),
    (-8.0, (0.03, 0.05, 0.13), (0.12, 0.12, 0.22), (0.13, 0.13, 0.18), 0.34),
    (-2.0, (0.10, 0.15, 0.32), (0.62, 0.40, 0.32), (0.25, 0.16, 0.14), 0.50),
    (3.0, (0.20, 0.31, 0.54), (0.92, 0.63, 0.42), (0.72, 0.45, 0.27), 0.70),
    (10.0, (0.30, 0.50, 0.76), (0.90, 0.82, 0.74), (0.82, 0.70, 0.56), 0.90),
    (22.0, (0.36, 0.58, 0.82), (0.80, 0.88, 0.94), (0.80, 0.80, 0.80), 1.00),
)
"""Elevation of the sun [degrees], colours of zenith, horizon and light, share of ambient light; mixed in between."""
_HEIGHTS, _ZENITH, _HORIZON, _LIGHT, _AMBIENT = zip(*_SKIES, strict=True)


@dataclass(frozen=True)
class Daylight:
    """What the hour makes of a clear sky."""

    zenith: RGB
    horizon: RGB
    light: RGB
    """Of the sun, or of what shines in its place."""
    sun: RGB
    """Direction to it, east, north, up."""
    ambient: float
    """Share of the day's ambient light and of the light from the camera."""


DAY = Daylight(_ZENITH[-1], _HORIZON[-1], _LIGHT[-1], (0.5, -0.1, 0.9), 1.0)
"""A world that says nothing of the hour: a clear morning."""


def daylight(sky: SkyConfig, latitude: float) -> Daylight:
    """Light at the sky's `time`, at a latitude [degrees] whose sign tells on which side the sun stands at noon.

    The sun rises in the east and sets in the west; its height is a sine of the share of the day, and of the night,
    that has passed. Season and true solar geometry are left out: the file says when the sun rises and sets.
    """
    elevation, course = _sun(sky, latitude)
    shown = max(elevation, LOWEST)
    degrees = math.degrees(elevation)
    return Daylight(
        zenith=_mix(degrees, _ZENITH),
        horizon=_mix(degrees, _HORIZON),
        light=_mix(degrees, _LIGHT),
        sun=(math.cos(shown) * math.cos(course), math.cos(shown) * math.sin(course), math.sin(shown)),
        ambient=float(np.interp(degrees, _HEIGHTS, _AMBIENT)),
    )


def _sun(sky: SkyConfig, latitude: float) -> tuple[float, float]:
    """Elevation and direction [rad, counter-clockwise from east]; under the horizon at night."""
    day = sky.sunset - sky.sunrise
    passed = sky.time - sky.sunrise
    if 0.0 <= passed <= day:
        turn = math.pi * passed / day
    else:
        night = 24.0 - day
        turn = math.pi * (1.0 + ((sky.time - sky.sunset) % 24.0) / night)
    side = 1.0 if latitude < 0.0 else -1.0  # in the south the sun passes through the north
    return NOON * math.sin(turn), side * turn


def _mix(degrees: float, colors: tuple[RGB, ...]) -> RGB:
    red, green, blue = (float(np.interp(degrees, _HEIGHTS, channel)) for channel in zip(*colors, strict=True))
    return red, green, blue
