"""Kinds of boats: a URDF or xacro, and the small YAML beside it for what a URDF cannot give.

A robot with a name is a folder with `robot.yaml`; a path leads to such a file, or to a `.urdf`, `.xacro` or `.sdf`,
whose YAML, if it has one, is called as itself: `my_boat.yaml` goes with `my_boat.urdf.xacro`.
"""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field

from vrx_mj.config.base import Config, Faults, Folder, InFolder, Only, column_faults, faults
from vrx_mj.config.dynamics import (
    ContactConfig,
    HydrodynamicsConfig,
    MarineHullConfig,
    PropellerConfig,
    ServoConfig,
    ThrusterConfig,
)
from vrx_mj.config.kinds import NEWER
from vrx_mj.config.loading import Loading, loads, read_source, referenced_file, validate
from vrx_mj.config.search import WORLD_SUFFIXES, contained_file
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.tree import File, Section, literal, merge, of_python
from vrx_mj.config.values import Name, NonNegative, Number, NumberOf, Positive, Switch, Vec3, demand, numbers
from vrx_mj.config.weather import WindageConfig
from vrx_mj.errors import UnknownNameError, VrxError
from vrx_mj.frames import ZERO
from vrx_mj.model.boats import Battery, Hull, Thruster
from vrx_mj.model.kinds import Share
from vrx_mj.packages import root

_DESCRIPTIONS = (".urdf.xacro", *WORLD_SUFFIXES, ".xacro", ".urdf")
"""How a robot's description may end, the longest first."""
YAML_OF = "the YAML of"
"""How messages call the YAML beside a description where there is none."""


def _scalars(value: object) -> object:
    """Values of xacro arguments as the texts that xacro wants; a switch is `true` or `false`, as in VRX's files."""
    if not isinstance(value, Mapping):
        return value
    odd = [key for key, item in value.items() if not isinstance(item, str | int | float | bool)]
    if odd:
        raise faults(((odd[0],), f"expected a number, text, true or false, got {literal(value[odd[0]])}"))
    return {key: str(item).lower() if isinstance(item, bool) else str(item) for key, item in value.items()}


_VoltagePoint = Annotated[tuple[Share, Positive], numbers("share voltage")]
_ChannelNumber = Annotated[str, Field(pattern="^([1-9]|[12][0-9]|3[0-2])$")]
_SailPoint = Annotated[tuple[Number, Number, NonNegative], numbers("angle lift drag")]
Arguments = Annotated[dict[str, str], BeforeValidator(_scalars)]
"""Values of xacro arguments by their names."""


class ThrusterEntry(ThrusterConfig):
    """A thruster, by the names of its links and joints in the URDF."""

    max_command: Annotated[Positive, NumberOf(Thruster, "max_command"), Only("mapping", ("linear", "glf"))] = 1.0
    """Unit of commands: `glf` divides a command by it, `linear` divides by it twice, as VRX does."""
    propeller: str
    """Link at whose origin the thrust acts, along its x axis."""
    joint: str | None = None
    """Joint that steers it; without one it is fixed."""
    max_angle: Annotated[float, NumberOf(Thruster, "max_angle"), Only("joint")] = 1.5707963267948966
    servo: Annotated[ServoConfig, Only("joint")] = ServoConfig(kp=300.0, kd=20.0, effort=10.0, velocity=10.0)
    """Servo that steers the thruster."""


class RudderEntry(Config):
    """A rudder or a keel: a wing in the water with the normal force of the MMG standard method."""

    joint: str | None = None
    """Joint that turns it, with its axis up. Without a joint it is a keel, along x of the base link."""
    area: Annotated[Positive, NumberOf(Thruster, "area")]
    """Area of the blade [m2]."""
    aspect_ratio: Positive
    """Span over mean chord."""
    center: Vec3 = ZERO
    """Centre of pressure in the frame of the joint's child link, or of the base link [m]."""
    propeller: Name | None = None
    """Thruster whose race it is in."""
    propeller_diameter: Annotated[Positive | None, Only("propeller", required=True)] = None
    """Diameter of that thruster's propeller [m]."""
    race_share: Annotated[float, NumberOf(Thruster, "race_share"), Only("propeller")] = 1.0
    max_angle: Annotated[float, NumberOf(Thruster, "max_angle")] = 0.6109
    servo: ServoConfig = ServoConfig(kp=300.0, kd=20.0, effort=10.0, velocity=0.6)
    """Servo that turns the rudder."""


