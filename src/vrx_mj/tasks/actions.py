"""What a task does to the world."""

from dataclasses import dataclass

__all__ = ["Action", "LightUp", "PlaceObject", "Release", "SetPinger", "ShowSymbol"]


@dataclass(frozen=True, slots=True)
class Release:
    """Let go of the boat."""

    boat: str


@dataclass(frozen=True, slots=True)
class PlaceObject:
    """Put a floating object somewhere, at rest."""

    name: str
    pose: tuple[float, float, float, float, float, float]
    """x, y, z [m], roll, pitch, yaw [rad], ENU."""


@dataclass(frozen=True, slots=True)
class LightUp:
    """Have a light buoy show three colours in turn, from a second later on."""

    name: str
    colors: tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class ShowSymbol:
    """Have a placard show a symbol."""

    placard: str
    symbol: str
    """As `red_circle`."""


@dataclass(frozen=True, slots=True)
class SetPinger:
    """Put the beacon that all receivers of a boat hear somewhere."""

    boat: str
    position: tuple[float, float, float]
    """[m, ENU]."""


Action = Release | PlaceObject | LightUp | ShowSymbol | SetPinger
