"""What a boat's thrusters are, as a controller's author knows them: where they push, how hard, and on what command."""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.tables import NEWTONS, RUDDER, THRUSTER, Record
from vrx_mj.physics.thrust import force_point, thrust_force
from vrx_mj.runtime.loop_arrays import LoopArrays

__all__ = ["Thruster", "thrusters"]

SAMPLES = 401
"""Commands at which the mapping is tabulated."""
DRIVE = ("mapping", "max_command", "max_forward", "max_reverse")
"""Fields of a thruster's row that its mapping depends on."""


@dataclass(frozen=True)
class Thruster:
    """A propeller that pushes along a line; the command `NAME_angle` turns that about the vertical."""

    name: str
    position: tuple[float, float, float]
    """Where it pushes at zero steering [m], body frame."""
    direction: tuple[float, float, float]
    """Of a positive force at zero steering, unit vector, body frame."""
    max_angle: float
    """Largest steering angle either way [rad]; 0: fixed."""
    max_forward: float
    """Largest force ahead [N]."""
    max_reverse: float
    """Largest force astern [N], above 0."""
    in_newtons: bool
    """Whether a command is the force itself [N]; else it is a share of full power."""
    _commands: FloatArray = field(repr=False, compare=False)
    _forces: FloatArray = field(repr=False, compare=False)

    @property
    def max_command(self) -> float:
        """The command of the largest force ahead: 1, or that force [N] in a profile with commands in newtons."""
        return float(self._commands[-1])

    def command(self, force: float) -> float:
        """The command that gives a force [N], or the nearest that it can give; 0 for 0."""
        if force == 0.0:
            return 0.0
        return float(np.interp(force, self._forces, self._commands))


def thrusters(rig: LoopArrays, rows: dict[str, int]) -> dict[str, Thruster]:
    """A boat's propellers by name; `rows` are those of its thrusters and rudders in the rig's table."""
    return {name: _thruster(name, rig.thrusters[row]) for name, row in rows.items() if not _is_rudder(rig, row)}


def _is_rudder(rig: LoopArrays, row: int) -> bool:
    return bool(rig.thrusters["mapping"][row] == RUDDER)


def _thruster(name: str, row: Record) -> Thruster:
    drive = {field: row[field].item() for field in DRIVE}
    commands, forces, spread = _tabulated(**drive)
    toward = row["rotation"] @ row["direction"]
    x, y, z = (float(value) for value in force_point(row, 0.0))
    return Thruster(
        name,
        (x, y, z),
        (float(toward[0]), float(toward[1]), float(toward[2])),
        float(row["max_angle"]),
        float(forces[-1]),
        float(-forces[0]),
        bool(row["mapping"] == NEWTONS),
        commands,
        spread,
    )


@lru_cache(maxsize=64)
def _tabulated(**drive: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Commands, the forces [N] that they give, and the same forces with a slope where they do not change."""
    row = np.zeros(1, THRUSTER)[0]
    for name, value in drive.items():
        row[name] = value
    commands = np.linspace(-drive["max_command"], drive["max_command"], SAMPLES)
    forces = np.maximum.accumulate([thrust_force(row, float(command)) for command in commands])
    spread = forces + 1e-9 * np.arange(SAMPLES)  # where the force does not change, the smallest command
    for array in (commands, forces, spread):
        array.setflags(write=False)  # all thrusters of a kind have the same
    return commands, forces, spread
