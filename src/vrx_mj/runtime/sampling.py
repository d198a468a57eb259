"""Rows that the compiled loop copies while it runs, for recorders."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

STRIDE, COUNTDOWN, FILLED = 0, 1, 2
"""Columns of the sampling table: steps per row, steps until the next row, rows in the buffer."""

BUFFER_BYTES = 4_000_000


class Listener(Protocol):
    """What a recorder offers to a simulation."""

    def rows(self, block: FloatArray) -> None:
        """Take sampled rows: [time, wind speed, thrusts, steering angles, qpos, qvel]."""

    def state(self, time: float, blob: bytes) -> None:
        """Take a saved state, once per simulated second."""

    def event(self, time: float, text: str, level: str) -> None:
        """Take a line of the log."""


class Sampler:
    """A buffer that `advance` fills, one row every `stride` steps, and the listeners that empty it."""

    def __init__(self, columns: int, timestep: float) -> None:
        self.table = np.array([0, 0, 0], np.int64)
        self.buffer = np.zeros((0, columns))
        self._timestep = timestep
        self._listeners: list[Listener] = []

    @property
    def listeners(self) -> tuple[Listener, ...]:
        """Those who listen now."""
        return tuple(self._listeners)

    def add(self, listener: Listener, rate: float) -> None:
        """Sample `rate` rows per simulated second (at most one per step) for a listener."""
        stride = max(1, round(1.0 / (rate * self._timestep)))
        columns = self.buffer.shape[1]
        self.drain()
        self.buffer = np.zeros((max(64, BUFFER_BYTES // (8 * columns)), columns))
        self.table[:] = (stride if not self._listeners else min(stride, self.table[STRIDE]), 0, 0)
        self._listeners.append(listener)

    def remove(self, listener: Listener) -> None:
        """Give it what is left, and stop sampling when nobody listens."""
        self.drain()
        self._listeners.remove(listener)
        if not self._listeners:
            self.table[:] = 0
            self.buffer = np.zeros((0, self.buffer.shape[1]))

    def restart(self) -> None:
        """Begin with a row at once: the state was set from outside."""
        self.drain()
        self.table[COUNTDOWN] = 0

    def drain(self) -> None:
        """Hand the filled rows to the listeners."""
        filled = int(self.table[FILLED])
        if not filled:
            return
        block = self.buffer[:filled].copy()
        self.table[FILLED] = 0
        for listener in self._listeners:
            listener.rows(block)
