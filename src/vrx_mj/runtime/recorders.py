"""What a `Simulation` offers to those who record it."""

import math

import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_number, as_text
from vrx_mj.errors import CommandError, shown
from vrx_mj.runtime.rig import Rig
from vrx_mj.runtime.sampling import Listener, Sampler, check_listener
from vrx_mj.runtime.turns import Turn, in_turn

__all__ = ["Recorders"]


class Recorders:
    """The part of a simulation that gives rows, states and events to listeners."""

    _rig: Rig
    _sampler: Sampler
    _turn: Turn

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        raise NotImplementedError

    @in_turn
    def attach(self, listener: Listener, *, rate: float) -> None:
        """Attach a listener that gets `rate` rows per simulated second [Hz], one state per second, and events.

        Raises:
            CommandError: it has not the methods of a listener, is attached already, or the rate is not above 0.
        """
        check_listener(listener)
        if not 0.0 < as_number(rate) < math.inf:
            raise CommandError(f"invalid rate {shown(rate)}: a number of rows per second above 0 is needed")
        self._sampler.add(listener, as_number(rate))
        self._renew_arguments()
        try:
            self._keep()
        except BaseException:
            self._sampler.remove(listener)
            self._renew_arguments()
            raise

    @in_turn
    def detach(self, listener: Listener) -> None:
        """Deliver the remaining rows to a listener and detach it; CommandError if it is not attached."""
        if not any(one is listener for one in self._sampler.listeners):
            raise CommandError(f"invalid listener {shown(listener)}: one that is attached is needed")
        self._keep()
        self._sampler.remove(listener)
        listener.rows(self.row()[None])
        self._renew_arguments()

    def row(self) -> npt.NDArray[np.float64]:
        """Row of the current time, as listeners get it."""
        return self._rig.row(self.time)

    @in_turn
    def event(self, text: str, level: str = "INFO") -> None:
        """Write a log line to the recordings at the current time; CommandError if it is not text."""
        text, level = as_text("text", text), as_text("level", level)
        for listener in self._sampler.listeners:
            listener.event(self.time, text, level)

    def _renew_arguments(self) -> None:
        """Give the loop the present buffer of rows."""
        raise NotImplementedError

    def _keep(self) -> None:
        """Keep the present state, and give it to the listeners."""
        raise NotImplementedError
