"""The light buoy: three colours, a second each, then two seconds of dark, over and over."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray
from vrx_mj.control.placards import COLORS, vivid

__all__ = ["OFF", "lamp_color", "sequence"]

OFF = "off"
LEAST = 4
"""So many pixels of one colour are a lamp that is lit."""
PURE = 0.6
"""Share of the vivid pixels that have the lamp's colour."""
GAP = 0.07
"""What lies apart by more than this share of the picture's height are two things: of 2.8 m, lamp and box by 0.4 m."""


def lamp_color(window: ByteArray) -> str:
    """The colour of the lamps in a picture of a light buoy, or `OFF`.

    Under its lamps the buoy carries a yellow box, so the upper one of two coloured things is a lamp, and something
    yellow alone is none. So nothing need be known of how high the buoy floats, nor of how waves lift it and the boat.
    """
    codes = vivid(window)
    rows = np.nonzero((codes >= 0).any(axis=1))[0]
    parts = [codes[part] for part in np.split(rows, np.nonzero(np.diff(rows) > GAP * len(codes))[0] + 1)]
    colors = [color for color in map(_color, parts) if color]
    return colors[0] if len(colors) > 1 or colors[:1] not in ([], ["yellow"]) else OFF


def _color(codes: npt.NDArray[np.int_]) -> str:
    """The colour of most of the vivid pixels; empty where there is none."""
    counts = [int((codes == code).sum()) for code in range(len(COLORS))]
    most = int(np.argmax(counts))
    return COLORS[most] if counts[most] >= max(LEAST, PURE * sum(counts)) else ""


def sequence(seen: Sequence[tuple[float, str]]) -> list[str] | None:
    """The three colours between two darks, from looks at a time [s] each; None as long as there are none.

    Looks must come at least three in two seconds; a colour that only one look told counts, as long as three different
    ones in a row lie between the darks and the whole lasts 2 to 4 s.
    """
    runs: list[tuple[str, float]] = []
    for time, color in seen:
        if not runs or runs[-1][0] != color:
            runs.append((color, time))
    for start in range(len(runs) - 4):
        (before, _), *lit, (after, end) = runs[start : start + 5]
        colors = [color for color, _ in lit]
        if before == after == OFF and OFF not in colors and 2.0 <= end - lit[0][1] <= 4.0:
            return colors
    return None
