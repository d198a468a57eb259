"""Pictures of a team, and how they are shown."""

import sys

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.physics.tables import Table
from vrx_mj.rl.gym.picture import Picture

__all__ = ["show", "team_picture"]

PITCH = 0.5
"""The camera looks down by this [rad], north."""
NEAREST, ROOM = 14.0, 1.1
"""Of the camera from the team's middle, at least [m], and for each m of the team's radius."""
COLUMNS = 80
"""Of a picture in the terminal."""


def team_picture(picture: Picture, qpos: FloatArray, time: float, places: FloatArray, waves: Table) -> ByteArray:
    """A picture (height, width, 3) from the south, with all boats at `places`, (boats, 2) [m], in sight.

    The other arguments are those of `Picture.take`.
    """
    low, high = (places.min(axis=0), places.max(axis=0)) if len(places) else (np.zeros(2), np.zeros(2))
    away = NEAREST + ROOM * 0.5 * float(np.hypot(*(high - low)))
    x, y = (low + high) / 2.0
    place = np.array([x, y - away * np.cos(PITCH), away * np.sin(PITCH)])
    return picture.take(qpos, time, place, (0.0, PITCH, np.pi / 2), waves)


def show(picture: ByteArray) -> None:
    """Write a picture to the terminal, two pixels to a character, over the one before."""
    step = max(1, picture.shape[1] // COLUMNS)
    small = picture[::step, ::step]
    rows = (zip(small[k], small[k + 1], strict=True) for k in range(0, len(small) - 1, 2))
    lines = ("".join("\x1b[38;2;{};{};{}m\x1b[48;2;{};{};{}m▀".format(*up, *down) for up, down in row) for row in rows)
    sys.stdout.write("\x1b[H" + "\x1b[0m\n".join(lines) + "\x1b[0m\n")
    sys.stdout.flush()
