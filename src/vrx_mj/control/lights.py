"""The light buoy: three colours, a second each, then two seconds of dark, over and over."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vrx_mj.control.placards import COLORS, vivid

__all__ = ["OFF", "lamp_color", "sequence"]

OFF = "off"
LEAST = 4
"""So many pixels of one colour are a lamp that is lit."""
PURE = 0.6
"""Share of the vivid pixels that have the lamp's colour."""


def lamp_color(window: npt.NDArray[np.uint8]) -> str:
    """The colour of a lamp in a small picture of it, or `OFF`."""
    codes = vivid(window)
    counts = [int((codes == code).sum()) for code in range(len(COLORS))]
    most = int(np.argmax(counts))
    if counts[most] < LEAST or counts[most] < PURE * sum(counts):
        return OFF
    return COLORS[most]


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
