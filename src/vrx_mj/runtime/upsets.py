"""Boats that capsize, or spin faster than boats do: said once each, with numbers."""

import math
import warnings

import numpy as np

from vrx_mj.errors import VrxWarning
from vrx_mj.runtime.observation import BoatObservation, Observation

__all__ = ["FASTEST_SPIN", "Upsets", "is_capsized", "spin", "tilt"]

FASTEST_SPIN = 12.0
"""Rate of turn [rad/s] that no boat reaches by itself: two turns a second."""


def tilt(boat: BoatObservation) -> float:
    """Angle between a boat's mast and the vertical [rad]."""
    return math.acos(max(-1.0, min(1.0, math.cos(boat.roll) * math.cos(boat.pitch))))


def is_capsized(boat: BoatObservation) -> bool:
    """Whether a boat's mast points downward."""
    return tilt(boat) > math.pi / 2


def spin(boat: BoatObservation) -> float:
    """Rate of turn about whatever axis [rad/s]."""
    return float(np.linalg.norm(boat.angular_velocity))


class Upsets:
    """What is wrong with how boats move, as far as it was said."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        """What was said."""
        self._said: set[tuple[str, str]] = set()

    def warn(self, seen: Observation, time: float) -> None:
        """Warn of what is wrong at a time [s]."""
        for line in self.look(seen, time):
            self.lines.append(line)
            warnings.warn(line, VrxWarning, stacklevel=3)

    def look(self, seen: Observation, time: float) -> list[str]:
        """What is wrong at a time [s] and was not said of that boat before."""
        found = []
        for name, boat in seen.items():
            if is_capsized(boat) and self._is_new(name, "capsized"):
                angle = math.degrees(tilt(boat))
                found.append(f"{name} has capsized at t = {time:.1f} s: it is {angle:.0f} degrees from upright")
            if spin(boat) > FASTEST_SPIN and self._is_new(name, "spins"):
                found.append(
                    f"{name} spins at {spin(boat):.3g} rad/s at t = {time:.1f} s, more than {FASTEST_SPIN:g}: "
                    "check masses, inertias and floats of its robot"
                )
        return found

    def _is_new(self, boat: str, what: str) -> bool:
        if (boat, what) in self._said:
            return False
        self._said.add((boat, what))
        return True
