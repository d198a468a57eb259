"""What is left in a boat's battery: charge, voltage and current from the energy that its propellers draw."""

import math

import numpy as np

from vrx_mj.errors import CommandError
from vrx_mj.model.boats import Battery
from vrx_mj.runtime.simulation import Simulation

_HOUR = 3600.0
"""Seconds in an hour."""


class Charge:
    """The charge of one boat's battery, which is full at the start of a run."""

    def __init__(self, sim: Simulation, boat: str, battery: Battery) -> None:
        self._sim, self._boat, self._battery = sim, boat, battery
        self._shares, self._voltages = np.array(battery.voltage).T
        self.restart()

    def restart(self) -> None:
        """A run begins."""
        self.left = 1.0
        """Share of the charge."""
        self._before = self._sim.time, self._energy()

    def measure(self) -> dict[str, float]:
        """Voltage [V] and current [A], means since the last call.

        The current I of a power P from a battery of voltage U at rest and resistance R is that for which
        (U - R I) I = P; a battery that cannot give the power gives what it can, at half its voltage.
        """
        (begun, before), now = self._before, (self._sim.time, self._energy())
        self._before = now
        interval = now[0] - begun
        power = (now[1] - before) / interval if interval > 0.0 else 0.0
        rest = float(np.interp(self.left, self._shares, self._voltages))
        voltage = 0.5 * (rest + math.sqrt(max(rest * rest - 4.0 * self._battery.resistance * power, 0.0)))
        current = power / voltage
        self.left = max(0.0, self.left - current * interval / (_HOUR * self._battery.capacity))
        return {"voltage": voltage, "current": current}

    def _energy(self) -> float:
        """Energy [J]; 0 where no power of a propeller is known."""
        try:
            return self._sim.energy(self._boat)
        except CommandError:
            return 0.0
