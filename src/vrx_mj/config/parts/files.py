"""Thruster and component files as read: every instance with its parameters, and where it stands."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from vrx_mj.config.tree import Place

__all__ = ["Instance", "PartsFile"]

Kind = Literal["components", "thrusters"]


@dataclass(frozen=True)
class Instance:
    """One part that a file asks for."""

    type: str
    """Name of its macro: `wamv_camera`, `engine`, ..."""
    index: int
    """Among those of its type, from 0."""
    parameters: Mapping[str, Any]
    """As the file has them, in its order: numbers, booleans and texts; `position` and `orientation` are texts.

    Expressions are worked out, and numbers in quotes are numbers.
    """
    place: Place

    @property
    def name(self) -> str:
        """What it is called."""
        return str(self.parameters.get("name", self.parameters.get("prefix", self.parameters.get("sensor_name", ""))))


@dataclass(frozen=True)
class PartsFile:
    """A file's parts in its order; a file may be empty."""

    path: Path
    kind: Kind
    instances: tuple[Instance, ...]
    stops: tuple[str, ...] = ()
    """What VRX's own generator stops at, with its place, though the file is read here."""
