"""The sea of a compiled world, and the tables of a world in the making."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from vrx_mj.arguments import check_kind
from vrx_mj.config.weather import CurrentConfig, SeaConfig, TideConfig
from vrx_mj.config.world import PhysicsConfig
from vrx_mj.constants import WATER_DENSITY, WAVE_GRAVITY
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Boat, Hull, Station, Thruster
from vrx_mj.model.kinds import ProfileCode, record_from
from vrx_mj.model.numbers import Number
from vrx_mj.model.things import Block, Dock, Element, Float, Follower, Light, Mooring, Object, PathPoint, Placard, Rope
from vrx_mj.model.water import Current, Layer, Sea, Wave
from vrx_mj.model.world import Parameters, Sensor
from vrx_mj.physics.tables import MARINE, VRX, VRX3
from vrx_mj.physics.waves import cwr_components, pms_components
from vrx_mj.spectra import LONGEST, REGULAR, SHORTEST, SPECTRA, Site, irregular_sea

_Row = dict[str, Any]
_NIL_AMPLITUDE = 1e-9
"""Waves lower than this [m] are left out: with VRX's scale 2.5 the longest one has 1e-11 m."""
PROFILES: Mapping[str, ProfileCode] = {"vrx": VRX, "vrx3": VRX3, "marine": MARINE}
"""Codes of the profiles in the runtime's tables."""


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
    afloat = [wave for wave in waves if wave["amplitude"] > _NIL_AMPLITUDE]
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
    return 1 if PROFILES[physics.profile] == MARINE else 0


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
