"""Which channel of an autopilot commands what of a boat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import BLADES
from vrx_mj.runtime.commands import ANGLE

_TRIM, _SPAN = 1500.0, (400.0, 400.0)
"""Width of a pulse that commands nothing, and how much less and more commands all [us]."""
_SAIL_TRIM, _SAIL_SPAN = 1000.0, (1000.0, 1000.0)
"""Trim and span of a sail's winch, which is hauled in at its trim [us]."""
SHORTEST, LONGEST = 500, 2500
"""Pulses that a servo can get [us]; a channel without output has 0."""


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
    return pulse == 0 or SHORTEST <= pulse <= LONGEST


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
        if one.command not in known:
            raise UnknownNameError(f"command of {boat}, which its robot's `autopilot:` has", one.command, known)
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
    sails = [one.name + ANGLE for one in own if one.sail]
    steering = [name for name in known if name.endswith(ANGLE) and name not in sails]
    if len(steering) != 1 or len(pushing) > 1 or len(sails) > 1 or not (pushing or sails):
        raise CommandError(
            f"which channels command {boat} is not clear: `autopilot:` of its robot's YAML has to say it, as in "
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
            found[one.name + ANGLE] = Channel(one.name + ANGLE, -one.max_angle, one.max_angle, *pulses)
    return found
