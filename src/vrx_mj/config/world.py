"""Worlds: sea, wind, terrain, what is in the water, the look of it all in SDF's vocabulary, and markers of goals."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, Tag, field_validator, model_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import Config, Fault, Faults, FromFile, InFolder, Only, duplicate_names
from vrx_mj.config.docks import DockPlacement, PosedEntry
from vrx_mj.config.kinds import CLASSIC, DEFAULT, MARINE, Profile, on_its_profile
from vrx_mj.config.loading import Loading, Source, check, document, loads, validate
from vrx_mj.config.objects import FieldConfig, Placement
from vrx_mj.config.robots import Arguments, load_robot
from vrx_mj.config.search import find_terrain
from vrx_mj.config.shapes import Size
from vrx_mj.config.tasks import Task
from vrx_mj.config.tree import Loc, Section, fault, literal
from vrx_mj.config.values import Cartesian, Color, NonNegative, Number, Pose, Switch, as_switch, by_type, demand
from vrx_mj.config.weather import CurrentConfig, SeaConfig, WindConfig
from vrx_mj.constants import GRAVITY
from vrx_mj.errors import warn
from vrx_mj.frames import Geodetic
from vrx_mj.model.kinds import AtBaseLink, Degrees, Latitude, Longitude, Seed, Share, Step
from vrx_mj.spectra import REGULAR, SPECTRA, VRX_SEAS

_NOTICED: list[str] = []
"""The world that the notice of the default profile was of."""
_MARINE_ONLY = "needs `physics: {profile: marine}`"
_MARINE_WIND = (
    "height", "exponent", "roughness", "spectrum", "components", "turning", "var_direction", "var_direction_time",
)  # fmt: skip
"""Keys of the wind that worlds of VRX's profiles cannot have."""
FULL_TURN = 2 * math.pi
"""Angle [rad] beyond which a pose was probably meant in degrees."""


class MarkersConfig(Config):
    """An upright cylinder at every position, and a horizontal one ahead of it that points along the desired yaw."""

    scaling: Annotated[
        Size, demand(lambda size: size[0] == size[1], "the first two must be equal, since markers are round; got {}")
    ] = (0.2, 0.2, 2.0)
    """Diameter, diameter again, and length of the cylinders [m]."""
    height: Number = 0.5
    """Height of the upright cylinder's lower end above the mean water level [m]."""
    color: Color = (1.0, 0.0, 0.0, 1.0)
    """Colour of the markers."""
    task: Switch = True
    """Whether the goal or the waypoints of the world's task have markers."""
    places: tuple[Cartesian, ...] = ()
    """Other positions with markers: x, y [m] and yaw [rad] in the world."""


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
    """Time of sunrise [h]."""
    sunset: _Hour = 20.0
    """Time of sunset [h]."""
    clouds: CloudsConfig = CloudsConfig()
    """Clouds. They are not drawn; setting them gives a warning."""

    def _faults(self) -> Faults:
        if self.sunset <= self.sunrise:
            yield ("sunset",), f"must be later than sunrise, {self.sunrise:g}; got {self.sunset:g}"


class FogConfig(Config):
    """Fog."""

    type: Literal["none", "linear", "exp", "quadratic"] = "none"
    """How fog increases with distance. exp and quadratic fog are drawn as linear between their distances of 5 % and 95
    %."""
    color: Annotated[Color, Only("type", ("linear", "exp", "quadratic"))] = (1.0, 1.0, 1.0, 1.0)
    """Colour of the fog, and of the horizon in it."""
    start: Annotated[NonNegative, Only("type", ("linear",))] = 1.0
    """Distance at which fog starts [m]."""
    end: Annotated[NonNegative, Only("type", ("linear",))] = 100.0
    """Distance beyond which fog hides everything [m]."""
    density: Annotated[NonNegative, Only("type", ("exp", "quadratic"))] = 1.0
    """Density [1/m]: exp fog hides 1 - exp(-density d) at distance d, quadratic fog 1 - exp(-(density d)^2)."""

    def _faults(self) -> Faults:
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
    """Whether there is a sky, or its time of day; by default a clear morning."""
    grid: Switch = False
    """SDF's grid. It is not drawn; true gives a warning."""
    origin_visual: Switch = False
    """SDF's axes at the origin. They are not drawn; true gives a warning."""
    shadows: Switch = True
    """Whether the sun casts shadows."""
    fog: FogConfig | None = None
    """Fog; by default none."""


