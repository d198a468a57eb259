"""Rows that the compiled loop copies while it runs, for recorders."""

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError, shown
from vrx_mj.runtime.timing import stride_of
from vrx_mj.tasks.frame import Message

STRIDE, COUNTDOWN, FILLED = 0, 1, 2
"""Columns of the sampling table: steps per row, steps until the next row, rows in the buffer."""

_BUFFER_BYTES = 4_000_000


class Listener(Protocol):
    """What a recorder offers to a simulation."""

    def rows(self, block: FloatArray) -> None:
        """Take sampled rows: [time, wind speed, thrusts, steering angles, qpos, qvel, displays' marks]."""

    def state(self, time: float, blob: bytes) -> None:
        """Take a saved state, once per simulated second."""

    def event(self, time: float, text: str, level: str) -> None:
        """Take a line of the log."""

    def frame(self, time: float, row: FloatArray, messages: Sequence[Message]) -> None:
        """Take a frame that the referee of the world's task looked at, as `tasks.layout` has it."""

    def boats_changed(self) -> None:
        """Boats have come or gone: later rows, states and frames are of the world as it is now."""


_METHODS = ("rows", "state", "event")
"""What every listener has; `frame` is called in worlds with a task, `boats_changed` when boats come and go."""


def check_listener(listener: object) -> None:
    """Check that something can be attached to a simulation.

    Raises:
        CommandError: it lacks a method of `Listener`, or is a class.
    """
    lacks = [name for name in _METHODS if not callable(getattr(listener, name, None))]
    if lacks or isinstance(listener, type):
        raise CommandError(
            f"invalid listener {shown(listener)}: an object with the methods {', '.join(_METHODS)} is needed"
        )


class Sampler:
    """A buffer that `advance` fills with rows, and the listeners that empty it, each at a rate of its own."""

    def __init__(self, columns: int, timestep: float) -> None:
        self.table = np.array([0, 0, 0], np.int64)
        self.buffer = np.zeros((0, columns))
        self._timestep = timestep
        self._strides: dict[Listener, int] = {}
        self._rows = 0

    @property
    def listeners(self) -> tuple[Listener, ...]:
        """Listeners that are attached."""
        return tuple(self._strides)

    def add(self, listener: Listener, rate: float) -> None:
        """Sample `rate` rows per simulated second (at most one per step) for a listener."""
        self.drain()
        self._strides[listener] = stride_of(rate, self._timestep)
        self._begin()

    def resize(self, columns: int) -> None:
        """Hand the filled rows over, and take rows of another width from now on, at the same steps."""
        self.drain()
        self._take(columns)

    def remove(self, listener: Listener) -> None:
        """Give it what is left, and stop sampling when nobody listens."""
        self.drain()
        del self._strides[listener]
        self._begin()

    def check_free(self, what: str) -> None:
        """Refuse what would make another run of the one that is recorded."""
        if self._strides:
            raise CommandError(
                f"{what} cannot be called while the run is recorded, since a recording holds one run: call it before "
                "the recording begins, or end the recording first"
            )

    def drain(self) -> None:
        """Hand the filled rows to the listeners, to each those that are due by its rate."""
        filled = int(self.table[FILLED])
        if not filled:
            return
        numbers = np.arange(self._rows, self._rows + filled) * self.table[STRIDE]
        self._rows += filled
        self.table[FILLED] = 0
        for listener, stride in self._strides.items():
            due = self.buffer[:filled][numbers % stride == 0]
            if len(due):
                listener.rows(due)

    def _begin(self) -> None:
        """Sample at the finest common stride of those who listen now."""
        self._take(self.buffer.shape[1])
        self._rows = 0
        self.table[:] = (math.gcd(*self._strides.values()), 0, 0)

    def _take(self, columns: int) -> None:
        """Make an empty buffer."""
        rows = max(64, _BUFFER_BYTES // (8 * columns)) if self._strides else 0
        self.buffer = np.zeros((rows, columns))
