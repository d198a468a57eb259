"""Sea and wind of a compiled world, and the tables of a world in the making."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from vrx_mj.arguments import check_kind
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.kinds import CLASSIC, MARINE, NEWER
from vrx_mj.config.robots import SailEntry
from vrx_mj.config.search import catalogue
from vrx_mj.config.weather import CurrentConfig, SeaConfig, TideConfig, WindageConfig, WindConfig
from vrx_mj.config.world import PhysicsConfig
from vrx_mj.constants import WATER_DENSITY, WAVE_GRAVITY
from vrx_mj.errors import warn
from vrx_mj.frames import Vector
from vrx_mj.mjcf import boats
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Boat, Hull, Station, Thruster, Windage, WindCoefficients
from vrx_mj.model.kinds import ProfileCode, record_from
from vrx_mj.model.numbers import Number
from vrx_mj.model.things import Block, Dock, Element, Float, Follower, Light, Mooring, Object, PathPoint, Placard, Rope
from vrx_mj.model.water import Air, Current, Layer, Sea, Wave, Wind
from vrx_mj.model.world import Parameters, Sensor
from vrx_mj.physics import tables
from vrx_mj.physics.waves import cwr_components, pms_components
from vrx_mj.physics.wind import BLENDERMANN, Areas, Superstructure, isherwood_curve
from vrx_mj.spectra import (
    LONGEST,
    REGULAR,
    SHORTEST,
    SPECTRA,
    Site,
    Spectrum,
    gust_frequencies,
    gust_variance,
    irregular_sea,
    npd,
)

_Row = dict[str, Any]
_MIN_AMPLITUDE = 1e-9
"""Waves lower than this [m] are left out: with VRX's scale 2.5 the longest one has 1e-11 m."""
PROFILES: Mapping[str, ProfileCode] = {"vrx": tables.VRX, "vrx3": tables.VRX3, "marine": tables.MARINE}
"""Codes of the profiles in the runtime's tables."""
NO_WIND = (0.0, 0.0, 0.0)
"""Mean wind of a calm [m/s]."""
_NPD_HEIGHT = 10.0
"""Height of the mean speed on which the NPD spectrum depends [m]."""
_STALE_LINK = "wind_stale_link"
"""VRX's defect by which the wind pushes no boat."""
_FIRST_GUST = {"vrx": 0.0, "vrx3": 0.001, "marine": 0.0}
"""Length of the first step that the gusts assume [s]; 0: its own. VRX 3's USVWind.cc."""
_SHOWN_NAMES = 3
"""Number of boats that a warning names."""


def sea_parameters(sea: SeaConfig, physics: PhysicsConfig) -> Sea:
    """Wave components and start-up ramp; `model: none` has no components. VRX's seas have a gravity of their own."""
    if sea.model in SPECTRA or sea.model in REGULAR:
        return _ocean(sea, physics)
    shape = (sea.number, sea.scale, sea.angle, sea.steepness)
    waves: Sequence[_Row] = ()
    if sea.model == "pms":
        waves = pms_components(*shape, gain=sea.gain, period=sea.period, direction=sea.direction)
    elif sea.model == "cwr":
        waves = cwr_components(*shape, amplitude=sea.amplitude, period=sea.period, direction=sea.direction)
    afloat = [wave for wave in waves if wave["amplitude"] > _MIN_AMPLITUDE]
    height = 4.0 * math.sqrt(math.fsum(wave["amplitude"] ** 2 for wave in afloat) / 2.0)
    # what presses on hulls; VRX's waves keep their own lengths
    pressing = (physics.gravity, sea.density) if _moving(physics) else (WAVE_GRAVITY, WATER_DENSITY)
    return record_from(
        Sea,
        sea,
        level=0.0,
        waves=tuple(Wave(**wave) for wave in afloat),
        significant_height=height,
        gravity=pressing[0],
        density=pressing[1],
        moving=_moving(physics),
    )


def _moving(physics: PhysicsConfig) -> int:
    """Whether what floats feels how the water moves."""
    return 1 if PROFILES[physics.profile] == tables.MARINE else 0


def _ocean(sea: SeaConfig, physics: PhysicsConfig) -> Sea:
    """A sea of a spectrum, or of one regular wave, under a world's gravity."""
    site = Site(math.inf if sea.depth is None else sea.depth, physics.gravity)
    regular = REGULAR.get(sea.model)
    if regular:
        waves = regular(sea.height or 0.0, sea.period, sea.direction, site)
    else:
        kind, peak = SPECTRA[sea.model], 2.0 * math.pi / sea.tp
        spectrum = kind.shape(peak, site, **{key: getattr(sea, key) for key in kind.keys})
        band = (LONGEST * peak, SHORTEST * peak)
        record = sea.record if sea.amplitudes == "drawn" else 0.0
        waves = irregular_sea(spectrum, sea.hs, band, sea.direction, sea.components, sea.spreading, site, record)
    return record_from(
        Sea,
        sea,
        physics,
        tau=sea.ramp,
        level=0.0,
        waves=tuple(Wave(**wave._asdict(), steepness=0.0) for wave in waves if wave.amplitude or regular),
        significant_height=sea.height or 0.0 if regular else sea.hs,
        period=sea.period if regular else sea.tp,
        moving=_moving(physics),
    )