class PhysicsConfig(Config):
    """Profile, step and gravity."""

    profile: Profile = DEFAULT
    """Physics profile: VRX classic's, VRX 3's, or `marine`, the models of naval architecture."""
    timestep: Step = 0.01
    """Physics step [s]; by default 0.004 in profile vrx3."""
    gravity: NonNegative = GRAVITY
    """Gravity, downward [m/s2]; by default 9.80665 in profile marine."""
    quirks: tuple[Literal["wind_stale_link"], ...] = ()
    """Defects of VRX's worlds to keep. `wind_stale_link`: no wind acts on boats, because VRX's file names a link that
    they do not have."""
    at_base_link: AtBaseLink = ("pinger",)
    """Sensors that measure at the origin of `base_link`, wherever they are mounted; all others measure where they are
    mounted. The default is that of VRX's plugins; in profile marine it is empty."""


class Georeference(Geodetic, Config):
    """The position of the world's origin on Earth (WGS84)."""

    latitude: Latitude
    """Latitude [degrees]."""
    longitude: Longitude
    """Longitude [degrees]."""
    elevation: Number = 0.0
    """Height of the origin above the ellipsoid [m]."""
    heading: Degrees = 0.0
    """Direction of the world's x axis [degrees], counter-clockwise from east."""


def _names(value: object) -> object:
    if isinstance(value, str):
        return (value,)
    if not isinstance(value, Sequence) or not all(isinstance(name, str) for name in value):
        raise fault(f"expected vrx, none, or a list of names, got {literal(value)}")
    return tuple(value)


Sensors = Annotated[tuple[str, ...], BeforeValidator(_names)]
"""Sensors of a boat: `vrx`, `none`, or a list of suites or of sensors by name."""


