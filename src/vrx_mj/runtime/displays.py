"""A world's lights and placards while it runs: what they show, and what they are made to show."""

from collections.abc import Sequence
from typing import Any

import mujoco

from vrx_mj.arguments import check_kind, check_name
from vrx_mj.config.bays import LIGHT_COLORS, OFF, SYMBOLS
from vrx_mj.errors import CommandError, shown
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.sensing import Sensing, display_colors
from vrx_mj.sensors.displays import Display, new_pattern, next_pattern, next_symbol, symbol_mark


class Displays:
    """The lights and placards of a run; errors are those of the methods of `Simulation` with these names."""

    def __init__(self, sensing: Sensing) -> None:
        """Displays of the run of some sensors, which see what the displays are made to show."""
        self._sensing = sensing

    @property
    def _arrays(self) -> LoopArrays:
        return self._sensing.arrays

    def names(self, kind: str) -> tuple[str, ...]:
        """Names of all displays of a kind, `light` or `placard`."""
        return tuple(display.name for display in self._arrays.displays if display.kind == kind)

    def showing(self, name: str) -> str:
        """Current colour of a light or symbol of a placard."""
        display = self._display("light or placard", name, ("light", "placard"))
        return display.shows(self._arrays.display_marks, float(self._arrays.data.time))

    def set_light(self, name: str, colors: Sequence[str]) -> None:
        """Make a light show three colours in turn, each for one second, beginning in one second."""
        display = self._display("light", name, ("light",))
        known = (*LIGHT_COLORS, OFF)
        given: Any = colors
        three = isinstance(given, Sequence) and not isinstance(given, str) and len(given) == 3
        if not three or not all(isinstance(color, str) and color in known for color in given):
            raise CommandError(f"invalid colours {shown(colors)} of {name}: three of {', '.join(known)} are needed")
        new_pattern(self._arrays.display_marks[display.marks], colors, float(self._arrays.data.time))
        self._sensing.renew()

    def set_placard(self, name: str, symbol: str) -> None:
        """Make a placard show a symbol, such as `red_circle`."""
        display = self._display("placard", name, ("placard",))
        check_name("symbol", symbol, SYMBOLS)
        self._arrays.display_marks[display.marks] = symbol_mark(symbol)
        self._sensing.renew()

    def shuffle(self, name: str) -> None:
        """Make a light or a placard show the next pattern in VRX's order."""
        display = self._display("light or placard", name, ("light", "placard"))
        marks = self._arrays.display_marks[display.marks]
        if display.kind == "light":
            next_pattern(marks, float(self._arrays.data.time))
        else:
            next_symbol(marks)
        self._sensing.renew()

    def paint(self, model: mujoco.MjModel) -> None:
        """Set the colours of lights and placards in a model to be drawn, such as `visual_model`."""
        check_kind("paint", model, mujoco.MjModel, "a model, as sim.visual_model")
        marks, time = self._arrays.display_marks, float(self._arrays.data.time)
        for geom, rgba in display_colors(model, self._arrays.displays, marks, time).items():
            model.geom_rgba[geom] = rgba

    def _display(self, what: str, name: str, kinds: Sequence[str]) -> Display:
        known = {display.name: display for display in self._arrays.displays if display.kind in kinds}
        check_name(what, name, known)
        return known[name]
