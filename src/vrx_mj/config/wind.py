"""The wind of a world's file, and what a boat shows to it: areas, and coefficients over its angle."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.base import Config, Fault, Only, column_faults, exclusive
from vrx_mj.config.values import NonNegative, Number, Positive, Seed, Vec3, numbers


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
    """Objects that the wind pushes besides boats whose robot has coefficients of its own; by default these boats alone.

    `[]`: nothing at all."""

    def _faults(self) -> Iterator[Fault]:
        yield from exclusive(self, "exponent", "roughness")
        if self.roughness is not None and self.roughness >= self.height:
            yield ("roughness",), f"a roughness below `height`, {self.height:g} m, is needed, got {self.roughness:g} m"


_Vessel = Literal[
    "car_carrier", "cargo_vessel", "cargo_vessel_containers", "container_ship", "destroyer", "diving_support_vessel",
    "drilling_vessel", "ferry", "fishing_vessel", "lng_tanker", "offshore_supply_vessel", "passenger_liner",
    "research_vessel", "speed_boat", "tanker_loaded", "tanker_ballast", "tender",
]  # fmt: skip
_Point = Annotated[tuple[Number, Number, Number, Number], numbers("angle cx cy cn")]
_Three = Annotated[tuple[NonNegative, NonNegative, Number], numbers("cx cy cn")]


class IsherwoodConfig(Config):
    """Inputs of Isherwood's formulas for merchant ships (1972) besides the areas. The link's origin is amidships."""

    breadth: Positive
    """Breadth [m]."""
    perimeter: Positive
    """Length of the outline of the lateral area, without the waterline, masts and ventilators [m]."""
    superstructure_area: NonNegative = 0.0
    """Lateral area of the superstructure [m2]."""
    masts: Annotated[int, Field(ge=0, le=20)] = 0
    """Distinct groups of masts seen from the side, without those close against the bridge."""


class WindageConfig(Config):
    """Areas of a boat in the wind of profile `marine`, and one of `coefficients`, `curve`, `isherwood` and `vessel`."""

    frontal_area: Positive
    """Area above the water, seen from ahead [m2]."""
    lateral_area: Positive
    """Area above the water, seen from the side [m2]."""
    length: Positive
    """Length overall [m]."""
    height: NonNegative
    """Height of the lateral area's centre over the link's origin, which counts as the water's level [m].

    There the wind acts, with its speed at this height."""
    offset: Number = 0.0
    """Distance of that centre ahead of the link's origin [m]."""
    coefficients: _Three | None = None
    """Coefficients cx, cy, cn of -cx cos, cy sin and cn sin 2 of the angle off the bow from which the wind comes."""
    curve: Annotated[tuple[_Point, ...], Field(max_length=361)] = ()
    """Coefficients over that angle from 0 to 180 [degrees], with straight lines between them, the same on both sides.

    cx is below 0 in wind from ahead; cy above 0 pushes to lee; cn above 0 turns the bow to lee."""
    isherwood: IsherwoodConfig | None = None
    """A merchant ship, whose coefficients Isherwood (1972) gives."""
    vessel: _Vessel | None = None
    """Type of vessel, whose coefficients Blendermann (1994) gives."""

    def _faults(self) -> list[Fault]:
        found = list(exclusive(self, "coefficients", "curve", "isherwood", "vessel", required=True))
        found += column_faults("curve", [row[0] for row in self.curve], "an angle", ends=(0.0, 180.0))
        found += [
            (("curve", index), f"cy and cn of 0 are needed at {angle:g}, where the sides meet")
            for index, (angle, _, cy, cn) in enumerate(self.curve)
            if angle in (0.0, 180.0) and (cy or cn)
        ]
        if self.isherwood and self.isherwood.superstructure_area > self.lateral_area:
            text = f"more than the lateral area, {self.lateral_area:g} m2: got {self.isherwood.superstructure_area:g}"
            found.append((("isherwood", "superstructure_area"), text))
        return found
