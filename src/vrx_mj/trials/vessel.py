"""A vessel as trials see it: it takes a power and a helm, and has a position, a heading and speeds."""

import math
from typing import NamedTuple, Protocol

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
            raise CommandError(f"boat '{self._boat}' has no engine that drives it ahead: only decay can be tried")
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
