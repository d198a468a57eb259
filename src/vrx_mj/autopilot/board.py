"""What an autopilot's board on a boat measures, without errors: ArduPilot adds those of its own simulated sensors.

Echo sounders are the boat's own, with their rates and errors.

Axes are those of aircraft: north-east-down for the world, forward-right-down for the boat.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import ImuConfig
from vrx_mj.frames import quaternion_product, rotation_matrix
from vrx_mj.runtime.battery import Charge
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.anemometer import apparent_wind
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.imu import inertia
from vrx_mj.sensors.places import Mount, Place, place_of_mount

_FORWARD_RIGHT_DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""Axes of the board in those of the boat, forward-left-up."""
_FROM_EAST_NORTH_UP = np.array([0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0])
"""(4,) quaternion that turns axes east, north, up into north, east, down."""
_RANGE_FINDERS = 6
"""Range finders that an answer has room for, `rng_1` to `rng_6`."""
_EXACT, _NO_DRAW = ImuConfig(name="board", link="base_link"), Draw(0, "", "board", 0, 1.0)


class Board:
    """The board of one boat: where it is, how it moves, and what its inertial unit measures."""

    def __init__(self, sim: Simulation, boat: str, position: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Mount it at a position (3,) [m] from the boat's origin, body axes forward-left-up."""
        self._sim, self._boat = sim, boat
        self._mount = Mount.of(position, _FORWARD_RIGHT_DOWN)
        self._gravity = np.array(sim.model.opt.gravity)
        self._before: tuple[float, Place] | None = None
        own = next(each for each in sim.world.parameters.boats if each.name == boat)
        sounders = [one.name for one in sim.mounted(boat) if one.config.type == "echo_sounder"]
        self._sounders = sounders[:_RANGE_FINDERS]
        self._charge = Charge(sim, boat, own.battery) if own.battery else None

    def restart(self) -> None:
        """Time begins anew: there is nothing before the next measurement."""
        self._before = None
        if self._charge is not None:
            self._charge.restart()

    def measure(self) -> dict[str, Any]:
        """The state of this moment, as `packets.answer` takes it.

        Rates [rad/s] and specific force [m/s2] are means since the last call, so that an autopilot that integrates them
        gets the change of attitude and velocity; at the first call and after a reset they are those of a moment without
        acceleration.
        """
        time, place = self._sim.time, self._place()
        before, self._before = self._before, (time, place)
        interval = time - before[0] if before else 0.0
        unit = inertia(
            _EXACT,
            place,
            before[1] if before and interval > 0.0 else None,
            interval,
            self._gravity,
            _NO_DRAW,
            self._sim.world.parameters.x_from_east,
        )
        battery = {} if self._charge is None else {"battery": self._charge.measure()}
        optional = battery | self._ranges()
        return optional | {
            "timestamp": time,
            "imu": {"gyro": _numbers(unit.angular_velocity), "accel_body": _numbers(unit.linear_acceleration)},
            "position": self._north_east_down(place.position),
            "velocity": self._north_east_down(place.velocity),
            "quaternion": _numbers(quaternion_product(_FROM_EAST_NORTH_UP, unit.orientation)),
            "windvane": self._windvane(place),
        }

    def _ranges(self) -> dict[str, float]:
        """Readings [m] of the boat's echo sounders, in their order; what hears no echo gives twice its range's end."""
        echoes = [self._sim.sense(self._boat)[name].data for name in self._sounders]
        return {f"rng_{number}": min(one.range, 2.0 * one.range_max) for number, one in enumerate(echoes, 1)}

    def _place(self) -> Place:
        seen = self._sim.observe()[self._boat]
        velocity = rotation_matrix(seen.quaternion) @ seen.velocity
        pose = np.concatenate((seen.position, seen.quaternion))
        return place_of_mount(pose, np.concatenate((velocity, seen.angular_velocity)), self._mount)

    def _north_east_down(self, vector: FloatArray) -> list[float]:
        """A vector (3,) of the world's axes."""
        x, y, z = vector.tolist()
        turn = self._sim.world.parameters.x_from_east
        cos, sin = math.cos(turn), math.sin(turn)
        return [sin * x + cos * y, cos * x - sin * y, -z]

    def _windvane(self, place: Place) -> dict[str, float]:
        """Apparent wind: where it comes from [rad], clockwise from ahead, and its speed [m/s]."""
        sim = self._sim
        flow = apparent_wind(sim.wind.velocity, sim.time, sim.world.parameters.sea.level, place)
        ahead, right, _ = (-flow).tolist()
        return {"direction": math.atan2(right, ahead), "speed": math.hypot(ahead, right)}


def _numbers(values: FloatArray) -> list[float]:
    return [float(value) for value in values]
