"""The look of a world, in SDF's vocabulary, and the markers of its goals and waypoints."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, Tag

from vrx_mj.config.base import Config, Fault, Only
from vrx_mj.config.shapes import Size
from vrx_mj.config.values import Cartesian, Color, NonNegative, Number, Share, Switch, as_switch, by_type, demand


class MarkersConfig(Config):
    """An upright cylinder at every place, and one ahead of it that lies along the yaw wanted there."""

    scaling: Annotated[
        Size, demand(lambda size: size[0] == size[1], "the first two must be equal, as a marker is round, got {}")
    ] = (0.2, 0.2, 2.0)
    """Diameter, once more, and length of the cylinders [m]."""
    height: Number = 0.5
    """Height of the upright cylinder's lower end over the mean water [m]."""
    color: Color = (1.0, 0.0, 0.0, 1.0)
    """Colour of the markers."""
    task: Switch = True
    """Whether the goal or the waypoints of the world's task have markers."""
    places: tuple[Cartesian, ...] = ()
    """Other places that have markers: x, y [m] and yaw [rad] in the world."""


_Hour = Annotated[float, Field(ge=0, le=24)]


class CloudsConfig(Config):
    """Clouds of the sky."""

    speed: NonNegative = 0.6
    """Speed [m/s]."""
    direction: Number = 0.0
    """Direction of travel [rad], counter-clockwise from x."""
    humidity: Share = 0.5
    """SDF's humidity; clouds are not drawn."""
    mean_size: Share = 0.5
    """SDF's mean size; clouds are not drawn."""
    ambient: Color = (0.8, 0.8, 0.8, 1.0)
    """SDF's ambient colour; clouds are not drawn."""


class SkyConfig(Config):
    """The sky: time of day and clouds."""

    time: _Hour = 10.0
    """Time of day [h]."""
    sunrise: _Hour = 6.0
    """When the sun rises [h]."""
    sunset: _Hour = 20.0
    """When the sun sets [h]."""
    clouds: CloudsConfig = CloudsConfig()
    """Clouds, which are not drawn: giving any gives a warning."""

    def _faults(self) -> Iterator[Fault]:
        if self.sunset <= self.sunrise:
            yield ("sunset",), f"must be later than sunrise, {self.sunrise:g}; got {self.sunset:g}"


class FogConfig(Config):
    """Fog."""

    type: Literal["none", "linear", "exp", "quadratic"] = "none"
    """How fog grows with the distance; exp and quadratic are drawn linear between their distances of 5 % and 95 %."""
    color: Annotated[Color, Only("type", ("linear", "exp", "quadratic"))] = (1.0, 1.0, 1.0, 1.0)
    """Colour of the fog, and of the horizon in it."""
    start: Annotated[NonNegative, Only("type", ("linear",))] = 1.0
    """Distance at which fog starts [m]."""
    end: Annotated[NonNegative, Only("type", ("linear",))] = 100.0
    """Distance beyond which fog hides everything [m]."""
    density: Annotated[NonNegative, Only("type", ("exp", "quadratic"))] = 1.0
    """Density [1/m]: exp fog hides 1 - exp(-density d) at distance d, quadratic fog 1 - exp(-(density d)^2)."""

    def _faults(self) -> Iterator[Fault]:
        if self.end <= self.start:
            yield ("end",), f"must be above start, {self.start:g}; got {self.end:g}"


_Sky = Annotated[
    Annotated[bool, Tag("switch")] | Annotated[SkyConfig, Tag("sky")],
    by_type("true, false, or keys and values", switch=bool, sky=(Mapping, SkyConfig)),
    BeforeValidator(as_switch),
]


class SceneConfig(Config):
    """Light, background, sky and fog."""

    ambient: Color | None = None
    """Ambient light; by default 0.4 in each channel."""
    background: Color | None = None
    """Colour of the horizon, and of the sky where `sky` is false."""
    sky: _Sky = True
    """Whether there is a sky, or which hour it shows; by default a clear morning."""
    grid: Switch = False
    """SDF's grid, which is not drawn: true gives a warning."""
    origin_visual: Switch = False
    """SDF's axes at the origin, which are not drawn: true gives a warning."""
    shadows: Switch = True
    """Whether the sun casts shadows."""
    fog: FogConfig | None = None
    """Fog; by default none."""