def current_parameters(current: CurrentConfig | None) -> Current | None:
    """The current of a compiled world."""
    if current is None:
        return None
    tide = current.tide or TideConfig(speed=0.0)
    along, main = math.radians(tide.direction), math.radians(current.direction)
    return record_from(
        Current,
        current,
        mean=(current.speed * math.cos(main), current.speed * math.sin(main)),
        tide_major=(tide.speed * math.cos(along), tide.speed * math.sin(along)),
        tide_minor=(-tide.minor * math.sin(along), tide.minor * math.cos(along)),
        tide_frequency=2.0 * math.pi / tide.period,
        tide_phase=math.radians(tide.phase),
        gain=current.var_gain,
        time_constant=current.var_time,
        layers=tuple(Layer(depth=depth, share=share) for depth, share in current.profile),
    )


def parameters(world: World) -> dict[str, Number]:
    """List the numbers of a compiled world: its sea, current, wind and moorings, and its boats, by name.

    A name is the path of a field: `wind.mean`, `wamv.hull.drag_linear.surge`, `wamv.hull.mass`. Numbers that
    follow from others, such as heights of waves, or exist only in the MJCF, such as places of joints, are not listed.
    `compile_world(..., parameters={name: value})` sets them.

    Raises:
        CommandError: it is not a compiled world.
    """
    check_kind("parameters", world, World, "a compiled world, as compile_world returns it")
    return dict(world.numbers)


@dataclass(frozen=True)
class Rows:
    """Rows of some tables of a world, each list under the name that its table has in `Parameters`."""

    hulls: list[Hull] = field(default_factory=list)
    stations: list[Station] = field(default_factory=list)
    thrusters: list[Thruster] = field(default_factory=list)
    floats: list[Float] = field(default_factory=list)
    links: list[Float] = field(default_factory=list)
    elements: list[Element] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    moorings: list[Mooring] = field(default_factory=list)
    ropes: list[Rope] = field(default_factory=list)
    followers: list[Follower] = field(default_factory=list)
    path_points: list[PathPoint] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    sensors: list[Sensor] = field(default_factory=list)
    boats: list[Boat] = field(default_factory=list)
    objects: list[Object] = field(default_factory=list)
    docks: list[Dock] = field(default_factory=list)
    placards: list[Placard] = field(default_factory=list)

    @classmethod
    def of(cls, world: Parameters) -> "Rows":
        """The rows that a compiled world has."""
        return cls(**{table.name: [*getattr(world, table.name)] for table in fields(cls)})

    def add(self, more: "Rows") -> None:
        """Append other rows, which are numbered to follow these."""
        for table, own in vars(more).items():
            getattr(self, table).extend(own)

    @property
    def tables(self) -> dict[str, Any]:
        """The rows by table, as `Parameters` has them."""
        return {table: tuple(rows) for table, rows in vars(self).items()}

    @property
    def shooters(self) -> list[tuple[str, str]]:
        """The ball shooters among the sensors, each as (boat, sensor)."""
        return [(sensor.boat, sensor.name) for sensor in self.sensors if sensor.type == "ball_shooter"]


def wind_parameters(wind: WindConfig | None, profile: str = CLASSIC) -> Wind:
    """The gust process and its direction; a world without wind is one of 0 m/s."""
    wind = wind or WindConfig(mean_velocity=0.0, var_gain=0.0)
    toward, gusts = math.radians(wind.direction), _spectrum(wind)
    return record_from(
        Wind,
        wind,
        direction=(math.cos(toward), math.sin(toward)),
        mean=wind.mean_velocity,
        gain=math.sqrt(gust_variance(gusts)) if gusts else wind.var_gain,
        time_constant=wind.var_time,
        first_step=_FIRST_GUST[profile],
    )


def air_parameters(wind: WindConfig | None, profile: str) -> Air | None:
    """Profile over height and gusts of the wind in profile `marine`; None in VRX's, and without wind."""
    if wind is None or profile != MARINE:
        return None
    gusts = _spectrum(wind)
    return record_from(
        Air,
        wind,
        exponent=wind.exponent or 0.0,
        roughness=wind.roughness or 0.0,
        turning=math.radians(wind.turning),
        spread=math.radians(wind.var_direction),
        time_constant=wind.var_direction_time,
        gust_frequencies=tuple(gust_frequencies(gusts, wind.components)) if gusts else (),
    )


