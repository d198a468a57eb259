"""From throttle and turn to the commands of a boat's engines, whatever their layout."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import mul
from typing import TYPE_CHECKING, Any

from vrx_mj.physics.tables import NEWTONS, RUDDER

if TYPE_CHECKING:
    from vrx_mj.mjcf.world import World

__all__ = ["Engine", "Wheel", "engine_commands", "engines_of"]

ACROSS = 0.2
"""Engines whose thrust points forward by less than this share are not driven: VRX's lateral one."""
SHORT_ARM = 0.1
"""Arm [m] of the engines' thrusts about the centre of mass, below which a boat is steered by turning them."""
FULL_RUDDER = 0.5
"""Angle [rad] of a full turn where engines are turned to steer."""


@dataclass(frozen=True)
class Wheel:
    """What a helmsman asks of one boat."""

    power: float = 0.0
    """Forward, as a share of full power."""
    turn: float = 0.0
    """Counter-clockwise, as a share of the largest difference between the sides."""
    angle: float = 0.0
    """Steering angle of the engines [rad], counter-clockwise."""


@dataclass(frozen=True)
class Engine:
    """One thruster or rudder that the keys drive."""

    name: str
    forward: float
    """Share of its thrust that points forward; 0 for a rudder."""
    arm: float
    """Arm of its thrust about the centre of mass [m]; positive turns counter-clockwise."""
    aft: bool
    """Whether it stands behind the centre of mass."""
    max_angle: float
    """Largest steering angle [rad]."""
    rudder: bool = False
    """Whether it has no propeller."""
    ahead: float = 1.0
    """Command of full power ahead: 1, or a force [N] where commands are newtons."""
    astern: float = 1.0
    """The same astern, above 0."""


def engines_of(world: World, boat: str) -> tuple[Engine, ...]:
    """The thrusters and rudders of a boat that the keys drive."""
    hull = world.boats.index(boat)
    centre = world.tree["hulls"][hull]["body_com"]
    engines = (_engine(row, centre) for row in world.tree["thrusters"] if row["hull"] == hull)
    return tuple(engine for engine in engines if engine.rudder or abs(engine.forward) > ACROSS)


def _engine(row: Mapping[str, Any], centre: Sequence[float]) -> Engine:
    x, y = row["position"][0] - centre[0], row["position"][1]  # hulls are alike on both sides, cargo is not
    forward, left, _ = (sum(map(mul, line, row["direction"])) for line in row["rotation"])
    if row["mapping"] == RUDDER:
        return Engine(row["name"], 0.0, 0.0, x < 0.0, row["max_angle"], rudder=True)
    full = (row["max_forward"], abs(row["max_reverse"])) if row["mapping"] == NEWTONS else (1.0, 1.0)
    return Engine(row["name"], forward, x * left - y * forward, x < 0.0, row["max_angle"], False, *full)


def engine_commands(engines: Sequence[Engine], wheel: Wheel) -> dict[str, float]:
    """Commands of the engines: thrusts in [-1, 1], or in newtons, and their `_angle` in rad.

    Thrusts turn the boat where they have an arm: for two engines side by side, left is power minus turn and right
    is power plus turn, as in VRX's twist2thrust. Else the engines turn to steer. A rudder always does.
    """
    reach = max((abs(engine.arm) for engine in engines), default=0.0)
    commands: dict[str, float] = {}
    for engine in engines:
        by_angle = engine.rudder or reach <= SHORT_ARM
        if not engine.rudder:
            turn = 0.0 if by_angle else wheel.turn * engine.arm / reach
            share = _within(_sign(engine.forward) * wheel.power + turn, 1.0)
            commands[engine.name] = share * (engine.ahead if share > 0.0 else engine.astern)
        if engine.max_angle > 0.0:
            steer = (-FULL_RUDDER if engine.aft else FULL_RUDDER) * wheel.turn if by_angle else 0.0
            commands[f"{engine.name}_angle"] = _within(steer + wheel.angle, engine.max_angle)
    return commands


def _sign(value: float) -> float:
    return math.copysign(1.0, value)


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit) + 0.0
