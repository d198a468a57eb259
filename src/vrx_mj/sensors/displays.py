"""What lights and placards show at a time: functions of their marks, which are part of a run's state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.docks import LIGHT_COLORS, LIGHT_PATTERNS, OFF, RGB, SHAPES, SYMBOLS
from vrx_mj.constants import EARLY
from vrx_mj.errors import StateError
from vrx_mj.model.things import Light, Placard
from vrx_mj.model.world import Parameters

CODES = (*LIGHT_COLORS, OFF)
"""Colours that a light shows, by their numbers."""
_DARK = CODES.index(OFF)
"""Number of the colour of a dark light."""
_COLOR_TIME, _COLOR_COUNT = 1.0, 5
"""Seconds of a colour, and how many of them make a sequence; the last two are dark. VRX: light_buoy_plugin.cc."""
_SINCE, _HELD, _UNTIL, _NEXT = 3, 4, 5, 6
"""A light's marks after the three colours: when the sequence began [s], what it shows until when [s] before the colours
are looked at, and which pattern the next shuffle gives."""
MARK_COUNTS = {"light": 7, "placard": 1}
"""Number of marks of each kind of display."""

_MARK_LIMITS: Mapping[str, Mapping[int, int]] = {
    "light": {**dict.fromkeys((0, 1, 2, _HELD), len(CODES)), _NEXT: len(LIGHT_PATTERNS)},
    "placard": {0: len(SYMBOLS)},
}
"""Marks that are whole numbers from 0, and below what, by the kind of display."""


@dataclass(frozen=True)
class Display:
    """A light or a placard of a world."""

    name: str
    kind: str
    """`light` or `placard`."""
    body: str
    """The body that carries it."""
    parts: Mapping[str, tuple[str, ...]]
    """Names of the geoms of each part: a light's panels, a placard's shapes."""
    start: tuple[float, ...]
    """Marks of the display at the start of a run."""
    marks: slice
    """Where its marks are among those of all displays."""

    def codes(self, marks: FloatArray, time: FloatArray) -> IntArray:
        """Numbers of what it shows (n,), by rows of all displays' marks (n, m) at times (n,) [s]."""
        own = marks[:, self.marks]
        return _light_codes(own, time) if self.kind == "light" else own[:, 0].astype(np.int64)

    def colors(self, code: int) -> dict[str, tuple[float, float, float, float]]:
        """Red, green, blue and alpha, 0 to 1, of every part; what is not seen has alpha 0."""
        if self.kind == "light":
            return dict.fromkeys(self.parts, (*RGB[CODES[code]], 1.0))
        color, shape = SYMBOLS[code].split("_")
        return {part: (*RGB[color], float(part == shape)) for part in self.parts}

    def shows(self, marks: FloatArray, time: float) -> str:
        """`red`, or `off`, or `red_circle`, by all displays' marks (m,) at a time [s]."""
        code = int(self.codes(marks[None], np.array([time]))[0])
        return CODES[code] if self.kind == "light" else SYMBOLS[code]


def _light_codes(marks: FloatArray, time: FloatArray) -> IntArray:
    """Numbers of the colours (n,) that a light shows, by rows of its marks (n, 7) at times (n,) [s].

    Each of its three colours lasts a second, then it is dark for two.
    """
    beat = np.floor((time + EARLY - marks[:, _SINCE]) / _COLOR_TIME).astype(np.int64) % _COLOR_COUNT
    colors = np.concatenate((marks[:, :3], np.full((len(marks), _COLOR_COUNT - 3), _DARK)), axis=1)
    shown = colors[np.arange(len(marks)), beat]
    return np.where(time + EARLY < marks[:, _UNTIL], marks[:, _HELD], shown).astype(np.int64)


def new_pattern(marks: FloatArray, colors: Sequence[str], time: float) -> None:
    """Give a light's marks (7,) another pattern at a time [s]: its sequence begins a second later."""
    held = _light_codes(marks[None], np.array([time]))[0]
    marks[:3] = [CODES.index(color) for color in colors]
    marks[_HELD], marks[_SINCE], marks[_UNTIL] = held, time + _COLOR_TIME, time + _COLOR_TIME


def next_pattern(marks: FloatArray, time: float) -> None:
    """Shuffle a light at a time [s]: it goes on with the next of VRX's patterns from the next beat on."""
    if time + EARLY >= marks[_UNTIL]:
        marks[_HELD] = _light_codes(marks[None], np.array([time]))[0]
        beats = np.floor((time + EARLY - marks[_SINCE]) / _COLOR_TIME)
        marks[_UNTIL] = marks[_SINCE] + _COLOR_TIME * (beats + 1.0)
    number = int(marks[_NEXT])
    marks[:3] = [CODES.index(color) for color in LIGHT_PATTERNS[number]]
    marks[_NEXT] = (number + 1) % len(LIGHT_PATTERNS)


def symbol_mark(symbol: str) -> float:
    """A placard's mark for a symbol."""
    return float(SYMBOLS.index(symbol))


def next_symbol(marks: FloatArray) -> None:
    """Shuffle a placard's mark (1,)."""
    marks[0] = (marks[0] + 1.0) % len(SYMBOLS)


def check_display_marks(displays: Sequence[Display], marks: FloatArray) -> None:
    """Check rows of all displays' marks (n, m): what names a colour, a pattern or a symbol does so.

    Raises:
        StateError: it does not.
    """
    for display in displays:
        own = marks[:, display.marks]
        for column, limit in _MARK_LIMITS[display.kind].items():
            values = own[:, column]
            if not ((values >= 0.0) & (values < limit) & (values == np.floor(values))).all():
                raise StateError(
                    f"invalid state of the {display.kind} '{display.name}': it shows an unknown colour, pattern or "
                    "symbol"
                )
        if not np.isfinite(own).all():
            raise StateError(f"invalid state of the {display.kind} '{display.name}': a time is not finite")


def displays_of(world: Parameters) -> tuple[Display, ...]:
    """The lights and placards of a world."""
    found: list[Display] = []

    def add(row: Light | Placard, kind: str, parts: Mapping[str, tuple[str, ...]], *start: float) -> None:
        first = found[-1].marks.stop if found else 0
        marks = slice(first, first + MARK_COUNTS[kind])
        found.append(Display(row.name, kind, row.body, parts, start, marks))

    for light in world.lights:
        colors = (float(CODES.index(color)) for color in light.pattern)
        add(light, "light", {"panels": light.geoms}, *colors, 0.0, float(_DARK), 0.0, 0.0)
    for placard in world.placards:
        parts = {str(shape): placard.geoms[shape] for shape in SHAPES if shape in placard.geoms}
        add(placard, "placard", parts, symbol_mark(placard.symbol))
    return tuple(found)


def display_marks(displays: Sequence[Display]) -> list[float]:
    """The marks of displays at the start of a run."""
    return list(chain.from_iterable(display.start for display in displays))
