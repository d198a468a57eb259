"""From east, north and up to WGS84 latitude, longitude and altitude, in scalars, as sensors and tasks ask for it.

pymap3d does the same for arrays, a hundred times slower for one point; a test holds the two together.
"""

import math

__all__ = ["enu_to_geodetic"]

MAJOR, FLATTENING = 6378137.0, 1.0 / 298.257223563
"""Semi-major axis [m] and flattening of the ellipsoid: WGS84, NIMA TR8350.2."""
MINOR = MAJOR * (1.0 - FLATTENING)
SQUARE = FLATTENING * (2.0 - FLATTENING)
"""Of the first eccentricity."""


def enu_to_geodetic(
    east: float, north: float, up: float, latitude: float, longitude: float, altitude: float
) -> tuple[float, float, float]:
    """Latitude, longitude [degrees] and altitude [m] of a point by a tangent plane [m] at a geodetic place."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    sin, cos = math.sin(phi), math.cos(phi)
    radius = MAJOR / math.sqrt(1.0 - SQUARE * sin * sin)
    outward = cos * up - sin * north
    p = (radius + altitude) * cos + outward  # in the meridian plane of the origin, from the axis
    x, y = math.cos(lam) * p - math.sin(lam) * east, math.sin(lam) * p + math.cos(lam) * east
    z = (radius * (1.0 - SQUARE) + altitude) * sin + cos * north + sin * up
    return _to_geodetic(x, y, z)


def _to_geodetic(x: float, y: float, z: float) -> tuple[float, float, float]:
    """From earth-centred x, y, z [m], by Bowring's formula (Survey Review 23, 1976), iterated to the last digits."""
    p = math.hypot(x, y)
    reduced = math.atan2(z * MAJOR, p * MINOR)
    for _ in range(3):
        s, c = math.sin(reduced), math.cos(reduced)
        phi = math.atan2(z + SQUARE / (1.0 - SQUARE) * MINOR * s**3, p - SQUARE * MAJOR * c**3)
        reduced = math.atan2(MINOR * math.sin(phi), MAJOR * math.cos(phi))
    sin, cos = math.sin(phi), math.cos(phi)
    altitude = p * cos + z * sin - MAJOR * math.sqrt(1.0 - SQUARE * sin * sin)
    return math.degrees(phi), math.degrees(math.atan2(y, x)), float(altitude)
