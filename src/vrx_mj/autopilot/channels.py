"""Which channel of an autopilot commands what of a boat."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vrx_mj.errors import CommandError
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import BLADES
from vrx_mj.runtime.commands import ANGLE

TRIM, SPAN = 1500.0, 400.0
"""Width of a pulse that commands nothing, and how much more commands all [us]."""
SAIL_TRIM, SAIL_SPAN = 1000.0, 1000.0
"""Those of a sail's winch, which is hauled in at its trim."""
SHORTEST, LONGEST = 500, 2500
"""Pulses that a servo can get [us]; a channel without output has 0."""


@dataclass(frozen=True)
class Channel:
    """A channel and the command that it gives."""

    command: str
    """Name of the command: a thruster, or what turns with `_angle` after it."""
    astern: float
    """The command at `trim - span`, at most 0."""
    ahead: float
    """The command at `trim + span`, at least 0."""
    trim: float = TRIM
    """Pulse that commands 0 [us]."""
    span: float = SPAN
    """Pulse beyond the trim that commands all [us]; below 0 for what turns the other way."""

    def value(self, pulse: int) -> float:
        """The command of a pulse [us]; none without a pulse."""
        share = max(-1.0, min(1.0, (pulse - self.trim) / self.span)) if pulse else 0.0
        return share * self.ahead if share > 0.0 else -share * self.astern


Channels = Mapping[int, Channel]
"""By number, from 1."""


def is_servo_pulse(pulse: int) -> bool:
    """Whether a servo can get a pulse [us]."""
    return pulse == 0 or SHORTEST <= pulse <= LONGEST


def default_channels(world: World, boat: str) -> dict[int, Channel]:
    """The channels of a boat as parameters of ArduPilot's Rover are usually set.

    Thrusters `left` and `right` are channels 1 and 3 (SERVO1_FUNCTION 73, SERVO3_FUNCTION 74); else what steers is
    channel 1 (26), the only thruster channel 3 (70) and the only sail channel 4 (89).

    Raises:
        CommandError: the boat has other thrusters.
    """
    own = world.parameters.thrusters_of(boat)
    pushing = {one.name: one for one in own if one.mapping not in BLADES}
    if {"left", "right"} <= pushing.keys():
        return {1: _thrust(pushing["left"]), 3: _thrust(pushing["right"])}
    steering, sails = [one for one in own if one.sail is None and one.max_angle], [one for one in own if one.sail]
    if len(steering) != 1 or len(pushing) > 1 or len(sails) > 1 or not (pushing or sails):
        known = ", ".join(_commands(own)) or "none"
        raise CommandError(
            f"which channels command {boat} is not clear: `autopilot:` of its robot's YAML has to say it, as in "
            f"{{1: left, 3: right}}; its commands: {known}"
        )
    found = {1: _angle(steering[0])}
    if pushing:
        found[3] = _thrust(*pushing.values())
    if sails:
        found[4] = _angle(sails[0], SAIL_TRIM, SAIL_SPAN)
    return found


def _commands(own: Sequence[Thruster]) -> Iterator[str]:
    for one in own:
        if one.mapping not in BLADES:
            yield one.name
        if one.max_angle:
            yield one.name + ANGLE


def _thrust(thruster: Thruster) -> Channel:
    return Channel(thruster.name, *thruster.command_limits)


def _angle(thruster: Thruster, trim: float = TRIM, span: float = SPAN) -> Channel:
    return Channel(thruster.name + ANGLE, -thruster.max_angle, thruster.max_angle, trim, span)
