"""What the sky and the water look like: a painted cube, and the palette of the sea's surface."""

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.physics.surface import EDGE

__all__ = ["sea_palette", "sky_cube"]


DEEP = (0.035, 0.165, 0.215)
"""Colour of deep water by day."""
DAY = 0.85
"""Brightness of a clear day's horizon: the water is darker in proportion where the horizon is."""
_LUMA = np.array([0.2126, 0.7152, 0.0722])


def sky_cube(side: int, zenith: FloatArray, horizon: FloatArray, sun: FloatArray, light: FloatArray) -> ByteArray:
    """A sky as MuJoCo's cube of six faces one above the other, (6 side, side, 3).

    Args:
        side: pixels along an edge.
        zenith: colour overhead.
        horizon: colour at the horizon, and below it.
        sun: unit vector to the sun.
        light: the sun's colour; a weak one has no disc.
    """
    rays = _rays(side)
    color = sky_color(rays[..., 2], zenith, horizon)
    if np.any(zenith != horizon):
        toward = np.clip(rays @ sun, 0.0, 1.0)[..., None]
        glow = 0.25 * toward**6 + 0.35 * toward**60
        disc = np.clip((toward - 0.9998) / 0.0001, 0.0, 1.0) * (light.max() > 0.4)  # 2 degrees wide, with a soft rim
        warm = np.clip(light / max(float(light.max()), 1e-6), 0.0, 1.0)
        color += (warm - color) * np.clip(light.max() * glow + disc, 0.0, 1.0) * (rays[..., 2:] > -0.02)
    return _bytes(color).reshape(6 * side, side, 3)


def sky_color(sine: FloatArray, zenith: FloatArray, horizon: FloatArray) -> FloatArray:
    """The sky's colour without the sun (..., 3) at the sine of an elevation (...)."""
    share = (1.0 - np.clip(sine, 0.0, 1.0)[..., None]) ** 3
    return np.asarray(zenith + (horizon - zenith) * share)


def sea_palette(width: int, height: int, zenith: FloatArray, horizon: FloatArray, light: FloatArray) -> ByteArray:
    """Colours of the sea (height, width, 3): columns by the share of sky that is mirrored, rows by glitter.

    What mirrors much is seen at a grazing angle and shows the sky near the horizon, so a column's share gives the
    elevation too: Schlick's law of reflectance, solved for the angle.
    """
    share, glitter = _scale(width), _scale(height)[:, None, None]
    sine = 1.0 - (np.clip(share - 0.02, 0.0, None) / 0.98) ** 0.2
    deep = np.array(DEEP) * min(float(horizon @ _LUMA) / DAY, 1.0)
    mirrored = deep + (sky_color(sine, zenith, horizon) - deep) * share[:, None]
    return _bytes(mirrored[None] + light * glitter)


def _scale(number: int) -> FloatArray:
    """What the middles of a palette's pixels stand for, 0 to 1."""
    return np.clip(((np.arange(number) + 0.5) / number - EDGE) / (1.0 - 2.0 * EDGE), 0.0, 1.0)


def _rays(side: int) -> FloatArray:
    """Where the middles of the cube's pixels lie, unit vectors (6, side, side, 3), world axes.

    MuJoCo's faces are east, west, up, down, south, north, seen from inside and mirrored left to right.
    """
    line = 2.0 * (np.arange(side) + 0.5) / side - 1.0
    b, a = np.meshgrid(line, line, indexing="ij")
    one = np.ones_like(a)
    faces = [(one, a, -b), (-one, -a, -b), (a, -b, one), (a, b, -one), (a, -one, -b), (-a, one, -b)]
    rays = np.stack([np.stack(face, axis=-1) for face in faces])
    return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))


def _bytes(color: FloatArray) -> ByteArray:
    return np.rint(np.clip(color, 0.0, 1.0) * 255.0).astype(np.uint8)