class SailEntry(Config):
    """A sail whose boom turns on a joint: lift and drag over the angle at which the apparent wind meets its chord."""

    joint: str
    """Joint of the boom, with its axis up. At angle 0 the sail runs aft from it, along -x of its child link."""
    area: Annotated[Positive, NumberOf(Thruster, "area")]
    """Area of the sail [m2]."""
    center: Vec3 = ZERO
    """Centre of effort in the frame of the joint's child link [m]."""
    aspect_ratio: Positive = 4.0
    """Aspect ratio, the square of the height over the area. The coefficients follow from it unless they are given."""
    coefficients: Annotated[tuple[_SailPoint, ...], Field(max_length=361)] = ()
    """Coefficients over that angle from 0 to 180 [degrees], interpolated linearly, the same on both sides. Lift is
    across the apparent wind. At 180 the wind meets the leech."""
    sheet: Switch = True
    """Whether the command is the angle up to which a sheet lets the boom out to leeward, on either side. Otherwise the
    boom turns to the commanded angle."""
    max_angle: Annotated[float, NumberOf(Thruster, "max_angle")] = 1.5707963267948966
    servo: ServoConfig = ServoConfig(kp=3000.0, kd=200.0, effort=1000.0, velocity=1.0)
    """Servo that holds the boom."""

    def _faults(self) -> Faults:
        return column_faults("coefficients", [row[0] for row in self.coefficients], "an angle", ends=(0.0, 180.0))


_Span = Annotated[Number, Field(ge=-2000, le=2000)]


_Spans = Annotated[
    tuple[_Span, _Span], BeforeValidator(lambda value: (value, value) if isinstance(value, int | float) else value)
]


class ChannelEntry(Config):
    """The command that an autopilot's channel sets."""

    thruster: str
    """Name of the command: a thruster, or a part that turns with `_angle` after its name."""
    trim: Annotated[Number, Field(ge=500, le=2500)] | None = None
    """Pulse of a zero command [us]; by default 1500, for a sail 1000."""
    span: _Spans | None = None
    """Differences of the shortest and longest pulses from the trim [us]; one number sets both. A negative number
    reverses the direction. By default 400, for a sail 1000."""
    dead_band: Annotated[Number, Field(ge=0, le=500)] = 0.0
    """Largest difference from the trim that still gives a zero command [us]."""

    def _faults(self) -> Faults:
        short, long = self.span or (1000.0, 1000.0)
        if short * long <= 0.0 or min(abs(short), abs(long)) <= self.dead_band:
            text = f"both must be above the dead band, {self.dead_band:g}, or both below -{self.dead_band:g}"
            yield ("span",), f"{text}, got {short:g} and {long:g}"


_Channel = Annotated[
    ChannelEntry, BeforeValidator(lambda value: {"thruster": value} if isinstance(value, str) else value)
]


class BatteryEntry(Config):
    """The battery of a boat's propellers."""

    capacity: Annotated[float, NumberOf(Battery, "capacity")]
    voltage: Annotated[tuple[_VoltagePoint, ...], NumberOf(Battery, "voltage"), Field(min_length=2, max_length=100)]
    resistance: Annotated[float, NumberOf(Battery, "resistance")] = 0.0

    def _faults(self) -> Faults:
        return column_faults("voltage", [share for share, _ in self.voltage], "a share", ends=(0.0, 1.0))


class _Partial(Config):
    """Fields any of which may be left out."""

    @classmethod
    def __pydantic_init_subclass__(cls, **_: object) -> None:
        """Make None the default of every field: it is not given."""
        for field in cls.model_fields.values():
            field.default = None

    @property
    def given_fields(self) -> dict[str, object]:
        """The fields that it gives."""
        return {key: getattr(self, key) for key in self.model_fields_set}


