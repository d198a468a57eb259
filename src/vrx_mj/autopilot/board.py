"""The board of an autopilot on a boat: what it measures, and which of its channels commands what.

Measurements have no errors: ArduPilot adds those of its own simulated sensors. Echo sounders are the boat's own, with
their rates and errors.

Axes are those of aircraft: north-east-down for the world, forward-right-down for the boat.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vrx_mj.arguments import check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import ImuConfig
from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.errors import CommandError
from vrx_mj.frames import quaternion_product, rotation_matrix
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import BLADES
from vrx_mj.runtime.battery import Charge
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.instruments import Draw, apparent_wind, inertia
from vrx_mj.sensors.readings import Mount, Place, place_of_mount

_FORWARD_RIGHT_DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""Axes of the board in those of the boat, forward-left-up."""
_FROM_EAST_NORTH_UP = np.array([0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0])
"""(4,) quaternion that turns axes east, north, up into north, east, down."""
_RANGE_FINDERS = 6
"""Number of range finders that an answer has room for, `rng_1` to `rng_6`."""
_EXACT, _NO_DRAW = ImuConfig(name="board", link="base_link"), Draw(0, "", "board", 0, 1.0)
"""An IMU without errors, and its draw without noise."""
_TRIM, _SPAN = 1500.0, (400.0, 400.0)
"""Width of a pulse that commands nothing, and how much less and more commands all [us]."""
_SAIL_TRIM, _SAIL_SPAN = 1000.0, (1000.0, 1000.0)
"""Trim and span of a sail's winch, which is hauled in at its trim [us]."""
MIN_PULSE, MAX_PULSE = 500, 2500
"""Pulses that a servo can get [us]; a channel without output has 0."""


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
        return (
            battery
            | self._ranges()
            | {
                "timestamp": time,
                "imu": {"gyro": unit.angular_velocity.tolist(), "accel_body": unit.linear_acceleration.tolist()},
                "position": self._north_east_down(place.position),
                "velocity": self._north_east_down(place.velocity),
                "quaternion": quaternion_product(_FROM_EAST_NORTH_UP, unit.orientation).tolist(),
                "windvane": self._windvane(place),
            }
        )

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


@dataclass(frozen=True)
class Channel:
    """A channel and the command that it gives."""

    command: str
    """Name of the command: a thruster, or what turns with `_angle` after it."""
    astern: float
    """The command of all astern, at most 0."""
    ahead: float
    """The command of all ahead, at least 0."""
    trim: float = _TRIM
    """Pulse that commands 0 [us]."""
    span: tuple[float, float] = _SPAN
    """How much shorter and longer the pulses are that command all [us]; below 0 for what turns the other way."""
    dead_band: float = 0.0
    """How far from the trim a pulse still commands nothing [us]."""

    def value(self, pulse: int) -> float:
        """The command of a pulse [us]; none without a pulse."""
        off = pulse - self.trim if pulse and abs(pulse - self.trim) > self.dead_band else 0.0
        share = max(-1.0, min(1.0, off / self.span[off > 0.0]))
        return share * self.ahead if share > 0.0 else -share * self.astern


Channels = Mapping[int, Channel]
"""Channels by number, from 1."""


def is_servo_pulse(pulse: int) -> bool:
    """Whether a servo can get a pulse [us]."""
    return pulse == 0 or MIN_PULSE <= pulse <= MAX_PULSE


def channels_of(world: World, boat: str) -> dict[int, Channel]:
    """The channels of a boat: those of its robot's `autopilot:`, else `_usual_channels`.

    Raises:
        UnknownNameError: its robot names a command that it has not.
        CommandError: what channels command is not clear.
    """
    given = next(each.autopilot for each in world.parameters.boats if each.name == boat)
    if not given:
        return _usual_channels(world, boat)
    known = _commands(world.parameters.thrusters_of(boat))
    found = {}
    for one in given:
        check_name(f"command of {boat}, which its robot's `autopilot:` has", one.command, known)
        usual = known[one.command]
        trim, span = (getattr(usual, key) if (own := getattr(one, key)) is None else own for key in ("trim", "span"))
        found[one.number] = replace(usual, trim=trim, span=span, dead_band=one.dead_band)
    return found


def _usual_channels(world: World, boat: str) -> dict[int, Channel]:
    """The channels of a boat as parameters of ArduPilot's Rover are usually set.

    Thrusters `left` and `right` are channels 1 and 3 (SERVO1_FUNCTION 73, SERVO3_FUNCTION 74); else what steers is
    channel 1 (26), the only thruster channel 3 (70) and the only sail channel 4 (89).

    Raises:
        CommandError: the boat has other thrusters.
    """
    own = world.parameters.thrusters_of(boat)
    known, pushing = _commands(own), [one.name for one in own if one.mapping not in BLADES]
    if {"left", "right"} <= set(pushing):
        return {1: known["left"], 3: known["right"]}
    sails = [one.name + ANGLE_SUFFIX for one in own if one.sail]
    steering = [name for name in known if name.endswith(ANGLE_SUFFIX) and name not in sails]
    if len(steering) != 1 or len(pushing) > 1 or len(sails) > 1 or not (pushing or sails):
        raise CommandError(
            f"it is not clear which channels command {boat}: set `autopilot:` in its robot's YAML, as in "
            f"{{1: left, 3: right}}; its commands: {', '.join(known) or 'none'}"
        )
    return {number: known[name] for number, names in ((1, steering), (3, pushing), (4, sails)) for name in names}


def _commands(own: Sequence[Thruster]) -> dict[str, Channel]:
    """Every command of a boat's thrusters, as channels usually have it."""
    found = {}
    for one in own:
        if one.mapping not in BLADES:
            found[one.name] = Channel(one.name, *one.command_limits)
        if one.max_angle:
            pulses = (_SAIL_TRIM, _SAIL_SPAN) if one.sail else (_TRIM, _SPAN)
            found[one.name + ANGLE_SUFFIX] = Channel(one.name + ANGLE_SUFFIX, -one.max_angle, one.max_angle, *pulses)
    return found
