"""What a trial records and finds: the vessel's states over time, and figures with their units.

A vessel as trials see it: it takes a power and a helm, and has a position, a heading and speeds.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.runtime.simulation import Simulation

_FULL_HELM = math.radians(35.0)
"""Angle of rudders and turning engines at full helm [rad], unless they turn less."""
_AHEAD = 0.7
"""Cosine of the angle to the bow up to which an engine drives the boat."""


class VesselState(NamedTuple):
    """State of a vessel; horizontal axes may be any, and velocities are those of its own axes."""

    time: float
    """Time [s]."""
    x: float
    """Position along x [m]."""
    y: float
    """Position along y [m]."""
    z: float
    """Height [m]."""
    heading: float
    """Heading [rad], counter-clockwise from x."""
    roll: float
    """Roll [rad]."""
    pitch: float
    """Pitch [rad]."""
    surge: float
    """Speed ahead [m/s]."""
    sway: float
    """Speed to port [m/s]."""
    yaw_rate: float
    """Rate of turn [rad/s], counter-clockwise."""


class Vessel(Protocol):
    """What a trial is made with: a boat of a simulation, or a model of one."""

    @property
    def state(self) -> VesselState:
        """The state now."""

    def advance(self, power: float, helm: float, duration: float) -> None:
        """Go on for a duration [s] under power -1 to 1 and helm -1 to 1, positive to port."""

    def displace(self, mode: str, amount: float) -> None:
        """Put it aside at rest: `heave` [m], `roll` or `pitch` [rad]."""


class SimulatedVessel:
    """A boat of a simulation.

    The helm turns rudders, or engines that can be turned, by up to 35 degrees; without any of these the engines of the
    inner side give less, and none at full helm.
    """

    def __init__(self, sim: Simulation, boat: str) -> None:
        """Take a boat, which needs at least one engine that drives it ahead for anything but a decay."""
        self._sim, self._boat = sim, boat
        seen = sim.observe()[boat]
        thrusters = seen.thrusters.values()
        self._engines = [engine for engine in thrusters if engine.direction[0] > _AHEAD]
        rudders = seen.hull.rudders.values() if seen.hull else ()
        self._rudders = {f"{rudder.name}_angle": min(rudder.max_angle, _FULL_HELM) for rudder in rudders}
        if not self._rudders:
            turning = (engine for engine in self._engines if engine.max_angle > 0.0)
            self._rudders = {f"{engine.name}_angle": min(engine.max_angle, _FULL_HELM) for engine in turning}

    @property
    def helm(self) -> str:
        """What the helm is, in words."""
        if self._rudders:
            degrees = math.degrees(max(self._rudders.values()))
            return f"{', '.join(sorted(self._rudders))}: up to {degrees:.3g} degrees"
        return "less thrust on the inner side: none at full helm"

    @property
    def state(self) -> VesselState:
        """The state of the boat now."""
        seen = self._sim.observe()[self._boat]
        x, y, z = (float(value) for value in seen.position)
        return VesselState(
            self._sim.time, x, y, z, seen.heading, seen.roll, seen.pitch,
            float(seen.velocity[0]), float(seen.velocity[1]), float(seen.angular_velocity[2]),
        )  # fmt: skip

    def advance(self, power: float, helm: float, duration: float) -> None:
        """Go on for a duration [s].

        Raises:
            CommandError: the boat has no engine, and power is asked of it.
        """
        if power and not self._engines:
            raise CommandError(
                f"boat '{self._boat}' has no engine that drives it ahead: only the trial decay is possible"
            )
        steering = {name: -helm * most for name, most in self._rudders.items()}
        self._sim.step({self._boat: {**self._thrusts(power, helm), **steering}}, duration=duration)

    def _thrusts(self, power: float, helm: float) -> dict[str, float]:
        """Commands of the engines; astern the engines of the inner side give less, too."""
        found = {}
        for engine in self._engines:
            inner = not self._rudders and engine.position[1] * helm > 0.0
            found[engine.name] = power * engine.max_command * (1.0 - abs(helm) * inner)
        return found

    def displace(self, mode: str, amount: float) -> None:
        """Put the boat aside from where it is, at rest."""
        now = self.state
        moved = {"z": now.z, "roll": now.roll, "pitch": now.pitch}
        moved["z" if mode == "heave" else mode] += amount
        pose = (now.x, now.y, moved["z"], moved["roll"], moved["pitch"], now.heading)
        self._sim.set_boat(self._boat, pose=pose, velocity=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True)
class Figure:
    """A number of a trial."""

    value: float
    """Value; NaN if the trial did not get to it."""
    unit: str
    """Unit of the value."""
    meaning: str
    """What it is, in words."""


@dataclass(frozen=True)
class Track:
    """States of a vessel over time, (n,) each, from the moment at which the trial begins.

    x points along the heading at that moment, y to its left.
    """

    time: FloatArray
    """Time [s]."""
    x: FloatArray
    """Distance ahead [m]."""
    y: FloatArray
    """Distance to port [m]."""
    heading: FloatArray
    """Change of heading [rad], positive to port, without jumps."""
    surge: FloatArray
    """Speed ahead [m/s]."""
    sway: FloatArray
    """Speed to port [m/s]."""
    yaw_rate: FloatArray
    """Rate of turn [rad/s], positive to port."""
    helm: FloatArray
    """Helm -1 to 1, positive turns to port."""


def track_of(states: Sequence[VesselState], helms: Sequence[float]) -> Track:
    """The track of states and of the helm at each, from the first of them."""
    rows = np.array([(s.time, s.x, s.y, s.heading, s.surge, s.sway, s.yaw_rate) for s in states], np.float64)
    time, x, y, heading, surge, sway, rate = rows.T
    cos, sin = math.cos(heading[0]), math.sin(heading[0])
    east, north = x - x[0], y - y[0]
    return Track(
        time - time[0], cos * east + sin * north, cos * north - sin * east, np.unwrap(heading) - heading[0],
        surge, sway, rate, np.array(helms, np.float64),
    )  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """A trial that has been carried out."""

    name: str
    """Name of the trial."""
    figures: Mapping[str, Figure]
    """Figures of the trial by name."""
    curves: Mapping[str, tuple[FloatArray, FloatArray]]
    """Curves of its chart by name: abscissae and ordinates."""
    axes: tuple[str, str]
    """Names and units of the chart's axes."""
    track: Track
    """States of the vessel."""
    remarks: tuple[str, ...] = ()
    """Why figures are missing, or are not what they seem."""


def crossing(x: FloatArray, y: FloatArray, level: float) -> float:
    """Abscissa at which ordinates first reach a level from below, by a straight line; not a number if they do not."""
    beyond = np.flatnonzero(y >= level)
    if not len(beyond) or beyond[0] == 0:
        return math.nan
    i = int(beyond[0])
    return float(x[i - 1] + (level - y[i - 1]) / (y[i] - y[i - 1]) * (x[i] - x[i - 1]))