class HydrodynamicsEntry(_Partial, HydrodynamicsConfig):
    """Known values of a hull. The others come from the URDF's dynamics plugin, or are derived from its shapes."""


class DriveEntry(_Partial):
    """Limits of all thrusters of a robot."""

    max_force_forward: Annotated[float, NumberOf(Thruster, "max_forward")]
    max_force_reverse: Annotated[float, NumberOf(Thruster, "max_reverse")]
    max_angle: Annotated[float, NumberOf(Thruster, "max_angle")]


class ProfileEntry(Config):
    """Differences of a robot in worlds of a profile other than `vrx`."""

    arguments: Arguments = Field(default_factory=dict)
    """Arguments of the xacro in this profile, unless a layout, a suite or a fleet gives them."""
    hydrodynamics: HydrodynamicsEntry = HydrodynamicsEntry.model_validate({})
    """Lift, drag and added mass in this profile."""
    thrusters: DriveEntry = DriveEntry.model_validate({})
    """Limits of the thrusters in this profile."""
    contact: ContactConfig | None = None
    """How its hull yields in this profile."""
    shot_impulse: NonNegative | None = None
    """Impulse of a shot of its ball shooters [N s] in this profile."""


class Profiles(Config):
    """Profiles of physics in which a robot's values may differ."""

    vrx3: ProfileEntry = ProfileEntry()
    """Differences in worlds of profile vrx3."""


def _file_part(path: str) -> str:
    """The path before the name of a model."""
    return path.partition("#")[0]


_Description = Annotated[
    str,
    demand(lambda urdf: _file_part(urdf).lower().endswith(_DESCRIPTIONS), "expected a .urdf, .xacro or .sdf, got {}"),
    loads(lambda urdf, near: contained_file(_file_part(urdf), near), "urdf_folder"),
]


