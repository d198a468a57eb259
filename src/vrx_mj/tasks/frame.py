"""What a referee sees: where things are, what the boat touched, and what its team sent."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = ["EARLY", "FRAME_RATE", "Frame", "Message", "Stand"]

FRAME_RATE = 20.0
"""Frames per simulated second [Hz], at least: the next rate above that divides a second into whole steps.

Recordings have rows at the same steps, so that a recording gives the score that the run gave."""
EARLY = 1e-6
"""By how much a moment may come early [s]: time is a sum of steps, each rounded."""


@dataclass(frozen=True, slots=True)
class Stand:
    """Position and attitude of a body's link origin."""

    x: float
    """[m], east."""
    y: float
    """[m], north."""
    z: float
    """[m], up."""
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """(w, x, y, z), body to world."""

    @property
    def yaw(self) -> float:
        """Heading [rad], counter-clockwise from east, in [-pi, pi]."""
        w, x, y, z = self.quaternion
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@dataclass(frozen=True, slots=True)
class Message:
    """What a team sends to its task."""

    topic: str
    content: Any
    """Plain data, as JSON holds it."""


@dataclass(frozen=True, slots=True)
class Frame:
    """The world at one moment, as far as a task wants to know it."""

    time: float
    """Simulated time [s], from the world's start."""
    stands: Mapping[str, Stand]
    """By name of the boat, object or ball; a dock has the name of its placement."""
    touches: Mapping[str, float] = field(default_factory=dict)
    """What the scored boat has touched, by name, and when it last did [s]; nothing that it never touched."""
    messages: tuple[Message, ...] = ()
    """Sent since the frame before, in their order."""
