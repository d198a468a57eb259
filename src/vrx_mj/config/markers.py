"""Markers of goals and waypoints, which are only looked at: VRX's waypoint_markers.cc."""

from typing import Annotated

from pydantic import field_validator

from vrx_mj.config.base import Color, Config, Coordinate, Positive, Switch, fault, numbers

__all__ = ["MarkersConfig"]

Place = Annotated[tuple[Coordinate, Coordinate, float], numbers("x y yaw")]
Scaling = Annotated[tuple[Positive, Positive, Positive], numbers("x y z")]


class MarkersConfig(Config):
    """An upright cylinder at every place, and one ahead of it that lies along the yaw wanted there."""

    scaling: Scaling = (0.2, 0.2, 2.0)
    """Diameter, once more, and length of the cylinders [m]."""
    height: float = 0.5
    """Height of the upright cylinder's lower end over the mean water [m]."""
    color: Color = (1.0, 0.0, 0.0, 1.0)
    """Colour of the markers."""
    task: Switch = True
    """Whether the goal or the waypoints of the world's task have markers."""
    places: tuple[Place, ...] = ()
    """Other places that have markers: x, y [m] and yaw [rad] in the world."""

    @field_validator("scaling")
    @classmethod
    def _is_round(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if value[0] != value[1]:
            raise fault(f"the first two numbers must be equal, as a marker is round, got {value[0]:g} and {value[1]:g}")
        return value
