"""Thrusts that last until the next one, as VRX 3's, in worlds whose thrusters forget a command after a second."""

import math
from typing import NamedTuple

from vrx_mj.runtime.simulation import Simulation

__all__ = ["HeldThrust"]


class _Order(NamedTuple):
    command: float
    renewed: float
    """Simulated time at which it was given last [s]."""
    period: float
    """After which it is given again [s]."""


class HeldThrust:
    """The last command of each thruster that was told to go on."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._orders: dict[str, dict[str, _Order]] = {}

    def bind(self) -> None:
        """Boats came or went."""
        self._orders = {boat: orders for boat, orders in self._orders.items() if boat in self._sim.boats}

    def begin(self) -> None:
        """Time began anew, or others steer now."""
        self._orders.clear()

    def hold(self, boat: str, thruster: str, command: float) -> None:
        """Go on giving a command that the simulation has taken just now."""
        hull = self._sim.boats.index(boat)
        rows = self._sim.world.tree["thrusters"]
        timeout = next(row["timeout"] for row in rows if row["hull"] == hull and row["name"] == thruster)
        period = 0.5 * timeout if timeout > 0.0 else math.inf
        self._orders.setdefault(boat, {})[thruster] = _Order(command, self._sim.time, period)

    def let_go(self, boat: str, thruster: str | None = None) -> None:
        """Somebody else commands a thruster, or all of the boat's."""
        if thruster is None:
            self._orders.pop(boat, None)
        else:
            self._orders.get(boat, {}).pop(thruster, None)

    def renew(self) -> None:
        """Give commands again before they end."""
        time = self._sim.time
        due: dict[str, dict[str, float]] = {}
        for boat, orders in self._orders.items():
            for name, order in orders.items():
                if time - order.renewed >= order.period:
                    due.setdefault(boat, {})[name] = order.command
                    orders[name] = order._replace(renewed=time)
        if due:
            self._sim.command_all(due)
