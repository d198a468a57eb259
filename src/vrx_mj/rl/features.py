"""What boats observe: entries in units that make them about one, clipped, and what they are called."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vrx_mj.rl.problem import Entry
from vrx_mj.rl.seen import OWN, OWN_NAMES

__all__ = ["BOUND", "Features", "Floats32"]

Floats32 = npt.NDArray[np.float32]
BOUND = 5.0
"""Observations are clipped to this either way, in their units."""


class Features:
    """What a boat feels, its previous action, and what its problem tells, in this order."""

    def __init__(self, actions: Sequence[str], entries: Sequence[Entry]) -> None:
        """Take what the numbers of an action are called, and the problem's entries."""
        own = [Entry(name, scale) for name, scale in zip(OWN_NAMES, OWN.tolist(), strict=True)]
        told = [[f"{entry.name} in units of {entry.scale:g}" for entry in part] for part in (own, entries)]
        self.names = (*told[0], *actions, *told[1])
        """What each is, and in which unit."""
        self._scales = np.concatenate((OWN, np.ones(len(actions)), [entry.scale for entry in entries]))

    def of(self, *parts: npt.NDArray[np.floating]) -> Floats32:
        """The features (..., len(names)) of parts (..., k) in SI units; what is no number is 0."""
        whole = np.nan_to_num(np.concatenate(parts, axis=-1) / self._scales, nan=0.0)
        observed: Floats32 = np.clip(whole, -BOUND, BOUND).astype(np.float32)
        return observed
