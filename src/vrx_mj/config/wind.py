"""The wind of a world's file: a mean with a profile over height, gusts, a direction that turns, and what it pushes."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.base import Config, Fault, Only, exclusive
from vrx_mj.config.values import NonNegative, Number, Positive, Seed, Vec3


class WindObject(Config):
    """Something that the wind pushes: a boat, an object, or every boat of a kind."""

    model: str
    """Name of a boat, an object, a kind of robot or a model of objects."""
    link: str | None = None
    """VRX's link_name: of an object that has joints, the link that is pushed; by default its own."""
    coefficients: Vec3
    """Coefficients of the force along x and y and of the torque about z [N s2/m2, N s2/m]."""


class WindConfig(Config):
    """VRX's usv_gazebo_wind_plugin: a mean wind with Gauss-Markov gusts; and what profile `marine` adds to it."""

    direction: Number = 270.0
    """Direction in which the air moves [degrees], counter-clockwise from x."""
    mean_velocity: NonNegative = 0.0
    """Mean speed [m/s]."""
    var_gain: Annotated[NonNegative, Only("spectrum", ("gauss_markov",))] = 0.0
    """Standard deviation of the gusts [m/s]."""
    var_time: Annotated[Positive, Only("spectrum", ("gauss_markov",))] = 2.0
    """Time constant of the gusts [s]."""
    seed: Seed = 0
    """Seed of the gusts; 0 leaves it to the world's seed."""
    update_rate: Number = 10.0
    """Rate at which VRX publishes the wind [Hz]; no effect on motion."""
    height: Positive = 10.0
    """Height above the water at which the wind has its speed [m]; this and what follows are for profile `marine`."""
    exponent: Annotated[float, Field(ge=0, le=1)] | None = None
    """Exponent of a power law over height, 0.11 over open water; by default the wind is the same at all heights."""
    roughness: Positive | None = None
    """Roughness length of a logarithmic profile over height [m], 0.0002 over open water; instead of `exponent`."""
    spectrum: Literal["gauss_markov", "npd"] = "gauss_markov"
    """Gusts: those of `var_gain` and `var_time`, or the NPD (Froya) spectrum, which follows from speed and height."""
    components: Annotated[int, Field(ge=1, le=500), Only("spectrum", ("npd",))] = 60
    """Number of harmonics of which the gusts of a spectrum consist."""
    turning: Number = 0.0
    """Rate at which the direction turns [degrees/s], counter-clockwise."""
    var_direction: NonNegative = 0.0
    """Standard deviation of the direction (Gauss-Markov) [degrees]."""
    var_direction_time: Positive = 60.0
    """Time constant of the direction [s]."""
    objects: tuple[WindObject, ...] | None = None
    """What the wind pushes besides boats whose robot has coefficients of its own; by default these boats alone.

    `[]`: nothing at all."""

    def _faults(self) -> Iterator[Fault]:
        yield from exclusive(self, "exponent", "roughness")
        if self.roughness is not None and self.roughness >= self.height:
            yield ("roughness",), f"a roughness below `height`, {self.height:g} m, is needed, got {self.roughness:g} m"
