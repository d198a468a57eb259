"""A propeller whose thrust was measured, for worlds of profile `marine`."""

from typing import Annotated

from pydantic import Field

from vrx_mj.config.base import Config, Fault, unsorted_rows
from vrx_mj.config.values import MAX_NUMBER, NonNegative, Number, Positive, numbers

Point = Annotated[tuple[Number, Number], numbers("command thrust")]


class PropellerConfig(Config):
    """A propeller whose thrust was measured, in worlds of profile `marine`, instead of the thruster's own curve."""

    thrust: Annotated[tuple[Point, ...], Field(max_length=1000)]
    """Commands -1..1 and the thrust at rest that each gives [N], by rising command, with `[0, 0]`.

    A command is a share of the thruster's `max_command`. Between rows are straight lines; a command beyond the first
    or the last gives that one's thrust."""
    diameter: Annotated[Positive, Field(le=20)]
    """Diameter [m]; what of the disc is in air pushes nothing and draws no power."""
    vanishing_speed: Annotated[float, Field(ge=0.1, le=MAX_NUMBER)] | None = None
    """Speed through the water, along the axis, at which full thrust vanishes [m/s]; by default it never does."""
    time_constant: NonNegative = 0.0
    """Time in which thrust at rest gets to 63 % of a new command's [s]; by default it follows at once."""
    dead_zone: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Commands up to this, either way, give no thrust at all."""
    power: NonNegative = 0.0
    """Electric power at full thrust at rest [W]; by default it is not known. Less thrust takes its share^1.5 of it."""

    def _faults(self) -> list[Fault]:
        found: list[Fault] = []
        for index, (command, thrust) in enumerate(self.thrust):
            place = ("thrust", index)
            if not -1.0 <= command <= 1.0:
                found.append((place, f"a command from -1 to 1 is needed, got {command:g}"))
            elif command * thrust < 0.0 or (command == 0.0 and thrust != 0.0):
                found.append((place, f"a thrust {_side(command)} is needed at command {command:g}, got {thrust:g} N"))
        found += unsorted_rows("thrust", [command for command, _ in self.thrust], "a command")
        if len(self.thrust) < 2:
            found.append((("thrust",), f"2 rows or more are needed, got {len(self.thrust)}"))
        if not found and 0.0 not in [command for command, _ in self.thrust]:
            found.append((("thrust",), "a row [0, 0] is needed: add it, and rows astern if it can push astern"))
        if not found and not any(thrust for _, thrust in self.thrust):
            found.append((("thrust",), "a thrust other than 0 is needed: all are 0 N"))
        return found


def _side(command: float) -> str:
    """The thrust that a command may have."""
    if command == 0.0:
        return "of 0"
    return "of 0 or more" if command > 0.0 else "of 0 or less"
