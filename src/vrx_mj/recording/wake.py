"""Wakes: the way of each boat over the last seconds, as a line that lies on the sea and sinks into its colour."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.recording.scene import SeaHeight

__all__ = ["FADES", "WAKE_RATE", "Wake"]


WAKE_RATE = 2.0
"""Wakes drawn, and points that a boat leaves, per second [Hz]."""
LASTS = 20.0
"""How long a point is seen [s]."""
FADES = ((214, 232, 240), (150, 186, 204), (98, 142, 168), (60, 104, 134))
"""Colours of a wake from the boat to its end, each over as long a time: the last is nearly that of the sea."""
OVER = 0.06
"""Height over the water [m], so that the facets of the sea's mesh hide no piece."""


class Wake:
    """The wake of a boat."""

    def __init__(self) -> None:
        self._left = np.zeros((0, 3))

    def strips(self, time: float, place: FloatArray, height: SeaHeight) -> list[npt.NDArray[np.float32]]:
        """Leave a point at `time` [s] at a place (2,) [m]; the wake then, a strip (n, 3) [m] for each colour.

        Every point lies on the sea as it is at `time`. The first is the newest; strips begin where the one before ends.
        """
        self._left = np.concatenate([[(time, *place)], self._left])
        self._left = self._left[time - self._left[:, 0] <= LASTS + 1e-6]
        x, y = self._left[:, 1], self._left[:, 2]
        points = np.column_stack([x, y, np.asarray(height(x, y, time)) + OVER]).astype(np.float32)
        share = np.minimum((time - self._left[:, 0]) / LASTS * len(FADES), len(FADES) - 1e-9).astype(int)
        ends = np.searchsorted(share, np.arange(len(FADES) + 1))
        return [points[max(begin - 1, 0) : end] for begin, end in pairwise(ends)]