class RobotConfig(InFolder):
    """A kind of boat."""

    folder_keys: ClassVar = {"urdf_folder": "urdf"}
    urdf_folder: Folder = None
    description: str = ""
    """Description in `vrx-mj list robots --verbose`."""
    urdf: _Description
    """The `.urdf`, `.xacro` or `.sdf`, relative to this file; `FILE#NAME` is the model of this name in a world."""
    arguments: Arguments = Field(default_factory=dict)
    """Arguments of the xacro."""
    layouts: dict[Name, Arguments] = Field(default_factory=dict)
    """Layouts of thrusters by name, as xacro arguments."""
    suites: dict[Name, Arguments] = Field(default_factory=dict)
    """Sets of sensors by name, as xacro arguments. If there are any, `vrx` and `none` must be among them."""
    vrx_parts: Switch = False
    """Whether it accepts VRX's thruster and component files."""
    hydrodynamics: HydrodynamicsEntry = HydrodynamicsEntry.model_validate({})
    """Lift, drag and added mass."""
    contact: ContactConfig = ContactConfig()
    """How its hull yields in a contact."""
    thrusters: dict[Name, ThrusterEntry] = Field(default_factory=dict)
    """Thrusters by the names of their commands; `{}` for a boat without any, which drifts."""
    rudders: dict[Name, RudderEntry] = Field(default_factory=dict)
    """Rudders and keels by the names of their commands."""
    sails: dict[Name, SailEntry] = Field(default_factory=dict)
    """Sails by the names of their commands."""
    propellers: dict[Name, PropellerConfig] = Field(default_factory=dict)
    """Measured propellers by the names of their thrusters, in worlds of profile `marine`. In a robot with layouts,
    propellers of thrusters that a boat does not have are ignored."""
    wind: Annotated[Vec3 | None, NumberOf(Hull, "wind")] = None
    """Wind coefficients along x and y and about z [N s2/m2, N s2/m], in worlds that list none for this boat."""
    windage: WindageConfig | None = None
    """Areas and coefficients in worlds of profile `marine`, instead of `wind`."""
    hull: MarineHullConfig | None = None
    """Hull in worlds of profile `marine`. Keys that it does not give have the values of `hydrodynamics`."""
    autopilot: dict[_ChannelNumber, _Channel] = Field(default_factory=dict)
    """Commands of an autopilot's channels, 1 to 32; by default channels 1 and 3 are two engines, or rudder and
    engine."""
    battery: BatteryEntry | None = None
    """Battery, whose voltage and current autopilots receive."""
    sensors: tuple[SensorConfig, ...] = ()
    """Sensors in addition to those of the URDF, with poses in their link's frame."""
    profiles: Profiles = Profiles()
    """Differences in worlds of other profiles."""

    def _faults(self) -> Faults:
        for kind, blades in (("rudder", self.rudders), ("sail", self.sails)):
            for name in blades:
                if name in self.thrusters:
                    yield (f"{kind}s", name), "duplicate name: it is the name of a thruster"
                if name in self.propellers:
                    yield ("propellers", name), f"not allowed for a {kind}; remove it"
        for name in self.rudders.keys() & self.sails.keys():
            yield ("sails", name), "duplicate name: it is the name of a rudder"
        for name, rudder in self.rudders.items():
            if rudder.propeller is not None and self.thrusters and rudder.propeller not in self.thrusters:
                error = UnknownNameError("thruster", rudder.propeller, self.thrusters)
                yield ("rudders", name, "propeller"), str(error)

    def in_profile(self, profile: str) -> ProfileEntry:
        """Differences in worlds of a profile; none in the classic one."""
        return self.profiles.vrx3 if profile == NEWER else ProfileEntry()

    def layout(self, name: str, robot: str) -> Mapping[str, str]:
        """The xacro arguments of a layout of thrusters; `robot` is what messages call this one.

        Raises:
            UnknownNameError: it has other layouts.
            VrxError: it has none.
        """
        if name in self.layouts:
            return self.layouts[name]
        if self.layouts:
            raise UnknownNameError("thruster layout", name, self.layouts)
        raise VrxError(f"not allowed for robot {robot}, whose own files place its thrusters; remove it")

    @property
    def description_file(self) -> Path:
        """The URDF, xacro or SDF, or `FILE#NAME`."""
        assert self.folder is not None, "a robot comes from a file"
        path, mark, name = self.urdf.partition("#")
        return Path(f"{contained_file(path, self.urdf_folder or self.folder)}{mark}{name}")

    @property
    def is_sdf(self) -> bool:
        """Whether its description is a model of Gazebo."""
        return _file_part(self.urdf).lower().endswith(WORLD_SUFFIXES)


def load_robot(name: str, near: Path | None = None) -> RobotConfig:
    """The kind of boat of a name, or of a path relative to the folder `near`."""
    file = referenced_file("robots", name, near).absolute()
    return _packaged_robot(file) if file.is_relative_to(root() / "assets") else _robot(file)


@lru_cache(maxsize=32)
def _packaged_robot(file: Path) -> RobotConfig:
    """A file of the package's own, which do not change while it runs."""
    return _robot(file)


def _robot(file: Path) -> RobotConfig:
    return validate(RobotConfig, _section(file), Loading())


def robot_section(name: str, near: Path | None = None) -> Section:
    """The content of a robot's YAML, with places; of a URDF, xacro or SDF without one its name alone."""
    return _section(referenced_file("robots", name, near).absolute())


def _section(file: Path) -> Section:
    if not _file_part(file.name).lower().endswith(_DESCRIPTIONS):
        return read_source("robots", file)
    beside = _beside(file)
    own = of_python({"urdf": file.name}, File(f"{YAML_OF} {file.name}", file.parent))
    return merge(own, read_source("robots", beside)) if beside else own


def _beside(file: Path) -> Path | None:
    """The YAML that goes with a description, if there is one."""
    if "#" in file.name:
        return None
    stem = next(file.name[: -len(end)] for end in _DESCRIPTIONS if file.name.lower().endswith(end))
    return next((path for path in (file.with_name(stem + end) for end in (".yaml", ".yml")) if path.is_file()), None)
