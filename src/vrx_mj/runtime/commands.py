"""Commands of boats: names and numbers checked, then written into the thrusters' state."""

import math
from collections.abc import Mapping, Sequence

from vrx_mj.arguments import as_number, check_name
from vrx_mj.errors import CommandError, shown
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import RUDDER
from vrx_mj.runtime.loop_arrays import LoopArrays

Commands = Mapping[str, Mapping[str, float]]
"""Boat -> {thruster: command, or thruster_angle: rad}."""

ANGLE = "_angle"


class Helm:
    """The names that take commands, and where they go; a rudder takes an angle alone."""

    def __init__(self, boats: Sequence[str], rows: Sequence[Thruster]) -> None:
        self._channels: dict[str, dict[str, tuple[int, str]]] = {boat: {} for boat in boats}
        self.thrusters: dict[str, dict[str, int]] = {boat: {} for boat in boats}
        for index, row in enumerate(rows):
            boat = boats[row.hull]
            if row.mapping != RUDDER:
                self._channels[boat][row.name] = (index, "command")
            self.thrusters[boat][row.name] = index
        for index, row in enumerate(rows):
            self._channels[boats[row.hull]].setdefault(row.name + ANGLE, (index, "angle_target"))

    def names(self, boat: str) -> tuple[str, ...]:
        """Every command that the boat takes.

        Raises:
            UnknownNameError: no boat has that name.
        """
        check_name("boat", boat, self._channels)
        return tuple(self._channels[boat])

    def refuse(self, boat: str, given: tuple[object, ...]) -> None:
        """Tell who gave a boat commands without names that they have names.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: always.
        """
        names = self.names(boat)
        example = f"command({boat!r}, {names[0]}=0.5)" if names else f"command({boat!r})"
        raise CommandError(
            f"invalid commands {', '.join(map(shown, given))} for {boat}: each needs its name, as in {example}; known: "
            f"{', '.join(names) or 'none'}"
        )

    def give(self, rig: LoopArrays, commands: Commands, time: float, hold: float) -> None:
        """Set commands at `time` [s]; a thrust lasts for its thruster's timeout, and at least `hold` [s].

        All of them are checked before any is set.

        Raises:
            UnknownNameError: no such boat, or no such thruster on it.
            CommandError: a command is not a finite number.
        """
        for index, column, value in self._checked(commands):
            rig.thruster_state[column][index] = value
            if column == "command":
                timeout = float(rig.thrusters["timeout"][index])
                lasts = max(timeout, hold) if timeout > 0.0 else math.inf
                rig.thruster_state["expires"][index] = time + lasts

    def _checked(self, commands: Commands) -> list[tuple[int, str, float]]:
        if not isinstance(commands, Mapping):
            raise CommandError(f"invalid commands {shown(commands)}: a mapping by boat is needed, " + EXAMPLE)
        checked = []
        for boat, values in commands.items():
            names = self.names(boat)
            if not isinstance(values, Mapping):
                raise CommandError(
                    f"invalid commands {shown(values)} for {boat}: a mapping by thruster is needed, {EXAMPLE}"
                )
            for name, value in values.items():
                check_name(f"thruster of {boat}", name, names)
                checked.append((*self._channels[boat][name], _number(boat, name, value)))
        return checked


EXAMPLE = 'as in {"wamv1": {"left": 0.5, "left_angle": 0.1}}'


def _number(boat: str, name: str, value: object) -> float:
    given = as_number(value)
    if not math.isfinite(given):
        raise CommandError(f"invalid command {shown(value)} for {name} of {boat}: a finite number is needed")
    return given