def _spectrum(wind: WindConfig) -> Spectrum | None:
    """The spectrum of the gusts at the wind's height; the speed at 10 m, on which it depends, is by the wind's profile.

    None: they are a Gauss-Markov process, or there is no wind.
    """
    if wind.spectrum != "npd" or not wind.mean_velocity:
        return None
    share = (_NPD_HEIGHT / wind.height) ** (wind.exponent or 0.0)
    if wind.roughness:
        share = math.log(max(_NPD_HEIGHT, wind.roughness) / wind.roughness) / math.log(wind.height / wind.roughness)
    return npd(share * wind.mean_velocity, wind.height)


def wind_coefficients(wind: WindConfig | None, *names: str) -> Vector | None:
    """Coefficients (Cx, Cy, Cz) for a thing that goes by any of these names; None if none is listed."""
    for item in (wind.objects if wind else None) or ():
        if item.model in names:
            return item.coefficients
    return None


def boat_wind(wind: WindConfig | None, physics: PhysicsConfig, name: str, robot: str, own: Vector | None) -> Vector:
    """Coefficients for a boat: the world's, or else its `own`; none where the world's push nothing."""
    if _STALE_LINK in physics.quirks:
        return NO_WIND
    return wind_coefficients(wind, name, robot) or (own if _pushes_boats(wind, physics) else None) or NO_WIND


def boat_windage(
    wind: WindConfig | None, physics: PhysicsConfig, names: Sequence[str], own: WindageConfig | None
) -> Windage | None:
    """Areas of a boat in profile `marine`, unless the world lists coefficients for its names, or pushes nothing."""
    listed = wind_coefficients(wind, *names) is not None
    if (
        own is None
        or physics.profile != MARINE
        or listed
        or _STALE_LINK in physics.quirks
        or not _pushes_boats(wind, physics)
    ):
        return None
    vessel = BLENDERMANN[own.vessel] if own.vessel else None
    return record_from(Windage, own, curve=_curve(own), vessel=vessel)


def _curve(own: WindageConfig) -> tuple[tuple[float, float, float, float], ...]:
    """Angles [rad] and coefficients of surge, sway and yaw that a boat lists, or that are Isherwood's."""
    ship = own.isherwood
    if ship is None:
        return tuple((math.radians(angle), cx, cy, cn) for angle, cx, cy, cn in own.curve)
    areas = Areas(own.frontal_area, own.lateral_area, own.length, own.height)
    more = Superstructure(ship.breadth, ship.perimeter, ship.superstructure_area, ship.masts)
    return isherwood_curve(more, areas, own.offset)


def _pushes_boats(wind: WindConfig | None, physics: PhysicsConfig) -> bool:
    """Whether boats that nobody lists are pushed. VRX 3's wind is apparent: in a world without wind it adds no drag."""
    return physics.profile != NEWER if wind is None else wind.objects != ()


def newcomer_wind(wind: WindConfig | None, physics: PhysicsConfig) -> tuple[WindCoefficients, ...] | None:
    """Wind coefficients for boats that join later; None: those of their own, (): none."""
    if wind is not None and wind.objects:
        return tuple(record_from(WindCoefficients, item) for item in wind.objects)
    return None if _pushes_boats(wind, physics) else ()


def own_load(boat: boats.Boat, physics: PhysicsConfig) -> object:
    """Coefficients, windage or sail by which the wind pushes a kind of boat; None without any."""
    sail = next((item.blade for item in boat.thrusters if isinstance(item.blade, SailEntry)), None)
    return boat.wind or (boat.windage if physics.profile == MARINE else None) or sail


def warn_if_unpushed(
    world: str, wind: WindConfig | None, physics: PhysicsConfig, boats: Iterable[tuple[BoatConfig, object]]
) -> None:
    """One warning if a wind blows that has no coefficients for some boats, each given with what it has of its own."""
    if wind is None or wind.objects == () or _STALE_LINK in physics.quirks or not (wind.mean_velocity or wind.var_gain):
        return
    still = [boat for boat, own in boats if not own and wind_coefficients(wind, boat.name, boat.robot) is None]
    if still:
        text = f"world {world}: the wind does not push {_first(boat.name for boat in still)}"
        lack = f"no wind coefficients for robot {_first(boat.robot for boat in still)}"
        advice = "write `wind: [x, y, yaw]` in the robot's YAML, or list it in `wind.objects`, Gazebo's <wind_obj>"
        warn(f"{text}: {lack}; {advice}", 5)


def warn_if_unmoved(world: str, wind: WindConfig | None, moving: Iterable[str]) -> None:
    """One warning if the wind lists things, but no kind of boat, of which none can move."""
    names = set(moving)
    idle = [item.model for item in (wind.objects if wind else None) or () if item.model not in names]
    robots = catalogue("robots") if idle else {}
    if idle := [name for name in idle if name not in robots]:
        text = f"world {world}: wind.objects has no effect on {_first(idle)}"
        warn(f"{text}; list boats, objects that float, and docks with `dynamic: true`", 5)


def _first(names: Iterable[str]) -> str:
    known = list(dict.fromkeys(names))
    more = [f"{len(known) - _SHOWN_NAMES} more"] if len(known) > _SHOWN_NAMES else []
    return ", ".join([*known[:_SHOWN_NAMES], *more])
