"""The person at the keys: which boat, and what is asked of it. No simulation, no window."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from vrx_mj.drive.helm.engines import Engine, Wheel, engine_commands

__all__ = ["Pilot"]

STEP = 0.1
"""Power and turn of one press of an arrow key."""
SPEED, TURN, ANGLE = 0.5, 1.0, 0.1
"""What VRX's keys start with: power, turn, and the step of the angle [rad]."""
TENTH = 1.1, 0.9
"""VRX's factors of more and less."""

TWISTS = {
    "i": (1, 0), ",": (-1, 0), "j": (0, 1), "l": (0, -1),
    "u": (1, 1), "o": (1, -1), "m": (-1, -1), ".": (-1, 1),
}  # fmt: skip
"""teleop_twist_keyboard: signs of power and turn."""
NUDGES = {"up": (STEP, 0.0), "down": (-STEP, 0.0), "left": (0.0, STEP), "right": (0.0, -STEP)}
SCALES = {
    "q": ("speed", "turn", TENTH[0]), "z": ("speed", "turn", TENTH[1]),
    "w": ("speed", "speed", TENTH[0]), "x": ("speed", "speed", TENTH[1]),
    "e": ("turn", "turn", TENTH[0]), "c": ("turn", "turn", TENTH[1]),
    "r": ("angle", "angle", TENTH[0]), "v": ("angle", "angle", TENTH[1]),
}  # fmt: skip
"""Which of VRX's sizes a key changes, and by what factor."""


class Pilot:
    """Drives one boat at a time by keys; boats that were driven once keep what they were told last."""

    def __init__(self, engines: Mapping[str, Sequence[Engine]], boat: str) -> None:
        self._engines = engines
        self._boats = tuple(engines)
        self.boat = boat
        """The boat that the keys drive now."""
        self.sizes = {"speed": SPEED, "turn": TURN, "angle": ANGLE}
        """What the keys of VRX command."""
        self._wheels: dict[str, Wheel] = {}

    @property
    def wheel(self) -> Wheel:
        """What is asked of the chosen boat."""
        return self._wheels.get(self.boat, Wheel())

    @property
    def wheels(self) -> Mapping[str, Wheel]:
        """What is asked of the boats that keys have driven."""
        return self._wheels

    def meet(self, engines: Mapping[str, Sequence[Engine]]) -> None:
        """Boats came or went. Keys go on with the one that they drove, or with the first; "" where there is none."""
        self._engines, self._boats = engines, tuple(engines)
        self._wheels = {boat: wheel for boat, wheel in self._wheels.items() if boat in engines}
        if self.boat not in engines:
            self.boat = next(iter(engines), "")

    def press(self, key: str) -> bool:
        """Take a key; False if it means nothing here."""
        if not self._boats:
            return False
        wheel = self._turned(key)
        if wheel is not None:
            self._wheels[self.boat] = wheel
            return True
        return self._scaled(key) or self._chosen(key)

    def commands(self) -> dict[str, dict[str, float]]:
        """Commands of all boats that keys have driven; the others are left alone."""
        return {boat: engine_commands(self._engines[boat], wheel) for boat, wheel in self._wheels.items()}

    def reset(self) -> None:
        """Let go of all boats."""
        self._wheels.clear()

    def _turned(self, key: str) -> Wheel | None:
        """The wheel after a key that turns it."""
        wheel = self.wheel
        if key in NUDGES:
            power, turn = NUDGES[key]
            return replace(wheel, power=_share(wheel.power + power), turn=_share(wheel.turn + turn))
        if key in TWISTS:
            power, turn = TWISTS[key]
            return replace(wheel, power=power * self.sizes["speed"], turn=turn * self.sizes["turn"])
        if key in {"h", ";"}:
            step = self.sizes["angle"] * (1 if key == ";" else -1)
            limit = max((engine.max_angle for engine in self._engines[self.boat]), default=0.0)
            return replace(wheel, angle=min(max(wheel.angle + step, -limit), limit))
        return replace(wheel, power=0.0, turn=0.0) if key in {"space", "k"} else None

    def _scaled(self, key: str) -> bool:
        if key not in SCALES:
            return False
        *names, factor = SCALES[key]
        for name in set(names):
            self.sizes[str(name)] *= float(factor)
        return True

    def _chosen(self, key: str) -> bool:
        count, here = len(self._boats), self._boats.index(self.boat)
        if key in {"tab", "n"}:
            self.boat = self._boats[(here + 1) % count]
            return True
        if key.isdecimal() and 1 <= int(key) <= count:
            self.boat = self._boats[int(key) - 1]
            return True
        return False


def _share(value: float) -> float:
    """Within [-1, 1], and without the dust of adding tenths."""
    return round(min(max(value, -1.0), 1.0), 6) + 0.0
