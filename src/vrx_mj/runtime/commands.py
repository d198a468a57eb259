"""Commands of boats: names and numbers checked, then written into the thrusters' state."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from vrx_mj.arguments import as_number, check_name
from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.errors import CommandError, quote
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.loop_arrays import LoopArrays

Commands = Mapping[str, Mapping[str, float]]
"""Boat -> {thruster: command, or thruster_angle: rad}."""

_EXAMPLE = 'as in {"wamv1": {"left": 0.5, "left_angle": 0.1}}'
"""Example of commands, in messages."""


class Channel(NamedTuple):
    """A command that a boat takes: a thrust, or a steering angle."""

    boat: str
    name: str
    row: int
    """Row of its thruster in the tables."""
    column: str
    """Column of `THRUSTER_STATE` that has the command."""
    limits: tuple[float, float]
    """Least and greatest value that changes anything."""
    timeout: float
    """For how long a thrust lasts [s]; 0: until the next."""

    def number(self, value: object, where: str = "") -> float:
        """A value of this command; CommandError if it is not a finite number."""
        number = as_number(value)
        if not math.isfinite(number):
            needed = "a finite number is needed"
            raise CommandError(f"invalid command {quote(value)} for {self.name} of {self.boat}{where}: {needed}")
        return number

    def write(self, state: Table, value: float, time: float, hold: float) -> None:
        """Set the command at `time` [s] in `state`, a `THRUSTER_STATE`.

        A thrust lasts for the thruster's timeout, and at least `hold` [s].
        """
        state[self.column][self.row] = value
        if self.column == "command":
            state["expires"][self.row] = time + (max(self.timeout, hold) if self.timeout > 0.0 else math.inf)


def channels_of(world: World) -> tuple[Channel, ...]:
    """Every command of a world: thrusts, then angles; rudders and sails have no thrust, what is fixed has no angle."""
    pushing, steering = [], []
    for number, given in enumerate(world.parameters.thrusters):
        boat, name, angle = world.boats[given.hull], given.name, given.max_angle
        if not given.is_blade:
            pushing.append(Channel(boat, name, number, "command", given.command_limits, given.timeout))
        if angle > 0.0:
            steering.append(Channel(boat, name + ANGLE_SUFFIX, number, "angle_target", (-angle, angle), given.timeout))
    return (*pushing, *steering)


def clipped_commands(world: World, boat: str, commands: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Commands beyond what a boat's thrusters do: the name of each, and what becomes of it."""
    own = {thruster.name: thruster for thruster in world.parameters.thrusters_of(boat)}
    for name, value in commands.items():
        angle = name.endswith(ANGLE_SUFFIX)
        thruster = own.get(name.removesuffix(ANGLE_SUFFIX))
        if thruster is None:
            continue
        least, most = (-thruster.max_angle, thruster.max_angle) if angle else thruster.command_limits
        if value < least - 1e-6 or value > most + 1e-6:
            yield name, f"{name} of {boat} is {_clipping_text(value, thruster, angle=angle)}"


def _clipping_text(value: float, thruster: Thruster, *, angle: bool) -> str:
    if angle:
        largest = thruster.max_angle
        return f"{value:.4g} rad: the angle is clamped to {min(max(value, -largest), largest):.4g} rad"
    ahead, astern = thruster.max_forward, abs(thruster.max_reverse)
    least, most = thruster.command_limits
    unit = " N" if thruster.in_newtons else ""
    text = f"{value:.4g}{unit}, outside {least:g} to {most:g}"
    return f"{text}: the force is clamped to {ahead:g} N ahead, {astern:g} N astern"


class CommandNames:
    """The names that take commands, and where they go."""

    def __init__(self, world: World) -> None:
        """Commands of a world's boats."""
        self._channels: dict[str, dict[str, Channel]] = {boat: {} for boat in world.boats}
        self.thrusters: dict[str, dict[str, int]] = {boat: {} for boat in world.boats}
        for channel in channels_of(world):
            self._channels[channel.boat].setdefault(channel.name, channel)
        for index, thruster in enumerate(world.parameters.thrusters):
            self.thrusters[world.boats[thruster.hull]][thruster.name] = index

    def names(self, boat: str) -> tuple[str, ...]:
        """Every command that the boat takes.

        Raises:
            UnknownNameError: no boat has that name.
        """
        check_name("boat", boat, self._channels)
        return tuple(self._channels[boat])

    def refuse(self, boat: str, given: tuple[object, ...]) -> None:
        """Refuse commands that were given without their names.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: always.
        """
        names = self.names(boat)
        example = f"command({boat!r}, {names[0]}=0.5)" if names else f"command({boat!r})"
        raise CommandError(
            f"invalid commands {', '.join(map(quote, given))} for {boat}: each needs its name, as in {example}; known: "
            f"{', '.join(names) or 'none'}"
        )

    def give(self, arrays: LoopArrays, commands: Commands, time: float, hold: float) -> None:
        """Set commands at `time` [s]; a thrust lasts for its thruster's timeout, and at least `hold` [s].

        All of them are checked before any is set.

        Raises:
            UnknownNameError: no such boat, or no such thruster on it.
            CommandError: a command is not a finite number.
        """
        for channel, value in self._channel_values(commands):
            channel.write(arrays.thruster_state, value, time, hold)

    def _channel_values(self, commands: Commands) -> list[tuple[Channel, float]]:
        if not isinstance(commands, Mapping):
            raise CommandError(f"invalid commands {quote(commands)}: a mapping by boat is needed, " + _EXAMPLE)
        checked = []
        for boat, values in commands.items():
            names = self.names(boat)
            if not isinstance(values, Mapping):
                raise CommandError(
                    f"invalid commands {quote(values)} for {boat}: a mapping by thruster is needed, {_EXAMPLE}"
                )
            for name, value in values.items():
                check_name(f"thruster of {boat}", name, names)
                channel = self._channels[boat][name]
                checked.append((channel, channel.number(value)))
        return checked