class SpawnConfig(InFolder):
    """The boat of a run without a fleet."""

    folder_keys: ClassVar = {"folder": "robot"}
    pose: Pose = (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
    """Pose in the world [m, rad]."""
    robot: Annotated[str, loads(load_robot)] = "wamv"
    """Kind of boat: a name, or a path relative to this file. It replaces that of the base, together with its thrusters
    and sensors."""
    arguments: Arguments = Field(default_factory=dict)
    """Arguments of the robot's xacro, such as `{mast_height: 2.5, locked: false}`."""
    thrusters: str = "T"
    """Layout of the thrusters: H, T or X; only for a robot that has layouts."""
    sensors: Sensors | None = None
    """`vrx`, `none`, or names of suites or sensors; by default the sensors of the robot."""

    @field_validator("thrusters")
    @classmethod
    def _robot_has_them(cls, value: str, info: ValidationInfo) -> str:
        if "robot" in info.data:
            check(info, lambda: check_thrusters(info.data["robot"], value, info.data.get("folder")))
        return value


class WorldConfig(FromFile):
    """A world's file, merged with those that it extends."""

    folder_keys: ClassVar = {"folder": "terrain"}
    name: str = "world"
    """Name of the world; by default that of the file."""
    description: str = ""
    """Description in `vrx-mj list worlds --verbose`."""
    georeference: Georeference | None = None
    """Position of the origin on Earth; required by GPS and geodetic goals."""
    physics: PhysicsConfig = PhysicsConfig()
    """Profile, step and gravity."""
    sea: SeaConfig = SeaConfig()
    """The waves."""
    current: CurrentConfig | None = None
    """The current, in profile `marine`; by default none."""
    wind: WindConfig | None = None
    """The wind; by default none."""
    scene: SceneConfig = SceneConfig()
    """Light, sky and fog."""
    spawn: SpawnConfig = SpawnConfig()
    """The boat of a run without a fleet, and defaults for fleets."""
    terrain: Annotated[str, loads(find_terrain)] | None = None
    """Shoreline and ground, as a name from `assets/terrain`."""
    objects: tuple[Placement, ...] = ()
    """Objects in the water and on the shore."""
    docks: tuple[DockPlacement, ...] = ()
    """Docks, drawn with letters."""
    fields: tuple[FieldConfig, ...] = ()
    """Objects at random positions drawn from a seed."""
    task: Task = None
    """The task, which is scored; by default none."""
    markers: MarkersConfig = MarkersConfig()
    """Markers at the task's goals and at other positions; visual only."""
    camera: Pose | None = None
    """Camera pose with which a recording opens [m, rad]."""
    seed: Seed = 0
    """Seed of everything random, unless a run specifies another."""

    @model_validator(mode="before")
    @classmethod
    def _of_its_profile(cls, data: object) -> object:
        return on_its_profile(data) if isinstance(data, Section) else data

    def _faults(self) -> list[Fault]:
        found = duplicate_names(objects=self.objects, docks=self.docks, fields=self.fields)
        if self.task and self.task.geodetic and not self.georeference:
            text = "latitude and longitude need a `georeference`, which this world does not have"
            found += [(("task", key), text) for key in self.task.geodetic]
        profile = self.physics.profile
        if profile != MARINE:
            found += [(loc, f"{what} {_MARINE_ONLY}, got {profile}") for loc, what in self._of_marine()]
        sea = self.sea.model
        if self.physics.gravity == 0.0 and (profile == MARINE or sea in SPECTRA or sea in REGULAR):
            what = MARINE if profile == MARINE else f"a sea of model {sea}"
            found.append((("physics", "gravity"), f"{what} needs gravity for its waves, got 0"))
        return found

    def _of_marine(self) -> Iterator[tuple[Loc, str]]:
        """Places and names of all that the file gives and that only worlds of profile `marine` have."""
        for number, item in enumerate(self.objects):
            if item.mooring is not None:
                yield ("objects", number, "mooring"), "a mooring"
        for name, part, keys in (("sea", self.sea, ("density",)), ("wind", self.wind, _MARINE_WIND)):
            yield from (((name, key), key) for key in keys if part is not None and key in part.model_fields_set)
        if self.current is not None:
            yield ("current",), "a current"

    @property
    def placements(self) -> tuple[PosedEntry, ...]:
        """Objects and docks of the world."""
        return (*self.objects, *self.docks)


def check_thrusters(robot: str, layout: str, folder: Path | None) -> None:
    """Refuse a layout of thrusters that the kind of boat does not have."""
    load_robot(robot, folder).layout(layout, robot)


def load_world(source: Source) -> WorldConfig:
    """The world of a name, a path, `FILE#k` (the k-th of an axes file) or a dict, with everything it names checked."""
    section, name = document("worlds", source, "world")
    world = validate(WorldConfig, section, Loading(), name=name)
    world._section = section
    things = [(thing.name, thing.pose[3:]) for thing in world.placements]
    warn_of_degrees(f"world {world.name}", [("spawn", world.spawn.pose[3:]), *things])
    for text in (*_of_its_sea(world), *_of_default_profile(world)):
        warn(f"world {world.name}: {text}", 3)
    return world


def _of_default_profile(world: WorldConfig) -> Iterator[str]:
    """One notice in a process, of the first world that names no profile."""
    if "profile" not in world.physics.model_fields_set and not _NOTICED:
        _NOTICED.append(world.name)
        yield (
            f"without `physics: profile`, {DEFAULT} is the default, which was {CLASSIC} in version 0.1; "
            f"write `physics: {{profile: {CLASSIC}}}` to keep that"
        )


def _of_its_sea(world: WorldConfig) -> Iterator[str]:
    """Warnings of seas that may be meant otherwise."""
    model = (world.section.get("sea") or {}).get("model", "pms")
    if world.sea.model != model:
        yield f"its sea is {world.sea.model}: `{model}` has no significant height; write `model: {world.sea.model}`"
    if world.sea.model == "cwr" and not world.sea.amplitude:
        yield "its cwr sea is flat: sea.amplitude is 0"
    if world.sea.model in VRX_SEAS and world.sea.depth is not None:
        what = f"a {world.sea.model} sea has the waves of deep water"
        yield f"{what}; sea.depth only affects echo sounders"


def warn_of_degrees(owner: str, poses: Iterable[tuple[str, Sequence[float]]]) -> None:
    """One warning if an angle is over a full turn; each thing comes with its name and its angles [rad]."""
    for name, angles in poses:
        angle = max(angles, key=abs)
        if abs(angle) > FULL_TURN:
            text = f"{owner}: angle {angle:g} of '{name}' exceeds a full turn, {FULL_TURN:.4f}"
            warn(f"{text}; poses are in radians", 4)
            return
