"""Actions of teams: arrays of worlds x boats x channels, and the flat commands of a batch."""

from collections.abc import Sequence

import gymnasium
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.rl.features import Floats32
from vrx_mj.rl.gym import commanded
from vrx_mj.rl.options import as_floats

__all__ = ["ActionError", "Actions"]


class ActionError(gymnasium.error.InvalidAction, AssertionError):
    """An invalid action: an AssertionError, as in PettingZoo, and an InvalidAction, as in Gymnasium."""


class Actions:
    """Which channel of which boat is which command of the batch; boats may have unlike numbers of channels."""

    def __init__(self, boats: Sequence[str], channels: Sequence[tuple[str, str]], largest: FloatArray) -> None:
        """Take the boats, and a batch's channels, boat and name of each, with their limits, (channels, 2)."""
        self._boats = tuple(boats)
        self.names = {boat: tuple(name for owner, name in channels if owner == boat) for boat in boats}
        self._boat = np.array([self._boats.index(boat) for boat, _ in channels], np.int64)
        self._channel = np.array([self.names[boat].index(name) for boat, name in channels], np.int64)
        self._limits = np.abs(largest)
        self._own = np.array([len(self.names[boat]) for boat in boats])

    @property
    def most(self) -> int:
        """Channels of the boat that has the most."""
        return int(self._own.max())

    def columns(self) -> list[str]:
        """What the numbers of an action are called where they mean another channel for every boat."""
        return [f"previous action {k + 1}" for k in range(self.most)]

    def commands(self, actions: Floats32) -> FloatArray:
        """The batch's commands (rows, channels) that actions (rows, boats, most) mean."""
        return commanded(actions[:, self._boat, self._channel], self._limits)

    def checked(self, actions: npt.ArrayLike, present: BoolArray) -> Floats32:
        """Actions (n, boats, most), zero for absent boats and where a boat has no channel.

        Raises:
            ActionError: another shape, or a number of a present boat is not within -1 and 1.
        """
        try:
            given = as_floats(actions)
        except gymnasium.error.InvalidAction:
            raise ActionError("invalid actions: an array of numbers is needed") from None
        shape = (*present.shape, self.most)
        if given.shape != shape:
            raise ActionError(f"invalid actions of shape {given.shape}: {shape} is needed")
        counts = present[..., None] & (np.arange(self.most) < self._own[:, None])
        wrong = counts & ~(np.abs(given) <= 1.0)
        if wrong.any():
            row, boat, channel = (int(index) for index in np.argwhere(wrong)[0])
            raise ActionError(f"row {row}: {self.told(self._boats[boat], channel, float(given[row, boat, channel]))}")
        return np.where(counts, given, np.float32(0.0))

    def told(self, boat: str, channel: int, value: float) -> str:
        """What is wrong with a number."""
        return f"invalid action {value:g} for {self.names[boat][channel]} of {boat}: a number from -1 to 1 is needed"
